"""`amb-design init` gives a file that everything accepts, and takes nothing away."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import amb_design as ad
from amb_design.analysis.outline import outline
from amb_design.spec.templates import KINDS, start, template
from report.pages import read

README = Path(__file__).parents[2] / "README.md"


@pytest.mark.parametrize("kind", KINDS)
def test_a_start_is_sound(kind):
    """Nothing unusual, no warning, every standard met, and a limit to work on."""
    machine = ad.loads(template(kind))
    assert outline(machine)["unusual"] == []
    analysis = ad.analyse(machine)
    assert analysis.limit.status == "limit found"
    assert analysis.limit.certified
    assert analysis.limit.speed > 2.0 * machine.operation.service_speed
    assert [f.text for f in analysis.findings] == []
    assert {c.verdict for c in analysis.criteria} == {"passes"}


@pytest.mark.parametrize("kind", KINDS)
def test_every_part_of_the_file_is_explained(kind):
    lines = template(kind).splitlines()
    assert sum("#" in line for line in lines) > 25
    assert max(map(len, lines)) <= 132


def test_init_check_analyse(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, output, errors = run("init", "mine")
    assert (status, errors) == (0, "")
    assert "amb-design check mine" in output
    assert (tmp_path / "mine" / "machine.toml").read_text(encoding="utf-8") == template("steel")
    status, output, _ = run("check", "mine")
    assert status == 0
    assert "carried by two magnetic bearings" in output
    status, output, _ = run("analyse", "mine", "--json")
    assert status == 0
    assert json.loads(output)["stability_limit"]["status"] == "limit found"


def test_init_never_overwrites(run, tmp_path):
    file = tmp_path / "machine.toml"
    file.write_text("mine")
    for target in (tmp_path, file):
        status, output, errors = run("init", str(target))
        assert (status, output) == (2, "")
        assert errors == f"amb-design: {file} exists already; name another folder\n"
    assert file.read_text() == "mine"


def test_init_refuses_other_kinds(run, tmp_path):
    status, _, errors = run("init", str(tmp_path / "new"), "--kind", "wood")
    assert status == 2
    assert errors == "amb-design: kind = 'wood' is no kind of machine; choose steel or composite\n"
    assert not (tmp_path / "new").exists()


def test_start_makes_the_folders_it_needs(tmp_path):
    file = start(tmp_path / "a" / "b", "composite")
    assert ad.load(tmp_path / "a" / "b") == ad.loads(file.read_text(encoding="utf-8"))


def test_fifteen_lines_and_one_command_give_a_campbell_diagram(run, tmp_path, monkeypatch):
    """The lines of the README, as somebody would type them who has never seen this package."""
    (lines,) = re.findall(r"```toml\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(lines.strip().splitlines()) <= 15
    monkeypatch.chdir(tmp_path)
    (tmp_path / "machine.toml").write_text(lines, encoding="utf-8")
    status, output, _ = run("analyse", ".", "--out", "results")
    assert status == 0
    assert "results/report.html shows all of it" in output
    assert (tmp_path / "results" / "campbell.png").stat().st_size > 20_000
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    limit = ad.stability_limit(ad.loads(lines))
    assert f"Stability limit: {limit.speed_rpm:.0f} rpm" in page
    labels = [given["aria-label"] for tag, given in read(page).tags if tag == "svg"]
    assert any(label.startswith("Campbell diagram of") for label in labels)


def test_shell_completion_knows_commands_and_problems():
    def completed(words: str) -> list[str]:
        program = "import sys; sys.argv[0] = 'amb-design'; from amb_design.cli import main; main()"
        environment = {
            **os.environ,
            "_AMB_DESIGN_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": str(len(words.split()) - 1),
        }
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment)
        return done.stdout.split()

    assert completed("amb-design ana") == ["analyse"]
    assert completed("amb-design check tum") == ["tum-rig", "tum-rig-pid", "tum-rig-pid-vs-lqg"]
