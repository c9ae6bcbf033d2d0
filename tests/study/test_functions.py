"""The Functions of a machine against analyses that share no path with them, and their derivatives against differences."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.errors import ModelError, SpecError
from amb_design.optimise.audit import with_pattern
from amb_design.study.catalogue import FUNCTIONS
from amb_design.transient.simulate import _equations
from checks import within, within_absolute

FREE = ["controller.kd", "magnets.bias_current", "rotor.shaft.viscous_damping", "plies[1].angle"]
SPEED = 700.0


@pytest.fixture(scope="module")
def machine() -> ad.Machine:
    return ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 6})


@pytest.fixture(scope="module")
def loop(machine: ad.Machine) -> ad.ClosedLoop:
    return ad.closed_loop(machine, FREE)


@pytest.fixture(scope="module")
def p(loop: ad.ClosedLoop) -> np.ndarray:
    return loop.vector() * np.array([1.1, 0.95, 1.2, 0.9])


def slopes(function: ca.Function, *point: np.ndarray) -> None:
    """Jacobians with respect to all inputs, forward and reverse, against central differences."""
    inputs = [ca.MX.sym(n, *function.size_in(n)) for n in function.name_in()]
    out = function(*inputs)
    for k, (x, value) in enumerate(zip(inputs, point, strict=True)):
        exact = ca.Function("j", inputs, [ca.jacobian(out, x)])(*point).full()
        for j in range(len(value)):
            step = np.zeros(len(value))
            step[j] = 2e-4 * max(abs(value[j]), 1e-6)
            ends = [function(*point[:k], value + s * step, *point[k + 1 :]).full()[:, 0] for s in (1.0, -1.0)]
            difference = (ends[0] - ends[1]) / (2.0 * step[j])
            scale = np.abs(difference).max() + 1e-9 * np.abs(ends[0]).max() / step[j]
            within_absolute(
                exact[:, j] / scale, difference / scale, 2e-3, f"{function.name()} to {function.name_in(k)}[{j}]"
            )
        seed = np.random.default_rng(k).standard_normal(exact.shape[1])
        row = np.random.default_rng(k).standard_normal(exact.shape[0])
        forward = ca.Function("f", inputs, [ca.jtimes(out, x, seed)])(*point).full()[:, 0]
        reverse = ca.Function("r", inputs, [ca.jtimes(out, x, row, True)])(*point).full()[:, 0]
        np.testing.assert_allclose(forward, exact @ seed, rtol=1e-10, atol=1e-12 * np.abs(exact @ seed).max())
        np.testing.assert_allclose(reverse, row @ exact, rtol=1e-10, atol=1e-12 * np.abs(row @ exact).max())


def test_growth_rates(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    speeds = np.array([0.0, SPEED])
    expected = [np.sort(np.linalg.eigvals(ad.system(loop.machine_at(p)).matrix(s)).real)[::-1][:4] for s in speeds]
    within(loop.growth_rates(p, speeds).full()[:, 0], np.concatenate(expected), 1e-7, "real parts")
    assert float(loop.damping_function(p, SPEED)) == pytest.approx(expected[1][0], rel=1e-7)
    slopes(loop.function("growth_rates", speeds=2, modes=4), p, np.array([100.0, SPEED]))


def test_smooth_damping_lies_above_and_comes_near(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    sharp, count = float(loop.damping_function(p, SPEED)), ad.system(loop.machine_at(p)).size
    values = [float(loop.damping_function(p, SPEED, smooth=s)) for s in (1.0, 0.1, 0.001)]
    assert values[0] > values[1] > values[2] >= sharp
    for smooth, value in zip((1.0, 0.1, 0.001), values, strict=True):
        assert value <= sharp + smooth * np.log(count)
    slopes(loop.function("growth_rates", smooth=1.0), p, np.array([SPEED]))


def test_damping_ratios(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    values = np.linalg.eigvals(ad.system(loop.machine_at(p)).matrix(SPEED))
    inside = values[(np.abs(values.imag) > 6.0) & (np.abs(values.imag) < 3000.0)]
    expected = np.sort(-inside.real / np.abs(inside))[:3]
    within(loop.damping_ratios(p, SPEED, 3, (6.0, 3000.0)).full()[:, 0], expected, 1e-7, "damping ratios")
    slopes(loop.function("damping_ratios", modes=3, window=(6.0, 3000.0)), p, np.array([SPEED]))


def test_sensitivity_peaks(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    expected = [peak.value for peak in ad.sensitivity(loop.machine_at(p), SPEED).peaks]
    within(loop.sensitivity_peaks(p, SPEED).full().reshape(2, 4)[:, 0], expected, 1e-6, "peaks")
    slopes(loop.function("sensitivity_peaks", peaks=2), p, np.array([SPEED]))


def test_unbalance(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    patterns = [(2e-5, 2e-5, 2e-5), (2e-5, 0.0, -2e-5)]
    for k, pattern in enumerate(patterns):
        response = ad.unbalance_response(with_pattern(loop.machine_at(p), pattern), [SPEED])
        found = loop.unbalance(p, SPEED, patterns).full()[2 * k : 2 * k + 2, 0]
        within(found, response.peak_currents[0], 1e-7, "currents")
    options = {"unbalance": tuple(tuple(map(complex, row)) for row in patterns), "quantity": "control_current_ratio"}
    slopes(loop.function("unbalance", **options), p, np.array([SPEED]))
    own = loop.unbalance(p, SPEED, peaks=2).full()[:, 0]
    grid = np.linspace(1.0, SPEED, 3000)
    swept = ad.unbalance_response(loop.machine_at(p), grid).peak_currents.max(axis=0)
    within(own.reshape(2, 3).max(axis=1), swept, 1e-3, "highest currents")


def test_stability_limit(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    limit = ad.stability_limit(loop.machine_at(p))
    assert float(loop.stability_limit(p)) == limit.speed
    x = ca.MX.sym("x", loop.np)
    gradient = ca.Function("g", [x], [ca.jacobian(loop.stability_limit(x), x)])(p).full()[0]
    exact = ad.stability_gradient(loop.machine_at(p), limit.mode, FREE)
    within(gradient, list(exact.values()), 1e-6, "gradient of the limit")
    assert float(loop.stability_limit(p, 100.0)) == 100.0
    assert float(loop.stability_limit(loop.vector({"controller.kd": 0.9}))) == 0.0


def test_second_derivatives(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    x = ca.MX.sym("x", loop.np)
    hessian = ca.Function("h", [x], [ca.hessian(loop.damping_function(x, SPEED), x)[0]])(p).full()
    first = ca.Function("g", [x], [ca.jacobian(loop.damping_function(x, SPEED), x)])
    for j in range(loop.np):
        step = np.zeros(loop.np)
        step[j] = 1e-4 * p[j]
        ends = [first(p + s * step).full()[0] for s in (1.0, -1.0)]
        difference = (ends[0] - ends[1]) / (2.0 * step[j])
        scale = np.abs(hessian * np.outer(p, p)).max() / p[j]
        within_absolute(hessian[j] * p / scale, difference * p / scale, 1e-2, f"row {j}")


def test_reduced_is_near(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    full, few = (float(x.damping_function(p, SPEED)) for x in (loop, loop.reduced(12)))
    assert 0.0 < abs(few / full - 1.0) < 0.05


def test_motion_linearised_is_the_pencil(loop: ad.ClosedLoop, p: np.ndarray) -> None:
    rhs = loop.function("rhs")
    x = ca.MX.sym("x", rhs.size1_in("x"))
    slope = ca.Function("j", [x], [ca.jacobian(rhs(p, x, SPEED, 0.0, 0.0)[0], x)])(0.0).full()
    real = ad.system(loop.machine_at(p), complex_form=False)
    found, expected = (np.sort_complex(np.linalg.eigvals(m)) for m in (slope, real.matrix(SPEED)))
    near = np.abs(found[:, None] - expected).min(axis=1) / np.abs(expected).max()
    within_absolute(near, np.zeros(len(near)), 1e-9, "eigenvalues")


@pytest.mark.parametrize("modes", [None, 6])
def test_motion_is_that_of_the_simulation(loop: ad.ClosedLoop, modes: int | None) -> None:
    machine = ad.replace(loop.machine, {"operation.gravity": 9.8})
    here = ad.closed_loop(machine, FREE)
    rhs, loads = here.function("rhs", modes=modes), here.function("loads", modes=modes)
    equations = _equations(machine, modes, (), None, False, None, True)
    basis, rng = equations.plant.basis, np.random.default_rng(1)
    n = equations.plant.size
    xi = np.concatenate([1e-7 * rng.standard_normal(n), 1e-5 * rng.standard_normal(n)])
    blocks = ad.system(machine, complex_form=False).plant.blocks
    names = [name for block in blocks for name in block.law.states]
    order = np.argsort([name.startswith("amplifier") for name in names], kind="stable")  # the simulation has them last
    c = 1e-5 * rng.standard_normal(len(names))
    speed, acceleration, angle = 300.0, 40.0, 0.4
    cos, sin = np.cos(angle), np.sin(angle)
    signals = [speed**2 * cos + acceleration * sin, speed**2 * sin - acceleration * cos, 1.0, 0.0, 0.0]
    expected = equations.rhs(np.concatenate([xi, c[order]]), signals, speed, acceleration, 0.0)[0].full()[:, 0]
    pull = loads(here.vector(), angle, speed, acceleration)
    turn = np.eye(n) if modes else basis  # from modal to nodal coordinates where all are kept
    state = np.concatenate([turn @ xi[:n], turn @ xi[n:], c])
    found = rhs(here.vector(), state, speed, acceleration, pull[0] + pull[1])[0].full()[:, 0]
    wanted = np.concatenate([turn @ expected[:n], turn @ expected[n : 2 * n], expected[2 * n :][np.argsort(order)]])
    for part in (slice(0, n), slice(n, 2 * n), slice(2 * n, None)):
        scale = np.abs(wanted[part]).max()
        within_absolute(found[part] / scale, wanted[part] / scale, 1e-7, "rates")


def test_magnet_force(loop: ad.ClosedLoop) -> None:
    force = loop.function("magnet_force")(loop.vector(), np.full((2, 2), 0.3), np.full((2, 2), 1e-4)).full()
    m = loop.machine.magnets[0]
    strength = 4e-7 * np.pi * m.turns**2 * m.pole_area * np.cos(m.half_angle) / 4.0
    i0, g0 = m.bias_current, m.gap
    expected = strength * (((i0 + 0.3) / (g0 - 1e-4)) ** 2 - ((i0 - 0.3) / (g0 + 1e-4)) ** 2)
    within(force, np.full((2, 2), expected), 1e-12, "force")


def test_open_loop_has_no_controllers(machine: ad.Machine) -> None:
    loop = ad.open_loop(machine, ["magnets.bias_current"])
    assert loop.function("controller").size1_in("state") == 0
    # stiff bearings carry: without controllers nothing is unstable at rest
    assert float(loop.damping_function(loop.vector(), 0.0)) < 0.0
    assert float(loop.stability_limit(loop.vector())) == ad.stability_limit(_without_control(machine)).speed


def _without_control(machine: ad.Machine) -> ad.Machine:
    return ad.replace(machine, {"controller": None})


def test_every_function_is_described(loop: ad.ClosedLoop) -> None:
    options = {"unbalance": {"unbalance": ((1e-5, 0.0, 0.0),)}}
    for name in FUNCTIONS:
        text = str(loop.describe(name, **options.get(name, {})))
        assert text.startswith(f"{name}: ")
    assert "in  speed 1 x 1 [rad/s]: spin speeds" in text or "out speed" in text
    first = loop.parameters[1]
    assert (first.unit, first.meaning, first.nominal, first.lower) == ("A", "bias current i0", 0.75, 0.0)
    assert len(loop.controller_states) == loop.function("controller").size1_in("state")


def test_vectors_know_their_names(machine: ad.Machine) -> None:
    loop = ad.closed_loop(machine, {"controller.kd": (1e-3, 0.2, "log"), "controller.kp": (0.1, 3.0)})
    assert (loop.lower, loop.upper) == ([1e-3, 0.1], [0.2, 3.0])
    p = loop.vector({"controller.kp": 0.5})
    assert loop.values(p) == {"controller.kd": 0.03, "controller.kp": 0.5}
    assert loop.machine_at(p).controller.kp == 0.5
    assert loop.vector({"controller.kp": ca.MX.sym("kp")}).shape == (2, 1)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda loop: loop.vector({"controller.kq": 1.0}), "controller.kq is no parameter here; did you mean"),
        (lambda loop: loop.function("growth"), "there is no Function 'growth'; choose one of M, "),
        (lambda loop: loop.function("A0", modes=3), "the Function 'A0' has no such option: modes"),
        (lambda loop: loop.function("damping_ratios", window=1, n=2), "no such option"),
        (lambda loop: loop.damping_function(ca.MX.sym("p", 1, 4), 1.0), "a column of 4 parameters is expected"),
        (lambda loop: loop.damping_function(ca.SX.sym("p", 4), 1.0), "not SX"),
        (lambda loop: loop.damping_function([1.0], 1.0), "p has 1 entries; 4 parameters are expected: controller.kd"),
        (lambda loop: loop.damping_function(loop.vector(), 1.0, smooth=0.0), "must be positive"),
        (lambda loop: loop.unbalance(loop.vector(), 1.0, [(1.0, 2.0)]), "one value [kg m] for each of 3 disks"),
        (lambda loop: loop.unbalance(loop.vector(), 1.0, quantity="noise"), "unbalance drives no 'noise'"),
        (lambda loop: loop.growth_rates(loop.vector(), 1.0, 99), "not between 1 and"),
    ],
)
def test_mistakes_are_named(loop: ad.ClosedLoop, call, message: str) -> None:
    with pytest.raises(ModelError) as caught:
        call(loop)
    assert message in str(caught.value)


def test_free_mistakes_are_named(machine: ad.Machine) -> None:
    with pytest.raises(ModelError, match="shares its node with a shaft end"):
        ad.closed_loop(machine, ["magnets[0].position"])
    with pytest.raises(SpecError, match=r"free.controller.kd = .* has its bounds the wrong way round"):
        ad.closed_loop(machine, {"controller.kd": (1.0, 0.1)})
    with pytest.raises(SpecError, match="must be a list of paths"):
        ad.closed_loop(machine, "controller.kd")
