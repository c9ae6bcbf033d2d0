"""Linear motion under forces that are parabolas in time, exactly, over steps of one length: by doubling shorter steps.

z = [x, a0, a1, a2] with x' = A x + B f, f = a0 + a1 t + a2 t^2/2. Over a step h, z becomes [X z, S(h) a]. Besides X there are
the integrals over the step of z' Q z, for the works that are quadratic in the state, and of t^j/j! v for the velocities v that
the forces work on. All of them over 2 h follow from those over h.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..analysis.system import Array

SMALL = 0.2
"""Norm times step below which series and Gauss's rule with four points are exact to rounding."""

TERMS = 11
"""Of the series."""

MOMENTS = 4
"""Number of powers of time in the integrals of velocities."""

LARGE = 600
"""Size of z beyond which not all rungs are kept, lest they fill the memory."""

SPARSE = 4
"""Then one of as many is, and those that are asked for."""


@dataclass(frozen=True)
class Rung:
    """A length of step.

    Attributes
    ----------
    motion : ndarray, shape (n, d)
        X.
    works : ndarray, shape (forms, d, d)
    moments : ndarray, shape (MOMENTS, inputs, d)
    """

    motion: Array
    works: Array
    moments: Array


class Ladder:
    """All lengths of step for one linear part.

    Parameters
    ----------
    A, B : ndarray, shapes (n, n), (n, inputs)
    forms : ndarray, shape (forms, n, n)
        Q of each work, which concerns x alone.
    velocities : ndarray, shape (inputs, n)
        From x to the velocities that the inputs work on.
    """

    def __init__(self, A: Array, B: Array, forms: Array, velocities: Array):
        self.states, self.inputs = len(A), int(B.shape[1])
        self.size = self.states + 3 * self.inputs
        self.A, self.B, self.forms, self.velocities = A, B, forms, velocities
        self._norm = max(float(np.abs(np.hstack([A, B])).sum(axis=0).max()), 1.0)
        self._rungs: dict[float, Rung] = {}

    def at(self, h: float) -> Rung:
        """Matrices of a step."""
        if h not in self._rungs:
            self._rungs[h] = self._made(h)
        return self._rungs[h]

    def _made(self, h: float) -> Rung:
        if h in self._rungs:
            return self._rungs[h]
        if self._norm * h < SMALL:
            return self._short(h)
        doublings = int(math.log2(h / 2.0 * self._norm / SMALL))
        keep = self.size <= LARGE or doublings % SPARSE == 0
        return self._double(self.at(h / 2.0) if keep else self._made(h / 2.0), h / 2.0)

    def _short(self, h: float) -> Rung:
        n, b = self.states, self.inputs
        term = np.eye(n, self.size)
        series = [term]
        for k in range(1, TERMS):  # rows of exp(F t), as a series in t/h
            x, a0, a1 = term[:, :n], term[:, n : n + b], term[:, n + b : n + 2 * b]
            term = np.hstack([x @ self.A, x @ self.B, a0, a1]) * (h / k)
            series.append(term)
        terms = np.array(series)
        points, weights = np.polynomial.legendre.leggauss(4)
        works = np.zeros((len(self.forms), self.size, self.size))
        moments = np.zeros((MOMENTS, b, self.size))
        for s, weight in zip((points + 1.0) / 2.0, h * weights / 2.0, strict=True):
            x = np.tensordot(s ** np.arange(TERMS), terms, 1)
            works += weight * (x.T @ (self.forms @ x))
            for j in range(MOMENTS):
                moments[j] += weight * (s * h) ** j / math.factorial(j) * (self.velocities @ x)
        return Rung(terms.sum(axis=0), works, moments)

    def _double(self, half: Rung, h: float) -> Rung:
        x = half.motion
        right = self._then(half.works, x, h)
        later = self._then(half.moments, x, h)
        moments = half.moments.copy()
        for j in range(MOMENTS):
            for i in range(j + 1):
                moments[j] += h ** (j - i) / math.factorial(j - i) * later[i]
        works = self._then(right.transpose(0, 2, 1), x, h)
        return Rung(self._then(x, x, h), half.works + works, moments)

    def _then(self, rows: Array, x: Array, h: float) -> Array:
        """Rows on z, after a step h in which x is found."""
        n = self.states
        found = rows[..., :n] @ x
        found[..., n:] += blocks(rows[..., n:], np.array([[1.0, h, h * h / 2.0], [0.0, 1.0, h], [0.0, 0.0, 1.0]]))
        return found


def blocks(rows: Array, small: Array) -> Array:
    """Rows times the Kronecker product of a matrix with the identity."""
    apart = rows.reshape(*rows.shape[:-1], len(small), rows.shape[-1] // len(small))
    return np.asarray(np.einsum("...ib,ij->...jb", apart, small).reshape(rows.shape))
