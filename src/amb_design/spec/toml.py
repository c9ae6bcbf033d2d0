"""What machine files and problem files share: TOML text within limits, a format, and variants.

A variant is laid over the base: tables merge, all other values, lists included, replace what the base has, and
``false`` removes it.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ..errors import SpecError
from .fields import Shown
from .tables import as_table, closest, inside, quoted

FORMAT = "amb_design/1"
MAX_BYTES = 1_000_000
MAX_DOTS = 1000  # in a line: a key of very many parts takes minutes to read


class Named(Protocol):
    """What a file describes."""

    @property
    def name(self) -> str:
        """Its name."""


T = TypeVar("T")
N = TypeVar("N", bound=Named)
Tables = dict[str, Any]


def text_of(path: Path) -> str:
    """Content of a file; refuses by size before it reads.

    Parameters
    ----------
    path : Path

    Returns
    -------
    str

    Raises
    ------
    SpecError
        If the file cannot be read or is no text.
    """
    file = str(path)
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            problem = f"is {size / 1e6:.3g} MB; machine and problem files have a few kB"
            raise SpecError(problem, file=file, remedy="check the name")
        content = path.read_bytes()
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise SpecError(f"cannot be read ({reason})", file=file, remedy="check its permissions") from None
    if not content.strip():
        raise SpecError("is empty", file=file, remedy=f'start with format = "{FORMAT}" and see the packaged problems')
    if b"\0" in content:
        raise SpecError("is a binary file", file=file, remedy="machine and problem files are TOML text in UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SpecError("is not in UTF-8", field=f"line {line}", file=file, remedy="save it as UTF-8 text") from None


def read(text: str, variant: str | None, file: str, make: Callable[[Tables], T]) -> T:
    """What a file, or one of its variants, describes.

    Parameters
    ----------
    text : str
        Content of the file.
    variant : str or None
    file : str
        Its name, for errors that do not name another file.
    make : callable
        Turns the tables into the object.

    Raises
    ------
    SpecError
        If anything in the text is wrong.
    """
    try:
        tables = parse(text)
        if variant is not None:
            tables = _with_variant(tables, variant)
            file = f"{file} (variant {variant})".lstrip()
        return make(tables)
    except SpecError as error:
        raise (error if error.file else error.in_file(file)) from None
    except RecursionError:
        raise _too_deep().in_file(file) from None


def read_variants(
    text: str, file: str, make: Callable[[Tables], N], matters: Callable[[Tables], bool] | None = None
) -> dict[str, N]:
    """What the variants of a file describe, by name in the order of the file.

    Parameters
    ----------
    text, file, make
        As in `read`.
    matters : callable, optional
        Tells from its changes whether a variant counts; all do if left out.

    Returns
    -------
    dict
        Of a file without variants that count, what it describes itself, under its own name.
    """
    base = read(text, None, file, make)
    variants: Mapping[str, Any] = tomllib.loads(text).get("variants", {})
    names = [
        name for name, changes in variants.items() if not (matters and isinstance(changes, dict)) or matters(changes)
    ]
    return {name: read(text, name, file, make) for name in names} or {base.name: base}


def parse(text: str) -> Tables:
    """The tables of a file of this version's format.

    Parameters
    ----------
    text : str

    Raises
    ------
    SpecError
        If the text is no TOML or of another format.
    """
    if any(line.count(".") > MAX_DOTS for line in text.splitlines()):
        raise _too_deep()
    try:
        tables = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, or an integer of thousands of digits
        what = str(error)
        place = re.search(r" \(at line (\d+), column \d+\)| \(at end of document\)", what)
        line = f"line {place[1] or text.count(chr(10)) + 1}" if place else "a number"
        what = what[: place.start()] if place else "it has too many digits"
        remedy = "correct the line: key = value, strings in quotes, each key once"
        raise SpecError(f"is no TOML: {what[:1].lower()}{what[1:120]}", field=line, remedy=remedy) from None
    if tables.get("format") != FORMAT:
        problem = "is not the format of this version" if "format" in tables else "is missing"
        raise SpecError(problem, field="format", got=tables.get("format"), remedy=f'write format = "{FORMAT}"')
    for name, changes in as_table(tables.get("variants", {}), "variants").items():
        as_table(changes, f"variants.{quoted(name)}")
    return tables


def _with_variant(tables: Tables, variant: str) -> Tables:
    variants = tables.get("variants", {})
    if variant not in variants:
        remedy = closest(variant, variants) or "it has none at all"
        raise SpecError(f"has no variant {quoted(variant)}", remedy=remedy)
    if not re.fullmatch(r"\w[\w .+-]*", variant):  # it becomes the name of a folder
        raise SpecError(
            "is no name",
            field="variants",
            got=variant,
            remedy="name variants with letters, digits, blanks, dots, + and -",
        )
    changes = variants[variant]
    for key in ("format", "name", "variants"):
        if key in changes:
            raise SpecError("cannot be changed by a variant", field=key, got=changes[key], remedy="remove the line")
    merged = _merge(tables, changes)
    return {**merged, "name": f"{merged['name']}: {variant}"} if isinstance(merged.get("name"), str) else merged


def _merge(base: Tables, changes: Tables) -> Tables:
    merged = dict(base)
    for key, value in changes.items():
        with inside(key):
            if value is False:
                if key not in base:
                    got = Shown("false")
                    raise SpecError("removes what the base does not have", got=got, remedy=closest(key, base))
                del merged[key]
            elif isinstance(value, dict) and isinstance(base.get(key), dict) and not _is_another(base[key], value):
                merged[key] = _merge(base[key], value)
            else:
                merged[key] = value
    return merged


def _is_another(base: Tables, changes: Tables) -> bool:
    """True if the changes make a table one of another type, to which the rest of it has no meaning."""
    return "type" in changes and changes["type"] != base.get("type", "pid")


def _too_deep() -> SpecError:
    return SpecError("is nested too deeply", remedy="machine and problem files need a handful of levels")
