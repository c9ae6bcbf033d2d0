"""Other people's optimisers around our Functions arrive where a dense scan arrives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.errors import ModelError
from amb_design.interop.openmdao import component
from amb_design.interop.scipy import callables

BOUNDS = {"controller.kd": (0.005, 0.06), "controller.low_pass.damping": (0.4, 1.2)}
SPEED = 600.0
SCALE = np.array([0.03, 1.0])


@pytest.fixture(scope="module")
def loop() -> ad.ClosedLoop:
    return ad.closed_loop(ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 4}), BOUNDS)


@pytest.fixture(scope="module")
def best(loop: ad.ClosedLoop) -> float:
    """Largest stability limit of a scan [rad/s], without any derivative."""
    scan = [
        ad.stability_limit(loop.machine_at([kd, zeta]), first_only=True).speed
        for kd in np.linspace(0.02, 0.06, 9)
        for zeta in (0.4, 0.8, 1.2)
    ]
    return max(scan)


@pytest.fixture(scope="module")
def stable(loop: ad.ClosedLoop) -> ca.Function:
    """Real parts over the range of speeds: smooth conditions in the place of a limit with kinks."""
    x, level = ca.MX.sym("x", 2), ca.MX.sym("level")
    rates = loop.growth_rates(x * SCALE, 1e3 * level * np.linspace(0.1, 1.0, 7), modes=3)
    return ca.Function("stable", [x, level], [rates / 10.0], ["x", "level"], ["rates"])


def test_scipy_maximises_the_limit(loop: ad.ClosedLoop, stable: ca.Function, best: float) -> None:
    from scipy.optimize import minimize

    z = ca.MX.sym("z", 3)
    whole = ca.Function("whole", [z], [stable(z[:2], z[2])], ["z"], ["rates"])
    fun, jac = callables(whole, by="z")
    low, high = np.array(loop.lower) / SCALE, np.array(loop.upper) / SCALE
    found = minimize(
        lambda z: -z[2],
        [*(loop.vector() / SCALE), 0.5],
        jac=lambda z: np.array([0.0, 0.0, -1.0]),
        bounds=[*zip(low, high, strict=True), (0.1, 3.0)],
        constraints={"type": "ineq", "fun": lambda z: -fun(z), "jac": lambda z: -jac(z)},
        method="SLSQP",
    )
    limit = ad.stability_limit(loop.machine_at(found.x[:2] * SCALE), first_only=True)
    assert limit.speed >= best * (1.0 - 1e-6)
    assert 1e3 * found.x[2] == pytest.approx(limit.speed, rel=1e-5)


def test_scipy_takes_vectors_as_constraints(loop: ad.ClosedLoop) -> None:
    fun, jac = callables(loop.function("damping_ratios", modes=3), speed=SPEED)
    assert fun(loop.vector()).shape == (3,)
    assert jac(loop.vector()).shape == (3, 2)
    with pytest.raises(ModelError, match="give a value for speed"):
        callables(loop.function("growth_rates"))
    with pytest.raises(ModelError, match="there is no velocity"):
        callables(loop.function("growth_rates"), speed=1.0, velocity=1.0)


@pytest.mark.filterwarnings("ignore")
def test_openmdao_partials_and_optimum(
    loop: ad.ClosedLoop, stable: ca.Function, best: float, tmp_path, monkeypatch
) -> None:
    om = pytest.importorskip("openmdao.api", reason="OpenMDAO is not installed")
    monkeypatch.chdir(tmp_path)  # it writes reports
    problem = om.Problem(reports=False)
    problem.model.add_subsystem(
        "stable", component(stable, {"x": loop.vector() / SCALE, "level": [0.5]}), promotes=["*"]
    )
    problem.model.add_subsystem("speed", om.ExecComp("speed = 1000 * level"), promotes=["*"])
    problem.model.add_design_var("x", lower=np.array(loop.lower) / SCALE, upper=np.array(loop.upper) / SCALE)
    problem.model.add_design_var("level", lower=0.1, upper=3.0)
    problem.model.add_objective("speed", ref=-1e3)
    problem.model.add_constraint("rates", upper=0.0)
    problem.model.set_input_defaults("level", 0.5)
    problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", disp=False, maxiter=100)
    problem.setup()
    problem.run_model()
    checked = problem.check_partials(out_stream=None, form="central", step=1e-5, step_calc="rel_avg")
    for pair in checked["stable"].values():
        exact, difference = pair["J_fwd"], pair["J_fd"]
        assert np.abs(exact - difference).max() <= 1e-4 * np.abs(exact).max()
    problem.run_driver()
    found = loop.machine_at(problem.get_val("x") * SCALE)
    assert ad.stability_limit(found, first_only=True).speed >= best * (1.0 - 1e-6)
    assert float(problem.get_val("speed")[0]) >= best * (1.0 - 1e-6)
