"""An interrupted solution goes on where it was: what was finished stays, and the result is that of an uninterrupted one."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from amb_design.errors import SpecError
from amb_design.optimise.solve import solve
from amb_design.optimise.start import Effort
from optimise import interrupted
from optimise.interrupted import EFFORT, SEED, small_problem

KILLS = {1: 14, 2: 6}
"""By number of workers; two of them take longer to come up than the problem takes to be solved."""


class Runner:
    """Conversation with the process that runs the problem."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "optimise.interrupted"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=Path(interrupted.__file__).parent.parent,
        )

    def run(self, folder: Path, workers: int, seconds: float | None = None) -> str:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print(json.dumps([str(folder), workers, seconds]), file=self.process.stdin, flush=True)
        return self.process.stdout.readline().strip()

    def close(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(60)
        self.process.stdout.close()


@pytest.fixture(scope="module")
def runner() -> Iterator[Runner]:
    made = Runner()
    yield made
    made.close()


@pytest.fixture(scope="module")
def uninterrupted(runner: Runner, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float, Any]:
    """A folder of finished starts, the time that they took, and the result."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    clock = time.monotonic()
    assert runner.run(folder, 1) == "done"
    result = json.loads((folder / "result.json").read_text())
    assert len(result["ranking"]) == interrupted.STARTS
    return folder, time.monotonic() - clock, result


@pytest.mark.parametrize("workers", [1, 2])
def test_killed_and_resumed_to_the_same_ranking(
    workers: int, runner: Runner, uninterrupted: tuple[Path, float, Any], tmp_path: Path
) -> None:
    _, seconds, expected = uninterrupted
    moments, folder, kept, finished = random.Random(workers), tmp_path / "starts", 0, 0
    folder.mkdir()
    (folder / "start-0003.partial").write_text('{"format": "amb_design/start/1", "outc')  # of an earlier interruption
    for _ in range(KILLS[workers]):
        said = runner.run(folder, workers, moments.uniform(0.05, 0.4 if workers == 1 else 1.0) * seconds)
        kept += bool(list(folder.glob("start-*.json")))
        if said == "done":  # all starts were there before the moment came: from the beginning
            assert json.loads((folder / "result.json").read_text()) == expected
            shutil.rmtree(folder)
            finished += 1
        else:
            assert said == "killed"
    assert runner.run(folder, workers) == "done"
    assert json.loads((folder / "result.json").read_text()) == expected
    print(f"{workers} workers: {KILLS[workers] - finished} runs killed, {kept} of them with starts to keep")
    assert kept > KILLS[workers] // 3


def again(folder: Path, **changes: Any) -> None:
    """Resume from the folder of another solution."""
    settings: dict[str, Any] = {"problem": small_problem(), "seed": SEED, "effort": EFFORT, **changes}
    solve(settings.pop("problem"), interrupted.STARTS, settings.pop("seed"), folder=folder, resume=True, **settings)


@pytest.mark.parametrize(
    "changes",
    [{"seed": SEED + 1}, {"problem": small_problem(limit=2.9)}, {"effort": Effort(3, 2, 3)}],
    ids=["seed", "problem", "effort"],
)
def test_starts_of_something_else_are_refused(changes: dict[str, Any], uninterrupted: tuple[Path, float, Any]) -> None:
    folder = uninterrupted[0]
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    with pytest.raises(SpecError, match="belongs to another problem, seed or version"):
        again(folder, **changes)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "null", '{"format": "amb_design/start/1"}', '{"outcome": {}}', '{"outcome": 3}', "\0\xff"]
)
def test_damaged_starts_are_refused(text: str, uninterrupted: tuple[Path, float, Any], tmp_path: Path) -> None:
    folder = tmp_path / "starts"
    shutil.copytree(uninterrupted[0], folder)
    (folder / "start-0002.json").write_text(text, encoding="latin-1")
    with pytest.raises(SpecError, match="is no finished start") as caught:
        again(folder)
    assert "start-0002.json" in str(caught.value)


def test_without_resume_everything_is_made_anew(uninterrupted: tuple[Path, float, Any], tmp_path: Path) -> None:
    folder = tmp_path / "starts"
    shutil.copytree(uninterrupted[0], folder)
    (folder / "start-0002.json").write_text("damaged")
    solve(small_problem(), 1, SEED, effort=Effort(2, 1, 1), folder=folder)
    assert [file.name for file in folder.glob("start-*.json")] == ["start-0000.json"]
