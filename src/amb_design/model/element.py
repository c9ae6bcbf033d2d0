"""Three-node Timoshenko shaft element in complex coordinates.

Each node has r = v + i w (lateral displacement) and phi = beta_y - i beta_x (slope, r' ~ phi). Interpolation is
quadratic in both. Shear and coupling terms are integrated with two Gauss points, which removes locking; the rest
exactly. The element matrices are sums of fixed shapes times a coefficient of the element, so that an assembled
matrix is, in its nonzeros, a constant sparse map applied to the vector of coefficients.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import casadi as ca

from .pair import Matrix

_Matrix = list[list[float]]


def _psi(x: float) -> list[float]:
    return [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)]


def _dpsi(x: float) -> list[float]:
    return [4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0]


_GAUSS2 = [(0.5 - 0.5 / math.sqrt(3.0), 0.5), (0.5 + 0.5 / math.sqrt(3.0), 0.5)]
_GAUSS3 = [(0.5 - math.sqrt(0.15), 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + math.sqrt(0.15), 5.0 / 18.0)]

_Shape = Callable[[float], list[float]]


def _integral(left: _Shape, right: _Shape, rule: list[tuple[float, float]]) -> _Matrix:
    """Integral of left^T right over the unit element."""
    return [[sum(w * left(x)[i] * right(x)[j] for x, w in rule) for j in range(3)] for i in range(3)]


def _blocks(*blocks: tuple[int, int, float, _Matrix]) -> _Matrix:
    """6 x 6 element matrix, order r0, phi0, r1, phi1, r2, phi2, from (row, column, factor, 3 x 3) blocks."""
    out = [[0.0] * 6 for _ in range(6)]
    for row, column, factor, block in blocks:
        for i in range(3):
            for j in range(3):
                out[2 * i + row][2 * j + column] += factor * block[i][j]
    return out


def _transposed(m: _Matrix) -> _Matrix:
    return [list(column) for column in zip(*m, strict=True)]


_R, _PHI = 0, 1
_dd2 = _integral(_dpsi, _dpsi, _GAUSS2)
_dn2 = _integral(_dpsi, _psi, _GAUSS2)
_nn2 = _integral(_psi, _psi, _GAUSS2)
_dd3 = _integral(_dpsi, _dpsi, _GAUSS3)
_nn3 = _integral(_psi, _psi, _GAUSS3)

SHAPES: dict[str, _Matrix] = {
    # shear energy 1/2 S |r' - phi|^2, in powers of the element length: 1/L, 1, L
    "shear_rr": _blocks((_R, _R, 1.0, _dd2)),
    "shear_rp": _blocks((_R, _PHI, -1.0, _dn2), (_PHI, _R, -1.0, _transposed(_dn2))),
    "shear_pp": _blocks((_PHI, _PHI, 1.0, _nn2)),
    # bending energy 1/2 B11 |phi'|^2
    "bending": _blocks((_PHI, _PHI, 1.0, _dd3)),
    # coupling energy a Im(conj(r' - phi) phi'): imaginary parts, 1/L and 1
    "coupling_rp": _blocks((_R, _PHI, -1.0, _dd2), (_PHI, _R, 1.0, _dd2)),
    "coupling_pp": _blocks((_PHI, _PHI, 1.0, _transposed(_dn2)), (_PHI, _PHI, -1.0, _dn2)),
    # inertia and anything proportional to the velocity of the axis
    "translation": _blocks((_R, _R, 1.0, _nn3)),
    "rotation": _blocks((_PHI, _PHI, 1.0, _nn3)),
}


@lru_cache(maxsize=256)
def _scatter(shape: str, elements: int) -> tuple[ca.Sparsity, ca.DM]:
    """Sparsity of the assembled matrix, and the map from element coefficients to its nonzeros."""
    matrix = SHAPES[shape]
    entries = [(i, j, matrix[i][j]) for i in range(6) for j in range(6) if matrix[i][j] != 0.0]
    n = 4 * elements + 2
    rows = [4 * e + i for e in range(elements) for i, _, _ in entries]
    columns = [4 * e + j for e in range(elements) for _, j, _ in entries]
    sparsity = ca.Sparsity.triplet(n, n, rows, columns)
    where = {rc: k for k, rc in enumerate(zip(*sparsity.get_triplet(), strict=True))}
    targets = [where[rc] for rc in zip(rows, columns, strict=True)]
    sources = [e for e in range(elements) for _ in entries]
    values = [v for _ in range(elements) for _, _, v in entries]
    return sparsity, ca.DM.triplet(targets, sources, ca.DM(values), sparsity.nnz(), elements)


def assemble(shape: str, coefficients: Matrix) -> Matrix:
    """Sum of the elements' matrices of one shape.

    Parameters
    ----------
    shape : str
        Key of ``SHAPES``.
    coefficients : CasADi column, one entry an element

    Returns
    -------
    CasADi matrix, 2 (2 elements + 1) square, rows r and phi of each node from left to right
    """
    sparsity, scatter = _scatter(shape, coefficients.shape[0])
    return type(coefficients)(sparsity, ca.mtimes(scatter, coefficients))
