"""Base of all specification objects: fields that know their unit, their domain and their meaning."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import MISSING, dataclass, field, fields
from numbers import Real
from typing import Any, TypeAlias, TypeGuard

import casadi as ca

from ..errors import SpecError

Number: TypeAlias = Any
"""A float, or a CasADi SX or MX scalar, which makes the field a design variable."""

OptionalNumber: TypeAlias = Any
"""A Number, or None where the field is left out."""

_DOMAINS: dict[str, tuple[Callable[[float], bool], str, str]] = {
    "any": (lambda x: True, "", ""),
    "positive": (lambda x: x > 0.0, "must be positive", "give a value above zero"),
    "nonnegative": (lambda x: x >= 0.0, "must not be negative", "give zero or a value above it"),
}


def number(
    unit: str,
    doc: str,
    *,
    domain: str = "any",
    options: tuple[str, ...] = (),
    default: Any = MISSING,
    switch: bool = False,
) -> Any:
    """Declare a number field.

    Parameters
    ----------
    unit : str
        SI unit, ``""`` for a pure number.
    doc : str
        One line for the reader of the problem-file reference.
    domain : {"any", "positive", "nonnegative"}
        Admissible values.
    options : tuple of str, optional
        Words that may stand in place of a number.
    default : float or None, optional
        ``None`` means that the field may be left out.
    switch : bool
        True if zero leaves a block with its states out of the model, so that the field cannot be varied around zero.
    """
    if domain not in _DOMAINS:
        raise ValueError(f"unknown domain {domain}")
    return field(
        default=default, metadata={"unit": unit, "domain": domain, "words": options, "doc": doc, "switch": switch}
    )


def part(doc: str, *, default: Any = MISSING) -> Any:
    """Declare a field that is no number: an object, a tuple of objects, a name or a choice."""
    return field(default=default, metadata={"doc": doc})


def choice(doc: str, options: tuple[str, ...], *, default: Any = MISSING, written: bool = False) -> Any:
    """Declare a field that takes one of a few words; `written` ones are stated in files even at their default."""
    return field(default=default, metadata={"doc": doc, "options": options, "written": written})


def matrix(doc: str, *, default: Any = MISSING) -> Any:
    """Declare a field that holds a matrix: rows of numbers (lists, arrays, a CasADi DM), kept as tuples, or a CasADi expression."""
    return field(default=default, metadata={"doc": doc, "matrix": True})


def is_symbolic(value: Any) -> bool:
    """True if the value is a CasADi expression that holds a symbol.

    Parameters
    ----------
    value : object
        Anything.
    """
    return isinstance(value, ca.SX | ca.MX) and not value.is_constant()


def is_number(value: Any) -> TypeGuard[float]:
    """True for the plain numbers of a specification (not bool, not symbols)."""
    return isinstance(value, Real) and not isinstance(value, bool)


def is_whole(value: Any) -> TypeGuard[int]:
    """True for whole numbers (not bool)."""
    return isinstance(value, int) and not isinstance(value, bool)


@dataclass(frozen=True, kw_only=True)
class Spec:
    """A frozen part of a machine; checks its own fields when it is made."""

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if isinstance(value, list) and "unit" not in f.metadata:  # frozen objects hold tuples, which can be hashed
                value = tuple(value)
                object.__setattr__(self, f.name, value)
            if "unit" in f.metadata:
                self._check_number(f, value)
            elif "matrix" in f.metadata:
                object.__setattr__(self, f.name, _rows(f.name, value))
            elif "options" in f.metadata and not (isinstance(value, str) and value in f.metadata["options"]):
                raise SpecError(
                    "is not known", field=f.name, got=value, remedy="choose one of " + ", ".join(f.metadata["options"])
                )
        self.check()

    def _check_number(self, f: Any, value: Any) -> None:
        if isinstance(value, ca.SX | ca.MX):
            if value.shape != (1, 1):
                raise SpecError("must be a scalar", field=f.name, got=value.shape, remedy="give one CasADi scalar")
            return
        if value is None and f.default is None:
            return
        if isinstance(value, str) and value in f.metadata["words"]:
            return
        unit = f.metadata["unit"]
        kind = f"number in {unit}" if unit else "plain number"
        if not is_number(value):
            words = "".join(f" or '{word}'" for word in f.metadata["words"])
            raise SpecError("must be a number", field=f.name, got=value, remedy=f"give a {kind}{words}")
        if not -math.inf < value < math.inf:  # unlike math.isfinite it bears integers beyond the floats
            raise SpecError("must be finite", field=f.name, got=value, remedy=f"give a finite {kind}")
        admissible, problem, remedy = _DOMAINS[f.metadata["domain"]]
        if not admissible(value):
            raise SpecError(problem, field=f.name, got=with_unit(value, unit), remedy=remedy)

    def check(self) -> None:
        """Relations between fields; classes override it and raise SpecError."""


class Shown(str):
    """A value already formatted with its unit, shown in messages without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def with_unit(value: Any, unit: str) -> Any:
    """The value as a message shows it: ``1.31 m``."""
    return Shown(f"{value:g} {unit}".strip()) if is_number(value) else value


def _rows(name: str, entries: Any) -> Any:
    """Rows as tuples of floats; CasADi expressions as they are."""
    if isinstance(entries, ca.SX | ca.MX):
        return entries
    entries = entries.full() if isinstance(entries, ca.DM) else entries
    try:
        rows = tuple(tuple(float(x) for x in row) for row in entries)
    except (TypeError, ValueError):
        rows = ((math.nan,),)
    if not all(math.isfinite(x) for row in rows for x in row):
        raise SpecError(
            "must hold finite numbers only", field=name, remedy="give a list of rows: [[1.0, 0.0], [0.0, 1.0]]"
        )
    if len({len(row) for row in rows}) > 1:
        raise SpecError(
            "has rows of different lengths", field=name, remedy="give each row as many numbers as the first"
        )
    return rows
