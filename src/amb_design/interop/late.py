"""Packages that are needed by one bridge only load with it, and their absence is said in one sentence."""

from __future__ import annotations

import importlib
from typing import Any

from ..errors import SolveError


def package(module: str, distribution: str) -> Any:
    """Import a package.

    Parameters
    ----------
    module : str
    distribution : str
        Its name for pip.

    Raises
    ------
    SolveError
        If it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.split(".")[0] != module.split(".")[0]:
            raise
        raise SolveError(f"{module} is not installed; run: pip install {distribution}") from None
