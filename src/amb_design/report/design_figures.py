"""The set of figures that belongs to a design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from .. import plots
from ..analysis.campbell import campbell
from ..analysis.stability import FOUND, StabilityLimit, stability_limit
from ..analysis.system import system
from ..optimise.answers import ParetoPoint
from ..optimise.design import Design
from .analysis_figures import SPEEDS, machine_drawing
from .picture import Drawn


def drawings(design: Design, fronts: Mapping[str, Sequence[ParetoPoint]]) -> Iterator[Drawn]:
    """Draw what a design has to show.

    Parameters
    ----------
    design : Design
        Verified.
    fronts : mapping of str to sequence of ParetoPoint
        By quantity.
    """
    yield machine_drawing(design.machine)
    machines = {"before": design.problem.machine, "after": design.machine}
    loops = {name: system(machine) for name, machine in machines.items()}
    limits = {name: stability_limit(loop, design.problem.top_speed) for name, loop in loops.items()}
    top = min(design.problem.top_speed, 1.25 * max(design.end, *(x.speed for x in limits.values())))
    speeds = np.linspace(0.0, top, SPEEDS)
    diagrams = {name: campbell(loop, speeds) for name, loop in loops.items()}
    told = {name: f"stability limit {name}: {_limit(limit)}" for name, limit in limits.items()}
    yield (
        "real_part",
        "Largest real part of all modes before and after; a machine is unstable where it is positive.",
        f"Largest real parts up to {top * 30.0 / np.pi:.0f} rpm; {told['before']}, {told['after']}.",
        plots.real_parts(diagrams, limits),
    )
    for name, diagram in diagrams.items():
        yield (
            f"campbell_{name}",
            f"Whirl frequencies over the spin speed, {name}: the Campbell diagram.",
            f"Campbell diagram {name} of {len(diagram.whirl)} modes; {told[name]}.",
            plots.campbell(diagram, limit=limits[name]),
        )
    if design.sensitivities:
        strongest = ", ".join(path for path, _ in design.sensitivities[:3])
        yield (
            "sensitivities",
            "What moves the stability limit most: per cent of speed for a per cent of each number.",
            f"Bars of relative sensitivities; the largest are those to {strongest}.",
            plots.limit_sensitivities(design),
        )
    yield (
        "convergence",
        "How the search went: the objective of each start over the eigendecompositions spent.",
        f"Progress of {len(design.outcomes)} starts.",
        plots.convergence(design),
    )
    for quantity, points in fronts.items():
        spoken = quantity.replace("_", " ")
        yield (
            f"pareto_{quantity}",
            f"Compromises: what the limit of the {spoken} costs.",
            f"Objective over the limit of the {spoken} at {len(points)} points.",
            plots.pareto(design, quantity, points),
        )


def _limit(limit: StabilityLimit) -> str:
    return f"{limit.speed_rpm:.0f} rpm" if limit.status == FOUND else limit.status
