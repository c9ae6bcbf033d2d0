"""Complex matrices for CasADi, which has none: pairs of a real and an imaginary part.

A real-linear map between complex vectors is z -> H z + J conj(z). The machine is isotropic exactly when every J
is zero; then H alone is a complex model of half the size. Otherwise the real model works on the components
[v, w, beta_x, beta_y] of each node, with z = (r, phi), r = v + i w, phi = beta_y - i beta_x.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca

Matrix = Any
"""A CasADi DM, SX or MX matrix."""


@dataclass(frozen=True)
class Pair:
    """A complex matrix re + i im; `im` has no nonzeros in a real model."""

    re: Matrix
    im: Matrix

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.re.shape  # type: ignore[no-any-return]

    def __add__(self, other: Pair) -> Pair:
        return Pair(self.re + other.re, self.im + other.im)

    def __neg__(self) -> Pair:
        return Pair(-self.re, -self.im)

    def __getitem__(self, where: Any) -> Pair:
        return Pair(self.re[where], self.im[where])

    def between(self, left: Matrix, right: Matrix) -> Pair:
        """left X right for real matrices on both sides."""
        return Pair(ca.mtimes([left, self.re, right]), ca.mtimes([left, self.im, right]))

    def columns(self, first: int, last: int) -> Pair:
        """Some neighbouring columns; unlike a slice it keeps the width of a matrix without rows."""
        return self[:, first:last] if self.shape[0] else zero(0, last - first)

    def select(self, rows: list[int]) -> Pair:
        """Square submatrix of some rows and the same columns."""
        return Pair(self.re[rows, rows], self.im[rows, rows])


def real(matrix: Matrix) -> Pair:
    """A pair without imaginary part."""
    return Pair(matrix, type(matrix)(*matrix.shape))


def zero(rows: int, columns: int) -> Pair:
    """A pair without nonzeros."""
    return Pair(ca.DM(rows, columns), ca.DM(rows, columns))


def blocks(rows: list[list[Pair]]) -> Pair:
    """A pair from blocks, row by row."""
    return Pair(ca.blockcat([[x.re for x in row] for row in rows]), ca.blockcat([[x.im for x in row] for row in rows]))


@dataclass(frozen=True)
class Affine:
    """A complex matrix that changes in proportion to the spin speed: constant + Omega rate."""

    constant: Pair
    rate: Pair

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.constant.shape

    @property
    def fixed(self) -> bool:
        """True if nothing changes with the speed."""
        return bool(self.rate.re.nnz() == 0 and self.rate.im.nnz() == 0)

    def __add__(self, other: Affine) -> Affine:
        return Affine(self.constant + other.constant, self.rate + other.rate)

    def __neg__(self) -> Affine:
        return Affine(-self.constant, -self.rate)

    def __getitem__(self, where: Any) -> Affine:
        return Affine(self.constant[where], self.rate[where])

    def columns(self, first: int, last: int) -> Affine:
        """Some neighbouring columns."""
        return Affine(self.constant.columns(first, last), self.rate.columns(first, last))

    def between(self, left: Matrix, right: Matrix) -> Affine:
        """left X right for real matrices on both sides."""
        return Affine(self.constant.between(left, right), self.rate.between(left, right))


@dataclass(frozen=True)
class Map:
    """A real-linear map H z + J conj(z) on the node vectors."""

    H: Pair
    J: Pair

    def __add__(self, other: Map) -> Map:
        return Map(self.H + other.H, self.J + other.J)

    def to_real(self) -> Pair:
        """The map as a real matrix on [v, w, beta_x, beta_y] of each node."""
        h, j = self.H, self.J
        embedded = ca.blockcat([[h.re + j.re, j.im - h.im], [h.im + j.im, h.re - j.re]])
        turn = _components(h.shape[0] // 2)
        return real(ca.mtimes([turn, embedded, turn.T]))


@lru_cache(maxsize=64)
def _components(nodes: int) -> ca.DM:
    """Orthogonal matrix from (Re z, Im z) to [v, w, beta_x, beta_y] of each node."""
    n = 2 * nodes
    rows, columns, values = [], [], []
    for k in range(nodes):
        rows += [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3]
        columns += [2 * k, n + 2 * k, n + 2 * k + 1, 2 * k + 1]
        values += [1.0, 1.0, -1.0, 1.0]
    return ca.DM.triplet(rows, columns, ca.DM(values), 2 * n, 2 * n)
