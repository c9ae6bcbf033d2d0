"""The set of figures that belongs to a design."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import plots
from .analysis.campbell import campbell
from .analysis.stability import stability_limit
from .analysis.system import system
from .figures import SPEEDS
from .optimise.answers import ParetoPoint
from .optimise.design import Design


def save_design_figures(
    design: Design, fronts: Mapping[str, Sequence[ParetoPoint]], folder: Path, formats: tuple[str, ...] = ("png",)
) -> None:
    """Draw what a design has to show.

    Parameters
    ----------
    design : Design
        Verified.
    fronts : mapping of str to sequence of ParetoPoint
        By quantity.
    folder : Path
        Made if it does not exist.
    formats : tuple of str
        File formats.
    """
    folder.mkdir(parents=True, exist_ok=True)

    def draw(name: str, plot: Callable[..., Any], *args: Any, **options: Any) -> None:
        drawing = plot(*args, **options)
        for i, f in enumerate(formats):
            plots.save(drawing, folder / f"{name}.{f}", close=i == len(formats) - 1)

    machines = {"before": design.problem.with_values(design.problem.start()), "after": design.machine}
    loops = {name: system(machine) for name, machine in machines.items()}
    limits = {name: stability_limit(loop, design.problem.top_speed) for name, loop in loops.items()}
    top = min(design.problem.top_speed, 1.25 * max(design.end, *(x.speed for x in limits.values())))
    speeds = np.linspace(0.0, top, SPEEDS)
    diagrams = {name: campbell(loop, speeds) for name, loop in loops.items()}
    for name, diagram in diagrams.items():
        draw(f"campbell_{name}", plots.campbell, diagram, limit=limits[name])
    draw("real_part", plots.real_parts, diagrams, limits)
    draw("convergence", plots.convergence, design)
    if design.sensitivities:
        draw("sensitivities", plots.limit_sensitivities, design)
    for quantity, points in fronts.items():
        draw(f"pareto_{quantity}", plots.pareto, design, quantity, points)
