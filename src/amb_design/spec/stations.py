"""Which places of the shaft coincide, and in which order they come."""

from __future__ import annotations

from .fields import Number
from .machine import Machine

COINCIDENT = 1e-6
"""Stations closer than this fraction of the shaft's length share a node."""


def boundaries(machine: Machine) -> list[Number]:
    """Coordinates of the shaft's ends and steps [m].

    Parameters
    ----------
    machine : Machine
    """
    out: list[Number] = [0.0]
    for segment in machine.rotor.shaft.segments:
        out.append(out[-1] + segment.length)
    return out


def station_groups(machine: Machine) -> list[list[tuple[float, int | str]]]:
    """Coordinate and name of every place, from left to right, those together that coincide.

    Parameters
    ----------
    machine : Machine
        Lengths and positions must be numbers.

    Returns
    -------
    list of list of (float, int or str)
        A shaft boundary has its number (0 is the left end), any other place the path of its position.
    """
    edges = boundaries(machine)
    places: list[tuple[float, int | str]] = [(x, i) for i, x in enumerate(edges)]
    places += [(min(position, edges[-1]), path) for path, position in machine.stations()]
    places.sort(key=lambda p: p[0])  # stable: boundaries lead, then the order of machine.stations()
    groups: list[list[tuple[float, int | str]]] = []
    for place in places:
        if groups and place[0] - groups[-1][0][0] <= COINCIDENT * edges[-1]:
            groups[-1].append(place)
        else:
            groups.append([place])
    return groups
