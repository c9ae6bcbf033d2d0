"""Design problems: reading them, what they say of a machine, and how wrong ones are refused."""

from __future__ import annotations

import json
import math
import pickle
import sys
from pathlib import Path

import casadi as ca
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import amb_design as ad
from amb_design import cli
from amb_design.errors import SpecError
from amb_design.spec import files, paths, problem_files
from amb_design.spec.fields import is_symbolic
from amb_design.spec.problem import DesignProblem
from amb_design.spec.problem_parts import Limit, Measure, Scenario, Tie, UnbalancePattern, Variable
from amb_design.units import rpm
from spec.bad_problems import BAD_PROBLEMS, GOOD, MACHINE, BadProblem, edited, write
from spec.test_bad_files import PIECES

RIG = files.loads(MACHINE)
KP = {"controller.kp": (5e3, 5e4)}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the good problem and its machine."""
    (tmp_path / "machine.toml").write_text(MACHINE)
    (tmp_path / "problem.toml").write_text(GOOD)
    return tmp_path


def seeking(machine: ad.Machine = RIG, **changes: object) -> DesignProblem:
    """A problem made in Python."""
    return DesignProblem(machine, **{"free": KP, "maximise": "stability_limit", **changes})


# --- wrong files ---------------------------------------------------------------------------------------------------


def test_the_table_is_long_and_has_no_doubles():
    names = [case.id for case in BAD_PROBLEMS]
    assert len(names) >= 100
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("case", BAD_PROBLEMS, ids=lambda case: case.id)
def test_refused_with_one_sentence(case: BadProblem, tmp_path: Path):
    target = write(case, tmp_path)
    with pytest.raises(SpecError) as caught:
        ad.load_problem_variants(target)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    assert len(message) < 1000
    for fragment in case.fragments:
        assert fragment in message


LINES = GOOD.splitlines()


@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.tuples(st.sampled_from(range(len(LINES))), st.sampled_from(PIECES)), min_size=1, max_size=3))
def test_nothing_but_a_sentence_comes_out(tmp_path_factory, changes):
    folder = tmp_path_factory.getbasetemp()
    (folder / "machine.toml").write_text(MACHINE)
    lines = list(LINES)
    for i, piece in changes:
        key, equals, _ = lines[i].rpartition("=")
        lines[i] = key + equals + piece
    for variant in (None, "lighter"):
        try:
            problem = problem_files.loads_problem("\n".join(lines), variant, folder=folder)
        except SpecError as refused:
            sentence = str(refused)
        else:
            sentence = problem.with_values(problem.start()).name
        assert len(sentence.splitlines()) == 1


# --- good files ----------------------------------------------------------------------------------------------------


def test_everything_in_a_file(folder):
    p = ad.load_problem(folder)
    assert (p.name, p.question, p.source) == ("good", "How fast may it spin?", {"title": "a problem for tests"})
    assert p.objective == Measure("stability_limit")
    assert p.seeks_speed
    assert p.top_speed == p.machine.operation.top_speed == pytest.approx(rpm(30000))
    assert p.variables == (
        Variable("controller.kp", 5e3, 5e4, "log"),
        Variable("low_pass.frequency", pytest.approx(2000 * math.pi), pytest.approx(8000 * math.pi)),
        Variable("magnets.bias_current", 1.0, 3.0),
        Variable("plies[1].angle", 0.0, pytest.approx(math.pi / 2)),
        Variable("magnets[0].position", 0.08, 0.2),
    )
    assert p.followers == (
        Tie("plies[2].angle", (("plies[1].angle", -1.0),)),
        Tie("sensors[0].position", (("magnets[0].position", 1.0),), 0.03),
    )
    window = (pytest.approx(2 * math.pi), pytest.approx(600 * math.pi))
    assert [(c.quantity, c.bound, c.options) for c in p.constraints] == [
        ("sensitivity_peak", 3.0, ()),
        ("total_current", 4.0, ()),
        ("damping_ratio", 0.002, (("window", window),)),
        ("surface_speed", 400.0, (("disks", ("left",)),)),
    ]
    assert p.patterns == (
        UnbalancePattern("static", pytest.approx((3e-6, 0.0, 3e-6))),
        UnbalancePattern("couple", pytest.approx((3e-6, 0.0, -3e-6))),
    )
    assert p.cases == (Scenario("soft-magnets", (("magnets.gap", 1.05),), 1.5),)


def test_variants(folder):
    variants = ad.load_problem_variants(folder)
    assert list(variants) == ["bias-only", "lighter", "shorter"]
    for name, p in variants.items():
        assert p.name == p.machine.name == f"good: {name}"
        assert p == ad.load_problem(folder / "problem.toml", name)
    assert variants["bias-only"].constraints == ()
    lighter = variants["lighter"]
    assert lighter.objective == Measure("mass")
    assert lighter.top_speed == pytest.approx(rpm(9000))
    assert not lighter.seeks_speed
    assert len(lighter.variables) == 6
    assert variants["shorter"].top_speed == pytest.approx(rpm(25000))
    with pytest.raises(SpecError, match=r"problem\.toml: the file has no variant shortr; did you mean `shorter`\?"):
        ad.load_problem(folder, "shortr")


def test_errors_name_the_variant(folder):
    (folder / "problem.toml").write_text(GOOD + '[variants.x]\nfree."controller.kp" = [2, 1]\n')
    with pytest.raises(SpecError, match=r"problem\.toml \(variant x\): free\.controller\.kp = \[2, 1\] has crossed"):
        ad.load_problem(folder, "x")


def test_a_file_without_variants_is_its_own_variant(folder):
    (folder / "problem.toml").write_text(GOOD[: GOOD.index("[variants")])
    assert list(ad.load_problem_variants(folder)) == ["good"]


def test_an_objective_with_options(folder):
    text = edited(
        GOOD,
        ('"stability_limit"', '{ quantity = "damping_ratio", window = ["2 Hz", 50] }\nspeed = "9000 rpm"'),
        ('damping_ratio = { limit = 0.002, window = ["1 Hz", "300 Hz"] }\n', ""),
    )
    p = problem_files.loads_problem(text, folder=folder)
    assert p.objective.option("window") == (pytest.approx(4 * math.pi), 50.0)
    assert Measure("damping_ratio").option("window") == (1.0, 1e9)


def test_limits_with_options_are_limits(folder):
    p = ad.load_problem(folder)
    assert all(isinstance(c, Limit) for c in p.constraints)
    assert p.constraints[3].option("disks") == ("left",)
    assert p.constraints[0].kind.upper


# --- the machine that a problem starts from ------------------------------------------------------------------------


def elsewhere(folder: Path, machine: str, *lines: str) -> Path:
    """The good problem in a folder of its own, with a machine elsewhere."""
    place = folder / "problem"
    place.mkdir()
    head = "\n".join([f'machine = "{machine}"', *lines])
    (place / "problem.toml").write_text(edited(GOOD, ("[source]", f"{head}\n[source]")))
    return place


@pytest.mark.parametrize("machine", ["..", "../machine.toml", "../"])
def test_a_machine_in_another_folder(folder, machine):
    place = elsewhere(folder, machine)
    assert ad.load_problem(place).machine == ad.load_problem(folder).machine
    assert ad.load(place) == ad.load_problem(place).machine


def test_a_packaged_machine_comes_after_one_beside_the_file(tmp_path):
    text = """
format = "amb_design/1"
name = "bias"
machine = "thesis-tuned"
maximise = "stability_limit"
source.title = "tests"
[free]
"magnets.bias_current" = [0.2, 1.0]
"""
    (tmp_path / "problem.toml").write_text(text)
    problem = ad.load_problem(tmp_path)
    assert paths.replace(problem.machine, {"name": "thesis-tuned"}) == ad.load("thesis-tuned")
    assert problem.start() == {"magnets.bias_current": 0.75}
    (tmp_path / "thesis-tuned").mkdir()
    (tmp_path / "thesis-tuned" / "machine.toml").write_text(MACHINE)
    assert len(ad.load_problem(tmp_path).machine.sensors) == 3


def test_a_machine_variant(folder):
    text = edited(GOOD, ("[source]", 'machine_variant = "own"\n[source]'))
    text = text[: text.index("[free]")] + '[free]\n"magnets[1].controller.kp" = [1e3, 1e5]\n'
    p = problem_files.loads_problem(text, folder=folder)
    assert p.machine.magnets[1].controller.kp == 1e4
    assert list(p.paths()) == ["magnets[1].controller.kp"]


def test_changes_reach_numbers_that_were_left_out(folder):
    text = edited(
        GOOD, ('"30000 rpm"', '"30000 rpm"\n"magnets.link_voltage" = "0.3 kV"\n"rotor.shaft.shear_correction" = 0.6')
    )
    machine = problem_files.loads_problem(text, folder=folder).machine
    assert [m.link_voltage for m in machine.magnets] == [300.0, 300.0]
    assert machine.rotor.shaft.shear_correction == 0.6
    assert machine.operation.service_speed == pytest.approx(rpm(10000))


def test_a_problem_stands_for_its_machine(folder):
    assert files.resolve(folder).name == "machine.toml"
    assert ad.load(folder).name == "rig"
    place = elsewhere(folder, "..")
    assert files.resolve(place) == place / "problem.toml"
    machine = ad.load(place)
    assert machine.name == "good"
    assert machine.source == ad.load(folder).source
    assert machine.operation.top_speed == pytest.approx(rpm(30000))
    assert ad.loads((place / "problem.toml").read_text(), folder=place) == machine
    # variants that start from the same machine are one machine
    assert list(ad.load_variants(place)) == ["shorter"]
    assert ad.load(place, "lighter") == paths.replace(machine, {"name": "good: lighter"})


def test_packaged_problems(monkeypatch, folder):
    place = elsewhere(folder, "..")
    monkeypatch.setattr(files, "packaged", lambda: {"rig": folder, "only": place})
    assert files.resolve("rig") == folder / "machine.toml"
    assert files.resolve("only") == place / "problem.toml"
    assert ad.load_problem("rig").machine == ad.load_problem("only").machine == ad.load("only")


def test_list_says_what_can_be_optimised(monkeypatch, folder, capsys):
    place, plain = elsewhere(folder, ".."), files.packaged()["jeffcott"]
    monkeypatch.setattr(files, "packaged", lambda: {"rig": folder, "only": place, "plain": plain})
    rows = {}
    for option in (["--json"], []):
        monkeypatch.setattr(sys, "argv", ["amb-design", "list", *option])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert stop.value.code == 0
        output = capsys.readouterr().out
        rows = rows or {row["name"]: row for row in json.loads(output)["problems"]}
    assert {name: row["optimise"] for name, row in rows.items()} == {"rig": True, "only": True, "plain": False}
    assert rows["only"]["design_variants"] == ["bias-only", "lighter", "shorter"]
    assert rows["rig"]["variants"] == ["own", "passive"]
    assert rows["only"]["source"] == "a problem for tests"
    assert output.count("analyse, optimise") == 2


def test_a_wrong_problem_gives_one_sentence_and_status_2(monkeypatch, folder, capsys):
    place = elsewhere(folder, "../nowhere")
    monkeypatch.setattr(sys, "argv", ["amb-design", "check", str(place)])
    with pytest.raises(SystemExit) as stop:
        cli.main()
    captured = capsys.readouterr()
    assert (stop.value.code, captured.out) == (2, "")
    assert len(captured.err.splitlines()) == 1
    assert "problem.toml: machine = '../nowhere' is neither" in captured.err


def test_every_packaged_problem_can_be_read():
    for folder in ad.packaged().values():
        if (folder / files.PROBLEM_FILE).is_file():
            assert ad.load_problem_variants(folder)


# --- values --------------------------------------------------------------------------------------------------------


def test_paths_and_values(folder):
    p = ad.load_problem(folder)
    assert p.paths() == {
        "controller.kp": {"controller.kp": 1.0},
        "controller.low_pass.frequency": {"low_pass.frequency": 1.0},
        "magnets[0].bias_current": {"magnets.bias_current": 1.0},
        "magnets[1].bias_current": {"magnets.bias_current": 1.0},
        "rotor.shaft.segments[0].plies[1].angle": {"plies[1].angle": 1.0},
        "magnets[0].position": {"magnets[0].position": 1.0},
        "rotor.shaft.segments[0].plies[2].angle": {"plies[1].angle": -1.0, "": 0.0},
        "sensors[0].position": {"magnets[0].position": 1.0, "": 0.03},
    }
    start = p.start()
    assert p.with_values(start) == p.machine
    other = p.with_values({**start, "plies[1].angle": 0.3, "magnets[0].position": 0.15, "magnets.bias_current": 1.5})
    assert [ply.angle for ply in other.rotor.shaft.segments[0].plies[1:3]] == [0.3, -0.3]
    assert (other.magnets[0].position, other.sensors[0].position) == (0.15, pytest.approx(0.18))
    assert [m.bias_current for m in other.magnets] == [1.5, 1.5]
    with pytest.raises(SpecError, match=r"plies\[1\]\.angle is missing"):
        p.values({name: x for name, x in start.items() if name != "plies[1].angle"})


@pytest.mark.parametrize("symbol", [ca.SX.sym, ca.MX.sym], ids=["SX", "MX"])
def test_values_may_be_symbols(folder, symbol):
    p = ad.load_problem(folder)
    x = {v.name: symbol(f"x{i}") for i, v in enumerate(p.variables)}
    values = p.values(x)
    machine = p.with_values(x)
    assert list(values) == list(p.paths())
    for path, found in values.items():
        assert is_symbolic(found)
        assert ca.is_equal(paths.value(machine, path), found, 2)
    start = p.start()
    numbers = ca.Function("f", list(x.values()), [ca.vertcat(*values.values())])(*start.values()).full()[:, 0]
    assert list(numbers) == pytest.approx(list(p.values(start).values()))
    slope = ca.Function("g", list(x.values()), [ca.jacobian(values["sensors[0].position"], x["magnets[0].position"])])
    assert float(slope(*start.values())) == 1.0


def test_the_start_lies_within_the_bounds():
    p = seeking(free={"controller.kp": (2e4, 5e4), "magnets.bias_current": [0.5, 1.5]})
    assert p.start() == {"controller.kp": 2e4, "magnets.bias_current": 1.5}


def test_a_tie_may_follow_several_variables():
    p = seeking(
        free={"controller.kd": (5, 20), "controller.ki": (50, 200)},
        ties={"controller.kp": {"controller.kd": 500, "controller.ki": 10, "constant": 100}},
    )
    assert p.values({"controller.kd": 10.0, "controller.ki": 100.0})["controller.kp"] == 6100.0


def test_problems_can_be_sent_to_other_processes(folder):
    p = ad.load_problem(folder)
    assert pickle.loads(pickle.dumps(p)) == p


# --- problems made in Python ---------------------------------------------------------------------------------------


def test_a_problem_in_python():
    p = seeking(limits={"mass": 30, "hoop_strain": {"limit": 4e-3, "overspeed": 1.2}})
    assert p.name == "rig"
    assert p.constraints[1].option("overspeed") == 1.2
    again = seeking(free={v.name: v for v in p.variables})
    assert again.variables == p.variables


def test_bounds_on_both_sides_of_a_relation_may_share_a_variable():
    """Inner and outer diameter move together: the corner where they would cross is none of this box."""
    ties = {"disks[0].outer_diameter": {"disks[0].inner_diameter": 1, "constant": 0.05}}
    seeking(free={"disks[0].inner_diameter": (0.05, 0.3)}, ties=ties)
    with pytest.raises(SpecError, match=r"inner_diameter = 0\.3 m is not below the outer diameter \(0\.2 m\)"):
        seeking(free={"disks[0].inner_diameter": (0.05, 0.3)})


def test_places_that_move_together_keep_their_order():
    """Magnet and sensor travel far, 30 mm apart; each alone would pass the other."""
    free = {"magnets[1].position": (0.8, 0.95)}
    seeking(free=free, ties={"sensors[1].position": {"magnets[1].position": 1, "constant": -0.03}})
    with pytest.raises(SpecError, match="meet or pass"):
        seeking(free=free)


def test_places_that_coincide_may_move_if_tied():
    machine = paths.replace(RIG, {"magnets[0].position": 0.13})
    free = {"magnets[0].position": (0.1, 0.2)}
    with pytest.raises(SpecError, match=r"moves sensors\[0\]\.position away|away from magnets\[0\]\.position"):
        seeking(machine, free=free)
    seeking(machine, free=free, ties={"sensors[0].position": {"magnets[0].position": 1}})


def test_a_longer_segment_carries_its_step_along():
    seeking(free={"segments[1].length": (0.15, 0.3)})
    with pytest.raises(SpecError, match=r"step after rotor\.shaft\.segments\[0\]"):
        seeking(free={"segments[0].length": (0.8, 1.05)})


def test_relations_across_parts_are_seen():
    """The three-dimensional ply law asks the shaft about its plies' materials."""
    machine = paths.replace(RIG, {"rotor.shaft.ply_law": "three-dimensional"})
    with pytest.raises(SpecError, match=r"free\.material\.G23 = .*nu23"):
        seeking(machine, free={"material.G23": (2.5e9, 4e9)})


def test_own_controllers_leave_the_shared_one_idle():
    own = files.loads(MACHINE, "own")
    with pytest.raises(SpecError, match=r"free\.controller\.kp influences nothing: no magnet uses this controller"):
        seeking(own)


@pytest.mark.parametrize(
    ("changes", "path", "reason"),
    [
        ({"rotor.shaft.theory": "rayleigh"}, "rotor.shaft.shear_correction", "rayleigh theory knows no shear"),
        (
            {f"rotor.shaft.segments[{i}].viscous_damping": 1e-5 for i in (0, 1)},
            "rotor.shaft.viscous_damping",
            "every segment has its own",
        ),
    ],
)
def test_numbers_that_nothing_reads(changes, path, reason):
    with pytest.raises(SpecError, match=f"influences nothing: .*{reason}"):
        seeking(paths.replace(RIG, changes), free={path: (1e-6, 1.0)})


def test_numbers_that_only_a_limit_reads():
    free = {**KP, "magnets.clearance": (1e-4, 3e-4)}
    with pytest.raises(SpecError, match="only displacement_ratio would read it"):
        seeking(free=free)
    seeking(free=free, limits={"displacement_ratio": 0.5})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"machine": "thesis"}, "machine = 'thesis' must be a machine"),
        (
            {"machine": paths.replace(RIG, {"controller.kd": ca.SX.sym("x")})},
            "controller.kd is a symbol in the machine",
        ),
        ({"free": [1, 2]}, "free = [1, 2] must be a table"),
        ({"free": {"controller.kp": (10**400, 1)}}, "free.controller.kp = 1000000"),
        ({"limits": {"mass": 10**400}}, "limits.mass = 1000000"),
        ({"name": 3}, "name = 3 must be text"),
        ({"limits": {"mass": None}}, "limits.mass must be a finite number; give the limit as a number in kg"),
        ({"scenarios": {"x": {"unbalance": 1}}}, "scenarios.x changes nothing"),
        (
            {"scenarios": {"x": {"disks.unbalance": 2}}, "unbalance": {"a": (1, 0, 0)}},
            "is no number to scale by itself",
        ),
        ({"free": {"controller.kp": (1, 2, ["log"])}}, "has an unknown scale"),
    ],
)
def test_wrong_problems_in_python(changes, words):
    with pytest.raises(SpecError) as caught:
        seeking(**changes)
    assert words in str(caught.value)


def test_many_variables_in_one_part_are_checked_in_pairs():
    names = ("turns", "pole_area", "gap", "bias_current", "resistance", "clearance", "position")
    own = {f"magnets[1].{n}": paths.value(RIG, f"magnets[1].{n}") for n in names}
    free = {path: (x - 1e-6, x + 1e-6) for path, x in own.items()}
    free |= {f"magnets[1].{n}": (0.0, 0.1) for n in ("half_angle", "axes_angle", "leakage_inductance")}
    limits = {"displacement_ratio": 0.5, "copper_loss": 900, "voltage": 300}
    seeking(free=free, limits=limits)
    free |= {"magnets[1].gap": (2.5e-4, 5e-4), "magnets[1].clearance": (1e-4, 3e-4)}
    with pytest.raises(SpecError, match=r"clearance = 0\.0003 m exceeds the air gap \(0\.00025 m\)"):
        seeking(free=free, limits=limits)
