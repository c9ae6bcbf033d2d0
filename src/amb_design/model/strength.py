"""What strength and economy ask of a machine: mass, losses, hoop strain, surface speed, torsional vibration.

Plain functions of a machine; every result is differentiable in every number. Rotating thin rings and torsion are textbook
matter; laminates after classical lamination theory.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from ..errors import ModelError
from ..spec.fields import Number
from ..spec.machine import Machine
from ..spec.shaft import Segment
from . import magnet as magnetics
from .element import assemble
from .laminate import hoop_modulus, section_constants, torsional_stiffness
from .mesh import Mesh, element_lengths
from .pair import Matrix
from .rotor import diagonal


def rotor_mass(machine: Machine) -> Number:
    """Mass of shaft and disks [kg].

    Parameters
    ----------
    machine : Machine
        Numbers or CasADi scalars of one kind.
    """
    shaft = machine.rotor.shaft
    total: Number = 0.0
    for segment in shaft.segments:
        total = total + section_constants(segment, shaft.ply_law).mass * segment.length
    for disk in machine.rotor.disks:
        total = total + disk.total_mass
    return total


def copper_loss(machine: Machine) -> Number:
    """Loss of all coils at bias [W]: 4 R i0^2 a magnet, for two horseshoes on each of two axes.

    Parameters
    ----------
    machine : Machine

    Raises
    ------
    ModelError
        If a magnet has no resistance or no bias current.
    """
    total: Number = 0.0
    for magnet in machine.magnets:
        total = total + magnetics.copper_loss(magnet)
    return total


def hoop_strain(machine: Machine, speed: Number) -> list[Number]:
    """Hoop strain of each segment's outermost fibre from its own rotation.

    Parameters
    ----------
    machine : Machine
    speed : float or CasADi scalar
        Spin speed [rad/s].

    Returns
    -------
    list of float or CasADi scalar
        rho R^2 Omega^2/E_theta, as if the whole wall were a thin ring at its outer radius R: on the safe side for thick walls,
        and by a factor of 4/(1 - nu) for solid shafts. What the disks pull or press is not in it.
    """
    return [_ring_strain(segment, speed) for segment in machine.rotor.shaft.segments]


def _ring_strain(segment: Segment, speed: Number) -> Number:
    if segment.material is not None:
        density, modulus = segment.material.density, segment.material.E
    else:
        thickness = ca.vertcat(*[p.thickness for p in segment.plies])
        density = ca.dot(ca.vertcat(*[p.material.density for p in segment.plies]), thickness) / ca.sum1(thickness)
        modulus = hoop_modulus(segment.plies)
    return density * (segment.outer / 2.0 * speed) ** 2 / modulus


def surface_speed(machine: Machine, speed: Number, names: Sequence[str] = ()) -> list[Number]:
    """Surface speed of disks and sleeves [m/s]: outer radius times spin speed.

    Parameters
    ----------
    machine : Machine
    speed : float or CasADi scalar
        Spin speed [rad/s].
    names : sequence of str, optional
        Names of the disks that count; all that have an outer diameter if left out.

    Returns
    -------
    list of float or CasADi scalar
        In the order of the machine's disks.

    Raises
    ------
    ModelError
        If a name is that of no disk, or of a disk without outer diameter.
    """
    disks = machine.rotor.disks
    for name in names:
        if not any(d.name == name for d in disks):
            raise ModelError(f"no disk of this machine is called {name!r}")
        if any(d.name == name and d.outer_diameter is None for d in disks):
            raise ModelError(f"the surface speed of {name!r} needs its outer_diameter")
    chosen = [d for d in disks if (d.name in names if names else d.outer_diameter is not None)]
    return [d.outer_diameter / 2.0 * speed for d in chosen]


def torsion(machine: Machine, mesh: Mesh) -> tuple[Matrix, Matrix]:
    """Stiffness and inertia of free torsional vibration, K q = omega^2 J q.

    Parameters
    ----------
    machine : Machine
        Numbers or CasADi scalars of one kind.
    mesh : Mesh
        Plan of the machine or of the numeric one behind it.

    Returns
    -------
    K, J : sparse CasADi matrices
        Over the angle of twist at every node, middle nodes included; [N m] and [kg m^2]. One eigenvalue is zero: the spin.

    Notes
    -----
    Quadratic interpolation, exact integration; the disks are rigid and hold the shaft at one station each.
    """
    shaft = machine.rotor.shaft
    lengths = element_lengths(machine, mesh)
    where = mesh.segment_of_elements()
    stiffness = [torsional_stiffness(s) for s in shaft.segments]
    inertia = [2.0 * section_constants(s, shaft.ply_law).inertia for s in shaft.segments]
    twist = slice(1, None, 2)  # the slopes of the bending element obey the same equation as the angle of twist
    K = assemble("bending", ca.vertcat(*[stiffness[s] for s in where]) / lengths)[twist, twist]
    J = assemble("rotation", ca.vertcat(*[inertia[s] for s in where]) * lengths)[twist, twist]
    nodes = [mesh.node_of(f"rotor.disks[{i}].position") for i in range(len(machine.rotor.disks))]
    return K, J + diagonal(mesh.nodes, nodes, [d.inertias[1] for d in machine.rotor.disks])
