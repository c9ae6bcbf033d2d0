"""Digital controllers: multipliers against another library, the simulation and the continuous loop; the sweep over the speed."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.sampled import SampledLoop, discretised
from amb_design.analysis.sampled_limit import STEPS, _Sweep
from amb_design.analysis.system import dense, system
from amb_design.model.controller import realise
from checks import within, within_absolute
from transient.rotors import levitated, pid

FILTERED = {"low_pass": ad.LowPass(frequency=6e3), "notches": (ad.Notch(frequency=3e3),), "ki": 2e4}


@pytest.mark.parametrize(("method", "name"), [("tustin", "bilinear"), ("hold", "zoh")])
def test_the_law_as_python_control_discretises_it(method: str, name: str) -> None:
    law = realise([pid(amplifier=None, **FILTERED)])
    a, b, c, d = (dense(x.constant) for x in (law.a, law.b[:, :1], law.c, law.d[:, :1]))
    sampling = ad.Sampling(period=8e-5, method=method)
    own = control.ss(*discretised(a, b, c, d, sampling), sampling.period)
    other = control.c2d(control.ss(a, b, c, d), sampling.period, method=name)
    for w in np.geomspace(1.0, 0.99 * math.pi / sampling.period, 20):
        z = np.exp(1j * w * sampling.period)
        within(own(z), other(z), 1e-9, f"{w:.3g} rad/s")


@pytest.mark.parametrize(
    ("delay", "method", "period"),
    [(0.0, "tustin", 6e-4), (0.4, "hold", 4e-4), (1.7, "tustin", 3e-4), (2.0, "hold", 2e-4)],
)
def test_the_simulation_grows_as_the_multiplier_says(delay: float, method: str, period: float) -> None:
    """Factor from sample to sample of the whirl at a place, in size and angle, once the worst motion has outgrown the others."""
    machine = levitated(controller=pid(delay=5e-5, **FILTERED), unbalance=0.0)
    sampling = ad.Sampling(period=period, delay=delay * period, method=method)
    worst = ad.sampled_stability(machine, sampling, [700.0]).multipliers[0, :2]
    assert abs(worst[0]) > 1.01
    samples = math.ceil(math.log(1e6) / math.log(abs(worst[0] / worst[1])))
    run = ad.simulate(
        machine,
        (samples + 5) * period,
        speed=700.0,
        sampling=sampling,
        linear=True,
        gravity=False,
        step=period,
        disturbances=[ad.Impulse(position=0.3, y=1e-6)],
    )
    seen = run.at(0.05) @ [1.0, 1j]
    for k in range(1, 5):
        within(seen[-k] / seen[-k - 1], worst[0], 3e-5, f"{samples} samples")


def test_both_forms() -> None:
    sampling = ad.Sampling(period=1e-4, delay=1.3e-4)
    machine = levitated(controller=pid(kc=2e3, kc_rate=3.0, **FILTERED))
    compact, whole = (SampledLoop(machine, sampling, complex_form=form).multipliers(600.0) for form in (True, False))
    both = np.concatenate([compact, compact.conj()])
    assert len(whole) == len(both)
    distance = np.abs(whole[:, None] - both)
    within_absolute(np.maximum(distance.min(axis=0), distance.min(axis=1)), 0.0 * np.abs(both), 1e-7, "multipliers")


@pytest.mark.parametrize("coupled", [False, True])
def test_short_periods_approach_the_continuous_loop(coupled: bool) -> None:
    """Held outputs are late by half a period; beside a continuous delay of that size the error falls with the period squared."""
    common = {"low_pass": ad.LowPass(frequency=2e4), "amplifier": ad.Amplifier(bandwidth=1.5e4)}
    law = (
        ad.LQG(current=1.0, force_noise=1.0, modes=4, scheduled=True, design_speed=500.0, **common) if coupled else None
    )
    machine = levitated(controller=law or pid(kc=1e3, **FILTERED))
    designed = ad.synthesise(machine)  # delays are changed under a law that stays
    errors = []
    for period in (4e-5, 2e-5, 1e-5):
        sampling = ad.Sampling(period=period, delay=0.6 * period)
        found = ad.sampled_stability(machine, sampling, [500.0]).multipliers[0]
        late = ad.replace(designed, {"controller": ad.replace(designed.controller, {"delay": 1.1 * period})})
        exact = np.linalg.eigvals(system(late).matrix(500.0))
        exact = exact[np.abs(exact) < 2000.0]
        exponents = np.log(found[np.abs(found) > 0.1]) / period
        errors.append(np.abs(exponents[:, None] - exact).min(axis=0).max())
    print("errors [1/s]", errors)
    assert errors[2] < 0.3 * errors[1] < 0.09 * errors[0]
    assert errors[2] < 0.1


def test_the_limit_approaches_the_certified_one_and_falls_with_delay() -> None:
    machine = ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 6})
    continuous = ad.stability_limit(machine).speed
    limits = [
        ad.sampled_stability_limit(machine, ad.Sampling(period=p, delay=d * p), 1.3 * continuous)
        for p, d in ((1e-6, 0.0), (2e-5, 0.0), (2e-5, 1.0), (1e-4, 1.0))
    ]
    assert {limit.status for limit in limits} == {"limit found"}
    within(limits[0].speed, continuous, 3e-4, "period of 1 us")
    assert limits[0].speed > limits[1].speed > limits[2].speed > limits[3].speed > 0.5 * continuous
    for limit, delay in ((limits[0], 5e-7), (limits[2], 3e-5)):  # holding takes half a period more
        late = ad.stability_limit(ad.replace(machine, {"controller.delay": delay}))
        within(limit.speed, late.speed, 1e-5, f"{limit.sampling.period:g} s beside a continuous delay of {delay:g} s")
    for limit in limits:
        assert limit.bracket[0] == limit.speed
        grid = [*np.linspace(0.0, 0.99999 * limit.speed, 30), limit.bracket[1]]
        seen = ad.sampled_stability(machine, limit.sampling, grid)
        assert seen.stable.tolist() == [True] * 30 + [False]
        assert (seen.growth[:30] < 0.0).all()
        assert seen.multipliers[-1, 0] == limit.multiplier
    assert limits[3].frequency == pytest.approx(ad.stability_limit(machine).mode.frequency, rel=0.05)


def test_statuses() -> None:
    machine = levitated()
    slow = ad.sampled_stability_limit(machine, ad.Sampling(period=2e-3))
    assert (slow.status, slow.speed, slow.evaluations) == ("unstable at rest", 0.0, 1)
    assert abs(slow.multiplier) > 1.0
    quick = ad.sampled_stability_limit(machine, ad.Sampling(period=2e-5), 400.0)
    assert (quick.status, quick.speed, quick.bracket) == ("none below the top speed", 400.0, (400.0, math.inf))
    with pytest.raises(ad.ModelError, match="no controller"):
        ad.sampled_stability(ad.load("jeffcott"), ad.Sampling(period=1e-4))
    with pytest.raises(ad.ModelError, match="top_speed = 0 rad/s must be positive"):
        ad.sampled_stability_limit(machine, ad.Sampling(period=1e-4), 0.0)
    with pytest.raises(ad.SpecError, match=r"method = 'euler' is not known; choose one of tustin, hold"):
        ad.Sampling(period=1e-4, method="euler")


class Bump:
    """Two multipliers: one close to the unit circle throughout, one that leaves it in a window between two steps of the sweep."""

    def __init__(self, width: float):
        self.centre, self.width = (20.45 / STEPS), width

    def multipliers(self, speed: float) -> np.ndarray:
        bump = 0.011 / (1.0 + ((speed - self.centre) / self.width) ** 2)
        return np.array([(0.99 + bump) * np.exp(1j * speed), 0.9995])


def test_the_sweep_is_refined_where_a_multiplier_bends() -> None:
    loop = Bump(width=0.4 / STEPS)
    edge = loop.centre - loop.width * math.sqrt(0.1)
    sweep = _Sweep(loop, 1.0)  # type: ignore[arg-type]
    assert not any(sweep.unstable(s) for s in sweep.found)
    stable, unstable = sweep.first()
    assert unstable - stable <= 1e-7
    within_absolute([stable, unstable], [edge, edge], 1e-7, "edge of the window")
