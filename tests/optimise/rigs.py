"""Machines and problems that the tests of the optimiser share."""

from __future__ import annotations

import math
from typing import Any

import amb_design as ad
from independent.everything import anisotropic_machine, isotropic_machine

TOP = 1000.0
"""End of the range of speeds of `everything` [rad/s]: the machine is stable to a little above."""

LIMITS: dict[str, Any] = {
    "decay_rate": 1.0,
    "damping_ratio": 0.01,
    "sensitivity_peak": 3.0,
    "bias_current": 3.0,
    "control_current": 1.0,
    "control_current_ratio": 0.5,
    "total_current": 4.0,
    "noise_current": {"limit": 1e-3, "noise": 1e-9},
    "noise_current_ratio": {"limit": 1e-3, "noise": 1e-9},
    "flux_density": 1.2,
    "voltage": 100.0,
    "displacement_ratio": 0.5,
    "separation_margin": 0.1,
    "hoop_strain": {"limit": 4e-3, "overspeed": 1.1},
    "torsional_ratio": 1.2,
    "surface_speed": 300.0,
    "mass": 50.0,
    "copper_loss": 100.0,
}
"""Every quantity that can be limited, with bounds of the usual size."""


def _about(value: float, by: float = 0.1) -> tuple[float, float]:
    return value * (1.0 - by), value * (1.0 + by)


def everything(anisotropic: bool = False, elements: int = 6) -> ad.Machine:
    """The machine with every kind of number, with what the quantities need besides, and a sleeve under its right magnet."""
    machine = anisotropic_machine() if anisotropic else isotropic_machine()
    common = {
        "turns": 180.0,
        "pole_area": 6e-4,
        "half_angle": 0.3,
        "gap": 6e-4,
        "bias_current": 2.0,
        "resistance": 0.4,
        "leakage_inductance": 2e-4,
    }
    left, right = machine.magnets
    sleeve = ad.Disk(
        name="sleeve", position=0.68, inner_diameter=0.052, outer_diameter=0.09, width=0.04, density=7700.0
    )
    first, second, third = machine.rotor.disks
    return ad.replace(
        machine,
        {
            "magnets": (
                ad.replace(left, {"resistance": 0.5, "clearance": 2e-4, "leakage_inductance": 1e-4}),
                ad.Magnet(
                    position=0.68,
                    sensor="right",
                    controller=right.controller,
                    axes_angle=right.axes_angle,
                    **common,  # type: ignore[arg-type]
                ),
            ),
            "rotor.disks": (first, second, sleeve, third),
            "rotor.shaft.elements": elements,
            "operation": ad.Operation(top_speed=TOP, service_speed=500.0),
        },
    )


def free_numbers(machine: ad.Machine) -> dict[str, Any]:
    """Bounds about every kind of number that a design can change."""
    paths = [
        *(
            "controller.kp",
            "controller.ki",
            "controller.kd",
            "controller.low_pass.frequency",
            "controller.low_pass.damping",
        ),
        *("controller.notches[0].frequency", "controller.notches[0].damping", "controller.notches[0].width"),
        *(
            "controller.delay",
            "controller.derivative_time",
            "controller.amplifier.bandwidth",
            "magnets[1].controller.kd",
        ),
        *(
            "magnets[0].bias_current",
            "magnets[0].gap",
            "magnets[0].pole_area",
            "magnets[0].half_angle",
            "magnets[0].turns",
        ),
        *("magnets[0].clearance", "magnets.resistance", "magnets[1].bias_current", "rotor.disks[1].outer_diameter"),
        *("rotor.disks[0].mass", "rotor.shaft.viscous_damping", "rotor.shaft.hysteretic_damping"),
        *("rotor.shaft.segments[0].inner_diameter", "rotor.shaft.segments[1].outer_diameter"),
        *("bearings[1].stiffness", "bearings[1].damping"),
    ]
    places = {
        "rotor.disks[0].position": (0.2, 0.24),
        "magnets[0].position": (0.11, 0.13),
        "magnets[1].position": (0.67, 0.69),
        "sensors[0].position": (0.145, 0.155),
        "bearings[1].position": (0.75, 0.8),
        "rotor.shaft.segments[1].length": (0.245, 0.255),
    }
    plies = {
        "plies[0].angle": (0.4, 0.8),
        "plies[2].angle": (0.1, 0.3),
        "plies[0].thickness": _about(6e-3),
        "plies[1].thickness": _about(5e-3),
    }
    more: dict[str, Any] = {"magnets[0].axes_angle": (0.6, 0.9)} if machine.controller_z else {}
    return (
        {path: _about(float(dict(ad.numbers(machine))[ad.find(machine, path)[0]])) for path in paths}
        | places
        | plies
        | more
    )


TIES = {
    "rotor.disks[2].position": {"magnets[1].position": 1.0},  # the sleeve goes with its magnet
    "rotor.disks[3].position": {"rotor.shaft.segments[1].length": 1.0, "constant": 0.65},  # at the shaft end
    "plies[1].angle": {"plies[0].angle": -1.0, "constant": math.radians(-30.0)},
}


def everything_problem(anisotropic: bool = False, elements: int = 6) -> ad.DesignProblem:
    """All quantities limited, all kinds of numbers free, two patterns of unbalance and a scenario."""
    machine = everything(anisotropic, elements)
    return ad.DesignProblem(
        machine,
        maximise="stability_limit",
        free=free_numbers(machine),
        ties=TIES,
        limits=LIMITS,
        unbalance={"static": (2e-5, 3e-5, 1e-5, 2e-5), "couple": (2e-5, 0.0, 0.0, -3e-5)},
        scenarios={"other": {"magnets.gap": 1.05, "plies.material.E1": 0.9, "unbalance": 1.5}},
    )


def flywheel() -> ad.Machine:
    """An overhung flywheel whose forward whirl meets a narrow notch of its controller at a third of the speed range."""
    steel = ad.Isotropic(E=205e9, nu=0.29, density=7850.0)
    return ad.Machine(
        name="flywheel",
        rotor=ad.Rotor(
            shaft=ad.Shaft(
                segments=(ad.Segment(length=0.3, outer_diameter=0.025, material=steel),),
                viscous_damping=2e-6,
                elements=8,
            ),
            disks=(ad.Disk(position=0.3, mass=1.5, polar_inertia=8e-3, diametral_inertia=5e-3),),
        ),
        magnets=tuple(ad.Magnet(position=x, current_stiffness=60.0, negative_stiffness=2e5) for x in (0.05, 0.23)),
        controller=ad.PID(
            kp=8000.0,
            kd=12.0,
            low_pass=ad.LowPass(frequency=2.0 * math.pi * 4e3),
            notches=(ad.Notch(frequency=2.0 * math.pi * 690.0, damping=0.0065, width=0.05),),
            amplifier=ad.Amplifier(bandwidth=2.0 * math.pi * 3e3),
        ),
        operation=ad.Operation(top_speed=ad.rpm(40e3)),
    )
