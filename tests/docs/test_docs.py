"""What the documents show runs as it is written there; programs of the README are tests/wheel's."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib as mpl
import pytest

import amb_design as ad
from amb_design.spec.comparison import BaseShock, Conditions, ForceStep
from amb_design.spec.comparison_files import COMPARISON_FILE
from amb_design.spec.fields import Spec
from amb_design.spec.files import controlled
from amb_design.spec.problem_files import KEYS, loads_problem
from amb_design.spec.quantities import QUANTITIES
from amb_design.spec.reference import (
    REFERENCES,
    TABLES,
    condition_reference,
    field_reference,
    key_reference,
    quantity_reference,
)

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
FILES = (ROOT / "docs" / "machine-files.md").read_text(encoding="utf-8")
PROBLEMS = (ROOT / "docs" / "problem-files.md").read_text(encoding="utf-8")


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_readme_machine_has_a_limit():
    (text,) = blocks(README, "toml")
    assert len(text.strip().splitlines()) <= 15
    assert ad.stability_limit(ad.loads(text)).status == "limit found"


def test_machine_file_example_is_complete():
    text = blocks(FILES, "toml")[0]
    machine = ad.loads(text)
    assert machine.rotor.disks[0].unbalance == pytest.approx(1e-5)
    assert machine.controller.low_pass.frequency == pytest.approx(18849.556)
    assert ad.loads(text, "no-notch").controller.notches == ()
    assert ad.stability_limit(machine).status == "none below the top speed"


def test_references_hold_every_field_that_a_file_may_have():
    def kinds(kind: type[Spec]) -> set[type[Spec]]:
        below = kind.__subclasses__()
        return {kind} if not below else {leaf for sub in below for leaf in kinds(sub)}

    elsewhere = {"Rotor", "StateFeedback", "Sampling"}  # a table of tables; made by `synthesise`; an argument
    written = {k for k in kinds(Spec) if k.__module__.startswith("amb_design.spec") and k.__name__ not in elsewhere}
    assert written == {*TABLES.values(), Conditions, ForceStep, BaseShock}
    tables = field_reference() + condition_reference()
    for kind in written:
        for f in dataclasses.fields(kind):
            assert f.metadata["doc"] in tables, f"{kind.__name__}.{f.name}"


def test_problem_file_example_is_complete():
    (text,) = blocks(PROBLEMS, "toml")
    problem = loads_problem(text)
    assert problem.seeks_speed
    assert len(problem.variables) == 6
    assert len(problem.constraints) == 6
    assert problem.with_values(problem.start()).operation.top_speed == pytest.approx(ad.rpm(15000))
    fixed = loads_problem(text, "fixed-layup")
    assert len(fixed.variables) == 5
    assert [tie.name for tie in fixed.followers] == ["disks[2].position"]
    assert loads_problem(text, "light").objective.quantity == "mass"


def test_problem_references_are_complete():
    assert [row.split("`")[1] for row in quantity_reference().splitlines()[2:]] == list(QUANTITIES)
    (example,) = blocks(PROBLEMS, "toml")
    known = {key.strip("[]").removesuffix(".NAME") for key in KEYS}
    assert set(tomllib.loads(example)) <= known
    assert [row.split("`")[1] for row in key_reference().splitlines()[2:]] == list(KEYS)


@pytest.mark.parametrize("page", ["machine-files", "problem-files", "comparison"])
def test_pages_say_how_to_print_their_tables(page):
    """Where the pages are read as text, the tables are a command away."""
    text = (ROOT / "docs" / f"{page}.md").read_text(encoding="utf-8")
    words = re.findall(r"`python -m amb_design\.spec\.reference ?(\w*)` prints", text)
    assert [word or "fields" for word in words] == re.findall(r"```\{reference\} (\w+)", text)
    for word in words:
        assert REFERENCES[word or "fields"]().count("\n|") > 10


def test_reference_is_printed():
    command = [sys.executable, "-m", "amb_design.spec.reference", "keys"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == key_reference()


def test_comparison_page(tmp_path, capsys):
    text = (ROOT / "docs" / "comparison.md").read_text(encoding="utf-8")
    (file,) = blocks(text, "toml")
    (tmp_path / COMPARISON_FILE).write_text(file)
    found = ad.load_comparison(tmp_path)
    assert list(found.designs) == ["by hand", "optimised", "soft"]
    assert found.seconds == {"soft": 90.0}
    for machine in found.designs.values():
        found.conditions.fit(machine)
    (code,) = blocks(text, "python")
    exec(compile(code, "comparison.md", "exec"), {})
    assert "stability limit speed, certified" in capsys.readouterr().out


def test_controller_example_is_stable():
    """The law of the page on the rotor that the page speaks of, behind the hardware that it writes down."""
    (text,) = blocks((ROOT / "docs" / "controllers.md").read_text(encoding="utf-8"), "toml")
    machine = ad.load("thesis-tuned")
    designed = controlled(machine, tomllib.loads(text)["controller"])
    assert isinstance(designed.controller, ad.LQG)
    assert ad.synthesise(designed).controller.law.states == 26
    assert ad.stability_limit(designed).speed > ad.rpm(14000)


def test_proof_example_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "proofs.md").read_text(encoding="utf-8")
    (block,) = blocks(text, "python")
    names = {}
    exec(compile(block, "proofs.md", "exec"), names)
    proof = names["proof"]
    for shown in (*proof.statements, f"{proof.lower * 30 / 3.141592653589793:.3f} rpm"):
        assert shown in text
    assert (tmp_path / "proof.json").stat().st_size < 1000


def test_simulation_examples_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    with mpl.rc_context({"backend": "agg"}):
        for block in blocks((ROOT / "docs" / "simulation.md").read_text(encoding="utf-8"), "python"):
            exec(compile(block, "simulation.md", "exec"), names)
    assert len(list(tmp_path.glob("*.png"))) == 5
    run = names["run"]
    assert run.peaks["magnet radius"].max() == pytest.approx(83e-6, abs=1e-6)
    assert max(s.share for s in run.saturations) == pytest.approx(0.32, abs=0.005)
    lift, up = names["lift"], names["up"]
    assert {s.kind for s in lift.saturations} == {"current", "contact", "clearance"}  # as the page says
    assert all(s.share < 0.02 for s in lift.saturations)
    first = {s.kind: s for s in reversed(up.saturations) if s.magnet == 1}
    assert first["current"].first < first["contact"].first < 0.27
    assert up.speeds[up.times > first["contact"].first][0] == pytest.approx(ad.rpm(2600), rel=0.05)


def test_relative_links_lead_somewhere():
    for file in [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "problems").glob("*/README.md")]:
        for link in re.findall(r"\]\((?!https?:)([^)#]+)", file.read_text(encoding="utf-8")):
            assert (file.parent / link).exists(), f"{file.name} links to {link}"
