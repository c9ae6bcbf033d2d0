"""The shaft element converges to the exact whirl roots of a spinning, simply supported Timoshenko shaft."""

from __future__ import annotations

import itertools
import math
from functools import cache

import numpy as np
import pytest

import amb_design as ad
from checks import within
from published.reference import case, uniform_shaft

REFERENCE = case("rotor_spinning_timoshenko_exact")
SPEEDS = REFERENCE["inputs"]["Omega_rad_s"]
MODES = (1, 2, 3)


@cache
def roots(elements: int, speed: float) -> np.ndarray:
    """Whirl roots of the finite-element model, forward ones positive."""
    i = REFERENCE["inputs"]
    machine = ad.Machine(
        name="spinning shaft",
        rotor=ad.Rotor(
            shaft=uniform_shaft(
                ad.Isotropic(E=i["E"], nu=i["nu"], density=i["rho"]),
                i["L"],
                i["diameter"],
                shear_correction=i["kappa"],
                elements=elements,
            )
        ),
        pins=(ad.Pin(position=0.0), ad.Pin(position=i["L"])),
        operation=ad.Operation(top_speed=1000.0),
    )
    loop = ad.system(machine)
    assert loop.complex_form
    values = np.linalg.eigvals(loop.matrix(speed))
    assert np.abs(values.real).max() < 1e-9 * np.abs(values).max()  # nothing dissipates
    return np.asarray(values.imag)


def exact(speed: float, mode: int) -> tuple[float, float, float, float]:
    """Backward high, backward low, forward low, forward high."""
    four = REFERENCE["outputs"]["whirl_roots_rad_s_per_mode_n1_2_3"][f"{speed:.1f}"][mode - 1]
    return tuple(four)


def nearest(elements: int, speed: float, root: float) -> float:
    values = roots(elements, speed)
    return float(values[np.argmin(np.abs(values - root))])


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("speed", SPEEDS)
def test_reference_roots(speed: float, mode: int) -> None:
    """The reference's own equation holds: a determinant of two by two."""
    i = REFERENCE["inputs"]
    area, second = math.pi * i["diameter"] ** 2 / 4.0, math.pi * i["diameter"] ** 4 / 64.0
    k = mode * math.pi / i["L"]
    shear = i["kappa"] * i["E"] / (2.0 * (1.0 + i["nu"])) * area
    for w in exact(speed, mode):
        a = shear * k**2 - i["rho"] * area * w**2
        d = i["E"] * second * k**2 + shear - i["rho"] * second * (w**2 - 2.0 * speed * w)
        assert abs(a * d - (shear * k) ** 2) < 1e-9 * (abs(a) + shear * k**2) * (abs(d) + shear)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("speed", SPEEDS)
def test_twenty_elements(speed: float, mode: int) -> None:
    """Stated tolerance: 1e-3 at 20 elements."""
    expected = exact(speed, mode)[1:3]
    computed = [nearest(20, speed, root) for root in expected]
    within(computed, expected, 1e-3, f"mode {mode}, {speed} rad/s, 20 elements, backward and forward")


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("whirl", ["backward", "forward"])
def test_order_of_convergence(speed: float, mode: int, whirl: str) -> None:
    """Stated: observed order of convergence of the frequencies at least 3.5."""
    root = exact(speed, mode)[1 if whirl == "backward" else 2]
    meshes = (8, 16, 32)
    errors = [abs(nearest(n, speed, root) / root - 1.0) for n in meshes]
    orders = [math.log2(a / b) for a, b in itertools.pairwise(errors)]
    print(f"mode {mode}, {whirl}, {speed} rad/s: errors {errors}, orders {[round(o, 2) for o in orders]}")
    assert errors[-1] > 1e-11, "nothing but rounding is left to measure"
    assert min(orders) >= 3.5
