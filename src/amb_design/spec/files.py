"""Machine files: finding, reading and writing them.

A machine file is TOML data that mirrors the specification objects; nothing in it is executed. Its tables hold the
fields of the objects under their own names. Numbers are SI, or strings with a unit (``"0.381 mm"``). A file also has

- ``format = "amb_design/1"`` and a table ``[source]`` of strings, title and so on: both mandatory;
- ``[materials.NAME]``: isotropic with ``E``, orthotropic with ``E1``; segments and layups name one by ``material``;
- ``[layups.NAME]``: ``material``, ``angles`` and ``thickness`` of the plies from the inside out, where material and
  thickness are one for all plies or a list; a segment names one by ``layup``;
- ``[variants.NAME]``: the same machine with changes. A variant is laid over the base: tables merge, except that
  a controller of another ``type`` takes the place of the base's; all other values, lists included, replace what the base has, and
  ``false`` removes it: ``controller = false``.

A problem file (see `problem_files`) stands for the machine that its design starts from.

Whatever is wrong with a file is reported as a SpecError of one sentence.
"""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from ..errors import SpecError
from .fields import Number
from .machine import Machine
from .paths import find, metadata, replace
from .tables import by_path, closest, controller_of, machine_of, quoted, si_number, tables_of
from .toml import FORMAT, Tables, read, read_variants, text_of

FILE_NAME = "machine.toml"
PROBLEM_FILE = "problem.toml"
START = ("machine", "machine_variant", "controller", "changes")
"""What in a problem file makes the machine that the design starts from."""


def load(path_or_name: str | os.PathLike[str], variant: str | None = None) -> Machine:
    """Read a machine.

    Parameters
    ----------
    path_or_name : str or path
        A machine file, a folder with a ``machine.toml``, or the name of a packaged problem. A problem file, where there
        is no machine file beside it, gives the machine that the design starts from, under the problem's name.
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
    return loads(text_of(path), variant, str(path), path.parent)


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
        under the machine's name. Variants of a problem that start from the same machine as the problem are left out.

    Raises
    ------
    SpecError
        If there is no such file or anything in it, the base machine included, is wrong.
    """
    path = resolve(path_or_name)
    text = text_of(path)
    matters = _starts_elsewhere if read(text, None, str(path), is_problem) else None
    return read_variants(text, str(path), partial(_machine, folder=path.parent), matters)


def loads(
    text: str, variant: str | None = None, file: str = "", folder: str | os.PathLike[str] | None = None
) -> Machine:
    """Read a machine from the text of a file.

    Parameters
    ----------
    text : str
        Content of a machine file, or of a problem file.
    variant : str, optional
        Name of one of the variants; the base machine if left out.
    file : str, optional
        Name of the file for error messages.
    folder : str or path, optional
        Where a problem's machine is looked for; the current folder if left out.

    Returns
    -------
    Machine

    Raises
    ------
    SpecError
        If anything in the text is wrong.
    """
    return read(text, variant, file, partial(_machine, folder=folder))


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
    found = {
        file.parent.name: file.parent
        for root in roots
        for file_name in (FILE_NAME, PROBLEM_FILE)
        for file in root.glob(f"*/{file_name}")
    }
    return dict(sorted(found.items()))


def resolve(path_or_name: str | os.PathLike[str]) -> Path:
    """Find a machine file, or a problem file in its place.

    Parameters
    ----------
    path_or_name : str or path
        A file, a folder with a ``machine.toml`` or a ``problem.toml``, or the name of a packaged problem, looked for in
        this order.

    Returns
    -------
    Path
        The machine file; the problem file of a folder that has no machine file.

    Raises
    ------
    SpecError
        If nothing is found; the sentence names the closest packaged problem.
    """
    return locate(path_or_name, (FILE_NAME, PROBLEM_FILE))


def locate(
    path_or_name: str | os.PathLike[str], file_names: Iterable[str], folder: str | os.PathLike[str] | None = None
) -> Path:
    """Find a file by its own path, by its folder, or by the name of a packaged problem, in this order.

    Parameters
    ----------
    path_or_name : str or path
    file_names : iterable of str
        What the file may be called in its folder, best first.
    folder : str or path, optional
        What a relative path is relative to; the current folder if left out.

    Returns
    -------
    Path

    Raises
    ------
    SpecError
        If nothing is found.
    """
    name, file_names = str(path_or_name), tuple(file_names)
    path, problems = Path(folder or "", path_or_name), packaged()
    places = (path, problems[name]) if name in problems else (path,)
    for candidate in (path, *(place / file_name for place in places for file_name in file_names)):
        if os.path.isfile(candidate):
            return candidate
    wanted = " or ".join(file_names)
    if name in problems:
        raise SpecError(f"has no {wanted}", field=quoted(name), remedy=_others(name, problems, file_names))
    if os.path.isdir(path):
        raise SpecError(f"is a folder without {wanted}", field=quoted(name), remedy="name one that has it")
    if os.path.exists(path):
        raise SpecError("is no regular file", field=quoted(name), remedy="name a file of TOML text")
    guess = path.parent.name if path.name in file_names else path.stem
    raise SpecError(
        "is neither a file, a folder nor a packaged problem",
        field=quoted(name),
        remedy=_others(guess, problems, file_names),
    )


def _others(word: str, problems: dict[str, Path], file_names: tuple[str, ...]) -> str:
    return closest(word, [n for n, place in problems.items() if any((place / f).is_file() for f in file_names)])


def is_problem(tables: Tables) -> bool:
    """True if the tables are those of a problem file.

    Parameters
    ----------
    tables : dict
    """
    return "rotor" not in tables and any(key in tables for key in ("free", "maximise", "minimise"))


def start_machine(tables: Tables, folder: str | os.PathLike[str] | None = None) -> Machine:
    """The machine that a design problem starts from, under the problem's name.

    Parameters
    ----------
    tables : dict
        Of the problem file.
    folder : str or path, optional
        Where the machine is looked for first; the current folder if left out.

    Returns
    -------
    Machine

    Raises
    ------
    SpecError
        If the machine is not found or anything in its file or in the changes is wrong.
    """
    for key in ("name", "machine", "machine_variant"):
        if key in tables and not (isinstance(tables[key], str) and tables[key]):
            raise SpecError("must be text", field=key, got=tables[key], remedy="write a name in quotes")
    try:
        path = locate(tables.get("machine", FILE_NAME), (FILE_NAME,), folder)
    except SpecError as error:
        if "machine" not in tables:
            remedy = f"name a machine or put a {FILE_NAME} beside the problem file"
            raise SpecError("is missing", field="machine", remedy=remedy) from None
        raise SpecError(error.problem, field="machine", got=tables["machine"], remedy=error.remedy) from None
    machine = read(text_of(path), tables.get("machine_variant"), str(path), _machine_only)
    if "controller" in tables:
        machine = controlled(machine, tables["controller"])
    machine = changed(machine, by_path(tables, "changes"))
    return dataclasses.replace(machine, name=tables.get("name", machine.name))


def _machine(tables: Tables, folder: str | os.PathLike[str] | None) -> Machine:
    return start_machine(tables, folder) if is_problem(tables) else machine_of(tables)


def _machine_only(tables: Tables) -> Machine:
    if is_problem(tables):
        raise SpecError("describes a design problem where a machine is wanted", remedy="name the machine file instead")
    return machine_of(tables)


def _starts_elsewhere(changes: Tables) -> bool:
    return any(key in changes for key in START)


def controlled(machine: Machine, table: object) -> Machine:
    """The machine under another controller, behind the hardware of its own one but for what the table says of it.

    Parameters
    ----------
    machine : Machine
    table : dict
        Of the controller.
    """
    try:
        law = controller_of(table, machine.controller)
        return replace(machine, {"controller": law, "controller_z": None})
    except SpecError as error:
        raise (error if error.field.startswith("controller") else error.inside("controller")) from None


def changed(machine: Machine, changes: Tables) -> Machine:
    """The machine with other numbers; unlike `replace` it reads units and sets numbers that were left out.

    Parameters
    ----------
    machine : Machine
    changes : dict
        Numbers, or texts with units, by path.
    """
    values: dict[str, Number] = {}
    for name, raw in changes.items():
        try:
            for path in find(machine, name, unset=True):
                if path in values:
                    raise SpecError("is changed twice", field=path, remedy="name each number once")
                values[path] = si_number(raw, metadata(machine, path))
        except SpecError as error:
            raise error.inside("changes" if error.field else f"changes.{name}") from None
    try:
        return replace(machine, values)
    except SpecError as error:
        raise error.inside("changes") from None
