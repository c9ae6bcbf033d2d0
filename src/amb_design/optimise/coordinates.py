"""Coordinates for the eigensolver: balanced, and optionally few.

The rotor's displacements are represented by its modes at rest; controller states stay as they are. With all modes this is an
exact change of coordinates, good for any design once it has been made. With few modes it is a projection: its
derivatives left^H dX right, with the vectors lifted back, miss only how the modes themselves change.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from ..analysis.system import SLOWEST, Array
from .family import Member


@dataclass(frozen=True)
class Coordinates:
    """x = right z, and left (E, A0, A1) right are the matrices in z.

    Attributes
    ----------
    right : ndarray, shape (n, m)
    left : ndarray, shape (m, n)
    """

    right: Array
    left: Array

    @property
    def size(self) -> int:
        """Number of states kept."""
        return int(self.right.shape[1])


def identity(size: int) -> Coordinates:
    """The coordinates of a matrix family without rotor structure."""
    return Coordinates(np.eye(size), np.eye(size))


def modal(member: Member, displacements: int, speed: float, modes: int | None = None) -> Coordinates:
    """Modal coordinates of a rotor on magnets.

    Parameters
    ----------
    member : Member
        With states q, dq/dt, controllers.
    displacements : int
        Length of q.
    speed : float
        Typical spin speed, for the balance [rad/s].
    modes : int, optional
        Number of the lowest modes at rest that are kept; all if left out.
    """
    n = displacements
    a0, a1, mass = member.part("A0"), member.part("A1"), member.part("E")[n : 2 * n, n : 2 * n]
    stiffness = -a0[n : 2 * n, :n]
    subset = None if modes is None else (0, modes - 1)
    squares, shapes = sla.eigh(
        (stiffness + stiffness.conj().T) / 2.0, (mass + mass.conj().T) / 2.0, subset_by_index=subset
    )
    scale = np.maximum(np.sqrt(np.abs(squares)), SLOWEST)
    controllers = np.eye(len(a0) - 2 * n)
    right = sla.block_diag(shapes / scale, shapes, controllers)
    left = sla.block_diag(scale[:, None] * (shapes.conj().T @ mass), shapes.conj().T, controllers)
    weights = np.abs(left @ a0 @ right) + speed * np.abs(left @ a1 @ right)
    _, (powers, _) = sla.matrix_balance(weights, permute=False, separate=True)
    return Coordinates(right * powers, left / powers[:, None])
