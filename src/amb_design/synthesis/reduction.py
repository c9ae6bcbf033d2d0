"""The rotor on its lowest modes, with the static rest: what a controller is designed for.

Modes are those at rest without magnets: their shapes do not depend on bias currents. What the modes left out would add at the sensors
is kept as a static flexibility, so that the zeros of the plant lie where they should.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ..errors import ModelError
from ..model.loop import Structure, structure
from ..model.magnet import negative_stiffness
from ..model.mesh import Mesh, plan
from ..model.pair import Matrix, Pair
from ..spec.machine import Machine

Array = np.ndarray


@dataclass(frozen=True)
class Basis:
    """Coordinates of the reduced rotor.

    Attributes
    ----------
    shapes : ndarray, shape (free degrees of freedom, modes)
        Modes at rest without magnets, mass-normalised.
    frequencies : ndarray, shape (modes,) [rad/s]
    heights : ndarray, shape (modes,)
        Largest displacement of each mode along the shaft.
    residual : ndarray, shape (axes, axes)
        Displacement at the sensors per force of the axes from all other modes, statically [m/N].
    mesh : Mesh
    complex_form : bool
    """

    shapes: Array
    frequencies: Array
    heights: Array
    residual: Array
    mesh: Mesh
    complex_form: bool

    @property
    def size(self) -> int:
        """Number of modes."""
        return len(self.frequencies)

    @property
    def planes(self) -> int:
        """Planes that the modes stand for: one complex coordinate for both is one, y and z are two."""
        return 1 if self.complex_form else 2


def basis_of(machine: Machine, modes: int) -> Basis:
    """Lowest modes at rest of a machine without its magnets.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    modes : int
        In each plane.

    Returns
    -------
    Basis

    Raises
    ------
    ModelError
        If there are fewer modes, or so few are asked for that the rest would not stand without control, such as rigid-body motions.
    """
    mesh = plan(machine)
    plant = structure(machine.without_controllers(), mesh)
    mass, stiffness = _full(plant.M), _full(plant.K0)
    push = np.hstack([_full(a.actuator) for a in plant.axes])
    outward = np.array([float(negative_stiffness(machine.magnets[a.magnet])) for a in plant.axes])
    stiffness = stiffness + push * outward @ push.T  # take the negative stiffness out again
    planes = 1 if plant.complex_form else 2
    count = planes * modes
    if count > len(mass):
        raise ModelError(f"{machine.name} has {len(mass)} modes in its model, fewer than the {count} of the controller")
    squares, shapes = sla.eigh((stiffness + stiffness.T) / 2.0, mass)
    pull = shapes.T @ push
    needed = next(c for c in range(modes, len(mass) + 1) if _stands(squares, pull, outward, planes * c))
    if needed > modes:
        raise ModelError(
            f"{machine.name}: controller.modes = {modes} leaves out a mode that does not stand without control; "
            f"raise it to {needed} or more"
        )
    frequencies = np.sqrt(np.maximum(squares, 0.0))
    sense = np.hstack([_full(a.sensor) for a in plant.axes])
    residual = (sense.T @ shapes[:, count:]) / squares[count:] @ pull[count:]
    width = 2 if plant.complex_form else 4
    moving = [i for i, place in enumerate(plant.free) if place % width < width // 2]
    heights = np.abs(shapes[moving, :count]).max(axis=0)
    return Basis(shapes[:, :count], frequencies[:count], heights, residual, mesh, plant.complex_form)


def _stands(squares: Array, pull: Array, outward: Array, known: int) -> bool:
    """True if all modes but the first ones bear the magnets' negative stiffness by themselves."""
    rest = np.diag(squares[known:]) - pull[known:] * outward @ pull[known:].T
    rounding = 100.0 * np.finfo(float).eps * squares[-1]
    return not len(rest) or bool(sla.eigvalsh(rest, subset_by_index=(0, 0))[0] > rounding)


@dataclass(frozen=True)
class Reduced:
    """q'' = -(K0 + Omega K1) q - (C0 + Omega C1) q' + push i with displacements seen q + residual i at the sensors.

    All are CasADi matrices, symbolic where the machine holds symbols.

    Attributes
    ----------
    K0, K1, C0, C1 : Pair
    push : Matrix, shape (modes, axes) [1/(kg^1/2) N/A]
        Modal force per current.
    force : Matrix, shape (modes, axes)
        Modal force per force of an axis.
    seen : Matrix, shape (axes, modes)
    moved : Matrix, shape (axes, modes)
        Displacements at the magnets.
    residual : Matrix, shape (axes, axes) [m/A]
    """

    K0: Pair
    K1: Pair
    C0: Pair
    C1: Pair
    push: Matrix
    force: Matrix
    seen: Matrix
    moved: Matrix
    residual: Matrix


def reduced(machine: Machine, basis: Basis) -> Reduced:
    """A machine in given modal coordinates.

    Parameters
    ----------
    machine : Machine
        Numbers or CasADi scalars; of the same mesh as the basis.
    basis : Basis
    """
    plant: Structure = structure(machine.without_controllers(), basis.mesh, basis.complex_form)
    phi = ca.DM(basis.shapes)
    mass = ca.mtimes([phi.T, plant.M.re, phi])

    def modal(matrix: Pair) -> Pair:
        both = matrix.between(phi.T, phi)
        return Pair(_solved(mass, both.re), _solved(mass, both.im))

    gains = ca.diag(ca.vertcat(*[a.current_stiffness for a in plant.axes]))
    actuators = ca.horzcat(*[a.actuator for a in plant.axes])
    sensors = ca.horzcat(*[a.sensor for a in plant.axes])
    force = _solved(mass, ca.mtimes(phi.T, actuators))
    return Reduced(
        modal(plant.K0),
        modal(plant.K1),
        modal(plant.C0),
        modal(plant.C1),
        ca.mtimes(force, gains),
        force,
        ca.mtimes(sensors.T, phi),
        ca.mtimes(actuators.T, phi),
        ca.mtimes(ca.DM(basis.residual), gains),
    )


def _solved(mass: Matrix, right: Matrix) -> Matrix:
    """mass^-1 right; the mass matrix is the unit matrix but where shapes or materials are variables."""
    if isinstance(mass, ca.DM):
        return ca.mtimes(ca.DM(np.linalg.inv(mass.full())), right) if right.nnz() else right
    return ca.solve(ca.densify(mass), ca.densify(right))


def _full(matrix: Matrix) -> Array:
    """Real part of a numeric matrix."""
    return np.asarray(ca.DM(matrix.re if isinstance(matrix, Pair) else matrix).full())
