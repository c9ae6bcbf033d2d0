"""The set of figures that belongs to a simulation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .. import plots
from ..transient.result import Transient

FEW = 40.0
"""Turns that are drawn whole as orbits."""

LAST = 10.0
"""Turns at the end that are drawn of longer runs."""


def save_simulation_figures(result: Transient, folder: Path, formats: tuple[str, ...] = ("png",)) -> None:
    """Draw what a simulation has to show.

    Parameters
    ----------
    result : Transient
    folder : Path
        Made if it does not exist.
    formats : tuple of str
        File formats.
    """
    folder.mkdir(parents=True, exist_ok=True)

    def draw(name: str, plot: Callable[..., Any], *args: Any, **options: Any) -> None:
        drawing = plot(result, *args, **options)
        for i, f in enumerate(formats):
            plots.save(drawing, folder / f"{name}.{f}", close=i == len(formats) - 1)

    turns = float(np.abs(result.angles[-1] - result.angles[0])) / (2.0 * np.pi)
    draw("radius", plots.history)
    draw("orbits", plots.orbits, turns=None if turns <= FEW else LAST)
    if result.machine.magnets:
        draw("currents", plots.history, "current")
        draw("magnet_forces", plots.history, "magnet force")
    if result.contact_forces.any():
        draw("contact_forces", plots.history, "contact force")
    if np.ptp(result.speeds) and turns >= 2.0:
        draw("envelope", plots.envelope)
    windows = min(40, len(result.times) // 40)
    if np.ptp(result.speeds) and windows >= 4:
        draw("waterfall", plots.waterfall, _widest(result), windows=windows)


def _widest(result: Transient) -> float:
    """The magnet or disk that moves most."""
    machine = result.machine
    places = [float(m.position) for m in machine.magnets] + [float(d.position) for d in machine.rotor.disks]
    return max(places or [float(result.positions[0])], key=lambda x: float(result.radius(x).max()))
