"""Commented machine files to start from."""

from __future__ import annotations

import os
from importlib import resources
from pathlib import Path

from ..errors import SpecError
from .files import FILE_NAME

KINDS = {
    "steel": "a steel rotor on two magnetic bearings",
    "composite": "a laminated carbon tube with rings on two magnetic bearings",
}
"""What may be asked for, and what it is."""


def template(kind: str = "steel") -> str:
    """The text of a commented machine file.

    Parameters
    ----------
    kind : {"steel", "composite"}

    Returns
    -------
    str

    Raises
    ------
    SpecError
        If there is no such kind.
    """
    if kind not in KINDS:
        raise SpecError("is no kind of machine", field="kind", got=kind, remedy=f"choose {' or '.join(KINDS)}")
    folder = resources.files("amb_design") / "templates"
    return (folder / f"{kind}.toml").read_text(encoding="utf-8")


def start(folder: str | os.PathLike[str], kind: str = "steel") -> Path:
    """Write a commented machine file to start from; an existing one stays as it is.

    Parameters
    ----------
    folder : str or path
        Made if it does not exist.
    kind : {"steel", "composite"}

    Returns
    -------
    Path
        The file.

    Raises
    ------
    SpecError
        If the folder has a machine file already or cannot be written to, or if there is no such kind.
    """
    text, path = template(kind), Path(folder) / FILE_NAME
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        what = path if path.exists() else path.parent
        raise SpecError("exists already", field=str(what), remedy="name another folder") from None
    except OSError as error:
        raise SpecError(
            f"cannot be written ({error.strerror or error})", field=str(path), remedy="name another folder"
        ) from None
    return path
