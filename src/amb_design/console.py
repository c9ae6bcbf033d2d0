"""Analysis documents as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table as Grid

from .analysis.published import Comparison
from .words import analysis, machine
from .words.parts import BETTER, Table

Document = Mapping[str, Any]


@contextmanager
def working(text: str) -> Iterator[None]:
    """A spinner on standard error for what has no steps to count."""
    with Console(stderr=True).status(text):
        yield


def terminal() -> Console:
    """Where tables go: standard output, as wide as tables need if it is no terminal."""
    console = Console(highlight=False, soft_wrap=False)
    # A pipe has no width; tables must not be squeezed into a guess of 80 columns.
    return console if console.is_terminal else Console(highlight=False, width=max(console.width, 118))


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


def problems(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print the packaged problems.

    Parameters
    ----------
    rows : sequence of mapping
        With ``name``, ``source``, ``variants`` (of the machine), ``optimise`` and ``design_variants``.
    """
    table = Grid("problem", "commands", "source", "variants", box=None, pad_edge=False)
    for row in rows:
        commands = "analyse, optimise" if row["optimise"] else "analyse"
        lists = {"machine": row["variants"], "design": row["design_variants"]}
        variants = "\n".join(f"{what}: {', '.join(names)}" for what, names in lists.items() if names)
        table.add_row(*(escape(t) for t in (row["name"], commands, row["source"], variants)))
    terminal().print(table)


def outlines(documents: Mapping[str, Document]) -> None:
    """Print what machine files describe.

    Parameters
    ----------
    documents : mapping of str to mapping
        Results of `amb_design.analysis.outline.outline` by variant.
    """
    console = terminal()
    for d in documents.values():
        console.print(f"[bold]{escape(d['name'])}[/]")
        if d["source"]:
            console.print(escape(f"Source: {machine.source(d)}."), style="dim")
        console.print(escape(" ".join(machine.sentences(d))))
        warned(console, "Unusual", d["unusual"])
        console.print()
        for t in machine.tables(d):
            show(console, t)


def show(console: Console, t: Table) -> None:
    """Print a table.

    Parameters
    ----------
    console : Console
    t : Table
    """
    drawn = Grid(title=escape(t.title), title_justify="left", box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for heading, align in zip(t.columns, t.align, strict=True):
        drawn.add_column(escape(heading), justify="right" if align == "r" else "left")
    for row in t.rows:
        drawn.add_row(*(f"[bold green]{escape(x)}[/]" if x.endswith(BETTER) else escape(x) for x in row))
    console.print(drawn)
    if t.note:
        console.print(escape(t.note), style="dim")
    console.print()


def warned(console: Console, title: str, lines: Sequence[str]) -> None:
    """Print a list of sentences under a title; nothing if there are none.

    Parameters
    ----------
    console : Console
    title : str
    lines : sequence of str
    """
    if lines:
        console.print(f"[bold]{title}[/]")
    for line in lines:
        console.print(escape(f"- {line}"), soft_wrap=not console.is_terminal)


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
