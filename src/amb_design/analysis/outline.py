"""A machine in figures, without analysing it: what ``amb-design check`` tells."""

from __future__ import annotations

import math
from typing import Any

from ..model import magnet as magnetics
from ..model.laminate import section_constants
from ..spec.machine import Machine
from .findings import capacity, static_shares
from .frequency import Loops
from .loop_outline import added_damping, bare_modes, loop_outlines, own_damping
from .system import System, system
from .unusual import unusual

HZ = 2.0 * math.pi


def outline(machine: Machine) -> dict[str, Any]:
    """Describe a machine.

    Parameters
    ----------
    machine : Machine
        Numbers only.

    Returns
    -------
    dict
        Nested dicts, lists, strings and numbers: masses [kg], section stiffnesses, magnet coefficients and capacity beside the
        load that they have to carry, stiffness and phase of the loops, what is unusual, and the size of the model.
    """
    loop = system(machine)
    plant = loop.plant
    loops, bare = Loops(plant), bare_modes(loop)
    segments, magnets = _segments(machine), _magnets(loop)
    controlled = loop_outlines(loop, loops, bare)
    disks = _disks(machine)
    shaft_mass = sum(s["mass_kg"] for s in segments)
    disk_masses = [d["mass_kg"] for d in disks]
    modes = []
    for w, shapes in zip(bare.frequencies, bare.shapes, strict=True):
        mode = {"frequency_hz": float(w) / HZ, "own_damping_ratio": own_damping(loop, float(w), shapes)}
        if controlled:
            mode["damping_ratio_from_loops"] = added_damping(loops, float(w), shapes)
        modes.append(mode)
    out = {
        "name": machine.name,
        "source": dict(machine.source),
        "length_m": float(machine.rotor.shaft.length),
        "mass_kg": shaft_mass + sum(disk_masses),
        "shaft_mass_kg": shaft_mass,
        "disk_masses_kg": disk_masses,
        "segments": segments,
        "disks": disks,
        "bearings": [
            {
                "name": b.name,
                "position_m": float(b.position),
                "stiffness_n_per_m": [[float(x) for x in row] for row in b.stiffness_matrix],
                "damping_ns_per_m": [[float(x) for x in row] for row in b.damping_matrix],
            }
            for b in machine.bearings
        ],
        "pins_m": [float(p.position) for p in machine.pins],
        "magnets": magnets,
        "controller": None if machine.controller is None else machine.controller.type,
        "loops": controlled,
        "supported": bool(machine.bearings or machine.pins),
        "rotor_modes": modes,
        "elements": plant.mesh.elements,
        "states": 2 * plant.size + sum(len(block.law.states) for block in plant.blocks),
        "form": "complex" if plant.complex_form else "real",
        "top_speed_rpm": machine.operation.top_speed * 30.0 / math.pi,
        "service_speed_rpm": None
        if machine.operation.service_speed is None
        else machine.operation.service_speed * 30.0 / math.pi,
    }
    return {**out, "unusual": list(unusual(machine, out))}


def _segments(machine: Machine) -> list[dict[str, Any]]:
    shaft, start, out = machine.rotor.shaft, 0.0, []
    for s in shaft.segments:
        c = section_constants(s, shaft.ply_law)
        out.append(
            {
                "start_m": start,
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
        start += float(s.length)
    return out


def _disks(machine: Machine) -> list[dict[str, Any]]:
    out = []
    for d in machine.rotor.disks:
        diametral, polar = d.inertias
        out.append(
            {
                "name": d.name,
                "position_m": float(d.position),
                "mass_kg": float(d.total_mass),
                "diametral_inertia_kgm2": float(diametral),
                "polar_inertia_kgm2": float(polar),
                "unbalance_kgm": float(d.unbalance),
            }
        )
    return out


def _magnets(loop: System) -> list[dict[str, Any]]:
    machine = loop.machine
    gravity = float(machine.operation.gravity)
    shares = static_shares(loop) if machine.magnets else []
    out = []
    for m, share in zip(machine.magnets, shares, strict=True):
        along = max(abs(math.cos(m.axes_angle)), abs(math.sin(m.axes_angle)))
        entry: dict[str, Any] = {
            "name": m.name,
            "position_m": float(m.position),
            "sensor_position_m": float(machine.sensor_position(m)),
            "current_stiffness_n_per_a": float(magnetics.current_stiffness(m)),
            "negative_stiffness_n_per_m": float(magnetics.negative_stiffness(m)),
            "load_n": share * gravity,
            "load_of_an_axis_n": abs(share) * gravity * along,
        }
        pull = capacity(m)
        if pull is not None:
            entry["capacity_n"] = pull
        if m.has_geometry:
            entry["bias_flux_density_t"] = float(magnetics.flux_density(m, 0.0))
        out.append(entry)
    return out
