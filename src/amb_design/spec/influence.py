"""Numbers of a machine that nothing reads: others replace them, or no quantity of the problem asks for them."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import TYPE_CHECKING

from ..errors import SpecError
from .machine import Machine
from .magnet import Magnet
from .paths import find, value
from .quantities import QUANTITIES

if TYPE_CHECKING:
    from .problem import DesignProblem

_READERS: dict[str, tuple[str, ...]] = {
    "max_current": (),
    "max_flux_density": (),
    "link_voltage": (),
    "clearance": ("displacement_ratio",),
    "resistance": ("voltage", "copper_loss"),
    "leakage_inductance": ("voltage",),
}
"""Of the numbers of a magnet that do not shape the dynamics: the quantities that read them."""

_MOVERS: dict[str, Callable[[str], bool]] = {
    "mass": lambda path: path.endswith((".length", "_diameter", ".thickness", ".width", ".density", ".mass")),
    "bias_current": lambda path: path.endswith(".bias_current"),
    "copper_loss": lambda path: path.endswith((".bias_current", ".resistance")),
}
"""Of the objectives that few numbers move: which those are."""


def check_influence(problem: DesignProblem) -> None:
    """Refuse variables and factors that influence nothing, and an objective that nothing moves.

    Parameters
    ----------
    problem : DesignProblem

    Raises
    ------
    SpecError
    """
    machine, moved, objective = problem.machine, problem.paths(), problem.objective.quantity
    quantities = [objective, *(c.quantity for c in problem.constraints)]
    why = {path: idle(machine, path, quantities) for path in moved}
    for v in problem.variables:
        reasons = [why[path] for path, terms in moved.items() if v.name in terms]
        if all(reasons):
            raise SpecError(
                f"influences nothing: {reasons[0]}", field=f"free.{v.name}", remedy="free what counts instead"
            )
    if not any(_MOVERS.get(objective, bool)(path) for path in moved):
        raise SpecError(
            "cannot change: nothing that is free moves it",
            field="maximise" if problem.minimise is None else "minimise",
            got=objective,
            remedy="free a number that does, or seek something else",
        )
    for case in problem.cases:
        for name, _ in case.factors:
            reason = _idle_factor(problem, name)
            if reason:
                raise SpecError(
                    f"influences nothing: {reason}", field=f"scenarios.{case.name}.{name}", remedy="remove the factor"
                )


def _idle_factor(problem: DesignProblem, name: str) -> str:
    """Why a factor changes nothing, whatever is limited: a variant may do without the limits."""
    paths, moved = find(problem.machine, name), problem.paths()
    if all(path not in moved and value(problem.machine, path) == 0.0 for path in paths):
        return "the number is zero"
    reasons = [idle(problem.machine, path, QUANTITIES) for path in paths]
    return reasons[0] if all(reasons) else ""


def idle(machine: Machine, path: str, quantities: Collection[str]) -> str:
    """Why a number influences nothing; empty if it does.

    Parameters
    ----------
    machine : Machine
    path : str
        Full path.
    quantities : collection of str
        What the problem limits or seeks.
    """
    section, _, name = path.rpartition(".")
    owner = value(machine, section)
    for shared in ("controller", "controller_z"):
        if path.startswith(f"{shared}."):
            used = [c for m in machine.magnets for c in machine.controllers_of(m)]
            return "" if any(c is getattr(machine, shared) for c in used) else "no magnet uses this controller"
    if section.startswith("bearings[") and name in ("stiffness", "damping"):
        parts = ("kyy", "kzz") if name == "stiffness" else ("cyy", "czz")
        return " and ".join(parts) + " replace it" if all(getattr(owner, p) is not None for p in parts) else ""
    if section == "rotor.shaft" and name in ("viscous_damping", "hysteretic_damping"):
        all_own = all(getattr(s, name) is not None for s in owner.segments)
        return "every segment has its own" if all_own else ""
    if path == "rotor.shaft.shear_correction" and owner.theory != "timoshenko":
        return f"{owner.theory} theory knows no shear"
    if section.startswith("sensors["):
        return "" if owner.name in [m.sensor for m in machine.magnets] else "no magnet uses this sensor"
    if isinstance(owner, Magnet) and name in _READERS and not set(_READERS[name]) & set(quantities):
        return "only " + " and ".join(_READERS[name]) + " would read it" if _READERS[name] else "no quantity reads it"
    if section.startswith("rotor.disks["):
        given = owner.mass is not None and owner.diametral_inertia is not None
        if given and (
            name in ("inner_diameter", "width") or (name == "outer_diameter" and "surface_speed" not in quantities)
        ):
            return "mass and moments of inertia are given"
    return ""
