"""The rotor in modal coordinates, M = 1: all modes at rest, which is exact, or the lowest with static correction; and what controls it.

q = basis xi, and xi'' + (C0 + Omega C1) xi' + (K0 + Omega K1 + Omega' C1) xi = loads. The magnets' negative stiffness is
not in K0: here it comes with their force law. The last term on the left is the moment that a spinning disk needs to
keep up with an accelerated spin while it is tilted (Genta 2005, rotors at variable speed).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
import scipy.linalg as sla
from scipy.sparse.csgraph import connected_components

from ..analysis.places import interpolated
from ..analysis.sampled import with_chains
from ..analysis.system import Array, dense, node_positions
from ..errors import ModelError
from ..model.loop import Axis, Structure, structure
from ..model.magnet import negative_stiffness
from ..model.mesh import plan
from ..spec.controller import Amplifier, Chain
from ..spec.machine import Machine
from ..synthesis.design import synthesise
from .law import Law
from .loads import Disturbance, Force, Impulse

ROUNDING = 1e-14
"""Entries of a matrix below this fraction of its largest are taken for zero."""


@dataclass(frozen=True)
class Plant:
    """Rotor on its passive bearings, without magnets.

    Attributes
    ----------
    basis : ndarray, shape (free degrees of freedom, n)
        Mass-normalised.
    mass : ndarray
        Over the free degrees of freedom.
    frequencies : ndarray, shape (n,) [rad/s]
    C0, C1, K0, K1 : ndarray, shape (n, n)
    shapes : ndarray, shape (nodes, 2, n)
        Displacements v and w of the nodes.
    positions : ndarray, shape (nodes,) [m]
    inertia : ndarray, shape (n, 2)
        Loads by a unit acceleration of all masses in y and in z.
    unbalance : ndarray, shape (n, 2)
        Loads by the disks' unbalances for factors cos and sin of the spin angle.
    actuators : ndarray, shape (axes, n)
    amplifiers : tuple of Amplifier or None
        Of the axes; None for ideal ones.
    law : Law
        Of all axes.
    """

    machine: Machine
    axes: tuple[Axis, ...]
    basis: Array
    mass: Array
    frequencies: Array
    C0: Array
    C1: Array
    K0: Array
    K1: Array
    shapes: Array
    positions: Array
    inertia: Array
    unbalance: Array
    actuators: Array
    amplifiers: tuple[Amplifier | None, ...]
    law: Law

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return int(self.basis.shape[1])

    def reduced(self, q: Array) -> Array:
        """Coordinates of displacements of the free degrees of freedom."""
        return np.asarray(self.basis.T @ self.mass @ q)

    def row(self, position: float) -> Array:
        """Displacements v and w at any place of the shaft for unit coordinates, shape (2, n)."""
        return interpolated(self.positions, self.shapes, position)

    def load(self, disturbance: Force | Impulse) -> Array:
        """Load of a force or impulse, shape (n,)."""
        v, w = self.row(disturbance.position)
        return np.asarray(disturbance.y * v + disturbance.z * w)


def plant_of(
    machine: Machine, modes: int | None, disturbances: tuple[Disturbance, ...], sampled: bool = False
) -> Plant:
    """Reduce the machine to modal coordinates.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    modes : int or None
        Number of the lowest modes; what the others would do is made up for statically at magnets, bearings and forces.
    disturbances : tuple
        Checked here for their places.
    sampled : bool
        True if the sampling takes the place of the delay in the chains.
    """
    mesh, designed = plan(machine), synthesise(machine)
    late = {"delay": 0.0} if sampled else {}
    whole = structure(with_chains(designed, amplifier=None, **late), mesh, complex_form=False)
    amplifiers = tuple(_amplifier(designed, k) for k in range(len(whole.axes)))
    n = whole.size
    actuators = np.hstack([np.zeros((n, 0)), *[ca.DM(a.actuator).full() for a in whole.axes]])
    pull = [float(ca.DM(negative_stiffness(machine.magnets[a.magnet]))) for a in whole.axes]
    stiffness = dense(whole.K0) + (actuators * pull) @ actuators.T
    mass = dense(whole.M)
    squares, shapes = _modes((stiffness + stiffness.T) / 2.0, (mass + mass.T) / 2.0)
    free = list(whole.free)
    full = np.zeros((4 * mesh.nodes, n))
    full[free] = np.eye(n)
    nodes = np.stack([full[0::4], full[1::4]], axis=1)
    x = node_positions(mesh)
    if modes is not None:
        if not 1 <= modes <= n:
            raise ModelError(f"modes = {modes} is not between 1 and {n}, the degrees of freedom of {machine.name}")
        at = [b.position for b in machine.bearings] + [
            d.position for d in disturbances if isinstance(d, Force | Impulse)
        ]
        places = [interpolated(x, nodes, float(position)).T for position in at]
        shapes, squares = _corrected(shapes, squares, modes, np.hstack([actuators, *places]))
    reduce: Callable[[Array], Array] = lambda matrix: _tidy(shapes.T @ matrix @ shapes)  # noqa: E731
    return Plant(
        machine=machine,
        axes=whole.axes,
        basis=shapes,
        mass=mass,
        frequencies=np.sqrt(np.maximum(squares, 0.0)),
        C0=reduce(dense(whole.C0)),
        C1=reduce(dense(whole.C1)),
        K0=reduce(stiffness),
        K1=reduce(dense(whole.K1)),
        shapes=nodes @ shapes,
        positions=x,
        inertia=shapes.T @ _inertia(whole, machine),
        unbalance=shapes.T @ _unbalance(whole, machine),
        actuators=actuators.T @ shapes,
        amplifiers=amplifiers,
        law=Law.of(whole, shapes, np.array([1.0 if a is None else float(a.gain) for a in amplifiers])),
    )


def _modes(stiffness: Array, mass: Array) -> tuple[Array, Array]:
    """All eigenvalues, ascending, and mass-normalised modes; planes that are not coupled have modes of their own."""
    _, part = connected_components((np.abs(stiffness) > ROUNDING * np.abs(stiffness).max()) | (mass != 0.0))
    squares, shapes = np.zeros(len(mass)), np.zeros_like(mass)
    for k in range(part.max() + 1):
        inside = np.flatnonzero(part == k)
        block = np.ix_(inside, inside)
        squares[inside], shapes[block] = sla.eigh(stiffness[block], mass[block])
    order = np.argsort(squares, kind="stable")
    return squares[order], shapes[:, order]


def _tidy(matrix: Array) -> Array:
    """Without entries that are rounding alone, so that products skip them."""
    return np.where(np.abs(matrix) > ROUNDING * np.abs(matrix).max(), matrix, 0.0)


def _corrected(shapes: Array, squares: Array, modes: int, loads: Array) -> tuple[Array, Array]:
    """The lowest modes, and what the others do under static loads, orthogonal to the first and to each other."""
    rest, above = shapes[:, modes:], squares[modes:]
    static = (rest.T @ loads) / np.maximum(above, 1.0)[:, None]  # in coordinates of the modes left out
    left, sizes, _ = np.linalg.svd(static, full_matrices=False)
    keep = left[:, sizes > 1e-9 * sizes.max(initial=0.0)]
    values, turn = np.linalg.eigh(keep.T @ (above[:, None] * keep))
    return np.hstack([shapes[:, :modes], rest @ (keep @ turn)]), np.concatenate([squares[:modes], values])


def _amplifier(machine: Machine, axis: int) -> Amplifier | None:
    chain = machine.controllers_of(machine.magnets[axis // 2])[axis % 2]
    return chain.amplifier if isinstance(chain, Chain) else None


def _inertia(whole: Structure, machine: Machine) -> Array:
    """Mass times a rigid translation in y and z; the mass that the pins hold counts, so it is assembled without them."""
    hanging = whole
    if machine.pins:
        free = dataclasses.replace(machine.without_controllers(), pins=())
        hanging = structure(free, plan(machine), complex_form=False)
    rigid = np.zeros((hanging.size, 2))
    rigid[0::4, 0] = rigid[1::4, 1] = 1.0
    return np.asarray((dense(hanging.M) @ rigid)[list(whole.free)])


def _unbalance(whole: Structure, machine: Machine) -> Array:
    """Real and imaginary part of u exp(i phase) exp(i angle) drive y and z: columns for cos and sin of the angle."""
    full = np.zeros((4 * whole.mesh.nodes, 2))
    for i, disk in enumerate(machine.rotor.disks):
        node = 4 * whole.mesh.node_of(f"rotor.disks[{i}].position")
        u = float(disk.unbalance) * np.exp(1j * float(disk.unbalance_phase))
        full[node : node + 2] += np.array([[u.real, -u.imag], [u.imag, u.real]])
    return np.asarray(full[list(whole.free)])
