"""Design documents as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from ..optimise.start import INFEASIBLE, Outcome
from ..units import in_words
from ..words import design as words
from .terminal import show, terminal, warned

Document = Mapping[str, Any]


@contextmanager
def progress(total: int, unit: str) -> Iterator[Callable[[Outcome], None]]:
    """Progress of the starts on standard error.

    Parameters
    ----------
    total : int
        Number of starts.
    unit : str
        Of the objective; rad/s is a spin speed.

    Yields
    ------
    callable
        To be called with each outcome.
    """
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
    with bar:
        task = bar.add_task("searching", total=total)

        def advance(o: Outcome) -> None:
            if o.status == INFEASIBLE:
                text = f"no point within the limits; least violation {100.0 * o.violation:.2g} %"
            else:
                text = in_words(o.objective, unit, speed=True)
            bar.console.print(escape(f"start {o.index}: {text} ({o.status}, {o.cpu_seconds:.1f} s)"), highlight=False)
            bar.update(task, advance=1)

        yield advance


def design(d: Document, out: Path | None) -> None:
    """Print a design.

    Parameters
    ----------
    d : mapping
        From `amb_design.optimise.report.document`.
    out : Path or None
        Where it was written.
    """
    console = terminal()
    console.print(f"[bold]{escape(d['name'])}[/]: {escape(d['question'])}" if d["question"] else d["name"])
    console.print(f"[bold]{escape(words.headline(d))}[/]\n")
    if not d["verified"]:
        warned(console, "The nearest point misses these limits, which hold each other back:", words.conflicts(d))
        return
    for t in words.tables(d):
        show(console, t)
    if out is not None:
        console.print(
            f"{out}/report.html shows all of it; design.toml, design.json and figures are beside it.", soft_wrap=True
        )
