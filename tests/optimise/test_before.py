"""What a machine was before: itself, and not what the search makes of it to begin with."""

from __future__ import annotations

import dataclasses

import pytest

import amb_design as ad
from amb_design.optimise.report import document
from amb_design.optimise.start import INFEASIBLE, Outcome
from amb_design.words.design import headline, variables
from optimise.interrupted import small_problem


def uneven() -> ad.DesignProblem:
    """Magnets that are not alike, under a variable that makes them so, and beyond its bounds."""
    small = small_problem()
    changes = {"magnets[0].negative_stiffness": 1e5, "magnets[1].negative_stiffness": 1.6e5, "controller.kp": 4e3}
    free = {**small.free, "magnets.negative_stiffness": (2e4, 9e4)}
    return dataclasses.replace(small, machine=ad.replace(small.machine, changes), free=free)


def test_a_machine_that_can_be_begun_at_is_its_own_problem() -> None:
    small = small_problem()
    assert small.as_drawn() is small


def test_before_is_the_machine_itself() -> None:
    problem = uneven()
    assert problem.with_values(problem.start()) != problem.machine
    drawn = problem.as_drawn()
    assert drawn.values(drawn.start()) == pytest.approx(
        {p: v for p, v in ad.numbers(problem.machine) if p in drawn.paths()}
    )
    design = ad.Design(problem, None, (), (Outcome(0, INFEASIBLE, problem.start(), 0.0, 1.0),), 0)
    assert design.before.stability[""].speed == pytest.approx(ad.stability_limit(problem.machine).speed, rel=1e-9)
    reach = design.reach_before
    peaks = [ad.sensitivity(problem.machine, f * reach).worst.value for f in (0.0, 1.0)]
    assert 0.0 < reach <= design.before.stability[""].speed
    assert max(peaks) <= 3.0
    table = variables(document(design))
    before = {row[0]: row[1] for row in table.rows}
    assert before["magnets.negative_stiffness"] == "100000 N/m and 160000 N/m"


@pytest.mark.parametrize("part", [0.4, 1.0])
def test_the_search_ends_at_the_top_speed_and_nowhere_else(part: float) -> None:
    """A limit that binds below it is no end of the search, though no mode is unstable up to there."""
    top = 30000.0
    d = {
        "status": "verified optimum",
        "verified": True,
        "starts": [{"status": "optimum"}],
        "objective": {"quantity": "stability_limit", "unit": "rad/s", "value": ad.rpm(part * top)},
        "speed_rpm": part * top,
        "after": {"stability_limit": {"status": "none below the top speed", "speed_rpm": top}},
    }
    assert ("where the search ends" in headline(d)) == (part == 1.0)


def test_speeds_of_a_law_are_shown_in_rpm() -> None:
    v = {
        "name": "controller.design_speed",
        "unit": "rad/s",
        "before": ad.rpm(9000.0),
        "others_before": [],
        "after": ad.rpm(12000.0),
        "lower": ad.rpm(4000.0),
        "upper": ad.rpm(30000.0),
        "at_bound": "",
    }
    (row,) = variables({"variables": [v]}).rows
    assert row[1:4] == ("9000 rpm", "12000 rpm", "4000 rpm to 30000 rpm")
