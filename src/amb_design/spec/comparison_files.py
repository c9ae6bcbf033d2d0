"""Comparison files: which designs are compared, and under which conditions.

A comparison file is TOML data; nothing in it is executed. It has

- ``format``, ``name`` and a table ``[source]`` of texts, all mandatory, and perhaps a ``question``;
- ``[conditions]``: the fields of `Conditions`, with the tables ``force_step``, ``base_shock``, ``unbalance`` and ``tolerances``;
- ``[designs.NAME]``: a ``machine`` (a file, a folder or the name of a packaged problem) with perhaps a ``variant``, or a
  ``problem``, whose stored optimum is taken; a ``controller`` in place of its own; ``changes``, numbers by path;
  ``ideal = true`` for the regulator of an LQG alone, the whole state known; ``design_time``, CPU seconds;
- ``[variants.NAME]``: the same comparison with changes, as in machine files.

Whatever is wrong with a file is reported as a SpecError of one sentence.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import SpecError
from .comparison import Comparison, Conditions
from .controller import ideal_law
from .files import FILE_NAME, PROBLEM_FILE, changed, controlled, load, locate
from .machine import Machine
from .paths import replace
from .problem_files import load_optimum
from .tables import as_table, by_path, closest, inside, quoted, si_number, spec_of, texts
from .toml import Tables, read, text_of

COMPARISON_FILE = "comparison.toml"

KEYS = ("format", "name", "question", "source", "conditions", "designs", "variants")
DESIGN_KEYS = ("machine", "problem", "variant", "controller", "changes", "ideal", "design_time")
DESIGN_FILES = ("design.toml", "design.json")
"""What `amb-design optimise --out` writes: the machine, and beside it what the search cost."""


def load_comparison(path_or_name: str | os.PathLike[str], variant: str | None = None) -> Comparison:
    """Read a comparison.

    Parameters
    ----------
    path_or_name : str or path
        A comparison file, a folder with a ``comparison.toml``, or the name of a packaged problem that has one.
    variant : str, optional
        Name of one of the file's variants; the comparison itself if left out.

    Returns
    -------
    Comparison

    Raises
    ------
    SpecError
        If there is no such file, or anything in it or in the files of its machines is wrong.
    """
    path = locate(path_or_name, (COMPARISON_FILE,))
    return read(text_of(path), variant, str(path), partial(_comparison, folder=path.parent))


def load_conditions(tables: Mapping[str, Any]) -> Conditions:
    """Conditions from their table.

    Parameters
    ----------
    tables : mapping
        What TOML gives for ``[conditions]``.
    """
    table = dict(tables)
    if "unbalance" in table:
        with inside("unbalance"):
            table["unbalance"] = {
                name: _numbers(amounts, "kg m", name) for name, amounts in as_table(table["unbalance"]).items()
            }
    if "tolerances" in table:
        table["tolerances"] = {p: _si(raw, "", f"tolerances.{p}") for p, raw in by_path(table, "tolerances").items()}
    return spec_of(Conditions, table)


def _comparison(tables: Tables, folder: str | os.PathLike[str]) -> Comparison:
    for key, raw in tables.items():
        if key not in KEYS:
            raise SpecError("is an unknown key", field=quoted(key), got=raw, remedy=closest(key, KEYS))
    for key, remedy in (
        ("name", "give the comparison a name"),
        ("source", "say where the conditions come from: [source] with title = '...'"),
        ("designs", "name what is compared: [designs.NAME] with machine = '...' or problem = '...'"),
    ):
        if not tables.get(key):
            raise SpecError("is missing", field=key, remedy=remedy)
    for key in ("name", "question"):
        if not isinstance(tables.get(key, ""), str):
            raise SpecError("must be text", field=key, got=tables[key], remedy="write it in quotes")
    with inside("source"):
        source = texts(tables["source"])
    with inside("conditions"):
        conditions = load_conditions(as_table(tables.get("conditions", {})))
    designs, seconds = {}, {}
    with inside("designs"):
        for name, table in as_table(tables["designs"]).items():
            with inside(name):
                designs[name], spent = _design(as_table(table), folder)
                if spent is not None:
                    seconds[name] = spent
    return Comparison(tables["name"], designs, conditions, seconds, tables.get("question", ""), source)


def _design(table: Tables, folder: str | os.PathLike[str]) -> tuple[Machine, float | None]:
    for key, raw in table.items():
        if key not in DESIGN_KEYS:
            raise SpecError("is an unknown key", field=quoted(key), got=raw, remedy=closest(key, DESIGN_KEYS))
    kinds = [key for key in ("machine", "problem") if key in table]
    if len(kinds) != 1:
        raise SpecError(
            "are both given" if kinds else "are both missing",
            field="machine, problem",
            remedy="name a machine, or a problem whose stored optimum is meant",
        )
    (kind,) = kinds
    for key in (kind, "variant"):
        if key in table and not (isinstance(table[key], str) and table[key]):
            raise SpecError("must be text", field=key, got=table[key], remedy="write a name in quotes")
    with inside(kind):
        names = (FILE_NAME, PROBLEM_FILE) if kind == "machine" else (PROBLEM_FILE,)
        path = _located(table[kind], names, folder)
    machine = (load if kind == "machine" else load_optimum)(path, table.get("variant"))
    if "controller" in table:
        machine = controlled(machine, table["controller"])
    machine = changed(machine, by_path(table, "changes"))
    if not isinstance(table.get("ideal", False), bool):
        raise SpecError("must be true or false", field="ideal", got=table["ideal"], remedy="write true or false")
    if table.get("ideal"):
        machine = replace(machine, {"controller": ideal_law(machine.controller)})
    spent = _si(table.get("design_time"), "s", "design_time")
    if spent is not None and not (isinstance(spent, float) and 0.0 <= spent < float("inf")):
        raise SpecError("must be a time", field="design_time", got=spent, remedy="give CPU seconds")
    return machine, design_time(path) if spent is None else spent


def _located(name: str, names: tuple[str, ...], folder: str | os.PathLike[str]) -> Path:
    try:
        return locate(name, names, folder)
    except SpecError as error:
        raise SpecError(error.problem, got=name, remedy=error.remedy) from None


def design_time(path: str | os.PathLike[str]) -> float | None:
    """CPU seconds of the search that wrote a design file, if its report lies beside it.

    Parameters
    ----------
    path : str or path
        Machine file; one called ``design.toml`` may have a ``design.json``.
    """
    file = Path(path)
    report = file.with_name(DESIGN_FILES[1])
    if file.name != DESIGN_FILES[0] or not report.is_file():
        return None
    try:
        found = json.loads(report.read_text(encoding="utf-8"))["cpu_seconds"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return float(found) if isinstance(found, int | float) else None


def _numbers(raw: Any, unit: str, where: str) -> Any:
    return [_si(item, unit, f"{where}[{i}]") for i, item in enumerate(raw)] if isinstance(raw, list) else raw


def _si(raw: Any, unit: str, where: str) -> Any:
    try:
        return si_number(raw, {"unit": unit})
    except SpecError as error:
        raise error.inside(where) from None
