"""The rotor of D. Ahmad's thesis (M.Tech., NIT Rourkela, 2014) in its four layups: passive, with the thesis' gains, tuned.

Critical speeds are printed in the thesis. The other figures are an independent recomputation on 24 elements; the packaged
machine has 12 elements.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

import amb_design as ad
from checks import within

RPM = ad.rpm(1.0)
PUBLISHED = 2e-2  # critical speeds of the thesis against this model
RECOMPUTED = 5e-3


@dataclass(frozen=True)
class Row:
    """Figures of one layup; speeds in rpm."""

    layup: int
    thesis_passive: float  # first critical speed, as the thesis prints it
    thesis_controlled: float
    passive_onsets: tuple[float, float]
    equivalent_critical: float
    equivalent_changes: tuple[float, float, float]  # unstable, stable, unstable; the next multiple of 100 rpm
    growth: float  # at rest, thesis gains [1/s]
    growth_hz: float
    stable_kd: float  # stable at rest below
    tuned_critical: float  # Kd 0.03
    tuned_onsets: tuple[float, float]


ROWS = [
    Row(1, 2405, 2765, (2545, 7879), 2770, (4500, 12300, 13300), 3824, 3105, 0.135, 2440, (4928, 12851)),
    Row(2, 2731, 3250, (2943, 8985), 3280, (5200, 12100, 13300), 3932, 3214, 0.162, 2770, (6691, 14468)),
    Row(3, 2630, 3112, (2848, 8609), 3135, (5100, 12100, 13300), 2835, 2860, 0.060, 2680, (6437, 14632)),
    Row(4, 3045, 3814, (3352, 10149), 3780, (6000, 11900, 13300), 3431, 3005, 0.070, 3055, (9382, 16855)),
]
each_row = pytest.mark.parametrize("row", ROWS, ids=lambda row: f"row{row.layup}")


@pytest.fixture(scope="module")
def variants() -> dict[str, ad.Machine]:
    return ad.load_variants("thesis")


def fine(machine: ad.Machine) -> ad.Machine:
    return ad.replace(machine, {"rotor.shaft.elements": 24})


def first_forward(machine: ad.Machine) -> float:
    return next(c.speed_rpm for c in ad.critical_speeds(machine) if c.whirl == "forward")


def onsets(limit: ad.StabilityLimit) -> list[float]:
    assert limit.status == "limit found"
    assert limit.certified
    assert all(o.unstable for o in limit.onsets)
    assert limit.onsets[0].speed == limit.speed
    return [o.speed / RPM for o in limit.onsets[:2]]


def test_there_are_twelve_variants(variants: dict[str, ad.Machine]) -> None:
    assert set(variants) == {f"row{k}-{kind}" for k in (1, 2, 3, 4) for kind in ("passive", "controlled", "tuned")}


@each_row
def test_passive(row: Row, variants: dict[str, ad.Machine]) -> None:
    machine = variants[f"row{row.layup}-passive"]
    within(first_forward(machine), row.thesis_passive, PUBLISHED, f"row {row.layup}, passive, critical (thesis)")
    for name, m in (("12 elements", machine), ("24 elements", fine(machine))):
        limit = ad.stability_limit(m)
        within(onsets(limit), row.passive_onsets, RECOMPUTED, f"row {row.layup}, passive, onsets, {name}")
        assert [o.mode.whirl for o in limit.onsets[:2]] == ["forward", "forward"]


@each_row
def test_equivalent_coefficients(row: Row, variants: dict[str, ad.Machine]) -> None:
    machine = variants[f"row{row.layup}-controlled"]
    equivalent = ad.equivalent_coefficients(machine)
    critical = equivalent.critical_speed / RPM
    within(critical, row.thesis_controlled, PUBLISHED, f"row {row.layup}, k_eq + c_eq, critical (thesis)")
    within(critical, row.equivalent_critical, RECOMPUTED, f"row {row.layup}, k_eq + c_eq, critical")
    assert [unstable for _, unstable in equivalent.changes] == [True, False, True]
    # the recomputation stepped by 100 rpm and names the first speed behind each change
    found = [100 * math.ceil(speed / RPM / 100) for speed, _ in equivalent.changes]
    print(f"row {row.layup}, k_eq + c_eq, changes: {[round(s / RPM) for s, _ in equivalent.changes]}")
    assert found == list(row.equivalent_changes)
    assert equivalent.stability_limit == equivalent.changes[0][0]


@each_row
def test_thesis_gains_are_unstable_at_rest(row: Row, variants: dict[str, ad.Machine]) -> None:
    machine = variants[f"row{row.layup}-controlled"]
    assert machine.controller is not None
    assert machine.controller.kd == 0.99
    limit = ad.stability_limit(machine, first_only=True)
    assert limit.status == "unstable at rest"
    assert limit.speed == 0.0
    worst = ad.stability_limit(fine(machine), first_only=True).unstable_at_rest[0]
    within(worst.eigenvalue.real, row.growth, RECOMPUTED, f"row {row.layup}, Kd 0.99, growth rate at rest")
    within(worst.frequency_hz, row.growth_hz, RECOMPUTED, f"row {row.layup}, Kd 0.99, frequency of the unstable mode")


@each_row
def test_largest_derivative_gain_at_rest(row: Row, variants: dict[str, ad.Machine]) -> None:
    """Printed with three decimals: half of the last is allowed."""
    machine = fine(variants[f"row{row.layup}-controlled"])

    def growth(kd: float) -> float:
        return float(np.linalg.eigvals(ad.system(ad.replace(machine, {"controller.kd": kd})).A0).real.max())

    low, high = row.stable_kd - 0.0005, row.stable_kd + 0.0005
    assert growth(low) < 0.0 < growth(high)
    for kd, status in ((low, "none below the top speed"), (high, "unstable at rest")):
        changed = ad.replace(machine, {"controller.kd": kd})
        assert ad.stability_limit(changed, top_speed=1.0, first_only=True).status == status
    while high - low > 1e-6:
        middle = (low + high) / 2.0
        low, high = (middle, high) if growth(middle) < 0.0 else (low, middle)
    print(f"row {row.layup}: stable at rest for Kd below {low:.5f} (stated {row.stable_kd:.3f})")


@each_row
def test_tuned(row: Row, variants: dict[str, ad.Machine]) -> None:
    machine = variants[f"row{row.layup}-tuned"]
    assert machine.controller is not None
    assert machine.controller.kd == 0.03
    for name, m in (("12 elements", machine), ("24 elements", fine(machine))):
        what = f"row {row.layup}, Kd 0.03, {name}"
        within(first_forward(m), row.tuned_critical, RECOMPUTED, f"{what}, critical")
        limit = ad.stability_limit(m, ad.rpm(20_000))
        within(onsets(limit), row.tuned_onsets, RECOMPUTED, f"{what}, onsets")


def test_packaged_starting_point(variants: dict[str, ad.Machine]) -> None:
    """The problem `thesis-tuned` is the fourth row with Kd 0.03."""
    expected = ad.stability_limit(variants["row4-tuned"], ad.rpm(20_000)).speed
    within(ad.stability_limit(ad.load("thesis-tuned")).speed, expected, 1e-7, "thesis-tuned")
