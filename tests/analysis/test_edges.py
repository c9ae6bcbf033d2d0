"""Machines at the edge of what the analysis can decide, each once a wrong answer or a traceback."""

from __future__ import annotations

import dataclasses
import math

import pytest

import amb_design as ad
from amb_design.analysis.summary import analyse

STEEL = ad.Isotropic(E=2.1e11, nu=0.3, density=7850.0)


def machine(elements: int = 4, viscous: float = 1e-5, **parts) -> ad.Machine:
    segment = ad.Segment(length=1.0, outer_diameter=0.05, material=STEEL)
    shaft = ad.Shaft(segments=(segment,), viscous_damping=viscous, elements=elements)
    given = {"rotor": ad.Rotor(shaft=shaft), "operation": ad.Operation(top_speed=1000.0), **parts}
    return ad.Machine(name="edge", **given)


def bearing(position: float, **fields) -> ad.Bearing:
    return ad.Bearing(position=position, stiffness=1e7, damping=300.0, **fields)


def magnet(position: float, **fields) -> ad.Magnet:
    return ad.Magnet(position=position, turns=100, pole_area=4e-4, gap=5e-4, bias_current=3.0, **fields)


def test_rounding_is_no_onset():
    """Nothing destabilises this rotor; its highest modes have almost no damping."""
    both = (magnet(0.1), magnet(0.9))
    limit = ad.stability_limit(machine(24, 0.0, magnets=both, controller=ad.PID(kp=3e4, kd=60.0)))
    assert limit.status == "none below the top speed"
    assert limit.onsets == ()


@pytest.mark.parametrize("offset", [1e-3, 1e-4])
def test_stations_close_together(offset):
    sensors = (ad.Sensor(name="l", position=offset), ad.Sensor(name="r", position=1.2 - offset))
    near = {"sensors": sensors, "magnets[0].sensor": "l", "magnets[1].sensor": "r"}
    limit = ad.stability_limit(ad.replace(ad.load("thesis-tuned"), near), first_only=True)
    assert limit.status == "limit found"
    assert limit.speed_rpm == pytest.approx(9382.0, rel=450.0 * offset / 9.382 + 1e-3)


@pytest.mark.parametrize("elements", [1, 4, 12, 16, 24, 48])
def test_a_free_rotor_is_marginal_on_any_mesh(elements):
    limit = ad.stability_limit(machine(elements))
    assert limit.status == "marginal"
    assert math.isnan(limit.speed)


def test_a_shaft_on_pins_has_a_limit():
    pins = (ad.Pin(position=0.0), ad.Pin(position=1.0))
    limit = ad.stability_limit(machine(pins=pins))
    first = next(c for c in ad.critical_speeds(machine(pins=pins)) if c.whirl == "forward")
    assert limit.speed == pytest.approx(first.speed, rel=1e-4)  # rotating damping alone: Zorzi & Nelson


def test_no_onset_twice_when_the_budget_ends():
    whole = ad.stability_limit(ad.load("thesis-tuned"))
    short = ad.stability_limit(ad.load("thesis-tuned"), budget=8)
    assert [o.speed for o in short.onsets] == pytest.approx([o.speed for o in whole.onsets], rel=1e-6)


def test_a_pair_counts_once_in_the_real_form():
    uneven = ad.replace(ad.load("thesis-tuned"), {"bearings[0].kzz": 1.7518e7})
    limit = ad.stability_limit(uneven, first_only=True)
    assert [o.count for o in limit.onsets] == [1]


@pytest.mark.parametrize("top", [0.0, -1.0, math.nan, math.inf])
def test_top_speed_must_make_sense(top):
    with pytest.raises(ad.ModelError, match="must be positive and finite"):
        ad.stability_limit(machine(bearings=(bearing(0.0), bearing(1.0))), top)


def test_equivalent_coefficients_with_controllers_in_the_magnets():
    shared = ad.load("thesis-tuned")
    own = tuple(dataclasses.replace(m, controller=shared.controller) for m in shared.magnets)
    apart = dataclasses.replace(shared, magnets=own, controller=None)
    first, second = (ad.equivalent_coefficients(m, 700.0, points=20) for m in (shared, apart))
    assert second.changes == first.changes
    assert second.critical_speed == pytest.approx(first.critical_speed)


def test_stations_that_differ_in_the_last_bits():
    disk = ad.Disk(position=0.1 * 3, mass=5.0, diametral_inertia=0.02, polar_inertia=0.03)
    shaft = machine(bearings=(bearing(0.0), bearing(0.3), bearing(1.0)))
    shaft = dataclasses.replace(
        shaft, rotor=dataclasses.replace(shaft.rotor, disks=(disk,)), operation=ad.Operation(top_speed=1e4)
    )
    document = analyse(shaft).document()
    assert document["stability_limit"]["status"] == "limit found"
    assert document["limit_sensitivities"]


def test_saturation_by_the_bias_alone():
    both = (magnet(0.1, max_flux_density=0.3), magnet(0.9))
    topics = [f.topic for f in ad.findings(machine(magnets=both, controller=ad.PID(kp=2e4, kd=20.0)))]
    assert "flux" in topics


def test_inadmissible_three_dimensional_ply():
    ply = ad.Orthotropic(E1=10e9, E2=9e9, G12=3e9, G13=3e9, G23=2.37e9, nu12=0.3, density=1500.0)
    tube = ad.Segment(length=1.0, inner_diameter=0.05, plies=ad.layup(ply, [0.0], 5e-3))
    with pytest.raises(ad.SpecError, match="G23"):
        ad.Shaft(segments=(tube,), shear_correction=0.5, ply_law="three-dimensional")


def test_low_critical_speeds_survive_a_fine_mesh():
    segment = ad.Segment(length=1.0, outer_diameter=0.02, material=STEEL)
    soft = tuple(ad.Bearing(position=x, stiffness=100.0, damping=5.0) for x in (0.0, 1.0))
    counts = {
        n: len(
            ad.critical_speeds(machine(rotor=ad.Rotor(shaft=ad.Shaft(segments=(segment,), elements=n)), bearings=soft))
        )
        for n in (12, 100)
    }
    assert counts[100] == counts[12]


@pytest.mark.parametrize("speeds", [[], [10.0, 5.0], [math.nan], [-1.0, 2.0]])
def test_speeds_must_make_sense(speeds):
    plain = machine(bearings=(bearing(0.0), bearing(1.0)))
    with pytest.raises(ad.ModelError, match="speeds must be"):
        ad.campbell(plain, speeds)


def test_an_integrator_has_no_response_at_zero_frequency():
    ideal = machine(magnets=(magnet(0.1), magnet(0.9)), controller=ad.PID(kp=2e4, ki=1e4, kd=20.0))
    with pytest.raises(ad.SolveError, match="has a pole at 0 rad/s"):
        ad.sensitivity(ideal, 0.0, [0.0, 1.0])


def test_symbols_are_refused_by_analyses():
    import casadi as ca

    symbolic = machine(bearings=[ad.Bearing(position=0.0, stiffness=ca.SX.sym("k")), bearing(1.0)])
    with pytest.raises(ad.ModelError, match=r"bearings\[0\].stiffness is a symbol"):
        ad.stability_limit(symbolic)


def test_numpy_numbers_and_lists_are_welcome():
    import numpy as np

    plain = machine(bearings=[bearing(np.float64(0.0)), bearing(np.int64(1))])
    assert isinstance(plain.bearings, tuple)
    assert ad.stability_limit(plain).speed > 0.0
