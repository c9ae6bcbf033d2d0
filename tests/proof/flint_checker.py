"""A second checker of proofs of stability, which shares nothing with the first.

Numbers are balls of 128 bits (python-flint), so that nothing depends on bounds of rounding that somebody derived. For a cell,
any V, W and signs J will do: S = W (A Q + Q A^H) W^H with Q = V J V^H is computed in balls from the exact doubles, at each
corner anew, and -S is positive definite if all pivots of its LDL^H factorisation are balls of positive numbers. Then A has as
many eigenvalues with positive real part as J has entries -1, and none on the imaginary axis.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, ctx

Array = np.ndarray[Any, Any]
Edges = tuple[tuple[float, float], ...]

BITS = 128


class RefusedError(Exception):
    """The certificate proves nothing."""


# --- matrices --------------------------------------------------------------------------------------------------------


def exact(matrix: Array) -> acb_mat:
    """The same numbers, without rounding."""
    rows = np.atleast_2d(matrix)
    if rows.dtype.kind in "ib":
        return acb_mat([[acb(int(x)) for x in row] for row in rows])
    if rows.dtype.kind not in "fc" or rows.dtype.itemsize > {"f": 8, "c": 16}[rows.dtype.kind]:
        raise RefusedError(f"numbers of the type {rows.dtype}")
    return acb_mat([[acb(float(x.real), float(x.imag)) for x in row] for row in rows])


def adjoint(m: acb_mat) -> acb_mat:
    """The conjugate transpose."""
    return m.transpose().conjugate()


def cut(m: acb_mat, rows: range, columns: range) -> acb_mat:
    """A block of a matrix."""
    return acb_mat([[m[i, j] for j in columns] for i in rows])


def blocks(parts: list[list[acb_mat]]) -> acb_mat:
    """A matrix from its blocks."""
    bands = [zip(*(block.table() for block in band), strict=True) for band in parts]
    return acb_mat([list(itertools.chain.from_iterable(rows)) for band in bands for rows in band])


def positive_definite(m: acb_mat) -> bool:
    """True if all pivots of the LDL^H factorisation, done in halves, are positive throughout their balls.

    Only true of a ball that holds no Hermitian matrix but positive definite ones.
    """
    n = m.nrows()
    if n == 1:
        return bool(m[0, 0].real > 0)
    head, tail = range(n // 2), range(n // 2, n)
    first = cut(m, head, head)
    if not positive_definite(first):
        return False
    try:
        across = first.solve(cut(m, head, tail))
    except ZeroDivisionError:
        return False
    return positive_definite(cut(m, tail, tail) - cut(m, tail, head) * across)


# --- cells -----------------------------------------------------------------------------------------------------------


def guesses(matrix: Array, moves: list[Array]) -> Iterator[tuple[Array, Array, Array]]:
    """V, W and the signs of J from the eigenvectors, with several scalings of them."""
    values, vectors = np.linalg.eig(matrix)
    inverse = np.linalg.inv(vectors)
    rates = np.sqrt(2.0 * np.abs(values.real))
    signs = np.where(values.real < 0.0, 1, -1)
    for scale in scalings(inverse, vectors, rates, moves):
        v, w = vectors * scale, inverse / (rates * scale)[:, None]
        if np.isfinite(v).all() and np.isfinite(w).all():
            yield v, w, signs


def scalings(inverse: Array, vectors: Array, rates: Array, moves: list[Array]) -> Iterator[Array]:
    """Scales of the eigenvectors: of the Perron vectors of what moves the matrix, by iteration and exactly; none."""
    size = sum((np.abs(inverse @ m @ vectors) for m in moves), np.zeros(vectors.shape)) / np.outer(rates, rates)
    if size.any() and np.isfinite(size).all():
        size = size + 1e-12 * size.max()
        right = left = np.ones(len(size))
        for _ in range(60):
            right, left = size @ right, left @ size
            right, left = right / right.max(), left / left.max()
        yield np.sqrt(right / left)
        for _ in range(2000):
            right, left = size @ right, left @ size
            right, left = right / right.max(), left / left.max()
        yield np.sqrt(right / left)
    yield np.ones(len(rates))


class Affine:
    """A matrix that is affine in the speed and in the coordinates of a box: doubles for guesses, balls for the proof."""

    def __init__(self, rough: list[Array], parts: list[acb_mat]):
        self.rough, self.parts = rough, parts

    def cell(self, middle: list[float], edges: Edges, allowed: Callable[[int], bool]) -> bool:
        """True if the cell is proven."""
        matrix = self.rough[0] + sum(t * m for t, m in zip(middle, self.rough[1:], strict=True))
        moves = [(b - a) * m for (a, b), m in zip(edges, self.rough[1:], strict=True) if b > a]
        with np.errstate(all="ignore"):
            try:
                found = list(guesses(matrix, moves))
            except np.linalg.LinAlgError:
                return False
        return any(allowed(int((j < 0).sum())) and self.definite(v, w, j, edges) for v, w, j in found)

    def definite(self, v: Array, w: Array, signs: Array, edges: Edges) -> bool:
        """True if S is negative definite at all corners."""
        right, left = exact(v), exact(w)
        rows = adjoint(left * right).table()
        back = acb_mat([[-x for x in row] if sign < 0 else row for row, sign in zip(rows, signs, strict=True)])
        forms = [left * (part * right) * back for part in self.parts]
        for corner in itertools.product(*edges):
            half = forms[0]
            for t, form in zip(corner, forms[1:], strict=True):
                half = half + form * acb(t)
            if not positive_definite(-(half + adjoint(half))):
                return False
        return True

    def confirm(self, tree: Any, edges: Edges, allowed: Callable[[int], bool]) -> None:
        """Go through a cover."""
        todo = [(tree, edges)]
        while todo:
            node, edges = todo.pop()
            if not isinstance(node, list):
                middle = [real(node), *((a + b) / 2.0 for a, b in edges[1:])]
                if not self.cell(middle, edges, allowed):
                    raise RefusedError(f"the cell {edges[0]}")
                continue
            axis, place = node[0], real(node[1])
            if isinstance(axis, bool) or not isinstance(axis, int) or axis not in range(len(edges)) or len(node) != 4:
                raise RefusedError("the cover")
            a, b = edges[axis]
            if not a < place < b:
                raise RefusedError("a cut")
            for part, edge in ((node[2], (a, place)), (node[3], (place, b))):
                todo.append((part, tuple(edge if k == axis else old for k, old in enumerate(edges))))


def real(raw: Any) -> float:
    """A number of a certificate."""
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not abs(raw) < 1e300:
        raise RefusedError("a number")
    return float(raw)


# --- claims ----------------------------------------------------------------------------------------------------------


def digest(matrices: Mapping[str, Array]) -> str:
    """Hash of names, shapes and numbers, as certificates state it."""
    data = b"".join(
        f"{name} {m.shape} ".encode() + np.asarray(m, "<c16").tobytes(order="C") for name, m in sorted(matrices.items())
    )
    return hashlib.sha256(data).hexdigest()


def confirm(certificate: Mapping[str, Any], matrices: Mapping[str, Array], bits: int = BITS) -> None:
    """Prove all claims of a certificate.

    Raises
    ------
    RefusedError
        At the first that cannot be proven.
    """
    if certificate["sha256"] != digest(matrices):
        raise RefusedError("the matrices")
    with ctx.workprec(bits):
        for claim in certificate["claims"]:
            confirm_claim(claim, matrices)


def confirms(certificate: Mapping[str, Any], matrices: Mapping[str, Array], bits: int = BITS) -> bool:
    """True if all claims are proven."""
    try:
        confirm(certificate, matrices, bits)
    except RefusedError:
        return False
    return True


def confirm_claim(claim: Mapping[str, Any], matrices: Mapping[str, Array]) -> None:
    """Prove one claim, at the precision of the context."""
    box = claim.get("box", {})
    low, high = (real(speed) for speed in claim["speeds"])
    sides = [real(side) for side in box.values()]
    if not 0.0 <= low <= high or min(sides, default=1.0) <= 0.0:
        raise RefusedError("the range")
    edges = ((low, high), *((-side, side) for side in sides))
    rough = [np.asarray(matrices[name]) for name in ("A0", "A1", *(f"D_{name}" for name in box))]
    parts = [exact(m) for m in rough]
    kind, cover = claim["kind"], claim["cover"]
    if kind == "stable":
        Affine(rough, parts).confirm(cover, edges, lambda count: count == 0)
    elif kind == "unstable":
        Affine(rough, parts).confirm(cover, edges, lambda count: count > 0)
    elif kind == "damping":
        ratio = real(claim["ratio"])
        if not 0.0 < ratio < 1.0:
            raise RefusedError("the ratio")
        for tree, z in zip(cover, (ratio, -ratio), strict=True):
            turn = acb((1 - arb(z) * arb(z)).sqrt(), arb(z))
            turned = Affine([m * complex(turn) for m in rough], [p * turn for p in parts])
            turned.confirm(tree, edges, lambda count: count == 0)
    elif kind == "sensitivity":
        n, k, gamma = len(rough[0]), claim["loop"], real(claim["below"])
        if box or gamma <= 1.0 or isinstance(k, bool) or k not in range(matrices["B"].shape[1]) or len(cover) != 2:
            raise RefusedError("the sensitivity")
        Affine(rough, parts).confirm(cover[0], edges, lambda count: count == 0)
        whole = bounded_real(parts, exact(matrices["B"][:, k : k + 1]), exact(matrices["C"][k : k + 1]), gamma)
        about = [np.array([[complex(x) for x in row] for row in m.table()]) for m in whole]
        Affine(about, whole).confirm(cover[1], edges, lambda count: count == n)
    else:
        raise RefusedError("the kind")


def bounded_real(parts: list[acb_mat], b: acb_mat, c: acb_mat, gamma: float) -> list[acb_mat]:
    """The Hamiltonian of G = 1 + C (s - A)^-1 B, which has eigenvalues iw where a singular value of G(iw) is gamma.

    From the state-space form of gamma^2 - G~ G, with R = gamma^2 - 1.
    """
    inverse = 1 / (arb(gamma) ** 2 - 1)
    n = parts[0].nrows()
    nothing = acb_mat(n, n)
    a = parts[0] + b * c * inverse
    corner = -(adjoint(c) * c) * (1 + inverse)
    first = blocks([[a, b * adjoint(b) * inverse], [corner, -adjoint(a)]])
    return [first, *(blocks([[p, nothing], [nothing, -adjoint(p)]]) for p in parts[1:])]
