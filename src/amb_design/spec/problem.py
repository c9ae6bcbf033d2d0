"""A design problem: what is free, what is sought, and which limits hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from dataclasses import replace as replace_fields
from functools import cached_property, partial
from typing import Any

from ..errors import SpecError
from .admissible import check_bounds
from .fields import is_number
from .influence import check_influence
from .machine import Machine
from .paths import find, replace, value
from .problem_checks import check_machine, check_measures, check_scenarios, check_variables
from .problem_parts import (
    Limit,
    Measure,
    Scenario,
    Tie,
    UnbalancePattern,
    Variable,
    read_limit,
    read_measure,
    read_pattern,
    read_scenario,
    read_tie,
    read_variable,
)
from .quantities import QUANTITIES
from .tables import as_table

HARDLY = 1e-12
"""Relative freedom of numbers that are to stay."""


@dataclass(frozen=True)
class DesignProblem:
    """Maximise or minimise a quantity over some numbers of a machine, under limits.

    Parameters
    ----------
    machine : Machine
        Start of the search; its top speed is where the search for the stability limit ends.
    maximise, minimise : str or mapping, optional
        Name of a quantity, or a mapping with ``quantity`` and its options. Exactly one of the two.
    free : mapping of str to sequence
        Bounds (lower, upper) or (lower, upper, scale) by path, in SI units.
    limits : mapping of str to float or mapping
        Bound by quantity; a mapping with ``limit`` gives options too.
    ties : mapping of str to mapping
        For each dependent number, the factor of each variable that it follows, and a ``constant``.
    unbalance : mapping of str to sequence
        Residual unbalance patterns by name, one signed amount [kg m] a disk. The machine's own unbalances if left out.
    scenarios : mapping of str to mapping
        Factors by path; ``unbalance`` is the factor on the residual unbalance. The limits hold in all scenarios and in
        the machine as drawn.
    speed : float, optional
        End of the range of speeds [rad/s] over which stability and limits must hold, where the objective is not the
        stability limit.
    name, question : str
        For tables and reports.
    source : mapping of str to str
        Where limits and bounds come from.

    Attributes
    ----------
    objective : Measure
    variables, constraints, followers, patterns, cases : tuple
        The above as objects.

    Raises
    ------
    SpecError
        If the problem names what does not exist, or cannot have a solution.
    """

    machine: Machine
    _: KW_ONLY
    free: Mapping[str, Sequence[Any]]
    maximise: Any = None
    minimise: Any = None
    limits: Mapping[str, Any] = field(default_factory=dict)
    ties: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    unbalance: Mapping[str, Sequence[float]] = field(default_factory=dict)
    scenarios: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    speed: float | None = None
    name: str = ""
    question: str = ""
    source: Mapping[str, str] = field(default_factory=dict, compare=False)
    objective: Measure = field(init=False)
    variables: tuple[Variable, ...] = field(init=False)
    constraints: tuple[Limit, ...] = field(init=False)
    followers: tuple[Tie, ...] = field(init=False)
    patterns: tuple[UnbalancePattern, ...] = field(init=False)
    cases: tuple[Scenario, ...] = field(init=False)

    def __post_init__(self) -> None:
        check_machine(self)
        disks = len(self.machine.rotor.disks)
        self._put("objective", self._objective())
        self._put("variables", self._each("free", read_variable))
        self._put("followers", self._each("ties", read_tie))
        self._put("patterns", self._each("unbalance", partial(read_pattern, disks=disks)))
        self._put("constraints", self._each("limits", read_limit))
        self._put("cases", self._each("scenarios", read_scenario))
        self._put("name", self.name or self.machine.name)
        check_variables(self)
        check_measures(self)
        check_scenarios(self)
        check_influence(self)
        check_bounds(self)

    def _put(self, name: str, found: Any) -> None:
        object.__setattr__(self, name, found)

    def _each(self, section: str, read: Callable[[str, Any], Any]) -> tuple[Any, ...]:
        return tuple(read(name, raw) for name, raw in as_table(getattr(self, section), section).items())

    @property
    def top_speed(self) -> float:
        """Where the range of speeds ends at the latest [rad/s]."""
        return float(self.machine.operation.top_speed if self.speed is None else self.speed)

    @property
    def seeks_speed(self) -> bool:
        """True if the objective is the stability limit."""
        return self.objective.quantity == "stability_limit"

    def paths(self) -> dict[str, dict[str, float]]:
        """Every full path that changes, with the factor of each variable; the key "" holds a constant."""
        return {path: dict(terms) for path, terms in self._forms.items()}

    @cached_property
    def _forms(self) -> dict[str, dict[str, float]]:
        moved = {path: {v.name: 1.0} for v in self.variables for path in find(self.machine, v.name)}
        for tie in self.followers:
            for path in find(self.machine, tie.name):
                moved[path] = {**dict(tie.terms), "": tie.constant}
        return moved

    def values(self, p: Mapping[str, Any]) -> dict[str, Any]:
        """Values of all paths that change.

        Parameters
        ----------
        p : mapping of str to float or CasADi scalar
            Values of the variables by name.

        Raises
        ------
        SpecError
            If `p` leaves a variable out.
        """
        for v in self.variables:
            if v.name not in p:
                raise SpecError("is missing", field=v.name, remedy="give a value for every variable")
        out = {}
        for path, terms in self._forms.items():
            summands = [p[name] if factor == 1.0 else factor * p[name] for name, factor in terms.items() if name]
            total: Any = summands[0]
            for summand in summands[1:]:
                total = total + summand
            out[path] = total + terms[""] if terms.get("") else total
        return out

    def with_values(self, p: Mapping[str, Any]) -> Machine:
        """The machine with other values of the variables.

        Parameters
        ----------
        p : mapping of str to float or CasADi scalar
        """
        return replace(self.machine, self.values(p))

    def with_limit(self, quantity: str, bound: float) -> DesignProblem:
        """The same problem with another bound of a limit, or with one limit more.

        Parameters
        ----------
        quantity : str
        bound : float
            SI unit.

        Raises
        ------
        SpecError
            If the quantity does not exist in this problem.
        """
        old: Any = self.limits.get(quantity)
        limits = {k: v for k, v in self.limits.items() if k != quantity}
        limits[quantity] = {**old, "limit": bound} if isinstance(old, Mapping) else bound
        return replace_fields(self, limits=limits)

    def start(self) -> dict[str, float]:
        """The machine's own values of the variables, moved into their bounds."""
        own = {v.name: float(value(self.machine, find(self.machine, v.name)[0])) for v in self.variables}
        return {v.name: min(max(own[v.name], v.lower), v.upper) for v in self.variables}

    def as_drawn(self) -> DesignProblem:
        """The same problem about exactly its machine, whose numbers stay: one of them is free, but hardly.

        `start` makes tied numbers alike and moves them into their bounds; this is for what the machine was before.
        """
        own, begun = {path: float(value(self.machine, path)) for path in self._forms}, self.values(self.start())
        if all(math.isclose(x, begun[path], rel_tol=HARDLY) for path, x in own.items()):
            return self
        for path, x in own.items():
            try:
                return replace_fields(self, free={path: (x - HARDLY * abs(x), x + HARDLY * abs(x))}, ties={})
            except SpecError:  # zero, or a place where two parts touch
                continue
        return self

    def starting_at(self, machine: Machine) -> DesignProblem:
        """The same problem, begun where another machine is: an earlier design, or the answer of a smaller problem.

        Parameters
        ----------
        machine : Machine
            Gives the values of the variables. Those that it does not have keep their own.

        Raises
        ------
        SpecError
            If it has none of the variables.
        """
        own, found = self.start(), {}
        for v in self.variables:
            try:
                number = value(machine, find(machine, v.name)[0])
            except SpecError:
                continue
            found[v.name] = min(max(float(number), v.lower), v.upper)
        if not found:
            raise SpecError(
                "has none of the problem's variables",
                field="machine",
                got=machine.name,
                remedy=f"give a machine with numbers such as {self.variables[0].name}",
            )
        return replace_fields(self, machine=self.with_values({**own, **found}))

    def _objective(self) -> Measure:
        given = [(n, getattr(self, n)) for n in ("maximise", "minimise") if getattr(self, n) is not None]
        if len(given) != 1:
            raise SpecError(
                "is missing" if not given else "is given beside `maximise`",
                field="maximise" if not given else "minimise",
                remedy='say what is sought, once: maximise = "stability_limit"',
            )
        word, raw = given[0]
        table = dict(raw) if isinstance(raw, Mapping) else {"quantity": raw}
        measure = read_measure(word, table.pop("quantity", None), table)
        choices = [q.name for q in QUANTITIES.values() if q.objective and q.upper == (word == "minimise")]
        if measure.quantity not in choices:
            raise SpecError(
                f"cannot be {word}d", field=word, got=measure.quantity, remedy="choose one of " + ", ".join(choices)
            )
        if measure.quantity == "stability_limit" and self.speed is not None:
            raise SpecError(
                "is not fixed when the stability limit is sought",
                field="speed",
                got=self.speed,
                remedy="remove it; operation.top_speed of the machine ends the search",
            )
        if measure.quantity != "stability_limit" and not (is_number(self.speed) and 0.0 < self.speed < math.inf):
            raise SpecError(
                "is missing" if self.speed is None else "must be a positive speed",
                field="speed",
                got=self.speed,
                remedy=f"say up to which speed [rad/s] the machine must be stable while {measure.quantity} is {word}d",
            )
        return measure
