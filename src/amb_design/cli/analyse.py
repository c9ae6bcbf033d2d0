"""A machine and its variants in numbers and figures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

import typer

from .arguments import Json, Svg, Target, Variants, machines_of
from .output import check_folder, formats, nested, print_result, provenance, staging, today, write_json, write_page


def analyse(
    target: Target,
    variant: Variants = None,
    out: Annotated[Path | None, typer.Option(help="folder for report.html, figures and analysis.json")] = None,
    workers: Annotated[int, typer.Option(min=1, help="processes for the variants")] = min(2, os.cpu_count() or 1),
    svg: Svg = False,
    as_json: Json = False,
) -> None:
    """Critical speeds, damping, stability limit and warnings of a machine and its variants.

    Of more than three variants only the main figures are drawn; name one with --variant for all.
    """
    from ..analysis.published import compare, published_figures
    from ..console import analyse as console
    from ..spec.files import resolve

    machines, file = machines_of(target, variant), resolve(target)
    figures = published_figures(file.parent)
    check_folder(out)
    with staging(out) as folder:
        accounts = _analysed(machines, folder, workers, svg)
        documents = {name: a if folder is None else a.document for name, a in accounts.items()}
        comparisons = compare(figures, documents)
        document = nested(documents)
        document["published"] = [console.comparison_row(c) for c in comparisons]
        if folder is not None:
            from ..report.analysis import analysis_page

            write_json(folder / "analysis.json", document)
            write_page(folder, analysis_page(accounts, comparisons, date=today(), inputs=provenance(file)))
    print_result(as_json, document, lambda: console.analyses(documents, comparisons, out))


def _analysed(machines: dict[str, Any], folder: Path | None, workers: int, svg: bool) -> dict[str, Any]:
    """Analyses by variant, computed side by side where there are many, with progress on standard error.

    Documents, or with a folder for figures all that a report tells.
    """
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    from ..console.analyse import progress

    single, many = len(machines) == 1, len(machines) > 3
    jobs = {
        name: (
            machine,
            folder if folder is None or single else folder / name,
            formats(svg),
            many,
            "" if single else f"v{k}-",
        )
        for k, (name, machine) in enumerate(machines.items())
    }
    done: dict[str, Any] = {}
    with progress(len(jobs)) as advance:
        if min(workers, len(jobs)) == 1 or len(jobs) < 3:
            for name, job in jobs.items():
                done[name] = _analyse_one(*job)
                advance(name)
        else:
            with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
                futures = {pool.submit(_analyse_one, *job): name for name, job in jobs.items()}
                for future in as_completed(futures):
                    done[futures[future]] = future.result()
                    advance(futures[future])
    return {name: done[name] for name in machines}


def _analyse_one(machine: Any, folder: Path | None, kinds: tuple[str, ...], main_only: bool, prefix: str) -> Any:
    from ..analysis.summary import analyse as run

    analysis = run(machine)
    if folder is None:
        return analysis.document()
    from ..report.analysis import account

    return account(analysis, folder, kinds, main_only=main_only, prefix=prefix)
