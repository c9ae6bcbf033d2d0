"""A small family as dense matrices: for studies that evaluate a few states thousands of times.

Sparse bookkeeping costs more than the eigenvalues of a dozen states. Here each evaluation is one CasADi call, and the derivative
of any function of the matrix A = E^-1 (A0 + Omega A1) is one product with the Jacobian of its nonzeros: df = tr(M dA).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.system import Array
from .family import Family


class DenseFamily:
    """A family with all matrices dense, in coordinates scaled by a diagonal matrix.

    Parameters
    ----------
    family : Family
    scale : ndarray, shape (n,), optional
        x = scale * z; ones if left out.

    Attributes
    ----------
    evaluations : int
        Decompositions, as counted by the modules that make them.
    """

    def __init__(self, family: Family, scale: Array | None = None):
        self.family = family
        self.scale = np.ones(family.size) if scale is None else scale
        self.evaluations = 0
        self._places: dict[str, list[tuple[complex, slice, Array, Array]]] = {
            name: [(unit, *family.slots[name, k]) for k, unit in enumerate((1.0, 1j))]
            for name in ("E", "A0", "A1")
            if name in family.shapes
        }

    def at(self, p: Array) -> Point:
        """The matrices at given parameters.

        Parameters
        ----------
        p : ndarray, shape (parameters,)
        """
        values, jacobian = self.family.nonzeros(p)
        return Point(self, values.full()[:, 0], jacobian.full())

    def part(self, name: str, values: Array) -> Array | None:
        """A part from the nonzeros of all; None if there is none."""
        if name not in self._places:
            return None
        out = np.zeros((self.family.size, self.family.size), complex)
        for unit, where, rows, cols in self._places[name]:
            out[rows, cols] += unit * values[where]
        return out if out.imag.any() else out.real

    def pull(self, name: str, weights: Array, jacobian: Array) -> Array:
        """Derivatives of tr(weights X) with respect to the parameters."""
        out = np.zeros(jacobian.shape[1], complex)
        for unit, where, rows, cols in self._places[name]:
            if len(rows):
                out += unit * (weights[cols, rows] @ jacobian[where])
        return out


@dataclass(frozen=True)
class Point:
    """A dense family at one value of its parameters.

    Attributes
    ----------
    dense : DenseFamily
    values : ndarray
        Nonzeros of all parts.
    jacobian : ndarray
    """

    dense: DenseFamily
    values: Array
    jacobian: Array

    def matrix(self, speed: float = 0.0) -> Array:
        """A = E^-1 (A0 + speed A1) in scaled coordinates.

        Parameters
        ----------
        speed : float
            Omega.
        """
        d = self.dense
        a = d.part("A0", self.values)
        assert a is not None
        if speed and (a1 := d.part("A1", self.values)) is not None:
            a = a + speed * a1
        if (e := d.part("E", self.values)) is not None:
            a = np.linalg.solve(e, a)
        return a * d.scale / d.scale[:, None]

    def slope(self, weights: Array, speed: float = 0.0) -> Array:
        """Derivatives of tr(weights A) with fixed weights.

        Parameters
        ----------
        weights : ndarray, shape (n, n)
            For scaled coordinates.
        speed : float
        """
        d = self.dense
        weights = d.scale[:, None] * weights / d.scale
        inner = weights
        if (e := d.part("E", self.values)) is not None:
            inner = np.linalg.solve(e.T, weights.T).T
        out = d.pull("A0", inner, self.jacobian)
        if speed and "A1" in d.family.shapes:
            out = out + speed * d.pull("A1", inner, self.jacobian)
        if e is not None:
            plain = self.matrix(speed) * d.scale[:, None] / d.scale
            out = out - d.pull("E", plain @ inner, self.jacobian)
        return out
