"""Parts of a design problem: variables, ties, quantities, limits, unbalances, scenarios; each read from what a file or a call gives."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import SpecError
from .fields import Shown, is_number
from .quantities import QUANTITIES, Quantity
from .tables import as_table, closest

SCALES = ("linear", "log")


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


def _finite(raw: Any, where: str, remedy: str) -> float:
    try:
        found = float(raw) if is_number(raw) else math.nan
    except OverflowError:  # an integer beyond the floats
        found = math.inf
    if not math.isfinite(found):
        raise SpecError("must be a finite number", field=where, got=raw, remedy=remedy)
    return found


def read_variable(name: str, raw: Any) -> Variable:
    """A variable from its bounds, and the scale if there is one."""
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


def read_tie(name: str, raw: Any) -> Tie:
    """A tied number from its factors."""
    where = f"ties.{name}"
    terms = {k: _finite(v, f"{where}.{k}", "give the factor of the variable") for k, v in as_table(raw, where).items()}
    constant = terms.pop("constant", 0.0)
    if not terms:
        raise SpecError(
            "follows no variable", field=where, remedy='name one with its factor: { "plies[1].angle" = -1 }'
        )
    for key, factor in terms.items():
        if factor == 0.0:
            raise SpecError("has the factor zero", field=f"{where}.{key}", remedy="remove it")
    return Tie(name, tuple(terms.items()), constant)


def read_measure(where: str, name: Any, table: Mapping[str, Any]) -> Measure:
    """A quantity from its name and its options."""
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


def read_limit(name: str, raw: Any) -> Limit:
    """A limit from its bound, or from a table with options."""
    where = f"limits.{name}"
    table = dict(raw) if isinstance(raw, Mapping) else {"limit": raw}
    bound = table.pop("limit", None)
    measure = read_measure(where, name, table)
    bound = _finite(
        bound, where, f"give the limit as a number{' in ' + measure.kind.unit if measure.kind.unit else ''}"
    )
    if bound <= 0.0:
        raise SpecError("must be positive", field=where, got=bound, remedy="give a limit above zero")
    return Limit(name, measure.options, bound)


def read_pattern(name: str, amounts: Any, disks: int) -> UnbalancePattern:
    """A residual unbalance from one amount a disk."""
    where = f"unbalance.{name}"
    if isinstance(amounts, str) or not isinstance(amounts, Sequence) or len(amounts) != disks:
        raise SpecError(
            f"must give one amount in kg m for each of the {disks} disks",
            field=where,
            got=amounts,
            remedy="list them in the order of rotor.disks; 0 for a balanced one",
        )
    found = tuple(_finite(a, f"{where}[{i}]", "give mass times eccentricity in kg m") for i, a in enumerate(amounts))
    if not any(found):
        raise SpecError("is zero at every disk", field=where, remedy="give mass times eccentricity in kg m")
    return UnbalancePattern(name, found)


def read_scenario(name: str, raw: Any) -> Scenario:
    """A scenario from its factors."""
    where = f"scenarios.{name}"
    factors = {}
    for path, factor in as_table(raw, where).items():
        factors[path] = _finite(factor, f"{where}.{path}", "give a factor; 1 changes nothing")
        if factors[path] <= 0.0:
            raise SpecError("must be positive", field=f"{where}.{path}", got=factor, remedy="give a factor above zero")
    unbalance = factors.pop("unbalance", 1.0)
    return Scenario(name, tuple(factors.items()), unbalance)
