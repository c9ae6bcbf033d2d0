"""Where the nodes go: a corner node at every station, elements spread evenly in between.

The plan is made from numbers and then holds for symbols: which stations coincide and in which order they
come must not depend on a design variable. Stations that coincide share a node and move together, led by the
shaft's own ends and steps, then disks, bearings, pins, magnets, sensors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import casadi as ca

from ..errors import ModelError
from ..spec.fields import Number, is_number
from ..spec.machine import Machine
from ..spec.paths import value
from ..spec.stations import boundaries, station_groups
from .pair import Matrix


@dataclass(frozen=True)
class Station:
    """One or more places of the machine that share a corner node.

    Attributes
    ----------
    position : nominal coordinate [m]
    leader : int or str
        Shaft boundary number (0 is the left end), or the path of the position that moves the node.
    members : paths of all positions found here
    """

    position: float
    leader: int | str
    members: tuple[str, ...]


@dataclass(frozen=True)
class Mesh:
    """Topology of the finite-element mesh.

    Attributes
    ----------
    stations : from left to right
    divisions : number of elements between neighbouring stations
    segments : index of the shaft segment between neighbouring stations
    """

    stations: tuple[Station, ...]
    divisions: tuple[int, ...]
    segments: tuple[int, ...]

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(self.divisions)

    @property
    def nodes(self) -> int:
        """Number of nodes, the middle nodes of the elements included."""
        return 2 * self.elements + 1

    def node_of(self, path: str) -> int:
        """Node of a component, named by the path of its position (``"magnets[0].position"``)."""
        for i, station in enumerate(self.stations):
            if path in station.members:
                return 2 * sum(self.divisions[:i])
        raise ModelError(f"no station of this machine is called {path}")

    def segment_of_elements(self) -> tuple[int, ...]:
        """Segment index of each element."""
        return tuple(s for s, n in zip(self.segments, self.divisions, strict=True) for _ in range(n))

    def finer(self, factor: int) -> Mesh:
        """The same stations with `factor` times as many elements."""
        return Mesh(self.stations, tuple(factor * n for n in self.divisions), self.segments)


def plan(machine: Machine) -> Mesh:
    """Lay out the mesh of a machine.

    Parameters
    ----------
    machine : Machine
        Lengths and positions must be numbers.

    Returns
    -------
    Mesh

    Raises
    ------
    ModelError
        If a length or position is a symbol.
    """
    shaft = machine.rotor.shaft
    lengths = [(f"rotor.shaft.segments[{i}].length", s.length) for i, s in enumerate(shaft.segments)]
    for path, x in [*lengths, *machine.stations()]:
        if not is_number(x):
            raise _symbolic(path)
    edges = boundaries(machine)
    length = edges[-1]
    stations = tuple(_station(g) for g in station_groups(machine))
    divisions, segments = [], []
    for a, b in pairwise(stations):
        divisions.append(max(1, math.ceil((b.position - a.position) * shaft.elements / length - 1e-6)))
        middle = (a.position + b.position) / 2.0
        segments.append(next(i for i, x in enumerate(edges[1:]) if middle < x))
    return Mesh(stations, tuple(divisions), tuple(segments))


def coordinates(machine: Machine, mesh: Mesh) -> list[Number]:
    """Coordinates of the stations [m], symbols where the machine holds symbols.

    Parameters
    ----------
    machine : Machine
        The machine that was planned, or one with symbols in its place.
    mesh : Mesh

    Returns
    -------
    list of float or CasADi scalar
    """
    edges = boundaries(machine)
    return [edges[s.leader] if isinstance(s.leader, int) else value(machine, s.leader) for s in mesh.stations]


def element_lengths(machine: Machine, mesh: Mesh) -> Matrix:
    """Length of each element [m] as a CasADi column."""
    x = coordinates(machine, mesh)
    return ca.vertcat(*[(b - a) / n for a, b, n in zip(x, x[1:], mesh.divisions, strict=False) for _ in range(n)])


def _station(group: list[tuple[float, int | str]]) -> Station:
    leaders = [who for _, who in group if isinstance(who, int)] + [who for _, who in group if isinstance(who, str)]
    position = next(x for x, who in group if who == leaders[0])
    return Station(position, leaders[0], tuple(who for who in leaders if isinstance(who, str)))


def _symbolic(path: str) -> ModelError:
    return ModelError(
        f"{path} is a symbol, but the mesh needs a nominal position; give a number and name the field in `free`"
    )
