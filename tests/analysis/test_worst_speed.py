"""Where over a range of speeds a quantity is worst, and at which frequencies the sensitivity is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.summary import analyse
from amb_design.analysis.worst_speed import most_sensitive_speeds, telling_sensitivities, worst_speeds
from amb_design.optimise.evaluation import Case
from optimise.interrupted import small_problem
from optimise.rigs import flywheel

END = 1000.0


@pytest.mark.parametrize("width", [0.02, 0.05, 0.3])
@pytest.mark.parametrize("place", [0.013, 0.2391, 0.5, 0.987])
def test_peaks_between_the_speeds_of_the_net(width: float, place: float) -> None:
    """The highest of several curves has its place first, to a thousandth of the range; a second, lower one follows."""

    def curves(speed: float) -> np.ndarray:
        x = speed / END
        return np.array(
            [2.0 / (1.0 + ((x - place) / (0.5 * width)) ** 2), 0.5 + 1.2 * np.exp(-(((x - 0.7) / 0.03) ** 2))]
        )

    found = worst_speeds(curves, END) / END
    assert found[0] == pytest.approx(place, abs=1e-3)
    assert np.abs(found - 0.7).min() <= 1e-3


def test_ends_of_the_range_are_places_too() -> None:
    assert worst_speeds(lambda s: np.array([s]), END) == pytest.approx([END])
    assert worst_speeds(lambda s: np.array([-s]), END) == pytest.approx([0.0])


def test_values_without_end_are_worst_where_they_are() -> None:
    """Noise of an unstable loop, and a window of frequencies without modes."""
    assert worst_speeds(lambda s: np.array([np.inf if s > 600.0 else s]), END)[0] > 600.0
    assert len(worst_speeds(lambda _: np.array([-np.inf]), END)) == 1


def test_a_narrow_notch_met_on_the_way() -> None:
    """A flywheel's forward whirl passes the notch at a third of the range: banded solutions at many speeds see it there."""
    machine = flywheel()
    end, top = machine.operation.top_speed, ad.rpm(60.0 * 10e3)
    speeds = np.linspace(0.0, end, 321)
    peaks = [ad.sensitivity(machine, s, highest=top).worst.value for s in speeds[110:140]]
    worst = speeds[110 + int(np.argmax(peaks))]
    assert max(peaks) > 1.4 * max(ad.sensitivity(machine, s, highest=top).worst.value for s in (0.0, 0.5 * end, end))
    found = most_sensitive_speeds(ad.system(machine), end, lambda _: top)
    assert found[0] == pytest.approx(worst, abs=end / 320.0)
    assert ad.sensitivity(machine, found[0], highest=top).worst.value >= max(peaks) * (1.0 - 1e-6)


def test_a_summary_tells_where_the_sensitivity_is_worst() -> None:
    """At rest and at the end all is well; the verdict between them is what counts."""
    machine = flywheel()
    told = telling_sensitivities(ad.system(machine), machine.operation.top_speed)
    assert [s.zone for s in told] == ["A", "D", "A"]
    verdicts = [c.verdict for c in analyse(machine).criteria if c.subject.startswith("peak sensitivity")]
    assert verdicts == ["passes", "fails", "passes"]
    steady = telling_sensitivities(ad.system(small_problem().machine), 200.0)
    assert [s.speed for s in steady] == [0.0, 200.0]  # it rises to the end


@pytest.mark.parametrize("hertz", [2e3, 60e3])
def test_slow_plateaus_are_seen_whatever_the_highest_frequency(hertz: float) -> None:
    """Little stiffness and much damping: the sensitivity is highest from rest to a few tenths of a hertz."""
    kp, machine = 2150.0, small_problem().machine
    machine = ad.replace(machine, {"controller.kp": kp, "controller.ki": 0.0, "controller.kd": 60.0})
    magnet, found = machine.magnets[0], ad.sensitivity(machine, 0.0, highest=2.0 * np.pi * hertz)
    slow = 1.0 / (kp * magnet.current_stiffness / magnet.negative_stiffness - 1.0)  # of what negative stiffness leaves
    assert found.stable
    assert found.worst.value == pytest.approx(slow, rel=1e-4)
    assert found.worst.frequency < 2.0 * np.pi
    assert found.frequencies[0] <= found.worst.frequency
    problem = dataclasses.replace(small_problem(), machine=machine, free={"controller.kp": (2e3, 3e4, "log")})
    case = Case(problem, None)
    seen = case.samples(case.state(np.array(list(problem.start().values()))), 100.0)["sensitivity_peak"]
    assert seen.values.max() == pytest.approx(slow, rel=1e-4)
