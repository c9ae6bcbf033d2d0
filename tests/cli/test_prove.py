"""`amb-design prove` and `check-proof` as their users see them."""

from __future__ import annotations

import json

import pytest

from cli.test_cli import FAST


@pytest.fixture
def machine(tmp_path):
    file = tmp_path / "machine.toml"
    file.write_text(FAST.replace("9000 rpm", "30000 rpm"))
    return file


def test_proof_is_written_and_checked(run, machine, tmp_path):
    file = tmp_path / "proof.json"
    status, text, _ = run("prove", str(machine), "--out", str(file), "--within", "bearings.stiffness=5 %")
    assert status == 0
    for words in ("proven stable at every speed up to", "unstable at", "bearings.stiffness within 5 %", "check-proof"):
        assert words in " ".join(text.split())
    assert file.stat().st_size < 2000
    status, text, _ = run("check-proof", str(file), "--machine", str(machine))
    assert status == 0
    assert "stable from 0 to" in text
    softer = tmp_path / "softer.toml"
    softer.write_text(machine.read_text().replace("stiffness = 1e6", "stiffness = 9e5"))
    status, _, error = run("check-proof", str(file), "--machine", str(softer))
    assert status == 2
    assert "belongs to another machine" in error
    assert error.count("\n") == 1


def test_json(run, machine):
    status, text, _ = run("prove", str(machine), "--json")
    document = json.loads(text)
    assert status == 0
    assert document["stable_up_to_rpm"] < document["unstable_at_rpm"] < document["stable_up_to_rpm"] * (1.0 + 2e-6)
    assert document["bytes"] < 1000


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("--within", "bearings.stiffness"), 2, "is no tolerance"),
        (("--within", "bearings.stifness=5 %"), 2, "did you mean"),
        (("--within", "segments.outer_diameter=5 %"), 2, "moves the mass"),
        (("--within", "bearings.stiffness=-0.1"), 2, "between 0 and 1"),
        (("--damping", "1.5"), 2, "between 0 and 1"),
        (("--up-to", "fast"), 2, "is not a number"),
        (("--up-to", "29000 rpm"), 3, "is proven up to"),
        (("--damping", "0.9"), 3, "cannot be proven even at rest"),
        (("--out", "proof.txt"), 2, "is no .json file"),
        (("--optimum",), 2, "problem"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(run, machine, tmp_path, arguments, status, words):
    if "--out" not in arguments:
        arguments = (*arguments, "--out", str(tmp_path / "never.json"))
    found, text, error = run("prove", str(machine), *arguments)
    assert (found, text) == (status, "")
    assert words in error
    assert error.count("\n") == 1
    assert not list(tmp_path.glob("never*"))


def test_stored_optimum(run):
    status, text, _ = run("prove", "composite-spindle", "--optimum", "--json")
    assert status == 0
    assert json.loads(text)["stable_up_to_rpm"] > 26000.0
