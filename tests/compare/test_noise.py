"""Noise currents against the integral of the squared frequency response, computed by python-control."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

import amb_design as ad
from checks import within
from compare.loops import jeffcott, levitated
from independent.everything import anisotropic_machine, isotropic_machine
from independent.test_control import real_loop

DENSITY = 2e-8


def by_quadrature(machine: ad.Machine, speed: float) -> np.ndarray:
    """Root mean square of each axis' current: the integral of DENSITY^2 |H|^2 over the frequencies in Hz."""
    plant, chains, count = real_loop(machine, speed)
    closed = control.feedback(control.ss([], [], [], np.eye(count)), plant * chains)
    values = np.linalg.eigvals(closed.A)
    values = values[(values.imag > 0.5) & (values.imag < 1e5)]
    near = (values.imag[:, None] - values.real[:, None] * np.sinh(np.linspace(-4.0, 4.0, 21))).ravel()
    w = np.unique(np.concatenate([near[near > 0.0], np.geomspace(1e-1, 3e6, 400)]))
    power = np.zeros((len(w), count))
    for i, x in enumerate(w):
        h = chains(1j * x) @ closed(1j * x)  # i = -G S n
        power[i] = (np.abs(h) ** 2).sum(axis=1)
    return DENSITY * np.sqrt(np.trapezoid(power, w, axis=0) / (2.0 * math.pi))


@pytest.mark.parametrize(
    ("make", "speed"), [(jeffcott, 0.0), (levitated, 500.0), (isotropic_machine, 400.0), (anisotropic_machine, 400.0)]
)
def test_against_quadrature(make, speed: float) -> None:
    machine = make()
    expected = by_quadrature(machine, speed)
    one = ad.noise_currents(machine, DENSITY, speed)
    if ad.system(machine).complex_form:
        expected = expected[::2]
    within(one.currents, expected, 3e-3, f"noise currents of {machine.name}")
    assert one.worst == one.currents.max()


def test_both_forms_say_the_same() -> None:
    machine = isotropic_machine()
    one = ad.noise_currents(ad.system(machine), DENSITY, 500.0)
    two = ad.noise_currents(ad.system(machine, complex_form=False), DENSITY, 500.0)
    within(one.currents, two.currents[::2], 1e-8, "complex against real form, y")
    within(one.currents, two.currents[1::2], 1e-8, "complex against real form, z")


def test_an_ideal_derivative_needs_a_filter_behind_it() -> None:
    """Neither low-pass nor amplifier: infinite. An amplifier of second order behind the derivative: finite, and right."""
    bare = ad.replace(jeffcott(), {"controller.low_pass": None, "controller.amplifier": None})
    assert np.isinf(ad.noise_currents(bare, DENSITY).currents).all()
    proportional = ad.replace(bare, {"controller.kd": 0.0, "controller.derivative_time": 0.0})
    damped = ad.replace(proportional, {"bearings": (ad.Bearing(position=0.25, stiffness=1e6, damping=900.0),)})
    assert np.isinf(ad.noise_currents(damped, DENSITY).currents).all()
    driven = ad.replace(jeffcott(), {"controller.low_pass": None})
    with pytest.raises(Exception, match=r"."):
        by_quadrature(bare, 0.0)  # python-control refuses an improper controller
    small = ad.replace(driven, {"controller.derivative_time": 1e-9})  # proper, and as good as ideal up to 1e8 rad/s
    within(
        ad.noise_currents(driven, DENSITY).currents, by_quadrature(small, 0.0)[:1], 5e-3, "ideal derivative, amplifier"
    )


def test_only_the_unfiltered_loop_is_infinite() -> None:
    machine = levitated()
    bare = ad.replace(machine.controller, {"low_pass": None, "amplifier": None})
    mixed = ad.replace(machine, {"magnets[1].controller": bare})
    found = ad.noise_currents(mixed, DENSITY).currents
    assert list(np.isinf(found)) == [False, True]
    passive = ad.replace(machine, {"controller": None, "magnets[1].controller": machine.controller})
    supported = ad.replace(passive, {"bearings": (ad.Bearing(position=0.05, stiffness=3e6, damping=900.0),)})
    alone = ad.noise_currents(supported, DENSITY)
    assert alone.names == ("magnets[1]",)
    assert np.isfinite(alone.currents).all()


def test_what_makes_no_sense() -> None:
    with pytest.raises(ad.SpecError, match="density = 0 must be positive"):
        ad.noise_currents(jeffcott(), 0.0)
    with pytest.raises(ad.ModelError, match="is not stable"):
        ad.noise_currents(levitated(controller=ad.PID(kp=1.0)), DENSITY)
