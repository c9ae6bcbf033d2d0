"""The set of figures that belongs to an analysis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from . import plots
from .analysis.campbell import campbell
from .analysis.modes import OVERDAMPED
from .analysis.sensitivity import sensitivity_over_speed
from .analysis.spectrum import spectrum
from .analysis.stability import FOUND, MARGINAL, UNSTABLE
from .analysis.summary import Analysis
from .analysis.system import system
from .analysis.unbalance import unbalance_response

SPEEDS = 46
"""Speeds of the Campbell diagram."""


def save_figures(
    analysis: Analysis, folder: Path, formats: tuple[str, ...] = ("png",), *, main_only: bool = False
) -> None:
    """Draw what an analysis has to show.

    Parameters
    ----------
    analysis : Analysis
    folder : Path
        Made if it does not exist.
    formats : tuple of str
        File formats.
    main_only : bool
        Only the Campbell diagram, the damping ratios and the largest real part.
    """
    machine, limit, critical = analysis.machine, analysis.limit, analysis.critical
    loop = system(machine)
    folder.mkdir(parents=True, exist_ok=True)

    def draw(name: str, plot: Callable[..., Any], *args: Any, **options: Any) -> None:
        drawing = plot(*args, **options)
        for i, f in enumerate(formats):
            plots.save(drawing, folder / f"{name}.{f}", close=i == len(formats) - 1)

    diagram = campbell(loop, np.linspace(0.0, limit.top_speed, SPEEDS), critical=False)
    draw("campbell", plots.campbell, replace(diagram, critical=critical), limit=limit)
    draw("damping", plots.damping_ratios, diagram, limit=limit)
    draw("real_part", plots.real_part, diagram, limit=limit)
    if main_only:
        return
    draw("machine", plots.machine, machine)
    at = limit.speed if limit.status == FOUND else 0.0
    light = [m for m in spectrum(loop, at) if m.whirl != "none" and m.damping_ratio < OVERDAMPED]
    draw("modes", plots.mode_shapes, light[:4], loop)
    if limit.status not in (UNSTABLE, MARGINAL) and any(d.unbalance for d in machine.rotor.disks):
        response = unbalance_response(loop, np.linspace(limit.speed / 500.0, limit.speed, 500))
        draw("unbalance", plots.unbalance, response, critical=critical)
        if machine.magnets:
            draw("currents", plots.currents, response, critical=critical)
    if analysis.sensitivities:
        rest, fast = analysis.sensitivities[0], analysis.sensitivities[-1]
        draw("sensitivity", plots.sensitivity, rest)
        draw("open_loop", plots.open_loop, rest)
        speeds = np.linspace(0.0, fast.speed, 9)
        draw("sensitivity_over_speed", plots.sensitivity_over_speed, sensitivity_over_speed(loop, speeds))
