"""Pages as HTML: one file with everything in it, no script, nothing to fetch."""

from __future__ import annotations

from functools import cache
from importlib import resources

import jinja2
from markupsafe import Markup, escape

from ..analysis.standards import FAILS, PASSES, TOLERABLE
from ..words.parts import BETTER, Table
from .parts import Page, Picture

NARROW, GAP = 40, 1
"""Characters that a phone shows side by side in a table, and what a column's margin takes of them."""


def html(page: Page) -> str:
    """Write a page.

    Parameters
    ----------
    page : Page

    Returns
    -------
    str
        A complete HTML document. All texts are escaped.
    """
    folder = resources.files(__package__)
    css = (folder / "page.css").read_text(encoding="utf-8")
    verdicts = (PASSES, TOLERABLE, FAILS)
    helpers = {"drawing": drawing, "is_wide": is_wide, "together": together}
    return _template().render(page=page, css=Markup(css), verdicts=verdicts, better=BETTER, **helpers)


def drawing(picture: Picture) -> Markup:
    """The markup of a picture with the words for those who do not see it.

    Parameters
    ----------
    picture : Picture
    """
    label = escape(picture.alt)
    return Markup(picture.svg.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1))


def is_wide(table: Table) -> bool:
    """True if a table does not fit the screen of a phone without scrolling.

    Parameters
    ----------
    table : Table
    """
    columns = zip(*table.rows, strict=True)
    entries = [
        max([max(map(len, heading.split()), default=0), *map(len, texts)])
        for heading, texts in zip(table.columns, columns, strict=True)
    ]
    return sum(entries) + GAP * len(entries) > NARROW


def together(heading: str) -> str:
    """A heading whose unit is not broken over lines.

    Parameters
    ----------
    heading : str
    """
    name, bracket, unit = heading.partition("[")
    return name + bracket + unit.replace(" ", "\u00a0")


@cache
def _template() -> jinja2.Template:
    folder = resources.files(__package__)
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.from_string((folder / "page.html.j2").read_text(encoding="utf-8"))
