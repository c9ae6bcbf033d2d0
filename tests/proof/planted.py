"""Families of matrices whose truth is known exactly, because eigenvalues are planted in integers.

Blocks of integers (times a power of two) with known eigenvalues are mixed by similarity transformations of integers, unitary
or with large condition numbers, and turned into doubles without rounding. What lies on the imaginary axis lies there exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]

BITS = 60
"""Blocks are integers times 2**-BITS."""


@dataclass(frozen=True)
class Integers:
    """A complex matrix of integers, (real + i imaginary) / 2**shift."""

    re: Array
    im: Array
    shift: int = 0

    def __matmul__(self, other: Integers) -> Integers:
        return Integers(
            self.re @ other.re - self.im @ other.im,
            self.re @ other.im + self.im @ other.re,
            self.shift + other.shift,
        )

    def doubles(self) -> Array | None:
        """The same numbers as doubles, real ones if it can be; None if one would be rounded."""
        parts = []
        for part in (self.re, self.im):
            if any((int(x) >> min(_twos(int(x)), 2000)).bit_length() > 53 for x in part.flat):
                return None
            parts.append(np.array([[float(Fraction(int(x), 2**self.shift)) for x in row] for row in part]))
        return parts[0] + 1j * parts[1] if self.im.any() else parts[0]


def _twos(x: int) -> int:
    return (x & -x).bit_length() - 1 if x else 0


def integers(blocks: list[list[list[complex | Fraction]]]) -> Integers:
    """A block-diagonal matrix; entries are dyadic fractions, or pairs (real, imaginary) of them."""
    n = sum(len(b) for b in blocks)
    re, im = np.zeros((n, n), object), np.zeros((n, n), object)
    k = 0
    for b in blocks:
        for i, row in enumerate(b):
            for j, entry in enumerate(row):
                pair = entry if isinstance(entry, tuple) else (entry, Fraction(0))
                for part, x in zip((re, im), pair, strict=True):
                    scaled = Fraction(x) * 2**BITS
                    assert scaled.denominator == 1
                    part[k + i, k + j] = int(scaled)
        k += len(b)
    return Integers(re, im, BITS)


def identity(n: int) -> Integers:
    """Ones on the diagonal."""
    return Integers(np.array([[int(i == j) for j in range(n)] for i in range(n)], object), np.zeros((n, n), object))


def unitary(rng: np.random.Generator, n: int, real: bool) -> tuple[Integers, Integers]:
    """A unitary matrix of dyadic numbers and its inverse: reflections I - 2 v v^H / v^H v with v^H v a power of two."""
    out = back = identity(n)
    for _ in range(2):
        count = 4 if n >= 4 and rng.random() < 0.5 else 2
        at = rng.choice(n, count, replace=False)
        v, u = np.zeros(n, object), np.zeros(n, object)
        for i in at:
            if real or rng.random() < 0.5:
                v[i] = int(rng.choice([-1, 1]))
            else:
                u[i] = int(rng.choice([-1, 1]))
        e = identity(n)
        outer_re = np.outer(v, v) + np.outer(u, u)
        outer_im = np.outer(u, v) - np.outer(v, u)
        half = count // 2  # v^H v / 2
        r = Integers(half * e.re - outer_re, -outer_im, half.bit_length() - 1)
        out, back = out @ r, r @ back
    return out, back


def sheared(rng: np.random.Generator, n: int, real: bool, largest: int, count: int) -> tuple[Integers, Integers]:
    """A product of integer shears and its inverse; badly conditioned if the shears are large."""
    out = back = identity(n)
    for _ in range(count):
        i, j = rng.choice(n, 2, replace=False)
        x, y = int(rng.integers(-largest, largest + 1)), 0 if real else int(rng.integers(-largest, largest + 1))
        one, other = identity(n), identity(n)
        one.re[i, j], one.im[i, j], other.re[i, j], other.im[i, j] = x, y, -x, -y
        out, back = out @ one, other @ back
    return out, back


def as_real(m: Integers) -> Integers:
    """[[Re, -Im], [Im, Re]]: the eigenvalues of a complex matrix and their conjugates."""
    re = np.block([[m.re, -m.im], [m.im, m.re]])
    return Integers(re, np.zeros(re.shape, object), m.shift)


def mixed(rng: np.random.Generator, parts: list[Integers], real: bool, normal: bool) -> tuple[list[Array], float]:
    """The same similarity transformation of several matrices, as doubles without rounding; and its condition number."""
    parts = [as_real(p) for p in parts] if real else parts
    n = len(parts[0].re)
    largest, count = int(rng.integers(0, 9)), int(rng.integers(1, n + 1))
    for trial in range(40):
        if n == 1 or trial >= 30:
            t = back = identity(n)
        elif normal:
            t, back = unitary(rng, n, real)
        else:  # gentler from trial to trial, until all numbers are doubles
            t, back = sheared(rng, n, real, 2 ** max(0, largest - trial // 4), max(1, count - trial // 6))
        out = [(t @ p @ back).doubles() for p in parts]
        if all(m is not None for m in out):
            kept = t.doubles()
            return [m for m in out if m is not None], float(np.linalg.cond(kept)) if kept is not None else 1.0
    raise AssertionError("no transformation is exact")


# --- blocks ----------------------------------------------------------------------------------------------------------


def dyadic(rng: np.random.Generator, low: float, high: float, bits: int = 10) -> Fraction:
    """A random number with few binary digits."""
    return Fraction(round(rng.uniform(low, high) * 2**bits), 2**bits)


@dataclass(frozen=True)
class Family:
    """A0 + Omega A1 + d_1 D_1 + ..., with an eigenvalue on the axis, or `over` beyond it, at `place`.

    Attributes
    ----------
    parts : list of ndarray
        A0, A1, D_1, ...
    low, high : float
        Range of speeds that holds the place.
    place : float
        Speed at which the family is not stable.
    over : float
        Real part of the worst eigenvalue there; zero means exactly on the axis.
    sides : tuple of float
        Box of the parameters.
    kind : str
    condition : float
        Of the mixing transformation.
    """

    parts: list[Array]
    low: float
    high: float
    place: float
    over: float
    kind: str
    condition: float
    sides: tuple[float, ...] = ()

    def matrices(self) -> dict[str, Array]:
        """As the checker takes them."""
        named = {"A0": self.parts[0], "A1": self.parts[1]}
        return named | {f"D_{k}": m for k, m in enumerate(self.parts[2:])}

    def box(self) -> dict[str, float]:
        """As certificates state it."""
        return {str(k): side for k, side in enumerate(self.sides)}

    def shifted(self, by: float) -> list[Array]:
        """The parts of a family that is more stable."""
        return [self.parts[0] - by * np.eye(len(self.parts[0])), *self.parts[1:]]


def stable_blocks(rng: np.random.Generator, count: int, extra: int) -> tuple[list[Any], ...]:
    """Stable blocks of total size `count`, with matrices for the speed and `extra` parameters; some are defective."""
    blocks: list[list[Any]] = [[] for _ in range(2 + extra)]
    zero = (Fraction(0), Fraction(0))
    while count:
        size = int(rng.integers(1, min(count, 3) + 1))
        decay, turn = dyadic(rng, 0.5, 8.0), dyadic(rng, -8.0, 8.0)
        strong = dyadic(rng, 0.0, 32.0, 4) if rng.random() < 0.5 else Fraction(0)
        spin = dyadic(rng, -0.5, 0.5)
        blocks[0].append(
            [
                [(-decay, turn) if i == j else (strong, Fraction(0)) if j == i + 1 else zero for j in range(size)]
                for i in range(size)
            ]
        )
        blocks[1].append([[(Fraction(0), spin) if i == j else zero for j in range(size)] for i in range(size)])
        for more in blocks[2:]:
            more.append([[zero] * size for _ in range(size)])
        count -= size
    return tuple(blocks)


def crossing(rng: np.random.Generator, size: int, real: bool, normal: bool) -> Family:
    """One eigenvalue i w + r (Omega - place) (+ a little): on the axis, or slightly over, at `place`."""
    rate = dyadic(rng, 0.125, 2.0, 5)
    place = dyadic(rng, 1.0, 16.0, 6)
    over = Fraction(0) if rng.random() < 0.5 else Fraction(1, 2 ** int(rng.integers(12, 34)))
    blocks = stable_blocks(rng, size - 1, 0)
    blocks[0].append([[(over - rate * place, dyadic(rng, -8.0, 8.0))]])
    blocks[1].append([[(rate, dyadic(rng, -0.5, 0.5, 5))]])
    (a0, a1), condition = mixed(rng, [integers(b) for b in blocks], real, normal)
    top = float(place) if rng.random() < 0.5 else float(place * dyadic(rng, 1.0, 1.5, 6))
    return Family([a0, a1], 0.0, top, float(place), float(over), "crossing", condition)


def window(rng: np.random.Generator, size: int, real: bool, normal: bool, width: float) -> Family:
    """Unstable in a window of this relative width only, or, with width 0, on the axis at one speed only.

    The block i w - d + [[i x, c], [c, -i x]] with x = a (Omega - place) has eigenvalues i w - d +- sqrt(c^2 - x^2).
    """
    place = dyadic(rng, 1.0, 8.0, 3)
    steep = Fraction(2) ** int(rng.integers(0, 4))
    damping = Fraction(1, 2 ** int(rng.integers(10, 16)))
    half = width * float(place) / 2.0
    lift = (float(steep) * half) ** 2 / (2.0 * float(damping))  # c - d of that window
    over = Fraction(0) if width == 0.0 else Fraction(2) ** round(np.log2(lift))
    c = damping + over
    w, zero = dyadic(rng, -8.0, 8.0, 3), Fraction(0)
    blocks = stable_blocks(rng, size - 2, 0)
    blocks[0].append(
        [[(-damping, w - steep * place), (c, zero)], [(c, zero), (-damping, w + steep * place)]]  # at rest
    )
    blocks[1].append([[(zero, steep), (zero, zero)], [(zero, zero), (zero, -steep)]])
    (a0, a1), condition = mixed(rng, [integers(b) for b in blocks], real, normal)
    return Family([a0, a1], 0.0, 2.0 * float(place), float(place), float(over), "window", condition)


def boxed(rng: np.random.Generator, size: int, real: bool, normal: bool, corner: bool) -> Family:
    """Not stable at one corner of a box only, or only at one point inside it."""
    extra = 1 if corner and rng.random() < 0.5 else 2 if corner else 1
    place = dyadic(rng, 1.0, 8.0, 3)
    sides = [Fraction(1, 2 ** int(rng.integers(2, 6))) for _ in range(extra)]
    over = Fraction(0) if rng.random() < 0.5 else Fraction(1, 2 ** int(rng.integers(12, 34)))
    zero = Fraction(0)
    if corner:
        blocks = stable_blocks(rng, size - 1, extra)
        rate = dyadic(rng, 0.125, 2.0, 4)
        pull = [dyadic(rng, 0.125, 2.0, 4) * int(rng.choice([-1, 1])) for _ in sides]
        worst = rate * place + sum((abs(p) * s for p, s in zip(pull, sides, strict=True)), zero)
        blocks[0].append([[(over - worst, dyadic(rng, -8.0, 8.0, 3))]])
        blocks[1].append([[(rate, zero)]])
        for more, p in zip(blocks[2:], pull, strict=True):
            more.append([[(p, zero)]])
    else:  # a window about d = 0, at all speeds, of which no corner knows
        blocks = stable_blocks(rng, size - 2, extra)
        damping, w = Fraction(1, 2 ** int(rng.integers(8, 14))), dyadic(rng, -8.0, 8.0, 3)
        over = min(over, damping / 16)
        c = (damping + over, zero)
        blocks[0].append([[(-damping, w), c], [c, (-damping, w)]])
        blocks[1].append([[(zero, Fraction(1, 4)), (zero, zero)], [(zero, zero), (zero, Fraction(1, 4))]])
        blocks[2].append([[(zero, Fraction(1)), (zero, zero)], [(zero, zero), (zero, Fraction(-1))]])
    parts, condition = mixed(rng, [integers(b) for b in blocks], real, normal)
    kind = "corner" if corner else "inside"
    return Family(parts, 0.0, float(place), float(place), float(over), kind, condition, tuple(map(float, sides)))


TRIPLES = ((3, 4, 5), (5, 12, 13), (8, 15, 17), (7, 24, 25), (20, 21, 29))


def damped(rng: np.random.Generator, size: int, real: bool, normal: bool) -> tuple[Family, Fraction]:
    """Least damping ratio known exactly, from a Pythagorean triple, and taken at the highest speed only."""
    a, b, c = TRIPLES[rng.integers(len(TRIPLES))]
    scale, place = dyadic(rng, 0.5, 2.0, 4), dyadic(rng, 1.0, 8.0, 3)
    rate, sign = dyadic(rng, 0.0, 0.5, 4), int(rng.choice([-1, 1]))
    blocks = stable_blocks(rng, size - 1, 0)
    for block, spin in zip(blocks[0], blocks[1], strict=True):  # well damped
        for i in range(len(block)):
            block[i][i] = (block[i][i][0], block[i][i][0] / 16)
            spin[i][i] = (Fraction(0), Fraction(0))
            if i + 1 < len(block):
                block[i][i + 1] = (block[i][i + 1][0] / 16, Fraction(0))
    blocks[0].append([[(-a * scale - rate * place, sign * b * scale)]])
    blocks[1].append([[(rate, Fraction(0))]])
    (a0, a1), condition = mixed(rng, [integers(b) for b in blocks], real, normal)
    return Family([a0, a1], 0.0, float(place), float(place), 0.0, "damped", condition), Fraction(a, c)
