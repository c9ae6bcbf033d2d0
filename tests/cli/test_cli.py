"""The command line as its users see it: output, exit status, files."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from spec.bad_files import BAD_FILES, GOOD, BadFile, write

FAST = """
format = "amb_design/1"
name = "fast"
[source]
title = "a small machine"
[operation]
top_speed = "9000 rpm"
[materials.steel]
E = "211 GPa"
G = "81.2 GPa"
density = 7810
[rotor.shaft]
elements = 4
viscous_damping = 2e-4
segments = [{ length = 1.5, material = "steel", outer_diameter = "50 mm" }]
[[rotor.disks]]
position = 0.6
mass = 30
diametral_inertia = 0.2
polar_inertia = 0.35
[[bearings]]
position = 0
stiffness = 1e6
damping = 200
[[bearings]]
position = 1.5
stiffness = 1e6
damping = 200
"""


@pytest.fixture
def fast(tmp_path) -> Path:
    file = tmp_path / "fast.toml"
    file.write_text(FAST)
    return file


@pytest.mark.parametrize("case", BAD_FILES, ids=lambda case: case.id)
def test_bad_file_gives_one_sentence_and_exit_2(case: BadFile, tmp_path, run):
    target, out = write(case, tmp_path), tmp_path / "out"
    status, output, errors = run("analyse", target, "--out", str(out))
    assert status == 2
    assert output == ""
    assert len(errors.splitlines()) == 1
    assert "Traceback" not in errors
    assert all(fragment in errors for fragment in case.fragments)
    assert not out.exists()
    assert not list(tmp_path.glob(".out-*"))


def test_bad_file_in_a_process_of_its_own(tmp_path):
    file = tmp_path / "machine.toml"
    file.write_text(GOOD.replace("position = 0.3", "position = 1.31", 1))
    done = subprocess.run(
        [sys.executable, "-m", "amb_design", "check", str(file)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert "rotor.disks[0].position = 1.31 m lies beyond the shaft (1.2 m)" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_out_may_not_be_a_file(fast, tmp_path, run):
    (tmp_path / "taken").write_text("mine")
    status, output, errors = run("analyse", str(fast), "--out", str(tmp_path / "taken"))
    assert (status, output) == (2, "")
    assert "is a file" in errors
    assert (tmp_path / "taken").read_text() == "mine"


def test_out_needs_an_existing_parent(fast, tmp_path, run):
    status, _, errors = run("analyse", str(fast), "--out", str(tmp_path / "no" / "such"))
    assert status == 2
    assert "does not exist" in errors


def test_unknown_variant_and_misspelt_problem(run):
    assert run("analyse", "thesis", "--variant", "row5")[0] == 2
    status, _, errors = run("check", "thesis-tunde")
    assert status == 2
    assert "thesis-tuned" in errors


def test_analyse_json_has_the_promised_keys(fast, run):
    status, output, _ = run("analyse", str(fast), "--json")
    assert status == 0
    document = json.loads(output)
    limit = document["stability_limit"]
    assert limit["status"] == "limit found"
    assert limit["certified"] is True
    assert 0.0 < limit["speed_rpm"] < 9000.0
    assert limit["whirl_frequency_hz"] > 0.0
    assert document["onsets_rpm"][0] == pytest.approx(limit["speed_rpm"])
    assert document["critical_speeds_rpm"] == sorted(document["critical_speeds_rpm"])
    assert {"speed_rpm", "whirl"} <= set(document["critical_speeds"][0])
    assert all(isinstance(text, str) for text in document["warnings"])
    assert document["limit_sensitivities"][0]["rpm_per_percent"]


def test_analyse_variants_are_nested(tmp_path, run):
    file = tmp_path / "two.toml"
    file.write_text(
        FAST + "\n[variants.stiff]\nbearings = [{position = 0, stiffness = 5e6}, {position = 1.5, stiffness = 5e6}]\n"
    )
    status, output, _ = run("analyse", str(file), "--json")
    assert status == 0
    document = json.loads(output)
    assert document["variants"]["stiff"]["critical_speeds_rpm"][0] > document["critical_speeds_rpm"][0]
    _, output, _ = run("analyse", str(file), "--variant", "stiff", "--json")
    assert set(json.loads(output)["variants"]) == {"stiff"}


def test_analyse_writes_figures_and_json(fast, tmp_path, run):
    out = tmp_path / "out"
    status, output, _ = run("analyse", str(fast), "--out", str(out))
    assert status == 0
    assert "stability limit" in output
    names = {p.name for p in out.iterdir()}
    assert {
        "report.html",
        "analysis.json",
        "campbell.png",
        "damping.png",
        "real_part.png",
        "modes.png",
        "machine.png",
    } <= names
    assert all(p.stat().st_size > 5000 for p in out.glob("*.png"))
    assert json.loads((out / "analysis.json").read_text())["name"] == "fast"
    assert not list(tmp_path.glob(".out-*"))


def test_a_failed_run_leaves_the_folder_as_it_was(fast, tmp_path, run, monkeypatch):
    from amb_design.errors import SolveError
    from amb_design.report import analysis

    def fail(*_, **__):
        raise SolveError("no picture today")

    out = tmp_path / "out"
    out.mkdir()
    (out / "analysis.json").write_text("old")
    monkeypatch.setattr(analysis, "pictures", fail)
    status, output, errors = run("analyse", str(fast), "--out", str(out))
    assert (status, output) == (3, "")
    assert errors.endswith("amb-design: no picture today\n")
    assert [p.name for p in out.iterdir()] == ["analysis.json"]
    assert (out / "analysis.json").read_text() == "old"


def test_check_tells_what_the_file_describes(run):
    status, output, _ = run("check", "thesis-tuned")
    assert status == 0
    output = " ".join(output.split())
    for words in (
        "152.7 kg",
        "An axis can pull 46.79 N",
        "share of the weight would be 786.4 and 711.3 N",
        "114 states",
    ):
        assert words in " ".join(output.split())
    document = json.loads(run("check", "thesis-tuned", "--json")[1])
    assert document["magnets"][0]["capacity_n"] == pytest.approx(46.79, abs=0.01)


def test_list(run):
    status, output, _ = run("list", "--json")
    assert status == 0
    names = [p["name"] for p in json.loads(output)["problems"]]
    assert {"thesis", "thesis-tuned", "tum-rig", "jeffcott"} <= set(names)
    assert "thesis-tuned" in run("list")[1]


def test_version_and_usage(run):
    assert run("--version")[1].startswith("amb-design ")
    assert run("analyse")[0] == 2
