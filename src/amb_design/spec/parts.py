"""Names of what sits on the shaft, and places given by such a name."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from ..errors import SpecError
from ..units import parse_quantity
from .fields import is_number
from .machine import Machine

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
        items = _items(machine, kind)
        for i, item in enumerate(items):
            found.append((_name(KINDS[kind], getattr(item, "name", ""), i, len(items)), float(item.position)))
    return found


def place(machine: Machine, at: str | float) -> float:
    """Position [m] of a place on the shaft.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    at : str or float
        A name as in `stations` (``"disk 2"``, ``"left magnet"``), a part (``"magnets[0]"``), or the position itself: a number [m],
        or a text with a unit.

    Raises
    ------
    SpecError
        If there is no such part, or the place is not on the shaft.
    """
    if isinstance(at, str) and re.match(r"[-+.\d]", at):
        at = parse_quantity(at, "m")
    length = float(machine.rotor.shaft.length)
    if is_number(at):
        if not 0.0 <= at <= length * (1.0 + 1e-9):
            raise SpecError(
                f"is not on the shaft (0 to {length:.6g} m)", field="at", got=at, remedy="name a part of the machine"
            )
        return min(float(at), length)
    found = re.match(r"(?:rotor\.)?([a-z]+)\[(\d+)\]$", str(at))
    if found and found[1] in KINDS and int(found[2]) < len(_items(machine, found[1])):
        return float(_items(machine, found[1])[int(found[2])].position)
    known = stations(machine)
    for name, position in known:
        if name == at:
            return position
    raise SpecError("names no part of this machine", field="at", got=at, remedy=f"known are {', '.join(dict(known))}")


def _items(machine: Machine, kind: str) -> Sequence[Any]:
    items: Sequence[Any] = machine.rotor.disks if kind == "disks" else getattr(machine, kind)
    return items


def _name(kind: str, name: str, i: int, count: int) -> str:
    if not name:
        return f"{kind} {i + 1}" if count > 1 else kind
    return name if kind == "disk" or kind in name.lower() else f"{name} {kind}"
