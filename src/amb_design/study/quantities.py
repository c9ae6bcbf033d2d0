"""What a machine does, as Functions of its parameters: values that are computed, with exact derivatives.

Lists of the worst few: largest real parts, least damping ratios, highest peaks. An entry of such a list is as smooth as the mode or
peak that holds its place, and its derivative is that of this mode or peak. Where two change places the derivative jumps; a
problem that limits the whole list does not notice, for it limits both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.stability import FOUND, NONE, stability_limit
from ..analysis.system import Array
from ..errors import ModelError
from ..optimise.measures import loops
from ..optimise.measures import modes as mode_measures
from ..optimise.measures.samples import Samples
from ..optimise.measures.whirl import QUANTITIES, UnbalanceMeasures
from ..optimise.state import State
from .numbers import Numbers, Patterns
from .numeric import numeric

Rows = tuple[Array, Array, Array]
"""Values (k,), their derivatives with respect to the parameters (k, np) and to the speed (k,)."""

ONE = np.ones(1)


def growth_rates(numbers: Numbers, speeds: int, modes: int = 1, smooth: float | None = None) -> ca.Function:
    """Largest real parts of the eigenvalues [1/s] at each speed, descending; negative means stable.

    Parameters
    ----------
    numbers : Numbers
    speeds : int
        Number of speeds.
    modes : int
        Number of eigenvalues at each speed; of a conjugate pair only one counts.
    smooth : float, optional
        [1/s] Instead one number a speed, smooth * log(sum(exp(real part/smooth))) over all eigenvalues. It lies above the largest
        real part by at most smooth * log(number of eigenvalues), and by next to nothing where one mode stands alone; it stays
        differentiable where modes change places, though not where two coalesce into one defective pair.
    """
    if smooth is not None:
        if not smooth > 0.0:
            raise ModelError(f"smooth = {smooth:g} must be positive; leave it out for the abscissa itself")
        return _over_speeds("growth_rates", numbers, speeds, 1, lambda s, w: _smoothed(s, w, smooth))
    _check_modes(modes)
    real_form = not numbers.loop.complex_form

    def rows(state: State, speed: float) -> Rows:
        found = mode_measures.modes(state, ONE, speed, real_form=real_form, slowest=True)
        return _worst(found.samples(found.values.real, found.slopes.real, found.rates.real), modes, -1e6)

    return _over_speeds("growth_rates", numbers, speeds, modes, rows)


def damping_ratios(
    numbers: Numbers, speeds: int, modes: int = 4, window: tuple[float, float] = (0.0, math.inf)
) -> ca.Function:
    """Least damping ratios at each speed, ascending.

    Parameters
    ----------
    numbers : Numbers
    speeds, modes : int
    window : (float, float)
        Whirl frequencies that count [rad/s]; real poles never do. Where fewer modes lie in it, ones fill the list.
    """
    _check_modes(modes)
    real_form = not numbers.loop.complex_form

    def rows(state: State, speed: float) -> Rows:
        chosen = mode_measures.in_window(state.spectra(ONE * speed).values, window)
        found = mode_measures.damping(mode_measures.modes(state, ONE, speed, chosen, real_form))
        return _worst(found, modes, 1.0, least=True)

    return _over_speeds("damping_ratios", numbers, speeds, modes, rows)


def sensitivity_peaks(numbers: Numbers, speeds: int, peaks: int = 4, up_to: float = 0.0) -> ca.Function:
    """Highest peaks of the sensitivity of each control loop at each speed, loop by loop, descending; zeros fill the list.

    Parameters
    ----------
    numbers : Numbers
    speeds, peaks : int
    up_to : float
        Highest frequency [rad/s] where that is above 2 kHz and three times the speed.
    """
    count, form = len(numbers.loop.plant.loops), numbers.loop.complex_form
    if not count:
        raise ModelError(f"{numbers.loop.machine.name} has no control loop, and so no sensitivity")

    def rows(state: State, speed: float) -> Rows:
        found = loops.sensitivity(state, ONE, speed, count, form, up_to=up_to, count=peaks)
        return _joined([_worst(found, peaks, 0.0, group=f"1.0 {k}") for k in range(count)])

    return _over_speeds("sensitivity_peaks", numbers, speeds, count * peaks, rows)


def unbalance(
    numbers: Numbers, speeds: int, unbalance: Patterns, quantity: str = "control_current", peaks: int = 0
) -> ca.Function:
    """What unbalances ask of the magnets at each speed.

    Parameters
    ----------
    numbers : Numbers
    speeds : int
    unbalance : tuple of tuple of complex
        One unbalance a disk [kg m], one row a pattern.
    quantity : {"control_current", "control_current_ratio", "total_current", "flux_density", "voltage", "displacement_ratio"}
    peaks : int
        Highest peaks below each speed that are listed behind the value at the speed itself; zeros fill the list.
    """
    if quantity not in QUANTITIES:
        raise ModelError(f"unbalance drives no {quantity!r}; choose one of {', '.join(QUANTITIES)}")
    driven = numbers.driven(unbalance)
    measures = UnbalanceMeasures(driven, {quantity: 0.0})
    places = [(i, j) for j in range(len(unbalance)) for i in range(len(driven.machine.magnets))]

    def rows(state: State, speed: float) -> Rows:
        if not peaks:
            force = state.lower @ driven.unbalance
            return _joined([_plain(measures.sample(state, i, 0, j, ONE * speed, force, speed)) for i, j in places])
        found, parts = measures.samples(state, speed)[quantity], []
        for i, j in places:
            parts += [_worst(found, 1, 0.0, group=f"{i} {j} end"), _worst(found, peaks, 0.0, group=f"{i} {j} peak")]
        return _joined(parts)

    return _over_speeds("unbalance", numbers, speeds, len(places) * (1 + peaks), rows)


def limit_speed(numbers: Numbers, top_speed: float) -> ca.Function:
    """The stability limit speed [rad/s], certified where the analysis certifies it.

    Parameters
    ----------
    numbers : Numbers
    top_speed : float
        Where the search ends [rad/s].

    Notes
    -----
    The derivative is that of the mode that becomes unstable first. It jumps where another one takes its place, and the limit itself
    jumps where a new window of instability opens. At zero (unstable at rest) and at the top speed the derivative is zero. Marginal
    machines have no limit: not a number.
    """

    def compute(p: Array) -> tuple[Array, Sequence[Array]]:
        found, flat = stability_limit(numbers.system(p), top_speed, first_only=True), np.zeros((1, len(p)))
        if found.status != FOUND or found.mode is None:
            return np.array([found.speed if found.status == NONE else 0.0 * found.speed]), [flat]
        mode, member = found.mode, numbers.member(p)
        left, right = mode.left.conj()[None], mode.right[None]
        moved = np.zeros(flat.shape, complex)
        for part, factor in (("A0", 1.0), ("A1", mode.speed), ("E", -mode.signed)):
            moved += factor * member.form(part, left, right)
        rate = complex(mode.left.conj() @ member.part("A1") @ mode.right).real
        return np.array([found.speed]), [-moved.real / rate]

    typical = (np.abs(numbers.loop.nominal),)
    return numeric("stability_limit", [("p", numbers.loop.np)], ("speed", 1), compute, typical)


def _check_modes(modes: int) -> None:
    if not 1 <= modes <= mode_measures.KEPT:
        raise ModelError(f"modes = {modes} is not between 1 and {mode_measures.KEPT}")


def _over_speeds(
    name: str, numbers: Numbers, speeds: int, each: int, rows: Callable[[State, float], Rows]
) -> ca.Function:
    """A Function of parameters and speeds from what is known at one speed."""

    def compute(p: Array, at: Array) -> tuple[Array, Sequence[Array]]:
        state = numbers.state(p)
        values, slopes, rates = zip(*(rows(state, float(s)) for s in at), strict=True)
        by_speed = np.zeros((speeds * each, speeds))
        for k, moves in enumerate(rates):
            by_speed[k * each : (k + 1) * each, k] = moves
        return np.concatenate(values), [np.concatenate(slopes), by_speed]

    top = float(numbers.loop.machine.operation.top_speed)
    typical = np.abs(numbers.loop.nominal), np.full(speeds, top)
    return numeric(name, [("p", numbers.loop.np), ("speed", speeds)], ("values", speeds * each), compute, typical)


def _smoothed(state: State, speed: float, smooth: float) -> Rows:
    """Logarithm of a sum of exponentials of all real parts."""
    spectra = state.spectra(ONE * speed)
    values, top = spectra.values[0], spectra.values[0].real.max()
    weights = np.exp((values.real - top) / smooth)
    total = weights.sum()
    chosen = np.flatnonzero(weights > 1e-18 * total)
    right, left = spectra.right[0].T[chosen], spectra.left[0][chosen]
    slopes, rates = state.eigenvalue_slopes(values[chosen], np.full(len(chosen), speed), right, left)
    shares = weights[chosen] / total
    value = float(top + smooth * math.log(total))
    return np.array([value]), (shares @ slopes.real)[None], np.array([shares @ rates.real])


def _worst(samples: Samples, keep: int, fill: float, least: bool = False, group: str | None = None) -> Rows:
    """The largest (or least) few samples of a group, in order."""
    inside = [k for k, g in enumerate(samples.groups) if group is None or g == group]
    order = sorted(inside, key=lambda k: float(samples.values[k]), reverse=not least)[:keep]
    missing = keep - len(order)
    return (
        np.append(samples.values[order], np.full(missing, fill)),
        np.vstack([samples.slopes[order], np.zeros((missing, samples.slopes.shape[1]))]),
        np.append(samples.rates[order], np.zeros(missing)),
    )


def _plain(samples: Samples) -> Rows:
    return samples.values, samples.slopes, samples.rates


def _joined(parts: Sequence[Rows]) -> Rows:
    values, slopes, rates = zip(*parts, strict=True)
    return np.concatenate(values), np.vstack(slopes), np.concatenate(rates)


OVER_SPEEDS: dict[str, Callable[..., ca.Function]] = {
    "growth_rates": growth_rates,
    "damping_ratios": damping_ratios,
    "sensitivity_peaks": sensitivity_peaks,
    "unbalance": unbalance,
}


def resonance_limit(values: Any, bound: float, low: float = 0.25) -> Any:
    """A bound on resonance peaks in a form that is close to linear in the design: not positive where values keep to it.

    Peaks grow like one over the damping, so 1 - bound/value is nearly linear where value - bound is not. Below a fraction of the bound
    it goes on as a straight line.

    Parameters
    ----------
    values : casadi MX, SX or DM
        Not negative.
    bound : float
        Positive.
    low : float
        That fraction.
    """
    ratio = values / bound
    return 1.0 - 1.0 / ca.fmax(ratio, low) + ca.fmin(ratio - low, 0.0) / low**2
