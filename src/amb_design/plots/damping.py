"""Damping over the speed: of each mode, and the margin of the whole machine."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, NullFormatter

from ..analysis.campbell import Campbell
from ..analysis.modes import WHIRL_FREQUENCY
from ..analysis.stability import FOUND, StabilityLimit
from ..analysis.system import Array
from ..units import RPM
from .base import COLOURS, DASHES, INK, RED, canvas, halo, hertz, legend_above, mark_limit, minus, note, shade
from .campbell_diagram import UNDAMPED, drawn, frequency_range

FAR = 1e7
"""Beyond every axis."""

ROUNDING = 1e-6
"""Real parts below this fraction of the highest whirl frequency are rounding errors of zero."""


def damping_ratios(
    result: Campbell,
    modes: Sequence[int] | None = None,
    *,
    limit: StabilityLimit | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the damping ratios of modes over the speed.

    Parameters
    ----------
    result : Campbell
        From `amb_design.campbell`.
    modes : sequence of int, optional
        Columns of ``result.eigenvalues``; the modes that a Campbell diagram shows, and the unstable ones, if left out.
    limit : StabilityLimit, optional
        Marks the stability limit speed.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm; damping ratios in percent, logarithmic away from zero where they span decades.
    """
    chosen = _default_modes(result) if modes is None else [int(j) for j in modes]
    zeta = np.where(result.frequencies > WHIRL_FREQUENCY, 100.0 * result.damping_ratios, np.nan)[:, chosen]
    with canvas(ax) as ax:
        ax.set_xlim(float(result.speeds[0]) / RPM, float(result.speeds[-1]) / RPM)
        ax.set_xlabel("spin speed [rpm]")
        ax.set_ylabel("damping ratio [%]")
        families = _families(result, chosen)
        named: set[str] = set()
        for k, j in enumerate(chosen):
            family, alike = families[k], [i for i, f in zip(chosen, families, strict=True) if f == families[k]]
            alike = [i for i in alike if result.whirl[i] == result.whirl[j]]
            controller = result.kind[j] == "controller"
            name = f"{hertz(result.frequencies[0, alike[0]])} at rest, {result.whirl[j]}"
            name += (" (controller)" if controller else "") + (f" ({len(alike)} modes)" if len(alike) > 1 else "")
            ax.plot(
                result.speeds / RPM,
                zeta[:, k],
                color=COLOURS[family % len(COLOURS)],
                linestyle=DASHES.get(result.whirl[j], "-"),
                linewidth=0.8 if controller else 1.5,
                label="_" if name in named else name,
                gid="curve",
            )
            named.add(name)
        _signed_scale(ax, 100.0 * UNDAMPED)
        _unstable_side(ax, below=True)
        if not np.any(np.abs(zeta) > 100.0 * UNDAMPED):
            note(ax, "undamped", below=True)
        if limit is not None:
            mark_limit(ax, limit, windows=False, note_below=True)
        legend_above(ax)
    return ax


def _families(result: Campbell, chosen: Sequence[int]) -> list[int]:
    """One number for all modes that share a frequency at rest, as the two directions of whirl mostly do."""
    at_rest = result.frequencies[0, list(chosen)]
    families, last = [0] * len(chosen), -1
    reference = -1.0
    for k in np.argsort(at_rest):
        if at_rest[k] > 1.01 * reference:
            last, reference = last + 1, float(at_rest[k])
        families[k] = last
    return families


def _default_modes(result: Campbell) -> list[int]:
    shown = drawn(result, frequency_range(result))
    unstable = np.flatnonzero(result.damping_ratios.min(axis=0) < -UNDAMPED)
    return sorted({*shown, *(int(j) for j in unstable)})


def real_part(
    result: Campbell,
    *,
    limit: StabilityLimit | None = None,
    label: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the largest real part of all whirling modes over the speed: the machine is stable where it is negative.

    Parameters
    ----------
    result : Campbell
        From `amb_design.campbell`.
    limit : StabilityLimit, optional
        Marks the stability limit speed, and where modes become unstable (filled) or stable again (hollow).
    label : str, optional
        Name in the legend; draw several machines into the same axes to compare them.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm; real parts in 1/s, logarithmic away from zero where they span decades. Real poles that become
        positive, which is a static instability, are dotted.
    """
    x = result.speeds / RPM
    noise = ROUNDING * float(result.frequencies.max())
    with canvas(ax) as ax:
        first = not any(line.get_gid() == "curve" for line in ax.lines)
        (curve,) = ax.plot(x, result.largest_real_part, linewidth=1.6, label=label or "whirling modes", gid="curve")
        colour = str(curve.get_color())
        if float(result.largest_real_pole.max()) > noise:
            still = np.where(result.largest_real_pole > -np.inf, result.largest_real_pole, np.nan)
            ax.plot(x, still, ":", color=colour, label="real poles" + (f", {label}" if label else ""), gid="curve")
        low, high = (float(x[0]), float(x[-1])) if first else ax.get_xlim()
        ax.set_xlim(min(low, float(x[0])), max(high, float(x[-1])))
        ax.set_xlabel("spin speed [rpm]")
        ax.set_ylabel("largest real part [1/s]")
        if limit is not None:
            _onsets(ax, limit, colour)
        _signed_scale(ax, noise)
        _unstable_side(ax, below=False)
        if limit is not None and limit.status != FOUND and first:
            mark_limit(ax, limit, windows=False)
        if label or len(ax.get_legend_handles_labels()[0]) > 1:
            legend_above(ax)
    return ax


def _onsets(ax: Axes, limit: StabilityLimit, colour: str) -> None:
    told = ax.get_legend_handles_labels()[1]
    for onset in limit.onsets:
        meaning = "becomes unstable" if onset.unstable else "becomes stable again"
        ax.plot(
            [onset.speed / RPM],
            [0.0],
            "o",
            color=colour,
            markersize=5.5,
            markerfacecolor=colour if onset.unstable else "white",
            markeredgecolor=colour,
            zorder=4,
            label="_" if meaning in told else meaning,
            gid="onset" if onset.unstable else "restabilisation",
        )
        told.append(meaning)
    if limit.status == FOUND:
        low, high = ax.get_xlim()
        right = (limit.speed_rpm - low) / (high - low) < 0.75
        halo(
            ax.annotate(
                f"SLS {limit.speed_rpm:.0f} rpm",
                (limit.speed_rpm, 0.0),
                xytext=(5.0, -5.0) if right else (-5.0, 5.0),  # where a rising curve leaves room
                textcoords="offset points",
                ha="left" if right else "right",
                va="top" if right else "bottom",
                fontsize="small",
                color=colour,
                zorder=5,
            )
        )


def _signed_scale(ax: Axes, noise: float) -> None:
    """Linear, or linear around zero and logarithmic outside if the curves span decades; zero is always in sight."""
    curves = [np.asarray(line.get_ydata(), float) for line in ax.lines if line.get_gid() == "curve"]
    values: Array = np.concatenate([c[np.isfinite(c)] for c in curves]) if curves else np.zeros(0)
    if not np.any(np.abs(values) > noise):
        ax.set_ylim(-1.0, 1.0)
        return
    low, high = float(values.min()), float(values.max())
    largest = max(-low, high)
    sizes = [float(np.median(np.abs(c[np.isfinite(c)]))) for c in curves if np.isfinite(c).any()]
    smallest = min((size for size in sizes if size > noise), default=largest)
    if largest > 60.0 * smallest:
        threshold = 10.0 ** math.floor(math.log10(max(smallest, 1e-5 * largest)))
        ax.set_yscale("symlog", linthresh=threshold, linscale=0.6)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: minus(f"{v:g}")))
        ax.yaxis.set_minor_formatter(NullFormatter())
        ax.set_ylim(min(1.6 * low, -threshold), max(1.6 * high, threshold))
    else:
        margin = 0.08 * (high - low + largest)
        ax.set_ylim(min(low, 0.0) - margin, max(high, 0.0) + margin)


def _unstable_side(ax: Axes, below: bool) -> None:
    if any(artist.get_gid() == "unstable side" for artist in ax.get_children()):
        return
    shade(ax, "unstable side", None, (-FAR, 0.0) if below else (0.0, FAR), "#fbe9ea")
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1.0)
    halo(
        ax.annotate(
            "unstable",
            (0.0 if below else 1.0, 0.0),  # where curves seldom run
            xycoords=ax.get_yaxis_transform(),
            xytext=(4.0, -3.0) if below else (-4.0, 3.0),
            textcoords="offset points",
            ha="left" if below else "right",
            va="top" if below else "bottom",
            fontsize="small",
            color=RED,
        )
    )
