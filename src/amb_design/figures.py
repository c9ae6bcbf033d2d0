"""The set of figures that belongs to an analysis."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from . import plots
from .analysis.campbell import campbell
from .analysis.sensitivity import sensitivity_over_speed
from .analysis.spectrum import spectrum
from .analysis.stability import FOUND, MARGINAL, UNSTABLE
from .analysis.summary import Analysis
from .analysis.system import system
from .analysis.unbalance import unbalance_response

SPEEDS = 76
"""Speeds of the Campbell diagram."""


def save_figures(analysis: Analysis, folder: Path, formats: tuple[str, ...] = ("png", "svg")) -> None:
    """Draw everything an analysis has to show.

    Parameters
    ----------
    analysis : Analysis
    folder : Path
        Made if it does not exist.
    formats : tuple of str
        File formats.
    """
    machine, limit = analysis.machine, analysis.limit
    loop = system(machine)
    folder.mkdir(parents=True, exist_ok=True)
    diagram = campbell(loop, np.linspace(0.0, limit.top_speed, SPEEDS), critical=False)
    diagram = replace(diagram, critical=analysis.critical)
    stable = limit.status not in (UNSTABLE, MARGINAL)

    def draw(name, plot, *args, **kwargs):  # type: ignore[no-untyped-def]
        plots.save(plot(*args, **kwargs), [folder / f"{name}.{f}" for f in formats])

    draw("machine", plots.machine, machine)
    draw("campbell", plots.campbell, diagram, limit=limit)
    draw("damping", plots.damping_ratios, diagram)
    draw("real_part", plots.real_part, diagram, limit=limit)
    shown = [m for m in spectrum(loop, limit.speed if limit.status == FOUND else 0.0) if m.damping_ratio < 0.5]
    draw("modes", plots.mode_shapes, [m for m in shown if m.whirl != "none"][:4], loop.node_positions)
    if stable and any(d.unbalance for d in machine.rotor.disks):
        top = limit.speed
        response = unbalance_response(loop, np.linspace(top / 500.0, top, 500))
        draw("unbalance", plots.unbalance, response)
        if machine.magnets:
            draw("currents", plots.currents, response)
    if analysis.sensitivities:
        draw("sensitivity", plots.sensitivity, analysis.sensitivities[0])
        draw("open_loop", plots.open_loop, analysis.sensitivities[0])
        last = analysis.sensitivities[-1].speed
        draw("sensitivity_over_speed", plots.sensitivity_over_speed, sensitivity_over_speed(loop, np.linspace(0.0, last, 9)))
