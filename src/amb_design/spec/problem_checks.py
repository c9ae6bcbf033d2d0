"""Whether what a design problem names exists in its machine, and whether it can be asked."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..errors import SpecError
from .controller import LQR, StateFeedback, weights
from .fields import is_number
from .machine import Machine
from .paths import find, is_switched_off, numbers
from .problem_parts import Measure
from .tables import closest

if TYPE_CHECKING:
    from .problem import DesignProblem

_RESIDUAL = ("unbalance", "unbalance_phase")


def check_machine(problem: DesignProblem) -> None:
    """Refuse a machine that cannot be designed."""
    if not isinstance(problem.machine, Machine):
        raise SpecError("must be a machine", field="machine", got=problem.machine, remedy="load one or make one")
    for path, number in numbers(problem.machine):
        if not is_number(number):
            raise SpecError(
                "is a symbol in the machine", field=path, remedy="give a number and name the field in `free`"
            )
    if isinstance(problem.machine.controller, LQR | StateFeedback):
        raise SpecError(
            "is an ideal that nobody can build",
            field="machine.controller",
            got=problem.machine.controller.type,
            remedy="design with pid, state_space or lqg, and analyse the ideal by itself",
        )
    for key in ("name", "question"):
        if not isinstance(getattr(problem, key), str):
            raise SpecError("must be text", field=key, got=getattr(problem, key), remedy="write it in quotes")


def check_variables(problem: DesignProblem) -> None:
    """Refuse variables and ties that set what is no design number, or a number twice."""
    if not problem.variables:
        raise SpecError("is empty", field="free", remedy='name what may change: "controller.kp" = [lower, upper]')
    taken: dict[str, str] = {}
    for group, section in ((problem.variables, "free"), (problem.followers, "ties")):
        for item in group:
            where = f"{section}.{item.name}"
            for path in _find(problem.machine, item.name, section):
                if path in taken:
                    raise SpecError(
                        f"sets {path}, which {taken[path]} sets too", field=where, remedy="name each number once"
                    )
                taken[path] = where
                if is_switched_off(problem.machine, path):
                    raise SpecError(
                        f"is zero in the machine ({path}), which leaves its block out of the model",
                        field=where,
                        remedy="start from a value above zero",
                    )
                if path.startswith("operation."):
                    raise SpecError(
                        "is no part of the design",
                        field=where,
                        remedy="free numbers of the rotor, magnets or controllers",
                    )
                if path.rpartition(".")[2] in _RESIDUAL:
                    raise SpecError(
                        "is no design number: it is what balancing leaves",
                        field=where,
                        remedy="give residual unbalances in [unbalance]",
                    )
    known = [v.name for v in problem.variables]
    for tie in problem.followers:
        for name, _ in tie.terms:
            if name not in known:
                tied = name in [other.name for other in problem.followers]
                raise SpecError(
                    "is tied itself" if tied else "names no variable",
                    field=f"ties.{tie.name}.{name}",
                    remedy="follow its variables instead" if tied else closest(name, known),
                )


def check_measures(problem: DesignProblem) -> None:
    """Refuse limits that cannot be met, and quantities that the machine does not have."""
    for limit in problem.constraints:
        where = f"limits.{limit.quantity}"
        if limit.quantity == problem.objective.quantity:
            raise SpecError(
                "is limited and sought at once", field=where, remedy="remove the limit or seek something else"
            )
        if limit.quantity == "stability_limit":
            raise SpecError("is what `speed` asks for", field=where, remedy='remove it and write speed = "9000 rpm"')
        least, greatest = _REACH.get(limit.quantity, (0.0, math.inf))
        if not least < limit.bound < greatest:
            between = f"above {least:g}" + (f" and below {greatest:g}" if greatest < math.inf else "")
            raise SpecError("cannot be met", field=where, got=limit.bound, remedy=f"give a limit {between}")
    named = [(f"limits.{c.quantity}", c) for c in problem.constraints]
    word = "maximise" if problem.maximise is not None else "minimise"
    for where, measure in [*named, (word, problem.objective)]:
        for need in measure.kind.needs:
            missing = _MISSING[need](problem)
            if missing:
                raise SpecError(missing[0], field=where, remedy=missing[1])
        _check_disks(problem, where, measure)


def _check_disks(problem: DesignProblem, where: str, measure: Measure) -> None:
    if "disks" not in measure.kind.options:
        return
    disks = problem.machine.rotor.disks
    for name in measure.option("disks"):
        named = [d for d in disks if d.name == name]
        if not named:
            remedy = closest(name, [d.name for d in disks if d.name]) or "give the disks names"
            raise SpecError("names no disk", field=f"{where}.disks", got=name, remedy=remedy)
        if any(d.outer_diameter is None for d in named):
            raise SpecError(
                "has no outer diameter", field=f"{where}.disks", got=name, remedy="describe the disk as a ring"
            )
    if all(d.outer_diameter is None for d in disks):
        raise SpecError("needs a disk with an outer diameter", field=where, remedy="describe the disks as rings")


def check_scenarios(problem: DesignProblem) -> None:
    """Refuse factors on what is no number of the machine, or on a number twice."""
    for case in problem.cases:
        taken: dict[str, str] = {}
        where = f"scenarios.{case.name}"
        if not case.factors and case.unbalance == 1.0:
            raise SpecError("changes nothing", field=where, remedy='give factors: "magnets.gap" = 1.05')
        for name, _ in case.factors:
            for path in _find(problem.machine, name, where):
                if path in taken:
                    raise SpecError(
                        f"scales {path}, which {taken[path]} scales too",
                        field=f"{where}.{name}",
                        remedy="name each number once",
                    )
                taken[path] = name
                if path.startswith("operation."):
                    raise SpecError(
                        "is no part of the machine itself",
                        field=f"{where}.{name}",
                        remedy="scale numbers of the rotor, bearings, magnets or controllers",
                    )
                if path in {f"controller.{name}" for name in weights(problem.machine.controller)}:
                    raise SpecError(
                        "is a weight of the law, which is designed for the machine as drawn",
                        field=f"{where}.{name}",
                        remedy="scale numbers of the machine or of the hardware around the law",
                    )
                if path.rpartition(".")[2] in _RESIDUAL:
                    raise SpecError(
                        "is no number to scale by itself",
                        field=f"{where}.{name}",
                        remedy="write unbalance = factor, which scales all residual unbalances",
                    )


def _has_unbalance(p: DesignProblem) -> bool:
    return bool(p.patterns) or any(d.unbalance for d in p.machine.rotor.disks)


_REACH = {"damping_ratio": (0.0, 1.0), "sensitivity_peak": (1.0, math.inf)}
"""Between which values a limit can be met and says something; above zero for the others."""

_MISSING: dict[str, Any] = {
    "loops": lambda p: (
        None
        if any(p.machine.controllers_of(m)[0] for m in p.machine.magnets)
        else ("needs a control loop", "add magnets and a controller, or remove it")
    ),
    "unbalance": lambda p: (
        None if _has_unbalance(p) else ("needs a residual unbalance", "add one in [unbalance], in kg m for each disk")
    ),
    "bias": lambda p: (
        None
        if p.machine.magnets and all(m.bias_current is not None for m in p.machine.magnets)
        else ("needs magnets with a bias_current", "give the magnets one, or remove it")
    ),
    "geometry": lambda p: (
        None
        if p.machine.magnets and all(m.has_geometry for m in p.machine.magnets)
        else ("needs magnets with geometry, not with k_i and k_s alone", "give turns, pole_area and gap, or remove it")
    ),
    "resistance": lambda p: (
        None
        if all(m.resistance is not None for m in p.machine.magnets)
        else ("needs the resistance of the coils", "give the magnets a resistance, or remove it")
    ),
    "room": lambda p: (
        None
        if p.machine.magnets and all(m.clearance is not None or m.gap is not None for m in p.machine.magnets)
        else ("needs the clearance or the gap of the magnets", "give the magnets a clearance, or remove it")
    ),
    "disks": lambda p: None if p.machine.rotor.disks else ("needs disks", "add disks to the rotor, or remove it"),
    "service_speed": lambda p: (
        None
        if p.machine.operation.service_speed is not None
        else ("needs a service speed", "give operation.service_speed, or remove it")
    ),
}


def _find(machine: Machine, path: str, section: str) -> tuple[str, ...]:
    try:
        return find(machine, path)
    except SpecError as error:
        raise error.inside(section) from None
