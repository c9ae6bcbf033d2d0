"""Comparisons as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .comparison.table import EMPTY, digits
from .console import terminal


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
    console.print(f"[bold]{escape(d['name'])}[/]" + (f": {escape(d['question'])}" if d["question"] else ""))
    console.print(_table(d))
    if any(design["modes"] for design in d["designs"].values()):
        console.print(_modes(d))
    for note in d["notes"]:
        console.print(escape(f"- {note}"), soft_wrap=not console.is_terminal)
    if out is not None:
        console.print(f"All data are in {out}/comparison.json, figures beside it.")


def _table(d: dict[str, Any]) -> Table:
    span = f"{d['conditions']['speed_rpm']:.0f} rpm"
    table = Table(title=f"Operating range up to {span}; the better entry has a star", title_justify="left")
    table.add_column("")
    for name in d["designs"]:
        table.add_column(escape(name), justify="right")
    group = ""
    for line in d["lines"]:
        if all(text in EMPTY for text in line["text"].values()):
            continue
        if line["group"] != group:
            if group:
                table.add_section()
            group = line["group"]
        cells = [_cell(text, name in line["best"]) for name, text in line["text"].items()]
        table.add_row(f"{group}: {line['label']}" if group in SAID else line["label"], *cells)
    return table


SAID = ("force step", "base shock", "unbalance", "noise")
"""Groups without which a label says too little."""


def _cell(text: str, better: bool) -> str:
    return f"[bold green]{escape(text)} *[/]" if better else f"{escape(text)}  "


def _modes(d: dict[str, Any]) -> Table:
    table = Table(
        title="First modes: least damping ratio, frequency at rest",
        title_justify="left",
    )
    table.add_column("")
    for name in d["designs"]:
        table.add_column(escape(name), justify="right")
    count = max(len(design["modes"]) for design in d["designs"].values())
    for k in range(count):
        cells = []
        for design in d["designs"].values():
            m = design["modes"][k] if k < len(design["modes"]) else None
            cells.append(
                ""
                if m is None
                else f"{digits(100.0 * m['least_damping_ratio'])} %, {digits(m['frequency_hz'])} Hz {m['whirl']}"
                + (" (controller)" if m["kind"] == "controller" else "")
            )
        table.add_row(str(k + 1), *cells)
    return table
