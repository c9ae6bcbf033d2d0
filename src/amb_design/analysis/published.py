"""Published figures of a problem, held against what the analysis finds.

A problem folder may have an ``expected.toml`` beside its machine file:

    [[figures]]
    variant = "row1-passive"                 # left out for a machine without variants
    quantity = "critical_speeds_rpm.0"       # a place in the analysis document
    published = 2405
    source = "Ahmad 2014, table 2"
    tolerance = 0.02                         # relative; or, where the figure is known not to hold:
    reason = "the first mode was missed"

A figure with a tolerance must agree; one with a reason is shown with it, as a disagreement that is understood.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import SpecError

FILE_NAME = "expected.toml"
_KEYS: dict[str, tuple[type, ...]] = {
    "variant": (str,),
    "quantity": (str,),
    "published": (int, float),
    "source": (str,),
    "tolerance": (int, float),
    "reason": (str,),
    "label": (str,),
}


@dataclass(frozen=True)
class Figure:
    """One published figure.

    Attributes
    ----------
    variant : str
        Empty for the machine itself.
    quantity : str
        Place in the analysis document, ``"onsets_rpm.1"``.
    published : float
    source : str
    tolerance : float or None
        Relative; None if the figure is not expected to hold.
    reason : str
        Why it does not hold.
    label : str
        The quantity in words.
    """

    variant: str
    quantity: str
    published: float
    source: str
    tolerance: float | None
    reason: str
    label: str


@dataclass(frozen=True)
class Comparison:
    """A published figure beside the computed one.

    Attributes
    ----------
    figure : Figure
    here : float or None
        None if the analysis has no such quantity, for example a limit that was not found.
    """

    figure: Figure
    here: float | None

    @property
    def difference(self) -> float | None:
        """Relative difference of the computed from the published value."""
        return None if self.here is None else self.here / self.figure.published - 1.0

    @property
    def agrees(self) -> bool:
        """True if the figure has a tolerance and holds within it."""
        tolerance, difference = self.figure.tolerance, self.difference
        return tolerance is not None and difference is not None and abs(difference) <= tolerance


def published_figures(folder: Path) -> tuple[Figure, ...]:
    """Read the published figures of a problem folder.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    tuple of Figure
        Empty if the folder has no ``expected.toml``.

    Raises
    ------
    SpecError
        If the file is malformed.
    """
    file = folder / FILE_NAME
    if not file.is_file():
        return ()
    try:
        tables = tomllib.loads(file.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SpecError(f"is no TOML: {error}", file=str(file), remedy="correct the file") from None
    rows = tables.pop("figures", [])
    if tables or not isinstance(rows, list) or not all(isinstance(t, dict) for t in rows):
        raise SpecError(
            "must hold [[figures]] and nothing else", file=str(file), remedy="write each as a table [[figures]]"
        )
    return tuple(_figure(t, i, str(file)) for i, t in enumerate(rows))


def compare(figures: tuple[Figure, ...], documents: Mapping[str, Mapping[str, Any]]) -> tuple[Comparison, ...]:
    """Hold published figures against analysis documents.

    Parameters
    ----------
    figures : tuple of Figure
    documents : mapping of str to mapping
        Analysis documents by variant; the empty name is the machine itself.

    Returns
    -------
    tuple of Comparison
        One for each figure whose variant was analysed.
    """
    return tuple(Comparison(f, _look_up(documents[f.variant], f.quantity)) for f in figures if f.variant in documents)


def _figure(table: Mapping[str, Any], index: int, file: str) -> Figure:
    where = f"figures[{index}]"
    for key, given in table.items():
        if key not in _KEYS:
            raise SpecError("is unknown", field=f"{where}.{key}", file=file, remedy="use " + ", ".join(sorted(_KEYS)))
        if not isinstance(given, _KEYS[key]) or isinstance(given, bool) or given == 0:
            kind = "a text" if _KEYS[key] == (str,) else "a number other than zero"
            raise SpecError(f"must be {kind}", field=f"{where}.{key}", got=given, file=file, remedy="correct it")
    for key in ("quantity", "published", "source"):
        if key not in table:
            raise SpecError("is missing", field=f"{where}.{key}", file=file, remedy="give it")
    if ("tolerance" in table) == ("reason" in table):
        raise SpecError(
            "needs either a tolerance or a reason",
            field=where,
            file=file,
            remedy="say how near it is, or why it is not",
        )
    return Figure(
        variant=table.get("variant", ""),
        quantity=table["quantity"],
        published=float(table["published"]),
        source=table["source"],
        tolerance=table.get("tolerance"),
        reason=table.get("reason", ""),
        label=table.get("label", table["quantity"]),
    )


def _look_up(document: Mapping[str, Any], quantity: str) -> float | None:
    node: Any = document
    for key in quantity.split("."):
        try:
            node = node[int(key)] if isinstance(node, list) else node[key]
        except (KeyError, IndexError, ValueError, TypeError):
            return None
    return float(node) if isinstance(node, int | float) else None
