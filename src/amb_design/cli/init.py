"""A machine file to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def init(
    folder: Annotated[Path, typer.Argument(help="folder for the machine.toml, made if it does not exist")] = Path(),
    kind: Annotated[
        str, typer.Option(help="steel: a steel shaft; composite: a laminated tube; both on magnets")
    ] = "steel",
) -> None:
    """Write a commented machine file to start from. It never replaces one."""
    from ..spec.templates import start

    file = start(folder, kind)
    typer.echo(f"{file} is written. Now: amb-design check {folder}")
