"""Unbalance response: displacements along the shaft, control currents, bearing and magnet forces over the speed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from ..errors import ModelError
from ..model.magnet import negative_stiffness
from ..spec.machine import Machine
from ..threads import one_thread
from .frequency import Loops, column
from .modes import circular, unpinned
from .places import interpolated
from .system import Array, System, ascending, node_positions, system


@dataclass(frozen=True)
class UnbalanceResponse:
    """Result of `unbalance_response`.

    Complex amplitudes multiply exp(i Omega t); the imaginary unit leads by a quarter turn.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        Spin speeds [rad/s].
    positions : ndarray, shape (nodes,)
        Nodes along the shaft [m].
    displacements : ndarray, shape (m, nodes, 2)
        v and w [m].
    currents : ndarray, shape (m, magnets, 2)
        Control currents of the magnets' axes [A]; zeros without controller.
    bearing_forces : ndarray, shape (m, bearings, 2)
        Forces of the passive bearings on the shaft in y and z [N].
    magnet_forces : ndarray, shape (m, magnets, 2)
        Forces of the magnets on the shaft along their axes [N], negative stiffness included.
    machine : Machine
    """

    speeds: Array
    positions: Array
    displacements: Array
    currents: Array
    bearing_forces: Array
    magnet_forces: Array
    machine: Machine = field(repr=False)

    @property
    def amplitudes(self) -> Array:
        """Largest radius of the orbit at each node [m], shape (m, nodes)."""
        return major_axis(self.displacements)

    @property
    def peak_currents(self) -> Array:
        """Largest amplitude over the two axes of each magnet [A], shape (m, magnets)."""
        return np.asarray(np.abs(self.currents).max(axis=2, initial=0.0))

    def at(self, position: float) -> Array:
        """Displacements v and w at any place of the shaft [m].

        Parameters
        ----------
        position : float
            Distance from the left shaft end [m].

        Returns
        -------
        ndarray, shape (m, 2)
            Quadratic inside each element, as the model has it.

        Raises
        ------
        ModelError
            If the place is not on the shaft.
        """
        return interpolated(self.positions, np.moveaxis(self.displacements, 1, 0), position)


def major_axis(amplitudes: Array) -> Array:
    """Largest radius of the orbit with complex amplitudes (v, w) in the last axis."""
    forward, backward = circular(amplitudes)
    return np.asarray(np.abs(forward) + np.abs(backward))


@one_thread
def unbalance_response(machine: Machine | System, speeds: Sequence[float] | Array | None = None) -> UnbalanceResponse:
    """Steady response to the disks' unbalances.

    Parameters
    ----------
    machine : Machine or System
    speeds : array_like, optional
        Spin speeds [rad/s]; 400 up to the top speed if left out.

    Returns
    -------
    UnbalanceResponse

    Raises
    ------
    ModelError
        If no disk has an unbalance.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    top = loop.machine.operation.top_speed
    grid = np.linspace(top / 400.0, top, 400) if speeds is None else ascending(speeds)
    plant = loop.plant
    loops = Loops(plant)
    unit = unbalance_forces(loop)[:, None]
    points = [loops.at(float(s), float(s), s**2 * unit) for s in grid]
    q = np.stack([p.response[:, 0] for p in points])
    full = unpinned(loop, q.T).T
    if loop.complex_form:
        displacements = np.stack([full[:, 0::2], -1j * full[:, 0::2]], axis=2)
    else:
        displacements = np.stack([full[:, 0::4], full[:, 1::4]], axis=2)
    m = loop.machine
    currents = _axis_values(loop, loops, np.stack([p.currents[:, 0] for p in points]))
    return UnbalanceResponse(
        speeds=grid,
        positions=node_positions(plant.mesh),
        displacements=displacements,
        currents=currents,
        bearing_forces=_bearing_forces(loop, grid, displacements),
        magnet_forces=_magnet_forces(loop, displacements, currents),
        machine=m,
    )


def unbalance_forces(loop: System) -> Array:
    """Force amplitudes of the disks' unbalances per squared spin speed [kg m], over the free degrees of freedom."""
    disks = loop.machine.rotor.disks
    if not any(d.unbalance for d in disks):
        raise ModelError(f"{loop.machine.name} has no unbalance; give a disk an `unbalance` in kg m")
    entries: list[tuple[int, complex]] = []
    for i, disk in enumerate(disks):
        node = loop.plant.mesh.node_of(f"rotor.disks[{i}].position")
        u = disk.unbalance * complex(math.cos(disk.unbalance_phase), math.sin(disk.unbalance_phase))
        entries += [(2 * node, u)] if loop.complex_form else [(4 * node, u), (4 * node + 1, -1j * u)]
    return column(loop.plant, entries)


def _axis_values(loop: System, loops: Loops, values: Array) -> Array:
    """Values of the controlled loops as (speeds, magnets, 2 axes)."""
    out = np.zeros((len(values), len(loop.machine.magnets), 2), complex)
    for k, axis in enumerate(loops.axes):
        if loop.complex_form:  # first and second axis, turned by the angle of the axes
            turned = values[:, k] * np.exp(-1j * float(loop.machine.magnets[axis.magnet].axes_angle))
            out[:, axis.magnet] = np.stack([turned, -1j * turned], axis=1)
        else:
            out[:, axis.magnet, int(axis.name.endswith("z"))] = values[:, k]
    return out


def _bearing_forces(loop: System, speeds: Array, displacements: Array) -> Array:
    out = np.zeros((len(speeds), len(loop.machine.bearings), 2), complex)
    for i, bearing in enumerate(loop.machine.bearings):
        u = displacements[:, loop.plant.mesh.node_of(f"bearings[{i}].position")]
        k, c = np.array(bearing.stiffness_matrix, float), np.array(bearing.damping_matrix, float)
        out[:, i] = -(u @ k.T + 1j * speeds[:, None] * (u @ c.T))
    return out


def _magnet_forces(loop: System, displacements: Array, currents: Array) -> Array:
    out = np.zeros_like(currents)
    gains = {a.magnet: float(a.current_stiffness) for a in loop.plant.axes}
    for i, magnet in enumerate(loop.machine.magnets):
        u = displacements[:, loop.plant.mesh.node_of(f"magnets[{i}].position")]
        c, s = math.cos(magnet.axes_angle), math.sin(magnet.axes_angle)
        along = u @ np.array([[c, -s], [s, c]])
        out[:, i] = gains[i] * currents[:, i] + float(ca.DM(negative_stiffness(magnet))) * along
    return out
