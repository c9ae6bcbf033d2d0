"""Every type of law in motion: what couples axes, what follows the speed, what is ideal, continuous and sampled."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sla

import amb_design as ad
from amb_design.analysis.sampled import discretised
from amb_design.analysis.system import dense
from amb_design.analysis.unbalance import unbalance_forces
from amb_design.synthesis.design import synthesise
from amb_design.transient.equations import WORKS
from amb_design.transient.loads import Spin
from amb_design.transient.plant import plant_of
from amb_design.transient.sampled import difference_equations
from checks import within, within_absolute
from synthesis.levitated import laws, lqg, lqr, small, uneven

LAWS = laws()
FOLLOWING = ("PID with cross gain that follows the speed", "cross and rates", "LQG, scheduled", "LQR, scheduled")


def slowest(machine: ad.Machine, speed: float) -> float:
    return float(np.linalg.eigvals(ad.system(machine).matrix(speed)).real.max())


def settled(machine: ad.Machine, speed: float) -> ad.Transient:
    """Linear motion at constant speed, in closed form, until nothing is left of how it began."""
    time = 20.0 / -slowest(machine, speed)
    return ad.simulate(machine, time, speed=speed, step=time / 8.0, linear=True, gravity=False)


def unbalance(machine: ad.Machine, speed: float, **options: Any) -> None:
    """Small motion with the force law, on the orbit that the linear motion has come to."""
    turn = 2.0 * math.pi / speed
    run = {"speed": speed, "step": turn / 32.0, "gravity": False, "start": settled(machine, speed).final} | options
    found, expected = ad.simulate(machine, 3.0 * turn, **run), ad.unbalance_response(machine, [speed])
    wave = np.exp(-1j * found.angles[-64:]) / 32.0
    for x in (0.08, 0.24):
        steady = expected.at(x)[0]
        within_absolute(
            wave @ found.at(x)[-64:] / np.abs(steady).max(), steady / np.abs(steady).max(), 1e-3, f"x = {x:g} m"
        )
    currents = np.tensordot(wave, found.currents[-64:], 1) / np.abs(expected.currents).max()
    within_absolute(currents, expected.currents[0] / np.abs(expected.currents).max(), 1e-3, "currents")


@pytest.mark.parametrize("name", LAWS)
def test_amplitude_and_phase_are_those_of_the_unbalance_response(name: str) -> None:
    machine = small(LAWS[name])
    end = min(ad.stability_limit(machine).speed, 1000.0)
    for part in (0.3, 0.9):
        unbalance(machine, part * end)


@pytest.mark.parametrize("kind", ["uneven", "axes of their own", "pinned", "axes of their own, LQR", "pinned, LQR"])
def test_other_machines(kind: str) -> None:
    law = lqr() if "LQR" in kind else lqg(scheduled=True)
    machine = small(law)
    if kind == "uneven":
        machine = uneven(law, base=small)
    elif kind.startswith("axes"):
        machine = ad.replace(machine, {"magnets[0].axes_angle": 0.8, "magnets[1].axes_angle": -0.3})
    else:
        machine = dataclasses.replace(machine, pins=(ad.Pin(position=0.3),))
    unbalance(machine, 300.0)


def exponents(result: ad.Transient, precision: float) -> np.ndarray:
    """Exponents of the modes in equidistant outputs of free motion, by shift invariance."""
    step = result.times[1] - result.times[0]
    signals = np.hstack([result.at(x) for x in (0.05, 0.08, 0.17, 0.24)])
    length = len(signals) // 2
    stacked = np.hstack([np.lib.stride_tricks.sliding_window_view(s, length).T for s in signals.T])
    left, sizes, _ = np.linalg.svd(stacked / np.abs(stacked).max(), full_matrices=False)
    left = left[:, sizes > precision * sizes[0]]
    return (
        np.asarray(np.log(np.linalg.eigvals(np.linalg.lstsq(left[:-1], left[1:], rcond=None)[0]).astype(complex)))
        / step
    )


def nearest(found: np.ndarray, wanted: complex) -> complex:
    return complex(found[np.argmin(np.minimum(np.abs(found - wanted), np.abs(found - np.conj(wanted))))])


@pytest.mark.parametrize("name", LAWS)
def test_growth_next_to_the_stability_limit_is_that_of_the_eigenvalue(name: str) -> None:
    machine = ad.replace(small(LAWS[name]), {"rotor.disks.unbalance": 0.0})
    limit = ad.stability_limit(machine, 2e4)
    assert limit.status == "limit found"
    for factor in (0.99, 1.01):
        speed = factor * limit.speed
        values = np.linalg.eigvals(ad.system(machine).matrix(speed))
        expected = values[np.argmin(np.abs(values - limit.mode.signed))]
        assert (expected.real > 0.0) == (factor > 1.0)
        time = max(0.05, 4.0 * math.pi / max(abs(limit.mode.signed.imag), 40.0))
        run: dict[str, Any] = {"speed": speed, "gravity": False, "step": time / 500.0}
        blow = ad.Impulse(position=0.2, y=1e-6)
        before = ad.simulate(machine, 0.1, linear=True, disturbances=[blow], **run)  # quick modes die out
        result = ad.simulate(machine, time, start=before.final, **run)
        found = nearest(exponents(result, 1e-6), expected)
        print(f"{factor} of {limit.speed:.1f} rad/s: {found.real:.5f} 1/s, eigenvalue {expected.real:.5f} 1/s")
        within(found.real, expected.real, 5e-3, "growth rate")


@pytest.mark.parametrize("method", ["tustin", "hold"])
@pytest.mark.parametrize("name", LAWS)
def test_sampled_motion_grows_as_its_multiplier_says(name: str, method: str) -> None:
    machine = ad.replace(small(LAWS[name]), {"rotor.disks.unbalance": 0.0})
    sampling = ad.Sampling(period=4e-4, delay=3e-4, method=method)
    speed = 200.0
    seen = ad.sampled_stability(machine, sampling, [speed])
    run: dict[str, Any] = {"speed": speed, "gravity": False, "step": sampling.period, "sampling": sampling}
    blow = ad.Impulse(position=0.2, y=1e-7)
    time = sampling.period * round(min(max(0.04, 2.0 / abs(seen.growth[0])), 0.16) / sampling.period)
    result = ad.simulate(machine, time, linear=True, disturbances=[blow], **run)
    found = nearest(exponents(result, 1e-10), seen.growth[0] + 1j * seen.frequencies[0])
    within(found.real, seen.growth[0], 5e-3, "growth rate")


def rotor_in_theory(machine: ad.Machine, times: np.ndarray, speeds: tuple[float, float]) -> np.ndarray:
    """Displacements at a place in a run-up from the centre, from the matrices of the linear analyses, midpoint by midpoint."""
    loop = ad.system(machine)
    rotor, n, step = loop.plant, loop.displacements, times[1]
    to, back = loop.to_state, loop.from_rate
    push = back[:, n : 2 * n] @ unbalance_forces(loop)
    moment = back[:, n : 2 * n] @ dense(rotor.C1) @ to[:n]
    rate = (speeds[1] - speeds[0]) / times[-1]
    z, found = np.zeros(len(to), complex), [np.zeros(n, complex)]
    for t in times[:-1]:
        angle, middle = (speeds[0] + 0.5 * rate * t) * t, speeds[0] + rate * (t + step / 2.0)
        whole = np.zeros((len(z) + 1,) * 2, complex)
        whole[:-1, :-1] = loop.matrix(middle) - rate * moment
        whole[:-1, -1] = push * (middle**2 - 1j * rate)
        whole[-1, -1] = 1j * middle
        z = (sla.expm(step * whole) @ np.append(z, np.exp(1j * angle)))[:-1]
        found.append(to[:n] @ z)
    return np.array(found)[:, 2 * rotor.mesh.node_of("magnets[1].position")]


def frozen(machine: ad.Machine) -> ad.Machine:
    """With the law at rest, whatever the speed."""
    designed = synthesise(machine)
    rates = {"kc_rate": 0.0, "law_rate": None, "cross_rate": None, "per_speed": None}
    own = {f.name for f in dataclasses.fields(designed.controller)}
    law = dataclasses.replace(designed.controller, **{k: v for k, v in rates.items() if k in own})
    return dataclasses.replace(designed, controller=law)


@pytest.mark.parametrize("name", FOLLOWING)
def test_a_run_up_follows_the_linear_theory(name: str) -> None:
    machine, speeds = small(LAWS[name]), (200.0, 800.0)
    times = np.linspace(0.0, 0.06, 301)
    expected, fixed = rotor_in_theory(machine, times, speeds), rotor_in_theory(frozen(machine), times, speeds)
    size = np.abs(expected).max()
    assert np.abs(fixed - expected).max() > 0.01 * size, "the law has to change noticeably"
    for linear in (True, False):
        run = {"speed": ((0.0, 0.06), speeds), "step": 2e-4, "linear": linear, "gravity": False}
        moved = ad.simulate(machine, 0.06, **run).at(0.24) @ [1.0, 1j]
        within_absolute(moved / size, expected / size, 1e-4, "motion over its peak")


@pytest.mark.parametrize("method", ["tustin", "hold"])
def test_difference_equations_follow_the_speed(method: str) -> None:
    law, spin = plant_of(small(LAWS["LQG, scheduled"]), None, (), sampled=True).law, Spin((0.0, 2.0), (0.0, 2500.0))
    sampling = ad.Sampling(period=2e-4, method=method)
    at = difference_equations(law, sampling, spin)
    for t in (0.0, 0.317, 1.05, 2.0):
        for found, expected in zip(at(t), discretised(*law.at(1250.0 * t), sampling), strict=True):
            size = max(np.abs(expected).max(), 1e-9)
            within_absolute(found / size, expected / size, 1e-11, f"matrix at {t:g} s")


@pytest.mark.parametrize("name", FOLLOWING)
def test_a_sampled_run_up_approaches_the_continuous_one(name: str) -> None:
    """Quick samples; holding takes half a period more, on average. Ideal feedback has no delay to stand for that, so zero is approached."""
    machine, period = small(LAWS[name]), 1e-5
    run: dict[str, Any] = {"speed": ((0.0, 0.012), (200.0, 2000.0)), "step": 2e-4, "modes": 8, "gravity": False}

    def sampled(**sampling: float) -> np.ndarray:
        return ad.simulate(machine, 0.012, sampling=ad.Sampling(**sampling), **run).at(0.24)

    if isinstance(machine.controller, ad.LQR):
        smooth = ad.simulate(machine, 0.012, **run).at(0.24)
        found = 2.0 * sampled(period=period / 2.0) - sampled(period=period)
    else:
        smooth = ad.simulate(ad.replace(machine, {"controller.delay": 4e-5}), 0.012, **run).at(0.24)
        found = sampled(period=period, delay=3.5e-5)
    size = np.abs(smooth).max()
    within_absolute(found / size, smooth / size, 1e-4, "motion over its peak")


LIMITED = {
    "magnets[0].link_voltage": 6.0,
    "magnets[0].clearance": 2e-4,
    "magnets[1].clearance": 1e-4,
    "magnets[1].bias_current": 0.8,
}
"""The first magnet is limited in voltage, both in current, and both touch."""


@pytest.mark.parametrize("name", FOLLOWING)
def test_collocation_agrees_with_idas_behind_every_limit(name: str) -> None:
    machine = ad.replace(small(LAWS[name]), {"rotor.disks.unbalance": 2e-4, **LIMITED})
    run: dict[str, Any] = {
        "speed": ((0.0, 0.02, 1.0), (400.0, 700.0, 1000.0)),
        "modes": 6,
        "contact": True,
        "disturbances": [ad.Force(position=0.15, y=150.0, z=-100.0, start=0.005, stop=0.01)],
        "step": 1e-4,
    }
    a, b = (
        ad.simulate(machine, 0.03, tolerance=1e-6, **run),
        ad.simulate(machine, 0.03, integrator="idas", tolerance=1e-8, **run),
    )
    limits = {"contact", "clearance", "current"} | (
        {"voltage"} if "LQR" not in name else set()
    )  # its amplifiers are ideal
    assert {s.kind for s in a.saturations} == limits
    within_absolute(a.at(0.24), b.at(0.24), 1e-8, "places [m]")
    within_absolute(a.currents, b.currents, 1e-3, "currents [A]")
    gross = sum(np.ptp(w) for w in b.works.values())
    for work in WORKS:
        within_absolute(a.works[work] / gross, b.works[work] / gross, 1e-4, f"work of {work}")
    within_absolute(a.energy_error, np.zeros(len(a.times)), 1e-4, "energy over gross work")


@pytest.mark.parametrize("name", ["LQG, scheduled", "LQR, scheduled"])
@pytest.mark.parametrize("sampled", [False, True])
def test_a_restart_goes_on_as_if_nothing_had_happened(name: str, sampled: bool) -> None:
    run: dict[str, Any] = {"speed": ((0.0, 1.0), (300.0, 2000.0)), "modes": 6, "tolerance": 1e-9, "step": 5e-4}
    if sampled:
        run["sampling"] = ad.Sampling(period=1e-4, delay=1.3e-4)
    machine = small(LAWS[name])
    whole, first = (ad.simulate(machine, t, start="levitated", **run) for t in (0.02, 0.01))
    second = ad.simulate(machine, 0.01, **(run | {"start": first.final}))
    size = np.abs(whole.at(0.24)).max()
    within_absolute(second.at(0.24) / size, whole.at(0.24)[20:] / size, 1e-6, "motion over its peak")
    other = {"sampling": None} if sampled else {"sampling": ad.Sampling(period=1e-4)}
    with pytest.raises(ad.ModelError, match="belongs to other controllers"):
        ad.simulate(machine, 0.01, **(run | {"start": first.final} | other))
