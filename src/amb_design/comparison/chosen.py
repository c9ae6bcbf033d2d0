"""Conditions that were left out, chosen from the machines, and said in words."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import casadi as ca

from ..analysis.stability import FOUND, NONE, StabilityLimit
from ..model.strength import rotor_mass
from ..spec.comparison import BaseShock, Conditions, ForceStep
from ..spec.machine import Machine
from ..spec.parts import stations
from ..units import in_words
from .robustness import usual_tolerances

MARGIN = 0.9
"""The operating range ends at this part of the smallest stability limit where no speed is given."""

GRAVITY = 9.80665


def top_speed(conditions: Conditions, machines: Mapping[str, Machine]) -> float:
    """Where the search for stability limits ends [rad/s]."""
    if conditions.top_speed is not None:
        return float(conditions.top_speed)
    return max(float(conditions.speed or 0.0), *(float(m.operation.top_speed) for m in machines.values()))


def completed(
    conditions: Conditions, machines: Mapping[str, Machine], limits: Mapping[str, StabilityLimit]
) -> tuple[Conditions, list[str]]:
    """All conditions as numbers, and sentences on those that were chosen.

    Parameters
    ----------
    conditions : Conditions
    machines : mapping of str to Machine
    limits : mapping of str to StabilityLimit
        Of the same designs.
    """
    top = top_speed(conditions, machines)
    speed, notes = _speed(conditions, machines, limits, top)
    force, base, tolerances = conditions.force_step, conditions.base_shock, conditions.tolerances
    first = next(iter(machines.values()))
    if force is None:
        weight = GRAVITY * min(float(ca.DM(rotor_mass(m))) for m in machines.values())
        force = ForceStep(force=float(f"{0.1 * weight:.2g}"), at=_where(first))
        notes.append(f"Force step: {in_words(force.force, 'N')} at {force.at}, about a tenth of the weight.")
    if base is None:
        base = BaseShock(acceleration=1.0, duration=0.011)
        notes.append("Base: half a sine of 1 m/s^2 in 11 ms.")
    own = [sum(d.unbalance for d in m.rotor.disks) for m in machines.values()]
    if not conditions.unbalance and any(own):
        notes.append(f"Unbalance: the machines' own, {in_words(max(own), 'kg m')} in all.")
    if tolerances is None:
        shared = [usual_tolerances(m) for m in machines.values()]
        tolerances = {path: t for path, t in shared[0].items() if all(path in other for other in shared)}
        told = ", ".join(f"{path} {100.0 * t:g} %" for path, t in tolerances.items())
        notes.append(f"Tolerances: {told or 'none that all machines have'}.")
    done = dataclasses.replace(
        conditions, speed=speed, top_speed=top, force_step=force, base_shock=base, tolerances=tolerances
    )
    return done, notes


def _speed(
    conditions: Conditions, machines: Mapping[str, Machine], limits: Mapping[str, StabilityLimit], top: float
) -> tuple[float, list[str]]:
    if conditions.speed is not None:
        return float(conditions.speed), []
    services = [float(m.operation.service_speed) for m in machines.values() if m.operation.service_speed is not None]
    if services:
        speed = min(*services, top)
        return speed, [f"Operating range: up to the service speed, {in_words(speed, 'rad/s', speed=True)}."]
    stable = [limit.speed for limit in limits.values() if limit.status in (FOUND, NONE)]
    speed = MARGIN * min(stable) if stable else top
    text = in_words(speed, "rad/s", speed=True)
    why = f"{100.0 * MARGIN:g} % of the smallest stability limit" if stable else "the top speed, for nothing is stable"
    return speed, [f"Operating range: up to {text}, {why}."]


def _where(machine: Machine) -> str | float:
    """The heaviest disk, else a magnet, else the middle of the shaft."""
    disks = machine.rotor.disks
    if disks:
        return stations(machine, ("disks",))[max(range(len(disks)), key=lambda i: float(ca.DM(disks[i].total_mass)))][0]
    return stations(machine, ("magnets",))[0][0] if machine.magnets else float(machine.rotor.shaft.length) / 2.0
