"""What all commands share on a terminal: where they write, tables, lists, a spinner."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table as Grid

from ..words.parts import BETTER, Table


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
