"""Every joule is accounted for."""

from __future__ import annotations

import numpy as np
import pytest

import amb_design as ad
from checks import within_absolute
from transient.rotors import levitated, passive, shaft

CONSERVATIVE = ad.replace(
    passive(bearings=(ad.Bearing(position=0.0, stiffness=1e6), ad.Bearing(position=0.6, stiffness=2e6))),
    {"rotor.shaft": shaft(viscous_damping=0.0)},
)


@pytest.mark.parametrize("linear", [True, False], ids=["closed form", "collocation"])
def test_a_conservative_rotor_keeps_what_its_unbalance_and_its_weight_give(linear: bool) -> None:
    result = ad.simulate(CONSERVATIVE, 0.2, speed=250.0, modes=8, linear=linear, step=1e-4, tolerance=1e-8)
    assert np.ptp(result.works["damping"]) < 1e-12
    assert np.ptp(result.works["circulation"]) < 1e-9 * np.ptp(result.works["unbalance"])
    assert np.ptp(result.works["unbalance"]) > 0.0
    within_absolute(result.energy_error, np.zeros(len(result.times)), 1e-4, "energy over gross work")


def test_a_free_conservative_rotor_keeps_its_energy() -> None:
    blow = ad.Impulse(position=0.2, y=0.1, z=0.05, time=0.01)
    machine = ad.replace(CONSERVATIVE, {"rotor.disks.unbalance": 0.0})
    result = ad.simulate(machine, 0.2, speed=500.0, modes=8, gravity=False, disturbances=[blow], tolerance=1e-9)
    energy = (result.kinetic + result.potential)[result.times > 0.0101]
    assert energy[0] > 0.0
    within_absolute(energy / energy[0], np.ones(len(energy)), 1e-4, "energy")
    within_absolute(result.works["forces"][-1] / energy[-1], 1.0, 1e-4, "work of the blow")


def test_all_forces_together() -> None:
    """Saturated magnets, contact with friction, base motion, a force, an anisotropic bearing and an accelerated spin."""
    machine = ad.replace(
        levitated(unbalance=4e-5, link_voltage=60.0, max_flux_density=0.6),
        {"bearings": (ad.Bearing(position=0.3, stiffness=1e4, kzz=2e4, kyz=3e3, kzy=-1e3, damping=20.0),)},
    )
    result = ad.simulate(
        machine,
        0.05,
        speed=([0.0, 0.02, 1.0], [200.0, 300.0, 600.0]),
        modes=8,
        start="resting",
        contact=True,
        disturbances=[
            ad.Force(position=0.3, y=150.0, z=-250.0, start=0.01, stop=0.02),
            ad.Shaking(y=20.0, frequency=300.0),
            ad.BaseMotion(times=[0.03, 0.035, 0.04], y=[0.0, 30.0, 0.0]),
        ],
    )
    assert {"current", "voltage", "contact", "clearance"} <= {s.kind for s in result.saturations}
    assert all(np.ptp(work) > 0.0 for work in result.works.values())
    within_absolute(result.energy_error, np.zeros(len(result.times)), 1e-4, "energy over gross work")
