"""When what acts: the run is cut into pieces on which every load is a smooth function of time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from .loads import BaseMotion, Disturbance, Force, Impulse, Shaking, Spin
from .plant import Plant

HEAD = 8
"""Numbers of a piece before the switches of the forces: start, angle, speed, its derivative, base accelerations and slopes."""


@dataclass(frozen=True)
class Piece:
    """A part of the run.

    Attributes
    ----------
    start, stop : float [s]
    numbers : ndarray
        Parameters of `Schedule.signals`.
    kick : ndarray, shape (n,)
        Change of the modal velocities at its start by impulses.
    """

    start: float
    stop: float
    numbers: Array = field(repr=False)
    kick: Array = field(repr=False)


@dataclass(frozen=True)
class Schedule:
    """All loads over time.

    Attributes
    ----------
    spin : Spin
    angle : float
        Added to the angle that `spin` counts [rad].
    disturbances : tuple
    """

    spin: Spin
    angle: float
    disturbances: tuple[Disturbance, ...]

    @property
    def forces(self) -> tuple[Force, ...]:
        """The disturbing forces."""
        return tuple(d for d in self.disturbances if isinstance(d, Force))

    @property
    def shakings(self) -> tuple[Shaking, ...]:
        """Harmonic motions of the base."""
        return tuple(d for d in self.disturbances if isinstance(d, Shaking))

    def pieces(self, start: float, stop: float, plant: Plant) -> Iterator[Piece]:
        """From start to stop, each as long as possible."""
        tables = [d for d in self.disturbances if isinstance(d, BaseMotion)]
        blows = [d for d in self.disturbances if isinstance(d, Impulse)]
        forces = self.forces
        edges = {start, stop, *self.spin.times, *(t for d in tables for t in d.times), *(b.time for b in blows)}
        edges |= {f.start for f in forces} | {f.stop for f in forces if f.stop is not None}
        for a, b in pairwise(sorted(t for t in edges if start <= t <= stop)):
            angle, speed, rate = self.spin.at(a)
            base = np.sum([t.at(a, b) for t in tables], axis=0) if tables else np.zeros(4)
            on = [float(f.start <= a and (f.stop is None or b <= f.stop)) for f in forces]
            kick = sum((plant.load(i) for i in blows if i.time == a), np.zeros(plant.size))
            yield Piece(a, b, np.array([a, angle + self.angle, speed, rate, *base, *on]), kick)

    @cached_property
    def signals(self) -> ca.Function:
        """Time and the numbers of its piece to signals, speed and its derivative (see `equations`)."""
        t, p = ca.SX.sym("t"), ca.SX.sym("p", HEAD + len(self.forces))
        tau = t - p[0]
        rate = p[3]
        speed = p[2] + rate * tau
        angle = p[1] + (p[2] + 0.5 * rate * tau) * tau
        cos, sin = ca.cos(angle), ca.sin(angle)
        base: list[Any] = [p[4] + p[6] * tau, p[5] + p[7] * tau]
        for shaking in self.shakings:
            wave = ca.cos(shaking.frequency * t + shaking.phase)
            base = [base[0] + shaking.y * wave, base[1] + shaking.z * wave]
        waves = [p[HEAD + k] * ca.cos(f.frequency * (t - f.start) + f.phase) for k, f in enumerate(self.forces)]
        turning = [speed**2 * cos + rate * sin, speed**2 * sin - rate * cos]
        return ca.Function("signals", [t, p], [ca.vertcat(*turning, 1.0, *base, *waves), speed, rate])

    def generator(self, speed: float) -> tuple[Array, Array]:
        """At constant speed the signals obey a linear law: dw/dt = S w, s = L w, with S and L as returned.

        w holds the two of the unbalance, gravity, then base acceleration and slope in y and z, then a pair (cos, sin) for
        each shaking and each force.
        """
        waves: list[Shaking | Force] = [*self.shakings, *self.forces]
        size, count = 7 + 2 * len(waves), 5 + len(self.forces)
        law, out = np.zeros((size, size)), np.zeros((count, size))
        for at, w in [(0, speed), *((7 + 2 * k, float(d.frequency)) for k, d in enumerate(waves))]:
            law[at, at + 1], law[at + 1, at] = -w, w
        law[3, 4] = law[5, 6] = 1.0
        out[[0, 1, 2, 3, 4], [0, 1, 2, 3, 5]] = 1.0
        for k, d in enumerate(waves):
            if isinstance(d, Shaking):
                out[3:5, 7 + 2 * k] = d.y, d.z
            else:
                out[5 + k - len(self.shakings), 7 + 2 * k] = 1.0
        return law, out

    def state(self, piece: Piece, t: float) -> Array:
        """The w of `generator` at a time of a piece."""
        start, angle, speed, _, y0, z0, y1, z1, *on = piece.numbers
        tau = t - start
        turned = angle + speed * tau
        out = [speed**2 * math.cos(turned), speed**2 * math.sin(turned), 1.0, y0 + y1 * tau, y1, z0 + z1 * tau, z1]
        for s in self.shakings:
            out += [math.cos(s.frequency * t + s.phase), math.sin(s.frequency * t + s.phase)]
        for switch, f in zip(on, self.forces, strict=True):
            argument = f.frequency * (t - f.start) + f.phase
            out += [switch * math.cos(argument), switch * math.sin(argument)]
        return np.array(out)
