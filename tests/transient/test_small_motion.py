"""Small motions obey the linear analyses: unbalance response, eigenvalues, closed form, and their invariances."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from checks import within
from transient.rotors import amplitude, levitated, passive


def turns(machine: ad.Machine, speed: float, count: int, **options: Any) -> ad.Transient:
    """Whole turns with 32 outputs each, without weight."""
    turn = 2.0 * math.pi / speed
    return ad.simulate(machine, count * turn, speed=speed, step=turn / 32.0, gravity=False, **options)


CASES = {
    "passive": passive(),
    "passive, anisotropic": passive(anisotropic=True),
    "magnets": ad.replace(levitated(unbalance=2e-6), {"controller.ki": 0.0}),
    "magnets, anisotropic": ad.replace(
        levitated(unbalance=2e-6),
        {"controller.ki": 0.0, "controller_z": ad.replace(levitated().controller, {"kp": 12000.0, "ki": 0.0})},
    ),
}


def compare(machine: ad.Machine, speed: float, time: float = 0.3, **options: Any) -> None:
    found = turns(machine, speed, math.ceil(time * speed / (2.0 * math.pi)), **options)
    expected = ad.unbalance_response(machine, [speed])
    for x in (0.2, 0.55):
        steady = expected.at(x)[0]
        error = np.abs(amplitude(found, x) - steady).max() / np.abs(steady).max()
        print(f"{machine.name}, {speed:g} rad/s, x = {x:g} m: {error:.1e}")
        assert error < 1e-3


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("options", [{"linear": True}, {"modes": 8}], ids=["closed form, full", "nonlinear, modal"])
def test_amplitude_and_phase_are_those_of_the_unbalance_response(name: str, options: dict[str, Any]) -> None:
    for speed in (150.0, 320.0, 900.0):
        compare(CASES[name], speed, **options)


def test_amplitude_and_phase_of_the_full_nonlinear_machine() -> None:
    machine = ad.replace(CASES["magnets, anisotropic"], {"rotor.shaft.viscous_damping": 1e-4})  # quick modes die out
    compare(machine, 900.0, time=0.08)


def test_growth_next_to_the_stability_limit_is_that_of_the_eigenvalue() -> None:
    machine = ad.replace(
        levitated(unbalance=0.0), {"rotor.shaft.viscous_damping": 1e-3, "controller.kd": 3.0, "controller.ki": 0.0}
    )
    limit = ad.stability_limit(machine, 4000.0)
    assert limit.status == "limit found"
    for factor in (0.99, 1.01):
        speed = factor * limit.speed
        values = np.linalg.eigvals(ad.system(machine).matrix(speed))
        expected = values[np.argmin(np.abs(values - limit.mode.signed))].real
        assert (expected > 0.0) == (factor > 1.0)
        blow = ad.Impulse(position=0.2, y=1e-2)
        result = ad.simulate(machine, 1.0, speed=speed, gravity=False, disturbances=[blow], step=1e-3)
        energy = np.log(result.kinetic[500:] + result.potential[500:])
        rate = np.polyfit(result.times[500:], energy, 1)[0] / 2.0
        print(f"{factor} of the limit: {rate:.5f} 1/s, eigenvalue {expected:.5f} 1/s")
        within(rate, expected, 5e-3, "growth rate")
