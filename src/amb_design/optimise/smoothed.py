"""The smoothed spectral abscissa (Vanbiervliet, Vandereycken, Michiels, Vandewalle & Diehl 2009).

It is the s at which the energy of x(t) = exp((A - s) t), summed over unit initial states, equals a given number: tr P = energy,
where (A - s) P + P (A - s)^H = -1. It lies above the spectral abscissa, tends to it as the energy grows, and is smooth even where
eigenvalues coalesce. Its derivative is tr(Q dA P)/tr(Q P), with Q from the adjoint equation.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg as sla

from ..analysis.system import Array
from .dense import DenseFamily

_trsyl = sla.get_lapack_funcs("trsyl", dtype=complex)


class SmoothedAbscissa:
    """The smoothed abscissa as a function of the parameters, the largest one over several speeds.

    Parameters
    ----------
    dense : DenseFamily
    speeds : tuple of float
    energy : float
        [s].
    """

    def __init__(self, dense: DenseFamily, speeds: tuple[float, ...], energy: float):
        self.dense, self.speeds, self.energy = dense, speeds, energy
        self._distances: dict[float, float] = {}

    def __call__(self, p: Array) -> tuple[float, Array]:
        """Value and gradient.

        Parameters
        ----------
        p : ndarray, shape (parameters,)
        """
        point = self.dense.at(p)
        self.dense.evaluations += len(self.speeds)
        found = [(*self._value(point.matrix(s), s), s) for s in self.speeds]
        value, weights, speed = max(found, key=lambda f: f[0])
        return value, point.slope(weights, speed).real

    def _value(self, a: Array, speed: float) -> tuple[float, Array]:
        """The smoothed abscissa of a matrix, and the weights of its derivative."""
        t, z = sla.schur(a, output="complex", check_finite=False)
        unit = -np.eye(len(t), dtype=complex)
        abscissa = float(t.diagonal().real.max())
        distance = self._distances.get(speed, 0.1 * float(np.abs(t).max()) + 1e-12)
        low, high = 0.0, math.inf
        for _ in range(60):  # Newton in logarithms, inside a bracket
            shifted = t + (abscissa + distance) * unit
            p, size, _ = _trsyl(shifted, shifted, unit, tranb="C")
            q, _, _ = _trsyl(shifted, shifted, unit, trana="C")
            trace, product = float(p.trace().real), float(np.sum(q.T * p).real)
            if not (trace > 0.0 and product > 0.0 and math.isfinite(product)) or size != 1.0:  # singular to rounding
                low, distance = distance, 2.0 * distance
                continue
            excess = math.log(trace / self.energy)
            exponent = 0.5 * excess * trace / (product * distance)
            if abs(excess) < 1e-4:  # the last step is taken without looking: what is left is of second order
                distance *= 1.0 + exponent
                break
            low, high = (distance, high) if excess > 0.0 else (low, distance)
            new = distance * math.exp(min(max(exponent, -3.0), 3.0))
            if not low < new < high:
                outward = distance * (2.0 if excess > 0.0 else 0.5)
                new = math.sqrt(low * high) if low > 0.0 and high < math.inf else outward
            if high - low <= 1e-14 * distance:
                break
            distance = new
        self._distances[speed] = distance
        return abscissa + distance, z @ (p @ q) @ z.conj().T / product
