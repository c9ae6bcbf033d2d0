"""Refine an eigenvalue on the full sparse pencil."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from ..errors import SolveError
from ..model.pair import Pair
from .system import Array, System


class Polisher:
    """Inverse iteration on the sparse pencil of a loop.

    Parameters
    ----------
    system : System
        Its pencil is used, not its (possibly truncated) balanced matrices.
    """

    def __init__(self, system: System):
        pencil = system.pencil
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
            With left^H E right = 1; the residual is at rounding level.

        Raises
        ------
        SolveError
            If the iteration does not settle.
        """
        a = (self.a0 + speed * self.a1).tocsc()
        shift = value + 1e-9 * abs(value)
        for _ in range(2):  # the second factorisation is needed only by poor estimates
            lu = spla.splu((a - shift * self.e).tocsc())
            for _ in range(4):
                right = lu.solve(self.e @ right)
                left = lu.solve(self.e.T @ left, trans="H")
                right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
                last, value = value, complex((left.conj() @ (a @ right)) / (left.conj() @ (self.e @ right)))
                if abs(value - last) <= 1e-11 * abs(value):
                    return value, right / (left.conj() @ (self.e @ right)), left
            shift = value * (1.0 + 1e-9)
        raise SolveError(f"no eigenvalue settles near {value:.6g} 1/s at {speed:.6g} rad/s")


def sparse(pair: Pair) -> sp.csc_matrix:
    """A numeric CasADi pair as a complex SciPy matrix."""
    import casadi as ca

    return (ca.DM(pair.re).sparse() + 1j * ca.DM(pair.im).sparse()).tocsc()
