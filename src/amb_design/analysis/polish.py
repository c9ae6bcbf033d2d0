"""Refine an eigenvalue on the full sparse pencil."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ..errors import SolveError
from ..model.loop import Pencil
from ..model.pair import Pair
from .system import Array

SETTLED = 1e-7
"""Relative change below which an iteration that no longer improves has arrived."""


class Polisher:
    """Inverse iteration on the sparse pencil of a loop.

    Parameters
    ----------
    pencil : Pencil
        Numeric.
    """

    def __init__(self, pencil: Pencil):
        self.e, self.a0, self.a1 = sparse(pencil.E), sparse(pencil.A0), sparse(pencil.A1)

    def eigenpair(self, speed: float, value: complex, right: Array, left: Array) -> tuple[complex, Array, Array]:
        """The eigenvalue nearest to an estimate.

        Parameters
        ----------
        speed : float [rad/s]
        value : complex
            Estimate [1/s].
        right, left : ndarray
            Estimates of the vectors of the pencil.

        Returns
        -------
        value, right, left
            With left^H E right = 1. Low modes of a fine mesh settle to about 1e-9 of their value, the rest better:
            rounding in the stiffness of the highest modes reaches them.

        Raises
        ------
        SolveError
            If the iteration does not settle.
        """
        from scipy.sparse.linalg import splu  # imported late: slow to load

        a = (self.a0 + speed * self.a1).tocsc()
        for _ in range(2):  # the second factorisation is needed only by poor estimates
            lu = splu((a - value * (1.0 + 1e-9) * self.e).tocsc())
            for _ in range(4):
                right = lu.solve(self.e @ right)
                left = lu.solve(self.e.T @ left, trans="H")
                right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
                last, value = value, complex((left.conj() @ (a @ right)) / (left.conj() @ (self.e @ right)))
                if abs(value - last) <= 1e-11 * abs(value):
                    break
            if abs(value - last) <= SETTLED * abs(value):
                return value, right / (left.conj() @ (self.e @ right)), left
        raise SolveError(f"no eigenvalue settles near {value:.6g} 1/s at {speed:.6g} rad/s")


def sparse(pair: Pair) -> Any:
    """A numeric CasADi pair as a complex SciPy matrix in CSC form."""
    return (ca.DM(pair.re).sparse() + 1j * ca.DM(pair.im).sparse()).tocsc()
