"""Algebraic Riccati equations with exact derivatives.

A^H X + X A - X B R^-1 B^H X + Q = 0 with the stabilising solution X and the gain K = R^-1 B^H X. A change of the data moves X by the
solution of a Lyapunov equation of A - B K, which is solved for all changes at once in the coordinates of its eigenvectors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from ..errors import SolveError

Array = np.ndarray  # complex or real


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
    poles : ndarray, shape (n,)
        Eigenvalues of A - B K.
    """

    X: Array
    K: Array
    poles: Array


def solve(data: Data) -> Solution:
    """Solve a Riccati equation.

    Parameters
    ----------
    data : Data

    Returns
    -------
    Solution

    Raises
    ------
    SolveError
        If no stabilising solution is found.
    """
    try:
        X = sla.solve_continuous_are(data.A, data.B, data.Q, np.diag(data.R))
    except np.linalg.LinAlgError:
        raise SolveError("the Riccati equation has no stabilising solution") from None
    X = (X + X.conj().T) / 2.0
    K = (data.B.conj().T @ X) / data.R[:, None]
    poles = np.linalg.eigvals(data.A - data.B @ K)
    if not (poles.real < 0.0).all():
        raise SolveError("the Riccati equation has no stabilising solution")
    return Solution(X, K, poles)


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
    values, right = np.linalg.eig(data.A - data.B @ K)
    left = np.linalg.inv(right)
    through = X @ (changes.A - changes.B @ K)  # X dA - X dB K, and its adjoint below
    source = changes.Q + through + _adjoint(through) + K.conj().T @ (changes.R[:, :, None] * K)
    turned = right.conj().T @ source @ right
    dX = -(left.conj().T @ (turned / (values.conj()[:, None] + values)) @ left)
    dK = (_adjoint(changes.B) @ X + data.B.conj().T @ dX - changes.R[:, :, None] * K) / weight
    return dX, dK


def _adjoint(stack: Array) -> Array:
    return stack.conj().swapaxes(-1, -2)
