"""A few of the random problems of benchmarks/random_problems.py: what is called verified holds, and nothing crashes."""

from __future__ import annotations

import dataclasses
import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from amb_design.optimise.audit import audit
from amb_design.optimise.meshes import four_times, halved, own, quartered, thrice, twice
from amb_design.optimise.solve import starter
from amb_design.optimise.start import Outcome
from amb_design.optimise.verification import ELSEWHERE, JUST_BELOW, _audits, _unresolved, _unsettled, excesses

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "random_problems.py"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("random_problems", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seed", [1, 5, 7, 10, 13, 14, 216])
def test_designs_keep_their_promises(seed: int, script: ModuleType) -> None:
    """On a finer mesh, at speeds of one's own, by code that shares nothing with the optimiser."""
    record = script.run(seed)
    assert record["status"] == "verified optimum", record
    assert record["broken"] == []


def test_no_mode_is_moved_just_out_of_the_window_of_damping(script: ModuleType) -> None:
    """Where it would be inside on a finer mesh, and the design rejected."""
    record = script.run(77)
    assert record["status"].startswith("verified"), record
    assert record["broken"] == []


@pytest.mark.parametrize("seed", [2, 9])
def test_hopeless_problems_are_called_infeasible(seed: int, script: ModuleType) -> None:
    record = script.run(seed)
    assert record["status"] == "infeasible", record


def test_modes_that_only_some_meshes_destabilise_are_seen(script: ModuleType) -> None:
    """At 40 kHz, a few elements to the wavelength; the search holds them down on the mesh that shows them."""
    problem, _ = script.problem_of(205)
    values = {
        "controller_z.kp": 8092.2,
        "controller.ki": 7477.1,
        "rotor.shaft.segments[1].plies[2].angle": -0.18377,
        "magnets.gap": 4.9376e-4,
        "controller_z.low_pass.frequency": 14708.0,
        "controller.low_pass.frequency": 46687.0,
        "rotor.shaft.segments[0].plies[0].angle": -0.61589,
    }
    refuted = {
        layout: [e.told for e in excesses(problem, audit(problem, values, 1200.0, layout, ()))]
        for layout in (own, halved, twice, thrice, four_times)
    }
    assert [len(told) for told in refuted.values()] == [0, 0, 1, 1, 0]
    assert refuted[twice][0].endswith(
        "rotor mode at 3.926e+04 Hz, at rest, on a mesh of twice as many elements, scenario other)"
    )
    assert refuted[thrice][0].endswith("on a mesh of three times as many elements, scenario other)")
    ev = starter(problem, script.EFFORT).evaluator
    x, level = ev.scaling.point(np.array([values[v.name] for v in problem.variables])), 0.3
    ev.watch("other", halved, 0.0)
    assert ev.rows(x, level).values.max() < 0.0
    ev.watch("other", twice, 0.0)
    rows = ev.rows(x, level)
    violated = rows.values > 0.0
    assert {(rows.quantities[i], rows.scenarios[i]) for i in np.flatnonzero(violated)} == {
        ("stability", "other"),
        ("decay_rate", "other"),
    }


def test_meshes_are_cut_until_a_limited_quantity_has_settled(script: ModuleType) -> None:
    """A mode at 5 kHz decays with 2.86 on the mesh, 1.50 where elements are cut in two, 1.43 in four, and 1.42 in the end."""
    problem, _ = script.problem_of(114)
    values = {
        "rotor.shaft.segments[0].plies[0].angle": -1.5121627744655954,
        "rotor.shaft.segments[1].plies[1].thickness": 0.0013045729385523768,
        "controller.amplifier.bandwidth": 15759.356660602047,
        "rotor.disks[0].outer_diameter": 0.2049241476504768,
        "rotor.shaft.segments[0].plies[1].thickness": 0.0022992082020457444,
        "rotor.disks[1].position": 0.3113575025818851,
    }
    decay = dataclasses.replace(problem, limits={"decay_rate": problem.limits["decay_rate"]})
    audits = [audit(decay, values, decay.top_speed, layout, {"decay_rate"}) for layout in (own, halved, quartered)]
    assert [a.at("decay_rate", "other").value for a in audits] == pytest.approx([2.857, 1.4962, 1.4253], rel=1e-4)
    assert [excesses(decay, a) == [] for a in audits] == [True, True, False]
    assert _unsettled(decay, *audits[:2]) == {"decay_rate"}
    found = _audits(starter(decay, script.EFFORT), Outcome(0, "optimum", values, 1.92, 0.0), 1.92)[1]
    assert [e.quantity for e in found] == ["decay_rate"]
    assert found[0].told.endswith("on a four times finer mesh, scenario other)")


def test_the_stability_limit_itself_has_to_settle(script: ModuleType) -> None:
    """It falls from 1585 rad/s on the mesh to 1522.3 where elements are cut in two, 1518.3 in four, and 1518.1 in the end."""
    problem, _ = script.problem_of(277)
    values = {
        "controller.amplifier.bandwidth": 32391.934570768288,
        "bearings[0].stiffness": 3365662.0144276014,
        "rotor.disks[0].position": 0.07874860220173004,
        "controller.kd": 103.0952856187307,
        "rotor.disks[2].mass": 1.4374403512833804,
        "rotor.shaft.segments[0].plies[1].angle": -0.6066263944949691,
        "bearings[1].kzz": 2766601.4229004313,
        "rotor.shaft.segments[0].plies[0].thickness": 0.003494809785994838,
    }
    end = 1521.99
    assert excesses(problem, audit(problem, values, end, halved, ())) == []
    for layout in (twice, thrice, four_times):
        assert _unresolved(problem, values, end, layout, ELSEWHERE) == []
    assert [e.told for e in _unresolved(problem, values, end, quartered, [JUST_BELOW])] == [
        "not stable (mode at 5122 Hz, 14519 rpm, on a four times finer mesh)"
    ]


def test_a_resonance_that_cannot_be_crossed_ends_the_range(script: ModuleType) -> None:
    """The current at a resonance is above its limit by 0.1 %, whatever the design: what lies below is the answer."""
    problem, _ = script.problem_of(68)
    design = script.solve(problem, 1, 68, effort=script.EFFORT)
    assert design.status == "verified optimum"
    assert [row.quantity for row in design.limits if row.active] == ["control_current"]
    assert script.broken_promises(design, 68) == []


def test_starts_agree_on_what_is_least_unstable(script: ModuleType) -> None:
    """No design of this problem is stable."""
    problem, _ = script.problem_of(59)
    search = starter(problem, script.EFFORT)
    found = [search.run(59, index) for index in range(3)]
    assert [outcome.status for outcome in found] == ["infeasible"] * 3
    assert [outcome.conflicts[0]["quantity"] for outcome in found] == ["stability"] * 3
    least = [outcome.violation for outcome in found]
    assert least == pytest.approx([0.0898] * 3, abs=1e-4)


@pytest.mark.parametrize("seed", [10, 13])
def test_the_check_finds_what_is_wrong(seed: int, script: ModuleType) -> None:
    """A check that never finds anything proves nothing: limits two per cent tighter than what the design reaches."""
    problem, _ = script.problem_of(seed)
    design = script.solve(problem, 1, seed, effort=script.EFFORT)
    assert script.broken_promises(design, seed) == []
    limits = {row.quantity: row.value * (0.98 if row.upper else 1.02) for row in design.limits}
    boast = dataclasses.replace(design, problem=dataclasses.replace(problem, limits=limits))
    assert {b["quantity"] for b in script.broken_promises(boast, seed)} == set(limits)
