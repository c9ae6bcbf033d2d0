"""Controllers in front of their amplifiers, all of a machine together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import casadi as ca
import numpy as np

from ..analysis.system import Array, dense
from ..model.loop import Block, Structure
from ..model.pair import Affine

Matrices: TypeAlias = tuple[Array, Array, Array, Array]


@dataclass(frozen=True)
class Law:
    """dx/dt = a x + b [s, v], commands = c x + d [s, v] [A], without the minus sign of the feedback.

    s and v are displacements and velocities of what the controllers see: sensors, or of ideal feedback all nodes. Whichever axes a
    controller couples, here it is real. Each matrix is a pair: at rest, and what a rad/s of spin speed adds.

    Attributes
    ----------
    sensors : ndarray, shape (inputs, n)
        From modal coordinates to s.
    a, b, c, d : ndarray, shapes (2, states, states), (2, states, 2 inputs), (2, axes, states), (2, axes, 2 inputs)
    """

    sensors: Array
    a: Array
    b: Array
    c: Array
    d: Array

    @classmethod
    def of(cls, whole: Structure, shapes: Array, gains: Array) -> Law:
        """All controllers of a machine.

        Parameters
        ----------
        whole : Structure
            Real, its controllers without amplifiers.
        shapes : ndarray, shape (free degrees of freedom, n)
        gains : ndarray, shape (axes,)
            Of the amplifiers [A/V].
        """
        axes = len(whole.axes)
        states, inputs = (sum(n) for n in zip((0, 0), *map(_sizes, whole.blocks), strict=True))
        a, c = np.zeros((2, states, states)), np.zeros((2, axes, states))
        b, d = np.zeros((2, states, 2, inputs)), np.zeros((2, axes, 2, inputs))
        rows, k, j = [np.zeros((0, len(shapes)))], 0, 0
        for block in whole.blocks:
            (n, m), law, to = _sizes(block), block.law, list(block.axes)
            own, seen = slice(k, k + n), slice(j, j + m)
            a[:, own, own], c[:, to, own] = _pair(law.a), _pair(law.c)
            b[:, own, :, seen] = _pair(law.b).reshape(2, n, 2, m)
            d[:, to, :, seen] = _pair(law.d).reshape(2, len(to), 2, m)
            rows.append(ca.DM(block.sensors).full().T)
            k, j = k + n, j + m
        b, d = b.reshape(2, states, 2 * inputs), d.reshape(2, axes, 2 * inputs)
        return cls(np.vstack(rows) @ shapes, a, b, gains[:, None] * c, gains[:, None] * d)

    @property
    def states(self) -> int:
        """Number of states."""
        return int(self.a.shape[1])

    @property
    def fixed(self) -> bool:
        """True if nothing changes with the speed."""
        return not any(m[1].any() for m in (self.a, self.b, self.c, self.d))

    def at(self, speed: float) -> Matrices:
        """a, b, c and d at a spin speed [rad/s]."""
        a, b, c, d = (m[0] + speed * m[1] for m in (self.a, self.b, self.c, self.d))
        return a, b, c, d

    def seen(self, xi: Array, rate: Array) -> Array:
        """[s, v] for modal coordinates and their rates."""
        return np.concatenate([self.sensors @ xi, self.sensors @ rate])

    @property
    def rates(self) -> Array:
        """From modal coordinates, their rates and the law's states to the latter's derivatives, shape (2, states, 2 n + states)."""
        return self._on_motion(self.b, self.a)

    @property
    def commands(self) -> Array:
        """From the same to the commands, shape (2, axes, 2 n + states)."""
        return self._on_motion(self.d, self.c)

    def _on_motion(self, seeing: Array, own: Array) -> Array:
        return np.concatenate([part @ self.sensors for part in np.split(seeing, 2, axis=2)] + [own], axis=2)


def _sizes(block: Block) -> tuple[int, int]:
    """Numbers of states and inputs."""
    return len(block.law.states), int(block.sensors.shape[1])


def _pair(matrix: Affine) -> Array:
    return np.array([dense(matrix.constant), dense(matrix.rate)])
