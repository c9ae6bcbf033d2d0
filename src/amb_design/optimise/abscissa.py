"""The smallest spectral abscissa of a matrix family over a box: how fast every motion of a system can be made to decay.

Starts on several scales go downhill by nonsmooth BFGS, until most are stuck on kinks. The best one then follows the minimiser of the
smoothed abscissa as the smoothing is withdrawn, which leads over the kinks, and Newton's method makes groups of eigenvalues coincide
that are about to; so do others until two agree. Nonsmooth BFGS on the abscissa itself has the last word.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as sla

from ..analysis.system import Array
from ..errors import ModelError
from ..threads import one_thread
from .dense import DenseFamily
from .family import Family
from .multiplicity import Group, coalesced, groups
from .nonsmooth import minimise
from .smoothed import SmoothedAbscissa

CONVERGED = "converged"
UNCONVERGED = "out of evaluations"

DECADES = 4.0
"""Starts are random in boxes between the whole one and one so many powers of ten smaller, around the origin."""

SMOOTHINGS = (1e-3, 1e-5, 1e-7, 1e-9)
"""Reciprocal energies of the smoothed abscissa, one after the other."""

FOLLOWED = 4
"""Starts that are followed through the smoothing, at most: the best ones, until two lead to the same abscissa."""

SAME = 1e-2
"""Relative difference of abscissas that are the same."""

FIRST, STAGE = 60, 120
"""Evaluations of the search from each start, and at each smoothing."""

LAST = 500
"""Evaluations of the last search."""

GROUP = 0.1
"""Eigenvalues nearer than this, relative to the rightmost, are reported as one group."""


@dataclass(frozen=True)
class AbscissaResult:
    """Result of `minimise_abscissa`.

    Attributes
    ----------
    p : ndarray, shape (parameters,)
    abscissa : float
        Largest real part of the eigenvalues at p, as numpy computes them; over all speeds.
    status : {"converged", "out of evaluations"}
        Converged if two starts led to the same abscissa and the last search ended by itself.
    groups : tuple of Group
        Eigenvalues at the abscissa that are near one another. A group of several is close to a multiple eigenvalue at its
        mean, which is what an exact p would have; rounding splits it.
    starts : tuple of float
        Abscissa from each start, as far as starts were needed.
    eigendecompositions : int
        Eigenvalue, Schur and eigenvector decompositions together.
    seconds : float
    """

    p: Array
    abscissa: float
    status: str
    groups: tuple[Group, ...]
    starts: tuple[float, ...]
    eigendecompositions: int
    seconds: float = field(compare=False)


@one_thread
def minimise_abscissa(
    family: Family,
    lower: Sequence[float] | Array | float,
    upper: Sequence[float] | Array | float,
    *,
    speeds: Sequence[float] = (0.0,),
    starts: int = 8,
    seed: int = 0,
    budget: int = 20_000,
) -> AbscissaResult:
    """Minimise the largest real part of the eigenvalues of A0(p) + Omega A1(p) over a box.

    Parameters
    ----------
    family : Family
    lower, upper : array_like
        Bounds of p. Huge ones do no harm: starts are on several scales.
    speeds : sequence of float
        Values of Omega; the worst counts.
    starts : int
        Random starts, at most.
    seed : int
    budget : int
        Largest number of eigendecompositions; the search for a start that has begun is completed.

    Returns
    -------
    AbscissaResult

    Raises
    ------
    ModelError
        If bounds do not fit the family.

    Examples
    --------
    An oscillator with velocity feedback decays fastest with critical damping:

    >>> import casadi as ca
    >>> from amb_design.optimise.abscissa import minimise_abscissa
    >>> from amb_design.optimise.family import Family
    >>> k = ca.SX.sym("k")
    >>> A = ca.Function("A", [k], [ca.vertcat(ca.horzcat(0, 1), ca.horzcat(-1, k))])
    >>> result = minimise_abscissa(Family.from_function(A), -100.0, 100.0)
    >>> print(f"{result.status}: {result.abscissa:.4f} at k = {result.p[0]:.4f}")
    converged: -1.0000 at k = -2.0000
    """
    clock = time.perf_counter()
    box = bounds(family, lower, upper)
    search = Descent(family, box, tuple(float(s) for s in speeds), budget)
    ends = []
    for p, unit in starting_points(box, starts, seed):
        ends.append(search.descend(p, unit, FIRST))
        if search.spent():
            break
    ends.sort(key=lambda e: e[0])
    refined: list[tuple[float, Array]] = []
    agreed = False
    for _, p, _ in ends[:FOLLOWED]:
        refined.append(search.refine(p))
        refined.sort(key=lambda e: e[0])
        agreed = len(refined) > 1 and refined[1][0] - refined[0][0] <= SAME * abs(refined[0][0])
        if agreed or search.spent():
            break
    best = refined[0][1]
    unit = typical(best)
    _, best, converged = search.descend(best, unit, LAST)
    return AbscissaResult(
        best,
        Descent(family, box, search.speeds, scaled=False).abscissa(best),
        CONVERGED if converged and (agreed or starts == 1) else UNCONVERGED,
        groups(search.dense, best, search.speeds, GROUP),
        tuple(e[0] for e in ends),
        search.dense.evaluations + len(search.speeds),
        time.perf_counter() - clock,
    )


def typical(p: Array) -> Array:
    """Typical changes of parameters near a point: as large as they are, or as their mean."""
    return np.asarray(np.maximum(np.abs(p), np.abs(p).mean() + 1e-300))


def bounds(family: Family, lower: Sequence[float] | Array | float, upper: Sequence[float] | Array | float) -> Array:
    """Bounds as an array, shape (2, parameters).

    Parameters
    ----------
    family : Family
    lower, upper : array_like
    """
    try:
        box = np.array([np.broadcast_to(np.asarray(b, float), family.parameters) for b in (lower, upper)])
    except ValueError:
        raise ModelError(f"bounds must be numbers or have {family.parameters} entries, one a parameter") from None
    if not np.isfinite(box).all() or not (box[0] <= box[1]).all():
        raise ModelError("bounds must be finite, and the lower ones must not exceed the upper ones")
    return box


def starting_points(box: Array, count: int, seed: int) -> Iterable[tuple[Array, Array]]:
    """Random points of a box with the size of the box that each was drawn from.

    Parameters
    ----------
    box : ndarray, shape (2, parameters)
    count : int
    seed : int
    """
    rng = np.random.default_rng(seed)
    anchor, width = np.clip(0.0, *box), box[1] - box[0]
    for size in 10.0 ** -np.linspace(0.0, DECADES, count):
        yield anchor + size * (rng.uniform(*box) - anchor), np.maximum(0.5 * size * width, 1e-300)


class Descent:
    """The spectral abscissa as a function of the parameters, with its gradient.

    Parameters
    ----------
    family : Family
    box : ndarray, shape (2, parameters)
    speeds : tuple of float
        The worst counts.
    budget : int
        Largest number of eigendecompositions.
    scaled : bool
        Balance the states.
    """

    def __init__(
        self, family: Family, box: Array, speeds: tuple[float, ...], budget: int = 20_000, *, scaled: bool = True
    ):
        self.box, self.speeds, self.budget = box, speeds, budget
        self.dense = DenseFamily(family)
        if not scaled:
            return
        middle = self.dense.at(np.clip(0.0, *box) * 0.9 + 0.05 * box.sum(axis=0))
        weights = sum(np.abs(middle.matrix(s)) for s in speeds)
        self.dense = DenseFamily(family, sla.matrix_balance(weights, permute=False, separate=True)[1][0])

    def spent(self) -> bool:
        """True if no evaluations are left."""
        return self.dense.evaluations >= self.budget

    def abscissa(self, p: Array) -> float:
        """The spectral abscissa."""
        self.dense.evaluations += len(self.speeds)
        point = self.dense.at(p)
        return max(float(np.linalg.eigvals(point.matrix(s)).real.max()) for s in self.speeds)

    def __call__(self, p: Array) -> tuple[float, Array]:
        """The spectral abscissa and its gradient, which is that of one rightmost eigenvalue."""
        self.dense.evaluations += len(self.speeds)
        point = self.dense.at(p)
        found = [(*rightmost(point.matrix(s)), s) for s in self.speeds]
        value, weights, speed = max(found, key=lambda f: f[0])
        return value, point.slope(weights, speed).real

    def descend(self, p: Array, unit: Array, evaluations: int) -> tuple[float, Array, bool]:
        """Nonsmooth BFGS on the abscissa itself."""
        found = minimise(self, p, *self.box, unit=unit, evaluations=evaluations)
        return found.value, found.x, found.converged

    def refine(self, p: Array) -> tuple[float, Array]:
        """Over kinks by smoothing, then to multiple eigenvalues."""
        unit, (lower, upper) = typical(p), self.box
        rate = float(np.median(np.abs(np.linalg.eigvals(self.dense.at(p).matrix(self.speeds[0]))))) + 1e-300
        visited = [p]
        for smoothing in SMOOTHINGS:
            if self.spent():
                break
            smoothed = SmoothedAbscissa(self.dense, self.speeds, 1.0 / (smoothing * rate))
            p = minimise(smoothed, p, lower, upper, unit=unit, evaluations=STAGE, tolerance=1e-6).x
            visited.append(p)
        visited.extend(coalesced(self.dense, p, lower, upper, self.speeds, unit))
        return min(((self.abscissa(q), q) for q in visited), key=lambda e: e[0])


def rightmost(a: Array) -> tuple[float, Array]:
    """Spectral abscissa of a matrix, and the weights M of its derivative tr(M dA).

    Parameters
    ----------
    a : ndarray, shape (n, n)
    """
    values, left, right = sla.eig(a, left=True, right=True, check_finite=False)
    i = int(np.argmax(values.real))
    product = left[:, i].conj() @ right[:, i]
    if abs(product) < 1e-14:  # a defective eigenvalue: some direction in which it moves fast
        product = 1e-14
    return float(values[i].real), np.outer(right[:, i], left[:, i].conj()) / product
