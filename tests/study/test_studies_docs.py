"""What docs/studies.md shows runs as it is written; the problem written by hand is a tutorial, run where the site is built."""

from __future__ import annotations

import multiprocessing
import pickle
import re
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.model.parametric import PENCIL, STRUCTURE
from amb_design.spec.paths import value

TEXT = (Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)


@pytest.fixture(scope="module")
def functions() -> dict:
    """Names that the first block leaves behind."""
    known: dict = {}
    exec(compile(BLOCKS[0], "docs/studies.md", "exec"), known)
    return known


def test_functions_of_a_machine(functions: dict, capsys: pytest.CaptureFixture[str]) -> None:
    assert functions["A0"].name_in() == ["p"]
    assert functions["opti"].g.shape == (1, 1)


@pytest.mark.parametrize("block", BLOCKS[1:])
def test_other_packages(functions: dict, block: str) -> None:
    exec(compile(block, "docs/studies.md", "exec"), dict(functions))


@pytest.fixture(scope="module")
def derivative() -> ad.ClosedLoop:
    machine = ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 4})
    return ad.closed_loop(machine, {"controller.kd": (0.01, 0.05)})


def most_damped(loop: ad.ClosedLoop) -> float:
    """The same Functions in `nlpsol`, with an exact quantity to be maximised."""
    x = ca.MX.sym("x")
    nlp = {"x": x, "f": -loop.damping_ratios(x, 300.0, 1)}
    solver = ca.nlpsol("s", "ipopt", nlp, {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes"})
    return float(solver(x0=0.02, lbx=0.01, ubx=0.05)["x"])


def test_optimisation_by_another_solver(derivative: ad.ClosedLoop) -> None:
    loop, found = derivative, most_damped(derivative)
    scan = np.linspace(0.01, 0.05, 81)
    best = scan[np.argmax([float(loop.damping_ratios([kd], 300.0, 1)) for kd in scan])]
    assert found == pytest.approx(best, abs=1e-3)


def _in_worker(loop: ad.ClosedLoop, p: np.ndarray) -> tuple[float, float]:
    return float(loop.damping_function(p, 300.0)), float(loop.function("M")(p)[0][0, 0])


def test_a_worker_builds_it_again() -> None:
    loop = ad.closed_loop(ad.load("tum-rig"), {"controller.kd": (1e-3, 1e2), "magnets.current_stiffness": (1.0, 1e3)})
    p = loop.vector() * 1.01
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = pool.submit(_in_worker, loop, p).result()
    assert there == pytest.approx(_in_worker(loop, p), rel=1e-12)
    back = pickle.loads(pickle.dumps(loop.reduced(5)))
    assert back.parameters == loop.parameters
    assert (back.names, back.lower, back.upper, back.modes) == (loop.names, loop.lower, loop.upper, 5)


def test_a_worker_optimises(derivative: ad.ClosedLoop) -> None:
    """What has arrived works in solvers, with its derivatives, and arrives at the same optimum."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        there = pool.submit(most_damped, derivative).result()
    assert there == pytest.approx(most_damped(derivative), rel=1e-9)


def test_expressions_are_saved(tmp_path: Path) -> None:
    loop = ad.closed_loop(ad.load("thesis-tuned"), ["controller.kd", "magnets.bias_current"])
    made = {name: loop.function(name) for name in (*PENCIL, *STRUCTURE, "magnet_force", "controller", "rhs", "loads")}
    made["rhs_of_modes"] = loop.function("rhs", modes=3)
    for name, function in made.items():
        function.save(str(tmp_path / name))
        back = ca.Function.load(str(tmp_path / name))
        assert (back.name_in(), back.name_out()) == (function.name_in(), function.name_out())
        point = [np.random.default_rng(1).random(function.size_in(k)) * 1e-5 for k in range(function.n_in())]
        point[0] = loop.vector()
        for a, b in zip(function.call(point), back.call(point), strict=True):
            np.testing.assert_array_equal(a.full(), b.full())
    computed = loop.function("growth_rates")
    for write in (lambda: computed.save(str(tmp_path / "growth_rates")), computed.serialize):
        with pytest.raises(ad.ModelError, match="growth_rates is computed by Python and cannot be saved; pickle its"):
            write()
    assert not (tmp_path / "growth_rates").exists()


def test_vectors_and_names_are_one(derivative: ad.ClosedLoop) -> None:
    machine = derivative.machine
    damper = {"gain": ["controller.kd"], "ends": ["bearings[0].damping", "bearings[1].damping"]}
    for loop in (ad.closed_loop(machine, damper), ad.closed_loop(machine, ad.find(machine, "plies.angle"))):
        p = loop.vector() * 1.1 + 0.01
        named = loop.values(p)
        assert list(named) == list(loop.names)
        np.testing.assert_array_equal(loop.vector(dict(reversed(named.items()))), p)
        there = loop.machine_at(p)
        for q in loop.parameters:
            assert {value(there, path) for path in q.paths} == {named[q.name]}
