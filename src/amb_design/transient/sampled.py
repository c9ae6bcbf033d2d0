"""Sampled controllers: they read at discrete times, and their commands act after a delay and are held."""

from __future__ import annotations

import math

import numpy as np
import scipy.linalg as sla

from ..analysis.sampled import INSTANT, discretised
from ..analysis.system import Array
from ..spec.sampling import Sampling
from .equations import Equations


class Sampler:
    """All controllers of a machine at work, one common clock.

    Parameters
    ----------
    equations : Equations
    sampling : Sampling
    memory, held, pending
        As in `State`.
    """

    def __init__(self, equations: Equations, sampling: Sampling, memory: Array, held: Array, pending: Array):
        self.equations, self.sampling = equations, sampling
        self.memory, self.held = memory.copy(), held.copy()
        self.pending = [row.copy() for row in pending]
        chains = [a.chain for a in equations.actuators if a.chain is not None]
        self._axes = [k for k, a in enumerate(equations.actuators) if a.chain is not None]
        laws = [discretised(c.a, c.b, c.c, c.d, sampling) for c in chains]
        self._a, self._b, self._c, self._d = (
            sla.block_diag(np.zeros((0, 0)), *[law[i] for law in laws]) for i in range(4)
        )

    def next_event(self, t: float) -> float:
        """Time of the next sample or command after t."""
        period = self.sampling.period
        sample = (math.floor(t / period + INSTANT) + 1) * period
        return min([float(sample), *(float(row[0]) for row in self.pending if row[0] > t + INSTANT * period)])

    def act(self, t: float, x: Array) -> None:
        """Do what is due at a time."""
        period = self.sampling.period
        near = INSTANT * period
        if abs(t / period - round(t / period)) < INSTANT:
            self.pending.append(np.concatenate([[t + self.sampling.delay], self._read(x)]))
        for row in [r for r in self.pending if r[0] <= t + near]:
            self.held = row[1:]
        self.pending = [r for r in self.pending if r[0] > t + near]

    def _read(self, x: Array) -> Array:
        p = self.equations.plant
        place, rate = p.sensors @ x[: p.size], p.sensors @ x[p.size : 2 * p.size]
        seen = np.stack([place, rate], axis=1)[self._axes].ravel()
        command = np.zeros(len(self.equations.actuators))
        command[self._axes] = self._c @ self.memory + self._d @ seen
        self.memory = self._a @ self.memory + self._b @ seen
        return command
