"""The set of figures that belongs to a comparison."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from . import plots
from .analysis.campbell import Campbell, campbell
from .comparison.assessment import Assessment
from .comparison.table import ComparisonTable
from .errors import ModelError, SolveError
from .figures import SPEEDS


def save_comparison_figures(table: ComparisonTable, folder: Path, formats: tuple[str, ...] = ("png",)) -> None:
    """Draw what a comparison has to show, each figure with the designs for which there is something to draw.

    Parameters
    ----------
    table : ComparisonTable
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

    designs, c = table.designs, table.conditions
    top = min(float(c.top_speed), 1.25 * max(float(c.speed), *(a.stable_up_to for a in designs.values())))
    speeds = np.linspace(0.0, top, SPEEDS)
    diagrams = {name: _forward(campbell(a.loop, speeds)) for name, a in designs.items()}
    limits = {name: a.limit for name, a in designs.items()}
    # Beyond its limit a design may become stable again, which nobody has looked for: nothing is shaded there.
    draw("campbell", plots.campbells, diagrams, {name: replace(x, onsets=()) for name, x in limits.items()})
    draw("real_part", plots.real_parts, diagrams, limits)
    found = _measured(designs.items(), lambda a: a.sensitivities)
    if found:
        draw("sensitivity", plots.sensitivities, [{n: s[k] for n, s in found.items()} for k in (0, -1)])
    found = _measured(designs.items(), lambda a: a.whirl)
    if found:
        draw("unbalance", plots.whirls_compared, found)
    for name, disturbance, responses in (
        ("force_step", c.force_step, lambda a: a.force_steps),
        ("base_shock", c.base_shock, lambda a: a.base_shocks),
    ):
        found = _measured(designs.items(), responses)
        if found:
            assert disturbance is not None
            direction = float(disturbance.angle)
            draw(name, plots.responses, {n: r[-1] for n, r in found.items()}, direction)
    found = _measured(designs.items(), lambda a: a.corners)
    if found:
        draw("corners", plots.corners, {n: designs[n] for n in found})


def _forward(diagram: Campbell) -> Campbell:
    """Without the backward critical speeds, whose labels small diagrams have no room for."""
    return replace(diagram, critical=tuple(c for c in diagram.critical if c.whirl != "backward"))


def _measured(designs: Any, measure: Callable[[Assessment], Any]) -> dict[str, Any]:
    """What can be measured, by design."""
    out = {}
    for name, a in designs:
        try:
            out[name] = measure(a)
        except (ModelError, SolveError):
            continue
    return out
