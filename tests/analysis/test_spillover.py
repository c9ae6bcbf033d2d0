"""A loop that nearly undoes the damping of a mode beyond the range of ISO 14839-3 is warned of."""

from __future__ import annotations

import amb_design as ad


def warnings(low_pass, kd):
    machine = ad.replace(ad.load("thesis-tuned"), {"controller.low_pass.frequency": low_pass, "controller.kd": kd})
    return machine, [f.text for f in ad.findings(machine) if f.topic == "spillover"]


def test_low_pass_that_is_too_fast():
    machine, found = warnings(1.2e4, 0.03)
    assert len(found) == 1
    assert "rises to 8.26 at 2393 Hz" in found[0]
    assert "by 11 %" in found[0]
    assert ad.sensitivity(machine, 0.0).worst.value < 5.0  # the standard's range does not show it
    more = ad.replace(machine, {"controller.kd": 0.03 * 1.5})
    assert ad.stability_limit(more).status == "unstable at rest"


def test_no_warning_where_there_is_room_or_no_stability():
    assert not warnings(5.0e3, 0.03)[1]
    assert not warnings(1.2e4, 0.05)[1]  # unstable at rest: then sensitivities mean nothing
