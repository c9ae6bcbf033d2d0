"""What is installed from a wheel works by itself: in an empty folder, without the repository."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")

PROBLEM = """
format = "amb_design/1"
name = "damped"
source = { title = "an example" }
maximise = "stability_limit"
free = { "bearings.damping" = [100, 2000, "log"] }
"""
COMPARISON = """
format = "amb_design/1"
name = "two dampers"
source = { title = "an example" }
conditions = { samples = 0 }
designs.soft = { machine = "." }
designs.hard = { machine = ".", changes = { "bearings.damping" = 800 } }
"""

Run = Callable[..., str]


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from the repository; without a network where hatchling is installed."""
    folder = tmp_path_factory.mktemp("wheel")
    here = ["--no-build-isolation"] if importlib.util.find_spec("hatchling") else []
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", *here, "-w", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True, text=True)
    (file,) = folder.glob("*.whl")
    return file


@pytest.fixture(scope="module")
def programs(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Programs of an environment with the wheel and, from where the tests run, its dependencies."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    found = {"base": str(folder), "platbase": str(folder)}
    own = Path(sysconfig.get_path("purelib", vars=found))
    for lists in (sysconfig.get_path("purelib"), sysconfig.get_path("platlib")):
        (own / "dependencies.pth").write_text(
            f"{lists}\n", encoding="utf-8"
        )  # a folder: its own .pth files stay unread
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", str(python), "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, "--ignore-installed", str(wheel)], check=True, capture_output=True, text=True)
    return python.parent


@pytest.fixture
def run(programs: Path, tmp_path: Path) -> Run:
    """Runs one of these programs in an empty folder; returns what it prints."""
    hidden = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")
    environment = {k: v for k, v in os.environ.items() if k not in hidden} | {"MPLBACKEND": "agg"}

    def call(program: str, *arguments: str) -> str:
        command = [str(programs / program), *arguments]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, f"{' '.join(command)}\n{done.stderr}"
        return done.stdout

    return call


def test_every_file_is_in_it(wheel: Path) -> None:
    wanted = {
        f"amb_design/{prefix}{file.relative_to(folder).as_posix()}"
        for folder, prefix in ((ROOT / "src" / "amb_design", ""), (ROOT / "problems", "problems/"))
        for file in folder.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    names = set(zipfile.ZipFile(wheel).namelist())
    assert wanted <= names, wanted - names
    for name in (
        "py.typed",
        "templates/steel.toml",
        "report/page.css",
        "interop/fmu.c",
        "problems/thesis/machine.toml",
    ):
        assert f"amb_design/{name}" in names
    assert not [name for name in names if not name.startswith(("amb_design/", "amb_design-"))]


def test_it_stands_alone(run: Run, tmp_path: Path) -> None:
    (tmp_path / "who.py").write_text("import sys, amb_design; print(*sys.path, amb_design.__file__, sep='\\n')")
    *searched, found = run("python", "who.py").splitlines()
    assert str(ROOT) not in found
    assert not [path for path in searched if Path(path).is_relative_to(ROOT / "src")]
    assert "thesis-pid-vs-lqg" in run("amb-design", "list")
    assert run("amb-design", "--version").startswith("amb-design ")
    for kind in ("steel", "composite"):
        run("amb-design", "init", kind, "--kind", kind)
        assert "carried by two magnetic bearings" in run("amb-design", "check", kind)


def test_commands_of_the_readme(run: Run, tmp_path: Path) -> None:
    """As they are written there, with a name in the place of FOLDER."""
    (lines,) = (text for text in blocks("") if "FOLDER" in text)
    (tmp_path / "mine").mkdir()
    machine = blocks("toml")[0].replace("rotor.shaft = {", "rotor.shaft = { elements = 2,")  # coarse, to be quick
    for name, text in (("machine", machine), ("problem", PROBLEM), ("comparison", COMPARISON)):
        (tmp_path / "mine" / f"{name}.toml").write_text(text, encoding="utf-8")
    done = []
    for line in lines.splitlines():
        program, command, *arguments = shlex.split(line.replace("FOLDER", "mine"), comments=True)
        done.append(command)
        assert run(program, command, *arguments)
        if command in ("analyse", "optimise", "compare"):
            page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
            assert "<svg" in page
            assert "http://" not in page.replace("http://www.w3.org", "")
    assert done == ["list", "check", "analyse", "analyse", "optimise", "compare", "prove", "simulate"]
    assert (tmp_path / "results" / "simulation.npz").is_file()
    run("amb-design", "check-proof", "proof.json")


def test_python_of_the_readme(run: Run, tmp_path: Path) -> None:
    out = ""
    for k, block in enumerate(blocks("python")):
        (tmp_path / f"block{k}.py").write_text(block, encoding="utf-8")
        out += run("python", f"block{k}.py")
    assert "limit found 9382 rpm forward rotor mode" in out
    assert "verified optimum" in out
    assert (tmp_path / "campbell.svg").stat().st_size > 10_000
