"""One design at work: its matrices in few coordinates, and its eigenvalues at several speeds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..analysis.system import Array
from .coordinates import Coordinates
from .family import Member


@dataclass(frozen=True)
class Spectra:
    """Eigensystems at several speeds.

    Attributes
    ----------
    speeds : ndarray, shape (s,)
    values : ndarray, shape (s, m)
    right : ndarray, shape (s, m, m)
        Columns.
    left : ndarray, shape (s, m, m)
        Rows w with w v = 1, not conjugated.
    """

    speeds: Array
    values: Array
    right: Array
    left: Array


class State:
    """A member of a family in given coordinates.

    Parameters
    ----------
    member : Member
    coordinates : Coordinates

    Attributes
    ----------
    a0, a1 : ndarray, shape (m, m)
        dz/dt = (a0 + Omega a1) z.
    decompositions : int
        Eigendecompositions so far.
    """

    def __init__(self, member: Member, coordinates: Coordinates):
        self.member, self.coordinates = member, coordinates
        e, a0, a1 = (coordinates.left @ member.part(name) @ coordinates.right for name in ("E", "A0", "A1"))
        self.lower = np.linalg.solve(e, coordinates.left)
        """Rows that turn left vectors of a0 + Omega a1 into those of the pencil."""
        self.a0, self.a1 = np.linalg.solve(e, a0), np.linalg.solve(e, a1)
        self.decompositions = 0
        self._spectra: dict[float, tuple[Array, Array, Array]] = {}

    @property
    def size(self) -> int:
        """Number of states in these coordinates."""
        return len(self.a0)

    @cached_property
    def ports(self) -> tuple[Array, Array, Array]:
        """F, G and C in these coordinates."""
        m = self.member
        return self.lower @ m.part("F"), self.lower @ m.part("G"), m.part("C") @ self.coordinates.right

    @cached_property
    def critical(self) -> tuple[Array, Array, Array]:
        """Eigensystem of the pencil that a whirl at the speed of the shaft obeys.

        A load that turns with the shaft, exp(i Omega t), makes (Omega (i - A1) - A0) x = load: linear in the speed. One
        eigendecomposition therefore gives the response at every speed.

        Returns
        -------
        values : ndarray, shape (m,)
            Complex critical speeds.
        right, left : ndarray, shape (m, m)
            x = right (Omega - values)^-1 left load.
        """
        whirl = 1j * np.eye(self.size) - self.a1
        try:
            inverse = np.linalg.inv(whirl)
        except np.linalg.LinAlgError:  # a disk whose forward whirl runs parallel to the line of synchronous speeds
            inverse = np.linalg.inv(whirl + 1e-9 * np.eye(self.size))
        self.decompositions += 1
        values, right, left = _eigensystems(inverse @ self.a0)
        return values, right, left @ inverse

    def spectra(self, speeds: Array) -> Spectra:
        """Eigenvalues with right and left vectors.

        Parameters
        ----------
        speeds : ndarray, shape (s,)
            Spin speeds [rad/s].
        """
        new = np.array([s for s in np.unique(speeds) if s not in self._spectra])
        if len(new):
            self._decompose(new)
        found = [self._spectra[s] for s in speeds]
        return Spectra(speeds, *(np.stack([f[i] for f in found]) for i in range(3)))

    def eigenvalues(self, speeds: Array) -> Array:
        """Eigenvalues without vectors, shape (s, m): for a look, at half the cost."""
        self.decompositions += len(speeds)
        return np.asarray(np.linalg.eigvals(self.a0 + speeds[:, None, None] * self.a1))

    def _decompose(self, speeds: Array) -> None:
        values, right, left = _eigensystems(self.a0 + speeds[:, None, None] * self.a1)
        self.decompositions += len(speeds)
        self._spectra |= dict(zip(speeds.tolist(), zip(values, right, left, strict=True), strict=True))

    def lifted(self, right: Array, left: Array) -> tuple[Array, Array]:
        """Vectors of the pencil from those in these coordinates, one a row."""
        return right @ self.coordinates.right.T, left @ self.lower

    def eigenvalue_slopes(self, values: Array, speeds: Array, right: Array, left: Array) -> tuple[Array, Array]:
        """Derivatives of eigenvalues with respect to the parameters and the speed.

        Parameters
        ----------
        values, speeds : ndarray, shape (k,)
        right, left : ndarray, shape (k, m)
            One vector a row; left not conjugated.

        Returns
        -------
        slopes : ndarray of complex, shape (k, parameters)
        rates : ndarray of complex, shape (k,)
        """
        x, y = self.lifted(right, left)
        return self.forms(y, x, values, speeds), ((left @ self.a1) * right).sum(axis=1)

    def forms(self, y: Array, x: Array, s: Array, speeds: Array) -> Array:
        """y (dA0 + speed dA1 - s dE) x for rows of vectors of the pencil, shape (k, parameters)."""
        m = self.member
        slopes: Array = m.form("A0", y, x)
        if "A1" in m.family.shapes:
            slopes = slopes + speeds[:, None] * m.form("A1", y, x)
        if "E" in m.family.shapes:
            slopes = slopes - s[:, None] * m.form("E", y, x)
        return slopes


def _eigensystems(matrices: Array) -> tuple[Array, Array, Array]:
    """Eigenvalues, right vectors as columns, left ones as rows, of a matrix or a stack of them."""
    values, right = np.linalg.eig(matrices)
    try:
        return values, right, np.linalg.inv(right)
    except np.linalg.LinAlgError:  # a defective matrix: one within rounding of it has all its vectors
        nearby = np.random.default_rng(0).standard_normal(matrices.shape)
        values, right = np.linalg.eig(matrices * (1.0 + 64.0 * np.finfo(float).eps * nearby))
        return values, right, np.linalg.inv(right)
