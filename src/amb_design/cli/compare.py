"""Designs side by side."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import SpecError
from .arguments import Json, Svg, quantity
from .output import check_folder, formats, print_result, provenance, staging, today, write_json, write_page


def compare(
    targets: Annotated[
        list[str],
        typer.Argument(
            help="comparison file, folder with a comparison.toml, or name of a packaged problem that has one; or two or more "
            "machines, as other commands take them, under conditions chosen from them"
        ),
    ],
    variant: Annotated[str | None, typer.Option(help="a variant of the comparison")] = None,
    optimum: Annotated[
        bool, typer.Option("--optimum", help="of problems among several targets their stored optimum")
    ] = False,
    speed: Annotated[str | None, typer.Option(help="end of the operating range: '9000 rpm'")] = None,
    samples: Annotated[int | None, typer.Option(min=0, help="random machines within the tolerances")] = None,
    out: Annotated[Path | None, typer.Option(help="folder for report.html, figures and comparison.json")] = None,
    svg: Svg = False,
    as_json: Json = False,
) -> None:
    """Set designs side by side under the same conditions, and mark the better entry of each line."""
    from ..comparison.compare import compare as run
    from ..console import compare as console
    from ..spec.comparison_files import COMPARISON_FILE
    from ..spec.files import locate

    check_folder(out)
    given = {"speed": None if speed is None else quantity(speed, "rad/s", "--speed"), "samples": samples}
    asked = _compared(targets, variant, optimum)
    conditions = dataclasses.replace(asked.conditions, **{k: v for k, v in given.items() if v is not None})
    asked = dataclasses.replace(asked, conditions=conditions)
    with console.progress() as tell:
        table = run(asked, progress=tell)
        document = table.document()
        with staging(out) as folder:
            if folder is not None:
                from ..report.comparison import comparison_page

                tell("drawing")
                write_json(folder / "comparison.json", document)
                inputs = provenance(locate(targets[0], (COMPARISON_FILE,)) if len(targets) == 1 else None)
                page = comparison_page(table, folder=folder, formats=formats(svg), date=today(), inputs=inputs)
                write_page(folder, page)
    print_result(as_json, document, lambda: console.comparison(document, out))


def _compared(targets: list[str], variant: str | None, optimum: bool) -> Any:
    """What the command line asks to compare."""
    from ..spec.comparison import Comparison, Conditions
    from ..spec.comparison_files import COMPARISON_FILE, design_time, load_comparison
    from ..spec.files import load, locate, resolve
    from ..spec.problem_files import has_optimum, load_optimum

    if len(targets) == 1:
        if optimum:
            raise SpecError(
                "needs several targets", field="--optimum", remedy="name the optimum in the comparison file"
            )
        try:
            locate(targets[0], (COMPARISON_FILE,))
        except SpecError as error:
            remedy = "write one, or name two or more machines"
            raise SpecError(error.problem, field=error.field, got=error.got, remedy=remedy) from None
        return load_comparison(targets[0], variant)
    if variant is not None:
        raise SpecError(
            "belongs to a comparison file", field="--variant", got=variant, remedy="write one, or name files alone"
        )
    designs, seconds = {}, {}
    for target in targets:
        machine = load_optimum(target) if optimum and has_optimum(target) else load(target)
        name = Path(target).name if machine.name in designs else machine.name
        if name in designs:
            raise SpecError("is named twice", field=target, got=name, remedy="write a comparison file with names")
        designs[name] = machine
        spent = design_time(resolve(target))
        if spent is not None:
            seconds[name] = spent
    return Comparison("comparison", designs, Conditions(), seconds)
