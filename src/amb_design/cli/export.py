"""A machine for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .arguments import Json, Optimum, Target, Variant, machine_of, quantity
from .output import check_folder, print_result, staging


def export(
    target: Target,
    to: Annotated[str, typer.Option(help="control, c, fmu, mat or ross")],
    out: Annotated[Path, typer.Option(help="folder for the files")],
    variant: Variant = None,
    optimum: Optimum = False,
    speed: Annotated[str, typer.Option(help="spin speed: '9000 rpm'")] = "0 rpm",
    period: Annotated[str, typer.Option(help="sampling period of controllers: '50 us'")] = "50 us",
    method: Annotated[str, typer.Option(help="discretisation of controllers: tustin or hold")] = "tustin",
    modes: Annotated[int, typer.Option(min=1, help="lowest modes that are kept, in each plane")] = 8,
    as_json: Json = False,
) -> None:
    """Write a machine for another program: state spaces, C code, FMI units, MATLAB files, a rotor of ROSS."""
    from ..console.export import export as write
    from ..console.terminal import working
    from ..spec.sampling import Sampling

    machine = machine_of(target, variant, optimum)
    check_folder(out)
    spin = quantity(speed, "rad/s", "--speed")
    sampling = Sampling(period=quantity(period, "s", "--period"), method=method)
    with staging(out) as folder, working("exporting"):
        assert folder is not None
        files = write(machine, to, folder, spin, sampling, modes)
    document = {"name": machine.name, "to": to, "files": [str(out / f) for f in files]}
    print_result(as_json, document, lambda: typer.echo("\n".join(document["files"])))
