"""Arguments that several commands take, and numbers with units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import SpecError

if TYPE_CHECKING:
    from ..spec.machine import Machine


def _names(incomplete: str) -> list[str]:
    """Packaged problems for the shell's completion; where none fits, it completes file names."""
    from ..spec.files import packaged

    return [name for name in packaged() if name.startswith(incomplete)]


Target = Annotated[
    str,
    typer.Argument(
        help="machine file, folder with a machine.toml, or name of a packaged problem", autocompletion=_names
    ),
]
ProblemTarget = Annotated[
    str,
    typer.Argument(
        help="problem file, folder with a problem.toml, or name of a packaged problem", autocompletion=_names
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print one JSON document instead of tables")]
Variants = Annotated[str | None, typer.Option("--variant", help="one variant of the file instead of all")]
Variant = Annotated[str | None, typer.Option(help="a variant of the file")]
Optimum = Annotated[bool, typer.Option("--optimum", help="a problem's stored optimum instead of its start")]
Svg = Annotated[bool, typer.Option("--svg", help="write figures as SVG too")]


def machines_of(target: str, variant: str | None) -> dict[str, Machine]:
    """The variants of a file by name, with the machine itself under the empty name unless it is one of them."""
    from ..spec.files import load, load_variants
    from ..spec.paths import replace

    if variant is not None:
        return {variant: load(target, variant)}
    base = load(target)
    variants = {n: m for n, m in load_variants(target).items() if n != base.name}
    if any(replace(base, {"name": m.name}) == m for m in variants.values()):
        return variants
    return {"": base, **variants}


def machine_of(target: str, variant: str | None, optimum: bool) -> Machine:
    """The one machine that a command is for."""
    from ..spec.files import load
    from ..spec.problem_files import load_optimum

    return load_optimum(target, variant) if optimum else load(target, variant)


def quantity(text: str, unit: str, option: str) -> float:
    """A number with a unit, in SI."""
    from ..units import parse_quantity

    try:
        return parse_quantity(text, unit)
    except SpecError as error:
        raise error.inside(option) from None
