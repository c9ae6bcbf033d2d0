"""Drawings as SVG inside a page: small, without texts that need a font, and with identifiers of their own."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..plots.base import figure_of, style
from .parts import Picture

Drawn = tuple[str, str, str, Any]
"""Name, caption, description and drawing."""

DECIMALS = 2
"""Of coordinates [pt]: a hundredth of a point is below any screen or printer."""

_PROLOGUE = re.compile(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<!--.*?-->|<metadata>.*?</metadata>|<style.*?</style>", re.DOTALL)
_ROOT = re.compile(r"<svg\b[^>]*>")
_VIEW = re.compile(r'viewBox="([^"]*)"')
_ID = re.compile(r'\sid="([^"]*)"')
_REFERENCE = re.compile(r'(?:xlink:)?href="#([^"]*)"')
_URL = re.compile(r"url\(#([^)]*)\)")
_COORDINATES = re.compile(r'\s(?:d|points|x|y|x1|x2|y1|y2|cx|cy|r|width|height)="[^"]*"')
_LONG = re.compile(r"-?\d+\.\d{3,}")


def picture(
    name: str,
    caption: str,
    alt: str,
    drawing: Any,
    folder: Path | None = None,
    formats: tuple[str, ...] = (),
    prefix: str = "",
) -> Picture:
    """Take a drawing into a page, and close it.

    Parameters
    ----------
    name : str
        Unique in the page; also that of the files.
    caption, alt : str
    drawing : Axes, Figure or iterable of Axes
        What a function of `amb_design.plots` returned.
    folder : Path, optional
        Where to write the drawing to files too; made if it does not exist.
    formats : tuple of str
        Of these files.
    prefix : str
        Of the identifiers in a page that shows several machines.

    Returns
    -------
    Picture
    """
    from matplotlib import pyplot as plt

    from ..plots import save

    figure = _figure(drawing)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        for ending in formats:
            save(figure, folder / f"{name}.{ending}")
    out = io.StringIO()
    with style(), mpl.rc_context({"svg.fonttype": "path"}):  # glyphs are drawn: no font of the reader's matters
        figure.savefig(out, format="svg", metadata={"Date": None})
    width = 72.0 * float(figure.get_figwidth())
    plt.close(figure)
    return Picture(name, caption, alt, inline(out.getvalue(), prefix + name), width)


def pictures(
    drawings: Iterable[Drawn], folder: Path | None = None, formats: tuple[str, ...] = (), prefix: str = ""
) -> tuple[Picture, ...]:
    """Take drawings into a page one after the other, each closed before the next one is made.

    Parameters
    ----------
    drawings : iterable of Drawn
    folder, formats, prefix
        As in `picture`.

    Returns
    -------
    tuple of Picture
    """
    return tuple(picture(*drawn, folder, formats, prefix) for drawn in drawings)


def _figure(drawing: Axes | Figure | Iterable[Axes]) -> Figure:
    first = drawing if isinstance(drawing, Axes | Figure) else next(iter(drawing))
    return first if isinstance(first, Figure) else figure_of(first)


def inline(svg: str, prefix: str) -> str:
    """SVG of a file as markup inside a page.

    Parameters
    ----------
    svg : str
        As matplotlib writes it.
    prefix : str
        Put before every identifier.

    Returns
    -------
    str
        One ``<svg>`` element without size, label and role, which the page gives it; identifiers that nothing refers to are
        left out.
    """
    text = _PROLOGUE.sub("", svg)
    root = _ROOT.search(text)
    if root is None or (view := _VIEW.search(root[0])) is None:
        raise ValueError("no SVG with a viewBox")
    body = text[root.end() :]
    used = {*_REFERENCE.findall(body), *_URL.findall(body)}
    body = _ID.sub(lambda m: f' id="{prefix}-{m[1]}"' if m[1] in used else "", body)
    body = _REFERENCE.sub(lambda m: f'href="#{prefix}-{m[1]}"', body)
    body = _URL.sub(lambda m: f"url(#{prefix}-{m[1]})", body)
    body = _COORDINATES.sub(lambda m: _LONG.sub(_rounded, m[0]), body)
    body = re.sub(r"\s*\n\s*", "\n", body).replace("<defs>\n</defs>\n", "")
    return f'<svg viewBox="{view[1]}" stroke-linejoin="round" stroke-linecap="butt">{body}'


def _rounded(match: re.Match[str]) -> str:
    return f"{float(match[0]):.{DECIMALS}f}".rstrip("0").rstrip(".")
