"""The machine to scale: shaft with its plies, disks, bearings, magnets and sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon, Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..spec.disk import Disk
from ..spec.fields import is_number
from ..spec.machine import Machine
from ..spec.magnet import Magnet
from ..spec.shaft import Segment
from .base import FAINT, INK, WIDTH, canvas, halo, minus, size_in_points
from .ply_stack import COLUMN, angle_colour, distinct_layups, draw_stacks
from .stations import stations

STEEL = 7850.0
"""Density of the rings that stand for disks known by mass and inertia only [kg/m^3]."""

METAL, DISK, CORE, COIL, BORE = "#cdd3dc", "#aab4c3", "#55657e", "#cf8a4c", "#f4f5f7"

SLENDER = 0.12
"""Rotors of a smaller ratio of diameter to length are drawn with enlarged radii."""


def machine(machine: Machine, *, radial_scale: float | None = None, ax: Axes | None = None) -> Axes:
    """Draw a machine in longitudinal section.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    radial_scale : float, optional
        Enlargement of the radii over the lengths. If left out it is 1, to scale, except for rotors so slender that
        nothing could be seen. It is told below the axis if it is not 1.
    ax : Axes, optional
        Where to draw; a new figure of fitting height if left out.

    Returns
    -------
    Axes
        Lengths in m or mm. Springs, pins, the magnets' radial size and their air gaps are symbols, not to scale;
        hatched disks are steel rings of the given mass and polar inertia.
    """
    stacks = len(distinct_layups(machine))
    points = 72.0 * WIDTH - 45.0 if ax is None else size_in_points(ax)[0]
    sheet = _Sheet.of(machine, radial_scale, points - COLUMN * stacks)
    height = (sheet.height / sheet.width * sheet.points + 42.0) / 72.0
    with canvas(ax, height=max(height, 1.9 if stacks else 1.2)) as ax:
        _axes(ax, sheet, machine)
        _shaft(ax, machine)
        for disk in machine.rotor.disks:
            _disk(ax, machine, disk)
        for magnet in machine.magnets:
            _magnet(ax, sheet, machine, magnet)
        for bearing in machine.bearings:
            _spring(ax, sheet, machine, float(bearing.position))
        for pin in machine.pins:
            _pin(ax, sheet, machine, float(pin.position))
        for sensor in machine.sensors:
            _sensor(ax, sheet, machine, float(sensor.position))
        _labels(ax, sheet)
        if stacks:
            draw_stacks(ax, machine, sheet.points * sheet.height / sheet.width, sheet.points)
    return ax


@dataclass(frozen=True)
class _Label:
    text: str
    x: float
    row: int


@dataclass(frozen=True)
class _Sheet:
    """Sizes of the drawing in metres of length; radii on paper are divided by `scale` to give ordinates.

    Attributes
    ----------
    length : of the shaft
    scale : enlargement of the radii
    radius : largest radius of rotor parts, on paper
    symbol : size of a symbol
    points : width of the drawing on paper [pt]
    upper, lower : labels above and below
    top, bottom : distance of the first row of labels from the axis, on paper
    """

    length: float
    scale: float
    radius: float
    symbol: float
    points: float
    upper: tuple[_Label, ...]
    lower: tuple[_Label, ...]
    top: float
    bottom: float

    @classmethod
    def of(cls, machine: Machine, radial_scale: float | None, points: float) -> _Sheet:
        length = float(machine.rotor.shaft.length)
        largest = max(_surface(machine, x) for x in _places(machine))
        scale = radial_scale or next(
            (s for s in (1.0, 2.0, 3.0, 5.0, 10.0, 20.0) if 2.0 * largest * s >= SLENDER * length), 50.0
        )
        symbol = 0.022 * length
        top = bottom = largest * scale
        for magnet in machine.magnets:
            top = max(top, _surface(machine, float(magnet.position)) * scale + 3.2 * symbol)
            bottom = max(bottom, top)
        for _, x in stations(machine, ("bearings", "pins")):
            bottom = max(bottom, _shaft_radius(machine, x) * scale + 3.4 * symbol)
        if machine.sensors:
            bottom += 1.2 * symbol
        per_point = 1.16 * length / points
        upper = _rows(stations(machine, ("disks", "magnets")), per_point)
        lower = _rows(stations(machine, ("bearings", "pins", "sensors")), per_point)
        return cls(length, scale, largest * scale, symbol, points, upper, lower, top, bottom)

    @property
    def width(self) -> float:
        return 1.16 * self.length

    @property
    def row(self) -> float:
        """Height of a row of labels."""
        return 11.0 * self.width / self.points

    @property
    def height(self) -> float:
        """Of the whole drawing, on paper."""
        return self.above + self.below

    @property
    def above(self) -> float:
        return self.top + self.row * (0.6 + _count(self.upper))

    @property
    def below(self) -> float:
        return self.bottom + self.row * (0.6 + _count(self.lower))


def _count(labels: tuple[_Label, ...]) -> int:
    return max((label.row + 1 for label in labels), default=0)


def _rows(items: list[tuple[str, float]], per_point: float) -> tuple[_Label, ...]:
    """Each label in the first row where it does not touch an earlier one; equal places share a label."""
    merged: dict[float, list[str]] = {}
    for name, x in items:
        merged.setdefault(round(x, 9), []).append(name)
    ends: list[float] = []
    labels = []
    for x, names in sorted(merged.items()):
        text = ", ".join(names)
        half = (2.1 * len(text) + 3.0) * per_point
        row = next((i for i, end in enumerate(ends) if x - half > end), len(ends))
        ends[row : row + 1] = [x + half]
        labels.append(_Label(text, x, row))
    return tuple(labels)


def _places(machine: Machine) -> list[float]:
    """A place inside every segment and the middle of every disk."""
    places, start = [], 0.0
    for segment in machine.rotor.shaft.segments:
        places.append(start + float(segment.length) / 2.0)
        start += float(segment.length)
    return places + [float(disk.position) for disk in machine.rotor.disks]


def _shaft_radius(machine: Machine, x: float) -> float:
    """Outer radius of the shaft; the larger one at a step."""
    start, found = 0.0, 0.0
    length = float(machine.rotor.shaft.length)
    for segment in machine.rotor.shaft.segments:
        end = start + float(segment.length)
        if start - 1e-9 * length <= x <= end + 1e-9 * length:
            found = max(found, float(segment.outer) / 2.0)
        start = end
    return found


def _surface(machine: Machine, x: float) -> float:
    """Outer radius of the rotor, disks included."""
    rings = [_ring(machine, d) for d in machine.rotor.disks]
    disks = [outer for left, right, _, outer in rings if left <= x <= right]
    return max([_shaft_radius(machine, x), *disks])


def _ring(machine: Machine, disk: Disk) -> tuple[float, float, float, float]:
    """Left and right end, inner and outer radius of a disk, or of a steel ring of the same mass and polar inertia."""
    x = float(disk.position)
    if disk.outer_diameter is not None and disk.width is not None and disk.inner_diameter is not None:
        half = float(disk.width) / 2.0
        return x - half, x + half, float(disk.inner_diameter) / 2.0, float(disk.outer_diameter) / 2.0
    inner = _shaft_radius(machine, x)
    mass, (_, polar) = float(disk.total_mass), disk.inertias
    square = 2.0 * float(polar) / mass - inner**2
    if square <= 1.2 * inner**2:  # no ring has so little inertia: one as wide as it is thick
        outer = inner + (mass / (STEEL * np.pi * 4.0)) ** (1.0 / 3.0)
    else:
        outer = float(np.sqrt(square))
    half = mass / (STEEL * np.pi * (outer**2 - inner**2)) / 2.0
    return x - half, x + half, inner, outer


def _axes(ax: Axes, sheet: _Sheet, machine: Machine) -> None:
    ax.set_aspect(sheet.scale)
    ax.set_xlim(-0.08 * sheet.length, 1.08 * sheet.length)
    ax.set_ylim(-sheet.below / sheet.scale, sheet.above / sheet.scale)
    factor, unit = (1000.0, "mm") if sheet.length < 1.0 else (1.0, "m")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda v, _: minus(f"{v * factor:g}")))
    radius = sheet.radius / sheet.scale
    outward = [r for r in _ticks(2, radius) if r > 0.0]
    ax.set_yticks([*(-r for r in reversed(outward)), 0.0, *outward])
    ax.set_xticks(_ticks(8, sheet.length))
    ax.grid(False)
    ax.spines[["left", "top", "right"]].set_visible(False)
    enlarged = f"      (radii enlarged {sheet.scale:g} : 1)" if sheet.scale != 1.0 else ""
    ax.set_xlabel(f"x [{unit}]{enlarged}")
    ax.set_ylabel(f"r [{unit}]")
    ends = [-0.03 * sheet.length, 1.03 * sheet.length]
    ax.plot(ends, [0.0, 0.0], color=INK, linewidth=0.6, dashes=(12, 3, 2, 3), zorder=5)


def _ticks(most: int, end: float) -> list[float]:
    ticks = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, end)
    return [float(t) for t in ticks if t <= end * (1.0 + 1e-9)]


def _both_sides(ax: Axes, x: float, inner: float, width: float, outer: float, **look: Any) -> None:
    """A ring in section: above and below the axis."""
    for low in (inner, -outer):
        ax.add_patch(Rectangle((x, low), width, outer - inner, **look))


def _shaft(ax: Axes, machine: Machine) -> None:
    x = 0.0
    for i, segment in enumerate(machine.rotor.shaft.segments):
        length, inner, outer = float(segment.length), float(segment.inner_diameter) / 2.0, float(segment.outer) / 2.0
        look: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.6, "zorder": 2.2, "gid": f"segment {i}"}
        if segment.plies:
            _plies(ax, segment, x, length)
        fill: dict[str, Any] = {"fill": False} if segment.plies else {"facecolor": METAL}
        if inner > 0.0:
            _both_sides(ax, x, inner, length, outer, **fill, **look)
            bore = Rectangle((x, -inner), length, 2.0 * inner)
            bore.set(facecolor=BORE, edgecolor=INK, linewidth=0.4, zorder=2.0)
            ax.add_patch(bore)
        else:
            ax.add_patch(Rectangle((x, -outer), length, 2.0 * outer, **fill, **look))
        x += length


def _plies(ax: Axes, segment: Segment, x: float, length: float) -> None:
    inner = float(segment.inner_diameter) / 2.0
    for ply in segment.plies:
        outer = inner + float(ply.thickness)
        look: dict[str, Any] = {"facecolor": angle_colour(float(ply.angle)), "edgecolor": "white", "linewidth": 0.15}
        _both_sides(ax, x, inner, length, outer, **look, zorder=2.1, gid="ply")
        inner = outer


def _disk(ax: Axes, machine: Machine, disk: Disk) -> None:
    left, right, inner, outer = _ring(machine, disk)
    known = disk.outer_diameter is not None
    look: dict[str, Any] = {"facecolor": DISK} if known else {"facecolor": "white", "hatch": "//////"}
    _both_sides(ax, left, inner, right - left, outer, edgecolor=INK, linewidth=0.6, zorder=2.6, gid="disk", **look)


def _magnet(ax: Axes, sheet: _Sheet, machine: Machine, magnet: Magnet) -> None:
    x, s = float(magnet.position), sheet.symbol
    width = 1.2 * s if not is_number(magnet.pole_area) else max(float(magnet.pole_area) ** 0.5, s)
    base = _surface(machine, x) * sheet.scale + 0.3 * s  # the gap would be invisible to scale
    height = 2.4 * s
    for sign in (1.0, -1.0):
        core = Rectangle((x - width / 2.0, sign * base / sheet.scale), width, sign * height / sheet.scale)
        core.set(facecolor=CORE, edgecolor=INK, linewidth=0.5, zorder=3, gid="magnet")
        ax.add_patch(core)
        for left in (x - width / 2.0 - 0.55 * s, x + width / 2.0):
            coil = Rectangle(
                (left, sign * (base + 0.7 * s) / sheet.scale),
                0.55 * s,
                sign * 1.3 * s / sheet.scale,
                facecolor=COIL,
                edgecolor=INK,
                linewidth=0.5,
                zorder=3,
            )
            ax.add_patch(coil)


def _spring(ax: Axes, sheet: _Sheet, machine: Machine, x: float) -> None:
    """A spring on hatched ground, beside the magnet or disk that has the same place."""
    s = sheet.symbol
    busy = any(abs(float(m.position) - x) < 1.5 * s for m in machine.magnets) or any(
        left <= x <= right for left, right, _, _ in (_ring(machine, d) for d in machine.rotor.disks)
    )
    place = x + (0.0 if not busy else -2.0 * s if x < sheet.length / 2.0 else 2.0 * s)
    start = _shaft_radius(machine, place) * sheet.scale
    if busy:
        ax.plot([x, place], [0.0, 0.0], color=INK, linewidth=1.0, zorder=3)
    end = _shaft_radius(machine, x) * sheet.scale + 2.8 * s
    t = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 7), 0.85, 1.0])
    side = np.array([0.0, 0.0, *(0.55 * s * (-1.0) ** np.arange(7)), 0.0, 0.0])
    ax.plot(place + side, -(start + t * (end - start)) / sheet.scale, color=INK, linewidth=0.9, zorder=3, gid="spring")
    _ground(ax, sheet, place, end)


def _ground(ax: Axes, sheet: _Sheet, x: float, depth: float) -> None:
    s = sheet.symbol
    ax.plot([x - 0.9 * s, x + 0.9 * s], [-depth / sheet.scale] * 2, color=INK, linewidth=0.9, zorder=3)
    ax.add_patch(
        Rectangle(
            (x - 0.9 * s, -depth / sheet.scale),
            1.8 * s,
            -0.5 * s / sheet.scale,
            facecolor="none",
            edgecolor=INK,
            hatch="////////",
            linewidth=0.0,
            zorder=3,
        )
    )


def _pin(ax: Axes, sheet: _Sheet, machine: Machine, x: float) -> None:
    s, start = sheet.symbol, _shaft_radius(machine, x) * sheet.scale
    corners = [(x, -start), (x - 0.8 * s, -start - 1.3 * s), (x + 0.8 * s, -start - 1.3 * s)]
    triangle = Polygon([(a, b / sheet.scale) for a, b in corners])
    triangle.set(facecolor="white", edgecolor=INK, linewidth=0.9, zorder=3, gid="pin")
    ax.add_patch(triangle)
    _ground(ax, sheet, x, start + 1.3 * s)


def _sensor(ax: Axes, sheet: _Sheet, machine: Machine, x: float) -> None:
    y = -(sheet.bottom - 0.6 * sheet.symbol) / sheet.scale
    ax.plot([x, x], [-_surface(machine, x), y], ":", color=FAINT, linewidth=0.8, zorder=1)
    ax.plot([x], [y], "^", color=INK, markersize=4.0, zorder=3, gid="sensor")


def _labels(ax: Axes, sheet: _Sheet) -> None:
    for labels, edge, sign in ((sheet.upper, sheet.top, 1.0), (sheet.lower, sheet.bottom, -1.0)):
        for label in labels:
            y = sign * (edge + (label.row + 0.7) * sheet.row) / sheet.scale
            if label.row:
                start = sign * (edge + 0.2 * sheet.row) / sheet.scale
                ax.plot([label.x] * 2, [start, y], color=FAINT, linewidth=0.5, zorder=0.5)
            halo(ax.text(label.x, y, label.text, ha="center", va="center", fontsize="small", zorder=6, gid="label"))
