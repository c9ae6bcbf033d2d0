"""What is written as C computes the same, sample by sample."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
import scipy.signal

import amb_design as ad
from amb_design.analysis.sampled import with_chains
from amb_design.errors import ModelError
from amb_design.interop.ccode import controller_code, function_code
from amb_design.interop.control import controller_matrices
from amb_design.interop.discrete import discrete
from amb_design.model.parametric import parametric
from amb_design.synthesis.design import synthesise
from checks import within_absolute
from interop.exported import LAWS, SPEED, machine_with

PERIOD = 5e-5
SAMPLING = ad.Sampling(period=PERIOD)
METHODS = {"tustin": "bilinear", "hold": "zoh"}
"""What scipy calls them."""

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")


@pytest.fixture(scope="module", params=LAWS)
def machine(request: pytest.FixtureRequest) -> ad.Machine:
    return machine_with(request.param)


def compiled(source: Path, *flags: str) -> Path:
    library = source.with_suffix(".so")
    command = ["gcc", "-O2", "-Wall", "-Werror", *flags, "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return library


def samples() -> np.ndarray:
    return 1e-5 * np.random.default_rng(3).standard_normal((400, 4))


@pytest.mark.parametrize("method", METHODS)
def test_sampled_controller_is_that_of_scipy(machine: ad.Machine, method: str) -> None:
    law = discrete(machine, ad.Sampling(period=PERIOD, method=method), SPEED)
    filters = with_chains(synthesise(machine), amplifier=None, delay=0.0)
    a, b, c, d = controller_matrices(parametric(filters, complex_form=False), SPEED)
    gain = machine.controller.amplifier.gain
    system = scipy.signal.cont2discrete((a, b[:, :4], gain * c, gain * d[:, :4]), PERIOD, METHODS[method])
    _, expected, _ = scipy.signal.dlsim(system, samples())
    found = law.run(samples())
    within_absolute(found / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-10, "commands")


@pytest.mark.parametrize("method", METHODS)
def test_sampled_controller_is_that_of_the_simulation(machine: ad.Machine, method: str) -> None:
    """Its commands on the displacements of a simulated run are those that the run's own sampled controller gave."""
    sampling = ad.Sampling(period=PERIOD, method=method)
    law = discrete(machine, sampling, SPEED)
    options = {
        "speed": SPEED,
        "modes": 3,
        "sampling": sampling,
        "linear": True,
        "gravity": False,
    }
    run = ad.simulate(machine, 100 * PERIOD, step=PERIOD, **options)
    places = [machine.sensor_position(m) for m in machine.magnets]
    moved = np.hstack([run.at(x) for x in places])
    expected = -run.final.held  # the sample at the very end is the next run's
    within_absolute(law.run(moved)[-2] / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-10, "commands")


@needs_gcc
def test_controller_code(machine: ad.Machine, tmp_path: Path) -> None:
    source, header = controller_code(machine, tmp_path, SAMPLING, SPEED, name="axes")
    library = ctypes.CDLL(str(compiled(source, "-std=c89", "-pedantic")))
    state = (ctypes.c_double * 200)()
    library.axes_reset(state)
    law, found = discrete(machine, SAMPLING, SPEED), []
    for y in samples():
        current = (ctypes.c_double * 4)()
        library.axes_step(state, (ctypes.c_double * 4)(*y), current)
        found.append(list(current))
    expected = law.run(samples())
    within_absolute(np.array(found) / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-12, "commands")
    assert "#define AXES_INPUTS 4" in header.read_text()


@needs_gcc
def test_controller_code_in_single_precision(machine: ad.Machine, tmp_path: Path) -> None:
    source, _ = controller_code(machine, tmp_path, SAMPLING, SPEED)
    library = ctypes.CDLL(str(compiled(source, "-DCONTROLLER_REAL=float")))
    state, expected, found = (ctypes.c_float * 200)(), discrete(machine, SAMPLING, SPEED).run(samples()), []
    library.controller_reset(state)
    for y in samples():
        current = (ctypes.c_float * 4)()
        library.controller_step(state, (ctypes.c_float * 4)(*y), current)
        found.append(list(current))
    within_absolute(np.array(found) / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-3, "commands")


@needs_gcc
def test_model_and_gradient_code(machine: ad.Machine, tmp_path: Path) -> None:
    loop = ad.closed_loop(machine, ["controller.sensor_gain", "magnets[0].bias_current"])
    rhs = loop.function("rhs", modes=3)
    library = compiled(function_code([rhs], tmp_path, "rotor"), "-O0", "-Wno-unused")
    rng = np.random.default_rng(0)
    x = 1e-6 * rng.standard_normal(rhs.size1_in("x"))
    point = [loop.vector(), x, 300.0, 0.0, 0.0]
    loaded = ca.external("rhs", str(library))
    for ours, theirs in zip(rhs(*point), loaded(*point), strict=True):
        np.testing.assert_allclose(theirs.full(), ours.full(), rtol=1e-12)
    jacobian = rhs.jacobian()
    loaded = ca.external(jacobian.name(), str(library))
    given = point + [0.0] * (jacobian.n_in() - len(point))
    for ours, theirs in zip(jacobian.call(given), loaded.call(given), strict=True):
        np.testing.assert_allclose(theirs.full(), ours.full(), rtol=1e-10, atol=1e-12)


def test_mistakes_are_named(machine: ad.Machine, tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="differentiates displacements without a low-pass"):
        discrete(ad.load("tum-rig"), SAMPLING)
    with pytest.raises(ModelError, match="has no controller"):
        discrete(ad.load("jeffcott"), SAMPLING)
    with pytest.raises(ad.SpecError, match="is no name for a C function"):
        controller_code(machine, tmp_path, SAMPLING, name="my law")
