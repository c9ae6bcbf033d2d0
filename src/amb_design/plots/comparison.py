"""Designs side by side, or in the same axes: what a comparison has to show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
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


def _stroke(k: int, count: int) -> dict[str, Any]:
    """Colour and width of the k-th of several curves: the later the thinner, so that curves that agree show all their colours."""
    width = 1.9 - 0.9 * k / max(count - 1, 1)
    return {"color": COLOURS[k % len(COLOURS)], "linewidth": width, "gid": "curve"}


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
                stroke = _stroke(k, len(found))
                ax.plot(s.frequencies / HZ, size, label=label, **stroke)
                ax.plot(
                    [peak.frequency / HZ], [in_decibels(np.array(peak.value))], "o", color=stroke["color"], zorder=4
                )
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


def whirls_compared(designs: Mapping[str, Whirl]) -> tuple[Axes, ...]:
    """Draw the largest orbit radius and control current under the residual unbalances over the speed.

    Parameters
    ----------
    designs : mapping of str to Whirl

    Returns
    -------
    tuple of Axes
        Radius of magnets and disks in micrometres, and current in ampere if there is any; the largest over all patterns, speeds
        in rpm.
    """
    driven = any(whirl.largest_current for whirl in designs.values())
    with page(height=4.4 if driven else 2.6) as figure:
        panels = _panels(figure, "largest orbit radius [µm]", driven)
        for k, (name, whirl) in enumerate(designs.items()):
            first = next(iter(whirl.responses.values()))
            radius = np.max([whirl.radii(r) for r in whirl.responses.values()], axis=0)
            current = np.max([whirl.currents(r) for r in whirl.responses.values()], axis=0)
            stroke, speeds = _stroke(k, len(designs)), first.speeds / RPM
            panels[0].plot(speeds, 1e6 * radius, label=name, **stroke)
            if current.any():
                panels[-1].plot(speeds, current, **stroke)
            panels[0].set_xlim(0.0, float(speeds[-1]))
        panels[-1].set_xlabel("spin speed [rpm]")
        for ax in panels:
            largest = max(float(np.max(line.get_ydata())) for line in ax.lines)
            ax.set_yscale("log")
            ax.set_ylim(1e-4 * largest, 3.0 * largest)  # what is smaller does not matter
        legend_above(panels[0])
    return panels


def _panels(figure: Figure, ordinate: str, driven: bool) -> tuple[Axes, ...]:
    """Axes for displacements, and for currents below them if there are any."""
    panels = tuple(figure.subplots(1 + driven, 1, sharex=True, squeeze=False)[:, 0])
    if driven:
        panels[1].set_ylabel("largest control current [A]" if "largest" in ordinate else "control current [A]")
    panels[0].set_ylabel(ordinate)
    return panels


def responses(found: Mapping[str, Response], direction: float = 0.0) -> tuple[Axes, ...]:
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
        design that carries most, if there is any. Times in milliseconds, until whirling has died away or has become a band.
    """
    largest = max(found.values(), key=lambda r: r.peak)
    place = largest.peak_place
    end = max(_window(r) for r in found.values())
    times = np.linspace(0.0, end, POINTS)
    along = np.array([math.cos(direction), math.sin(direction)])
    driven = any(r.peak_current for r in found.values())
    with page(height=4.4 if driven else 2.8) as figure:
        panels = _panels(figure, f"{place} [µm]", driven)
        for k, (name, r) in enumerate(found.items()):
            stroke = _stroke(k, len(found))
            moved = r.displacements(times)[:, r.watched.places.index(place)] @ along
            where = "" if r.peak_place == place else f" at {r.peak_place}"
            label = f"{name}: peak {shown(r.peak, 'm')}{where}, settled after {shown(r.settling_time, 's')}"
            panels[0].plot(1e3 * times, 1e6 * moved, label=label, **stroke)
            if r.peak_current:
                currents = r.axis_currents(times)
                most = int(np.abs(currents).max(axis=0).argmax())
                panels[1].plot(1e3 * times, currents[:, most], **stroke)
        panels[-1].set_xlabel(f"time [ms], at {largest.speed / RPM:.0f} rpm")
        panels[-1].set_xlim(0.0, 1e3 * end)
        for ax in panels:
            ax.axhline(0.0, color=INK, linewidth=0.6, zorder=1.0)
        legend_above(panels[0])
    return panels


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
