"""Proofs of the stability limit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import SpecError
from .arguments import Json, Optimum, Target, Variant, machine_of, quantity
from .output import print_result


def prove(
    target: Target,
    variant: Variant = None,
    optimum: Optimum = False,
    out: Annotated[Path | None, typer.Option(help="certificate to write, a .json file; matrices go beside it")] = None,
    damping: Annotated[float | None, typer.Option(help="prove damping ratios above this one")] = None,
    sensitivity: Annotated[float | None, typer.Option(help="prove sensitivities below this one")] = None,
    within: Annotated[
        list[str] | None, typer.Option(help="prove it with tolerances: 'magnets.current_stiffness=5 %'")
    ] = None,
    up_to: Annotated[str | None, typer.Option(help="speed up to which all this must hold: '9000 rpm'")] = None,
    as_json: Json = False,
) -> None:
    """Prove the stability limit of a machine, with a certificate that anybody can check."""
    from ..console import prove as console
    from ..console.terminal import working
    from ..proof.claims import prove_stability_limit

    if out is not None and out.suffix != ".json":
        raise SpecError("is no .json file", field="--out", got=str(out), remedy="name the certificate so")
    machine = machine_of(target, variant, optimum)
    speed = None if up_to is None else quantity(up_to, "rad/s", "--up-to")
    tolerances = dict(_tolerance(text) for text in within or ())
    with working("proving"):
        proof = prove_stability_limit(
            machine, damping_ratio=damping, sensitivity_peak=sensitivity, up_to=speed, within=tolerances
        )
    if out is not None:
        proof.save(out)
    document = {"name": machine.name, **proof.document()}
    print_result(as_json, document, lambda: console.proof(document, out))


def check_saved_proof(
    file: Annotated[Path, typer.Argument(help="certificate; its matrices lie beside it")],
    machine: Annotated[
        str | None, typer.Option(help="machine whose matrices, made anew, must be those of the certificate")
    ] = None,
    variant: Annotated[str | None, typer.Option(help="a variant of that machine")] = None,
    as_json: Json = False,
) -> None:
    """Check a certificate."""
    from ..console import prove as console
    from ..proof.claims import check_proof
    from ..spec.files import load

    statements = check_proof(file, None if machine is None else load(machine, variant))
    print_result(as_json, {"proven": statements}, lambda: console.checked(statements))


def _tolerance(text: str) -> tuple[str, float]:
    """A path and its tolerance from ``path=5 %`` or ``path=0.05``."""
    path, _, number = text.partition("=")
    try:
        factor = 0.01 if number.rstrip().endswith("%") else 1.0
        return path.strip(), factor * float(number.rstrip().rstrip("%"))
    except ValueError:
        raise SpecError(
            "is no tolerance", field="--within", got=text, remedy="write 'magnets.current_stiffness=5 %'"
        ) from None
