"""`amb-design simulate` as its users see it."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import amb_design as ad
from checks import within
from transient.rotors import levitated

RUN = ("--duration", "0.02 s", "--speed", "2000 rpm", "--modes", "6")


@pytest.fixture
def machine(tmp_path) -> str:
    file = tmp_path / "rotor.toml"
    ad.save(dataclasses.replace(levitated(), source={"title": "a test"}), file)
    return str(file)


def test_json_is_what_the_function_finds(run, machine):
    status, text, _ = run("simulate", machine, *RUN, "--json", "--start", "resting")
    found = json.loads(text)
    result = ad.simulate(ad.load(machine), 0.02, speed=ad.rpm(2000.0), modes=6, start="resting", contact=True)
    assert status == 0
    within([m["radius_m"] for m in found["magnets"]], result.peaks["magnet radius"], 1e-12, "radii at the magnets")
    within([d["radius_m"] for d in found["disks"]], result.peaks["disk radius"], 1e-12, "radii at the disks")
    assert [(s["kind"], s["magnet"]) for s in found["limits_met"]] == [(s.kind, s.magnet) for s in result.saturations]
    assert "contact" in {s["kind"] for s in found["limits_met"]}
    assert found["speed_rpm"] == pytest.approx([2000.0, 2000.0])
    assert (found["start_s"], found["end_s"], found["stopped"]) == (0.0, 0.02, "")
    assert 0.0 < found["energy_error"] < 1e-4


def test_run_up_with_figures_and_its_continuation(run, machine, tmp_path):
    out = tmp_path / "up"
    rise = ("--duration", "0.4 s", "--run-up", "0 rpm", "6000 rpm", "--modes", "4", "--linear")
    status, text, _ = run("simulate", machine, *rise, "--out", str(out))
    assert status == 0
    for words in ("from 0 to 6000 rpm, 20 turns", "Largest values at the magnets", "simulation.npz"):
        assert words in text
    drawn = {"radius", "orbits", "currents", "magnet_forces", "envelope", "waterfall"}
    assert {p.name for p in out.iterdir()} == {f"{d}.png" for d in drawn} | {"simulation.npz", "simulation.json"}
    first = ad.load_transient(out / "simulation.npz")
    assert first.final.time == 0.4
    fall = (*RUN[:2], "--run-up", "6000 rpm", "5000 rpm", *RUN[4:])
    status, text, _ = run("simulate", machine, *fall, "--json", "--start", str(out / "simulation.npz"))
    found = json.loads(text)
    assert status == 0
    assert (found["start_s"], found["end_s"]) == (0.4, pytest.approx(0.42))
    assert found["speed_rpm"] == pytest.approx([6000.0, 5000.0])


def test_an_interrupted_run_goes_on(run, machine, tmp_path):
    out = tmp_path / "out"
    long = ("--duration", "0.04 s", *RUN[2:], "--out", str(out))

    def stop(fraction: float) -> None:
        if fraction > 0.5:
            raise KeyboardInterrupt

    options = {"speed": ad.rpm(2000.0), "modes": 6, "start": "levitated"}
    with pytest.raises(KeyboardInterrupt):
        ad.simulate(ad.load(machine), 0.04, path=out / "chunks", progress=stop, **options)
    kept = len(list((out / "chunks").glob("chunk-*.npz")))
    assert kept >= 2
    status, text, error = run("simulate", machine, *long)
    assert (status, text) == (2, "")
    assert "already holds chunks of a run; resume it, or name another folder" in error
    status, _, _ = run("simulate", machine, *long, "--resume")
    assert status == 0
    assert not (out / "chunks").exists()
    whole = ad.simulate(ad.load(machine), 0.04, **options)
    found = ad.load_transient(out / "simulation.npz")
    assert np.array_equal(found.times, whole.times)
    assert np.abs(found.coordinates - whole.coordinates).max() < 1e-9 * np.abs(whole.coordinates).max()


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ((), 2, "--speed and --run-up exclude each other, and one of them is needed"),
        (
            ("--speed", "10 rpm", "--run-up", "0", "10"),
            2,
            "--speed and --run-up exclude each other, and one of them is needed",
        ),
        (("--speed", "fast"), 2, "--speed = 'fast' is not a number with a unit"),
        (("--speed", "10 m"), 2, "--speed = '10 m' has the wrong unit"),
        (("--speed", "10 rpm", "--duration", "-1 s"), 2, "duration = -1 must be positive"),
        (("--speed", "10 rpm", "--modes", "0"), 2, "modes = 0 is not between 1 and"),
        (("--speed", "10 rpm", "--start", "flying"), 2, "there is no start 'flying'"),
        (("--speed", "10 rpm", "--start", "no.npz"), 2, "no.npz"),
        (("--speed", "10 rpm", "--start", "noise.npz"), 2, "noise.npz: the file is no saved simulation"),
        (("--speed", "10 rpm", "--linear", "--contact"), 2, "does not go with contact"),
        (("--speed", "10 rpm", "--sampling", "0 s"), 2, "period = 0"),
        (("--speed", "10 rpm", "--delay", "1 ms"), 2, "needs a sampling period"),
        (("--speed", "10 rpm", "--method", "hold"), 2, "--method = 'hold' needs a sampling period"),
        (("--speed", "10 rpm", "--sampling", "50 us", "--method", "euler"), 2, "method = 'euler'"),
        (("--speed", "10 rpm", "--out", "noise.npz"), 2, "is a file"),
        (("--speed", "10 rpm", "--out", "no/such"), 2, "does not exist"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(run, machine, tmp_path, monkeypatch, arguments, status, words):
    monkeypatch.chdir(tmp_path)
    Path("noise.npz").write_text("noise")
    if "--out" not in arguments:
        arguments = (*arguments, "--out", "never")
    before = sorted(tmp_path.rglob("*"))
    found, text, error = run("simulate", machine, *arguments)
    assert (found, text) == (status, "")
    assert words in error
    assert error.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before


def test_a_resumption_needs_its_folder(run, machine):
    status, text, error = run("simulate", machine, *RUN, "--resume")
    assert (status, text) == (2, "")
    assert "--resume needs the folder of the run; add --out FOLDER" in error


def test_too_heavy_a_rotor_is_status_3(run, tmp_path):
    file = tmp_path / "heavy.toml"
    heavy = ad.replace(levitated(), {"rotor.disks.mass": 80.0})
    ad.save(dataclasses.replace(heavy, source={"title": "a test"}), file)
    status, text, error = run("simulate", str(file), *RUN)
    assert (status, text) == (3, "")
    assert "do not carry the weight" in error


def test_the_stored_optimum_of_a_variant(run):
    """A regulator with observer that follows the speed; on stiff bearings, where integral action and weight do not go together."""
    which = ("thesis-pid-vs-lqg", "--optimum", "--variant", "scheduled")
    options = ("--duration", "0.02 s", "--run-up", "2000 rpm", "4000 rpm", "--modes", "8", "--json")
    status, text, error = run("simulate", *which, *options)
    assert (status, text) == (3, "")
    assert "do not carry the weight; start it centred or without gravity" in error
    status, text, _ = run("simulate", *which, *options, "--no-gravity")
    found = json.loads(text)
    assert (status, found["name"], found["stopped"]) == (0, "thesis-pid-vs-lqg: scheduled", "")
    assert found["energy_error"] < 1e-4
