"""Sampled controllers: they read at discrete times, and their commands act after a delay and are held."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev

from ..analysis.sampled import INSTANT, discretised
from ..analysis.system import Array
from ..spec.sampling import Sampling
from .equations import Equations
from .law import Law, Matrices
from .loads import Spin

EXACT = 1e-13
"""Relative size of what polynomials in the speed may leave out."""

DEGREES = (6, 12, 24)
"""Of the polynomials that are tried."""


class Sampler:
    """All controllers of a machine at work, one common clock.

    Parameters
    ----------
    equations : Equations
    sampling : Sampling
    spin : Spin
    memory, held, pending
        `law`, `held` and `pending` of a `State`.
    """

    def __init__(
        self, equations: Equations, sampling: Sampling, spin: Spin, memory: Array, held: Array, pending: Array
    ):
        self.equations, self.sampling, self.spin = equations, sampling, spin
        self._law = difference_equations(equations.plant.law, sampling, spin)
        self.restart(memory, held, pending)

    def restart(self, memory: Array, held: Array, pending: Array) -> None:
        """Go on from other states."""
        self.memory, self.held = memory.copy(), held.copy()
        self.pending = [row.copy() for row in pending]

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
            self.pending.append(np.concatenate([[t + self.sampling.delay], self._read(t, x)]))
        for row in [r for r in self.pending if r[0] <= t + near]:
            self.held = row[1:]
        self.pending = [r for r in self.pending if r[0] > t + near]

    def _read(self, t: float, x: Array) -> Array:
        a, b, c, d = self._law(t)
        n = self.equations.plant.size
        seen = self.equations.plant.law.seen(x[:n], x[n : 2 * n])
        command = c @ self.memory + d @ seen
        self.memory = a @ self.memory + b @ seen
        return np.asarray(command)


def difference_equations(law: Law, sampling: Sampling, spin: Spin) -> Callable[[float], Matrices]:
    """The law at discrete times, as a function of time.

    Where it follows the speed its matrices are polynomials in the speed through Chebyshev's points, exact to rounding: at each
    sample there would be a matrix to be inverted or an exponential else.
    """

    def exact(speed: float) -> Matrices:
        return discretised(*law.at(speed), sampling)

    low, high = min(spin.speeds), max(spin.speeds)
    if law.fixed or low == high:
        always = exact(low)
        return lambda t: always
    middle, half = (high + low) / 2.0, (high - low) / 2.0
    shapes = [m.shape for m in exact(middle)]
    edges = np.cumsum([math.prod(shape) for shape in shapes])[:-1]
    for degree in DEGREES:
        nodes = chebyshev.chebpts1(degree + 1)
        values = np.array([np.concatenate([m.ravel() for m in exact(middle + half * k)]) for k in nodes])
        flat: Array = np.linalg.solve(chebyshev.chebvander(nodes, degree), values)
        parts = np.split(flat, edges, axis=1)
        if all(np.abs(m[-2:]).max(initial=0.0) <= EXACT * np.abs(m).max(initial=0.0) for m in parts):
            break
    else:
        return lambda t: exact(spin.at(t)[1])

    def at(t: float) -> Matrices:
        (weights,) = chebyshev.chebvander((spin.at(t)[1] - middle) / half, degree)
        a, b, c, d = (part.reshape(s) for part, s in zip(np.split(weights @ flat, edges), shapes, strict=True))
        return a, b, c, d

    return at
