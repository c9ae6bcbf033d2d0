"""Small levitated machines, and their loops in python-control."""

from __future__ import annotations

import control
import numpy as np

import amb_design as ad
from independent.test_control import real_loop
from transient.rotors import levitated, magnet, pid, shaft


def jeffcott(**fields: float) -> ad.Machine:
    """One disk and one magnet in the middle of a shaft on pins: a single loop in each plane."""
    return ad.Machine(
        name="jeffcott on a magnet",
        rotor=ad.Rotor(
            shaft=shaft(), disks=(ad.Disk(position=0.25, mass=4.0, diametral_inertia=0.01, polar_inertia=0.018),)
        ),
        pins=(ad.Pin(position=0.0), ad.Pin(position=0.6)),
        magnets=(magnet(0.3),),
        controller=pid(**fields),
        operation=ad.Operation(top_speed=1000.0),
    )


def apart(machine: ad.Machine) -> ad.Machine:
    """The same machine with a controller of its own for each axis, so that one loop can be changed alone."""
    changes = {}
    for i, m in enumerate(machine.magnets):
        first, second = machine.controllers_of(m)
        changes |= {
            f"magnets[{i}].controller": first,
            f"magnets[{i}].controller_z": ad.replace(second, {"kp": second.kp}),
        }
    return ad.replace(machine, changes)


def loop_alone(machine: ad.Machine, speed: float, k: int) -> control.StateSpace:
    """L of loop k with all others closed, broken at its sensor."""
    plant, chains, count = real_loop(machine, speed)
    others = np.eye(count)
    others[k, k] = 0.0
    return control.feedback(plant * chains, control.ss([], [], [], others))[k, k]


def is_stable(machine: ad.Machine, speed: float) -> bool:
    return bool((np.linalg.eigvals(ad.system(machine, complex_form=False).matrix(speed)).real < 0.0).all())


__all__ = ["apart", "is_stable", "jeffcott", "levitated", "loop_alone", "pid"]
