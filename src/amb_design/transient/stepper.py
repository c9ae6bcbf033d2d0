"""What all ways through a piece of the run have in common."""

from __future__ import annotations

from typing import Protocol

from ..analysis.system import Array
from .schedule import Piece


class Stepper(Protocol):
    """Moves the state through a piece and keeps account."""

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> Array:
        """States after 1 ... count equal steps from a time inside the piece, one a row.

        Raises RuntimeError if it gives up.
        """
        ...

    def drain(self) -> tuple[Array, Array]:
        """Of each step since it was last asked: works done, and the share of the time that each flag was up.

        Returns
        -------
        works : ndarray, shape (steps, len(WORKS))
        shares : ndarray, shape (steps, magnets * len(FLAGS))
        """
        ...
