"""The certified stability limit of random machines against a dense sweep with bisection."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings

import amb_design as ad
from amb_design.analysis.certificate import Walk
from amb_design.threads import one_thread
from properties.machines import machines
from refine import eigenvalue, onset

EXAMPLES = {"isotropic": 180, "anisotropic": 60}
SWEEP = 300
BELOW = 1e-6  # the limit may lie this much below the true onset
ABOVE = 1e-7  # and never more than this above it


def growth(loop: ad.System, speed: float) -> float:
    return float(np.linalg.eigvals(loop.matrix(speed)).real.max())


@one_thread
def swept_onset(loop: ad.System, top: float) -> float:
    """First speed at which an eigenvalue crosses the axis; infinite if a sweep finds none."""
    grid = np.linspace(0.0, top, SWEEP)
    low = 0.0
    for speed in grid[1:]:
        if growth(loop, float(speed)) > 0.0:
            high = float(speed)
            while high - low > 1e-12 * high:
                middle = (low + high) / 2.0
                if not low < middle < high:
                    break
                low, high = (low, middle) if growth(loop, middle) > 0.0 else (middle, high)
            e = Walk(loop.A0, loop.A1).at(high)
            return onset(loop.A0, loop.A1, high, complex(e.values[e.rightmost]))
        low = float(speed)
    return np.inf


class Tally:
    """What the random machines were, and how well their limits agree."""

    def __init__(self) -> None:
        self.statuses: Counter[str] = Counter()
        self.below = self.above = 0.0
        self.eigendecompositions: list[int] = []
        self.missed_by_sweep = 0

    def compare(self, machine: ad.Machine) -> None:
        loop = ad.system(machine)
        limit = ad.stability_limit(loop, first_only=True)
        self.statuses[limit.status] += 1
        rest = growth(loop, 0.0)
        if limit.status == "marginal":
            assert abs(rest) < 1e-3  # truly on the axis, to rounding
            return
        assert limit.certified
        assert (limit.status == "unstable at rest") == (rest > 0.0)
        if limit.status == "unstable at rest":
            assert limit.speed == 0.0
            assert limit.unstable_at_rest[0].eigenvalue.real > 0.0
            return
        self.eigendecompositions.append(limit.eigendecompositions)
        true = swept_onset(loop, limit.top_speed)
        if limit.status == "none below the top speed":
            assert limit.speed == limit.top_speed
            assert true == np.inf
            return
        behind = limit.bracket[1] * (1.0 + ABOVE)
        if true > behind and growth(loop, behind) > 0.0:  # a window that the sweep stepped over
            self.missed_by_sweep += 1
            true = limit.bracket[1]
        self.below = max(self.below, 1.0 - limit.speed / true)
        self.above = max(self.above, limit.speed / true - 1.0)
        assert limit.speed >= true * (1.0 - BELOW)
        assert limit.speed <= true * (1.0 + ABOVE)
        assert limit.onsets[0].unstable
        # the limiting mode is taken at the limit: on the axis but for the resolution and rounding
        assert limit.mode is not None
        assert limit.mode.speed == pytest.approx(limit.speed, rel=1e-7)
        value, rate = eigenvalue(loop.A0, loop.A1, limit.mode.speed, limit.mode.signed)
        assert abs(value.real) <= 1e-6 * limit.speed * abs(rate.real)
        rounding = 1e3 * np.finfo(float).eps * np.linalg.norm(loop.matrix(limit.mode.speed))
        assert abs(value - limit.mode.signed) <= rounding

    def report(self, kind: str) -> None:
        spent = self.eigendecompositions
        print(
            f"{kind}: {dict(self.statuses)}; limits at most {self.below:.1e} below and {self.above:.1e} above the true onset; "
            f"{self.missed_by_sweep} windows missed by the sweep; eigendecompositions {min(spent)} to {max(spent)}, "
            f"median {np.median(spent):.0f}"
        )


def run(anisotropic: bool) -> Tally:
    kind = "anisotropic" if anisotropic else "isotropic"
    tally = Tally()

    @settings(
        max_examples=EXAMPLES[kind],
        derandomize=True,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(machines(anisotropic=anisotropic))
    def compare(machine: ad.Machine) -> None:
        tally.compare(machine)

    compare()
    tally.report(kind)
    return tally


def test_isotropic_machines() -> None:
    counts = run(anisotropic=False).statuses
    decided = sum(counts.values()) - counts["marginal"]
    assert decided >= 160
    assert counts["limit found"] >= 50
    assert counts["unstable at rest"] >= 10
    assert counts["none below the top speed"] >= 10


def test_anisotropic_machines() -> None:
    counts = run(anisotropic=True).statuses
    assert sum(counts.values()) - counts["marginal"] >= 50
    assert counts["limit found"] >= 10
