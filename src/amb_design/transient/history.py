"""Raw results of a run, in memory and chunk by chunk in a folder."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from ..analysis.system import Array
from ..errors import ModelError
from .state import State


@dataclass(frozen=True)
class History:
    """Raw results at the output times.

    Attributes
    ----------
    times : ndarray, shape (m,)
    states : ndarray, shape (m, size)
    held : ndarray, shape (m, axes)
        Commands of sampled controllers.
    works : ndarray, shape (m, forces)
        Since the start of the run.
    shares : ndarray, shape (m, magnets * flags)
        Of the time since the output before that each limit was met.
    """

    times: Array
    states: Array
    held: Array
    works: Array
    shares: Array

    @classmethod
    def joined(cls, parts: list[History]) -> History:
        """One after the other."""
        return cls(*(whole([getattr(part, k) for part in parts]) for k in vars(parts[0])))

    def head(self, count: int) -> History:
        """The first of it."""
        return History(*(getattr(self, k)[:count] for k in vars(self)))


class Chunks:
    """Finished chunks in a folder, one file each, with the state at their end.

    Parameters
    ----------
    folder : Path or None
        Nothing is kept without one.
    signature : str
        Of everything that the run depends on.
    """

    def __init__(self, folder: Path | None, signature: str):
        self.folder, self.signature = folder, hashlib.sha256(signature.encode()).hexdigest()

    def begin(self, resume: bool) -> list[tuple[History, State]]:
        """Chunks to go on from, in order; without `resume` the folder has to be empty."""
        if self.folder is None:
            return []
        self.folder.mkdir(parents=True, exist_ok=True)
        head, files = self.folder / "run.json", sorted(self.folder.glob("chunk-*.npz"))
        if not resume and files:
            raise ModelError(f"{self.folder} already holds chunks of a run; resume it, or name another folder")
        if files and (not head.exists() or json.loads(head.read_text())["signature"] != self.signature):
            raise ModelError(f"{self.folder} holds chunks of another run; resume with the same machine and options")
        head.write_text(json.dumps({"signature": self.signature}))
        return [self._read(f) for f in files]

    def keep(self, number: int, history: History, state: State) -> None:
        """Write a chunk; a file under its final name is complete."""
        if self.folder is None:
            return
        part = self.folder / "unfinished.npz"
        arrays: dict[str, Any] = vars(history) | state.arrays()
        np.savez(part, **arrays)
        part.replace(self.folder / f"chunk-{number:06d}.npz")

    @staticmethod
    def _read(file: Path) -> tuple[History, State]:
        try:
            with np.load(file) as found:
                arrays = dict(found)
            return History(*(arrays[k] for k in ("times", "states", "held", "works", "shares"))), State.of(arrays)
        except (OSError, ValueError, KeyError, TypeError, BadZipFile):
            raise ModelError(f"{file} is no finished chunk; remove it and those after it") from None


def whole(parts: list[Array]) -> Array:
    """One below the other; a single part is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
