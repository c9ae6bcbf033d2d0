"""Problem files: a machine, what is free in it, what is sought, and which limits hold.

A problem file is TOML data; nothing in it is executed. Numbers are SI, or strings with a unit. Paths into the machine are
keys in quotes and may be short. `KEYS` says what a file has.

Whatever is wrong with a file is reported as a SpecError of one sentence.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from functools import partial
from typing import Any

from ..errors import SpecError
from .files import PROBLEM_FILE, locate, start_machine
from .machine import Machine
from .paths import find, metadata
from .problem import DesignProblem
from .quantities import QUANTITIES
from .tables import as_table, by_path, closest, inside, quoted, si_number, texts
from .toml import Tables, read, read_variants, text_of

KEYS = {
    "format": '`"amb_design/1"`; required',
    "name": "for tables and reports; required",
    "question": "what the problem asks, in a sentence",
    "[source]": "texts that say where limits and bounds come from, such as `title` and `assumed`; required",
    "machine": "where the design starts: a packaged name, a file or a folder; the `machine.toml` beside the file if left out",
    "machine_variant": "a variant of that file",
    "[controller]": "another controller than the machine's; sensor gain, low-pass, delay and amplifier that it leaves out are the machine's own",
    "[changes]": "numbers of the machine, by path, that are replaced before the design starts",
    "maximise": "the quantity sought, or a table with `quantity` and its options; either this or `minimise`",
    "minimise": "the same, where small values are good",
    "speed": "end of the range of speeds, where the objective is not the stability limit; rad/s",
    "[free]": 'variables by path: `[lower, upper]` or `[lower, upper, "log"]`',
    "[ties]": "numbers that follow variables, by path: a factor for each variable, and `constant`",
    "[limits]": "bounds by quantity: a number, or a table with `limit` and the quantity's options",
    "[unbalance]": "residual unbalances by name: for each disk an amount with its sign; the machine's own if left out; kg m",
    "[scenarios.NAME]": "factors by path, and `unbalance` for the residual unbalance; all limits hold for this machine too",
    "[variants.NAME]": "the same problem with changes: tables merge, other values replace, `false` removes",
}
"""What may stand in a problem file, tables in brackets."""

_KNOWN = tuple(key.strip("[]").removesuffix(".NAME") for key in KEYS)

OPTIMUM_FILE = "optimum.toml"
OPTIMUM_FORMAT = "amb_design/optimum/1"


def load_problem(path_or_name: str | os.PathLike[str], variant: str | None = None) -> DesignProblem:
    """Read a design problem.

    Parameters
    ----------
    path_or_name : str or path
        A problem file, a folder with a ``problem.toml``, or the name of a packaged problem.
    variant : str, optional
        Name of one of the file's variants; the problem itself if left out.

    Returns
    -------
    DesignProblem

    Raises
    ------
    SpecError
        If there is no such file or anything in it, or in the file of its machine, is wrong.
    """
    path = locate(path_or_name, (PROBLEM_FILE,))
    return loads_problem(text_of(path), variant, str(path), path.parent)


def load_problem_variants(path_or_name: str | os.PathLike[str]) -> dict[str, DesignProblem]:
    """Read all variants of a design problem.

    Parameters
    ----------
    path_or_name : str or path
        As in `load_problem`.

    Returns
    -------
    dict of str to DesignProblem
        By the variants' names, in the order of the file; a file without variants gives its one problem under the
        problem's name.

    Raises
    ------
    SpecError
        If there is no such file or anything in it, the problem without variants included, is wrong.
    """
    path = locate(path_or_name, (PROBLEM_FILE,))
    return read_variants(text_of(path), str(path), partial(_problem, folder=path.parent))


def load_optimum(path_or_name: str | os.PathLike[str], variant: str | None = None) -> Machine:
    """The machine of a problem's stored optimum.

    Parameters
    ----------
    path_or_name : str or path
        A problem, as in `load_problem`, with an ``optimum.toml`` beside it.
    variant : str, optional
        Name of one of the problem's variants; the problem itself if left out.

    Returns
    -------
    Machine

    Raises
    ------
    SpecError
        If there is none, or it does not belong to the problem.
    """
    problem = load_problem(path_or_name, variant)
    file = locate(path_or_name, (PROBLEM_FILE,)).parent / OPTIMUM_FILE
    if not file.is_file():
        raise SpecError("does not exist", file=str(file), remedy="optimise the problem first")
    try:
        return problem.with_values(_stored(tomllib.loads(text_of(file)), problem, variant or "base"))
    except tomllib.TOMLDecodeError as error:
        raise SpecError(f"is no TOML ({error})", file=str(file), remedy="optimise the problem anew") from None
    except SpecError as error:
        raise (error if error.file else error.in_file(str(file))) from None


def has_optimum(path_or_name: str | os.PathLike[str]) -> bool:
    """True if there is a problem with an ``optimum.toml`` beside it.

    Parameters
    ----------
    path_or_name : str or path
    """
    try:
        return (locate(path_or_name, (PROBLEM_FILE,)).parent / OPTIMUM_FILE).is_file()
    except SpecError:
        return False


def _stored(tables: Tables, problem: DesignProblem, variant: str) -> dict[str, float]:
    if tables.get("format") != OPTIMUM_FORMAT:
        raise SpecError(
            "is not the format of this version", field="format", got=tables.get("format"), remedy="optimise anew"
        )
    optima = as_table(tables.get("optima", {}), "optima")
    if variant not in optima:
        remedy = f"known are {', '.join(optima)}" if optima else "optimise the problem first"
        raise SpecError("is not stored", field=f"optima.{quoted(variant)}", remedy=remedy)
    values = as_table(as_table(optima[variant], f"optima.{variant}").get("values"), f"optima.{variant}.values")
    found = {}
    for v in problem.variables:
        number = values.get(v.name)
        if isinstance(number, bool) or not isinstance(number, int | float):
            where = f"optima.{variant}.values.{quoted(v.name)}"
            raise SpecError("is missing or no number", field=where, got=number, remedy="optimise the problem anew")
        found[v.name] = float(number)
    return found


def loads_problem(
    text: str, variant: str | None = None, file: str = "", folder: str | os.PathLike[str] | None = None
) -> DesignProblem:
    """Read a design problem from the text of a file.

    Parameters
    ----------
    text : str
        Content of a problem file.
    variant : str, optional
        Name of one of the variants; the problem itself if left out.
    file : str, optional
        Name of the file for error messages.
    folder : str or path, optional
        Where the machine is looked for first; the current folder if left out.

    Returns
    -------
    DesignProblem

    Raises
    ------
    SpecError
        If anything in the text, or in the file of its machine, is wrong.
    """
    return read(text, variant, file, partial(_problem, folder=folder))


def _problem(tables: Tables, folder: str | os.PathLike[str] | None) -> DesignProblem:
    if "rotor" in tables:
        raise SpecError("describes a machine, not a design problem", remedy=f"write a {PROBLEM_FILE} beside it")
    for key, raw in tables.items():
        if key not in _KNOWN:
            raise SpecError("is an unknown key", field=quoted(key), got=raw, remedy=closest(key, _KNOWN))
    for key, remedy in (
        ("name", "give the problem a name"),
        ("source", "say where limits and bounds come from: [source] with title = '...'"),
    ):
        if not tables.get(key):
            raise SpecError("is missing", field=key, remedy=remedy)
    with inside("source"):
        source = texts(tables["source"])
    machine = start_machine(tables, folder)
    return DesignProblem(
        machine,
        name=tables["name"],
        question=tables.get("question", ""),
        source=source,
        free={path: _bounds(machine, path, raw) for path, raw in by_path(tables, "free").items()},
        ties={path: _tie(machine, path, raw) for path, raw in as_table(tables.get("ties", {}), "ties").items()},
        maximise=_measure("maximise", tables.get("maximise")),
        minimise=_measure("minimise", tables.get("minimise")),
        speed=_si(tables.get("speed"), "rad/s", "speed"),
        limits={name: _limit(name, raw) for name, raw in as_table(tables.get("limits", {}), "limits").items()},
        unbalance={
            name: _si(raw, "kg m", f"unbalance.{name}")
            for name, raw in as_table(tables.get("unbalance", {}), "unbalance").items()
        },
        scenarios={name: _factors(tables, name) for name in as_table(tables.get("scenarios", {}), "scenarios")},
    )


def _si(raw: Any, unit: str, where: str) -> Any:
    """A number, or a list of them, in SI; the problem judges everything else."""
    if isinstance(raw, list):
        return [_si(item, unit, f"{where}[{i}]") for i, item in enumerate(raw)]
    try:
        return si_number(raw, {"unit": unit})
    except SpecError as error:
        raise error.inside(where) from None


def _unit(machine: Machine, path: str, section: str) -> str:
    try:
        return str(metadata(machine, find(machine, path)[0])["unit"])
    except SpecError as error:
        raise error.inside(section) from None


def _bounds(machine: Machine, path: str, raw: Any) -> Any:
    unit = _unit(machine, path, "free")
    return [*_si(raw[:2], unit, f"free.{path}"), *raw[2:]] if isinstance(raw, list) else raw


def _tie(machine: Machine, path: str, raw: Any) -> Mapping[str, Any]:
    unit, where = _unit(machine, path, "ties"), f"ties.{path}"
    return {
        key: _si(item, unit if key == "constant" else "", f"{where}.{key}")
        for key, item in as_table(raw, where).items()
    }


def _measure(word: str, raw: Any) -> Any:
    if not isinstance(raw, dict):
        return raw
    return {
        key: item if key == "quantity" else _option(word, raw.get("quantity"), key, item) for key, item in raw.items()
    }


def _limit(name: str, raw: Any) -> Any:
    where, unit = f"limits.{name}", QUANTITIES[name].unit if name in QUANTITIES else None
    if unit is None:
        return raw
    if not isinstance(raw, dict):
        return _si(raw, unit, where)
    return {
        key: _si(item, unit, where) if key == "limit" else _option(where, name, key, item) for key, item in raw.items()
    }


def _option(where: str, quantity: Any, key: str, raw: Any) -> Any:
    options = QUANTITIES[quantity].options if isinstance(quantity, str) and quantity in QUANTITIES else {}
    known = key in options and options[key].unit != "name"
    return _si(raw, options[key].unit, f"{where}.{key}") if known else raw


def _factors(tables: Tables, name: str) -> Mapping[str, Any]:
    with inside("scenarios"):
        table = by_path(tables["scenarios"], name)
    return {path: _si(raw, "", f"scenarios.{name}.{path}") for path, raw in table.items()}
