"""A design problem: what is free, what is sought, and which limits hold."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from dataclasses import replace as replace_fields
from functools import cached_property
from typing import Any

from ..errors import SpecError
from .admissible import check_bounds
from .controller import LQR, StateFeedback, weights
from .fields import Shown, is_number
from .influence import check_influence
from .machine import Machine
from .paths import find, is_switched_off, numbers, replace, value
from .quantities import QUANTITIES, Quantity
from .tables import closest

SCALES = ("linear", "log")

_RESIDUAL = ("unbalance", "unbalance_phase")


@dataclass(frozen=True)
class Variable:
    """A number, or a group of tied numbers, that the design may change.

    Attributes
    ----------
    name : str
        Path of the number; a short one ties all numbers that it fits.
    lower, upper : float
        Bounds in the SI unit of the field.
    scale : {"linear", "log"}
        How the search sees it; logarithmic where it spans decades.
    """

    name: str
    lower: float
    upper: float
    scale: str = "linear"


@dataclass(frozen=True)
class Tie:
    """A number that follows free ones: constant + sum of factor times variable.

    Attributes
    ----------
    name : str
        Path of the number, full or short.
    terms : tuple of (str, float)
        Name of the variable and its factor.
    constant : float
    """

    name: str
    terms: tuple[tuple[str, float], ...]
    constant: float = 0.0


@dataclass(frozen=True)
class Measure:
    """A quantity with its settings.

    Attributes
    ----------
    quantity : str
        A key of ``QUANTITIES``.
    options : tuple of (str, object)
        Settings that differ from their defaults.
    """

    quantity: str
    options: tuple[tuple[str, Any], ...] = ()

    @property
    def kind(self) -> Quantity:
        """What it is."""
        return QUANTITIES[self.quantity]

    def option(self, name: str) -> Any:
        """A setting, or its default."""
        return dict(self.options).get(name, self.kind.options[name].default)


@dataclass(frozen=True)
class Limit(Measure):
    """A bound on a quantity, from above or below as the quantity is.

    Attributes
    ----------
    bound : float
        In the quantity's SI unit.
    """

    bound: float = math.nan


@dataclass(frozen=True)
class UnbalancePattern:
    """A residual unbalance: kg m of each disk, with signs, all in one plane.

    Attributes
    ----------
    name : str
    amounts : tuple of float
        One a disk [kg m].
    """

    name: str
    amounts: tuple[float, ...]


@dataclass(frozen=True)
class Scenario:
    """The machine as it might turn out: factors on some of its numbers and on the residual unbalance.

    Attributes
    ----------
    name : str
    factors : tuple of (str, float)
        Path, full or short, and factor.
    unbalance : float
        Factor on the residual unbalance.
    """

    name: str
    factors: tuple[tuple[str, float], ...] = ()
    unbalance: float = 1.0


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
        self._check_machine()
        self._put("objective", self._objective())
        self._put("variables", tuple(_variable(n, b) for n, b in _mapping(self.free, "free").items()))
        self._put("followers", tuple(_tie(n, t) for n, t in _mapping(self.ties, "ties").items()))
        self._put("patterns", tuple(self._patterns()))
        self._put("constraints", tuple(_limit(n, b) for n, b in _mapping(self.limits, "limits").items()))
        self._put("cases", tuple(_scenario(n, f) for n, f in _mapping(self.scenarios, "scenarios").items()))
        self._put("name", self.name or self.machine.name)
        self._check_variables()
        self._check_measures()
        self._check_scenarios()
        check_influence(self)
        check_bounds(self)

    def _put(self, name: str, found: Any) -> None:
        object.__setattr__(self, name, found)

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

    def _check_machine(self) -> None:
        if not isinstance(self.machine, Machine):
            raise SpecError("must be a machine", field="machine", got=self.machine, remedy="load one or make one")
        for path, number in numbers(self.machine):
            if not is_number(number):
                raise SpecError(
                    "is a symbol in the machine", field=path, remedy="give a number and name the field in `free`"
                )
        if isinstance(self.machine.controller, LQR | StateFeedback):
            raise SpecError(
                "is an ideal that nobody can build",
                field="machine.controller",
                got=self.machine.controller.type,
                remedy="design with pid, state_space or lqg, and analyse the ideal by itself",
            )
        for key in ("name", "question"):
            if not isinstance(getattr(self, key), str):
                raise SpecError("must be text", field=key, got=getattr(self, key), remedy="write it in quotes")

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
        measure = _measure(word, table.pop("quantity", None), table)
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

    def _patterns(self) -> Iterator[UnbalancePattern]:
        disks = self.machine.rotor.disks
        for name, amounts in _mapping(self.unbalance, "unbalance").items():
            where = f"unbalance.{name}"
            if isinstance(amounts, str) or not isinstance(amounts, Sequence) or len(amounts) != len(disks):
                raise SpecError(
                    f"must give one amount in kg m for each of the {len(disks)} disks",
                    field=where,
                    got=amounts,
                    remedy="list them in the order of rotor.disks; 0 for a balanced one",
                )
            found = tuple(
                _finite(a, f"{where}[{i}]", "give mass times eccentricity in kg m") for i, a in enumerate(amounts)
            )
            if not any(found):
                raise SpecError("is zero at every disk", field=where, remedy="give mass times eccentricity in kg m")
            yield UnbalancePattern(name, found)

    def _check_variables(self) -> None:
        if not self.variables:
            raise SpecError("is empty", field="free", remedy='name what may change: "controller.kp" = [lower, upper]')
        taken: dict[str, str] = {}
        for group, section in ((self.variables, "free"), (self.followers, "ties")):
            for item in group:
                where = f"{section}.{item.name}"
                for path in _find(self.machine, item.name, section):
                    if path in taken:
                        raise SpecError(
                            f"sets {path}, which {taken[path]} sets too", field=where, remedy="name each number once"
                        )
                    taken[path] = where
                    if is_switched_off(self.machine, path):
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
        known = [v.name for v in self.variables]
        for tie in self.followers:
            for name, _ in tie.terms:
                if name not in known:
                    tied = name in [other.name for other in self.followers]
                    raise SpecError(
                        "is tied itself" if tied else "names no variable",
                        field=f"ties.{tie.name}.{name}",
                        remedy="follow its variables instead" if tied else closest(name, known),
                    )

    def _check_measures(self) -> None:
        for limit in self.constraints:
            where = f"limits.{limit.quantity}"
            if limit.quantity == self.objective.quantity:
                raise SpecError(
                    "is limited and sought at once", field=where, remedy="remove the limit or seek something else"
                )
            if limit.quantity == "stability_limit":
                raise SpecError(
                    "is what `speed` asks for", field=where, remedy='remove it and write speed = "9000 rpm"'
                )
            least, greatest = _REACH.get(limit.quantity, (0.0, math.inf))
            if not least < limit.bound < greatest:
                between = f"above {least:g}" + (f" and below {greatest:g}" if greatest < math.inf else "")
                raise SpecError("cannot be met", field=where, got=limit.bound, remedy=f"give a limit {between}")
        named = [(f"limits.{c.quantity}", c) for c in self.constraints]
        word = "maximise" if self.maximise is not None else "minimise"
        for where, measure in [*named, (word, self.objective)]:
            for need in measure.kind.needs:
                problem = _MISSING[need](self)
                if problem:
                    raise SpecError(problem[0], field=where, remedy=problem[1])
            self._check_disks(where, measure)

    def _check_disks(self, where: str, measure: Measure) -> None:
        if "disks" not in measure.kind.options:
            return
        disks = self.machine.rotor.disks
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

    def _check_scenarios(self) -> None:
        for case in self.cases:
            taken: dict[str, str] = {}
            where = f"scenarios.{case.name}"
            if not case.factors and case.unbalance == 1.0:
                raise SpecError("changes nothing", field=where, remedy='give factors: "magnets.gap" = 1.05')
            for name, _ in case.factors:
                for path in _find(self.machine, name, where):
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
                    if path in {f"controller.{name}" for name in weights(self.machine.controller)}:
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


def _mapping(raw: Any, section: str) -> Mapping[str, Any]:
    if not isinstance(raw, Mapping):
        raise SpecError(
            "must be a table", field=section, got=raw, remedy=f"write [{section}], then lines of key = value"
        )
    return raw


def _find(machine: Machine, path: str, section: str) -> tuple[str, ...]:
    try:
        return find(machine, path)
    except SpecError as error:
        raise error.inside(section) from None


def _finite(raw: Any, where: str, remedy: str) -> float:
    try:
        found = float(raw) if is_number(raw) else math.nan
    except OverflowError:  # an integer beyond the floats
        found = math.inf
    if not math.isfinite(found):
        raise SpecError("must be a finite number", field=where, got=raw, remedy=remedy)
    return found


def _variable(name: str, raw: Any) -> Variable:
    where = f"free.{name}"
    if isinstance(raw, Variable):
        raw = (raw.lower, raw.upper, raw.scale)
    if isinstance(raw, str) or not isinstance(raw, Sequence) or len(raw) not in (2, 3):
        raise SpecError("must be a pair of bounds", field=where, got=raw, remedy="write [lower, upper]")
    lower, upper = (_finite(b, where, "give both bounds as numbers") for b in raw[:2])
    scale = raw[2] if len(raw) == 3 else "linear"
    if not isinstance(scale, str) or scale not in SCALES:
        raise SpecError("has an unknown scale", field=where, got=scale, remedy="choose one of " + ", ".join(SCALES))
    if not lower < upper:
        raise SpecError(
            "has crossed bounds" if lower > upper else "has equal bounds",
            field=where,
            got=Shown(f"[{lower:g}, {upper:g}]"),
            remedy="put the smaller one first" if lower > upper else "widen them or remove the variable",
        )
    if scale == "log" and lower <= 0.0:
        raise SpecError(
            "has a logarithmic scale down to zero or below", field=where, got=lower, remedy="raise the lower bound"
        )
    return Variable(name, lower, upper, scale)


def _tie(name: str, raw: Any) -> Tie:
    where = f"ties.{name}"
    terms = {k: _finite(v, f"{where}.{k}", "give the factor of the variable") for k, v in _mapping(raw, where).items()}
    constant = terms.pop("constant", 0.0)
    if not terms:
        raise SpecError(
            "follows no variable", field=where, remedy='name one with its factor: { "plies[1].angle" = -1 }'
        )
    for key, factor in terms.items():
        if factor == 0.0:
            raise SpecError("has the factor zero", field=f"{where}.{key}", remedy="remove it")
    return Tie(name, tuple(terms.items()), constant)


def _measure(where: str, name: Any, table: Mapping[str, Any]) -> Measure:
    if not isinstance(name, str) or name not in QUANTITIES:
        remedy = closest(name, list(QUANTITIES)) if isinstance(name, str) else "known are " + ", ".join(QUANTITIES)
        raise SpecError("is no known quantity", field=where, got=name, remedy=remedy)
    known = QUANTITIES[name].options
    options = []
    for key, raw in table.items():
        here = f"{where}.{key}"
        if key not in known:
            remedy = closest(key, list(known)) if known else f"{name} has no options"
            raise SpecError("is an unknown option", field=here, got=raw, remedy=remedy)
        options.append((key, _option(here, raw, known[key].unit, known[key].many)))
    for key, option in known.items():
        if option.default is None and key not in table:
            remedy = f"give it in {option.unit}: the {option.doc}"
            raise SpecError("is missing", field=f"{where}.{key}", remedy=remedy)
    return Measure(name, tuple(options))


def _option(where: str, raw: Any, unit: str, many: int) -> Any:
    if unit == "name":
        if isinstance(raw, str) or not isinstance(raw, Sequence) or not raw or not all(isinstance(x, str) for x in raw):
            raise SpecError("must be a list of names", field=where, got=raw, remedy='write ["left", "right"]')
        return tuple(raw)
    if many == 0:
        found = _finite(raw, where, "give a number")
        if found <= 0.0:
            raise SpecError("must be positive", field=where, got=raw, remedy="give a number above zero")
        return found
    if isinstance(raw, str) or not isinstance(raw, Sequence) or len(raw) != many:
        raise SpecError(f"must hold {many} numbers", field=where, got=raw, remedy="write [lower, upper]")
    values = tuple(_finite(x, where, "give numbers") for x in raw)
    if values[0] < 0.0 or list(values) != sorted(set(values)):
        raise SpecError("is no range", field=where, got=raw, remedy="write [lower, upper] with 0 <= lower < upper")
    return values


def _limit(name: str, raw: Any) -> Limit:
    where = f"limits.{name}"
    table = dict(raw) if isinstance(raw, Mapping) else {"limit": raw}
    bound = table.pop("limit", None)
    measure = _measure(where, name, table)
    bound = _finite(
        bound, where, f"give the limit as a number{' in ' + measure.kind.unit if measure.kind.unit else ''}"
    )
    if bound <= 0.0:
        raise SpecError("must be positive", field=where, got=bound, remedy="give a limit above zero")
    return Limit(name, measure.options, bound)


def _scenario(name: str, raw: Any) -> Scenario:
    where = f"scenarios.{name}"
    factors = {}
    for path, factor in _mapping(raw, where).items():
        factors[path] = _finite(factor, f"{where}.{path}", "give a factor; 1 changes nothing")
        if factors[path] <= 0.0:
            raise SpecError("must be positive", field=f"{where}.{path}", got=factor, remedy="give a factor above zero")
    unbalance = factors.pop("unbalance", 1.0)
    return Scenario(name, tuple(factors.items()), unbalance)
