"""The closed loop as numbers: dense matrices in coordinates that suit an eigensolver.

The pencil E x' = (A0 + Omega A1) x is brought to standard form in the modal coordinates of the rotor at rest, scaled
so that the undamped part is skew-Hermitian. In these coordinates the matrix is close to normal: its eigenvalues are
well conditioned, and the certificate of the stability limit takes long steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ..model.loop import Pencil, Structure, close
from ..model.loop import structure as structure_of
from ..model.mesh import Mesh, plan
from ..model.pair import Pair
from ..spec.machine import Machine

Array: TypeAlias = np.ndarray[Any, Any]

SLOWEST = 1.0
"""Rigid and statically unstable modes are scaled as if they had this frequency [rad/s]."""


def dense(pair: Pair) -> Array:
    """A numeric CasADi pair as a dense array, real if it has no imaginary part."""
    re, im = ca.DM(pair.re).full(), ca.DM(pair.im).full() if pair.im.nnz() else None
    return re + 1j * im if im is not None and im.any() else re


@dataclass(frozen=True)
class System:
    """Numeric closed loop of a machine.

    Attributes
    ----------
    machine : Machine
    plant : Structure
        Its CasADi matrices (numeric).
    A0, A1 : ndarray, shape (n, n)
        dz/dt = (A0 + speed A1) z in balanced coordinates; complex in the complex form, else real.
    to_state : ndarray, shape (n, n)
        x = to_state z: balanced coordinates to the states of the pencil.
    from_rate : ndarray, shape (n, n)
        Left vectors: y^H = w^H from_rate belongs to the pencil if w^H belongs to A0 + speed A1.
    """

    machine: Machine
    plant: Structure
    pencil: Pencil
    A0: Array
    A1: Array
    to_state: Array
    from_rate: Array

    @property
    def complex_form(self) -> bool:
        """True if one complex coordinate stands for y and z."""
        return self.plant.complex_form

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.A0)

    @property
    def displacements(self) -> int:
        """Number of displacements at the head of the state."""
        return self.plant.size

    def truncated(self, modes: int) -> System:
        """The loop on the lowest modes of the rotor at rest, and all controller states.

        Parameters
        ----------
        modes : int
            Number of modes kept.
        """
        n = self.displacements
        keep = np.r_[0:modes, n : n + modes, 2 * n : self.size]
        inside = np.ix_(keep, keep)
        return System(
            self.machine,
            self.plant,
            self.pencil,
            self.A0[inside],
            self.A1[inside],
            self.to_state[:, keep],
            self.from_rate[keep],
        )

    @cached_property
    def mass(self) -> Array:
        """Mass matrix over the free degrees of freedom."""
        return dense(self.plant.M)

    def matrix(self, speed: float) -> Array:
        """A0 + speed A1."""
        return np.asarray(self.A0 + speed * self.A1)

    @cached_property
    def node_positions(self) -> Array:
        """Axial coordinates of all nodes [m]."""
        return node_positions(self.plant.mesh)


def node_positions(mesh: Mesh) -> Array:
    """Axial coordinates of all nodes of a mesh [m], middle nodes included."""
    x = [mesh.stations[0].position]
    for a, b, n in zip(mesh.stations, mesh.stations[1:], mesh.divisions, strict=False):
        x.extend(np.linspace(a.position, b.position, 2 * n + 1)[1:])
    return np.array(x)


def system(machine: Machine, mesh: Mesh | None = None, complex_form: bool | None = None) -> System:
    """Evaluate the closed loop of a machine.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    mesh : Mesh, optional
        Another mesh than the machine's own.
    complex_form : bool, optional
        Force the complex or the real form; chosen by the machine's symmetry if left out.

    Returns
    -------
    System
    """
    plant = structure_of(machine, mesh or plan(machine), complex_form)
    pencil = close(plant)
    n = plant.size
    mass, a0, a1 = dense(plant.M), dense(pencil.A0), dense(pencil.A1)
    stiffness = -a0[n : 2 * n, :n]
    squares, modes = sla.eigh((stiffness + stiffness.conj().T) / 2.0, mass)
    scale = np.maximum(np.sqrt(np.abs(squares)), SLOWEST)

    size = len(a0)
    dtype = np.result_type(a0, a1, modes)
    right = np.zeros((size, size), dtype)
    left = np.zeros((size, size), dtype)
    right[:n, :n] = modes / scale
    right[n : 2 * n, n : 2 * n] = modes
    left[:n, :n] = scale[:, None] * (modes.conj().T @ mass)
    left[n : 2 * n, n : 2 * n] = modes.conj().T
    controller = np.arange(2 * n, size)
    right[controller, controller] = left[controller, controller] = 1.0
    b0, b1 = left @ a0 @ right, left @ a1 @ right
    b0[:n, :] = 0.0
    b0[np.arange(n), n + np.arange(n)] = scale  # exactly, instead of to rounding
    top = machine.operation.top_speed
    _, (powers, _) = sla.matrix_balance(np.abs(b0) + top * np.abs(b1), permute=False, separate=True)
    b0, b1 = b0 / powers[:, None] * powers, b1 / powers[:, None] * powers
    return System(machine, plant, pencil, b0, b1, right * powers, left / powers[:, None])
