"""Pages of the site that live elsewhere in the repository: READMEs of problems and benchmarks, the list of changes."""

from __future__ import annotations

import os
import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
FOLDER = "generated"


def sources() -> dict[Path, str]:
    """Files of the repository and the pages that they become."""
    found = {readme: f"problems/{readme.parent.name}.md" for readme in sorted(ROOT.glob("problems/*/README.md"))}
    return {**found, ROOT / "benchmarks" / "README.md": "benchmarks.md", ROOT / "CHANGELOG.md": "changes.md"}


def write(app: Sphinx) -> None:
    """Copy what has changed, with links that lead to the copies.

    Parameters
    ----------
    app : Sphinx
    """
    for source, page in sources().items():
        target = Path(app.srcdir) / FOLDER / page
        text = relinked(source.read_text(encoding="utf-8"), source.parent, target.parent)
        if not (target.is_file() and target.read_text(encoding="utf-8") == text):
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")


def relinked(text: str, here: Path, there: Path) -> str:
    """A text whose relative links hold from another folder and lead to pages of the site.

    Parameters
    ----------
    text : str
    here, there : Path
        Folders of the text and of the page.
    """
    pages = {source: ROOT / "docs" / FOLDER / page for source, page in sources().items()}

    def moved(link: re.Match[str]) -> str:
        target = (here / link[1]).resolve()
        return f"]({os.path.relpath(pages.get(target, target), there)})"

    return re.sub(r"\]\((?!\w+:|#)([^)#\s]+)\)", moved, text)


def on_read(app: Sphinx, name: str, content: list[str]) -> None:
    """Links of hand-written pages to files that have become pages.

    Parameters
    ----------
    app : Sphinx
    name : str
        Of the page.
    content : list of str
        Its text, replaced in place.
    """
    if not name.startswith(FOLDER):
        here = Path(app.env.doc2path(name)).parent
        content[0] = relinked(content[0], here, here)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect with Sphinx."""
    app.connect("builder-inited", write)
    app.connect("source-read", on_read)
    return {"parallel_read_safe": True}
