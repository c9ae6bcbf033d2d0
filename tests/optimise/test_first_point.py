"""Where searches begin, and that they end no worse than that."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise.solve import starter
from amb_design.optimise.start import INFEASIBLE, Effort
from optimise.interrupted import small_problem


def test_a_problem_begins_at_another_machine():
    problem = small_problem()
    first = problem.variables[0]
    elsewhere = {v.name: 0.9 * v.lower + 0.1 * v.upper for v in problem.variables}
    begun = problem.starting_at(problem.with_values(elsewhere))
    assert begun.start() == pytest.approx(elsewhere)
    assert dataclasses.replace(begun, machine=problem.machine) == problem
    beyond = problem.starting_at(problem.with_values({**elsewhere, first.name: 2.0 * first.upper}))
    assert beyond.start()[first.name] == first.upper
    with pytest.raises(ad.SpecError, match="has none of the problem's variables"):
        problem.starting_at(ad.load("jeffcott"))


def test_first_start_ends_no_worse_than_the_machine_as_it_is(monkeypatch):
    """A search that loses its way (here: that never takes the long way) still keeps what it was given."""
    problem = small_problem()
    search = starter(problem, Effort(20, 20, 20))
    found = search.run(0, 0)
    assert found.status != INFEASIBLE
    again = starter(problem.starting_at(problem.with_values(found.values)), Effort(20, 20, 20))
    lost = dataclasses.replace(found, objective=0.8 * found.objective)
    monkeypatch.setattr(type(again), "_from", lambda *_: lost)
    kept = again.run(0, 0)
    assert kept.objective >= 0.9999 * found.objective
    assert again.run(0, 1) is lost  # other starts are what they are


def test_every_other_start_begins_nearer_to_the_machine():
    problem = small_problem()
    search = starter(problem, Effort())
    machine = search.evaluator.scaling.point(np.array(list(problem.start().values())))
    begun = np.array([search._first(3, k) for k in range(41)])
    assert (begun[0] == machine).all()
    assert (begun[1::2] >= machine / 2.0).all()
    assert (begun[1::2] <= (1.0 + machine) / 2.0).all()
    assert (np.abs(begun[2::2] - machine) > 0.5).any()


def test_what_is_infeasible_has_the_objective_of_its_point():
    """Nothing is asked of the objective while a search looks for a point within the limits; here its gains cannot bring one."""
    small = small_problem().machine
    bounds = {"controller.kp": (5e3, 7e3), "rotor.disks[0].mass": (5.5, 6.5)}
    limits = {"damping_ratio": {"limit": 0.9, "window": (60.0, 1200.0)}}
    problem = ad.DesignProblem(small, minimise="mass", speed=300.0, free=bounds, limits=limits)
    found = starter(problem, Effort(10, 5, 5)).run(0, 0)
    assert found.status == INFEASIBLE
    shaft = 7850.0 * math.pi / 4.0 * 0.03**2 * 0.6
    assert found.objective == pytest.approx(shaft + found.values["rotor.disks[0].mass"], rel=1e-9)
