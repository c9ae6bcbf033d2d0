"""Write a result as a page."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..analysis.summary import Analysis, analyse
from ..comparison.table import ComparisonTable
from ..errors import SpecError
from ..optimise.design import Design
from ..spec.machine import Machine
from .analysis import account, analysis_page
from .comparison import comparison_page
from .design import design_page
from .parts import Page
from .render import html


def save_report(result: Any, path: str | os.PathLike[str], *, date: str = "") -> None:
    """Write a result as one self-contained HTML page: nothing to fetch, no script.

    Parameters
    ----------
    result : Machine, Analysis, Design, ComparisonTable, or mapping of str to Machine or Analysis
        A machine is analysed first. A mapping puts variants on one page, by their names.
    path : str or path
        File to write; an existing one is replaced.
    date : str
        Of the calculation, as the page shall show it; left out if empty, so that the same result gives the same page.

    Raises
    ------
    SpecError
        If the result is none of these.

    Examples
    --------
    ``ad.save_report(ad.analyse(machine), "report.html", date="2025-11-22")``
    """
    text = html(page_of(result, date=date))
    Path(path).write_text(text, encoding="utf-8")


def page_of(result: Any, *, date: str = "") -> Page:
    """The page of a result.

    Parameters
    ----------
    result : Machine, Analysis, Design, ComparisonTable, or mapping of str to Machine or Analysis
    date : str
        Of the calculation.

    Returns
    -------
    Page
        `amb_design.report.render.html` writes it.

    Raises
    ------
    SpecError
        If the result is none of these.
    """
    if isinstance(result, Design):
        return design_page(result, date=date)
    if isinstance(result, ComparisonTable):
        return comparison_page(result, date=date)
    variants = dict(result) if isinstance(result, Mapping) else {"": result}
    if not variants:
        raise SpecError("is empty", field="result", remedy="give at least one machine")
    many = len(variants) > FEW
    accounts = {
        name: account(_analysed(one), main_only=many, prefix=f"v{k}-" if len(variants) > 1 else "")
        for k, (name, one) in enumerate(variants.items())
    }
    return analysis_page(accounts, date=date)


FEW = 3
"""Of more variants than this only the main figures are drawn."""


def _analysed(one: Any) -> Analysis:
    if isinstance(one, Machine):
        return analyse(one)
    if isinstance(one, Analysis):
        return one
    raise SpecError(
        f"is a {type(one).__name__}",
        field="result",
        remedy="give a machine, an analysis, a design, a comparison, or a dict of machines",
    )
