"""What figures come from: the input and its fingerprint, versions, seed, date."""

from __future__ import annotations

import dataclasses
import hashlib
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

from ..spec.files import dumps
from ..spec.machine import Machine

PACKAGES = ("casadi", "numpy", "scipy", "matplotlib")
"""On whose versions figures may depend."""


def text_of(machine: Machine) -> str:
    """A machine as the text of a file, with a source in any case.

    Parameters
    ----------
    machine : Machine
    """
    cited = machine if machine.source else dataclasses.replace(machine, source={"title": "not stated"})
    return dumps(cited)


def fingerprint(text: str | bytes) -> str:
    """SHA-256 of an input.

    Parameters
    ----------
    text : str or bytes
    """
    return hashlib.sha256(text.encode() if isinstance(text, str) else text).hexdigest()


def provenance(date: str, entries: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Everything that one has to know to get the same figures again.

    Parameters
    ----------
    date : str
        Of the calculation; left out if empty.
    entries : mapping of str to str
        Input, fingerprints, seed: whatever belongs to this result. Empty ones are left out.

    Returns
    -------
    tuple of (str, str)
    """
    from .. import __version__

    packages = [f"{name} {found}" for name in PACKAGES if (found := _version(name))]
    rows = {
        **entries,
        "Calculated": date,
        "Software": f"amb_design {__version__}, Python {platform.python_version()}, {', '.join(packages)}",
        "System": f"{platform.system()} {platform.machine()}",
    }
    return tuple((name, text) for name, text in rows.items() if text)


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
