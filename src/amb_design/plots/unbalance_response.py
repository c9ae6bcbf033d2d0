"""Unbalance response: amplitudes and control currents over the speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from ..analysis.critical import CriticalSpeed
from ..analysis.stability import StabilityLimit
from ..analysis.system import Array
from ..analysis.unbalance import UnbalanceResponse, major_axis
from ..errors import ModelError
from ..spec.fields import is_number
from ..units import RPM
from .base import COLOURS, INK, canvas, halo, legend_above, mark_critical, mark_limit
from .stations import stations


def unbalance(
    result: UnbalanceResponse,
    positions: Sequence[float | str] | None = None,
    *,
    critical: Sequence[CriticalSpeed] = (),
    limit: StabilityLimit | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the amplitudes of the unbalance response over the speed.

    Parameters
    ----------
    result : UnbalanceResponse
        From `amb_design.unbalance_response`.
    positions : sequence of float or str, optional
        Places along the shaft [m], or names of disks, bearings, magnets and sensors; all of these if left out.
    critical : sequence of CriticalSpeed, optional
        The forward ones are marked.
    limit : StabilityLimit, optional
        Marks the stability limit speed and shades the speeds where the machine is unstable and the response means
        nothing.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm; largest radius of the orbit in micrometres.

    Raises
    ------
    ModelError
        If a name is not known.
    """
    with canvas(ax) as ax:
        _speed_axis(ax, result)
        ax.set_ylabel("orbit radius [µm]")
        for k, (name, x) in enumerate(_places(result, positions)):
            radius = 1e6 * major_axis(result.at(x))
            ax.plot(result.speeds / RPM, _positive(radius), color=COLOURS[k % len(COLOURS)], label=name, gid="curve")
        clearances = {m.clearance for m in result.machine.magnets if is_number(m.clearance)}
        for clearance in sorted(clearances):
            _level(ax, 1e6 * clearance, f"clearance {1e6 * clearance:.0f} µm")
        _marks(ax, critical, limit)
        legend_above(ax)
    return ax


def currents(
    result: UnbalanceResponse,
    *,
    critical: Sequence[CriticalSpeed] = (),
    limit: StabilityLimit | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the amplitudes of the control currents over the speed, with the bias current that they must stay below.

    Parameters
    ----------
    result : UnbalanceResponse
        From `amb_design.unbalance_response`.
    critical : sequence of CriticalSpeed, optional
        The forward ones are marked.
    limit : StabilityLimit, optional
        Marks the stability limit speed.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm; the larger amplitude of each magnet's two axes in ampere.

    Raises
    ------
    ModelError
        If the machine has no magnets.
    """
    magnets = result.machine.magnets
    if not magnets:
        raise ModelError(f"{result.machine.name} has no magnets, and so no control currents")
    names = [name for name, _ in stations(result.machine, ("magnets",))]
    with canvas(ax) as ax:
        _speed_axis(ax, result)
        ax.set_ylabel("control current [A]")
        for k, name in enumerate(names):
            colour = COLOURS[k % len(COLOURS)]
            ax.plot(result.speeds / RPM, _positive(result.peak_currents[:, k]), color=colour, label=name, gid="curve")
        levels: dict[float, list[str]] = {}
        for name, magnet in zip(names, magnets, strict=True):
            if is_number(magnet.bias_current):
                levels.setdefault(float(magnet.bias_current), []).append(name)
        for current, those in levels.items():
            whose = f" of {', '.join(those)}" if len(levels) > 1 else ""
            _level(ax, current, f"bias current{whose} {current:g} A")
        _marks(ax, critical, limit)
        legend_above(ax)
    return ax


def _places(result: UnbalanceResponse, positions: Sequence[float | str] | None) -> list[tuple[str, float]]:
    known = stations(result.machine)
    if positions is None:
        merged: dict[float, list[str]] = {}
        for name, x in known:
            names = merged.setdefault(round(x, 9), [])
            if not (names and name.endswith("sensor")):  # a magnet's own sensor says nothing new
                names.append(name)
        return [(", ".join(names), x) for x, names in sorted(merged.items())]
    found = []
    for wanted in positions:
        if isinstance(wanted, str):
            places = sorted({x for name, x in known if name == wanted or name.startswith(wanted + " ")})
            if not places:
                every = ", ".join(name for name, _ in known)
                raise ModelError(f"{result.machine.name} has nothing called {wanted!r}; known are {every}")
            found += [(wanted if len(places) == 1 else f"{wanted}, x = {x:.4g} m", x) for x in places]
        else:
            found.append((f"x = {wanted:.4g} m", float(wanted)))
    return found


def _speed_axis(ax: Axes, result: UnbalanceResponse) -> None:
    ax.set_yscale("log")
    ax.set_xlim(0.0, float(result.speeds[-1]) / RPM)
    ax.set_xlabel("spin speed [rpm]")


def _range(ax: Axes) -> None:
    """The five decades below the highest peak; what is smaller does not matter."""
    curves = [np.asarray(line.get_ydata(), float) for line in ax.lines if line.get_gid() in ("curve", "level")]
    values = np.concatenate([c[np.isfinite(c)] for c in curves])
    if values.size:
        ax.set_ylim(max(float(values.min()) / 2.0, 1e-5 * float(values.max())), 5.0 * float(values.max()))


def _positive(values: Array) -> Array:
    return np.asarray(np.where(values > 0.0, values, np.nan))


def _level(ax: Axes, y: float, text: str) -> None:
    ax.axhline(y, color=INK, linewidth=0.9, linestyle=(0, (6.0, 2.0)), zorder=1.5, gid="level")
    halo(
        ax.annotate(
            text,
            (1.0, y),
            xycoords=ax.get_yaxis_transform(),
            xytext=(-4.0, 2.5),
            textcoords="offset points",
            ha="right",
            fontsize="small",
            color=INK,
            zorder=5,
        )
    )


def _marks(ax: Axes, critical: Sequence[CriticalSpeed], limit: StabilityLimit | None) -> None:
    _range(ax)
    if critical:
        mark_critical(ax, [c for c in critical if c.speed_rpm <= ax.get_xlim()[1]])
    if limit is not None:
        mark_limit(ax, limit, text_below=True)
