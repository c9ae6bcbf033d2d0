"""Analysis documents as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ..analysis.published import Comparison
from ..words import analysis
from .terminal import show, terminal, warned

Document = Mapping[str, Any]


@contextmanager
def progress(total: int) -> Iterator[Callable[[str], None]]:
    """Progress bar on standard error for several jobs.

    Parameters
    ----------
    total : int
        Number of jobs.

    Yields
    ------
    callable
        To be called with the name of each job that is done.
    """
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with bar:
        task = bar.add_task("analysing", total=total)

        def advance(name: str) -> None:
            bar.update(task, advance=1, description=f"analysed {name}" if name else "analysed")

        yield advance


def analyses(documents: Mapping[str, Document], comparisons: Sequence[Comparison], out: Path | None) -> None:
    """Print analyses.

    Parameters
    ----------
    documents : mapping of str to mapping
        Analysis documents by variant.
    comparisons : sequence of Comparison
        Published figures.
    out : Path or None
        Where figures were written.
    """
    console = terminal()
    if len(documents) == 1:
        _details(console, next(iter(documents.values())))
    else:
        show(console, analysis.overview(documents))
    warned(console, "Warnings", analysis.warnings(documents))
    figures, remarks = analysis.published(comparisons)
    if figures.rows:
        show(console, figures)
    for remark in remarks:
        console.print(escape(remark), soft_wrap=not console.is_terminal)
    if out is not None:
        console.print(f"{out}/report.html shows all of it; figures and analysis.json are beside it.", soft_wrap=True)


def _details(console: Console, d: Document) -> None:
    limit, certified = d["stability_limit"], analysis.certificate(d)
    console.print(f"[bold]{escape(d['name'])}[/]: {d['states']} states, {d['form']} form")
    console.print(f"[bold]stability limit: {analysis.limit_text(d)}[/]{certified and f' ({certified})'}")
    if limit["mode"]:
        verb = "undamped" if limit["status"] == "marginal" else "set by"
        console.print(f"  {verb}: {limit['mode']}")
    for line in analysis.onsets(d):
        console.print(f"  {line}")
    console.print()
    for t in analysis.tables(d):
        show(console, t)
    if claim := analysis.equivalent(d):
        console.print(claim + "\n")


def comparison_row(comparison: Comparison) -> dict[str, Any]:
    """A comparison with a published figure as plain data.

    Parameters
    ----------
    comparison : Comparison
    """
    f = comparison.figure
    return {
        "variant": f.variant,
        "quantity": f.quantity,
        "label": f.label,
        "published": f.published,
        "here": comparison.here,
        "difference": comparison.difference,
        "tolerance": f.tolerance,
        "agrees": comparison.agrees,
        "reason": f.reason,
        "source": f.source,
    }
