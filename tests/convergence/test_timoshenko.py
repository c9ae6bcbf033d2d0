"""Order of convergence against the exact whirl roots of a simply supported spinning Timoshenko shaft."""

from __future__ import annotations

import numpy as np
import pytest
from published.reference import case

import amb_design as ad

CASE = case("rotor_spinning_timoshenko_exact")
INPUTS = CASE["inputs"]
ROOTS = CASE["outputs"]["whirl_roots_rad_s_per_mode_n1_2_3"]


def shaft(elements: int) -> ad.Machine:
    steel = ad.Isotropic(E=INPUTS["E"], nu=INPUTS["nu"], density=INPUTS["rho"])
    segment = ad.Segment(length=INPUTS["L"], outer_diameter=INPUTS["diameter"], material=steel)
    return ad.Machine(
        name="spinning shaft",
        rotor=ad.Rotor(
            shaft=ad.Shaft(segments=(segment,), shear_correction=INPUTS["kappa"], elements=elements)
        ),
        pins=(ad.Pin(position=0.0), ad.Pin(position=INPUTS["L"])),
        operation=ad.Operation(top_speed=1000.0),
    )


def errors(elements: int, speed: float) -> np.ndarray:
    """Relative error of the low backward and forward root of modes 1 to 3, shape (3, 2)."""
    modes = ad.spectrum(shaft(elements), speed, 8)
    found = {w: sorted(m.frequency for m in modes if m.whirl == w) for w in ("backward", "forward")}
    exact = np.abs(np.array(ROOTS[str(float(speed))])[:, 1:3])
    computed = np.stack([found["backward"][:3], found["forward"][:3]], axis=1)
    return np.abs(computed / exact - 1.0)


@pytest.mark.parametrize("speed", [0, 500, 1000])
def test_exact_roots_at_20_elements(speed):
    worst = errors(20, speed).max()
    print(f"spinning Timoshenko shaft, 20 elements, {speed} rad/s: {worst:.1e} (tolerance 1e-3)")
    assert worst <= 1e-3


@pytest.mark.parametrize("speed", [0, 500, 1000])
def test_order_of_convergence(speed):
    meshes = np.array([4, 6, 8, 12])
    table = np.stack([errors(int(n), speed) for n in meshes])
    order = -np.polyfit(np.log(meshes), np.log(table.reshape(len(meshes), -1)), 1)[0]
    print(f"order of convergence at {speed} rad/s, modes 1 to 3, backward and forward: {np.round(order, 2)}")
    assert (order >= 3.5).all()
