"""Tutorials are plain Python in the percent format; jupytext makes notebooks of them."""

from __future__ import annotations

import jupytext
from nbformat import NotebookNode

KERNEL = {"name": "python3", "display_name": "Python 3", "language": "python"}


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
