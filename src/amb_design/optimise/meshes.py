"""The meshes on which a design has to hold.

Those whose elements are cut converge: what they say of the rotor's own modes is the more exact the more parts there are. Modes
with only a few elements to their wavelength are the mesh's, not the rotor's. A controller that drives some of them unstable may
do so on one mesh and not on another, wherever their nodes fall: hence several that are laid out anew. These leave short spans
between stations in one piece, and do not converge.
"""

from __future__ import annotations

from collections.abc import Callable

from ..model.mesh import Mesh, plan
from ..spec.machine import Machine
from ..spec.paths import replace

Layout = Callable[[Machine], Mesh]
"""Lays out the mesh of a machine of numbers."""


def own(machine: Machine) -> Mesh:
    """The mesh that the machine asks for."""
    return plan(machine)


def halved(machine: Machine) -> Mesh:
    """Every element of its own mesh cut in two."""
    return plan(machine).finer(2)


def quartered(machine: Machine) -> Mesh:
    """Every element of its own mesh cut in four."""
    return plan(machine).finer(4)


def in_eighths(machine: Machine) -> Mesh:
    """Every element of its own mesh cut in eight."""
    return plan(machine).finer(8)


def twice(machine: Machine) -> Mesh:
    """Laid out anew for twice as many elements: of equal length, as far as the stations allow."""
    return _anew(machine, 2)


def thrice(machine: Machine) -> Mesh:
    """Laid out anew for three times as many elements."""
    return _anew(machine, 3)


def four_times(machine: Machine) -> Mesh:
    """Laid out anew for four times as many elements."""
    return _anew(machine, 4)


def told(layout: Layout) -> str:
    """What a mesh is, in words."""
    names: dict[Layout, str] = {
        own: "its own mesh",
        halved: "a twice finer mesh",
        quartered: "a four times finer mesh",
        in_eighths: "an eight times finer mesh",
        twice: "a mesh of twice as many elements",
        thrice: "a mesh of three times as many elements",
        four_times: "a mesh of four times as many elements",
    }
    return names.get(layout, layout.__name__)


def _anew(machine: Machine, factor: int) -> Mesh:
    return plan(replace(machine, {"rotor.shaft.elements": factor * int(machine.rotor.shaft.elements)}))
