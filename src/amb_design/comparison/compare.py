"""Compare designs under the same conditions."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from ..analysis.stability import stability_limit
from ..analysis.system import system
from ..errors import SpecError
from ..optimise.design import Design
from ..spec.comparison import Comparison, Conditions
from ..spec.machine import Machine
from ..threads import one_thread
from .assessment import Assessment
from .chosen import completed, top_speed
from .plants import notes as plant_notes
from .robustness import check_tolerances
from .table import ComparisonTable, rows_of


@one_thread
def compare(
    designs: Mapping[str, Machine | Design] | Comparison,
    conditions: Conditions | None = None,
    *,
    progress: Callable[[str], None] | None = None,
    **options: Any,
) -> ComparisonTable:
    """Measure designs under the same conditions and set them side by side.

    Parameters
    ----------
    designs : mapping of str to Machine or Design, or Comparison
        By the names that the table shows. A `Design` brings the CPU time of its search.
    conditions : Conditions, optional
        What is alike for all. What it leaves out is chosen from the machines, and the notes of the result say how.
    progress : callable, optional
        Called with a word on what comes next.
    **options
        Fields of `Conditions` in place of the object: ``speed=ad.rpm(9000)``, ``samples=200``.

    Returns
    -------
    ComparisonTable
        ``print`` shows it; ``table["stability_limit"]`` gives the values of a line.

    Raises
    ------
    SpecError
        If there is nothing to compare, or a condition does not fit a machine.

    Examples
    --------
    >>> import amb_design as ad
    >>> tuned = ad.load("thesis-tuned")
    >>> table = ad.compare({"0.03": tuned, "0.02": ad.replace(tuned, {"controller.kd": 0.02})}, samples=4)
    >>> table["stability_limit"]["0.03"] > table["stability_limit"]["0.02"]
    True
    """
    asked = _asked(designs, conditions, options)
    machines = dict(asked.designs)
    for machine in machines.values():
        asked.conditions.fit(machine)
        check_tolerances(machine, asked.conditions.tolerances or {})
    tell = progress or (lambda text: None)
    top = top_speed(asked.conditions, machines)
    same = {name: _up_to(machine, top) for name, machine in machines.items()}
    loops, limits = {}, {}
    for name, machine in same.items():
        tell(f"stability limit of {name}")
        loops[name] = system(machine)
        limits[name] = stability_limit(loops[name], top, first_only=True)
    complete, chosen = completed(asked.conditions, machines, limits)
    found = {
        name: Assessment(name, machine, loops[name], limits[name], complete, asked.seconds.get(name))
        for name, machine in same.items()
    }
    rows, missing = rows_of(found, tell)
    notes = (*plant_notes(machines), *chosen, *missing)
    return ComparisonTable(asked.name, asked.question, complete, found, rows, notes)


def _asked(
    designs: Mapping[str, Machine | Design] | Comparison, conditions: Conditions | None, options: Mapping[str, Any]
) -> Comparison:
    """What is compared, whichever way it was given."""
    if conditions is not None and options:
        raise SpecError(
            "are given beside conditions", field=", ".join(options), remedy="put them into the Conditions object"
        )
    known = [f.name for f in dataclasses.fields(Conditions)]
    for name in options:
        if name not in known:
            raise SpecError("is no condition", field=name, remedy=f"known are {', '.join(known)}")
    given = conditions or (Conditions(**options) if options else None)
    if isinstance(designs, Comparison):
        return designs if given is None else dataclasses.replace(designs, conditions=given)
    if not isinstance(designs, Mapping) or not designs:
        raise SpecError(
            "are missing", field="designs", remedy='give machines by name: {"PID": machine, "LQG": another}'
        )
    machines: dict[str, Machine] = {}
    seconds: dict[str, float] = {}
    for name, design in designs.items():
        if not isinstance(name, str) or not name:
            raise SpecError("must be text", field="designs", got=name, remedy="give each design a name")
        if isinstance(design, Design):
            machines[name], seconds[name] = design.machine, sum(o.cpu_seconds for o in design.outcomes)
        elif isinstance(design, Machine):
            machines[name] = design
        else:
            raise SpecError(
                "is neither a machine nor a design", field=f"designs.{name}", got=design, remedy="load or solve one"
            )
    return Comparison("comparison", machines, given or Conditions(), seconds)


def _up_to(machine: Machine, top: float) -> Machine:
    """The machine with the common top speed, on which the scaling of its coordinates depends."""
    return dataclasses.replace(machine, operation=dataclasses.replace(machine.operation, top_speed=top))
