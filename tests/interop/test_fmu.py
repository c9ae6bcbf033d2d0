"""Units run by FMPy do what the simulation does."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.interop.discrete import discrete
from amb_design.interop.fmu import controller_fmu, model_fmu
from checks import within_absolute
from interop.exported import LAWS, SPEED, machine_with

pytestmark = [
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler is installed"),
    pytest.mark.filterwarnings("ignore"),
]
PERIOD = 5e-5
SAMPLING = ad.Sampling(period=PERIOD)


@pytest.fixture(scope="module")
def fmpy() -> Any:
    pytest.importorskip("fmpy.validation", reason="FMPy is not installed")
    return pytest.importorskip("fmpy", reason="FMPy is not installed")


@pytest.fixture(scope="module", params=LAWS)
def machine(request: pytest.FixtureRequest) -> ad.Machine:
    return machine_with(request.param)


def test_model_unit_moves_as_the_simulation(fmpy: Any, machine: ad.Machine, tmp_path: Path) -> None:
    file = tmp_path / "rotor.fmu"
    model_fmu(machine, file, SPEED, modes=2)
    assert fmpy.validation.validate_fmu(str(file)) == []
    run = ad.simulate(machine, 0.01, speed=SPEED, modes=2, step=5e-4, tolerance=1e-9)
    outputs = [f"{what} magnets[{k}] {d}" for what in ("current", "force") for k in range(2) for d in "yz"]
    options = {"solver": "CVode", "stop_time": 0.01, "output_interval": 5e-4, "relative_tolerance": 1e-9}
    found = fmpy.simulate_fmu(str(file), output=outputs, fmi_type="ModelExchange", **options)
    table = np.array([[row[n] for n in outputs] for row in found])
    expected = np.hstack([run.currents.reshape(-1, 4), run.magnet_forces.reshape(-1, 4)])
    assert table.shape == expected.shape
    scale = np.abs(expected).max(axis=0)
    assert scale.min() > 1e-4
    within_absolute(table / scale, expected / scale, 1e-5, "currents and forces")


@pytest.mark.parametrize("method", ["tustin", "hold"])
def test_controller_unit_answers_sample_by_sample(fmpy: Any, machine: ad.Machine, tmp_path: Path, method: str) -> None:
    file, sampling = tmp_path / "law.fmu", ad.Sampling(period=PERIOD, method=method)
    controller_fmu(machine, file, sampling, SPEED)
    assert fmpy.validation.validate_fmu(str(file)) == []
    law, count = discrete(machine, sampling, SPEED), 60
    seen = 1e-5 * np.random.default_rng(5).standard_normal((count + 1, 4))
    signal = np.array(
        [(k * PERIOD, *row) for k, row in enumerate(seen)], dtype=[("time", float), *[(n, float) for n in law.inputs]]
    )
    found = fmpy.simulate_fmu(
        str(file), stop_time=count * PERIOD, output_interval=PERIOD, input=signal, output=list(law.outputs)
    )
    table = np.array([[row[n] for n in law.outputs] for row in found])[1:]
    expected = law.run(seen)[:count]
    within_absolute(table / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-9, "commands")


def test_mistakes_are_named(machine: ad.Machine, tmp_path: Path) -> None:
    with pytest.raises(ad.SpecError, match=r"is no \.fmu file"):
        controller_fmu(machine, tmp_path / "law.zip", SAMPLING)


def test_what_is_missing_is_said_at_once(machine: ad.Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy", None)
    for make in (model_fmu, lambda m, file: controller_fmu(m, file, SAMPLING)):
        with pytest.raises(ad.SolveError, match="fmpy is not installed; run: pip install fmpy"):
            make(machine, tmp_path / "unit.fmu")
    assert not list(tmp_path.iterdir())
