"""The set of figures that belongs to a comparison."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from .. import plots
from ..analysis.campbell import Campbell, campbell
from ..comparison.assessment import Assessment
from ..comparison.table import ComparisonTable
from ..errors import ModelError, SolveError
from ..units import in_words
from .analysis_figures import SPEEDS
from .picture import Drawn


def drawings(table: ComparisonTable) -> Iterator[Drawn]:
    """Draw what a comparison has to show, each figure with the designs for which there is something to draw.

    Parameters
    ----------
    table : ComparisonTable
    """
    designs, c = table.designs, table.conditions
    names = ", ".join(designs)
    top = min(float(c.top_speed), 1.25 * max(float(c.speed), *(a.stable_up_to for a in designs.values())))
    speeds = np.linspace(0.0, top, SPEEDS)
    diagrams = {name: _forward(campbell(a.loop, speeds)) for name, a in designs.items()}
    limits = {name: a.limit for name, a in designs.items()}
    reach = f"up to {in_words(top, 'rad/s', speed=True)}"
    yield (
        "real_part",
        "Largest real part of all modes; a design is unstable where it is positive.",
        f"Largest real parts of {names} {reach}.",
        plots.real_parts(diagrams, limits),
    )
    # Beyond its limit a design may become stable again, which nobody has looked for: nothing is shaded there.
    yield (
        "campbell",
        "Whirl frequencies over the spin speed: the Campbell diagrams.",
        f"Campbell diagrams of {names} {reach}.",
        plots.campbells(diagrams, {name: replace(x, onsets=()) for name, x in limits.items()}),
    )
    found = _measured(designs.items(), lambda a: a.sensitivities)
    if found:
        yield (
            "sensitivity",
            "Sensitivities at rest and at the end of the operating range, with the zones of ISO 14839-3.",
            f"Sensitivities of {', '.join(found)} at rest and at the end of the operating range.",
            plots.sensitivities([{n: s[k] for n, s in found.items()} for k in (0, -1)]),
        )
    found = _measured(designs.items(), lambda a: a.whirl)
    if found:
        yield (
            "unbalance",
            "Orbits and control currents under the same unbalance.",
            f"Unbalance responses of {', '.join(found)} over the operating range.",
            plots.whirls_compared(found),
        )
    for name, what, disturbance, responses in (
        ("force_step", "a step of the force", c.force_step, lambda a: a.force_steps),
        ("base_shock", "a shock of the base", c.base_shock, lambda a: a.base_shocks),
    ):
        found = _measured(designs.items(), responses)
        if found:
            assert disturbance is not None
            yield (
                name,
                f"Response to {what} at the end of the operating range.",
                f"Responses of {', '.join(found)} to {what}.",
                plots.responses({n: r[-1] for n, r in found.items()}, float(disturbance.angle)),
            )
    found = _measured(designs.items(), lambda a: a.corners)
    if found:
        yield (
            "corners",
            "Stability limits at all corners of the tolerances.",
            f"Stability limits of {', '.join(found)} at the corners of the tolerances.",
            plots.corners({n: designs[n] for n in found}),
        )


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
