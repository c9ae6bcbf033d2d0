"""Saturation, touch-down, drift and lift-off happen when they should."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import amb_design as ad
from amb_design.model.magnet import current_stiffness, negative_stiffness
from checks import within, within_absolute
from transient.rotors import levitated, magnet, pid


def kinds(result: ad.Transient) -> set[str]:
    return {s.kind for s in result.saturations}


@pytest.mark.parametrize(("factor", "stays"), [(0.98, False), (1.02, True)])
def test_a_magnet_needs_more_gain_than_its_negative_stiffness(factor: float, stays: bool) -> None:
    gain = factor * float(negative_stiffness(magnet(0.0)) / current_stiffness(magnet(0.0)))
    machine = levitated(unbalance=0.0, controller=pid(kp=gain, ki=0.0, kd=40.0), sensors=False)
    blow = [ad.Impulse(position=x, y=1e-4) for x in (0.05, 0.55)]
    result = ad.simulate(machine, 1.5, speed=0.0, modes=6, gravity=False, disturbances=blow, step=1e-3)
    radius = result.radius(0.05)
    assert (radius[-1] < radius.max() / 2.0) == stays
    assert bool(result.stopped) == (not stays and radius[-1] >= 5e-4)
    if not stays:
        assert radius[-1] == radius.max()


def test_an_uncontrolled_rotor_falls_to_the_pole_and_the_result_up_to_then_is_kept() -> None:
    machine = ad.replace(levitated(), {"controller": None})
    result = ad.simulate(machine, 1.0, speed=0.0, modes=6)
    assert "left the air gap of magnets[" in result.stopped
    assert f"{result.times[-1]:.6g} s" in result.stopped
    assert result.times[-1] < 0.1
    assert max(result.radius(x)[-1] for x in (0.05, 0.55)) >= 5e-4
    assert max(result.radius(x)[-2] for x in (0.05, 0.55)) < 5e-4


def test_a_resting_rotor_lifts_off_and_settles_where_it_levitates() -> None:
    machine = levitated()
    machine = ad.replace(machine, {"controller.ki": 3e5})
    up = ad.simulate(machine, 0.6, speed=0.0, modes=8, start="resting", contact=True)
    for x in (0.05, 0.55):  # at first each end lies a little beyond the clearance, straight below
        v, w = up.at(x)[0]
        assert 0.0 < -v - 2.5e-4 < 5e-6
        assert abs(w) < 1e-9
    weight = 9.80665 * (8.0 + 7860.0 * np.pi / 4.0 * 0.03**2 * 0.6)
    within(up.contact_forces[0, :, 0].sum(), weight, 1e-6, "weight on the backup bearings")
    level = ad.simulate(machine, 0.01, speed=0.0, modes=8, start="levitated")
    assert np.abs(level.rates).max() < 1e-9
    within_absolute(up.at(0.05)[-1], level.at(0.05)[-1], 2e-6, "settled place")
    within_absolute(up.currents[-1], level.currents[-1], 0.02, "settled currents")
    touching = np.hypot(*np.moveaxis(up.contact_forces, 2, 0)) > 0.0
    beyond = np.stack([up.radius(x) for x in (0.05, 0.55)], axis=1) > 2.5e-4
    assert not (touching & ~beyond).any()
    assert not touching[-100:].any()


def test_currents_never_exceed_the_limits() -> None:
    machine = levitated(max_current=5.0, unbalance=0.0)
    push = ad.Force(position=0.3, y=-400.0, start=0.01, stop=0.05)
    result = ad.simulate(machine, 0.1, speed=300.0, modes=8, start="levitated", contact=True, disturbances=[push])
    assert "current" in kinds(result)
    assert np.abs(result.currents).max() <= 2.0 + 1e-12  # 5 A less the bias of 3 A
    assert np.abs(result.currents).max() > 1.99
    free = ad.simulate(machine, 0.005, speed=300.0, modes=8, start="levitated")
    assert not free.saturations


def test_the_link_limits_the_rate_of_the_currents() -> None:
    step = [ad.Force(position=0.3, y=-200.0, start=0.002)]
    common = {"speed": 0.0, "modes": 8, "start": "levitated", "disturbances": step, "step": 2e-5}
    weak = ad.simulate(levitated(unbalance=0.0, link_voltage=6.0), 0.012, contact=True, **common)
    strong = ad.simulate(levitated(unbalance=0.0, link_voltage=400.0), 0.012, contact=True, **common)
    assert "voltage" in kinds(weak)
    assert "voltage" not in kinds(strong)
    assert np.abs(weak.voltages).max() <= 6.0 * (1.0 + 1e-6) < np.abs(strong.voltages).max() < 400.0


def test_flux_saturation_bounds_the_force() -> None:
    machine = levitated(unbalance=0.0, max_flux_density=0.5)
    push = ad.Force(position=0.3, y=-150.0, start=0.002)
    result = ad.simulate(machine, 0.03, speed=0.0, modes=8, start="levitated", contact=True, disturbances=[push])
    assert "flux" in kinds(result)
    m = machine.magnets[0]
    most = 0.5**2 * m.pole_area * np.cos(m.half_angle) / (4e-7 * np.pi)
    assert np.abs(result.magnet_forces).max() <= most * (1.0 + 1e-9)


def test_touch_down_of_an_unbalanced_rotor_stays_near_the_clearance() -> None:
    machine = ad.replace(levitated(unbalance=2e-4), {"controller": None})
    machine = dataclasses.replace(
        machine, magnets=tuple(dataclasses.replace(m, bias_current=1e-3) for m in machine.magnets)
    )
    result = ad.simulate(machine, 0.2, speed=200.0, modes=6, contact=True)
    assert "contact" in kinds(result)
    assert not result.stopped
    touching = np.hypot(*np.moveaxis(result.contact_forces, 2, 0)) > 0.0
    radius = np.stack([result.radius(x) for x in (0.05, 0.55)], axis=1)
    assert not touching[radius <= 2.5e-4].any()
    assert 2.5e-4 < radius.max() < 3.5e-4
    first = min(s.first for s in result.saturations if s.kind == "contact")
    within(first, np.sqrt(2.0 * 2.5e-4 / 9.80665), 0.1, "time to fall through the clearance")
