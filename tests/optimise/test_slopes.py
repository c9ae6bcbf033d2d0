"""Gradients of every quantity with respect to every kind of free number, against differences of fourth order.

The differences are taken of the values that the search itself sees, on the complete model, each computed anew for the changed
numbers. Samples of two designs belong together as in the search: same group, nearest mark. Peaks of the unbalance response
stay at the speeds where the nominal design has them, for at a peak the speed does not matter; test_audit.py compares
the peaks themselves. Errors are relative to the largest derivative of the same sample, each number counted over its own
bounds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise.evaluation import Case
from amb_design.optimise.measures import modes, whirl
from amb_design.optimise.measures.samples import Samples, joined
from optimise.rigs import LIMITS, everything_problem

TOLERANCE = 1e-6

STEPS = (4e-3, 5e-4, 2e-3, 1e-3)
"""Of the range of a number; the best one counts, for peaks want small steps and decay rates of high modes large ones."""

HIGHEST = 3e4
"""Modes of the real form with a higher frequency [rad/s] come in pairs too close for their marks to tell them apart."""

END = 800.0
FRACTIONS = np.array([0.45, 1.0])
CHECKED = np.array([1.0])


class FixedPeaks:
    """Unbalance measures at speeds that are found once."""

    def __init__(self, inner: whirl.UnbalanceMeasures):
        self.inner, self.speeds = inner, {}

    def samples(self, state: Any, end: float) -> dict[str, Samples]:
        inner, force = self.inner, state.lower @ self.inner.loops.unbalance
        if not self.speeds:
            self.find(state, end)
        out: dict[str, list[Samples]] = {q: [] for q in inner.bounds}
        for (k, i, j), (name, found) in self.speeds.items():
            speeds = np.append(found, end)
            out[name].append(inner.sample(state, i, k, j, speeds, force, end))
        n = state.member.family.parameters
        return {name: joined(samples, n) for name, samples in out.items()}

    def find(self, state: Any, end: float) -> None:
        """Peaks, found with many rounds."""
        found = self.inner.samples(state, end, points=40, zooms=13)
        for k, (name, samples) in enumerate(found.items()):
            at = 0
            for j in range(self.inner.loops.unbalance.shape[1]):
                for i in range(len(self.inner.loops.machine.magnets)):
                    group = f"{i} {j} peak"
                    mine = [s for s, g in zip(samples.speeds, samples.groups, strict=True) if g == group]
                    self.speeds[k, i, j] = name, np.array(mine)
                    at += len(mine)
            assert at, f"{name} has no peak below the end of the range"


def values_of(case: Case, p: np.ndarray, end: float) -> dict[str, Samples]:
    """Samples with the decay rates of the same modes in place of stability, whose denominator is frozen for stable modes."""
    state, real_form = case.state(p), not case.loops.complex_form
    found = case.samples(state, end, FRACTIONS, CHECKED)
    rates = modes.decay(modes.modes(state, FRACTIONS, end, real_form=real_form))
    factor = found["stability"].values / rates.values
    assert (factor > 0.0).all()
    assert (rates.values > 0.0).all()
    np.testing.assert_allclose(found["stability"].slopes, factor[:, None] * rates.slopes, rtol=1e-12)
    np.testing.assert_allclose(found["stability"].rates, factor * rates.rates, rtol=1e-12)
    found["stability"] = rates
    if real_form:
        found |= {q: below(found[q], HIGHEST) for q in ("stability", "decay_rate", "damping_ratio")}
    return found


def below(samples: Samples, highest: float) -> Samples:
    """Samples with marks below a frequency."""
    kept = np.flatnonzero(np.abs(samples.marks) < highest)
    texts = {f: tuple(getattr(samples, f)[i] for i in kept) for f in ("places", "groups")}
    arrays = {f: getattr(samples, f)[kept] for f in ("values", "slopes", "rates", "speeds", "marks")}
    return Samples(**arrays, **texts)


def matched(nominal: Samples, other: Samples) -> np.ndarray:
    """Values at another design in the order of the nominal ones; NaN where a mode or peak is not found again."""
    out = np.full(len(nominal), np.nan)
    groups = np.array(other.groups)
    for i, (group, mark) in enumerate(zip(nominal.groups, nominal.marks, strict=True)):
        same = np.flatnonzero(groups == group)
        if len(same):
            distances = np.abs(other.marks[same] - mark)
            if distances.min() <= 0.02 * abs(mark) + 1e-12:
                out[i] = other.values[same[int(np.argmin(distances))]]
    return out


class Comparison:
    """Exact derivatives of one case beside differences."""

    def __init__(self, problem: ad.DesignProblem, scenario: int | None = None):
        self.case = Case(problem, None if scenario is None else problem.cases[scenario])
        self.case.unbalance = FixedPeaks(self.case.unbalance)  # type: ignore[assignment, arg-type]
        self.p = np.array(list(problem.start().values()))
        self.ranges = np.array([v.upper - v.lower for v in problem.variables])
        self.names = [v.name for v in problem.variables]
        self.nominal = values_of(self.case, self.p, END)
        self.largest = {q: np.abs(s.slopes * self.ranges).max(axis=1) for q, s in self.nominal.items()}
        self.largest = {q: np.maximum(big, np.abs(self.nominal[q].rates * END)) for q, big in self.largest.items()}

    def differences(self, p: np.ndarray, end: float) -> dict[str, np.ndarray]:
        """Fourth-order central differences for a change of numbers and end of range."""
        f = {k: values_of(self.case, self.p + k * p, END + k * end) for k in (-2, -1, 1, 2)}
        out = {}
        for q, s in self.nominal.items():
            m = {k: matched(s, f[k][q]) for k in f}
            out[q] = (8.0 * (m[1] - m[-1]) - (m[2] - m[-2])) / 12.0
        return out

    def errors(self, number: int | None) -> dict[str, np.ndarray]:
        """Relative errors with respect to a number, or to the end of the range."""
        best: dict[str, np.ndarray] = {}
        for h in STEPS if number is not None else (*STEPS, STEPS[1] / 2.0):  # resonances are narrow in the speed
            direction = np.zeros(len(self.p))
            if number is not None:
                direction[number] = h * self.ranges[number]
            found = self.differences(direction, 0.0 if number is not None else h * END)
            for q, s in self.nominal.items():
                exact = s.rates * END if number is None else s.slopes[:, number] * self.ranges[number]
                error = np.abs(found[q] / h - exact) / self.largest[q]
                best[q] = np.fmin(best[q], error) if q in best else error
            if all((np.nan_to_num(e) < 0.5 * TOLERANCE).all() for e in best.values()):
                break
        return best


def compare(rig: Comparison, numbers: list[str], what: str) -> None:
    worst: dict[str, tuple[float, str]] = dict.fromkeys(rig.nominal, (0.0, ""))
    bad, lost, total = [], 0, 0
    for name in [*numbers, None]:
        for q, error in rig.errors(None if name is None else rig.names.index(name)).items():
            lost, total = lost + int(np.isnan(error).sum()), total + len(error)
            if not np.isnan(error).all():
                k = int(np.nanargmax(error))
                worst[q] = max(worst[q], (float(error[k]), f"{name or 'end of the range'}, {rig.nominal[q].places[k]}"))
                if error[k] > TOLERANCE:
                    bad.append(f"{q} to {name or 'end of the range'}, {rig.nominal[q].places[k]}: {error[k]:.1e}")
    print(f"{what}, {len(numbers)} numbers and the end of the range, worst errors of the gradients:")
    for q, (error, where) in worst.items():
        print(f"    {q}: {error:.1e} ({where})")
    assert not bad, "\n".join(bad)
    assert lost <= 0.02 * total, f"{lost} of {total} modes and peaks were not found again"


@pytest.fixture(scope="module")
def isotropic() -> Comparison:
    return Comparison(everything_problem(elements=4))


@pytest.fixture(scope="module")
def anisotropic() -> Comparison:
    return Comparison(everything_problem(anisotropic=True, elements=4))


def test_every_quantity_and_every_number_counts(isotropic: Comparison, anisotropic: Comparison) -> None:
    """No gradient is there for show: each quantity has samples, and each number moves something."""
    for rig, real_form in ((isotropic, False), (anisotropic, True)):
        assert rig.case.loops.complex_form is not real_form
        assert set(rig.nominal) == {"stability", *LIMITS}
        assert all(len(s) for s in rig.nominal.values())
        slopes = np.concatenate(
            [s.slopes / big[:, None] for (s, big) in zip(rig.nominal.values(), rig.largest.values(), strict=True)]
        )
        idle = [
            n for n, moved in zip(rig.names, (np.abs(slopes * rig.ranges) > 1e-9).any(axis=0), strict=True) if not moved
        ]
        assert not idle


def test_isotropic(isotropic: Comparison) -> None:
    compare(isotropic, isotropic.names, "complex form")


ANISOTROPIC = (
    *("controller.kd", "controller.low_pass.frequency", "controller.delay", "magnets[0].gap", "magnets[0].axes_angle"),
    *("magnets[1].position", "sensors[0].position", "bearings[1].position", "plies[0].angle", "plies[1].thickness"),
)


def test_anisotropic(anisotropic: Comparison) -> None:
    compare(anisotropic, list(ANISOTROPIC), "real form")


def test_scenario() -> None:
    rig = Comparison(everything_problem(elements=4), scenario=0)
    compare(rig, ["magnets[0].gap", "controller.kd", "plies[0].angle", "magnets[1].position"], "scenario")
