"""Designs: how the search went, what limits the speed, and compromises."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from ..analysis.campbell import Campbell
from ..analysis.stability import FOUND, StabilityLimit
from ..optimise.answers import ParetoPoint
from ..optimise.design import Design
from ..optimise.start import INFEASIBLE
from ..spec.quantities import QUANTITIES
from ..units import RPM, unit_shown
from .base import COLOURS, FAINT, GREY, INK, canvas, legend_above, note
from .damping import real_part


def real_parts(diagrams: Mapping[str, Campbell], limits: Mapping[str, StabilityLimit], ax: Axes | None = None) -> Axes:
    """Draw the largest real part of several machines, such as before and after.

    Parameters
    ----------
    diagrams : mapping of str to Campbell
    limits : mapping of str to StabilityLimit
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
    """
    with canvas(ax) as ax:
        for name, diagram in diagrams.items():
            limit = limits[name]
            text = f"SLS {limit.speed_rpm:.0f} rpm" if limit.status == FOUND else limit.status
            real_part(diagram, label=f"{name}: {text}", ax=ax)
            if limit.status == FOUND:
                colour = next(line for line in reversed(ax.lines) if line.get_gid() == "curve").get_color()
                ax.plot([limit.speed_rpm], [0.0], "o", color=colour, markersize=5.5, zorder=4)
    return ax


def convergence(design: Design, ax: Axes | None = None) -> Axes:
    """Draw the objective of each start over the eigendecompositions spent, as far as the limits were held.

    Parameters
    ----------
    design : Design
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Points within the limits (to 1e-5) carry lines, which show the best so far; the others are faint dots.
    """
    kind = design.problem.objective.kind
    speed = design.problem.seeks_speed
    unit, scale = ("rpm", RPM) if speed else unit_shown(kind.unit)
    with canvas(ax) as ax:
        ax.set_xlabel("eigendecompositions in this start")
        name = "speed within all limits" if speed else kind.name.replace("_", " ")
        ax.set_ylabel(f"{name} [{unit}]" if unit else name)
        shown = 0
        for outcome in sorted(design.outcomes, key=lambda o: o.index):
            history = np.array(outcome.history).reshape(-1, 3)
            if outcome.status == INFEASIBLE or not len(history):
                continue
            held = history[:, 2] <= 1e-5
            colour = COLOURS[shown % len(COLOURS)]
            shown += 1
            ax.plot(history[~held, 0], history[~held, 1] / scale, ".", color=colour, alpha=0.25, markersize=4.0)
            if held.any():
                best = (np.minimum if kind.upper else np.maximum).accumulate(history[held, 1])
                ax.plot(
                    history[held, 0], best / scale, ".-", color=colour, linewidth=1.2, label=f"start {outcome.index}"
                )
        left_out = sum(o.status == INFEASIBLE for o in design.outcomes)
        if left_out:
            note(ax, f"{left_out} of {len(design.outcomes)} starts found no point within the limits", GREY, below=True)
        if design.verified:
            ax.axhline(design.objective / scale, color=INK, linewidth=0.8, linestyle=(0, (4.0, 2.0)), zorder=0.5)
        ax.set_xlim(left=0.0)
        legend_above(ax)
    return ax


def limit_sensitivities(design: Design, count: int = 12, ax: Axes | None = None) -> Axes:
    """Draw what moves the stability limit most.

    Parameters
    ----------
    design : Design
    count : int
        Number of bars.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Per cent of speed for one per cent of each number, for angles for a hundredth of a radian.
    """
    chosen = design.sensitivities[:count][::-1]
    values = np.array([s for _, s in chosen])
    with canvas(ax, height=0.9 + 0.24 * len(chosen)) as ax:
        ax.barh(range(len(chosen)), values, color=[COLOURS[1] if v < 0.0 else COLOURS[0] for v in values], height=0.7)
        ax.set_yticks(range(len(chosen)), [path for path, _ in chosen])
        ax.grid(visible=False, axis="y")
        ax.axvline(0.0, color=INK, linewidth=0.8)
        ax.set_xlabel("change of the stability limit for +1 % [%]")
    return ax


def pareto(design: Design, quantity: str, points: Sequence[ParetoPoint], ax: Axes | None = None) -> Axes:
    """Draw the objective over the limit of a quantity.

    Parameters
    ----------
    design : Design
    quantity : str
    points : sequence of ParetoPoint
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Limits without a verified design are marked on the axis.
    """
    kind = design.problem.objective.kind
    speed = design.problem.seeks_speed
    unit, scale = ("rpm", RPM) if speed else unit_shown(kind.unit)
    x_unit, x_scale = unit_shown(QUANTITIES[quantity].unit)
    found = [p for p in points if np.isfinite(p.objective)]
    missing = [p for p in points if not np.isfinite(p.objective)]
    with canvas(ax) as ax:
        x, y = [p.bound / x_scale for p in found], [p.objective / scale for p in found]
        ax.plot(x, y, "o-", markersize=4.5)
        if missing:
            low = ax.get_ylim()[0]
            ax.plot([p.bound / x_scale for p in missing], [low] * len(missing), "x", color=FAINT, clip_on=False)
            note(ax, "x: no verified design", GREY, below=True)
        word = "at most" if QUANTITIES[quantity].upper else "at least"
        ax.set_xlabel(f"{quantity.replace('_', ' ')}, {word}" + (f" [{x_unit}]" if x_unit else ""))
        name = "speed within all limits" if speed else kind.name.replace("_", " ")
        ax.set_ylabel(f"{name} [{unit}]" if unit else name)
    return ax
