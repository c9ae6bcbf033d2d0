"""A machine in words and a few figures, without analysing it: what ``amb-design check`` tells."""

from __future__ import annotations

import math
from typing import Any

from ..model import magnet as magnetics
from ..model.laminate import section_constants
from ..model.loop import close, structure
from ..spec.machine import Machine
from ..synthesis.design import synthesise
from .frequency import Loops
from .system import dense


def outline(machine: Machine) -> dict[str, Any]:
    """Describe a machine.

    Parameters
    ----------
    machine : Machine
        Numbers only.

    Returns
    -------
    dict
        Nested dicts, lists, strings and numbers: masses [kg], section stiffnesses, magnet coefficients and capacity, loop
        gains, and the size of the model.
    """
    plant = structure(synthesise(machine))
    shaft = machine.rotor.shaft
    segments = []
    shaft_mass = 0.0
    for s in shaft.segments:
        c = section_constants(s, shaft.ply_law)
        shaft_mass += float(c.mass) * float(s.length)
        segments.append(
            {
                "length_m": float(s.length),
                "outer_diameter_m": float(s.outer),
                "inner_diameter_m": float(s.inner_diameter),
                "plies_deg": [round(math.degrees(p.angle), 6) for p in s.plies],
                "bending_stiffness_nm2": float(c.bending),
                "shear_stiffness_n": float(c.shear),
                "bend_twist_coupling_nm": float(c.coupling),
                "mass_kg": float(c.mass) * float(s.length),
            }
        )
    disks = [float(d.total_mass) for d in machine.rotor.disks]
    loops, magnets = Loops(plant), []
    states = [len(block.law.states) for block in plant.blocks for _ in block.axes]
    for i, m in enumerate(machine.magnets):
        entry: dict[str, Any] = {
            "position_m": float(m.position),
            "current_stiffness_n_per_a": float(magnetics.current_stiffness(m)),
            "negative_stiffness_n_per_m": float(magnetics.negative_stiffness(m)),
        }
        if m.has_geometry:
            entry["capacity_n"] = float(magnetics.capacity(m))
            entry["bias_flux_density_t"] = float(magnetics.flux_density(m, 0.0))
        own = next((k for k, a in enumerate(loops.axes) if a.magnet == i), None)
        if own is not None and own < len(plant.loops):
            gain = complex(loops.controller(2.0 * math.pi * 50.0, 0.0)[own, own])
            stiffness = entry["current_stiffness_n_per_a"] * gain
            entry["controller_states"] = states[own]
            entry["gain_at_50_hz_a_per_m"] = abs(gain)
            entry["loop_stiffness_at_50_hz_n_per_m"] = stiffness.real - entry["negative_stiffness_n_per_m"]
            entry["loop_damping_at_50_hz_ns_per_m"] = stiffness.imag / (2.0 * math.pi * 50.0)
        magnets.append(entry)
    return {
        "name": machine.name,
        "source": dict(machine.source),
        "length_m": float(shaft.length),
        "mass_kg": shaft_mass + sum(disks),
        "shaft_mass_kg": shaft_mass,
        "disk_masses_kg": disks,
        "segments": segments,
        "bearings": [
            {
                "position_m": float(b.position),
                "stiffness_n_per_m": [[float(x) for x in row] for row in b.stiffness_matrix],
                "damping_ns_per_m": [[float(x) for x in row] for row in b.damping_matrix],
            }
            for b in machine.bearings
        ],
        "pins_m": [float(p.position) for p in machine.pins],
        "magnets": magnets,
        "elements": plant.mesh.elements,
        "states": len(dense(close(plant).E)),
        "form": "complex" if plant.complex_form else "real",
        "top_speed_rpm": machine.operation.top_speed * 30.0 / math.pi,
    }
