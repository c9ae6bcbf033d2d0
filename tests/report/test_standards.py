"""Verdicts of standards against limits and margins worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.critical import CriticalSpeed
from amb_design.analysis.standards import amplification, criteria, required_margin, running_speed
from amb_design.spec.templates import template
from checks import within

STEEL = ad.loads(template("steel"))
JEFFCOTT = ad.load("jeffcott")


def judged(machine: ad.Machine, *speeds: float) -> dict[str, list]:
    loop = ad.system(machine)
    peaks = [ad.sensitivity(loop, s) for s in speeds]
    found: dict[str, list] = {}
    for c in criteria(loop, ad.stability_limit(loop, first_only=True), peaks):
        found.setdefault(c.standard, []).append(c)
    return found


@pytest.mark.parametrize(
    ("factor", "below", "above"),
    [
        (2.4, 0.0, 0.0),  # no margin for damped modes
        (2.5, 0.0, 0.10),
        (3.5, 0.085, 0.185),  # 17 (1 - 1/2) %
        (10.0, 0.15, 0.25),  # 17 (1 - 1/8.5) %
        (100.0, 0.16, 0.26),  # the largest that is asked for
        (math.inf, 0.16, 0.26),
    ],
)
def test_separation_margins_by_hand(factor, below, above):
    assert required_margin(factor, above=False) == pytest.approx(below, abs=1e-12)
    assert required_margin(factor, above=True) == pytest.approx(above, abs=1e-12)


def test_amplification_factor_is_that_of_the_response():
    """Half-power width of a Jeffcott rotor's unbalance response, as the standard measures it."""
    machine = ad.replace(
        JEFFCOTT, {"rotor.disks.unbalance": 1e-4, "bearings.damping": 700.0, "rotor.shaft.viscous_damping": 0.0}
    )
    (critical,) = [c for c in ad.critical_speeds(machine) if c.whirl == "forward"]
    speeds = critical.speed * np.linspace(0.6, 1.6, 4001)
    radius = ad.unbalance_response(machine, speeds).amplitudes.max(axis=1) / speeds**2
    wide = speeds[radius > radius.max() / math.sqrt(2.0)]
    within(amplification(critical), speeds[np.argmax(radius)] / (wide[-1] - wide[0]), 0.02, "amplification factor")
    undamped = CriticalSpeed(critical.speed, "forward", 0.0, "rotor")
    assert amplification(undamped) == math.inf


def test_running_speed_is_the_service_speed_or_below_the_limit():
    limit = ad.stability_limit(STEEL)
    assert running_speed(limit) == pytest.approx(ad.rpm(15000))
    free = ad.stability_limit(ad.replace(STEEL, {"operation.service_speed": None}))
    assert running_speed(free) == pytest.approx(0.9 * free.speed)


def test_every_demand_is_judged_with_its_numbers():
    end = ad.rpm(15000)
    found = judged(STEEL, 0.0, end)
    assert [c.verdict for c in found["stability"]] == ["passes"]
    peaks = [ad.sensitivity(STEEL, s).worst.value for s in (0.0, end)]
    assert [c.value for c in found["ISO 14839-3"]] == pytest.approx(peaks)
    slow = [
        m.logarithmic_decrement
        for m in ad.spectrum(STEEL, end)
        if m.whirl == "forward" and m.kind == "rotor" and m.frequency < end
    ]
    assert found["API 617"][0].value == pytest.approx(min(slow))
    margins = [c for c in found["API 617"] if "margin" in c.subject]
    (bending,) = [c for c in ad.critical_speeds(STEEL) if c.whirl == "forward" and 20000 < c.speed_rpm < 30000]
    assert margins[0].value == pytest.approx(bending.speed / end - 1.0)
    assert margins[0].limit == pytest.approx(required_margin(1.0 / (2.0 * bending.damping_ratio), above=True))
    (whirl,) = found["ISO 14839-2"]
    radii = ad.unbalance_response(STEEL, np.linspace(10.0, end, 700))
    largest = max(np.abs(radii.at(m.position)).max() for m in STEEL.magnets)
    within(whirl.value, largest / 0.25e-3, 1e-3, "whirl over clearance")


def test_what_is_missed_is_said():
    close = judged(ad.replace(STEEL, {"operation.service_speed": ad.rpm(21500)}), 0.0)
    assert any(c.verdict == "fails" and "separation margin" in c.subject for c in close["API 617"])
    limit = ad.stability_limit(STEEL)
    fast = judged(ad.replace(STEEL, {"operation.service_speed": 1.05 * limit.speed}), 0.0)
    assert set(fast) == {"stability"}  # nothing else can be judged
    assert fast["stability"][0].verdict == "fails"
    loud = judged(ad.replace(STEEL, {"rotor.disks.unbalance": 2e-3}), 0.0)
    assert loud["ISO 14839-2"][0].verdict == "fails"
    weak = judged(ad.replace(STEEL, {"controller.kd": 8.0}), 0.0)
    assert weak["ISO 14839-3"][0].value > 3.0
    assert weak["ISO 14839-3"][0].verdict in ("tolerable", "fails")


def test_what_cannot_be_judged_says_why():
    passive = judged(JEFFCOTT)
    assert {c.where for c in passive["ISO 14839-2"] + passive["ISO 14839-3"]} == {
        "there is no magnet",
        "there is no control loop",
    }
    unstable = judged(ad.load("thesis", "row4-controlled"))
    assert [(c.verdict, c.where) for c in unstable["stability"]] == [("fails", "unstable at rest")]
    still = judged(ad.replace(STEEL, {"rotor.disks.unbalance": 0.0, "operation.service_speed": None}), 0.0)
    assert still["ISO 14839-2"][0].where == "no disk has an unbalance"
    assert still["API 617"][-1].where == "no service speed is given"
