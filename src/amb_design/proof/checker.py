"""Checks proofs of stability. Stands alone: numpy, scipy and the standard library, nothing of this package.

What is proven. Given are matrices of floating-point numbers and the family

    A(Omega, d) = A0 + Omega A1 + d_1 D_1 + ... + d_m D_m

A claim says of every speed Omega in a range, and of all d in a box, one of

    stable        all eigenvalues of A have negative real parts
    unstable      at least one eigenvalue of A has a positive real part
    damping       all eigenvalues have damping ratios -Re/abs above a given one
    sensitivity   A is stable and abs(1 + C_k (iw - A)^-1 B_k) < gamma at every real frequency w

How. For any square matrices V, W and signs J = diag(+-1) let Q = V J V^H and S = W (A Q + Q A^H) W^H. If S is negative
definite, A has exactly as many eigenvalues with positive real part as J has entries -1, and none on the imaginary axis
(Ostrowski and Schneider 1962; Lyapunov's theorem where J = 1). S is affine in Omega and d: negative definite at all corners of
a box, it is so inside. V and W may be anything; here they are made of computed eigenvectors, and nothing depends on how good they
are. A cover cuts the range and the box into cells until S can be shown to be negative definite at all corners of each.
Damping ratios above z: the same for (c + iz) A and (c - iz) A, with c just below sqrt(1 - z^2). Sensitivity below gamma: the
Hamiltonian matrix of the bounded-real lemma, affine in Omega too, has no eigenvalue on the axis (Boyd et al. 1989).

What is trusted. IEEE double arithmetic, rounded to nearest; matrix products that sum n products of entries in any order,
with or without fused multiply-add (no Strassen); sums and comparisons of arrays. LAPACK is not trusted: its results enter
as guesses only. All that is rounded is a ball, midpoint and radius, after the a-priori bounds
abs(fl(A B) - A B) <= n u/(1 - n u) abs(A) abs(B) (Higham 2002, section 3.5), doubled and more for complex numbers.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

FORMAT = "amb_design/proof/1"
LARGEST = 2**20
"""Bytes of a certificate, and..."""
CELLS, DEPTH = 20000, 500
"""... cells and depth of a cover beyond which it is refused."""

U = 2.0**-53
TINY = 1e-290
"""More than all underflow can add to an entry of a product."""
MORE = 1.0 + 1e-6
"""Covers the rounding of a radius itself, which is a sum of fewer than a million positive terms."""


class ProofError(Exception):
    """The certificate does not prove what it claims, or is none; the message says why."""


class Ball:
    """All matrices within a radius, entry by entry, of a midpoint."""

    def __init__(self, mid: Array, rad: Array | None = None):
        self.mid = mid
        self.rad: Array = np.zeros(mid.shape) if rad is None else rad

    def __matmul__(self, other: Ball) -> Ball:
        gamma = 4.0 * (self.mid.shape[1] + 8) * U  # 2 sqrt(2) n u/(1 - 2 n u) and more
        a, b = np.abs(self.mid), np.abs(other.mid)
        rad = gamma * (a @ b) + a @ other.rad + self.rad @ (b + other.rad)
        return Ball(self.mid @ other.mid, MORE * rad + TINY)

    def __add__(self, other: Ball) -> Ball:
        mid = self.mid + other.mid
        return Ball(mid, MORE * (self.rad + other.rad + 2.0 * U * np.abs(mid)) + TINY)

    def scaled(self, factor: complex) -> Ball:
        """The product with a floating-point number, real or complex."""
        mid, size = factor * self.mid, abs(factor)
        return Ball(mid, MORE * (size * self.rad + 8.0 * U * size * np.abs(self.mid)) + TINY)

    @property
    def h(self) -> Ball:
        """The conjugate transpose."""
        return Ball(self.mid.conj().T, self.rad.T)


def negative_definite(s: Ball) -> bool:
    """True if every Hermitian matrix in the ball is negative definite.

    -S = sigma + L L^H + remainder, with L a computed Cholesky factor: definite if the remainder is smaller than sigma, and
    the largest row sum bounds its norm.
    """
    mid = -s.mid
    size = np.abs(np.diagonal(mid)).max()
    sigma = 4.0 * s.rad.sum(axis=1).max() + 64.0 * (len(mid) + 8) * U * size
    if not (np.isfinite(mid).all() and np.isfinite(sigma)):
        return False
    try:
        factor = Ball(np.linalg.cholesky(mid - sigma * np.eye(len(mid))))
    except np.linalg.LinAlgError:
        return False
    rest = Ball(mid, s.rad) + Ball(-sigma * np.eye(len(mid))) + (factor @ factor.h).scaled(-1.0)
    return bool(MORE * (np.abs(rest.mid) + rest.rad).sum(axis=1).max() < sigma)


def guesses(matrix: Array, moves: list[Array]) -> tuple[Array, Array, Array]:
    """V, W and the diagonal of J for a cell.

    Eigenvectors in the middle make S = -1 there; Perron scaling, after the parts of the family that move the matrix
    away from the middle, lets the cell be large.
    """
    values, v = np.linalg.eig(matrix)
    d = np.sqrt(2.0 * np.abs(values.real))
    w = np.linalg.inv(v) / np.maximum(d, 1e-150)[:, None]
    if moves:
        m = sum(np.abs(w @ move @ v) / np.maximum(d, 1e-150) for move in moves)
        m = m + 1e-12 * np.max(m) + 1e-300
        x = y = np.ones(len(m))
        for _ in range(60):
            x, y = m @ x, y @ m
            x, y = x / x.max(), y / y.max()
        s = np.sqrt(x / y)
        v, w = v * s, w / s[:, None]
    return v, w, np.where(values.real < 0.0, 1.0, -1.0)


class Family:
    """A sum of balls with factors, one for each matrix: 1, the speed, then the coordinates of the box.

    Parameters
    ----------
    parts : list of Ball
    """

    def __init__(self, parts: list[Ball]):
        self.parts = parts

    @np.errstate(all="ignore")  # what overflows is not definite
    def holds(
        self, corners: list[tuple[float, ...]], middle: tuple[float, ...], unstable: Callable[[int], bool]
    ) -> bool:
        """True if S is negative definite at all corners, with a number of eigenvalues -1 in J that suits.

        Parameters
        ----------
        corners : list of tuple of float
        middle : tuple of float
        unstable : callable
            Of the number of entries -1 in J.
        """
        matrix = sum((t * p.mid for t, p in zip(middle, self.parts[1:], strict=True)), self.parts[0].mid)
        ranges = np.ptp(np.array(corners), axis=0)
        try:
            moves = [r * p.mid for r, p in zip(ranges, self.parts[1:], strict=True) if r > 0.0]
            v, w, signs = guesses(matrix, moves)
        except np.linalg.LinAlgError:
            return False
        if not (np.isfinite(v).all() and np.isfinite(w).all() and unstable(int((signs < 0).sum()))):
            return False
        left, right = Ball(w), Ball(v)
        both = left @ right
        back = Ball(both.mid * signs, both.rad).h  # J V^H W^H
        forms = []
        for part in self.parts:
            t = left @ (part @ right) @ back
            forms.append(t + t.h)
        for corner in corners:
            s = forms[0]
            for factor, form in zip(corner, forms[1:], strict=True):
                s = s + form.scaled(factor)
            if not negative_definite(s):
                return False
        return True

    def proves(self, cover: Any, box: tuple[tuple[float, float], ...], unstable: Callable[[int], bool]) -> None:
        """Raise ProofError unless the cover proves the claim on the whole box.

        Parameters
        ----------
        cover : number, or list of axis, place, lower part, upper part
        box : tuple of (float, float)
        unstable : callable
        """
        cells, left = [(cover, box, 0)], CELLS
        while cells:
            node, box, depth = cells.pop()
            left -= 1
            if left < 0 or depth > DEPTH:
                raise ProofError("the cover has too many cells")
            if isinstance(node, list):
                if len(node) != 4 or type(node[0]) is not int or not 0 <= node[0] < len(box):
                    raise ProofError("the cover is damaged")
                axis, place = node[0], number(node[1])
                low, high = box[axis]
                if not low < place < high:
                    raise ProofError(f"the cover is cut at {place:.10g}, outside its cell")
                for part, edges in ((node[2], (low, place)), (node[3], (place, high))):
                    cells.append((part, (*box[:axis], edges, *box[axis + 1 :]), depth + 1))
                continue
            middle = (number(node), *[0.5 * (a + b) for a, b in box[1:]])
            corners = list(itertools.product(*[sorted({a, b}) for a, b in box]))
            if not self.holds(corners, middle, unstable):
                raise ProofError(f"nothing is proven from {box[0][0]:.10g} to {box[0][1]:.10g} rad/s")


def sector(parts: list[Ball], ratio: float) -> list[Ball]:
    """(c + i ratio) A, with c just below what makes the factor's modulus one."""
    c = math.sqrt((1.0 - ratio) * (1.0 + ratio)) * (1.0 - 8.0 * U)
    return [p.scaled(complex(c, ratio)) for p in parts]


def hamiltonian(parts: list[Ball], b: Ball, c: Ball, gamma: float) -> list[Ball]:
    """The bounded-real lemma's matrices for 1 + C (s - A)^-1 B: with 1/(g^2 - 1) rounded up, the bound g is at most gamma."""
    r = 1.0 / ((gamma - 1.0) * (gamma + 1.0)) * (1.0 + 16.0 * U)
    zero, cc = Ball(np.zeros(parts[0].mid.shape)), c.h @ c
    first = parts[0] + (b @ c).scaled(r)
    whole = joined(first, (b @ b.h).scaled(r), (cc + cc.scaled(r)).scaled(-1.0), first.h.scaled(-1.0))
    return [whole, *[joined(p, zero, zero, p.h.scaled(-1.0)) for p in parts[1:]]]


def joined(a: Ball, b: Ball, c: Ball, d: Ball) -> Ball:
    """Four balls as the blocks of one."""
    return Ball(np.block([[a.mid, b.mid], [c.mid, d.mid]]), np.block([[a.rad, b.rad], [c.rad, d.rad]]))


def number(raw: Any) -> float:
    """A finite number of a certificate."""
    if isinstance(raw, bool) or not isinstance(raw, int | float) or not -1e300 < raw < 1e300:
        raise ProofError(f"{raw!a:.40} is no finite number")
    return float(raw)


def fingerprint(matrices: Mapping[str, Array]) -> str:
    """Hash of all matrices, their names and shapes."""
    total = hashlib.sha256()
    for name in sorted(matrices):
        array = np.ascontiguousarray(matrices[name], complex)
        total.update(f"{name} {array.shape} ".encode() + array.astype("<c16").tobytes())
    return total.hexdigest()


def admitted(matrices: Mapping[str, Array]) -> None:
    """Refuse what is no matrix of finite doubles: other kinds of numbers would round, or wrap around, unnoticed."""
    for name, m in matrices.items():
        doubles = isinstance(m, np.ndarray) and m.dtype in (np.float64, np.complex128)
        if not doubles or m.ndim != 2 or not m.size or not np.isfinite(m).all():
            raise ProofError(f"{name!a:.40} is no matrix of finite doubles")


def shown(x: float, way: int = 0, digits: int = 10) -> str:
    """A number in few digits, rounded up (+1) or down (-1); exactly where the way is 0."""
    text = f"{x:.{digits}g}"
    if way == 0 or x == 0.0:
        return repr(x).removesuffix(".0")
    if (float(text) - x) * way < 0.0:
        text = f"{float(text) + way * 10.0 ** (math.floor(math.log10(abs(x))) - digits + 1):.{digits}g}"
    return text


def read(text: str) -> dict[str, Any]:
    """The certificate in a text.

    Raises
    ------
    ProofError
        If it is none.
    """
    if len(text.encode("utf-8", "surrogatepass")) > LARGEST:
        raise ProofError(f"is longer than {LARGEST} bytes")
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ProofError("is truncated or no JSON") from None
    if not isinstance(found, dict) or not str(found.get("format", "")).startswith("amb_design/proof/"):
        raise ProofError("is no certificate of amb_design")
    if found["format"] != FORMAT:
        raise ProofError(f"has the format {found['format']!a:.40}, but this checker reads {FORMAT}")
    claims = found.get("claims")
    if not isinstance(claims, list) or not claims or not all(isinstance(c, dict) for c in claims):
        raise ProofError("claims nothing")
    return found


def check(certificate: Mapping[str, Any], matrices: Mapping[str, Array]) -> list[str]:
    """Check all claims of a certificate.

    Parameters
    ----------
    certificate : dict
        From `read`.
    matrices : mapping of str to ndarray
        A0, A1 of shape (n, n); B of shape (n, loops) and C of shape (loops, n) for sensitivities; D_name of shape (n, n) for each
        name in a box.

    Returns
    -------
    list of str
        What has been proven, a sentence a claim.

    Raises
    ------
    ProofError
        At the first claim that is not proven.
    """
    admitted(matrices)
    if certificate.get("sha256") != fingerprint(matrices):
        raise ProofError("belongs to other matrices")
    with np.errstate(all="ignore"):  # what overflows is refused
        return [one(claim, matrices) for claim in certificate["claims"]]


def one(claim: Mapping[str, Any], matrices: Mapping[str, Array]) -> str:
    """Check one claim; see `check`."""
    kind, speeds, box = claim.get("kind"), claim.get("speeds"), claim.get("box", {})
    if not isinstance(speeds, list) or len(speeds) != 2 or not isinstance(box, dict):
        raise ProofError("a claim names no range of speeds")
    low, high = number(speeds[0]), number(speeds[1])
    if not 0.0 <= low <= high:
        raise ProofError(f"{low:.10g} to {high:.10g} rad/s is no range of speeds")
    missing = [name for name in ("A0", "A1", *[f"D_{n}" for n in box]) if name not in matrices]
    if missing:
        raise ProofError("a matrix that a claim needs is missing")
    size = matrices["A0"].shape
    parts = [Ball(np.asarray(matrices[n])) for n in ("A0", "A1", *[f"D_{name}" for name in box])]
    if size[0] != size[1] or any(p.mid.shape != size for p in parts):
        raise ProofError("the matrices do not fit together")
    sides = [number(side) for side in box.values()]
    if any(side <= 0.0 for side in sides):
        raise ProofError("a side of the box is not positive")
    whole = ((low, high), *[(-side, side) for side in sides])
    within = "".join(f", {name} within {shown(100.0 * side, -1, 6)} %" for name, side in box.items())
    range_text = f"from {shown(low, 1)} to {shown(high, -1)} rad/s" if low < high else f"at {shown(low)} rad/s"
    where = range_text + within
    cover = claim.get("cover")
    if kind == "stable":
        Family(parts).proves(cover, whole, lambda count: count == 0)
        return f"stable {where}"
    if kind == "unstable":
        Family(parts).proves(cover, whole, lambda count: count > 0)
        return f"unstable {where}"
    if kind == "damping":
        ratio = number(claim.get("ratio"))
        if not 0.0 < ratio < 1.0 or not isinstance(cover, list) or len(cover) != 2:
            raise ProofError("a claim of damping is damaged")
        for part, sign in zip(cover, (1.0, -1.0), strict=True):
            Family(sector(parts, sign * ratio)).proves(part, whole, lambda count: count == 0)
        return f"damping ratios above {shown(ratio, -1, 6)} {where}"
    if kind == "sensitivity":
        gamma, loop = number(claim.get("below")), claim.get("loop")
        b, out = matrices.get("B"), matrices.get("C")
        if b is None or out is None or box or b.shape != out.T.shape or len(b) != size[0]:
            raise ProofError("the matrices B and C do not fit the claim of a sensitivity")
        if type(loop) is not int or not 0 <= loop < b.shape[1] or not 1.0 < gamma < 1e6:
            raise ProofError("a claim of sensitivity is damaged")
        if not isinstance(cover, list) or len(cover) != 2:
            raise ProofError("a claim of sensitivity is damaged")
        Family(parts).proves(cover[0], whole, lambda count: count == 0)
        enter, leave = Ball(np.asarray(b)[:, loop : loop + 1]), Ball(np.asarray(out)[loop : loop + 1])
        Family(hamiltonian(parts, enter, leave, gamma)).proves(cover[1], whole, lambda count: count == size[0])
        return f"sensitivity of loop {loop} below {shown(gamma, 1, 6)} {where}"
    raise ProofError(f"{kind!a:.40} is no kind of claim")
