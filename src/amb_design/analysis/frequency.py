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
from .system import Array, triplets


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


class Chain:
    """Transfer function of a controller chain, from shaft displacement to current.

    Parameters
    ----------
    realisation : Realisation
        Numeric state space.
    """

    def __init__(self, realisation: Realisation):
        a, b, c, d = (np.array(ca.DM(m).full()) for m in (realisation.a, realisation.b, realisation.c, realisation.d))
        self._a, self._b, self._c, self._d = a, b, c, d
        self._last = float("nan"), 0j

    def at(self, frequency: float) -> complex:
        """G(i frequency) [A/m], without the minus sign of the feedback."""
        size = abs(frequency)  # the coefficients are real: one solution serves forward and backward whirl
        if self._last[0] != size:
            self._last = size, self._solve(size)
        return self._last[1] if frequency >= 0.0 else self._last[1].conjugate()

    def _solve(self, frequency: float) -> complex:
        s = 1j * frequency
        inputs = np.array([1.0, s])
        direct = self._d[0] @ inputs
        if not len(self._a):
            return complex(direct)
        try:
            state = np.linalg.solve(s * np.eye(len(self._a)) - self._a, self._b @ inputs)
        except np.linalg.LinAlgError:
            raise SolveError(
                f"the controller has a pole at {frequency:g} rad/s; ask for a frequency beside it"
            ) from None
        return complex(self._c[0] @ state + direct)


@dataclass(frozen=True)
class Point:
    """Everything about the loops at one frequency and speed.

    Attributes
    ----------
    sensitivity : ndarray, shape (axes, axes)
        (1 + P G)^-1, from disturbances added to the sensors to the shaft's displacements at the sensors plus them.
    chains : ndarray, shape (axes,)
        G of each axis.
    plant : ndarray, shape (axes, axes)
        P: displacement at the sensors per control current of each axis [m/A].
    response : ndarray, shape (n, k)
        Closed-loop displacements under the forces.
    currents : ndarray, shape (axes, k)
        Control currents under the forces [A].
    """

    sensitivity: Array
    chains: Array
    plant: Array
    response: Array
    currents: Array


class Loops:
    """The controlled structure in the frequency domain.

    Parameters
    ----------
    plant : Structure
        Numeric.
    """

    def __init__(self, plant: Structure):
        self.plant = plant
        self.receptance = Receptance(plant)
        self.axes = tuple(a for a in plant.axes if a.chain is not None)
        self._chains = [Chain(a.chain) for a in self.axes if a.chain is not None]
        n = plant.size
        self.push = np.hstack(
            [np.zeros((n, 0)), *[float(a.current_stiffness) * _column(a.actuator) for a in self.axes]]
        )
        self.sense = np.hstack([np.zeros((n, 0)), *[_column(a.sensor) for a in self.axes]])

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
        chains = np.array([c.at(frequency) for c in self._chains], complex)
        plant = self.sense.T @ q[:, k:]
        sensitivity = np.linalg.inv(np.eye(len(chains)) + plant * chains) if len(chains) else np.zeros((0, 0), complex)
        currents = -chains[:, None] * (sensitivity @ (self.sense.T @ q[:, :k]))
        return Point(sensitivity, chains, plant, q[:, :k] + q[:, k:] @ currents, currents)


def column(plant: Structure, entries: Sequence[tuple[int, complex]]) -> Array:
    """Complex column over the free degrees of freedom with values at places of the unpinned order."""
    where = {k: i for i, k in enumerate(plant.free)}
    out = np.zeros(plant.size, complex)
    for place, value in entries:
        if place in where:
            out[where[place]] += value
    return out


def _column(matrix: ca.DM) -> Array:
    return np.asarray(ca.DM(matrix).full())
