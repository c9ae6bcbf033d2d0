"""The control loops in the frequency domain: sensitivity with the zones of ISO 14839-3, and the open loop."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, MultipleLocator, NullFormatter

from ..analysis.sensitivity import ZONES, Sensitivity, SensitivityOverSpeed, zone
from ..analysis.stability import StabilityLimit
from ..analysis.system import Array
from ..units import RPM
from .base import (
    COLOURS,
    INK,
    LIGHT,
    RED,
    canvas,
    hertz,
    legend_above,
    mark_limit,
    minus,
    note,
    page,
    shade,
    unstable_windows,
)
from .stations import stations

HZ = 2.0 * math.pi

ZONE_COLOURS = {"A": "#eef5ee", "B": "#fff6d9", "C": "#fde6cf", "D": "#f9d6d5"}


def sensitivity(result: Sensitivity, *, decibels: bool = True, ax: Axes | None = None) -> Axes:
    """Draw the sensitivity of each control loop over the frequency, with the zones of ISO 14839-3.

    Parameters
    ----------
    result : Sensitivity
        From `amb_design.sensitivity`.
    decibels : bool
        False gives a linear ordinate.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Frequencies in Hz; one curve for loops that are alike, their peaks marked and told in the legend. Where the closed
        loop is unstable the drawing says so, for then the curves mean nothing.
    """
    scale = in_decibels if decibels else np.asarray
    with canvas(ax) as ax:
        frequency_axis(ax, result)
        ax.set_ylabel("sensitivity |S| [dB]" if decibels else "sensitivity |S|")
        ax.plot(_hz(result), 0.0 * result.frequencies + scale(np.array(1.0)), color=INK, linewidth=0.6)
        for k, group in enumerate(_alike(result.sensitivity)):
            peak = max((result.peaks[j] for j in group), key=lambda p: p.value)
            colour = COLOURS[k % len(COLOURS)]
            size = f"{scale(np.array(peak.value)):.1f} dB" if decibels else f"{peak.value:.2f}"
            name = f"{_names(result, group)}: {minus(size)} at {hertz(peak.frequency)}, zone {peak.zone}"
            y = scale(np.abs(result.sensitivity[:, group[0]]))
            ax.plot(_hz(result), y, color=colour, label=name, gid="curve")
            ax.plot(
                [peak.frequency / HZ],
                [scale(np.array(peak.value))],
                "o",
                color=colour,
                markeredgecolor="white",
                zorder=4,
                gid="peak",
            )
        highest = max(result.worst.value, ZONES[-1][1])
        if decibels:
            deepest = float(in_decibels(np.abs(result.sensitivity)).min())
            ax.set_ylim(min(-10.0, max(-30.0, deepest - 2.0)), float(in_decibels(np.array(highest))) + 4.0)
        else:
            ax.set_ylim(0.0, 1.15 * highest)
        if decibels:
            ax.yaxis.set_major_locator(MultipleLocator(10.0))
        zones(ax, decibels)
        if not result.stable:
            note(ax, f"unstable at {result.speed / RPM:.0f} rpm: these curves mean nothing", RED)
        legend_above(ax)
    return ax


def sensitivity_over_speed(
    result: SensitivityOverSpeed, *, limit: StabilityLimit | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the peak sensitivity of each control loop over the spin speed, with the zones of ISO 14839-3.

    Parameters
    ----------
    result : SensitivityOverSpeed
        From `amb_design.sensitivity_over_speed`.
    limit : StabilityLimit, optional
        Marks the stability limit speed; where the machine is unstable, the values mean nothing.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm; peaks as ratios, on a logarithmic axis if one exceeds 20.
    """
    with canvas(ax) as ax:
        ax.set_xlim(float(result.speeds[0]) / RPM, float(result.speeds[-1]) / RPM)
        ax.set_xlabel("spin speed [rpm]")
        ax.set_ylabel("peak sensitivity")
        for k, group in enumerate(_alike(result.peaks)):
            worst = float(result.peaks[:, group].max())
            ax.plot(
                result.speeds / RPM,
                result.peaks[:, group[0]],
                marker=".",
                color=COLOURS[k % len(COLOURS)],
                label=f"{_names(result, group)}: up to {worst:.2f}, zone {zone(worst)}",
                gid="curve",
            )
        if result.worst > 20.0:
            ax.set_yscale("log")
            ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            ax.yaxis.set_minor_formatter(NullFormatter())
            ax.set_ylim(1.0, 1.5 * result.worst)
        else:
            ax.set_ylim(0.0, max(1.2 * ZONES[-1][1], 1.1 * result.worst))
        zones(ax, decibels=False)
        if limit is not None:
            mark_limit(ax, limit, windows=False, text_below=True)
            _veil(ax, limit)
        legend_above(ax)
    return ax


def open_loop(result: Sensitivity, *, axes: Sequence[Axes] | None = None) -> tuple[Axes, Axes]:
    """Draw the Bode diagram of each open loop, all others closed.

    Parameters
    ----------
    result : Sensitivity
        From `amb_design.sensitivity`.
    axes : sequence of two Axes, optional
        For magnitude and phase; a new figure if left out.

    Returns
    -------
    tuple of Axes
        Magnitude in dB and phase in degrees, over Hz.
    """
    if axes is not None:
        upper, lower = axes
        _bode(result, upper, lower)
        return upper, lower
    with page(height=4.4) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _bode(result, upper, lower)
        upper.set_xlabel("")
    return upper, lower


def _bode(result: Sensitivity, upper: Axes, lower: Axes) -> None:
    groups = _alike(result.open_loop)
    for k, group in enumerate(groups):
        values = result.open_loop[:, group[0]]
        colour = COLOURS[k % len(COLOURS)]
        upper.plot(_hz(result), in_decibels(np.abs(values)), color=colour, label=_names(result, group), gid="curve")
        lower.plot(*_unbroken(_hz(result), np.degrees(np.angle(values))), color=colour, gid="curve")
    upper.axhline(0.0, color=INK, linewidth=0.7, zorder=1.0)
    upper.set_ylabel("open loop |L| [dB]")
    lower.set_ylabel("phase [deg]")
    lower.set_ylim(-190.0, 190.0)
    lower.yaxis.set_major_locator(MultipleLocator(90.0))
    for ax in (upper, lower):
        frequency_axis(ax, result)
    legend_above(upper)


def _unbroken(x: Array, phase: Array) -> tuple[Array, Array]:
    """A gap wherever the phase jumps from one end of its range to the other."""
    jumps = np.flatnonzero(np.abs(np.diff(phase)) > 180.0) + 1
    return np.insert(x, jumps, np.nan), np.insert(phase, jumps, np.nan)


def frequency_axis(ax: Axes, result: Sensitivity) -> None:
    """Give axes the frequencies of a result, in Hz and logarithmic; a frequency of zero is left out.

    Parameters
    ----------
    ax : Axes
    result : Sensitivity
    """
    ax.set_xscale("log")
    positive = _hz(result)[result.frequencies > 0.0]
    ax.set_xlim(float(positive[0]), float(positive[-1]))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    ax.set_xlabel("frequency [Hz]")


def zones(ax: Axes, decibels: bool) -> None:
    """Bands of the zones, named at the right edge.

    Parameters
    ----------
    ax : Axes
        With its final limits.
    decibels : bool
        Whether the ordinate is in decibels.
    """
    bounds = [0.0, *(limit for _, limit in ZONES), 1e6]
    low, high = ax.get_ylim()
    for name, start, stop in zip("ABCD", bounds, bounds[1:], strict=False):
        y = [float(in_decibels(np.array(max(b, 1e-9)))) if decibels else b for b in (start, stop)]
        shade(ax, f"zone {name}", None, (y[0], y[1]), ZONE_COLOURS[name])
        bottom, top = max(y[0], low), min(y[1], high)
        logarithmic = ax.get_yscale() == "log"
        place = math.sqrt(max(bottom, 1e-9) * top) if logarithmic else (bottom + top) / 2.0
        if name == "A":  # close to its upper bound, where it matters
            place = y[1] * 0.88 if logarithmic else y[1] - 0.05 * (high - low)
        ax.annotate(
            name,
            (1.0, place),
            xycoords=ax.get_yaxis_transform(),
            xytext=(4.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize="small",
            color=INK,
            annotation_clip=False,
            gid=f"zone {name}",
        )
        if name != "D":
            ax.axhline(y[1], color=LIGHT, linewidth=0.7, zorder=0.2)


def _veil(ax: Axes, limit: StabilityLimit) -> None:
    """Fade what lies at speeds of instability."""
    for start, stop in unstable_windows(limit):
        veil = Rectangle((start / RPM, 0.0), (stop - start) / RPM, 1.0, transform=ax.get_xaxis_transform())
        veil.set(facecolor="white", alpha=0.65, linewidth=0.0, zorder=3, gid="veil")
        ax.add_artist(veil)


def _alike(curves: Array) -> list[list[int]]:
    """Columns that agree drawn as one, such as the two axes of a magnet in an isotropic machine."""
    groups: list[list[int]] = []
    size = np.abs(curves)
    for j in range(curves.shape[1]):
        for group in groups:
            if np.allclose(size[:, j], size[:, group[0]], rtol=1e-4, atol=0.0):
                group.append(j)
                break
        else:
            groups.append([j])
    return groups


def _names(result: Sensitivity | SensitivityOverSpeed, group: Sequence[int]) -> str:
    names = [name for name, _ in stations(result.machine, ("magnets",))]
    return _joined([_named(loop, names) for loop in result.loops], group)


def _named(loop: str, names: Sequence[str]) -> str:
    """``left magnet y`` for ``magnets[0] y``."""
    found = re.match(r"magnets\[(\d+)\](.*)$", loop)
    return names[int(found[1])] + found[2] if found else loop


def _joined(loops: Sequence[str], group: Sequence[int]) -> str:
    """``left magnet y, z`` for the loops of a group."""
    axes: dict[str, list[str]] = {}
    for j in group:
        name, _, axis = loops[j].rpartition(" ") if loops[j][-2:] in (" y", " z") else (loops[j], "", "")
        axes.setdefault(name, []).append(axis)
    return ", ".join(f"{name} {', '.join(found)}".strip() for name, found in axes.items())


def _hz(result: Sensitivity) -> Array:
    return np.asarray(result.frequencies / HZ)


def in_decibels(values: Array) -> Array:
    """Magnitudes in decibels.

    Parameters
    ----------
    values : ndarray
        Not negative; those below 1e-12 count as that, -240 dB.

    Returns
    -------
    ndarray of the same shape
    """
    return np.asarray(20.0 * np.log10(np.maximum(values, 1e-12)))
