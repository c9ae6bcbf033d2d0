"""Algebraic Riccati equations with exact derivatives.

A^H X + X A - X B R^-1 B^H X + Q = 0 with the stabilising solution X and the gain K = R^-1 B^H X. A change of the data moves X by the
solution of a Lyapunov equation of A - B K, whose Schur form serves all changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla
from scipy.linalg import get_lapack_funcs

from ..errors import SolveError

Array = np.ndarray  # complex or real

EXACT = 1e-14
"""Residual, relative to the terms of the equation, that Newton's method does not try to lower."""

SOLVED = 1e-6
"""Relative residual above which the equation does not count as solved."""


@dataclass(frozen=True)
class Data:
    """Data of the equation, or their derivatives along a first axis.

    Attributes
    ----------
    A : ndarray, shape (..., n, n)
    B : ndarray, shape (..., n, m)
    Q : ndarray, shape (..., n, n)
        Hermitian, positive semidefinite.
    R : ndarray, shape (..., m)
        Diagonal of the input's weight, positive.
    """

    A: Array
    B: Array
    Q: Array
    R: Array


@dataclass(frozen=True)
class Solution:
    """Stabilising solution.

    Attributes
    ----------
    X : ndarray, shape (n, n)
    K : ndarray, shape (m, n)
    schur : tuple of ndarray
        Complex Schur form T and vectors U of A - B K.
    """

    X: Array
    K: Array
    schur: tuple[Array, Array] = field(repr=False)

    @property
    def poles(self) -> Array:
        """Eigenvalues of A - B K."""
        return np.diagonal(self.schur[0])


def solve(data: Data) -> Solution:
    """Solve a Riccati equation.

    Parameters
    ----------
    data : Data

    Returns
    -------
    Solution
        The solution of SciPy, polished by Newton's method as long as that makes the residual smaller.

    Raises
    ------
    SolveError
        If no stabilising solution is found.
    """
    nothing = SolveError("the Riccati equation has no stabilising solution")
    try:
        X = sla.solve_continuous_are(data.A, data.B, data.Q, np.diag(data.R))
    except np.linalg.LinAlgError:
        raise nothing from None
    best: float = np.inf
    found: Solution | None = None
    while best > EXACT:
        X = (X + X.conj().T) / 2.0
        K = (data.B.conj().T @ X) / data.R[:, None]
        half = X @ data.A
        residual = half + half.conj().T - K.conj().T @ (data.R[:, None] * K) + data.Q
        terms = 2.0 * np.linalg.norm(half) + np.linalg.norm(data.Q)
        size = float(np.linalg.norm(residual) / max(terms, np.finfo(float).tiny))
        polished = Solution(X, K, sla.schur(data.A - data.B @ K, output="complex"))
        if not (size < best and (polished.poles.real < 0.0).all()):
            break
        best, found = size, polished
        X = X + _correction(found, residual[None])[0]
    if found is None or best > SOLVED:
        raise nothing
    return found


def derivatives(data: Data, changes: Data, solution: Solution) -> tuple[Array, Array]:
    """How the solution follows its data.

    Parameters
    ----------
    data : Data
    changes : Data
        Derivatives with respect to k parameters, along the first axis.
    solution : Solution
        Of the data.

    Returns
    -------
    dX : ndarray, shape (k, n, n)
    dK : ndarray, shape (k, m, n)
    """
    X, K, weight = solution.X, solution.K, data.R[:, None]
    through = X @ (changes.A - changes.B @ K)  # X dA - X dB K, and its adjoint below
    source = changes.Q + through + adjoint(through) + adjoint(K) @ (changes.R[:, :, None] * K)
    dX = _correction(solution, source)
    half = dX @ (data.A - data.B @ K)
    dX = dX + _correction(solution, source + half + adjoint(half))  # gains hang on digits that the first one loses
    dK = (adjoint(changes.B) @ X + data.B.conj().T @ dX - changes.R[:, :, None] * K) / weight
    return dX, dK


def _correction(solution: Solution, sources: Array) -> Array:
    """All Y of (A - B K)^H Y + Y (A - B K) + source = 0."""
    found = lyapunov(solution.schur, sources)
    return found if np.iscomplexobj(solution.X) else found.real


def lyapunov(schur: tuple[Array, Array], sources: Array) -> Array:
    """All Y of M^H Y + Y M + source = 0; without eigenvectors, which notches with double poles do not have.

    Parameters
    ----------
    schur : tuple of ndarray
        Complex Schur form T and vectors U of M = U T U^H.
    sources : ndarray, shape (k, n, n)

    Returns
    -------
    ndarray of complex, shape (k, n, n)
    """
    T, U = schur
    (trsyl,) = get_lapack_funcs(("trsyl",), (T,))
    found = np.zeros(sources.shape, complex)
    for k in np.flatnonzero(sources.any(axis=(1, 2))):
        y, scale, _ = trsyl(T, T, -(U.conj().T @ sources[k] @ U), trana="C")
        found[k] = y / scale
    return np.asarray(U @ found @ U.conj().T)


def adjoint(stack: Array) -> Array:
    """Conjugate transpose of a matrix, or of each of a stack."""
    return stack.conj().swapaxes(-1, -2)
