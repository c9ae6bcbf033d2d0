"""A parametric machine at numbers: matrices with derivatives, eigenvalues and responses, kept for the next question."""

from __future__ import annotations

from functools import cached_property

import casadi as ca

from ..analysis.system import Array, System
from ..model.loop import Structure, ports, structure
from ..model.parametric import Parametric
from ..optimise.coordinates import Coordinates, modal
from ..optimise.family import Family, Member
from ..optimise.loop_family import unbalance_forces
from ..optimise.state import State
from ..spec.machine import Machine
from ..spec.paths import replace

Patterns = tuple[tuple[complex, ...], ...]


class Numbers:
    """The closed loop of a parametric machine at parameters that are numbers.

    Parameters
    ----------
    loop : Parametric
    modes : int, optional
        Lowest modes at rest that represent the rotor in eigenvalues and responses, in each plane; all if left out, which is exact.
    """

    def __init__(self, loop: Parametric, modes: int | None = None):
        count = None if modes is None else modes * (1 if loop.complex_form else 2)
        self.loop, self.modes = loop, None if count is None or count >= loop.plant.size else count
        self._states: dict[bytes, State] = {}
        self._coordinates: Coordinates | None = None

    @cached_property
    def family(self) -> Family:
        """All matrices with their derivatives."""
        pencil = self.loop.pencil
        seen = ports(self.loop.plant, pencil)
        parts = {"E": pencil.E, "A0": pencil.A0, "A1": pencil.A1, "F": seen.F, "G": seen.G, "C": seen.C}
        return Family(self.loop.p, parts)

    def state(self, p: Array) -> State:
        """The machine at parameters.

        Parameters
        ----------
        p : ndarray, shape (np,)
        """
        key = p.tobytes()
        if key not in self._states:
            member = self.family.at(p)
            while len(self._states) >= 2:
                self._states.pop(next(iter(self._states)))
            self._states[key] = State(member, self._in(member))
        return self._states[key]

    def _in(self, member: Member) -> Coordinates:
        speed = 0.5 * float(self.loop.machine.operation.top_speed)
        if self.modes is not None:
            return modal(member, self.loop.plant.size, speed, self.modes)
        if self._coordinates is None:  # complete ones are exact whatever the parameters: made once
            self._coordinates = modal(member, self.loop.plant.size, speed)
        return self._coordinates

    def member(self, p: Array) -> Member:
        """The matrices at parameters, with their derivatives."""
        return self.family.at(p)

    def system(self, p: Array) -> System:
        """The machine at parameters, for the analyses."""
        machine = machine_at(self.loop, p)
        plant = structure(machine, self.loop.plant.mesh, self.loop.complex_form)
        if not self.loop.plant.blocks:  # the loops were cut
            plant = _cut(plant)
        return System(machine, plant, plant.size)

    def driven(self, patterns: Patterns) -> Driven:
        """The machine under unbalances."""
        return Driven(self.loop, patterns)


class Driven:
    """What unbalance measures need to know (`optimise.measures.whirl.Driven`).

    Parameters
    ----------
    loop : Parametric
    patterns : tuple of tuple of complex
        One unbalance a disk [kg m].
    """

    def __init__(self, loop: Parametric, patterns: Patterns):
        self.p: ca.SX = loop.p
        self.machine, self.plant = loop.symbolic, loop.plant
        self.axes = tuple(a.magnet for a in loop.plant.driven)
        self.pushed = tuple(a.magnet for a in loop.plant.axes)
        self.unbalance = unbalance_forces(loop.plant, patterns)
        self.patterns = tuple(f"pattern {k}" for k in range(len(patterns)))


def machine_at(loop: Parametric, p: Array) -> Machine:
    """The machine with numbers in the places of the parameters.

    Parameters
    ----------
    loop : Parametric
    p : ndarray, shape (np,)
    """
    values = {path: float(x) for x, paths in zip(p, loop.members, strict=True) for path in paths}
    return replace(loop.machine, values) if values else loop.machine


def _cut(plant: Structure) -> Structure:
    from dataclasses import replace as with_fields

    return with_fields(plant, blocks=())
