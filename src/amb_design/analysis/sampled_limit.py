"""How fast a machine with a digital controller may spin: a sweep over the speed, refined where multipliers come near to one.

This is no certificate as for continuous loops: a window of instability that is narrow beside the steps of the sweep and shows in no
curve of a multiplier over the speed is missed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import ModelError
from ..spec.machine import Machine
from ..spec.sampling import Sampling
from ..threads import one_thread
from .sampled import SampledLoop
from .stability import FOUND, MARGINAL, NONE, UNSTABLE
from .system import Array, ascending

STEPS = 40
"""Steps of the sweep before it is refined."""

FINEST = 1.0 / 5120.0
"""Least step, as a fraction of the range."""

WARY = 16.0
"""How much further than a parabola through its known sizes a multiplier may go between two steps."""

CLOSE = 1e-7
"""Width of the bracket of the limit, as a fraction of the range."""

ROUNDING = 1e-12
"""A multiplier nearer to the unit circle than this has no side."""


@dataclass(frozen=True)
class SampledStability:
    """Result of `sampled_stability`.

    Attributes
    ----------
    speeds : ndarray, shape (k,)
        Spin speeds [rad/s].
    multipliers : ndarray of complex, shape (k, n)
        Factors by which the loop's motions change over one period, the largest first.
    growth : ndarray, shape (k,)
        Growth rate of the worst motion [1/s]: negative where the loop is stable.
    frequencies : ndarray, shape (k,)
        Its frequency as the samples show it [rad/s], between plus and minus half the sampling frequency; in the complex
        form negative for a backward whirl.
    sampling : Sampling
    machine : Machine
    """

    speeds: Array
    multipliers: Array
    growth: Array
    frequencies: Array
    sampling: Sampling
    machine: Machine = field(repr=False)

    @property
    def stable(self) -> Array:
        """True where every multiplier is smaller than one."""
        return np.asarray(np.abs(self.multipliers[:, 0]) < 1.0)


@dataclass(frozen=True)
class SampledLimit:
    """Result of `sampled_stability_limit`.

    Attributes
    ----------
    speed : float
        Largest speed [rad/s] up to which the sweep found the loop stable. The top speed if it found no limit below it, zero
        if the loop is unstable at rest, NaN if it is marginal.
    status : {"limit found", "none below the top speed", "unstable at rest", "marginal"}
    bracket : tuple of float
        Stable at the first speed, unstable at the second [rad/s].
    multiplier : complex
        The largest one at the upper end of the bracket, at the top speed, or at rest.
    top_speed : float [rad/s]
    evaluations : int
        Speeds that were looked at.
    sampling : Sampling
    machine : Machine
    """

    speed: float
    status: str
    bracket: tuple[float, float]
    multiplier: complex
    top_speed: float
    evaluations: int
    sampling: Sampling
    machine: Machine = field(repr=False)

    @property
    def speed_rpm(self) -> float:
        """The limit [rpm]."""
        return self.speed * 30.0 / math.pi

    @property
    def frequency(self) -> float:
        """Frequency of the critical motion as the samples show it [rad/s]."""
        return float(np.angle(self.multiplier) / self.sampling.period)


@one_thread
def sampled_stability(
    machine: Machine, sampling: Sampling, speeds: Sequence[float] | Array | None = None
) -> SampledStability:
    """Stability of a loop with a digital controller at some speeds, exact at each.

    Parameters
    ----------
    machine : Machine
        Numbers only. Everything before its amplifiers is digital; their continuous `delay` is left out.
    sampling : Sampling
    speeds : array_like, optional
        Spin speeds [rad/s]; 41 from rest to the machine's top speed if left out.

    Returns
    -------
    SampledStability

    Raises
    ------
    ModelError
        If the machine has no controller, or the speeds do not ascend.
    """
    loop = SampledLoop(machine, sampling)
    top = float(machine.operation.top_speed)
    grid = ascending(np.linspace(0.0, top, STEPS + 1) if speeds is None else speeds)
    table = np.array([_by_size(loop, float(s)) for s in grid])
    worst = table[:, 0]
    with np.errstate(divide="ignore"):
        growth = np.log(np.abs(worst)) / sampling.period
    return SampledStability(grid, table, growth, np.angle(worst) / sampling.period, sampling, machine)


@one_thread
def sampled_stability_limit(machine: Machine, sampling: Sampling, top_speed: float | None = None) -> SampledLimit:
    """How fast a machine with a digital controller may spin.

    Parameters
    ----------
    machine : Machine
        As for `sampled_stability`.
    sampling : Sampling
    top_speed : float, optional
        Look up to this speed [rad/s]; the machine's own top speed if left out.

    Returns
    -------
    SampledLimit

    Raises
    ------
    ModelError
        If the machine has no controller, or the top speed is not positive and finite.

    Notes
    -----
    Exact at each speed that is looked at, but a sweep between them: steps are halved where the curvature of a multiplier's size
    over the speed allows it to reach one, down to 1/5120 of the range.
    """
    top = float(machine.operation.top_speed if top_speed is None else top_speed)
    if not (math.isfinite(top) and top > 0.0):
        raise ModelError(f"top_speed = {top:g} rad/s must be positive and finite")
    sweep = _Sweep(SampledLoop(machine, sampling), top)
    rest = sweep.worst(0.0)

    def result(speed: float, status: str, bracket: tuple[float, float], multiplier: complex) -> SampledLimit:
        return SampledLimit(speed, status, bracket, multiplier, top, len(sweep.found), sampling, machine)

    if abs(rest) > 1.0 + ROUNDING:
        return result(0.0, UNSTABLE, (0.0, 0.0), rest)
    if abs(rest) >= 1.0 - ROUNDING:
        return result(math.nan, MARGINAL, (0.0, 0.0), rest)
    bracket = sweep.first()
    if bracket is None:
        return result(top, NONE, (top, math.inf), sweep.worst(top))
    return result(bracket[0], FOUND, bracket, sweep.worst(bracket[1]))


def _by_size(loop: SampledLoop, speed: float) -> Array:
    found = loop.multipliers(speed)
    return np.asarray(found[np.argsort(-np.abs(found))])


class _Sweep:
    """Multipliers over the speed, as far as they are known."""

    def __init__(self, loop: SampledLoop, top: float):
        self.loop, self.top = loop, top
        self.found: dict[float, Array] = {}
        for speed in np.linspace(0.0, top, STEPS + 1):
            self.worst(float(speed))
            if self.unstable(float(speed)):
                break

    def worst(self, speed: float) -> complex:
        """The largest multiplier at a speed."""
        if speed not in self.found:
            self.found[speed] = _by_size(self.loop, speed)
        return complex(self.found[speed][0])

    def unstable(self, speed: float) -> bool:
        """True if a multiplier is larger than one."""
        return abs(self.worst(speed)) > 1.0 + ROUNDING

    def first(self) -> tuple[float, float] | None:
        """A stable speed and an unstable one close above it, the lowest that can be found."""
        while True:
            speeds = sorted(self.found)
            end = next((k for k, s in enumerate(speeds) if self.unstable(s)), len(speeds))
            doubtful = self._doubtful(speeds[:end])
            if doubtful:
                for speed in doubtful:
                    self.worst(speed)
            elif end == len(speeds):
                return None
            elif speeds[end] - speeds[end - 1] <= CLOSE * self.top:
                return speeds[end - 1], speeds[end]
            else:
                self._close_in(speeds[end - 1], speeds[end])

    def _doubtful(self, stable: list[float]) -> list[float]:
        """Middles of steps between stable speeds over which a curved multiplier might reach the unit circle."""
        least, at = FINEST * self.top, stable[:1]
        for speed in stable[1:]:
            if speed - at[-1] >= least:  # curvature over smaller steps is rounding
                at.append(speed)
        if len(at) < 3:
            return []
        branches, steps = _followed([self.found[s] for s in at]), np.diff(at)
        size = np.log(np.maximum(np.abs(branches), 1e-300))
        slopes = np.diff(size, axis=0) / steps[:, None]
        bends = np.abs(np.diff(slopes, axis=0)) / (steps[1:] + steps[:-1])[:, None]
        bends = np.maximum(np.vstack([bends[:1], bends]), np.vstack([bends, bends[-1:]]))
        reach = np.maximum(size[:-1], size[1:]) + WARY * bends * steps[:, None] ** 2 / 4.0
        found = np.flatnonzero((reach > 0.0).any(axis=1) & (steps > 2.0 * least))
        return [(at[k] + at[k + 1]) / 2.0 for k in found]

    def _close_in(self, stable: float, unstable: float) -> None:
        """Narrow the step that leads to instability, by false position and halving in turns."""
        goal = CLOSE * self.top
        while unstable - stable > goal:
            low, high = (math.log(abs(self.worst(s))) for s in (stable, unstable))
            guess = stable - low * (unstable - stable) / (high - low)
            for s in (guess - 0.25 * goal, guess + 0.25 * goal, (stable + unstable) / 2.0):
                if stable < s < unstable:
                    stable, unstable = (stable, s) if self.unstable(s) else (s, unstable)


def _followed(tables: list[Array]) -> Array:
    """Multipliers of neighbouring speeds in one order, each next to its nearest."""
    from scipy.optimize import linear_sum_assignment  # imported late: slow to load

    out = [tables[0]]
    for table in tables[1:]:
        _, order = linear_sum_assignment(np.abs(out[-1][:, None] - table))
        out.append(table[order])
    return np.array(out)
