"""What results are told in, wherever they are read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

BETTER = " *"
"""Behind the better entries of a comparison."""


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes
    ----------
    title : str
    columns : tuple of str
        Headings.
    align : str
        One letter a column: l for texts, r for numbers.
    rows : tuple of tuple of str
        As many texts as there are columns.
    note : str
        What the reader has to know of the figures.
    """

    kind: ClassVar[str] = "table"
    title: str
    columns: tuple[str, ...]
    align: str
    rows: tuple[tuple[str, ...], ...] = field(repr=False)
    note: str = ""

    def __post_init__(self) -> None:
        widths = {len(self.columns), len(self.align), *map(len, self.rows)}
        if len(widths) > 1:
            raise ValueError(f"table {self.title!r} has rows of {sorted(widths)} entries")


def table(title: str, align: str, columns: Sequence[str], rows: Iterable[Sequence[str]], note: str = "") -> Table:
    """A table from any sequences.

    Parameters
    ----------
    title : str
    align : str
        One letter a column: l for texts, r for numbers.
    columns : sequence of str
    rows : iterable of sequence of str
    note : str

    Returns
    -------
    Table
    """
    return Table(title, tuple(columns), align, tuple(tuple(row) for row in rows), note)
