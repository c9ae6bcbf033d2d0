"""Proofs as text on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.markup import escape

from .terminal import terminal


def proof(d: Mapping[str, Any], out: Path | None) -> None:
    """Print what is proven of a machine.

    Parameters
    ----------
    d : mapping
        From `amb_design.proof.claims.Proof.document`, with the machine's name.
    out : Path or None
        Where the certificate was written.
    """
    console = terminal()
    lower, upper = d["stable_up_to_rpm"], d["unstable_at_rpm"]
    beyond = "the top speed of the search" if upper is None else f"unstable at {upper:.3f} rpm"
    console.print(f"[bold]{escape(d['name'])}: proven stable at every speed up to {lower:.3f} rpm[/], {beyond}.")
    held = {
        "stable_within_tolerances_up_to_rpm": "with all tolerances",
        "damped_up_to_rpm": "damping ratios",
        "sensitivity_held_up_to_rpm": "sensitivities of all loops",
    }
    for key, what in held.items():
        if d[key] is not None:
            console.print(f"Proven {what} up to {d[key]:.1f} rpm.")
    checked(d["proven"])
    console.print(
        f"{d['states']} states, {d['cells']} cells, {d['bytes']} bytes, made and checked in {d['seconds']:.2g} s. Proven for the "
        "matrices of the model at any constant speed; how well model and mesh describe the machine is another matter."
    )
    if out is not None:
        console.print(
            f"The certificate is {out}, its matrices {out.with_suffix('.npz')}; `amb-design check-proof {out}`."
        )


def checked(statements: Sequence[str]) -> None:
    """Print the statements of a certificate that has been checked.

    Parameters
    ----------
    statements : sequence of str
    """
    console = terminal()
    for statement in statements:
        console.print(escape(f"- {statement}"))
