"""Names of what sits on the shaft."""

from __future__ import annotations

from collections.abc import Sequence

from ..spec.machine import Machine

KINDS = {"disks": "disk", "bearings": "bearing", "pins": "pin", "magnets": "magnet", "sensors": "sensor"}


def stations(machine: Machine, kinds: Sequence[str] = tuple(KINDS)) -> list[tuple[str, float]]:
    """Name and position [m] of every disk, bearing, pin, magnet and sensor.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    kinds : sequence of str
        Which of them, in this order.

    Returns
    -------
    list of (str, float)
        ``left bearing``; a part without a name is counted: ``disk 2``.
    """
    found = []
    for kind in kinds:
        items = machine.rotor.disks if kind == "disks" else getattr(machine, kind)
        for i, item in enumerate(items):
            found.append((_name(KINDS[kind], getattr(item, "name", ""), i, len(items)), float(item.position)))
    return found


def _name(kind: str, name: str, i: int, count: int) -> str:
    if not name:
        return f"{kind} {i + 1}" if count > 1 else kind
    return name if kind == "disk" or kind in name.lower() else f"{name} {kind}"
