"""Is it the same machine? What designs have in common but for their controllers, and what they have not."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator, Mapping
from typing import Any

from ..spec.fields import is_number, with_unit
from ..spec.machine import Machine
from ..spec.paths import metadata, numbers, skeleton

HARDWARE = re.compile(r"(^|\.)(amplifier\.(bandwidth|damping)|delay)$")
"""Numbers of a controller that stand for hardware, not for its law: amplifiers and the delay of the processor."""

SHOWN = 3
"""Differences that are told one by one."""


def plant(machine: Machine) -> Machine:
    """A machine without controllers, bias currents and what does not move it, to be compared with others.

    Parameters
    ----------
    machine : Machine
        With a magnet's bias currents k_i and k_s change; they count as the controller's.
    """
    magnets = tuple(_bare(m, bias_current=None if m.bias_current is None else 1.0) for m in machine.magnets)
    operation = dataclasses.replace(machine.operation, top_speed=1.0, service_speed=None)
    bare: Machine = _bare(machine, magnets=magnets, operation=operation, name="", sensors=_used(machine))
    return bare


def _used(machine: Machine) -> tuple[Any, ...]:
    """Sensors that a magnet looks at; others change nothing."""
    return tuple(s for s in machine.sensors if any(m.sensor == s.name for m in machine.magnets))


def _bare(spec: Any, **values: Any) -> Any:
    """A copy without its fields that hold controllers."""
    controllers = {f.name: f.default for f in dataclasses.fields(spec) if f.name.startswith("controller")}
    if values.get("bias_current") is not None and spec.max_current is not None:
        values["max_current"] = None  # a limit that the common bias might exceed
    return dataclasses.replace(spec, **controllers, **values)


def notes(machines: Mapping[str, Machine]) -> list[str]:
    """Sentences on what keeps a comparison from being one of controllers alone.

    Parameters
    ----------
    machines : mapping of str to Machine
        As given, controllers by their weights included.
    """
    (first, reference), *others = machines.items()
    out = []
    for name, machine in others:
        differing = list(_differences(plant(reference), plant(machine)))
        if differing:
            told = "; ".join(differing[:SHOWN]) + (f"; and {len(differing) - SHOWN} more" * (len(differing) > SHOWN))
            out.append(
                f"{first} and {name} are different machines ({told}): the table compares machines, not only controllers."
            )
        hardware, theirs = _hardware(reference), _hardware(machine)
        if hardware != theirs and hardware and theirs:
            out.append(
                f"The controllers of {first} and {name} have different hardware ({_listed(hardware)} against {_listed(theirs)})."
            )
        bias, other = _bias(reference), _bias(machine)
        if bias != other and not differing:
            out.append(f"Bias currents differ: {bias} in {first}, {other} in {name}; k_i and k_s follow from them.")
    ideal = [name for name, machine in machines.items() if _controlled(machine) and not _hardware(machine)]
    if ideal and len(ideal) < len(machines):
        out.append(f"{' and '.join(ideal)}: neither amplifier nor delay in the model, an ideal reference.")
    return out


def _controlled(machine: Machine) -> bool:
    return any(law is not None for magnet in machine.magnets for law in machine.controllers_of(magnet))


def _differences(one: Machine, other: Machine) -> Iterator[str]:
    ours, theirs = dict(numbers(one)), dict(numbers(other))
    same_kind = skeleton(one) == skeleton(other)
    if not same_kind:
        parts = [n for n in ("rotor", "bearings", "pins", "magnets", "sensors") if _kind(one, n) != _kind(other, n)]
        yield f"{' and '.join(parts) or 'their parts'} of another kind"
    for path in ours:
        if path in theirs and ours[path] != theirs[path]:
            unit = str(metadata(one, path)["unit"])
            yield f"{path} {with_unit(ours[path], unit)} and {with_unit(theirs[path], unit)}"


def _kind(machine: Machine, name: str) -> Any:
    return skeleton(getattr(machine, name))


def _hardware(machine: Machine) -> tuple[tuple[str, float, str], ...]:
    """Name, value and unit of the numbers of the controllers' hardware, equal ones once."""
    found = set()
    for path, value in numbers(machine):
        match = HARDWARE.search(path)
        if match and "controller" in path and is_number(value) and value:
            found.add((match[2], float(value), str(metadata(machine, path)["unit"])))
    return tuple(sorted(found))


def _listed(hardware: tuple[tuple[str, float, str], ...]) -> str:
    return ", ".join(f"{name} {with_unit(value, unit)}" for name, value, unit in hardware)


def _bias(machine: Machine) -> str:
    values = dict.fromkeys(str(with_unit(m.bias_current, "A")) for m in machine.magnets if m.bias_current is not None)
    return ", ".join(values) or "none given"
