"""The packaged problems as a table on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.markup import escape
from rich.table import Table

from .terminal import terminal


def problems(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print the packaged problems.

    Parameters
    ----------
    rows : sequence of mapping
        With ``name``, ``source``, ``variants`` (of the machine), ``optimise`` and ``design_variants``.
    """
    table = Table("problem", "commands", "source", "variants", box=None, pad_edge=False)
    for row in rows:
        commands = "analyse, optimise" if row["optimise"] else "analyse"
        lists = {"machine": row["variants"], "design": row["design_variants"]}
        variants = "\n".join(f"{what}: {', '.join(names)}" for what, names in lists.items() if names)
        table.add_row(*(escape(t) for t in (row["name"], commands, row["source"], variants)))
    terminal().print(table)
