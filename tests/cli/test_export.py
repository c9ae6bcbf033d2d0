"""The export command writes what its bridges write, or nothing."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

Run = Callable[..., tuple[int, str, str]]
Files = Callable[..., list[str]]


@pytest.fixture
def files(run: Run, tmp_path: Path) -> Files:
    """Export a target, and say what files there are."""

    def call(to: str, target: str, *more: str) -> list[str]:
        status, output, error = run("export", target, "--to", to, "--out", str(tmp_path / "out"), "--json", *more)
        assert status == 0, error
        written = json.loads(output)["files"]
        assert all(Path(f).stat().st_size > 0 for f in written)
        return [Path(f).name for f in written]

    return call


def test_state_spaces(files: Files, tmp_path: Path) -> None:
    assert files("control", "thesis-tuned", "--speed", "600 rpm", "--modes", "4") == [
        "closed_loop.npz",
        "controller.npz",
        "plant.npz",
    ]
    found = np.load(tmp_path / "out" / "plant.npz")
    assert found["A"].shape == (16, 16)
    assert found["speed"][0] == pytest.approx(62.83185)
    assert files("mat", "thesis-tuned", "--modes", "4") == ["closed_loop.mat", "controller.mat", "plant.mat"]
    again = loadmat(tmp_path / "out" / "plant.mat")
    assert again["A"].shape == (16, 16)
    assert again["inputs"][0].strip() == "current magnets[0] y"


@pytest.mark.parametrize(
    ("target", "method", "told"),
    [
        (["thesis-tuned"], [], "by the trapezoidal rule"),
        (["thesis-tuned"], ["--method", "hold"], "exactly for inputs that are held"),
        (["tum-rig-pid-vs-lqg", "--variant", "lqg", "--optimum"], [], "by the trapezoidal rule"),
    ],
)
def test_c(files: Files, tmp_path: Path, target: list[str], method: list[str], told: str) -> None:
    written = files("c", *target, "--modes", "2", *method)
    assert written == ["controller.c", "controller.h", "model.c", "model.h"]
    assert f"Made discrete {told}" in (tmp_path / "out" / "controller.c").read_text()


def test_ross(files: Files) -> None:
    assert files("ross", "friswell-5-9-1") == ["rotor.toml"]


def test_mistakes_leave_nothing(run: Run, tmp_path: Path) -> None:
    for arguments, message in (
        (["thesis-tuned", "--to", "step"], "is no target; choose one of c, control, fmu, mat, ross"),
        (["thesis-tuned", "--to", "c", "--method", "zoh"], "method = 'zoh' is not known; choose one of tustin, hold"),
        (["thesis-tuned", "--to", "c", "--period", "0 s"], "period = 0 s must be positive"),
        (["thesis-tuned", "--to", "ross"], "holds magnets, which ROSS does not have"),
    ):
        status, output, error = run("export", *arguments, "--out", str(tmp_path / "out"))
        assert (status, output, error.count("\n")) == (2, "", 1)
        assert message in error
        assert not (tmp_path / "out").exists()
