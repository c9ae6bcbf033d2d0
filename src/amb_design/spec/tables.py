"""Tables to specification objects and back: one decoder and one encoder, driven by the fields of the dataclasses.

A field's unit, words and type say how its value is written; no class needs code of its own. Two things are written once
and referred to by name: materials and layups.
"""

from __future__ import annotations

import dataclasses
import difflib
import json
import re
import typing
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import Any, TypeVar

from ..errors import SpecError
from ..units import parse_quantity
from .controller import HARDWARE
from .fields import Spec, is_number
from .machine import Machine
from .material import Isotropic, Material, Orthotropic
from .shaft import Ply, Segment

S = TypeVar("S", bound=Spec)

LAYUP = {"material": "material", "angles": "angle", "thickness": "thickness"}  # key of a layup: field of a ply
ALIASES: dict[type, dict[str, str]] = {Segment: {"layup": "plies"}}  # key in a file: field that it fills


def machine_of(tables: dict[str, Any]) -> Machine:
    """A machine from the tables of a file.

    Parameters
    ----------
    tables : dict
        What TOML gives; variants are ignored.

    Returns
    -------
    Machine

    Raises
    ------
    SpecError
        With the path of the field that is wrong.
    """
    names = _Names()
    names.materials = _read_all(tables, "materials", names.material)
    names.layups = _read_all(tables, "layups", names.layup)
    extra = ("format", "materials", "layups", "variants")
    machine: Machine = names.spec(Machine, {k: v for k, v in tables.items() if k not in extra}, extra)
    if not machine.source:
        remedy = "say where the numbers come from: [source] with title = '...'"
        raise SpecError("is missing", field="source", remedy=remedy)
    return machine


def spec_of(cls: type[S], table: Any) -> S:
    """An object of a class of specifications that names neither materials nor layups, from its table.

    Parameters
    ----------
    cls : type
    table : dict

    Raises
    ------
    SpecError
        With the path of the field that is wrong.
    """
    found: S = _Names().spec(cls, table)
    return found


def controller_of(table: Any, former: Any = None) -> Any:
    """A controller from its table.

    Parameters
    ----------
    table : dict
    former : Controller, optional
        Whose hardware (`HARDWARE`) it takes over where the table gives none.

    Returns
    -------
    Controller

    Raises
    ------
    SpecError
        With the path of the field that is wrong.
    """
    names = _Names()
    _, _, classes = _kind(Machine, "controller")
    kind = _of_type(classes, table)
    known = {f.name for f in dataclasses.fields(kind)}
    built = {
        name: getattr(former, name)
        for name in HARDWARE
        if name in known and name not in table and getattr(former, name, None) is not None
    }
    return names.spec(kind, table, given=built)


def _read_all(tables: dict[str, Any], section: str, read: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    found = {}
    for name, table in as_table(tables.get(section, {}), section).items():
        with inside(section), inside(name):
            found[name] = read(as_table(table))
    return found


class _Names:
    """The decoder, with the materials and layups that a file has defined so far."""

    def __init__(self) -> None:
        self.materials: dict[str, Material] = {}
        self.layups: dict[str, tuple[Ply, ...]] = {}

    def spec(self, cls: Any, table: Any, extra: Iterable[str] = (), given: Mapping[str, Any] | None = None) -> Any:
        """An object of class `cls` from its table; `extra` are further keys that are known in its place, `given` fields that
        are known already."""
        fields = {f.name: f for f in dataclasses.fields(cls)}
        aliases = ALIASES.get(cls, {})
        values: dict[str, Any] = dict(given or {})
        for key, raw in as_table(table).items():
            name = aliases.get(key, key)
            with inside(key):
                if name not in fields:
                    raise SpecError("is an unknown key", got=raw, remedy=closest(key, [*fields, *aliases, *extra]))
                if name in values:
                    raise SpecError("is given twice", remedy=f"give {' or '.join([name, *aliases])}, not both")
                values[name] = self.value(cls, fields[name], raw)
        for f in fields.values():
            if f.name not in values and f.default is f.default_factory is dataclasses.MISSING:
                unit = f" [{f.metadata['unit']}]" if f.metadata.get("unit") else ""
                raise SpecError("is missing", field=f.name, remedy=f"add it: {f.metadata['doc']}{unit}")
        return cls(**values)

    def value(self, cls: type, f: dataclasses.Field[Any], raw: Any) -> Any:
        """The value of field `f` of class `cls`; what the object judges better is passed on to it."""
        hint, many, parts = _kind(cls, f.name)
        if "unit" in f.metadata:
            return si_number(raw, f.metadata)
        if many:
            if Ply in parts and not isinstance(raw, list):
                return self.named("layup", self.layups, raw)
            if not isinstance(raw, list):
                raise SpecError("must be a list of tables", got=raw, remedy=f"write [[{f.name}]] above each of them")
            items = []
            for i, item in enumerate(raw):
                with inside(f"[{i}]"):
                    items.append(self.part(parts, item))
            return tuple(items)
        if parts:
            return self.part(parts, raw)
        if hint is str and "options" not in f.metadata and not (isinstance(raw, str) and (raw or f.default == "")):
            raise SpecError("must be text", got=raw, remedy="write some text in quotes")
        if hint == Mapping[str, str]:
            return texts(raw)
        return raw

    def part(self, classes: tuple[type, ...], raw: Any) -> Any:
        """A part of the machine: its own table, except for a material, which is defined elsewhere under a name."""
        if Isotropic in classes:
            return self.named("material", self.materials, raw)
        return self.spec(_of_type(classes, raw) if len(classes) > 1 else classes[0], raw)

    def material(self, table: dict[str, Any]) -> Any:
        return self.spec(Orthotropic if "E1" in table else Isotropic, table)

    def named(self, kind: str, known: Mapping[str, Any], name: Any) -> Any:
        if isinstance(name, str) and name in known:
            return known[name]
        remedy = closest(name if isinstance(name, str) else "", known) or f"define one in [{kind}s.NAME]"
        raise SpecError(f"names no {kind} of this file", got=name, remedy=remedy)

    def layup(self, table: dict[str, Any]) -> tuple[Ply, ...]:
        for key in table:
            if key not in LAYUP:
                raise SpecError("is an unknown key", field=quoted(key), remedy=closest(key, LAYUP))
        for key in LAYUP:
            if key not in table:
                raise SpecError("is missing", field=key, remedy=f"a layup needs {', '.join(LAYUP)}")
        angles = table["angles"]
        if not isinstance(angles, list) or not angles:
            remedy = "give the angle of each ply: [0, '90 deg']"
            raise SpecError("must be a list", field="angles", got=angles, remedy=remedy)
        for key in LAYUP:
            if isinstance(table[key], list) and len(table[key]) != len(angles):
                problem = f"has {len(table[key])} entries for {len(angles)} angles"
                raise SpecError(problem, field=key, remedy="give one for all plies, or one for each angle")
        return tuple(self.ply(table, i) for i in range(len(angles)))

    def ply(self, table: dict[str, Any], i: int) -> Ply:
        each = {key: isinstance(table[key], list) for key in LAYUP}
        try:
            values = {LAYUP[key]: table[key][i] if many else table[key] for key, many in each.items()}
            ply: Ply = self.spec(Ply, values)
            return ply
        except SpecError as error:  # found in a ply, but written in a list of the layup
            where = {LAYUP[key]: f"{key}[{i}]" if many else key for key, many in each.items()}
            field = where.get(error.field, error.field)
            raise SpecError(error.problem, field=field, got=error.got, remedy=error.remedy) from None


def si_number(raw: Any, metadata: Mapping[str, Any]) -> Any:
    """A number of a file in SI; what is no number, such as a word or a list, is passed on to be judged elsewhere.

    Parameters
    ----------
    raw : object
        A number, or a text with a unit.
    metadata : mapping
        Of the field: its ``unit``, and the ``words`` that it takes.
    """
    words = metadata.get("words", ())
    if isinstance(raw, str) and raw not in words:
        if words and not re.match(r"\s*[-+.\d]", raw):
            return raw  # a misspelt word: the object knows what it should have been
        return parse_quantity(raw, metadata["unit"])
    try:
        return float(raw) if is_number(raw) else raw
    except OverflowError:
        return float("inf")


def texts(raw: Any) -> dict[str, str]:
    """The value itself, if it is a table of texts.

    Parameters
    ----------
    raw : object
    """
    for key, text in as_table(raw).items():
        if not isinstance(text, str) or not text.strip():
            raise SpecError("must be text", field=quoted(key), got=text, remedy="write it in quotes")
    return dict(raw)


def _of_type(classes: tuple[type, ...], raw: Any) -> type:
    """The class whose ``type`` a table names; the first where it names none."""
    kinds = {f.metadata["options"][0]: c for c in classes for f in dataclasses.fields(c) if f.name == "type"}
    word = as_table(raw).get("type", next(iter(kinds)))
    if not (isinstance(word, str) and word in kinds):
        raise SpecError("is not known", field="type", got=word, remedy="choose one of " + ", ".join(kinds))
    return kinds[word]


@cache
def _kind(cls: type, name: str) -> tuple[Any, bool, tuple[type, ...]]:
    """Type of a field, whether it is a tuple of parts, and the classes of its parts."""
    hint = typing.get_type_hints(cls)[name]
    many = typing.get_origin(hint) is tuple
    inner = typing.get_args(hint)[0] if many else hint
    options = typing.get_args(inner) or (inner,)  # a union, often with None
    return hint, many, tuple(c for c in options if isinstance(c, type) and issubclass(c, Spec))


def tables_of(machine: Machine) -> dict[str, Any]:
    """The tables of a file that holds a machine.

    Parameters
    ----------
    machine : Machine
        All its numbers must be known.

    Returns
    -------
    dict
        In the order in which they are written; fields at their defaults are left out.

    Raises
    ------
    SpecError
        If a number is a CasADi expression.
    """
    writer = _Writer()
    body = writer.table(machine)
    head: dict[str, Any] = {key: body[key] for key in ("name", "source", "operation")}  # what a reader wants first
    named = {"materials": writer.materials, "layups": writer.layups}
    return {**head, **{key: tables for key, tables in named.items() if tables}, **body}


class _Writer:
    """The encoder, with the tables of the materials and layups that it has named so far."""

    def __init__(self) -> None:
        self.names: dict[Any, str] = {}
        self.materials: dict[str, dict[str, Any]] = {}
        self.layups: dict[str, dict[str, Any]] = {}

    def table(self, spec: Spec) -> dict[str, Any]:
        """The fields of an object that differ from their defaults."""
        table: dict[str, Any] = {}
        for f in dataclasses.fields(spec):
            value = getattr(spec, f.name)
            with inside(f.name):
                if "unit" in f.metadata and not isinstance(value, float | int | str | None):
                    raise SpecError("is a CasADi expression", remedy="put a number in its place before saving")
                if value is None or (value == f.default and not f.metadata.get("written")):
                    continue
                if isinstance(value, Isotropic | Orthotropic):
                    table[f.name] = self.name(value, "material", self.materials, self.table)
                elif "matrix" in f.metadata:
                    if not isinstance(value, tuple):
                        raise SpecError("is a CasADi matrix", remedy="put numbers in its place before saving")
                    table[f.name] = [list(row) for row in value]
                elif isinstance(value, tuple) and isinstance(value[0], Ply):
                    table["layup"] = self.name(value, "layup", self.layups, self.layup)
                elif isinstance(value, tuple):
                    table[f.name] = [self.table(item) for item in value]
                elif isinstance(value, Spec):
                    table[f.name] = self.table(value)
                elif isinstance(value, Mapping):
                    table[f.name] = dict(value)
                else:
                    table[f.name] = float(value) if isinstance(value, float) else value  # numpy's floats too
        return table

    def name(self, value: Any, kind: str, tables: dict[str, Any], write: Callable[[Any], dict[str, Any]]) -> str:
        """The name under which equal materials or layups are written once."""
        written = write(value)  # before it is looked up, for symbols cannot be compared
        if value not in self.names:
            self.names[value] = f"{kind}{len(tables) + 1}"
            tables[self.names[value]] = written
        return self.names[value]

    def layup(self, plies: tuple[Ply, ...]) -> dict[str, Any]:
        rows = [self.table(ply) for ply in plies]
        columns = {key: [row[name] for row in rows] for key, name in LAYUP.items()}
        return {k: c[0] if k != "angles" and all(x == c[0] for x in c) else c for k, c in columns.items()}


@contextmanager
def inside(key: str) -> Iterator[None]:
    """Errors raised within get `key` in front of their field."""
    try:
        yield
    except SpecError as error:
        raise error.inside(quoted(key)) from None


def quoted(key: str) -> str:
    """A key as TOML writes it, shortened if it is absurd."""
    key = key if len(key) <= 200 else key[:200] + "..."
    return key if re.fullmatch(r"[\w./\\:~+ -]+|\[\d+\]", key) else json.dumps(key)


def as_table(raw: Any, field: str = "") -> dict[str, Any]:
    """The value itself, if it is a table."""
    if not isinstance(raw, Mapping):
        remedy = f"write [{field or 'its.path'}], then lines of key = value"
        raise SpecError("must be a table", field=field, got=raw, remedy=remedy)
    return dict(raw)


def by_path(tables: Mapping[str, Any], section: str) -> dict[str, Any]:
    """A section whose keys are paths into the machine.

    Parameters
    ----------
    tables : mapping
        That may hold the section.
    section : str
    """
    found = as_table(tables.get(section, {}), section)
    for key, raw in found.items():
        if isinstance(raw, dict):  # controller.kp = 1 without quotes is a table in a table
            remedy = f'write the whole path in quotes: "{key}.{next(iter(raw), "...")}" = ...'
            raise SpecError("is no path", field=f"{section}.{quoted(key)}", remedy=remedy)
    return found


def closest(word: str, known: Iterable[str]) -> str:
    """The remedy for an unknown word: the closest known one, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(word, known, n=1)
    if near:
        return f"did you mean `{near[0]}`?"
    return "known are " + ", ".join(quoted(k) for k in known) if known else ""
