"""`amb-design optimise` as its users see it."""

from __future__ import annotations

import json

import pytest

import amb_design as ad
from cli.test_cli import FAST
from report.pages import read

PROBLEM = """
format = "amb_design/1"
name = "fast-design"
question = "Which bearings let it spin fastest?"
[source]
title = "a small problem"
[free]
"bearings.damping" = [50, 400, "log"]
"bearings.stiffness" = [1e5, 5e6, "log"]
[limits]
damping_ratio = { limit = 0.02, window = ["1 Hz", "1000 Hz"] }
"""


@pytest.fixture
def folder(tmp_path):
    def make(text: str = 'maximise = "stability_limit"\n'):
        (tmp_path / "machine.toml").write_text(
            FAST.replace("9000 rpm", "30000 rpm").replace("elements = 4", "elements = 12")
        )
        head, name, rest = PROBLEM.partition('name = "fast-design"\n')
        (tmp_path / "problem.toml").write_text(head + name + text + rest)
        return tmp_path

    return make


def test_design_table_files_and_resume(run, folder, tmp_path):
    out = tmp_path / "out"
    status, text, progress = run(
        "optimise", str(folder()), "--starts", "2", "--workers", "1", "--out", str(out), "--relax"
    )
    assert status == 0
    assert "verified optimum: stable and within all limits up to" in text
    for words in (
        "Before and after",
        "Variables",
        "What moves the stability limit most",
        "What easing a limit by 10 % brings",
    ):
        assert words in text
    assert progress.count("(optimum") == 2
    names = {p.name for p in out.iterdir()}
    figures = {
        "machine.png",
        "campbell_before.png",
        "campbell_after.png",
        "real_part.png",
        "convergence.png",
        "sensitivities.png",
    }
    assert names == {"starts", "report.html", "design.toml", "design.json", "proof.json", "proof.npz", *figures}
    assert ad.check_proof(out / "proof.json", ad.load(out / "design.toml"))[0].startswith("stable from 0 to")
    assert all((out / f).stat().st_size > 10_000 for f in figures)
    document = json.loads((out / "design.json").read_text())
    assert document["verified"]
    assert document["after"]["stability_limit"]["certified"]
    page = (out / "report.html").read_text(encoding="utf-8")
    told = " ".join(read(page).text)
    assert 'class="verdict good"' in page or 'class="verdict bad"' in page
    for words in (
        "Which bearings let it spin fastest?",
        "Verified optimum: stable and within all limits up to",
        "The largest stability limit, by changing 2 numbers of the machine.",
        "What easing a limit by 10 % brings",
        "0, 2 starts",
        f"Proven stable, on its own mesh, at every speed up to {document['after']['proof']['stable_up_to_rpm']:.2f} rpm.",
    ):
        assert words in told, words
    machine = ad.load(out / "design.toml")
    limit = ad.stability_limit(machine)
    assert limit.speed_rpm >= document["speed_rpm"] * (1.0 - 1e-6)
    again = run("optimise", str(folder()), "--starts", "2", "--workers", "1", "--out", str(out), "--resume", "--json")
    assert again[0] == 0
    resumed = json.loads(again[1])
    assert resumed["starts"] == document["starts"]
    assert resumed["objective"] == document["objective"]


def test_json_says_what_others_rely_on(run, folder):
    status, text, _ = run(
        "optimise", str(folder()), "--starts", "1", "--json", "--pareto", "damping_ratio=0.015:0.03:2"
    )
    assert status == 0
    d = json.loads(text)
    assert {"before", "after", "variables", "limits", "status", "verified", "eigensolves", "cpu_seconds"} <= set(d)
    assert d["before"]["stability_limit"]["speed_rpm"] < d["after"]["stability_limit"]["speed_rpm"]
    assert {"quantity", "value", "limit", "active"} <= set(d["limits"][0])
    strict, loose = (p["objective"] for p in d["pareto"]["damping_ratio"][::-1])
    assert strict < loose


def test_infeasible_problem_names_what_conflicts(run, folder, tmp_path):
    path = folder()
    text = (path / "problem.toml").read_text().replace("limit = 0.02", "limit = 0.6")
    (path / "problem.toml").write_text(text)
    out = tmp_path / "none"
    status, text, error = run("optimise", str(path), "--starts", "1", "--out", str(out))
    assert status == 3
    assert "No design keeps all limits." in text
    last = error.strip().splitlines()[-1]
    assert last.startswith("amb-design: fast-design: infeasible: limits that cannot be held together: damping ratio by")
    assert not (out / "design.toml").exists()
    told = " ".join(read((out / "report.html").read_text(encoding="utf-8")).text)
    assert "No design keeps all limits." in told
    assert "damping ratio: missed by" in told


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--resume"], "--resume needs the folder of the starts; add --out FOLDER"),
        (["--pareto", "mass"], "--pareto = 'mass' is no range of limits; write quantity=first:last:count"),
        (["--pareto", "masses=1:2:3"], "did you mean `mass`?"),
        (["--pareto", "sensitivity_peak=3:4:2"], "needs a control loop"),
        (["--variant", "other"], "has no variant other"),
    ],
)
def test_wrong_options(run, folder, arguments, words):
    status, text, error = run("optimise", str(folder()), *arguments)
    assert (status, text) == (2, "")
    assert words in " ".join(error.split())
    assert len(error.strip().splitlines()) == 1


def test_objective_that_is_no_speed(run, folder):
    path = folder('minimise = "mass"\nspeed = "2000 rpm"\n')
    text = (path / "problem.toml").read_text()
    (path / "problem.toml").write_text(
        text.replace("[free]\n", '[free]\n"rotor.shaft.segments[0].outer_diameter" = ["40 mm", "60 mm"]\n')
    )
    status, text, _ = run("optimise", str(path), "--starts", "1")
    assert status == 0
    assert "verified optimum: mass" in text


def test_folder_without_a_problem(run, tmp_path):
    (tmp_path / "machine.toml").write_text(FAST)
    status, _, error = run("optimise", str(tmp_path))
    assert status == 2
    assert len(error.strip().splitlines()) == 1
