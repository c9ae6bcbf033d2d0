"""Frequency response by banded solution of the open structure and a small closed-loop algebra.

The structure with its magnets' negative stiffness, but without controllers, has a banded dynamic stiffness when the
nodes are numbered along the shaft. Each frequency takes one banded solution for all forces of interest; the loops are
then closed among the few sensor and actuator signals, which is exact and needs no eigenvalues.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.linalg import get_lapack_funcs

from ..errors import SolveError
from ..model.controller import Realisation
from ..model.loop import Structure
from .system import Array, dense, triplets


class Receptance:
    """Displacements of the open structure under harmonic forces.

    Parameters
    ----------
    plant : Structure
        Numeric.
    """

    def __init__(self, plant: Structure):
        self.plant = plant
        matrices = (plant.M, plant.C0, plant.C1, plant.K0, plant.K1)
        entries = [triplets(m) for m in matrices]
        self.bandwidth = max((int(np.abs(r - c).max()) for r, c, _ in entries if len(r)), default=0)
        self._bands = [self._banded(*e) for e in entries]
        (self._solve,) = get_lapack_funcs(("gbsv",), (np.zeros(1, complex),))

    def _banded(self, rows: Array, columns: Array, values: Array) -> Array:
        """LAPACK band storage with room for the factorisation."""
        b = self.bandwidth
        out = np.zeros((3 * b + 1, self.plant.size), complex)
        np.add.at(out, (2 * b + rows - columns, columns), values)
        return out

    def solve(self, frequency: float, speed: float, forces: Array) -> Array:
        """Complex amplitudes q of the motion q exp(i frequency t) under forces F exp(i frequency t).

        Parameters
        ----------
        frequency : float
            Excitation frequency [rad/s]; negative ones turn backward in the complex form.
        speed : float
            Spin speed [rad/s].
        forces : ndarray, shape (n, k)

        Returns
        -------
        ndarray, shape (n, k)

        Raises
        ------
        SolveError
            If an undamped machine is driven exactly at resonance.
        """
        m, c0, c1, k0, k1 = self._bands
        stiffness = k0 + speed * k1 + 1j * frequency * (c0 + speed * c1) - frequency**2 * m
        _, _, q, info = self._solve(self.bandwidth, self.bandwidth, stiffness, forces, overwrite_ab=True)
        if info:
            raise SolveError(f"the response at {frequency:.6g} rad/s is infinite: an undamped resonance")
        return np.asarray(q)


class Controller:
    """Transfer functions of a controller, from shaft displacements to currents.

    Parameters
    ----------
    law : Realisation
        Numeric state space.
    """

    def __init__(self, law: Realisation):
        self._matrices = [(dense(m.constant), dense(m.rate)) for m in (law.a, law.b, law.c, law.d)]
        self._real = not any(np.iscomplexobj(m) for pair in self._matrices for m in pair)
        self._last: tuple[float, float] = (float("nan"), float("nan"))
        self._found = np.zeros(0)

    def at(self, frequency: float, speed: float = 0.0) -> Array:
        """G(i frequency) [A/m], outputs by inputs, without the minus sign of the feedback."""
        mirrored = self._real and frequency < 0.0  # then one solution serves forward and backward whirl
        key = (abs(frequency) if self._real else frequency), speed
        if self._last != key:
            self._last, self._found = key, self._solve(*key)
        return self._found.conj() if mirrored else self._found

    def _solve(self, frequency: float, speed: float) -> Array:
        s = 1j * frequency
        a, b, c, d = (m + speed * rate for m, rate in self._matrices)
        inputs = d.shape[1] // 2
        direct = d[:, :inputs] + s * d[:, inputs:]
        if not len(a):
            return np.asarray(direct)
        try:
            states = np.linalg.solve(s * np.eye(len(a)) - a, b[:, :inputs] + s * b[:, inputs:])
        except np.linalg.LinAlgError:
            raise SolveError(
                f"the controller has a pole at {frequency:g} rad/s; ask for a frequency beside it"
            ) from None
        return np.asarray(c @ states + direct)


@dataclass(frozen=True)
class Point:
    """Everything about the loops at one frequency and speed.

    Attributes
    ----------
    sensitivity : ndarray, shape (inputs, inputs)
        (1 + P G)^-1, from disturbances added to the sensors to the shaft's displacements at the sensors plus them.
    controller : ndarray, shape (axes, inputs)
        G of all controllers.
    plant : ndarray, shape (inputs, axes)
        P: displacement at the sensors per control current of each axis [m/A].
    response : ndarray, shape (n, k)
        Closed-loop displacements under the forces.
    currents : ndarray, shape (axes, k)
        Control currents under the forces [A].
    """

    sensitivity: Array
    controller: Array
    plant: Array
    response: Array
    currents: Array


class Loops:
    """The controlled structure in the frequency domain.

    Parameters
    ----------
    plant : Structure
        Numeric.

    Attributes
    ----------
    axes : tuple of Axis
        That have a controller, in the order of the controllers.
    loops : tuple of int
        Those inputs at which a loop can be opened, in the order of `Structure.loops`.
    push, sense : ndarray
        Forces of currents, shape (n, axes), and what controllers see, shape (n, inputs).
    """

    def __init__(self, plant: Structure):
        self.plant = plant
        self.receptance = Receptance(plant)
        self.axes = plant.driven
        self._controllers = [Controller(block.law) for block in plant.blocks]
        n = plant.size
        self.push = np.hstack(
            [np.zeros((n, 0)), *[float(a.current_stiffness) * _numbers(a.actuator) for a in self.axes]]
        )
        self.sense = np.hstack([np.zeros((n, 0)), *[_numbers(block.sensors) for block in plant.blocks]])
        can_open = [not block.ideal for block in plant.blocks for _ in range(block.sensors.shape[1])]
        self.loops = tuple(k for k, it_can in enumerate(can_open) if it_can)

    def controller(self, frequency: float, speed: float) -> Array:
        """G of all controllers [A/m], axes by inputs."""
        out, row, column = np.zeros((len(self.axes), self.sense.shape[1]), complex), 0, 0
        for c in self._controllers:
            part = c.at(frequency, speed)
            out[row : row + part.shape[0], column : column + part.shape[1]] = part
            row, column = row + part.shape[0], column + part.shape[1]
        return out

    def at(self, frequency: float, speed: float, forces: Array | None = None) -> Point:
        """Solve the closed loop at a frequency.

        Parameters
        ----------
        frequency, speed : float [rad/s]
        forces : ndarray, shape (n, k), optional

        Returns
        -------
        Point
        """
        given = np.zeros((self.plant.size, 0), complex) if forces is None else forces
        k = given.shape[1]
        q = self.receptance.solve(frequency, speed, np.hstack([given, self.push]).astype(complex))
        controller = self.controller(frequency, speed)
        plant = self.sense.T @ q[:, k:]
        sensitivity = np.linalg.inv(np.eye(len(plant)) + plant @ controller)
        currents = -controller @ (sensitivity @ (self.sense.T @ q[:, :k]))
        return Point(sensitivity, controller, plant, q[:, :k] + q[:, k:] @ currents, currents)


def column(plant: Structure, entries: Sequence[tuple[int, complex]]) -> Array:
    """Complex column over the free degrees of freedom with values at places of the unpinned order."""
    where = {k: i for i, k in enumerate(plant.free)}
    out = np.zeros(plant.size, complex)
    for place, value in entries:
        if place in where:
            out[where[place]] += value
    return out


def _numbers(matrix: ca.DM) -> Array:
    return np.asarray(ca.DM(matrix).full())
