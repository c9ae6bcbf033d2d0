"""The stack of plies of a laminate, as a bar from the inside (below) to the outside (above)."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from ..spec.machine import Machine
from ..spec.shaft import Ply
from .base import INK, minus, spread

COLUMN = 66.0
"""Width that one stack takes beside a drawing [pt]."""

MOST = 3
"""Stacks drawn beside a machine."""

_HUES = {-90.0: "#e8ddc0", -45.0: "#3f9f9b", 0.0: "#274472", 45.0: "#d8793a", 90.0: "#e8ddc0"}


def angle_colour(angle: float) -> tuple[float, float, float]:
    """Colour of a fibre angle [rad]: dark along the shaft, light around it, warm and cold for the two slants."""
    degrees = (math.degrees(angle) + 90.0) % 180.0 - 90.0
    known = np.array(list(_HUES))
    parts = np.array([[int(h[i : i + 2], 16) / 255.0 for i in (1, 3, 5)] for h in _HUES.values()])
    red, green, blue = (float(np.interp(degrees, known, parts[:, c])) for c in range(3))
    return red, green, blue


def distinct_layups(machine: Machine) -> list[tuple[tuple[Ply, ...], list[int]]]:
    """The different layups of a shaft with the indices of their segments, at most three."""
    found: list[tuple[tuple[Ply, ...], list[int]]] = []
    for i, segment in enumerate(machine.rotor.shaft.segments):
        if not segment.plies:
            continue
        for plies, where in found:
            if plies == segment.plies:
                where.append(i)
                break
        else:
            found.append((segment.plies, [i]))
    return found[:MOST]


def draw_stacks(ax: Axes, machine: Machine, height: float, width: float) -> None:
    """Draw the stacks to the right of axes of a given size [pt]."""
    layups = distinct_layups(machine)
    for k, (plies, where) in enumerate(layups):
        runs = _runs(plies)
        tall = max(min(0.8 * height, 130.0), 11.0 * len(runs), 60.0)
        left = 1.0 + (14.0 + k * COLUMN) / width
        bar = ax.inset_axes((left, 0.5 - tall / height / 2.0, 13.0 / width, tall / height))
        _stack(bar, plies, runs, tall)
        several = len(machine.rotor.shaft.segments) > 1
        name = "segment" + ("s " if len(where) > 1 else " ") + ", ".join(str(i + 1) for i in where) if several else ""
        wall = sum(1000.0 * float(p.thickness) for p in plies)
        title = f"{len(plies)} plies\n{wall:.3g} mm"
        bar.set_title(f"{name}\n{title}" if name else title, fontsize="small", loc="left", pad=10.0)


def _runs(plies: tuple[Ply, ...]) -> list[tuple[float, float, float, int]]:
    """Bottom, top [m], angle [deg] and number of neighbouring plies of the same angle."""
    runs: list[tuple[float, float, float, int]] = []
    bottom = 0.0
    for ply in plies:
        top, angle = bottom + float(ply.thickness), round(math.degrees(float(ply.angle)), 6)
        if runs and runs[-1][2] == angle:
            runs[-1] = (runs[-1][0], top, angle, runs[-1][3] + 1)
        else:
            runs.append((bottom, top, angle, 1))
        bottom = top
    return runs


def _stack(bar: Axes, plies: tuple[Ply, ...], runs: list[tuple[float, float, float, int]], tall: float) -> None:
    bottom = 0.0
    for ply in plies:
        size = float(ply.thickness)
        layer = Rectangle((0.0, bottom), 1.0, size)
        layer.set(facecolor=angle_colour(float(ply.angle)), edgecolor=INK, linewidth=0.4, gid="layer")
        bar.add_patch(layer)
        bottom += size
    bar.set(xlim=(0.0, 1.0), ylim=(0.0, bottom), xticks=[], yticks=[])
    bar.grid(False)
    bar.spines[:].set_visible(False)
    centres = [(low + high) / 2.0 / bottom * tall for low, high, _, _ in runs]
    for (_, _, angle, count), place in zip(runs, spread(centres, 9.5, 2.0, tall - 2.0), strict=True):
        sign = "+" if angle > 0.0 and abs(angle) != 90.0 else ""
        text = minus(f"{sign}{angle:.3g}°") + (f"  ({count})" if count > 1 else "")
        bar.annotate(
            text,
            (1.0, place / tall),
            xycoords="axes fraction",
            xytext=(3.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize="small",
            color=INK,
        )
    for y, word, va in ((1.0, "outside", "bottom"), (0.0, "inside", "top")):
        bar.annotate(
            word,
            (0.0, y),
            xycoords="axes fraction",
            xytext=(0.0, 2.0 if y else -2.0),
            textcoords="offset points",
            va=va,
            fontsize="x-small",
            color=INK,
        )
