"""Speeds at which eigenvalues of A0 + Omega A1 cross the imaginary axis, with a certificate that none is missed.

At a speed without eigenvalues on the axis let A = V Lambda V^-1, D = sqrt(2 abs(Re Lambda)), J = -sign(Re Lambda),
B = V^-1 A1 V and H = D^-1 (B J + J B^H) D^-1. The matrix V J V^H shows (Ostrowski & Schneider 1962; Lyapunov's theorem
where all J = 1) that A + d A1 has as many unstable eigenvalues as A for every d between 1/lambda_min(H) and
1/lambda_max(H). Each eigendecomposition therefore certifies a whole range of speeds on either side. The ranges are
laid end to end; what they leave open shrinks around the crossings, and no window of instability can slip through,
however narrow. V may be replaced by V S with a positive diagonal S; Perron scaling (S from the dominant vectors of
abs(B)) makes the ranges several times longer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as sla

from ..errors import SolveError
from .system import Array

RESOLUTION = 2e-8
"""Ranges of speed that are left open, as a fraction of the speed."""

ROUNDING = 64.0 * np.finfo(float).eps
"""An eigenvalue nearer to the axis than this, times abs(left) abs(A) abs(right), has no sign."""


@dataclass(frozen=True)
class Eigensystem:
    """Eigenvalues and vectors of A0 + speed A1, and what they certify.

    Attributes
    ----------
    speed : float [rad/s]
    values : ndarray, shape (n,)
    right : ndarray, shape (n, n); columns
    left : ndarray, shape (n, n); rows w^H with w^H v = 1
    coupling : ndarray, shape (n, n); left A1 right
    matrix : ndarray, shape (n, n); A0 + speed A1
    """

    speed: float
    values: Array
    right: Array
    left: Array
    coupling: Array
    matrix: Array

    @property
    def rates(self) -> Array:
        """Derivatives of the eigenvalues with respect to the speed."""
        return np.diagonal(self.coupling)

    @property
    def unstable(self) -> int:
        """Number of eigenvalues with positive real part."""
        return int(np.sum(self.values.real > 0.0))

    @property
    def rightmost(self) -> int:
        """Index of the eigenvalue with the largest real part."""
        return int(np.argmax(self.values.real))

    @cached_property
    def uncertainty(self) -> Array:
        """Rounding error to expect in each eigenvalue [1/s]: what its Rayleigh quotient may be off, and is off."""
        products = self.left @ self.matrix
        quotients = np.einsum("ij,ji->i", products, self.right)
        sizes = np.einsum("ij,ji->i", np.abs(self.left) @ np.abs(self.matrix), np.abs(self.right))
        return np.asarray(ROUNDING * sizes + np.abs(quotients - self.values))

    @cached_property
    def certified(self) -> tuple[float, float]:
        """Range of speeds over which the number of unstable eigenvalues is proven constant."""
        distance = np.abs(self.values.real)
        if distance.min() <= np.finfo(float).eps ** 2 * np.abs(self.values).max():  # on the axis: nothing is proven
            return self.speed, self.speed
        d = np.sqrt(2.0 * distance)
        scaled = self.coupling / d[:, None] / d
        s = perron(np.abs(scaled))
        scaled = scaled / s[:, None] * s
        signs = -np.sign(self.values.real)
        ends = sla.eigvalsh(scaled * signs + signs[:, None] * scaled.conj().T, check_finite=False)[[0, -1]]
        back = 1.0 / ends[0] if ends[0] < 0.0 else -np.inf
        ahead = 1.0 / ends[1] if ends[1] > 0.0 else np.inf
        return self.speed + back, self.speed + ahead

    def predicted(self, direction: float) -> float:
        """Nearest speed in a direction (+1 or -1) where the tangents of the eigenvalues meet the axis."""
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = -self.values.real / self.rates.real * direction
        distance = distance[np.isfinite(distance) & (distance > 0.0)]
        return self.speed + direction * float(distance.min()) if len(distance) else direction * np.inf


@dataclass(frozen=True)
class Crossing:
    """Eigenvalues that cross the imaginary axis within a small range of speeds.

    Attributes
    ----------
    lower, upper : float
        Certified on the near side up to `lower` and on the far side from `upper` [rad/s].
    below, above : Eigensystem
        The nearest decompositions on either side.
    """

    lower: float
    upper: float
    below: Eigensystem
    above: Eigensystem

    @property
    def onset(self) -> bool:
        """True if a mode becomes unstable as the speed rises."""
        return self.above.unstable > self.below.unstable

    @property
    def critical(self) -> int:
        """Index, in `below`, of the eigenvalue that crosses."""
        sign = 1.0 if self.onset else -1.0
        e = self.below
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.where(e.values.real * sign < 0.0, -e.values.real / e.rates.real, np.inf)
        return int(np.argmin(np.where(distance > 0.0, distance, np.inf)))


@dataclass(frozen=True)
class Range:
    """A range of speeds over which the number of unstable eigenvalues is certified constant."""

    start: float
    stop: float
    unstable: int


class Walk:
    """Certified walk over the spin speed for a matrix A0 + Omega A1.

    Parameters
    ----------
    a0, a1 : ndarray, shape (n, n)
        Real or complex.
    budget : int
        Largest number of eigendecompositions.

    Attributes
    ----------
    eigendecompositions : int
        Spent so far.
    """

    def __init__(self, a0: Array, a1: Array, budget: int = 600):
        self.a0, self.a1, self.budget = a0, a1, budget
        self.eigendecompositions = 0

    def at(self, speed: float) -> Eigensystem:
        """Decompose the matrix at a speed.

        Parameters
        ----------
        speed : float [rad/s]

        Raises
        ------
        SolveError
            If the budget is spent.
        """
        if self.eigendecompositions >= self.budget:
            raise SolveError(
                f"no certificate: {self.budget} eigendecompositions were spent at {speed:.6g} rad/s; "
                "some mode has almost no damping"
            )
        self.eigendecompositions += 1
        matrix = self.a0 + speed * self.a1
        norm = float(np.linalg.norm(matrix))
        try:
            values, right = np.linalg.eig(matrix)
            left = sla.inv(right, check_finite=False)
        except np.linalg.LinAlgError:  # a defective matrix: one within rounding of it has all its eigenvectors
            nearby = np.random.default_rng(0).standard_normal(matrix.shape) * (np.finfo(float).eps * norm / len(matrix))
            values, right = np.linalg.eig(matrix + nearby)
            left = sla.inv(right, check_finite=False)
        return Eigensystem(speed, values, right, left, left @ self.a1 @ right, matrix)

    def events(self, top: float, start: Eigensystem | None = None) -> Iterator[Range | Crossing]:
        """Cover the speeds from rest to the top with certified ranges.

        Parameters
        ----------
        top : float
            Last speed [rad/s].
        start : Eigensystem, optional
            At the first speed; decomposed at rest if left out.

        Yields
        ------
        Range or Crossing
            In order of speed; two ranges meet at each crossing.
        """
        left = start or self.at(0.0)
        begin = left.speed
        ahead: list[Eigensystem] = []  # decompositions to the right, the nearest last
        tries = 0
        while left.certified[1] < top:
            reach = left.certified[1]
            resolution = RESOLUTION * max(reach, 1e-3 * top)
            if not ahead:
                ahead.append(self.at(self._next(left, top, resolution)))
            right = ahead[-1]
            back = right.certified[0]
            same = left.unstable == right.unstable
            if back - reach <= (0.0 if same else resolution):  # ranges meet, or enclose a crossing
                if not same:
                    yield Range(begin, min(reach, right.speed), left.unstable)
                    begin = max(back, left.speed)
                    yield Crossing(min(reach, begin), max(reach, begin), left, right)
                left, tries = ahead.pop(), 0
                continue
            if back - reach <= 1e-3 * resolution:  # touched the axis without crossing, to rounding
                left, tries = ahead.pop(), 0
                continue
            tries += 1
            ahead.append(self.at(self._between(left, right, reach, back, resolution, tries)))
        yield Range(begin, top, left.unstable)

    def _next(self, left: Eigensystem, top: float, resolution: float) -> float:
        """Where to look behind the last known range: about as far as the next range should reach back."""
        back, reach = left.certified
        stride = reach + max(0.8 * max(reach - left.speed, min(left.speed - back, left.speed)), 0.4 * resolution)
        guess = left.predicted(+1.0)
        if guess < stride:
            stride = max(guess, reach + 0.4 * resolution)
        return min(stride, top)

    @staticmethod
    def _between(
        left: Eigensystem, right: Eigensystem, reach: float, back: float, resolution: float, tries: int
    ) -> float:
        """Where to look inside a gap: at a predicted crossing, now and then in the middle."""
        margin = 0.4 * min(resolution, back - reach)
        if tries % 4:
            for guess in (left.predicted(+1.0), right.predicted(-1.0)):
                if reach - margin <= guess <= back + margin:
                    return float(np.clip(guess, reach + margin, back - margin))
        return (reach + back) / 2.0


def perron(magnitudes: Array, sweeps: int = 60) -> Array:
    """Diagonal scaling that balances a nonnegative matrix.

    Parameters
    ----------
    magnitudes : ndarray, shape (n, n)
        Nonnegative.
    sweeps : int
        Power iterations.

    Returns
    -------
    ndarray, shape (n,)
        s such that ``diag(s)^-1 M diag(s)`` has equal dominant right and left vectors: the square root of their ratio.
    """
    m = magnitudes + 1e-12 * magnitudes.max() + np.finfo(float).tiny
    x = y = np.ones(len(m))
    for _ in range(sweeps):
        x = m @ x
        y = y @ m
        x, y = x / x.max(), y / y.max()
    return np.asarray(np.sqrt(x / y))
