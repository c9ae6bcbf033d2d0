"""Comparison files and `amb-design compare`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import amb_design as ad
from amb_design.spec.comparison_files import design_time
from compare.loops import levitated
from report.pages import read

GOOD = """
format = "amb_design/1"
name = "two"
question = "Which is better?"
[source]
title = "a test"
[conditions]
speed = "2000 rpm"
top_speed = "6000 rpm"
sensor_noise = "10 nm/sqrt(Hz)"
samples = 2
[conditions.force_step]
force = "10 N"
at = "disk 1"
[conditions.base_shock]
acceleration = "0.2 gravity"
[conditions.unbalance]
static = ["2 g mm", 1e-6]
[conditions.tolerances]
"magnets.negative_stiffness" = "10 %"
[designs.soft]
machine = "soft.toml"
[designs.stiff]
machine = "soft.toml"
changes = { "controller.kp" = 20000 }
design_time = "2 min"
[variants.slower]
conditions.speed = "1000 rpm"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    machine = ad.replace(levitated(), {"source": {"title": "a test"}})
    ad.save(machine, tmp_path / "soft.toml")
    (tmp_path / "comparison.toml").write_text(GOOD)
    return tmp_path


def test_a_file_says_it_all(folder: Path) -> None:
    found = ad.load_comparison(folder)
    c = found.conditions
    assert (found.name, found.question) == ("two", "Which is better?")
    assert list(found.designs) == ["soft", "stiff"]
    assert found.designs["stiff"].controller.kp == 20000
    assert found.seconds == {"stiff": 120.0}
    assert c.speed == pytest.approx(ad.rpm(2000.0))
    assert c.sensor_noise == pytest.approx(1e-8)
    assert c.force_step.force == 10.0
    assert c.base_shock.acceleration == pytest.approx(0.2 * 9.80665)
    assert c.base_shock.duration is None
    assert c.unbalance["static"] == pytest.approx([2e-6, 1e-6])
    assert c.tolerances == {"magnets.negative_stiffness": pytest.approx(0.1)}
    assert ad.load_comparison(folder, "slower").conditions.speed == pytest.approx(ad.rpm(1000.0))


def test_the_packaged_comparison_can_be_read() -> None:
    found = ad.load_comparison("thesis-pid")
    assert list(found.designs) == ["by hand", "optimised", "bias alone limited"]
    assert found.designs["optimised"] == ad.load_optimum("thesis-pid")
    for machine in found.designs.values():
        found.conditions.fit(machine)


def test_a_controller_in_place_of_the_own_one(folder: Path) -> None:
    (folder / "comparison.toml").write_text(
        GOOD.replace("design_time", 'controller = { type = "lqr", current = "0.5 A" }\ndesign_time').replace(
            'changes = { "controller.kp" = 20000 }', ""
        )
    )
    assert isinstance(ad.load_comparison(folder).designs["stiff"].controller, ad.LQR)


def test_what_a_search_cost_lies_beside_its_design(folder: Path) -> None:
    (folder / "soft.toml").rename(folder / "design.toml")
    assert design_time(folder / "design.toml") is None
    (folder / "design.json").write_text('{"cpu_seconds": 12.5}')
    (folder / "comparison.toml").write_text(GOOD.replace("soft.toml", "design.toml"))
    assert ad.load_comparison(folder).seconds == {"soft": 12.5, "stiff": 120.0}
    (folder / "design.json").write_text("no json")
    assert design_time(folder / "design.toml") is None


BAD = {
    "unknown key": (
        'question = "',
        'qestion = "',
        "qestion = 'Which is better?' is an unknown key; did you mean `question`?",
    ),
    "no source": ('title = "a test"', "", "source is missing; say where the conditions come from"),
    "no designs": ("[designs.soft]", "[other.soft]", "other"),
    "unknown condition": (
        "samples = 2",
        "sample = 2",
        "conditions.sample = 2 is an unknown key; did you mean `samples`?",
    ),
    "half a sample": ("samples = 2", "samples = 2.5", "conditions.samples = 2.5 must be a whole number"),
    "wrong unit": ('speed = "2000 rpm"', 'speed = "2 m"', "conditions.speed = '2 m' has the wrong unit"),
    "noise in metres": ("10 nm/sqrt(Hz)", "10 nm", "conditions.sensor_noise = '10 nm' has the wrong unit"),
    "no force": ('force = "10 N"\n', "", "conditions.force_step.force is missing; add it: size [N]"),
    "unknown place": ('at = "disk 1"', 'at = "disc"', "two: force_step.at = 'disc' names no part of levitated"),
    "list of unbalances": ('["2 g mm", 1e-6]', '"2 g mm"', "conditions.unbalance.static = '2 g mm' must be a list"),
    "one unbalance": (
        '["2 g mm", 1e-6]',
        "[1e-6]",
        "two: unbalance.static gives 1 amounts for the 2 disks of levitated",
    ),
    "path without quotes": ('"magnets.negative_stiffness" =', "magnets.negative_stiffness =", "conditions.tolerances"),
    "tolerance": (
        '"10 %"',
        '"110 %"',
        "conditions.tolerances.magnets.negative_stiffness = 1.1 must lie between 0 and 1",
    ),
    "unknown tolerance": ("negative_stiffness", "stifness", "two: tolerances.magnets.stifness names no number"),
    "no such machine": (
        'machine = "soft.toml"\n[',
        'machine = "sift.toml"\n[',
        "designs.soft.machine = 'sift.toml' is neither",
    ),
    "machine and problem": (
        'machine = "soft.toml"\nchanges',
        'machine = "soft.toml"\nproblem = "x"\nchanges',
        "designs.stiff.machine, problem are both given",
    ),
    "neither": ('machine = "soft.toml"\nchanges', "changes", "designs.stiff.machine, problem are both missing"),
    "design key": ("changes =", "change =", "designs.stiff.change"),
    "bad change": ('"controller.kp"', '"controller.kq"', "designs.stiff.changes.controller.kq names no number"),
    "time": ('"2 min"', '"-2 min"', "designs.stiff.design_time = -120 must be a time; give CPU seconds"),
    "no optimum": (
        'machine = "soft.toml"\nchanges',
        'problem = "thesis-pid"\nvariant = "x"\nchanges',
        "has no variant x",
    ),
    "machine file": ("[conditions]", "[rotor]\n[conditions]", "rotor"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files(name: str, folder: Path, run) -> None:
    old, new, words = BAD[name]
    assert old in GOOD
    (folder / "comparison.toml").write_text(GOOD.replace(old, new, 1))
    status, output, errors = run("compare", str(folder), "--out", str(folder / "out"))
    assert (status, output) == (2, "")
    assert words.removeprefix("two: ") in errors
    assert len(errors.strip().splitlines()) == 1
    assert "comparison.toml" in errors or words.startswith("two: ") or "thesis-pid" in errors
    assert not (folder / "out").exists()


def test_table_json_and_files(folder: Path, run) -> None:
    out = folder / "out"
    status, text, _ = run("compare", str(folder), "--out", str(out))
    assert status == 0
    for words in (
        "two: Which is better?",
        "Operating range up to 2000 rpm",
        "stability limit speed, certified",
        "force step: settling time",
        "First modes: least damping ratio",
        "CPU time of the design",
        "120 s",
        f"{out}/report.html shows all of it",
    ):
        assert words in text, words
    figures = {"campbell", "real_part", "sensitivity", "unbalance", "force_step", "base_shock", "corners"}
    assert {p.name for p in out.iterdir()} == {
        "report.html",
        "comparison.json",
        *(f"{f}.png" for f in figures),
    }
    page = (out / "report.html").read_text(encoding="utf-8")
    told = " ".join(read(page).text)
    for words in ("Which is better?", "Operating range up to 2000 rpm", "soft as a file", "SHA-256"):
        assert words in told
    assert all((out / f"{f}.png").stat().st_size > 10_000 for f in figures)
    stored = json.loads((out / "comparison.json").read_text())
    status, text, _ = run("compare", str(folder), "--json")
    assert status == 0
    assert json.loads(text) == stored
    assert stored["designs"]["stiff"]["design_time"] == 120.0
    assert stored["question"] == "Which is better?"


def test_several_machines(folder: Path, run) -> None:
    other = ad.replace(levitated(), {"name": "other", "controller.kd": 35.0, "source": {"title": "a test"}})
    other = ad.replace(other, {"operation": ad.Operation(top_speed=400.0)})
    ad.save(other, folder / "other.toml")
    both = (str(folder / "soft.toml"), str(folder / "other.toml"))
    status, text, _ = run("compare", *both, "--samples", "1", "--speed", "1500 rpm", "--json")
    assert status == 0
    document = json.loads(text)
    assert list(document["designs"]) == ["levitated", "other"]
    assert document["conditions"]["speed_rpm"] == pytest.approx(1500.0)
    assert document["conditions"]["samples"] == 1
    assert document["conditions"]["top_speed_rpm"] == pytest.approx(1000.0 * 30.0 / 3.14159265)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["thesis-tuned"], "thesis-tuned has no comparison.toml; write one, or name two or more machines"),
        (["thesis-tuned", "thesis-tuned"], "is named twice; write a comparison file with names"),
        (["thesis-tuned", "jeffcott", "--variant", "x"], "--variant = 'x' belongs to a comparison file"),
        (["thesis-pid", "--optimum"], "--optimum needs several targets"),
        (["thesis-pid", "--variant", "x"], "has no variant x"),
        (["thesis-pid", "--speed", "9 m"], "--speed = '9 m' has the wrong unit: rad/s is expected"),
        (["thesis-tuned", "nowhere"], "nowhere is neither a file, a folder nor a packaged problem"),
    ],
)
def test_wrong_arguments(arguments: list[str], words: str, run) -> None:
    status, output, errors = run("compare", *arguments)
    assert (status, output) == (2, "")
    assert words in errors
    assert len(errors.strip().splitlines()) == 1
