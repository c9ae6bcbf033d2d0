"""The best design of a problem."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..errors import SolveError, SpecError
from .arguments import Json, ProblemTarget, Svg
from .output import check_folder, formats, print_result, provenance, staging, today, write_json, write_page


def optimise(
    target: ProblemTarget,
    variant: Annotated[str | None, typer.Option(help="a variant of the problem")] = None,
    out: Annotated[
        Path | None, typer.Option(help="folder for report.html, the design, figures and finished starts")
    ] = None,
    starts: Annotated[int, typer.Option(min=1, help="number of starts; the first begins at the machine as it is")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="of the random starts")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = min(2, os.cpu_count() or 1),
    resume: Annotated[
        bool, typer.Option("--resume", help="take finished starts from the folder given by --out")
    ] = False,
    begin: Annotated[
        str | None,
        typer.Option("--from", help="a machine, such as an earlier design.toml, that the first start begins at"),
    ] = None,
    relax: Annotated[bool, typer.Option("--relax", help="solve again with each active limit eased by 10 %")] = False,
    pareto: Annotated[
        list[str] | None, typer.Option(help="compromises with a quantity: 'bias_current=2:4.8:6', SI units")
    ] = None,
    svg: Svg = False,
    as_json: Json = False,
) -> None:
    """Find the best design of a problem, and verify it on the full model."""
    from ..console import optimise as console
    from ..console.terminal import working
    from ..optimise.answers import pareto as trade
    from ..optimise.answers import relaxations
    from ..optimise.report import document
    from ..optimise.solve import solve
    from ..spec.files import PROBLEM_FILE, load, locate, save
    from ..spec.problem_files import load_problem

    problem = load_problem(target, variant)
    if begin is not None:
        problem = problem.starting_at(load(begin))
    fronts = dict(_front(text) for text in pareto or ())
    for quantity, bounds in fronts.items():
        problem.with_limit(quantity, bounds[0])  # says at once what is wrong with it
    check_folder(out)
    if resume and out is None:
        raise SpecError("needs the folder of the starts", field="--resume", remedy="add --out FOLDER")
    with console.progress(starts, problem.objective.kind.unit) as report:
        folder = None if out is None else out / "starts"
        design = solve(problem, starts, seed, workers=workers, folder=folder, resume=resume, report=report)
    with staging(out) as staged, working("looking around the optimum"):
        relaxed = relaxations(design) if relax and design.verified else ()
        traded = {q: trade(design, q, b) for q, b in fronts.items()} if design.verified else {}
        result = document(design, relaxed, traded)
        if staged is not None:
            from ..report.design import design_page

            write_json(staged / "design.json", result)
            if design.verified:
                save(design.machine, staged / "design.toml")
                if design.best is not None and design.best.proof is not None:
                    design.best.proof.save(staged / "proof.json")
            inputs = provenance(locate(target, (PROBLEM_FILE,)))
            page = design_page(
                design, relaxed, traded, folder=staged, formats=formats(svg), date=today(), inputs=inputs
            )
            write_page(staged, page)
    print_result(as_json, result, lambda: console.design(result, out))
    if not design.verified:
        raise SolveError(f"{problem.name}: {design.status}: {design.explanation()}")


def _front(text: str) -> tuple[str, list[float]]:
    """A quantity and its limits from ``quantity=first:last:count``."""
    quantity, _, numbers = text.partition("=")
    try:
        first, last, count = numbers.split(":")
        return quantity, np.linspace(float(first), float(last), int(count)).tolist()
    except ValueError:
        raise SpecError(
            "is no range of limits", field="--pareto", got=text, remedy="write quantity=first:last:count in SI units"
        ) from None
