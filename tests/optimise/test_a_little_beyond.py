"""Designs a little beyond their limits: little speed is given up for them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise import verification
from amb_design.optimise.meshes import twice
from amb_design.optimise.search import Trace
from amb_design.optimise.solve import starter
from amb_design.optimise.start import ALMOST, FOUND, Effort, Outcome, Starter
from amb_design.optimise.verification import Excess, _tighten, verify
from optimise.interrupted import small_problem

EFFORT = Effort(20, 20, 20)


def problem(tighter: float = 0.0) -> ad.DesignProblem:
    """One whose sensitivity holds it back long before its top speed."""
    small = small_problem(2.0 * (1.0 - tighter))
    return dataclasses.replace(small, machine=ad.replace(small.machine, {"operation.top_speed": 20000.0}))


@pytest.fixture(scope="module")
def optimum() -> Outcome:
    found = starter(problem(), EFFORT).run(0, 0)
    assert found.status == FOUND
    return found


def at(search: Starter, optimum: Outcome) -> tuple[np.ndarray, float]:
    ev = search.evaluator
    return ev.scaling.point(np.array(list(optimum.values.values()))), ev.level(optimum.objective)


def test_limits_are_held_nearby(optimum: Outcome) -> None:
    """For half a percent of a limit at most one percent of the speed."""
    search = starter(problem(tighter=0.005), EFFORT)
    x, level = at(search, optimum)
    trace = Trace(x, level, search.evaluator.rows(x, level))
    assert trace.rows.worst > 10.0 * ALMOST
    search._mend(trace)
    assert trace.rows.worst <= ALMOST
    assert 0.99 * level <= trace.level < level
    assert search.evaluator.rows(trace.x, trace.level).worst == pytest.approx(trace.rows.worst, abs=1e-12)


def test_a_point_that_held_them_is_not_given_up_for_less(optimum: Outcome) -> None:
    search = starter(problem(tighter=0.005), EFFORT)
    x, level = at(search, optimum)
    rows = search.evaluator.rows(x, level)
    trace = Trace(x, level, rows, feasible=(x, 0.9999 * level, rows))
    search._mend(trace)
    assert trace.rows is rows


@pytest.mark.parametrize("beyond", [5e-4, 5e-3])
def test_the_first_point_may_miss_the_margins_of_the_search(
    optimum: Outcome, beyond: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A machine within a thousandth of its limits is better than a search that lost its way; one further out is not."""
    machine = problem().with_values(optimum.values)
    mass = 7850.0 * np.pi / 4.0 * 0.03**2 * 0.6 + 6.0
    free = {v.name: (v.lower, v.upper) for v in problem().variables} | {"rotor.disks[0].mass": (5.5, 6.5)}
    limits = {"sensitivity_peak": 2.0, "mass": mass * (1.0 - beyond)}
    search = starter(ad.DesignProblem(machine, maximise="stability_limit", free=free, limits=limits), EFFORT)
    lost = dataclasses.replace(optimum, objective=0.8 * optimum.objective)
    monkeypatch.setattr(search, "_from", lambda *_: lost)
    kept = search.run(0, 0)
    if beyond < 1e-3:
        assert kept.objective >= 0.99 * optimum.objective
        assert kept.violation <= ALMOST
    else:
        assert kept is lost


def test_a_shorter_range_is_better_than_a_refinement_that_loses_more(
    optimum: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The design stays what it was, and is verified up to a little less than it claimed."""
    search = starter(problem(tighter=-0.002), EFFORT)  # what the finer mesh adds below the end is allowed
    claim = dataclasses.replace(optimum, objective=1.01 * optimum.objective)
    monkeypatch.setattr(
        search, "polished", lambda *_, **__: dataclasses.replace(claim, objective=0.8 * claim.objective)
    )
    verified = verify(search, claim)
    assert verified.passed
    assert verified.outcome is claim
    assert 0.97 * claim.objective <= verified.objective < claim.objective


def test_no_range_is_short_enough_for_what_is_unstable_at_rest(
    optimum: Outcome, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verification, "audit", pytest.fail)
    assert verification._shorter(problem(), optimum, [Excess("stability", "", 1.0, 0.0)]) is None


@pytest.mark.parametrize("quantity", ["stability", "decay_rate", "damping_ratio", "sensitivity_peak"])
def test_what_a_finer_mesh_refutes_is_held_on_that_mesh(quantity: str) -> None:
    """A margin on the design's own mesh does nothing about modes that it does not have."""
    small = problem()
    limits = {**small.limits, "decay_rate": 0.1, "damping_ratio": {"limit": 1e-3, "window": (1.0, 1e6)}}
    search = starter(dataclasses.replace(small, limits=limits), EFFORT)
    ev, end = search.evaluator, 1000.0
    margins = dict(ev.margins)
    x = ev.scaling.point(np.array(list(small.start().values())))
    before = set(ev.rows(x, 0.05).keys)
    _tighten(search, Excess(quantity, "", 0.2, 0.4 * end, twice), end, again=True)
    rows = ev.rows(x, 0.05)
    added = [i for i, key in enumerate(rows.keys) if key not in before]
    assert {rows.quantities[i] for i in added} == {"stability", "decay_rate", "damping_ratio", "sensitivity_peak"}
    assert 0.4 * ev.end(0.05) in rows.speeds[added]
    assert ev.margins == margins


def test_limits_are_tightened_only_where_they_were_looked_at() -> None:
    """A speed that nobody had looked at says nothing of how far a limit has to be tightened elsewhere."""
    search = starter(problem(), EFFORT)
    ev, end = search.evaluator, 1000.0
    before = ev.margins["sensitivity_peak"]
    missed = Excess("sensitivity_peak", "", 0.15, 0.3217 * end)
    _tighten(search, missed, end, again=True)
    assert ev.margins["sensitivity_peak"] == before
    assert np.abs(ev.checked - 0.3217).min() < 1e-12
    _tighten(search, missed, end, again=True)
    assert ev.margins["sensitivity_peak"] > before + 0.15
