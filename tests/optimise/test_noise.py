"""Noise currents: against the integral over the frequency, between the two forms of the model, and as limits of a design."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad_vec

import amb_design as ad
from amb_design.analysis.frequency import Loops
from amb_design.analysis.system import System, system
from amb_design.optimise.evaluation import Case
from amb_design.optimise.measures.noise import LEAST
from checks import within
from independent.everything import isotropic_machine
from optimise.rigs import everything

NOISE = 3e-9


def with_chain(machine: ad.Machine, **changes: object) -> ad.Machine:
    """All magnets with the machine's common controller, changed."""
    controller = ad.replace(machine.controller, changes)
    magnets = tuple(ad.replace(m, {"controller": None, "controller_z": None}) for m in machine.magnets)
    return ad.replace(machine, {"controller": controller, "controller_z": None, "magnets": magnets})


def ideal_derivative(machine: ad.Machine) -> ad.Machine:
    """The noise's own rate enters the controller, and only the amplifier filters it."""
    return with_chain(machine, low_pass=None, derivative_time=0.0, kp=1.5, kd=8e-4, sensor_gain=4000.0, notches=())


def integral(loop: System, speed: float) -> np.ndarray:
    """Rms currents from the frequency response, closed among the sensors and solved without eigenvalues."""
    loops = Loops(loop.plant)

    def density(w: float) -> np.ndarray:
        point = loops.at(w, speed)
        return np.sum(np.abs(point.controller @ point.sensitivity) ** 2, axis=1)

    modes = np.linalg.eigvals(loop.matrix(speed))
    modes = modes[np.abs(modes) < 3e4]
    near = [modes.imag + k * modes.real for k in (-3.0, 0.0, 3.0)]
    spread = np.geomspace(1.0, 1e6, 13)
    points = np.unique(
        np.concatenate([*near, *[-1.1 * x for x in near], spread, -1.1 * spread])
    )  # none at zero, a pole
    inside, _ = quad_vec(density, points[0], points[-1], points=points[1:-1], epsrel=1e-5, limit=4000)
    tail, _ = quad_vec(lambda t: (density(1.0 / t) + density(-1.1 / t) * 1.1) / t**2, 0.0, 1e-6, epsrel=1e-5)
    return np.asarray(NOISE * np.sqrt((inside + tail) / (4.0 * math.pi)))


@pytest.mark.parametrize(
    ("name", "machine"),
    [
        ("cross gain that follows the speed", with_chain(isotropic_machine(), kc=0.4, kc_rate=-3e-4)),
        ("ideal derivative", ideal_derivative(isotropic_machine())),
        ("low-pass alone", with_chain(isotropic_machine(), amplifier=None, delay=0.0)),
    ],
)
def test_integral_over_the_frequency(name: str, machine: ad.Machine) -> None:
    loop = system(ad.replace(machine, {"rotor.shaft.elements": 3}))
    within(ad.noise_current(loop, NOISE, 500.0), integral(loop, 500.0), 1e-7, name)


def test_both_forms_and_both_ways() -> None:
    """The complex form, the real form, and the search's sum over pairs of modes."""
    for machine in (isotropic_machine(), ideal_derivative(isotropic_machine())):
        compact, real = (system(machine, complex_form=form) for form in (True, False))
        assert compact.size * 2 == real.size
        for speed in (0.0, 600.0):
            alone, pairs = ad.noise_current(compact, NOISE, speed), ad.noise_current(real, NOISE, speed)
            within(pairs, np.repeat(alone, 2), 1e-8, f"real form, {speed:g} rad/s")
        case = Case(problem(machine), None)
        state = case.state(np.array(list(case.problem.start().values())))
        samples = case.samples(state, 600.0, checked=np.array([0.0, 1.0]))["noise_current"]
        both = np.stack([ad.noise_current(compact, NOISE, s) for s in (0.0, 600.0)], axis=1)
        within(samples.values, both.ravel(), 1e-8, "sum over pairs of modes")


def problem(machine: ad.Machine, limit: float = 1e-9, **changes: object) -> ad.DesignProblem:
    free = {
        "controller.kp": (0.5, 4.0),
        "controller.kd": (1e-4, 3e-3),
        "disks[1].outer_diameter": (0.2, 0.3),
        "magnets[0].gap": (4e-4, 6e-4),
    }
    given = {"maximise": "stability_limit", "limits": {"noise_current": {"limit": limit, "noise": NOISE}}, "free": free}
    return ad.DesignProblem(machine, **{**given, **changes})


def test_derivatives_where_the_rate_of_the_noise_enters() -> None:
    """With a low-pass it does not; test_slopes.py has that case with every kind of number."""
    case = Case(problem(ideal_derivative(everything())), None)
    p, end, at = np.array(list(case.problem.start().values())), 700.0, np.array([0.4, 1.0])
    ranges = np.array([v.upper - v.lower for v in case.problem.variables])
    assert case.state(p).ports[1].any()

    def values(step: np.ndarray, longer: float) -> np.ndarray:
        return case.noise.samples(case.state(p + step), at, end + longer)["noise_current"].values

    def differences(step: np.ndarray, longer: float) -> np.ndarray:
        f = {k: values(k * step, k * longer) for k in (-2, -1, 1, 2)}
        return (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / 12.0

    found = case.noise.samples(case.state(p), at, end)["noise_current"]
    largest = np.abs(found.slopes * ranges).max(axis=1)
    for k, v in enumerate(case.problem.variables):
        step = 1e-3 * ranges * (np.arange(len(p)) == k)
        error = np.abs(differences(step, 0.0) / 1e-3 - found.slopes[:, k] * ranges[k]) / largest
        print(f"{v.name}: {error.max():.1e}")
        assert error.max() < 1e-6
    error = np.abs(differences(0.0 * p, 1e-3 * end) / 1e-3 - found.rates * end) / np.abs(found.rates * end).max()
    print(f"end of the range: {error.max():.1e}")
    assert error.max() < 1e-6


def test_a_law_that_couples_all_magnets() -> None:
    """An observer's gains follow its weights and the speed; noise of each sensor reaches every magnet."""
    machine = ad.load("composite-spindle")
    hardware = {name: getattr(machine.controller, name) for name in ("sensor_gain", "low_pass", "amplifier", "delay")}
    law = ad.LQG(
        **hardware, modes=6, current=1.0, force_noise=1.0, current_noise=1e-3, scheduled=True, design_speed=2000.0
    )
    machine = ad.replace(machine, {"controller": law, "rotor.shaft.elements": 6})
    case = Case(problem(machine, free={"controller.current": (0.5, 2.0), "magnets.gap": (4.5e-4, 5.5e-4)}), None)
    p, at, end = np.array(list(case.problem.start().values())), np.array([0.0, 1.0]), 1500.0
    found = case.noise.samples(case.state(p), at, end)["noise_current"]
    for form, times in ((True, 1), (False, 2)):
        loop = system(machine, complex_form=form)
        both = [ad.noise_current(loop, NOISE, s) for s in at * end]
        within(np.stack(both, axis=1).ravel(), np.tile(found.values, times), 1e-8, f"{times} planes")
    for k, v in enumerate(case.problem.variables):
        step = 1e-4 * (v.upper - v.lower) * (np.arange(len(p)) == k)
        f = {i: case.noise.samples(case.state(p + i * step), at, end)["noise_current"].values for i in (-2, -1, 1, 2)}
        within(found.slopes @ step, (8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / 12.0, 1e-6, v.name)


def test_an_unstable_loop_is_told_the_way_back() -> None:
    """Through the stability limit the search sees a value without a jump, that rises with the instability."""
    machine = ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 6})
    limit = ad.stability_limit(machine).speed
    case = Case(problem(machine, free={"controller.kd": (0.01, 0.1)}), None)
    state = case.state(np.array(list(case.problem.start().values())))
    fractions = np.array([0.9, 0.999, 1.0, 1.001, 1.1, 1.5])
    stability = case.samples(state, limit, fractions)["stability"]
    damping = np.array([stability.values[stability.speeds == f * limit].min() for f in fractions])
    assert damping[1] > 0.0 > damping[3]
    found = case.noise.samples(state, fractions, limit)["noise_current"]
    loops = found.values.reshape(-1, len(fractions))
    assert (np.diff(loops[:, 1:], axis=1) > 0.0).all()
    assert (found.rates.reshape(loops.shape)[:, 1:] > 0.0).all()
    step = case.noise.samples(state, np.array([1.0 - 1e-7, 1.0 + 1e-7]), limit)["noise_current"].values.reshape(-1, 2)
    within(step[:, 1], step[:, 0], 1e-4, "step at the limit")
    calm = damping > LEAST
    assert calm.any()
    for f, seen in zip(fractions[calm], loops[:, calm].T, strict=True):
        within(seen, ad.noise_current(machine, NOISE, f * limit), 1e-8, "stable loop")
    assert np.isinf(ad.noise_current(machine, NOISE, 1.001 * limit)).all()


def test_noise_that_nothing_filters_is_refused() -> None:
    bare = with_chain(isotropic_machine(), low_pass=None, amplifier=None)
    with pytest.raises(
        ad.ModelError, match=r"infinite control current at magnets\[0\].*give the controller a low_pass"
    ):
        Case(problem(bare), None)
    with pytest.raises(ad.ModelError, match="infinite control current"):
        ad.noise_current(bare, NOISE)
    passive = ad.replace(ad.load("jeffcott"), {"magnets": ()})
    with pytest.raises(ad.ModelError, match="no control loop"):
        ad.noise_current(passive, NOISE)


FREE = {"kp": (0.1, 3.0, "log"), "kd": (1e-3, 0.1, "log"), "low_pass.frequency": (1000.0, 12000.0, "log")}


def test_a_design_within_the_limit() -> None:
    """More speed takes more derivative gain, and that more current from noise: the limit binds, and is worth its price."""
    machine = ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 6})
    limits = {"damping_ratio": {"limit": 0.002, "window": (6.0, 2e4)}, "noise_current": {"limit": 0.02, "noise": 2e-9}}
    ends = []
    for bound in (0.02, 0.01):
        limits["noise_current"] = {"limit": bound, "noise": 2e-9}
        design = ad.solve(ad.DesignProblem(machine, maximise="stability_limit", free=FREE, limits=limits), starts=1)
        assert design.status == "verified optimum"
        row = next(r for r in design.limits if r.quantity == "noise_current")
        assert row.active
        assert row.worth > 0.1
        assert 0.998 * bound < row.value <= bound * (1.0 + 1e-6)
        for speed in np.linspace(0.0, design.end, 7):
            assert ad.noise_current(design.machine, 2e-9, speed).max() <= bound * (1.0 + 1e-6)
        ends.append(design.end)
    assert ends[1] < 0.9 * ends[0]


def test_the_least_noise() -> None:
    machine = ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 6})
    design = ad.solve(
        ad.DesignProblem(
            machine,
            minimise={"quantity": "noise_current", "noise": 2e-9},
            speed=ad.rpm(8000.0),
            free=FREE,
            limits={"damping_ratio": {"limit": 0.002, "window": (6.0, 2e4)}},
        ),
        starts=1,
    )
    assert design.status == "verified optimum"
    assert design.objective < 0.3 * ad.noise_current(machine, 2e-9).max()
    assert ad.stability_limit(design.machine).speed > ad.rpm(8000.0)
