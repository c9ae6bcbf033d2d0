"""What happens between the speeds that a search looks at is not left to chance."""

from __future__ import annotations

import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise.evaluation import CLOSER, Evaluator
from amb_design.optimise.search import Settings
from amb_design.optimise.start import ALMOST, Starter
from synthesis.levitated import laws, small

TOP = 1500.0
WINDOW = (6.3, 6000.0)
ENDS = np.array([0.0, 1.0])


def problem(bound: float) -> ad.DesignProblem:
    """The least damping of this loop lies at three quarters of the range."""
    return ad.DesignProblem(
        ad.replace(small(laws()["state space, one input"]), {"operation.top_speed": TOP}),
        maximise="stability_limit",
        free={"controller.sensor_gain": (4000.0, 9000.0)},
        limits={"damping_ratio": {"limit": bound, "window": WINDOW}},
    )


def damping(machine: ad.Machine, speeds: np.ndarray) -> np.ndarray:
    """Least damping ratio in the window at each speed, from dense eigenvalues of the full model."""
    loop, out = ad.system(machine), []
    for s in speeds:
        e = np.linalg.eigvals(loop.matrix(s))
        e = e[(np.abs(e.imag) > WINDOW[0]) & (np.abs(e.imag) < WINDOW[1])]
        out.append((-e.real / np.abs(e)).min())
    return np.array(out)


def test_the_worst_speed_between_two_is_found():
    nominal = problem(0.46)
    seen = damping(nominal.machine, TOP * np.linspace(0.0, 1.0, 41))
    assert seen.min() < 0.46 < min(seen[0], seen[-1])
    evaluator = Evaluator(nominal)
    evaluator.fractions = evaluator.checked = ENDS
    x = evaluator.scaling.point(np.array(list(nominal.start().values())))
    assert evaluator.rows(x, 1.0).worst <= 0.0  # nothing wrong, as far as it looks
    (found,), others = evaluator.overlooked(x, 1.0)
    assert not len(others)
    assert found == pytest.approx(np.linspace(0.0, 1.0, 41)[seen.argmin()], abs=0.5 / CLOSER)
    state = evaluator.cases[0].state(evaluator.scaling.values(x))
    excess = evaluator.cases[0].shortfalls(state.eigenvalues(np.array([found * TOP])), {"damping_ratio": 0.46})
    assert excess["damping_ratio"][0, 0] == pytest.approx(
        1.0 - damping(nominal.machine, [found * TOP]) / 0.46, abs=1e-8
    )
    evaluator.fractions = np.append(ENDS[:1], [found, 1.0])
    assert evaluator.rows(x, 1.0).worst == pytest.approx(excess["damping_ratio"][0, 0], rel=1e-6)


def test_a_search_that_settles_holds_its_limits_between_its_speeds():
    nominal = problem(0.462)
    starter = Starter(nominal)
    starter.evaluator.fractions = starter.evaluator.checked = ENDS
    x = starter.evaluator.scaling.point(np.array(list(nominal.start().values())))
    trace = starter._settled(x, 0.9, Settings(steps=30, highest=1.0), None)
    assert trace.rows.worst <= ALMOST
    values = dict(zip(nominal.start(), starter.evaluator.scaling.values(trace.x), strict=True))
    seen = damping(nominal.with_values(values), trace.level * TOP * np.linspace(0.0, 1.0, 61))
    assert seen.min() >= 0.462 * (1.0 - 2e-3)
    assert len(starter.evaluator.fractions) > len(ENDS)
