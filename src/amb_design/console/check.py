"""What machine files describe, in words on a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.markup import escape

from ..words import machine
from .terminal import show, terminal, warned


def outlines(documents: Mapping[str, Mapping[str, Any]]) -> None:
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
