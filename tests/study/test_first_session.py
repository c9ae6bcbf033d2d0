"""What a newcomer types, line after line, from a machine to an optimisation of his own; on a coarse mesh, to be quick."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import matplotlib as mpl
import numpy as np
import pytest

import amb_design as ad

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def machine() -> ad.Machine:
    return ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 4})


def test_machine_limit_and_diagram(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    machine = ad.load("problems/thesis")
    assert machine == ad.load("thesis")
    machine = ad.replace(machine, {"controller.kd": 0.03, "rotor.shaft.elements": 4})
    limit = ad.stability_limit(machine)
    assert (limit.status, limit.certified) == ("limit found", True)
    assert limit.onsets[0].speed == limit.speed == limit.mode.speed
    result = ad.campbell(machine, speeds=ad.rpm(np.linspace(0, 15000, 151)))
    assert result.speeds[-1] == pytest.approx(ad.rpm(15000))
    with mpl.rc_context({"backend": "agg"}):
        ax = ad.plots.campbell(result)
        assert len(ax.lines) > 4
        mpl.pyplot.close(ax.figure)


def test_design_and_comparison(machine: ad.Machine) -> None:
    problem = ad.DesignProblem(
        machine,
        maximise="stability_limit",
        free={"controller.kp": (0.01, 1.0), "controller.kd": (1e-4, 0.2), "magnets.bias_current": (0.2, 0.75)},
        limits={
            "sensitivity_peak": 3.0,
            "control_current_ratio": 0.5,
            "damping_ratio": {"limit": 0.002, "window": (6.3, 12566.0)},
        },
        unbalance={"static": [3e-7, 3e-7, 3e-7], "couple": [3e-7, 0.0, -3e-7]},
    )
    design = ad.solve(problem, starts=1, seed=1)
    assert design.verified
    assert {row.quantity for row in design.limits} == set(problem.limits)
    sizes = [abs(slope) for _, slope in design.sensitivities]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 0.0

    lqg = ad.LQG.with_hardware_of(machine.controller, current=0.5, force_noise=0.1, design_speed=ad.rpm(9000))
    observed = ad.replace(machine, {"controller": lqg})
    table = ad.compare({"PID": design.machine, "LQR + observer": observed}, samples=0)
    limits = table["stability_limit"]
    assert limits["PID"] == pytest.approx(ad.stability_limit(design.machine).speed)
    assert limits["LQR + observer"] > ad.stability_limit(machine).speed


def test_new_controllers_keep_the_hardware(machine: ad.Machine) -> None:
    old = machine.controller
    law = ad.LQG.with_hardware_of(old, current=0.5, force_noise=0.1, delay=1e-4)
    assert (law.sensor_gain, law.low_pass, law.amplifier) == (old.sensor_gain, old.low_pass, old.amplifier)
    assert (law.delay, law.notches) == (1e-4, ())  # notches are the law's, not the hardware's
    assert ad.PID.with_hardware_of(law, kp=1.0).amplifier == old.amplifier
    with pytest.raises(ad.SpecError, match="other = 'lqr' has no hardware; name a controller that can be built"):
        ad.PID.with_hardware_of(ad.LQR(current=0.5), kp=1.0)


def test_functions_in_a_problem_of_ones_own(machine: ad.Machine) -> None:
    loop = ad.closed_loop(machine, free=["controller.kp", *ad.find(machine, "plies.angle")])
    assert loop.np == 11
    assert [loop.function(name).name_in() for name in ("A0", "A1")] == [["p"], ["p"]]
    opti, start = ca.Opti(), loop.vector()
    p = opti.variable(loop.np)
    opti.minimize(ca.sumsqr(p - start))  # the nearest machine
    opti.subject_to(loop.damping_function(p, speed=1200.0) <= 0.0)  # that is stable at 1200 rad/s
    opti.set_initial(p, start)
    opti.solver("ipopt", {"print_time": False, "ipopt.print_level": 0, "ipopt.hessian_approximation": "limited-memory"})
    found = loop.machine_at(opti.solve().value(p))
    assert float(loop.damping_function(start, 1200.0)) > 0.0
    assert np.linalg.eigvals(ad.system(found).matrix(1200.0)).real.max() <= 1e-3
    with pytest.raises(ad.ModelError, match=r"free them one by one, as find\(machine, 'plies.angle'\) lists them"):
        ad.closed_loop(machine, free=["plies.angle"])
