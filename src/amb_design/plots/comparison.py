"""Designs side by side, or in the same axes: what a comparison has to show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from ..analysis.campbell import Campbell
from ..analysis.disturbance import Response
from ..analysis.modes import whirls
from ..analysis.sensitivity import ZONES, Sensitivity
from ..analysis.stability import StabilityLimit
from ..comparison.assessment import Assessment, Whirl
from ..comparison.table import shown
from ..units import RPM
from .base import COLOURS, FAINT, INK, WIDTH, canvas, hertz, legend_above, note, page
from .campbell_diagram import campbell, colour_bar, frequency_range, legend_handles
from .campbell_diagram import drawn as modes_drawn
from .loops import HZ, frequency_axis, in_decibels, zones

PERIODS = 25
"""Time histories show at most so many periods of their largest whirl."""

POINTS = 3000


def campbells(diagrams: Mapping[str, Campbell], limits: Mapping[str, StabilityLimit]) -> tuple[Axes, ...]:
    """Draw the Campbell diagrams of several designs beside each other, with common axes.

    Parameters
    ----------
    diagrams : mapping of str to Campbell
    limits : mapping of str to StabilityLimit

    Returns
    -------
    tuple of Axes
        One a design.
    """
    columns = min(len(diagrams), 3)
    rows = math.ceil(len(diagrams) / columns)
    highest = max(frequency_range(d, limits[name]) for name, d in diagrams.items())
    with page(height=0.5 + 3.3 * rows, width=max(WIDTH, 0.6 + 3.6 * columns)) as figure:
        drawn: list[Axes] = []
        handles: dict[str, Artist] = {}
        for k, (name, diagram) in enumerate(diagrams.items()):
            ax = figure.add_subplot(rows, columns, k + 1)
            campbell(diagram, limit=limits[name], highest=highest, key=False, ax=ax)
            ax.set_title(name, fontweight="bold")
            ax.xaxis.set_major_locator(MaxNLocator(5))
            meant = legend_handles(diagram, modes_drawn(diagram, highest))
            handles |= {str(h.get_label()): h for h in meant}
            if k % columns:
                ax.set_ylabel("")
            drawn.append(ax)
        figure.legend(handles=list(handles.values()), loc="outside upper left", ncols=3 if columns == 1 else 6)
        colour_bar(drawn)
    return tuple(drawn)


def sensitivities(results: Sequence[Mapping[str, Sensitivity]]) -> tuple[Axes, ...]:
    """Draw the largest sensitivity of all loops over the frequency, one curve a design, with the zones of ISO 14839-3.

    Parameters
    ----------
    results : sequence of mapping of str to Sensitivity
        For each speed, one panel.

    Returns
    -------
    tuple of Axes
        One a speed.
    """
    with page(height=0.7 + 2.3 * len(results)) as figure:
        panels = figure.subplots(len(results), 1, sharex=True, squeeze=False)[:, 0]
        for ax, found in zip(panels, results, strict=True):
            worst = ZONES[-1][1]
            for k, (name, s) in enumerate(found.items()):
                peak = s.worst
                worst = max(worst, peak.value)
                label = f"{name}: {peak.value:.2f} at {hertz(peak.frequency)}, zone {peak.zone}"
                size = in_decibels(np.abs(s.sensitivity).max(axis=1))
                colour = COLOURS[k % len(COLOURS)]
                ax.plot(s.frequencies / HZ, size, color=colour, linewidth=1.2, label=label, gid="curve")
                ax.plot([peak.frequency / HZ], [in_decibels(np.array(peak.value))], "o", color=colour, zorder=4)
            widest = min(found.values(), key=lambda s: float(s.frequencies[s.frequencies > 0.0][0]))
            frequency_axis(ax, widest)
            ax.set_xlim(right=max(float(s.frequencies[-1]) for s in found.values()) / HZ)
            ax.axhline(0.0, color=INK, linewidth=0.6)
            ax.set_ylim(-20.0, float(in_decibels(np.array(worst))) + 4.0)
            ax.set_ylabel("largest |S| [dB]")
            zones(ax, decibels=True)
            note(ax, f"{next(iter(found.values())).speed / RPM:.0f} rpm")
            legend_above(ax)
        for ax in panels[:-1]:
            ax.set_xlabel("")
    return tuple(panels)


def whirls_compared(designs: Mapping[str, Whirl]) -> tuple[Axes, Axes]:
    """Draw the largest orbit radius and control current under the residual unbalances over the speed.

    Parameters
    ----------
    designs : mapping of str to Whirl

    Returns
    -------
    tuple of Axes
        Radius of magnets and disks in micrometres, current in ampere; the largest over all patterns, speeds in rpm.
    """
    with page(height=4.4) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        for k, (name, whirl) in enumerate(designs.items()):
            first = next(iter(whirl.responses.values()))
            radius = np.max([whirl.radii(r) for r in whirl.responses.values()], axis=0)
            current = np.max([whirl.currents(r) for r in whirl.responses.values()], axis=0)
            colour, speeds = COLOURS[k % len(COLOURS)], first.speeds / RPM
            upper.plot(speeds, 1e6 * radius, color=colour, label=name, gid="curve")
            lower.plot(speeds, np.where(current > 0.0, current, np.nan), color=colour, gid="curve")
            upper.set_xlim(0.0, float(speeds[-1]))
        upper.set_ylabel("largest orbit radius [µm]")
        lower.set_ylabel("largest control current [A]")
        lower.set_xlabel("spin speed [rpm]")
        for ax in (upper, lower):
            largest = max((float(np.nanmax(line.get_ydata())) for line in ax.lines), default=1.0)
            ax.set_yscale("log")
            ax.set_ylim(1e-4 * largest, 3.0 * largest)  # what is smaller does not matter
        legend_above(upper)
    return upper, lower


def responses(found: Mapping[str, Response], direction: float = 0.0) -> tuple[Axes, Axes]:
    """Draw displacement and control current after a disturbance, one curve a design.

    Parameters
    ----------
    found : mapping of str to Response
    direction : float
        Of the disturbance, from y towards z [rad]; displacements are drawn along it.

    Returns
    -------
    tuple of Axes
        Displacement in micrometres of the place that moves most in any design; current in ampere of the axis of each
        design that carries most. Times in milliseconds, until whirling has died away or has become a band.
    """
    largest = max(found.values(), key=lambda r: r.peak)
    place = largest.peak_place
    end = max(_window(r) for r in found.values())
    times = np.linspace(0.0, end, POINTS)
    along = np.array([math.cos(direction), math.sin(direction)])
    with page(height=4.4) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        for k, (name, r) in enumerate(found.items()):
            colour = COLOURS[k % len(COLOURS)]
            moved = r.displacements(times)[:, r.watched.places.index(place)] @ along
            label = f"{name}: peak {shown(r.peak, 'm')}, settled after {shown(r.settling_time, 's')}"
            upper.plot(1e3 * times, 1e6 * moved, color=colour, label=label, linewidth=1.2, gid="curve")
            driven = r.axis_currents(times)
            if driven.size:
                most = int(np.abs(driven).max(axis=0).argmax())
                lower.plot(1e3 * times, driven[:, most], color=colour, linewidth=1.2, gid="curve")
        upper.set_ylabel(f"{place} [µm]")
        lower.set_ylabel("control current [A]")
        lower.set_xlabel(f"time [ms], at {largest.speed / RPM:.0f} rpm")
        lower.set_xlim(0.0, 1e3 * end)
        for ax in (upper, lower):
            ax.axhline(0.0, color=INK, linewidth=0.6, zorder=1.0)
        legend_above(upper)
    return upper, lower


def _window(r: Response) -> float:
    """How long a history is worth drawing [s]."""
    last = r.history.pieces[-1]
    moving = whirls(last.exponents)
    if not moving.any():
        return max(1.2 * r.settling_time, 1e-6)
    size = np.where(moving, np.abs(r.watched.split(last.coefficients)[0]).max(axis=0), 0.0)
    period = 2.0 * math.pi / abs(float(last.exponents[int(size.argmax())].imag))
    return last.start + min(max(1.2 * (r.ringing_time - last.start), 4.0 * period), PERIODS * period)


def corners(designs: Mapping[str, Assessment], ax: Axes | None = None) -> Axes:
    """Draw the stability limits at all corners of the tolerances.

    Parameters
    ----------
    designs : mapping of str to Assessment
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        A row a design: a dot for each corner, a ring for the machine as drawn. Speeds in rpm; those that reach the end of the
        search lie at it.
    """
    names = list(designs)[::-1]
    with canvas(ax, height=1.1 + 0.42 * len(names)) as ax:
        for row, name in enumerate(names):
            a, colour = designs[name], COLOURS[list(designs).index(name) % len(COLOURS)]
            found = np.array([c.stable_up_to for c in a.corners]) / RPM
            ax.plot([found.min(), found.max()], [row, row], color=colour, linewidth=1.0, zorder=1.5)
            ax.plot(found, np.full(len(found), row), "o", color=colour, markersize=5.0, alpha=0.55, gid="corner")
            first = "as drawn" if row == 0 else "_"
            ring = {"markersize": 9.0, "markerfacecolor": "none", "color": INK, "linestyle": "none", "gid": "nominal"}
            ax.plot([a.stable_up_to / RPM], [row], "o", label=first, **ring)  # type: ignore[arg-type]
        end = next(iter(designs.values())).end / RPM
        dashes = {"color": FAINT, "linewidth": 0.9, "linestyle": (0, (4.0, 2.0)), "zorder": 0.5}
        ax.axvline(end, label=f"operating range up to {end:.0f} rpm", **dashes)  # type: ignore[arg-type]
        legend_above(ax)
        ax.set_yticks(range(len(names)), names)
        ax.set_ylim(-0.6, len(names) - 0.1)
        ax.set_xlim(left=0.0)
        ax.grid(visible=False, axis="y")
        ax.set_xlabel("stability limit speed at the corners of the tolerances [rpm]")
    return ax
