"""Linear motion under forces that are parabolas in time, exactly, over steps of one length: by doubling shorter steps.

z = [x, a0, a1, a2] with x' = A x + B f, f = a0 + a1 t + a2 t^2/2. Over a step h, z becomes exp(F h) z. Besides this matrix there are
the integrals over the step of z' Q z, for the works that are quadratic in the state, and of t^j/j! v for the velocities v that
the forces work on. All of them over 2 h follow from those over h.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from ..analysis.system import Array

SMALL = 0.2
"""Norm of F h below which Gauss's rule with four points integrates to rounding."""

MOMENTS = 4
"""Number of powers of time in the integrals of velocities."""


@dataclass(frozen=True)
class Rung:
    """A length of step.

    Attributes
    ----------
    motion : ndarray, shape (d, d)
        exp(F h).
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
        Q of each work.
    velocities : ndarray, shape (inputs, n)
        From x to the velocities that the inputs work on.
    """

    def __init__(self, A: Array, B: Array, forms: Array, velocities: Array):
        self.states, self.inputs = n, b = B.shape
        size = n + 3 * b
        self.F, self.forms, self.velocities = (
            np.zeros((size, size)),
            np.zeros((len(forms), size, size)),
            np.zeros((b, size)),
        )
        self.F[:n, : n + b] = np.hstack([A, B])
        self.F[n : n + 2 * b, n + b :] = np.eye(2 * b)
        self.forms[:, :n, :n], self.velocities[:, :n] = forms, velocities
        self._norm = float(np.abs(self.F).sum(axis=0).max())
        self._rungs: dict[float, Rung] = {}

    def at(self, h: float) -> Rung:
        """Matrices of a step."""
        if h not in self._rungs:
            self._rungs[h] = self._short(h) if self._norm * h < SMALL else self._double(self.at(h / 2.0), h / 2.0)
        return self._rungs[h]

    def _short(self, h: float) -> Rung:
        points, weights = np.polynomial.legendre.leggauss(4)
        works, moments = np.zeros_like(self.forms), np.zeros((MOMENTS, *self.velocities.shape))
        for t, weight in zip(h * (points + 1.0) / 2.0, h * weights / 2.0, strict=True):
            motion = sla.expm(self.F * t)
            works += weight * (motion.T @ self.forms @ motion)
            moments += (
                weight
                * np.array([t**j / math.factorial(j) for j in range(MOMENTS)])[:, None, None]
                * (self.velocities @ motion)
            )
        return Rung(sla.expm(self.F * h), works, moments)

    @staticmethod
    def _double(half: Rung, h: float) -> Rung:
        motion = half.motion
        later = half.moments @ motion
        shifted = [
            sum((h ** (j - i) / math.factorial(j - i) * later[i] for i in range(j + 1)), half.moments[j])
            for j in range(MOMENTS)
        ]
        return Rung(motion @ motion, half.works + motion.T @ half.works @ motion, np.array(shifted))
