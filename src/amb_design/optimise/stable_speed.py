"""Stability over a range of Omega for matrix families A0(p) + Omega A1(p) without a rotor behind them.

`crossing` finds where an eigenvalue crosses the imaginary axis, for fixed parameters: the certified walk encloses it, Newton's
method makes it exact. `largest_stable` looks for the parameters that put the first crossing as high as possible: the search holds the
eigenvalues down at a few fractions of the range, and the walk adds the fractions at which that was not enough.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..analysis.certificate import RESOLUTION, Crossing, Walk
from ..analysis.system import Array
from ..errors import ModelError, SolveError
from ..threads import one_thread
from .abscissa import Descent, bounds, starting_points
from .coordinates import identity
from .evaluation import Rows
from .family import Family
from .nonsmooth import minimise
from .search import Settings, search
from .state import State

FOUND = "crossing found"
NONE = "no crossing below the top"
CONVERGED = "converged"
UNCONVERGED = "out of evaluations"
TOP = "stable up to the top"
UNSTABLE = "no stable point found at rest"

ROUNDS = 10
"""Searches from one start, each followed by a walk."""

GAIN = 1e-6
"""Relative gain of a round that ends the search."""

FRACTIONS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Where eigenvalues are held down from the beginning."""

WATCHED = 24
"""Rightmost eigenvalues that are held down at each fraction."""


@dataclass(frozen=True)
class AxisCrossing:
    """Result of `crossing`.

    Attributes
    ----------
    status : {"crossing found", "no crossing below the top"}
    speed : float
        Omega at the first crossing; NaN without one.
    frequency : float
        Imaginary part of the eigenvalue that crosses; not negative for real matrices.
    onset : bool
        True if the eigenvalue becomes unstable there, False if it becomes stable.
    bracket : tuple of float
        No eigenvalue crosses below the first, and one has crossed at the second; proven by the walk.
    unstable : int
        Number of unstable eigenvalues below the crossing.
    eigendecompositions : int
    """

    status: str
    speed: float
    frequency: float
    onset: bool
    bracket: tuple[float, float]
    unstable: int
    eigendecompositions: int


@dataclass(frozen=True)
class StableResult:
    """Result of `largest_stable`.

    Attributes
    ----------
    p : ndarray, shape (parameters,)
    speed : float
        A0(p) + Omega A1(p) is stable for all Omega from zero up to here.
    status : {"converged", "out of evaluations", "stable up to the top", "no stable point found at rest"}
    certified : bool
        True if the walk proves it.
    starts : tuple of float
        Speed from each start.
    eigendecompositions : int
    seconds : float
    """

    p: Array
    speed: float
    status: str
    certified: bool
    starts: tuple[float, ...]
    eigendecompositions: int
    seconds: float = field(compare=False)


@one_thread
def crossing(family: Family, p: Sequence[float] | Array | float, top: float, *, budget: int = 600) -> AxisCrossing:
    """Find the first Omega at which an eigenvalue of A0(p) + Omega A1(p) crosses the imaginary axis.

    Parameters
    ----------
    family : Family
    p : array_like, shape (parameters,)
    top : float
        Last Omega.
    budget : int
        Largest number of eigendecompositions.

    Returns
    -------
    AxisCrossing

    Raises
    ------
    ModelError
        If the top is not positive and finite.
    SolveError
        If the budget is spent, as happens if an eigenvalue starts on the axis.

    Examples
    --------
    Velocity feedback that overcomes the damping at Omega = 0.3:

    >>> import casadi as ca
    >>> from amb_design.optimise.family import Family
    >>> from amb_design.optimise.stable_speed import crossing
    >>> damping = ca.SX.sym("damping")
    >>> A0 = ca.vertcat(ca.horzcat(0, 1), ca.horzcat(-4, -damping))
    >>> family = Family(damping, {"A0": A0, "A1": ca.DM([[0, 0], [0, 1]])})
    >>> found = crossing(family, 0.3, 1.0)
    >>> print(f"{found.status}: Omega = {found.speed:.10f}, frequency = {found.frequency:.10f}")
    crossing found: Omega = 0.3000000000, frequency = 2.0000000000
    """
    _check(top)
    walk = _walk(family, np.atleast_1d(np.asarray(p, float)), budget)
    start = walk.at(0.0)
    event = next((e for e in walk.events(top, start) if isinstance(e, Crossing)), None)
    if event is None:
        return AxisCrossing(NONE, math.nan, math.nan, False, (top, math.inf), start.unstable, walk.eigendecompositions)
    speed, frequency = _exact(walk, event)
    return AxisCrossing(
        FOUND,
        speed,
        frequency,
        event.onset,
        (float(event.lower), float(event.upper)),
        event.below.unstable,
        walk.eigendecompositions,
    )


@one_thread
def largest_stable(
    family: Family,
    lower: Sequence[float] | Array | float,
    upper: Sequence[float] | Array | float,
    top: float,
    *,
    starts: int = 4,
    seed: int = 0,
    evaluations: int = 60,
) -> StableResult:
    """Maximise the Omega up to which A0(p) + Omega A1(p) is stable, over a box of p.

    Parameters
    ----------
    family : Family
    lower, upper : array_like
        Bounds of p.
    top : float
        Largest Omega of interest.
    starts : int
        Random starts on several scales.
    seed : int
    evaluations : int
        Largest number of evaluations of a search; a start may take ten.

    Returns
    -------
    StableResult

    Raises
    ------
    ModelError
        If the bounds do not fit the family, or the top is not positive and finite.

    Examples
    --------
    A rotor with internal damping 0.1 is stable up to sqrt(stiffness) (1 + damping/0.1). Here damping costs stiffness,
    which is 4 - damping:

    >>> import casadi as ca
    >>> from amb_design.model.pair import Pair
    >>> from amb_design.optimise.family import Family
    >>> from amb_design.optimise.stable_speed import largest_stable
    >>> c = ca.SX.sym("c")
    >>> A0 = ca.vertcat(ca.horzcat(0, 1), ca.horzcat(c - 4, -c - 0.1))
    >>> A1 = Pair(ca.SX(2, 2), ca.DM([[0, 0], [0.1, 0]]))
    >>> result = largest_stable(Family(c, {"A0": A0, "A1": A1}), 0.0, 3.9, 100.0)
    >>> print(f"{result.status}: {result.speed:.4f} at c = {result.p[0]:.3f}")
    converged: 31.9539 at c = 2.633
    """
    clock = time.perf_counter()
    _check(top)
    box = bounds(family, lower, upper)
    climb = _Climb(family, box, top, evaluations)
    ends = [climb.start(p, unit) for p, unit in starting_points(box, starts, seed)]
    best = max(ends, key=lambda e: e.speed)
    return StableResult(
        best.p,
        best.speed,
        best.status,
        best.certified,
        tuple(e.speed for e in ends),
        climb.eigendecompositions + climb.descent.dense.evaluations,
        time.perf_counter() - clock,
    )


@dataclass(frozen=True)
class _End:
    p: Array
    speed: float
    status: str
    certified: bool


class _Climb:
    """One problem with its count of evaluations."""

    def __init__(self, family: Family, box: Array, top: float, evaluations: int):
        self.family, self.box, self.top, self.evaluations = family, box, top, evaluations
        self.descent = Descent(family, box, (0.0,))
        self.eigendecompositions = 0

    def start(self, p: Array, unit: Array) -> _End:
        """The best from one start."""
        p = minimise(self.descent, p, *self.box, unit=unit, evaluations=150, enough=-1e-9).x
        speed, certified = self._reach(p)
        if not speed > 0.0:
            return _End(p, 0.0, UNSTABLE, certified)
        fractions = list(FRACTIONS)
        best, idle = _End(p, speed, UNCONVERGED, certified), 0
        for _ in range(ROUNDS):
            if best.speed >= self.top:
                return _End(best.p, best.speed, TOP, best.certified)
            p, wanted, settled = self._search(best, unit, tuple(fractions))
            speed, certified = self._reach(p)
            missed = speed < wanted * (1.0 - GAIN)
            if missed:
                fractions += [speed / wanted, min(1.02 * speed / wanted, 1.0)]
            gained = speed > best.speed * (1.0 + GAIN)
            if speed > best.speed:
                best = _End(p, speed, UNCONVERGED, certified)
            idle = 0 if gained else idle + 1
            if not gained and settled and (not missed or idle > 2):
                return _End(best.p, best.speed, UNCONVERGED if missed else CONVERGED, best.certified)
        return best

    def _reach(self, p: Array) -> tuple[float, bool]:
        """Omega up to which the matrices at p are stable, and whether that is proven."""
        walk = _walk(self.family, p, 600)
        reached = 0.0
        try:
            for event in walk.events(self.top):
                if isinstance(event, Crossing) or event.unstable:
                    break
                reached = event.stop
            certified = True
        except SolveError:
            certified = False
        self.eigendecompositions += walk.eigendecompositions
        return float(reached), certified

    def _search(self, best: _End, unit: Array, fractions: tuple[float, ...]) -> tuple[Array, float, bool]:
        """Sequential quadratic programming near a point, in a box of the size of the point."""
        reach = 2.0 * np.maximum(np.abs(best.p), unit)
        low, high = np.maximum(self.box[0], best.p - reach), np.minimum(self.box[1], best.p + reach)
        width = np.maximum(high - low, 1e-300)

        def rows(x: Array, level: float) -> Rows:
            return self._rows(low + x * width, level, width, np.unique(fractions))

        settings = Settings(steps=self.evaluations, progress=0.1 * GAIN, smallest=1e-7)
        trace = search(rows, (best.p - low) / width, best.speed / self.top, settings)
        trace.retreat()
        return low + trace.x * width, trace.level * self.top, trace.status == "settled"

    def _rows(self, p: Array, level: float, width: Array, fractions: Array) -> Rows:
        """Real parts of the rightmost eigenvalues at fractions of the range, relative to the eigenvalues at rest."""
        state = State(self.family.at(p), identity(self.family.size))
        speeds = level * self.top * fractions
        spectra = state.spectra(speeds)
        self.eigendecompositions += state.decompositions
        rate = float(np.median(np.abs(spectra.values[0]))) + 1e-300
        order = np.argsort(-spectra.values.real, axis=1)[:, :WATCHED]
        count = order.shape[1]
        where = np.repeat(np.arange(len(speeds)), count), order.ravel()
        values = spectra.values[where]
        right, left = spectra.right.transpose(0, 2, 1)[where], spectra.left[where]
        slopes, rates = state.eigenvalue_slopes(values, speeds[where[0]], right, left)
        by_level = (rates * self.top * fractions[where[0]]).real[:, None]
        blank = ("",) * len(values)
        return Rows(
            values.real / rate,
            np.hstack([slopes.real * width, by_level]) / rate,
            blank,
            blank,
            blank,
            speeds[where[0]],
            tuple(fractions[where[0]].tolist()),
            values,
        )


def _check(top: float) -> None:
    if not (math.isfinite(top) and top > 0.0):
        raise ModelError(f"top = {top:g} must be positive and finite")


def _walk(family: Family, p: Array, budget: int) -> Walk:
    state = State(family.at(p), identity(family.size))
    return Walk(state.a0, state.a1, budget)


def _exact(walk: Walk, event: Crossing) -> tuple[float, float]:
    """Omega and frequency of a crossing by Newton's method inside the bracket."""
    slack = RESOLUTION * max(event.upper, np.finfo(float).tiny)
    speed, frequency = 0.5 * (event.lower + event.upper), 0.0
    walk.budget += 20
    for _ in range(20):
        e = walk.at(speed)
        with np.errstate(divide="ignore", invalid="ignore"):
            change = -e.values.real / e.rates.real
        change = np.where(np.isfinite(change), change, np.inf)
        nearest = np.abs(change).min()
        alike = np.flatnonzero(np.abs(change) <= nearest + 1e-3 * slack)  # a conjugate pair crosses together
        k = int(alike[np.argmax(e.values.imag[alike])])
        if not event.lower - slack <= speed + change[k] <= event.upper + slack:  # grazes the axis: Newton is of no use
            break
        frequency = float(e.values[k].imag + change[k] * e.rates[k].imag)
        speed += float(change[k])
        if abs(change[k]) <= 1e-14 * speed:
            break
    return float(speed), frequency
