"""Campbell diagram: whirl frequency over speed, coloured by damping."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D

from ..analysis.campbell import Campbell
from ..analysis.critical import CriticalSpeed
from ..analysis.modes import OVERDAMPED, WHIRL_FREQUENCY
from ..analysis.stability import StabilityLimit
from ..analysis.system import Array
from ..units import RPM
from .base import (
    DASHES,
    FAINT,
    INK,
    RED,
    canvas,
    figure_of,
    halo,
    legend_above,
    mark_limit,
    note,
    size_in_points,
    spread,
)

HZ = 2.0 * math.pi

LEVELS = np.array([-1.0, 0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 1.0])
"""Bounds of the classes of damping ratio; the first class is unstable."""

CLASSES = ListedColormap([RED, "#f0a04b", "#d7b64a", "#86b98a", "#4f9fb3", "#2f6ea3", "#1d2f6f"])

UNDAMPED = 1e-7
"""Damping ratios below this are rounding errors of zero."""


def campbell(
    result: Campbell,
    *,
    limit: StabilityLimit | None = None,
    highest: float | None = None,
    key: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw a Campbell diagram.

    Parameters
    ----------
    result : Campbell
        From `amb_design.campbell`.
    limit : StabilityLimit, optional
        Marks the stability limit speed and shades the speeds of instability.
    highest : float, optional
        Upper end of the frequency axis [rad/s]; a little above the synchronous line, the lowest modes and the limiting
        mode if left out. Unstable modes above it are named in a note.
    key : bool
        False leaves out legend and colour bar, for several diagrams that share them.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm, frequencies in Hz.
    """
    top = float(result.speeds[-1])
    end = frequency_range(result, limit) if highest is None else highest
    zeta = _clean(result.damping_ratios)
    undamped = not zeta.any()
    with canvas(ax, height=4.0) as ax:
        ax.set_xlim(float(result.speeds[0]) / RPM, top / RPM)
        ax.set_ylim(0.0, end / HZ)
        ax.set_xlabel("spin speed [rpm]")
        ax.set_ylabel("whirl frequency [Hz]")
        for j in drawn(result, end):
            _branch(ax, result, j, zeta[:, j], undamped)
        ax.plot([0.0, top / RPM], [0.0, top / HZ], color=FAINT, linewidth=0.9, zorder=1.5, gid="synchronous")
        _critical(ax, [c for c in result.critical if c.speed <= min(top, end)])
        if limit is not None:
            mark_limit(ax, limit)
        _above(ax, result, end)
        if key:
            legend_above(ax, legend_handles(result, drawn(result, end)))
        if key and not undamped:
            colour_bar([ax])
    return ax


def frequency_range(result: Campbell, limit: StabilityLimit | None = None) -> float:
    """Upper end of a frequency axis that shows what matters [rad/s]."""
    top = float(result.speeds[-1])
    ends = [1.1 * top]
    moderate = np.flatnonzero(result.damping_ratios.min(axis=0) < OVERDAMPED)
    rotor = [float(result.frequencies[:, j].max()) for j in moderate if result.kind[j] == "rotor"]
    ends += [1.15 * f for f in sorted(rotor)[:2]]  # a stiff rotor: all modes may lie above the synchronous line
    unstable = _clean(result.damping_ratios).min(axis=0) < 0.0
    ends += [1.1 * f for f in result.frequencies[:, unstable].max(axis=0) if f < 2.0 * top]
    if limit is not None and limit.mode is not None and limit.mode.frequency < 3.0 * top:
        ends.append(1.2 * limit.mode.frequency)
    return max(ends)


def drawn(result: Campbell, end: float) -> list[int]:
    """Modes that a diagram up to a frequency shows: all that whirl inside it and are not overdamped throughout."""
    inside = result.frequencies.min(axis=0) < end
    visible = result.damping_ratios.min(axis=0) < OVERDAMPED
    return [int(j) for j in np.flatnonzero(inside & visible)]


def _clean(zeta: Array) -> Array:
    return np.asarray(np.where(np.abs(zeta) < UNDAMPED, 0.0, zeta))


def _branch(ax: Axes, result: Campbell, j: int, zeta: Array, undamped: bool) -> None:
    paths, classes = pieces(result.speeds / RPM, result.frequencies[:, j], zeta)
    width = 0.8 if result.kind[j] == "controller" else 1.6
    lines = LineCollection(
        [path / [1.0, HZ] for path in paths],
        linewidths=[width + 0.6 if c == 0 else width for c in classes],
        linestyles=[DASHES.get(result.whirl[j], "-")],
        colors=[INK if undamped else CLASSES(c) for c in classes],
        zorder=2.0 if result.kind[j] == "controller" else 2.5,
        gid=f"mode {j}",
    )
    ax.add_collection(lines, autolim=False)


def pieces(x: Array, y: Array, zeta: Array) -> tuple[list[Array], list[int]]:
    """Cut a curve where its damping ratio passes from one class to the next; the parts and the class of each."""
    paths: list[list[tuple[float, float]]] = []
    classes: list[int] = []
    for i in range(len(x) - 1):
        if min(y[i], y[i + 1]) < WHIRL_FREQUENCY:  # no whirl: a gap
            continue
        a, b = float(zeta[i]), float(zeta[i + 1])
        cuts = [] if a == b else sorted((level - a) / (b - a) for level in LEVELS if min(a, b) < level < max(a, b))
        for t, u in zip([0.0, *cuts], [*cuts, 1.0], strict=True):
            start, stop = ((float(x[i] + s * (x[i + 1] - x[i])), float(y[i] + s * (y[i + 1] - y[i]))) for s in (t, u))
            middle = a + (t + u) / 2.0 * (b - a)
            kind = int(np.clip(np.searchsorted(LEVELS, middle, side="right") - 1, 0, len(LEVELS) - 2))
            if paths and classes[-1] == kind and paths[-1][-1] == start:
                paths[-1].append(stop)
            else:
                paths.append([start, stop])
                classes.append(kind)
    return [np.array(path) for path in paths], classes


def _critical(ax: Axes, critical: Sequence[CriticalSpeed]) -> None:
    """Markers on the synchronous line, labelled on its two sides."""
    width, height = size_in_points(ax)
    high = ax.get_ylim()[1]
    length = 30.0  # of a label
    ahead = [c.speed_rpm for c in critical if c.whirl != "backward"]
    right = max([ax.get_xlim()[1], *(x / (1.0 - length / width) for x in ahead)])  # room for the last label
    ax.set_xlim(right=right)
    along = 60.0 * (width / right) / (height / high)  # of the synchronous line, points to the right for each one up
    sides: dict[int, list[tuple[float, float, str]]] = {1: [], -1: []}
    for c in critical:
        x, y = c.speed_rpm, c.speed / HZ
        backward = c.whirl == "backward"
        ax.plot(
            [x],
            [y],
            marker="D" if c.whirl == "planar" else "o",
            markersize=5.0,
            markerfacecolor="white" if backward else INK,
            markeredgecolor=INK,
            markeredgewidth=0.9,
            linestyle="none",
            zorder=4,
            gid=f"critical {c.whirl}",
        )
        side = -1 if backward and x / right * width > length else 1
        sides[side].append((x, y, f"{x:.0f}"))
    for side, crowd in sides.items():
        marks: list[tuple[float, float, str]] = []
        wanted: list[float] = []
        last = -math.inf
        for mark in crowd:  # where they crowd, some stay without label: far away it would point at nothing
            want = mark[1] / high * height - side * 7.0
            if last + 9.0 <= want + 18.0:
                last = max(want, last + 9.0)
                marks.append(mark)
                wanted.append(want)
        for (x, y, text), place, want in zip(marks, spread(wanted, 9.0, 5.0, height - 5.0), wanted, strict=True):
            shift = place - want
            clear = 6.0 + max(side * shift, 0.0) * along  # a label that is pushed along the line stays beside it
            room = (width - x / right * width if side > 0 else x / right * width) - length
            halo(
                ax.annotate(
                    text,
                    (x, y),
                    xytext=(side * max(min(clear, room), 6.0), place - y / high * height),
                    textcoords="offset points",
                    ha="left" if side > 0 else "right",
                    va="center",
                    fontsize="small",
                    zorder=5,
                    arrowprops={"arrowstyle": "-", "linewidth": 0.5, "color": FAINT, "shrinkB": 3.0}
                    if abs(shift) > 6.0
                    else None,
                )
            )


def _above(ax: Axes, result: Campbell, end: float) -> None:
    lowest = result.frequencies.min(axis=0)
    hidden = np.flatnonzero((lowest >= end) & (_clean(result.damping_ratios).min(axis=0) < 0.0))
    if len(hidden):
        places = sorted({f"{f / HZ:.0f}" for f in lowest[hidden]}, key=float)
        groups = _grouped([float(f / HZ) for f in lowest[hidden]])
        where = ", ".join(groups if len(places) > 3 else places)
        plural = "s" if len(hidden) > 1 else ""
        note(ax, f"{len(hidden)} unstable mode{plural} above the range: {where} Hz", RED)


def _grouped(frequencies: Sequence[float]) -> list[str]:
    """Frequencies that differ by less than 1 % under one number."""
    groups: list[list[float]] = []
    for f in sorted(frequencies):
        if groups and f < 1.01 * groups[-1][0]:
            groups[-1].append(f)
        else:
            groups.append([f])
    return [f"{np.mean(g):.0f}" + (f" ({len(g)})" if len(g) > 1 else "") for g in groups]


def colour_bar(axes: Sequence[Axes]) -> None:
    """The classes of damping ratio beside one or more diagrams."""
    mappable = ScalarMappable(BoundaryNorm(LEVELS, CLASSES.N), CLASSES)
    bar = figure_of(axes[0]).colorbar(mappable, ax=list(axes), fraction=0.03, pad=0.015, spacing="uniform", aspect=28)
    bar.set_ticks([-0.5, *LEVELS[1:-1]], labels=["unstable", "0", "0.1 %", "0.3 %", "1 %", "3 %", "10 %"])
    bar.ax.tick_params(length=0.0)
    bar.ax.grid(False)
    bar.minorticks_off()
    bar.outline.set_linewidth(0.5)
    bar.set_label("damping ratio")


def legend_handles(result: Campbell, modes: Sequence[int]) -> list[Artist]:
    """What the lines and marks of a diagram mean."""
    whirls = {result.whirl[j] for j in modes if result.kind[j] == "rotor"}
    handles: list[Artist] = [
        Line2D([], [], color=INK, linestyle=dashes, linewidth=1.6, label=whirl)
        for whirl, dashes in DASHES.items()
        if whirl in whirls
    ]
    if any(result.kind[j] == "controller" for j in modes):
        handles.append(Line2D([], [], color=INK, linewidth=0.8, label="controller mode"))
    handles.append(Line2D([], [], color=FAINT, linewidth=0.9, label="synchronous (1x)"))
    for whirl, face in (("forward", INK), ("backward", "white"), ("planar", INK)):
        if any(c.whirl == whirl for c in result.critical):
            handles.append(
                Line2D(
                    [],
                    [],
                    linestyle="none",
                    marker="D" if whirl == "planar" else "o",
                    markersize=5.0,
                    markerfacecolor=face,
                    markeredgecolor=INK,
                    label=f"critical, {whirl}",
                )
            )
    return handles
