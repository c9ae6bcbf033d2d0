"""The table says what the analyses say, marks the better entry, and tells what keeps it from being fair."""

from __future__ import annotations

import dataclasses
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

import amb_design as ad
from amb_design.comparison import compare as comparing
from amb_design.comparison.assessment import Assessment
from amb_design.comparison.chosen import completed
from amb_design.comparison.plants import notes, plant
from amb_design.comparison.quantities import LINES, Line
from amb_design.comparison.robustness import usual_tolerances, varied_machine
from amb_design.comparison.table import best, digits, shown
from compare.loops import jeffcott, levitated, pid
from transient.rotors import passive

OPTIONS = {"speed": 300.0, "top_speed": 900.0, "samples": 3, "tolerances": {"magnets.negative_stiffness": 0.1}}


@pytest.fixture(scope="module")
def machines() -> dict[str, ad.Machine]:
    stiff = levitated(controller=pid(kp=20000.0), resistance=0.5)
    return {
        "soft": levitated(resistance=0.5),
        "stiff": stiff,
        "falls": ad.replace(stiff, {"controller.kp": 1000.0}),
        "known": ad.replace(stiff, {"controller": ad.LQR(current=0.5, velocity=0.01)}),
    }


@pytest.fixture(scope="module")
def table(machines: dict[str, ad.Machine]) -> object:
    return ad.compare(machines, **OPTIONS, modes=4)


def test_the_table_says_what_the_analyses_say(table, machines) -> None:
    for name in ("soft", "stiff"):
        m = machines[name]
        margins = [ad.margins(m, s) for s in (0.0, 300.0)]
        shocks = [ad.base_shock(m, 1.0, 0.011, s) for s in (0.0, 300.0)]
        expected = {
            "stability_limit": ad.stability_limit(m, 900.0).speed,
            "sensitivity_peak": max(ad.sensitivity(m, s).worst.value for s in (0.0, 150.0, 300.0)),
            "gain_margin": min(x.worst("gain_up").gain_up for x in margins),
            "gain_reduction_margin": min(1.0 / x.gain_down for found in margins for x in found.loops),
            "phase_margin": min(x.worst("phase").phase for x in margins),
            "disk_margin": min(x.worst("disk").disk for x in margins),
            "noise_current": max(ad.noise_current(m, 1e-8, s).max() for s in (0.0, 300.0)),
            "base_peak": max(x.peak for x in shocks),
            "base_settling": max(x.settling_time for x in shocks),
            "copper_loss": 2 * 4.0 * 0.5 * 9.0,
            "bias_current": 3.0,
            "controller_order": 2 * 2 * (2 + 1 + 2),
            "unstable_controller_poles": 0.0,
            "design_time": None,
        }
        for key, value in expected.items():
            found = table[key][name]
            if value is None:
                assert found is None
            elif math.isinf(value):
                assert found == value
            else:
                assert found == pytest.approx(value, rel=1e-8), key
        lifted = ad.simulate(m, 0.1, speed=0.0, start="resting", contact=True)  # all modes
        beyond = np.max([lifted.radius(x) for x in (0.05, 0.55)], axis=0) > 2.5e-4
        assert table["lift_off"][name] == pytest.approx(lifted.times[beyond][-1], abs=4e-4)
        damping = ad.campbell(m, np.linspace(0.0, 300.0, 33), modes=4).damping_ratios[:, :4].min()
        assert table["least_damping_ratio"][name] == pytest.approx(damping, rel=1e-6)
        response = ad.unbalance_response(m, np.linspace(0.5, 300.0, 1500))
        radius = max(ad.analysis.unbalance.major_axis(response.at(x)).max() for x in (0.05, 0.55, 0.2, 0.45))
        assert table["unbalance_radius"][name] == pytest.approx(radius, rel=2e-3)
        assert table["unbalance_current"][name] == pytest.approx(response.peak_currents.max(), rel=2e-3)
        assert table["unbalance_current_ratio"][name] == pytest.approx(response.peak_currents.max() / 3.0, rel=2e-3)


def test_the_better_entry_is_marked(table) -> None:
    rows = {row.line.key: row for row in table.rows}
    for key, row in rows.items():
        values = {n: v for n, v in row.values.items() if v is not None and n != "known"}  # ideal feedback wins no line
        assert "known" not in row.best
        for name in row.best:
            for other in values.values():
                assert not (other > values[name] if row.line.better == "higher" else other < values[name]) or shown(
                    other, row.line.unit
                ) == shown(values[name], row.line.unit), key
    assert rows["force_peak"].best == ("stiff",)
    assert rows["force_peak"].values["known"] < rows["force_peak"].values["stiff"]
    assert not rows["bias_current"].best
    text = str(table)
    assert "* " in text.replace("*\n", "* \n")
    assert text.count("\n") > 20


def test_ties_and_infinite_entries() -> None:
    line = Line("x", "g", "l", "dB", "higher", lambda a: 1.0)
    assert best(line, {"a": math.inf, "b": 2.0}) == ("a",)
    assert best(line, {"a": math.inf, "b": math.inf}) == ()
    assert best(line, {"a": 2.0, "b": 2.0001, "c": 1.0}) == ("a", "b")
    assert best(line, {"a": None, "b": 2.0}) == ("b",)
    assert best(line, {"a": 2.0}) == ()
    assert best(dataclasses.replace(line, better=""), {"a": 1.0, "b": 2.0}) == ()


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (ad.rpm(9000.0), "rpm", "9000 rpm"),
        (1.23456e-5, "m", "12.3 µm"),
        (0.9999, "A", "1.00 A"),
        (9935.3, "s", "9935 s"),
        (0.5, "%", "50.0 %"),
        (2.0, "dB", "6.0 dB"),
        (math.pi / 4.0, "deg", "45.0 deg"),
        (math.inf, "dB", "no limit"),
        (3.0, "", "3"),
        (2.999, "", "3.00"),
        (0.0, "m", "0 nm"),
        (15.0, "W", "15.0 W"),
    ],
)
def test_numbers_as_text(value: float, unit: str, text: str) -> None:
    assert shown(value, unit) == text


def test_digits() -> None:
    assert [digits(x) for x in (9.996, 0.001234, 123456.0, 1e-7)] == ["10.0", "0.00123", "123456", "1e-07"]


def test_what_cannot_be_measured_is_said(table) -> None:
    rows = {row.line.key: row for row in table.rows}
    assert rows["sensitivity_peak"].cell("falls") == "unstable"
    assert rows["stability_limit"].cell("falls") == "unstable"
    assert rows["stable_share"].values["falls"] == 0.0
    assert rows["gain_margin"].cell("known") == "none"
    assert rows["design_time"].cell("soft") == "not known"
    assert "CPU time" not in str(table)
    notes = " ".join(table.notes)
    assert "falls is unstable at rest" in notes
    assert "known: no gain margin, gain reduction margin, phase margin and disk margin (has no control loop" in notes
    assert "known: neither amplifier nor delay in the model, an ideal reference." in notes
    assert "Base: half a sine of 1 m/s^2 in 11 ms." in notes
    assert "Force step: 11 N at disk 1, about a tenth of the weight." in notes
    with pytest.raises(ad.ModelError, match="has no line 'speed'; its lines are stability_limit"):
        table["speed"]


def test_document(table) -> None:
    d = json.loads(json.dumps(table.document(), allow_nan=False))
    assert list(d["designs"]) == ["soft", "stiff", "falls", "known"]
    soft = d["designs"]["soft"]
    assert {line.key for line in LINES} <= set(soft)
    assert soft["stability"]["certified"]
    assert len(soft["modes"]) == 4
    assert soft["modes"][0]["least_damping_ratio"] > 0.0
    assert len(soft["loops"]) == 3 * 2
    assert {"loop", "speed_rpm", "sensitivity_peak", "zone", "phase_margin_deg", "disk_margin"} <= set(soft["loops"][0])
    assert "disk_margin" not in soft["loops"][2]  # margins at both ends alone
    assert [c["signs"] for c in soft["corners"]] == [{"magnets.negative_stiffness": s} for s in (-1, 1)]
    assert d["designs"]["falls"]["loops"] == []
    assert d["conditions"]["speed_rpm"] == pytest.approx(300.0 * 30.0 / math.pi)
    assert d["lines"][0]["measure"] == "stability_limit"
    assert d["lines"][0]["unit"] == "rad/s"


def test_a_design_brings_its_time(machines) -> None:
    outcomes = [SimpleNamespace(cpu_seconds=2.0), SimpleNamespace(cpu_seconds=3.5)]
    design = object.__new__(ad.Design)
    object.__setattr__(design, "problem", SimpleNamespace(with_values=lambda p: machines["stiff"], start=dict))
    object.__setattr__(design, "best", None)
    object.__setattr__(design, "outcomes", outcomes)
    asked = comparing._asked({"soft": machines["soft"], "found": design}, None, OPTIONS)
    assert asked.seconds == {"found": 5.5}
    assert asked.designs["found"] == machines["stiff"]


def test_the_operating_range_is_chosen(machines) -> None:
    """From the smallest limit of what is stable at rest; from a service speed if there is one."""
    few = {n: machines[n] for n in ("soft", "stiff", "falls")}
    limits = {n: ad.stability_limit(m, 900.0, first_only=True) for n, m in few.items()}
    complete, notes = completed(ad.Conditions(), few, limits)
    assert complete.speed == pytest.approx(0.9 * min(limits[n].speed for n in ("soft", "stiff")))
    assert any("90 % of the smallest stability limit" in note for note in notes)
    assert complete.top_speed == 1000.0
    assert complete.tolerances.keys() == usual_tolerances(few["soft"]).keys()
    served = {n: ad.replace(m, {"operation.service_speed": 200.0}) for n, m in _served(few).items()}
    assert completed(ad.Conditions(), served, limits)[0].speed == 200.0
    fallen = completed(ad.Conditions(), {"falls": few["falls"]}, {"falls": limits["falls"]})
    assert fallen[0].speed == 1000.0
    assert "the top speed, for nothing is stable" in " ".join(fallen[1])


def _served(machines: dict[str, ad.Machine]) -> dict[str, ad.Machine]:
    return {
        n: ad.replace(m, {"operation": ad.Operation(top_speed=900.0, service_speed=1.0)}) for n, m in machines.items()
    }


@pytest.mark.parametrize("name", ["thesis-pid-vs-lqg", "tum-rig-pid-vs-lqg", "composite-spindle-pid-vs-lqg"])
def test_without_their_controllers_all_variants_are_one_model(name: str) -> None:
    base = ad.load_problem(name).machine
    bare = ad.system(base.without_controllers())
    for variant in ("cross", "lqg", "scheduled"):
        other = ad.load_problem(name, variant).machine
        assert plant(other) == plant(base)
        loop = ad.system(other.without_controllers())
        np.testing.assert_array_equal(loop.A0, bare.A0)
        np.testing.assert_array_equal(loop.A1, bare.A1)


def test_different_machines_are_told(machines) -> None:
    soft = machines["soft"]
    heavier = ad.replace(soft, {"rotor.disks[0].mass": 5.0})
    biased = ad.replace(soft, {"magnets.bias_current": 2.5})
    slower = ad.replace(soft, {"controller.amplifier.bandwidth": 1e4})
    supported = ad.replace(soft, {"bearings": (ad.Bearing(position=0.3, stiffness=1e5),)})
    assert plant(soft) == plant(machines["stiff"]) == plant(biased) == plant(machines["known"])
    assert notes({"a": soft, "b": machines["stiff"]}) == []
    (told,) = notes({"a": soft, "b": heavier})
    assert told.startswith("a and b are different machines (rotor.disks[0].mass 4 kg and 5 kg)")
    (told,) = notes({"a": soft, "b": biased})
    assert told == "Bias currents differ: 3 A in a, 2.5 A in b; k_i and k_s follow from them."
    (told,) = notes({"a": soft, "b": slower})
    assert "have different hardware (amplifier.bandwidth 15000 rad/s," in told
    assert "against amplifier.bandwidth 10000 rad/s," in told
    (told,) = notes({"a": soft, "b": supported})
    assert "bearings of another kind" in told
    unused = ad.replace(soft, {"sensors": (*soft.sensors, ad.Sensor(name="idle", position=0.3))})
    assert notes({"a": soft, "b": unused}) == []


@pytest.mark.parametrize(
    ("designs", "options", "words"),
    [
        ({}, {}, "designs are missing; give machines by name"),
        ({"a": 3}, {}, "designs.a = 3 is neither a machine nor a design"),
        ({"": "soft"}, {}, "designs = '' must be text"),
        (None, {"sped": 3.0}, "sped is no condition; known are speed, top_speed"),
        (None, {"speed": -1.0}, "speed = -1 rad/s must be positive"),
        (None, {"speed": 300.0, "top_speed": 200.0}, "top_speed = 200 rad/s is below the end of the operating range"),
        (None, {"samples": 2.5}, "samples = 2.5 must be a whole number"),
        (None, {"settled": 1.5}, "settled = 1.5 must lie between 0 and 1"),
        (None, {"unbalance": {"x": [1e-5]}}, "unbalance.x gives 1 amounts for the 2 disks of levitated"),
        (None, {"unbalance": {"x": [0.0, 0.0]}}, "unbalance.x is zero at every disk"),
        (None, {"unbalance": [1e-5, 1e-5]}, "unbalance = (1e-05, 1e-05) must be a table"),
        (None, {"tolerances": {"magnets.gaap": 0.1}}, "tolerances.magnets.gaap names no number of this machine"),
        (None, {"tolerances": {"magnets.negative_stiffness": 5}}, "must lie between 0 and 1"),
        (None, {"tolerances": {"bearings.stiffness": 0.1}}, "tolerances.bearings.stiffness names no number"),
        (None, {"tolerances": {"plies[0].angle": 0.1}}, "names no number"),
        (None, {"tolerances": dict.fromkeys("abcdef", 0.1)}, "tolerances = 6 holds more than 5"),
        (
            None,
            {"tolerances": {"magnets.current_stiffness": 0.1, "magnets[0].current_stiffness": 0.1}},
            "has a tolerance in magnets.current_stiffness too",
        ),
        (
            None,
            {"force_step": ad.ForceStep(force=1.0, at="disk 7")},
            "force_step.at = 'disk 7' names no part of levitated",
        ),
        (None, {"force_step": 3.0}, "force_step = 3 has the wrong type; give an ad.ForceStep"),
        (None, {"conditions": ad.Conditions(), "speed": 3.0}, "speed are given beside conditions"),
    ],
)
def test_wrong_input_is_one_sentence(designs, options, words, machines) -> None:
    designs = {"soft": machines["soft"]} if designs is None else designs
    with pytest.raises(ad.SpecError) as error:
        ad.compare(designs, **options)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_worst_corner_and_random_machines_by_hand() -> None:
    """The same machines made by hand, their stability by eigenvalues at many speeds."""
    machine = jeffcott(kd=3.8, ki=6e5)
    tolerances = {"magnets.negative_stiffness": 0.25, "magnets.current_stiffness": 0.6}
    table = ad.compare({"a": machine}, speed=700.0, top_speed=900.0, tolerances=tolerances, samples=25, seed=4)
    base = varied_machine(machine)

    def varied(x: float, y: float) -> ad.Machine:
        m = base.magnets[0]
        return ad.replace(
            base,
            {
                "magnets[0].negative_stiffness": m.negative_stiffness * (1.0 + x),
                "magnets[0].current_stiffness": m.current_stiffness * (1.0 + y),
            },
        )

    limits = [ad.stability_limit(varied(x, y), 900.0).speed for x in (-0.25, 0.25) for y in (-0.6, 0.6)]
    assert table["worst_stability_limit"]["a"] == pytest.approx(min(limits), rel=1e-9)
    draws = np.random.default_rng(4).uniform(-1.0, 1.0, (25, 2)) * [0.25, 0.6]
    stable = 0
    for x, y in draws:
        loop = ad.system(varied(float(x), float(y)))
        stable += all(np.linalg.eigvals(loop.matrix(s)).real.max() < 0.0 for s in np.linspace(0.0, 700.0, 15))
    assert 0 < stable < 25
    assert table["stable_share"]["a"] == stable / 25


def test_controllers_stay_while_the_machine_varies() -> None:
    """A regulator is designed for the machine as drawn, and not again for each that differs from it."""
    chain = {"low_pass": ad.LowPass(frequency=2e4), "amplifier": ad.Amplifier(bandwidth=1.5e4)}
    law = ad.LQG(modes=4, current=0.05, force_noise=0.1, sensor_noise=1e-8, integral=1e-6, **chain)
    machine = levitated(controller=law)
    base = varied_machine(machine)
    other = ad.replace(base, {"magnets.negative_stiffness": 1.1 * base.magnets[0].negative_stiffness})
    assert other.controller == base.controller
    assert base.controller.type == "state_space"
    one, two = ad.system(base), ad.system(machine)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(one.A0)), np.sort_complex(np.linalg.eigvals(two.A0)), rtol=1e-6, atol=1e-3
    )
    table = ad.compare({"PID": levitated(), "LQG": machine}, speed=200.0, samples=2, top_speed=600.0)
    assert table["stability_limit"]["LQG"] > 200.0
    for key in ("sensitivity_peak", "disk_margin", "noise_current", "force_peak", "base_settling", "stable_share"):
        assert table[key]["LQG"] is not None


def test_usual_tolerances_fit_the_machine() -> None:
    assert set(usual_tolerances(levitated())) == {
        "magnets.current_stiffness",
        "magnets.negative_stiffness",
        "segments.material.E",
    }
    assert set(usual_tolerances(passive())) == {"bearings.stiffness", "segments.material.E"}
    assert "plies.material.E1" in usual_tolerances(ad.load("thesis-tuned"))


def test_a_passive_machine_has_lines_too() -> None:
    """No magnets: no loops, no currents, no copper; but limits, damping and responses."""
    table = ad.compare({"a": passive(), "b": passive(anisotropic=True)}, speed=200.0, samples=2)
    assert table["sensitivity_peak"] == {"a": None, "b": None}
    assert table["force_peak"]["a"] > 0.0
    assert table["force_current"] == {"a": 0.0, "b": 0.0}
    assert table["controller_order"] == {"a": 0.0, "b": 0.0}
    assert any("different machines" in note for note in table.notes)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"rotor.disks.mass": 80.0}, "is still on its backup bearings 0.5 s after its magnets are switched on"),
        ({"magnets[1].clearance": None}, "has no backup bearings, that is magnets with a clearance"),
        ({"operation.gravity": 0.0}, "has no weight to lift"),
    ],
)
def test_who_cannot_lift_off_is_told(changes: dict[str, float | None], reason: str) -> None:
    design = SimpleNamespace(machine=ad.replace(levitated(), changes), require_running=lambda: None)
    with pytest.raises(ad.ModelError, match=reason):
        Assessment.lift_off.func(design)
