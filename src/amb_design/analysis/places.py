"""Any place of the shaft: what moves there, and forces that act there, with the interpolation of the elements."""

from __future__ import annotations

import cmath

import numpy as np

from ..errors import ModelError
from ..model.rotor import rotor
from .frequency import column
from .modes import unpinned
from .system import Array, System, dense


def weights(positions: Array, position: float) -> tuple[int, Array]:
    """First of the three nodes around a place, and the interpolation functions of the three there.

    Parameters
    ----------
    positions : ndarray, shape (nodes,)
        Nodes along the shaft [m], middle nodes included.
    position : float
        Distance from the left shaft end [m].

    Raises
    ------
    ModelError
        If the place is not on the shaft.
    """
    if not positions[0] <= position <= positions[-1] * (1.0 + 1e-12):
        raise ModelError(f"x = {position:g} m is not on the shaft (0 to {positions[-1]:g} m)")
    left = 2 * min(int(np.searchsorted(positions[2::2], position)), (len(positions) - 3) // 2)
    t = (position - positions[left]) / (positions[left + 2] - positions[left])
    return left, np.array([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])


def interpolated(positions: Array, shapes: Array, position: float) -> Array:
    """Values at a place of the shaft, quadratic inside each element as the model has it.

    Parameters
    ----------
    positions : ndarray, shape (nodes,) [m]
    shapes : ndarray, shape (nodes, ...)
        Values at the nodes.
    position : float [m]

    Raises
    ------
    ModelError
        If the place is not on the shaft.
    """
    left, psi = weights(positions, position)
    return np.asarray(np.tensordot(psi, shapes[left : left + 3], 1))


def motion(loop: System, q: Array, position: float) -> Array:
    """Displacements v and w at a place for given coordinates.

    Parameters
    ----------
    loop : System
    q : ndarray, shape (free degrees of freedom, k)
    position : float [m]

    Returns
    -------
    ndarray, shape (1 or 2, k)
        In the complex form r = v + i w; else v and w.
    """
    full = unpinned(loop, q)
    width = 2 if loop.complex_form else 4
    return np.stack(
        [interpolated(loop.node_positions, full[k::width], position) for k in range(1 if loop.complex_form else 2)]
    )


def force(loop: System, position: float, angle: float = 0.0) -> Array:
    """Load of a unit force across the shaft, over the free degrees of freedom.

    Parameters
    ----------
    loop : System
    position : float
        Where it acts [m].
    angle : float
        Its direction, from y towards z [rad].
    """
    left, psi = weights(loop.node_positions, position)
    turn = cmath.rect(1.0, angle)
    width = 2 if loop.complex_form else 4
    entries: list[tuple[int, complex]] = []
    for node, share in enumerate(psi, left):
        if loop.complex_form:
            entries.append((width * node, share * turn))
        else:
            entries += [(width * node, share * turn.real), (width * node + 1, share * turn.imag)]
    return column(loop.plant, entries)


def inertia(loop: System, angle: float = 0.0) -> Array:
    """Mass times a unit translation, over the free degrees of freedom: minus the load of a unit acceleration of the base.

    Parameters
    ----------
    loop : System
    angle : float
        Direction of the translation, from y towards z [rad].

    Notes
    -----
    What the pins hold has mass too; the mass matrix is therefore that of the rotor without them.
    """
    mass = rotor(loop.machine, loop.plant.mesh).M
    turn = cmath.rect(1.0, angle)
    rigid = np.zeros((2 if loop.complex_form else 4) * loop.plant.mesh.nodes, complex)
    if loop.complex_form:
        rigid[0::2] = turn
    else:
        rigid[0::4], rigid[1::4] = turn.real, turn.imag
    whole = dense(mass.H if loop.complex_form else mass.to_real())
    return np.asarray((whole @ rigid)[list(loop.plant.free)])
