"""What a machine file describes."""

from __future__ import annotations

from .arguments import Json, Target, Variants, machines_of
from .output import nested, print_result


def check(target: Target, variant: Variants = None, as_json: Json = False) -> None:
    """Read a machine file and say in words what it describes."""
    from ..analysis.outline import outline
    from ..console import check as console

    documents = {name: outline(machine) for name, machine in machines_of(target, variant).items()}
    print_result(as_json, nested(documents), lambda: console.outlines(documents))
