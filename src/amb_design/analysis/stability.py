"""The stability limit speed: how fast the machine may spin before a mode becomes unstable."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..errors import ModelError, SolveError
from ..spec.machine import Machine
from ..threads import one_thread
from .certificate import RESOLUTION, Crossing, Eigensystem, Walk
from .modes import Mode, mode
from .system import System, system

FOUND = "limit found"
NONE = "none below the top speed"
UNSTABLE = "unstable at rest"
MARGINAL = "marginal"

RIGID = 1e-3
"""Eigenvalues of the rotor at rest below this size [rad/s] are rigid-body motions without restraint."""

SPLIT = 0.1
"""So are opposite ones below this size: rounding splits a double zero into plus and minus the root of what it leaves of a stiffness."""


@dataclass(frozen=True)
class Onset:
    """A speed at which a mode becomes unstable, or stable again.

    Attributes
    ----------
    speed : float [rad/s]
    unstable : bool
        True if the mode becomes unstable as the speed rises.
    count : int
        Number of unstable modes above it.
    mode : Mode
        The mode that crosses.
    """

    speed: float
    unstable: bool
    count: int
    mode: Mode


@dataclass(frozen=True)
class StabilityLimit:
    """Result of `stability_limit`.

    Attributes
    ----------
    speed : float
        Stability limit speed [rad/s]: stable at every lower speed. The top speed if no limit was found below it, zero
        if the machine is unstable at rest, NaN if it is marginal.
    status : {"limit found", "none below the top speed", "unstable at rest", "marginal"}
    certified : bool
        True if every speed below `speed` is covered by a certificate.
    bracket : tuple of float
        Certified stable up to the first, certified unstable from the second [rad/s].
    mode : Mode or None
        The mode that limits, at the limit or at rest.
    onsets : tuple of Onset
        All onsets and restabilisations up to `top_speed`, or only the first.
    unstable_at_rest : tuple of Mode
        The unstable modes at zero speed, the worst first.
    top_speed : float [rad/s]
    eigendecompositions : int
        Full-size eigendecompositions that were spent.
    machine : Machine
    """

    speed: float
    status: str
    certified: bool
    bracket: tuple[float, float]
    mode: Mode | None
    onsets: tuple[Onset, ...]
    unstable_at_rest: tuple[Mode, ...]
    top_speed: float
    eigendecompositions: int
    machine: Machine = field(repr=False)

    @property
    def speed_rpm(self) -> float:
        """Stability limit speed [rpm]."""
        return self.speed * 30.0 / math.pi


@one_thread
def stability_limit(
    machine: Machine | System, top_speed: float | None = None, *, first_only: bool = False, budget: int = 600
) -> StabilityLimit:
    """Find the stability limit speed, with a certificate.

    Parameters
    ----------
    machine : Machine or System
    top_speed : float, optional
        Look up to this speed [rad/s]; the machine's own top speed if left out.
    first_only : bool
        Stop at the first onset.
    budget : int
        Largest number of eigendecompositions before the certificate gives way to a sweep.

    Returns
    -------
    StabilityLimit

    Raises
    ------
    ModelError
        If the top speed is not positive and finite.

    Notes
    -----
    See `amb_design.analysis.certificate` for the certificate. When its budget is spent, which takes modes with almost
    no damping, the limit comes from a refined sweep, and ``certified`` is False.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    top = loop.machine.operation.top_speed if top_speed is None else top_speed
    if not (math.isfinite(top) and top > 0.0):
        raise ModelError(f"top_speed = {top:g} rad/s must be positive and finite")
    walk = Walk(loop.A0, loop.A1, budget)
    rest = walk.at(0.0)
    rigid = _rigid(loop, rest)
    unstable = np.flatnonzero((rest.values.real > rest.uncertainty) & ~rigid)
    at_rest = tuple(
        mode(loop, rest, int(i))
        for i in unstable[np.argsort(-rest.values.real[unstable])]
        if loop.complex_form or rest.values[i].imag >= 0.0
    )
    undecided = np.flatnonzero((np.abs(rest.values.real) <= rest.uncertainty) | rigid)
    if len(undecided) or (at_rest and first_only):
        lowest = min(undecided, key=lambda i: abs(rest.values[i]), default=0)
        worst = at_rest[0] if at_rest else mode(loop, rest, int(lowest))
        status, speed = (UNSTABLE, 0.0) if at_rest else (MARGINAL, math.nan)
        return StabilityLimit(speed, status, True, (0.0, 0.0), worst, (), at_rest, top, 1, loop.machine)

    crossings: list[Crossing] = []
    certified, reached = True, 0.0
    try:
        for event in walk.events(top, rest):
            if not isinstance(event, Crossing):
                reached = event.stop
                continue
            reached = max(event.upper, event.above.speed)
            if _decided(walk, event):
                crossings.append(event)
                if first_only:
                    break
            elif not crossings:
                certified = False  # a mode touches the axis to rounding: nothing can be said of its sign there
    except SolveError:
        certified = certified and bool(crossings)  # of the speeds below the first onset; later ones are swept
        crossings += [c for c in _sweep(walk, reached, top, first_only) if _decided(walk, c)]
    onsets = tuple(_onset(walk, loop, c) for c in crossings)
    limiting: Mode | None = None
    status, speed, bracket = NONE, top, (top, math.inf)
    if at_rest:
        status, speed, bracket, limiting = UNSTABLE, 0.0, (0.0, 0.0), at_rest[0]
    elif crossings:
        status, speed, limiting = FOUND, onsets[0].speed, onsets[0].mode
        bracket = speed, crossings[0].upper
    return StabilityLimit(
        float(speed), status, certified, bracket, limiting, onsets, at_rest, top, walk.eigendecompositions, loop.machine
    )


def _rigid(loop: System, rest: Eigensystem) -> np.ndarray:
    """Rigid-body motions that nothing restrains: double zeros, or what rounding makes of them."""
    size = np.abs(rest.values)
    small = np.where(size < SPLIT, rest.values, np.inf)
    opposite = np.abs(np.add.outer(small, small)).min(axis=1) < 1e-3 * size
    return np.array([bool(n) and mode(loop, rest, i).kind == "rotor" for i, n in enumerate((size < RIGID) | opposite)])


def _modes(loop: System, e: Eigensystem) -> int:
    """Number of unstable modes; of a conjugate pair only one counts."""
    return int(np.sum((e.values.real > 0.0) & (loop.complex_form | (e.values.imag >= 0.0))))


def _decided(walk: Walk, crossing: Crossing) -> bool:
    """True if the mode becomes unstable beyond rounding somewhere near the crossing, on its unstable side."""
    outward = 1.0 if crossing.onset else -1.0
    edge = crossing.upper if crossing.onset else crossing.lower
    for distance in RESOLUTION * edge * 8.0 ** np.arange(6):
        walk.budget += 1
        e = walk.at(edge + outward * distance)
        others = min(crossing.above.unstable, crossing.below.unstable)
        if np.sum(e.values.real > e.uncertainty) > others:
            return True
    return False


def _onset(walk: Walk, loop: System, crossing: Crossing) -> Onset:
    """The mode that crosses, at the crossing itself: the range that led there may have come from a speed far off."""
    e, k = crossing.below, crossing.critical
    if abs(crossing.lower - e.speed) > RESOLUTION * crossing.lower:
        walk.budget += 1
        e = walk.at(crossing.lower)
        rates = e.rates.real if crossing.onset else -e.rates.real
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = np.where(rates > 0.0, np.abs(e.values.real) / rates, np.inf)
        k = int(np.argmin(distance))
    speed = crossing.lower
    with np.errstate(divide="ignore", invalid="ignore"):
        axis = e.speed - e.values[k].real / e.rates[k].real
        doubt = RESOLUTION * speed + e.uncertainty[k] / abs(e.rates[k].real)
    if 0.0 < speed - axis <= doubt:  # by rounding the range ends beyond what the eigenvalue itself says
        speed = float(axis)
    return Onset(speed, crossing.onset, _modes(loop, crossing.above), mode(loop, e, k))


def _sweep(walk: Walk, start: float, top: float, first_only: bool, speeds: int = 200) -> list[Crossing]:
    """Crossings by a sweep with bisection, for loops that defeat the certificate."""
    walk.budget += 40 * speeds
    grid = np.linspace(start, top, speeds)
    left = walk.at(float(grid[0]))
    found: list[Crossing] = []
    for speed in grid[1:]:
        right = walk.at(float(speed))
        if right.unstable != left.unstable:
            found.append(_bisect(walk, left, right))
            if first_only:
                break
        left = right
    return found


def _bisect(walk: Walk, left: Eigensystem, right: Eigensystem) -> Crossing:
    while right.speed - left.speed > 1e-8 * right.speed:
        middle = walk.at((left.speed + right.speed) / 2.0)
        if middle.unstable == left.unstable:
            left = middle
        else:
            right = middle
    return Crossing(left.speed, right.speed, left, right)
