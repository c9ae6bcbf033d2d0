"""Machine files: finding, reading and writing them.

A machine file is TOML data that mirrors the specification objects; nothing in it is executed. Its tables hold the
fields of the objects under their own names. Numbers are SI, or strings with a unit (``"0.381 mm"``). A file also has

- ``format = "amb_design/1"`` and a table ``[source]`` of strings, title and so on: both mandatory;
- ``[materials.NAME]``: isotropic with ``E``, orthotropic with ``E1``; segments and layups name one by ``material``;
- ``[layups.NAME]``: ``material``, ``angles`` and ``thickness`` of the plies from the inside out, where material and
  thickness are one for all plies or a list; a segment names one by ``layup``;
- ``[variants.NAME]``: the same machine with changes. A variant is laid over the base: tables merge, all other
  values, lists included, replace what the base has, and ``false`` removes it: ``controller = false``.

Whatever is wrong with a file is reported as a SpecError of one sentence.
"""

from __future__ import annotations

import os
import re
import tomllib
from pathlib import Path
from typing import Any

from ..errors import SpecError
from .fields import Shown
from .machine import Machine
from .tables import as_table, closest, inside, machine_of, quoted, tables_of

FORMAT = "amb_design/1"
FILE_NAME = "machine.toml"
MAX_BYTES = 1_000_000
MAX_DOTS = 1000  # in a line: a key of very many parts takes minutes to read


def load(path_or_name: str | os.PathLike[str], variant: str | None = None) -> Machine:
    """Read a machine.

    Parameters
    ----------
    path_or_name : str or path
        A machine file, a folder with a ``machine.toml``, or the name of a packaged problem.
    variant : str, optional
        Name of one of the file's variants; the base machine if left out.

    Returns
    -------
    Machine

    Raises
    ------
    SpecError
        If there is no such file or anything in it is wrong.
    """
    path = resolve(path_or_name)
    return loads(_text(path), variant, str(path))


def load_variants(path_or_name: str | os.PathLike[str]) -> dict[str, Machine]:
    """Read all variants of a machine.

    Parameters
    ----------
    path_or_name : str or path
        As in `load`.

    Returns
    -------
    dict of str to Machine
        By the variants' names, in the order of the file; a file without variants gives its one machine
        under the machine's name.

    Raises
    ------
    SpecError
        If there is no such file or anything in it, the base machine included, is wrong.
    """
    path = resolve(path_or_name)
    text = _text(path)
    base = loads(text, file=str(path))
    names = tomllib.loads(text).get("variants", {})
    return {name: loads(text, name, str(path)) for name in names} or {base.name: base}


def loads(text: str, variant: str | None = None, file: str = "") -> Machine:
    """Read a machine from the text of a file.

    Parameters
    ----------
    text : str
        Content of a machine file.
    variant : str, optional
        Name of one of the variants; the base machine if left out.
    file : str, optional
        Name of the file for error messages.

    Returns
    -------
    Machine

    Raises
    ------
    SpecError
        If anything in the text is wrong.
    """
    try:
        tables = _parse(text)
        if variant is not None:
            tables = _with_variant(tables, variant)
            file = f"{file} (variant {variant})".lstrip()
        return machine_of(tables)
    except SpecError as error:
        raise error.in_file(file) from None
    except RecursionError:
        raise _too_deep().in_file(file) from None


def dumps(machine: Machine) -> str:
    """Write a machine as the text of a file.

    Parameters
    ----------
    machine : Machine
        All its numbers must be known; symbols have no place in a file.

    Returns
    -------
    str
        TOML that `loads` turns into an equal machine. Numbers are SI; fields at their defaults are left out.

    Raises
    ------
    SpecError
        If a number is a CasADi expression or the machine cites no source.
    """
    import tomli_w  # imported late: reading does not need it

    if not machine.source:
        raise SpecError("is missing", field="source", remedy="say where the numbers come from: set machine.source")
    return tomli_w.dumps({"format": FORMAT, **tables_of(machine)})


def save(machine: Machine, path: str | os.PathLike[str]) -> None:
    """Write a machine to a file.

    Parameters
    ----------
    machine : Machine
        As in `dumps`.
    path : str or path
        File to write; an existing one is replaced.

    Raises
    ------
    SpecError
        As in `dumps`; then no file is touched.
    """
    text = dumps(machine)
    Path(path).write_text(text, encoding="utf-8")


def packaged() -> dict[str, Path]:
    """Folders of the problems that come with the package, by name.

    Returns
    -------
    dict of str to Path
        In alphabetical order.
    """
    here = Path(__file__).resolve()
    roots = [here.parents[1] / "problems"]  # in an installed package
    if here.parents[2].name == "src":
        roots.append(here.parents[3] / "problems")  # in a source checkout
    found = {file.parent.name: file.parent for root in roots for file in root.glob(f"*/{FILE_NAME}")}
    return dict(sorted(found.items()))


def resolve(path_or_name: str | os.PathLike[str]) -> Path:
    """Find a machine file.

    Parameters
    ----------
    path_or_name : str or path
        A file, a folder with a ``machine.toml``, or the name of a packaged problem, looked for in this order.

    Returns
    -------
    Path
        The machine file.

    Raises
    ------
    SpecError
        If nothing is found; the sentence names the closest packaged problem.
    """
    path, problems = Path(path_or_name), packaged()
    for candidate in (path, path / FILE_NAME, problems.get(str(path_or_name), path) / FILE_NAME):
        if os.path.isfile(candidate):
            return candidate
    name = str(path_or_name)
    if os.path.isdir(path):
        raise SpecError(f"is a folder without {FILE_NAME}", field=quoted(name), remedy="name one that has it")
    if os.path.exists(path):
        raise SpecError("is no regular file", field=quoted(name), remedy="name a machine file")
    guess = path.parent.name if path.name == FILE_NAME else path.stem
    raise SpecError(
        "is neither a file, a folder nor a packaged problem", field=quoted(name), remedy=closest(guess, problems)
    )


def _text(path: Path) -> str:
    """Content of a machine file; refuses by size before it reads."""
    file = str(path)
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            problem = f"is {size / 1e6:.3g} MB; a machine file has a few kB"
            raise SpecError(problem, file=file, remedy="check the name")
        content = path.read_bytes()
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise SpecError(f"cannot be read ({reason})", file=file, remedy="check its permissions") from None
    if not content.strip():
        raise SpecError("is empty", file=file, remedy=f'start with format = "{FORMAT}" and see the packaged problems')
    if b"\0" in content:
        raise SpecError("is a binary file", file=file, remedy="machine files are TOML text in UTF-8")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise SpecError("is not in UTF-8", field=f"line {line}", file=file, remedy="save it as UTF-8 text") from None


def _too_deep() -> SpecError:
    return SpecError("is nested too deeply", remedy="machine files need a handful of levels")


def _parse(text: str) -> dict[str, Any]:
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
    as_table(tables.get("variants", {}), "variants")
    return tables


def _with_variant(tables: dict[str, Any], variant: str) -> dict[str, Any]:
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
    changes = as_table(variants[variant], f"variants.{quoted(variant)}")
    for key in ("format", "name", "variants"):
        if key in changes:
            raise SpecError("cannot be changed by a variant", field=key, got=changes[key], remedy="remove the line")
    merged = _merge(tables, changes)
    return {**merged, "name": f"{merged['name']}: {variant}"} if isinstance(merged.get("name"), str) else merged


def _merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in changes.items():
        with inside(key):
            if value is False:
                if key not in base:
                    got = Shown("false")
                    raise SpecError("removes what the base does not have", got=got, remedy=closest(key, base))
                del merged[key]
            elif isinstance(value, dict) and isinstance(base.get(key), dict):
                merged[key] = _merge(base[key], value)
            else:
                merged[key] = value
    return merged
