"""A levitated rotor whose magnets, sensors and hardware are all different, and laws for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import linear_sum_assignment

import amb_design as ad
from amb_design.synthesis.plant import Plant, PlantFamily
from amb_design.synthesis.reduction import basis_of

HARDWARE: dict[str, Any] = {
    "sensor_gain": 7000.0,
    "low_pass": ad.LowPass(frequency=12000.0, damping=0.75),
    "notches": (ad.Notch(frequency=5200.0, damping=0.35, width=0.8),),
    "delay": 4e-5,
    "amplifier": ad.Amplifier(gain=0.8, bandwidth=13000.0, damping=0.65),
}
WEIGHTS: dict[str, Any] = {
    "modes": 5,
    "displacement": 2e-5,
    "current": 0.7,
    "velocity": 0.02,
    "modal_velocity": 0.5,
    "design_speed": 300.0,
}
NOISE: dict[str, Any] = {"sensor_noise": 3e-9, "force_noise": 0.5, "modal_noise": 0.02, "current_noise": 1e-3}


def lqg(**changes: Any) -> ad.LQG:
    """Everything weighed, every noise there, with integral action."""
    law = {"integral": 2e-7, "current_rate": 2e4, "scheduled": False, **HARDWARE, **WEIGHTS, **NOISE}
    return ad.LQG(**{**law, **changes})


def lqr(**changes: Any) -> ad.LQR:
    """The same weights without anything between rotor and law."""
    return ad.LQR(**{**WEIGHTS, **changes})


def rotor(controller: Any = None, **parts: Any) -> ad.Machine:
    """Isotropic, unstable without control, destabilised by the shaft's damping at speed."""
    steel = ad.Isotropic(E=205e9, nu=0.29, density=7850.0)
    segments = (
        ad.Segment(length=0.3, outer_diameter=0.03, material=steel),
        ad.Segment(length=0.35, outer_diameter=0.026, inner_diameter=0.008, material=steel),
    )
    given: dict[str, Any] = {
        "name": "levitated",
        "source": {"title": "tests"},
        "rotor": ad.Rotor(
            shaft=ad.Shaft(segments=segments, viscous_damping=4e-5, hysteretic_damping=2e-4, elements=4),
            disks=(
                ad.Disk(position=0.2, mass=1.1, diametral_inertia=1.2e-3, polar_inertia=2e-3, unbalance=2e-6),
                ad.Disk(position=0.45, mass=1.6, diametral_inertia=2e-3, polar_inertia=3.4e-3, unbalance_phase=1.0),
            ),
        ),
        "magnets": (
            ad.Magnet(
                position=0.08, turns=120, pole_area=3e-4, gap=4e-4, half_angle=0.39, bias_current=2.0, sensor="left"
            ),
            ad.Magnet(position=0.58, current_stiffness=60.0, negative_stiffness=2.5e5, sensor="right"),
        ),
        "sensors": (ad.Sensor(name="left", position=0.11), ad.Sensor(name="right", position=0.545)),
        "controller": controller,
        "operation": ad.Operation(top_speed=3000.0),
    }
    return ad.Machine(**{**given, **parts})


def small(controller: Any = None) -> ad.Machine:
    """Four elements, so that a law may know every mode of the mesh: 18 in each plane."""
    machine = rotor(controller)
    shaft = ad.replace(machine.rotor.shaft, {"segments": machine.rotor.shaft.segments[:1], "elements": 1})
    left, right = (ad.replace(m, {"position": x}) for m, x in zip(machine.magnets, (0.05, 0.24), strict=True))
    return ad.replace(
        machine,
        {
            "rotor": ad.Rotor(
                shaft=shaft, disks=(ad.replace(machine.rotor.disks[1], {"position": 0.24, "unbalance": 3e-6}),)
            ),
            "magnets": (left, ad.replace(right, {"sensor": ""})),
            "sensors": (ad.Sensor(name="left", position=0.08),),
        },
    )


def uneven(controller: Any = None, base: Callable[..., ad.Machine] = rotor) -> ad.Machine:
    """The same between springs that differ in y and z, its magnets turned by different angles."""
    machine = base(controller)
    middle = float(machine.rotor.shaft.segments[0].length)
    return ad.replace(
        machine,
        {
            "name": "uneven",
            "bearings": (ad.Bearing(position=middle, kyy=4e4, kzz=9e4, kyz=5e3, cyy=20.0, czz=30.0),),
            "magnets[0].axes_angle": math.pi / 4.0,
            "magnets[1].axes_angle": 0.2,
        },
    )


def pid(**changes: Any) -> ad.PID:
    """Behind the same hardware; stable on `small`."""
    return ad.PID(**{"kp": 1.1, "ki": 3.0, "kd": 2.2e-3, **HARDWARE, **changes})


def filtered(ports: int) -> ad.Matrices:
    """A gain and a filtered derivative for each port."""
    eye = np.eye(ports)
    return ad.Matrices(a=-2e4 * eye, b=2e4 * eye, c=-40.0 * eye, d=41.1 * eye)


def mixed(ports: int, size: float, seed: int) -> ad.Matrices:
    """Something everywhere, a part of `filtered`."""
    rng, base = np.random.default_rng(seed), filtered(ports)
    parts = {name: size * np.abs(getattr(base, name)[0][0]) * rng.normal(size=(ports, ports)) for name in "abcd"}
    return ad.Matrices(**parts)


def laws() -> dict[str, Any]:
    """Every type of law, with and without what couples axes or follows the speed; all are stable on `small` at rest."""
    one, two, four = (filtered(ports) for ports in (1, 2, 4))
    rates = {"law_rate": mixed(2, 1e-6, 1), "cross_rate": mixed(2, 1e-6, 2)}
    return {
        "PID": pid(),
        "PID with cross gain": pid(kc=0.03),
        "PID with cross gain that follows the speed": pid(kc=0.02, kc_rate=-1e-4),
        "state space, one input": ad.StateSpace(law=one, **HARDWARE),
        "one input, rates": ad.StateSpace(law=one, law_rate=mixed(1, 1e-6, 3), **HARDWARE),
        "state space, an input a magnet": ad.StateSpace(law=two, **HARDWARE),
        "cross": ad.StateSpace(law=two, cross=mixed(2, 1e-3, 4), **HARDWARE),
        "cross and rates": ad.StateSpace(law=two, cross=mixed(2, 1e-3, 5), **rates, **HARDWARE),
        "two inputs a magnet": ad.StateSpace(law=four, law_rate=mixed(4, 3e-7, 6), **HARDWARE),
        "LQG": lqg(),
        "LQG, scheduled": lqg(scheduled=True),
        "LQR": lqr(),
        "LQR, scheduled": lqr(scheduled=True),
    }


def synthesis_plant(machine: ad.Machine) -> Plant:
    """What the LQG law of a machine is designed for."""
    law = machine.controller
    assert isinstance(law, ad.LQG)
    return PlantFamily(ca.SX(0, 1), machine, basis_of(machine, law.modes)).at(np.zeros(0))


def widened(matrix: np.ndarray) -> np.ndarray:
    """A complex matrix as a real one of twice the size."""
    return np.block([[matrix.real, -matrix.imag], [matrix.imag, matrix.real]])


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference of two sets of numbers, matched one to one, relative to the numbers."""
    assert len(first) == len(second)
    cost = np.abs(first[:, None] - second) / np.abs(first)[:, None]
    return float(cost[linear_sum_assignment(cost)].max())
