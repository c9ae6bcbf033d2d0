"""The layers of the package as a drawing, from the contract that import-linter checks and the packages' own words."""

from __future__ import annotations

import html
import importlib
import tomllib
from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[2]
WIDTH, LINE, GAP, NAMES = 760, 20, 14, 210


class Layers(SphinxDirective):
    """What may import what: each layer knows those above it."""

    def run(self) -> list[nodes.Node]:
        return [nodes.raw("", drawing(), format="html")]


def layers() -> list[list[str]]:
    """Packages layer by layer, the first known to all others."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (contract,) = [c for c in settings["tool"]["importlinter"]["contracts"] if c["type"] == "layers"]
    return [[name.strip() for name in layer.split("|")] for layer in reversed(contract["layers"])]


def drawing() -> str:
    """SVG in the colour of the text around it."""
    parts, y = [], 2
    for packages in layers():
        height = LINE * len(packages) + 8
        if y > 2:
            middle = NAMES / 2
            parts.append(
                f'<path d="M{middle} {y - GAP} v{GAP - 2} m-4 -5 l4 5 l4 -5" fill="none" stroke="currentColor"/>'
            )
        parts.append(
            f'<rect x="1" y="{y}" width="{NAMES}" height="{height}" rx="4" fill="none" stroke="currentColor"/>'
        )
        for k, package in enumerate(packages):
            base = y + LINE * k + 18
            name, words = package.removeprefix("amb_design."), _words(package)
            parts.append(f'<text x="12" y="{base}" font-family="monospace">{name}</text>')
            parts.append(f'<text x="{NAMES + 16}" y="{base}" opacity="0.85">{html.escape(words)}</text>')
        y += height + GAP
    title = "Layers of the package, from what knows nothing of the others to the command line"
    return (
        f'<figure class="layers"><svg viewBox="0 0 {WIDTH} {y}" width="{WIDTH}" role="img" aria-label="{title}" '
        f'font-size="13" fill="currentColor" xmlns="http://www.w3.org/2000/svg">{"".join(parts)}</svg></figure>'
    )


def _words(package: str) -> str:
    """First sentence of a package about itself."""
    text = (importlib.import_module(package).__doc__ or "").strip().splitlines()[0]
    return text.split(";")[0].split(":")[0].rstrip(".")


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect with Sphinx."""
    app.add_directive("layers", Layers)
    return {"parallel_read_safe": True}
