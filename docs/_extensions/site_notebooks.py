"""Tutorials are plain Python in the percent format; jupytext makes notebooks of them."""

from __future__ import annotations

import jupytext
from docutils import nodes
from nbformat import NotebookNode
from sphinx.application import Sphinx

KERNEL = {"name": "site", "display_name": "Python 3", "language": "python"}
"""Python itself, less talkative: see jupyter/kernels beside this file."""


def read(text: str) -> NotebookNode:
    """A tutorial as a notebook.

    Parameters
    ----------
    text : str
        Python in the percent format.

    Returns
    -------
    NotebookNode
    """
    notebook = jupytext.reads(text, fmt="py:percent")
    notebook.metadata["kernelspec"] = KERNEL
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def describe(app: Sphinx, doctree: nodes.document) -> None:
    """Say to those who cannot see a figure what it belongs to.

    Parameters
    ----------
    app : Sphinx
    doctree : document
    """
    for image in doctree.findall(nodes.image):
        section = image.parent
        while section is not None and not isinstance(section, nodes.section):
            section = section.parent
        if section is not None and not image.get("alt"):
            image["alt"] = f"Figure: {section[0].astext()}"


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect with Sphinx."""
    app.connect("doctree-read", describe)
    return {"parallel_read_safe": True}
