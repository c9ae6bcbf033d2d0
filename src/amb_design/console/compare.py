"""Comparisons as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape

from ..words import comparison as words
from .terminal import show, terminal


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """What is being measured, on standard error.

    Yields
    ------
    callable
        To be called with a word on what comes next.
    """
    with Console(stderr=True).status("comparing") as status:
        yield lambda text: status.update(escape(text))


def comparison(d: dict[str, Any], out: Path | None) -> None:
    """Print a comparison.

    Parameters
    ----------
    d : dict
        From `ComparisonTable.document`.
    out : Path or None
        Where it was written.
    """
    console = terminal()
    if not console.is_terminal:  # as wide as it takes
        console = Console(highlight=False, width=max(console.width, 48 + 28 * len(d["designs"])))
    console.print(f"[bold]{escape(d['name'])}[/]" + (f": {escape(d['question'])}" if d["question"] else "") + "\n")
    for t in (words.lines(d), words.modes(d)):
        if t.rows:
            show(console, t)
    for note in d["notes"]:
        console.print(escape(f"- {note}"), soft_wrap=not console.is_terminal)
    if out is not None:
        console.print(f"{out}/report.html shows all of it; comparison.json and figures are beside it.", soft_wrap=True)
