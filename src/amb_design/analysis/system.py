"""The closed loop as numbers: dense matrices in coordinates that suit an eigensolver.

The pencil E x' = (A0 + Omega A1) x is brought to standard form in the modal coordinates of the rotor at rest, scaled
so that the undamped part is skew-Hermitian. In these coordinates the matrix is close to normal: its eigenvalues are
well conditioned, and the certificate of the stability limit takes long steps. Nothing is computed before it is asked for, so
that analyses which work on the sparse matrices do without the dense ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ..errors import ModelError
from ..model.loop import Pencil, Structure, close
from ..model.loop import structure as structure_of
from ..model.mesh import Mesh, plan
from ..model.pair import Pair
from ..spec.fields import is_symbolic
from ..spec.machine import Machine
from ..spec.paths import numbers
from ..synthesis.design import synthesise

Array: TypeAlias = np.ndarray[Any, Any]

SLOWEST = 1.0
"""Rigid and statically unstable modes are scaled as if they had this frequency [rad/s]."""


def triplets(pair: Pair) -> tuple[Array, Array, Array]:
    """Rows, columns and values of a numeric CasADi pair; a place may come twice, with its real and imaginary part."""
    rows, columns, values = [], [], []
    for part, factor in ((pair.re, 1.0), (pair.im, 1j)):
        matrix = ca.DM(part)
        r, c = matrix.sparsity().get_triplet()
        rows += r
        columns += c
        values += [factor * v for v in matrix.nonzeros()]
    return np.array(rows, int), np.array(columns, int), np.array(values)


def dense(pair: Pair) -> Array:
    """A numeric CasADi pair as a dense array, real if it has no imaginary part."""
    rows, columns, values = triplets(pair)
    values = values if values.imag.any() else values.real
    out = np.zeros(pair.shape, values.dtype)
    np.add.at(out, (rows, columns), values)
    return out


@dataclass(frozen=True)
class System:
    """Numeric closed loop of a machine.

    Attributes
    ----------
    machine : Machine
    plant : Structure
        Its CasADi matrices (numeric).
    kept : int
        Number of modes of the rotor at rest that the balanced coordinates hold; all of them is exact.
    """

    machine: Machine
    plant: Structure
    kept: int

    @cached_property
    def pencil(self) -> Pencil:
        """E x' = (A0 + speed A1) x of the full model, sparse."""
        return close(self.plant)

    @property
    def A0(self) -> Array:  # noqa: N802
        """dz/dt = (A0 + speed A1) z in balanced coordinates; complex in the complex form, else real."""
        return self._balanced[0]

    @property
    def A1(self) -> Array:  # noqa: N802
        """Part of the matrix that is proportional to the speed."""
        return self._balanced[1]

    @property
    def to_state(self) -> Array:
        """x = to_state z: balanced coordinates to the states of the pencil."""
        return self._balanced[2]

    @property
    def from_rate(self) -> Array:
        """Left vectors: y^H = w^H from_rate belongs to the pencil if w^H belongs to A0 + speed A1."""
        return self._balanced[3]

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
        return System(self.machine, self.plant, modes)

    @cached_property
    def mass(self) -> Array:
        """Mass matrix over the free degrees of freedom."""
        return dense(self.plant.M)

    def matrix(self, speed: float) -> Array:
        """A0 + speed A1.

        Parameters
        ----------
        speed : float
            Spin speed [rad/s].
        """
        return np.asarray(self.A0 + speed * self.A1)

    @cached_property
    def _balanced(self) -> tuple[Array, Array, Array, Array]:
        n, k = self.displacements, self.kept
        a0, a1, mass = dense(self.pencil.A0), dense(self.pencil.A1), self.mass
        stiffness = -a0[n : 2 * n, :n]
        squares, modes = sla.eigh(
            (stiffness + stiffness.conj().T) / 2.0, mass, subset_by_index=None if k == n else (0, k - 1)
        )
        scale = np.maximum(np.sqrt(np.abs(squares)), SLOWEST)
        controllers = np.eye(len(a0) - 2 * n)
        right = sla.block_diag(modes / scale, modes, controllers)
        left = sla.block_diag(scale[:, None] * (modes.conj().T @ mass), modes.conj().T, controllers)
        b0, b1 = left @ a0 @ right, left @ a1 @ right
        b0[:k, :] = 0.0
        b0[np.arange(k), k + np.arange(k)] = scale  # exactly, instead of to rounding
        top = self.machine.operation.top_speed
        _, (powers, _) = sla.matrix_balance(np.abs(b0) + top * np.abs(b1), permute=False, separate=True)
        return b0 / powers[:, None] * powers, b1 / powers[:, None] * powers, right * powers, left / powers[:, None]

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

    Raises
    ------
    ModelError
        If a number is a symbol.
    """
    symbolic = next((path for path, found in numbers(machine) if is_symbolic(found)), None)
    if symbolic is not None:
        raise ModelError(f"{symbolic} is a symbol; analyses need numbers: use ad.closed_loop for expressions")
    plant = structure_of(synthesise(machine), mesh or plan(machine), complex_form)
    return System(machine, plant, plant.size)


def ascending(speeds: Sequence[float] | Array) -> Array:
    """Speeds as an array, checked.

    Parameters
    ----------
    speeds : array_like
        At least one finite number [rad/s], none below zero, each larger than the one before.

    Raises
    ------
    ModelError
        If they are not.
    """
    grid = np.asarray(speeds, float)
    if grid.ndim != 1 or not len(grid) or not np.isfinite(grid).all() or grid[0] < 0.0 or (np.diff(grid) <= 0.0).any():
        raise ModelError("speeds must be one or more finite numbers in rad/s, not negative and ascending")
    return grid
