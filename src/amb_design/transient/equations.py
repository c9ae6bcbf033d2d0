"""The equations of motion as CasADi functions of state and loads.

State x = (xi, xi', controllers); the controllers' states axis by axis, each with those before its amplifier first. A sampled
controller leaves only the amplifiers' states here, and its commands come in as numbers.

Loads of the signals s = (Omega^2 cos + Omega' sin, Omega^2 sin - Omega' cos, gravity, base y, base z, forces ...): the first two are
the unbalance, -(d/dt)^2 of exp(i angle), for any course of the speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..spec.machine import Machine
from .actuator import Actuator
from .loads import Contact, Force
from .plant import Plant

WORKS = ("unbalance", "gravity", "base motion", "forces", "magnets", "contact", "damping", "circulation")
"""Forces whose work is counted. Damping: with the gyroscopic moments, which work only while the spin accelerates. Circulation: the
skew part of the stiffness, from rotating damping and cross-coupled bearings."""

INLINE = {"always_inline": True}
"""Expressions that call a function without dissolving it get slow Jacobians."""

FLAGS = ("current", "voltage", "flux", "contact", "clearance")


@dataclass(frozen=True)
class Equations:
    """A machine in motion.

    Attributes
    ----------
    plant : Plant
    actuators : one for each axis
    forces : the disturbing forces, in the order of their signals
    contact : Contact or None
    sampled : bool
        True if the controllers' commands are inputs.
    gravity : float
        [m/s^2] along -y.
    """

    plant: Plant
    actuators: tuple[Actuator, ...]
    forces: tuple[Force, ...]
    contact: Contact | None
    sampled: bool
    gravity: float

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.plant.machine

    @cached_property
    def blocks(self) -> tuple[slice, ...]:
        """Where the states of each axis are among the controllers'."""
        sizes = [0 if c is None else c.back + (0 if self.sampled else c.front) for c in self._chains]
        edges = np.concatenate([[0], np.cumsum(sizes)])
        return tuple(slice(int(a), int(b)) for a, b in pairwise(edges))

    @property
    def _chains(self) -> list[Any]:
        return [a.chain for a in self.actuators]

    @property
    def controllers(self) -> int:
        """Number of controller states."""
        return self.blocks[-1].stop if self.blocks else 0

    @property
    def size(self) -> int:
        """Number of states."""
        return 2 * self.plant.size + self.controllers

    @cached_property
    def quantities(self) -> Array:
        """From the state to the first five inputs of `magnets`, one below the other."""
        p, n, axes = self.plant, self.plant.size, len(self.actuators)
        rows = np.zeros((4 * axes + self.controllers, self.size))
        rows[:axes, :n] = rows[axes : 2 * axes, n : 2 * n] = p.actuators
        rows[2 * axes : 3 * axes, :n] = rows[3 * axes : 4 * axes, n : 2 * n] = p.sensors
        rows[4 * axes :, 2 * n :] = np.eye(self.controllers)
        return rows

    @cached_property
    def load(self) -> Array:
        """Generalised forces of the signals, shape (n, signals)."""
        p = self.plant
        columns = [
            p.unbalance,
            -self.gravity * p.inertia[:, :1],
            -p.inertia,
            *[p.load(f)[:, None] for f in self.forces],
        ]
        return np.hstack(columns)

    @cached_property
    def magnets(self) -> ca.Function:
        """All axes at once: displacements, velocities at magnets and sensors, controller states, commands, speed.

        Returns axis forces, contact forces (y, z of each magnet), controllers' rates, currents, known current rates, flags.
        """
        count, places = len(self.actuators), len(self.machine.magnets)
        y, v, s, r = (ca.SX.sym(name, count) for name in ("y", "v", "s", "r"))
        state, held, speed = ca.SX.sym("c", self.controllers), ca.SX.sym("held", count), ca.SX.sym("speed")
        answers, rates = [], [ca.SX(0, 1)]
        for k, (actuator, block) in enumerate(zip(self.actuators, self.blocks, strict=True)):
            chain, own = actuator.chain, state[block]
            command: Any = held[k]
            front = 0
            if chain is not None and not self.sampled:
                front, seen = chain.front, ca.vertcat(s[k], r[k])
                command = ca.mtimes(_dm(chain.c), own[:front]) + ca.mtimes(_dm(chain.d), seen)
                rates.append(ca.mtimes(_dm(chain.a), own[:front]) + ca.mtimes(_dm(chain.b), seen))
            answer = actuator.respond(ca.SX(0) if chain is None else command, own[front:], y[k], v[k])
            rates.append(answer.rates)
            answers.append(answer)
        touch = [self._touch(i, y, v, speed) for i in range(places)]
        flags = [ca.vertcat(*[ca.SX(a.saturated.get(f, 0)) for f in FLAGS[:3]]) for a in answers]
        by_magnet = [
            ca.vertcat(ca.fmax(flags[2 * i], flags[2 * i + 1]), ca.SX(touch[i][1]), ca.SX(touch[i][2]))
            for i in range(places)
        ]
        column: Callable[[list[Any]], Any] = lambda parts: ca.densify(ca.vertcat(ca.SX(0, 1), *parts))  # noqa: E731
        return ca.Function(
            "magnets",
            [y, v, s, r, state, held, speed],
            [
                column([a.force for a in answers]),
                column([t[0] for t in touch]),
                column(rates),
                column([a.current for a in answers]),
                column([ca.SX(0) if a.current_rate is None else a.current_rate for a in answers]),
                column(by_magnet),
            ],
        )

    def _touch(self, index: int, y: Any, v: Any, speed: Any) -> tuple[Any, Any, Any]:
        """Force of a backup bearing in y and z, whether it touches, and whether the clearance is used up."""
        magnet = self.machine.magnets[index]
        if magnet.clearance is None:
            return ca.SX(2, 1), 0, 0
        c, s = math.cos(magnet.axes_angle), math.sin(magnet.axes_angle)
        turn = ca.DM([[c, -s], [s, c]])
        place, moving = ca.mtimes(turn, y[2 * index : 2 * index + 2]), ca.mtimes(turn, v[2 * index : 2 * index + 2])
        radius = ca.sqrt(ca.sumsqr(place) + 1e-24)
        depth = radius - magnet.clearance
        if self.contact is None:
            return ca.SX(2, 1), 0, depth > 0
        outward = place / radius
        along = ca.vertcat(-outward[1], outward[0])
        ramp = clip01(depth / (0.01 * magnet.clearance))
        smooth = ramp**2 * (3.0 - 2.0 * ramp)
        k, d = self.contact.stiffness, self.contact.damping
        normal = ca.fmax(0.0, k * ca.fmax(depth, 0.0) + d * smooth * ca.dot(outward, moving))
        slip = ca.dot(along, moving) + speed * self._shaft_radius(magnet.position)
        drag = self.contact.friction * normal * ca.tanh(slip / self.contact.slip_speed)
        return -normal * outward - drag * along, normal > 0, depth > 0

    def _shaft_radius(self, position: float) -> float:
        x = 0.0
        for segment in self.machine.rotor.shaft.segments:
            x += float(segment.length)
            if position <= x * (1.0 + 1e-9):
                break
        return float(segment.outer) / 2.0

    def _parts(self, x: Any, held: Any, speed: Any) -> tuple[Any, ...]:
        """Coordinates, their rates, and all answers of the magnets, as MX."""
        p, n = self.plant, self.plant.size
        xi, rate, state = x[:n], x[n : 2 * n], x[2 * n :]
        act, see = _dm(p.actuators), _dm(p.sensors)
        motion = [ca.mtimes(matrix, part) for matrix in (act, see) for part in (xi, rate)]
        return xi, rate, *self.magnets(*motion, state, held, speed)

    def symbols(self) -> tuple[Any, ...]:
        """State, signals, speed, its derivative, commands of sampled controllers."""
        sizes = (self.size, self.load.shape[1], 1, 1, len(self.actuators))
        names = ("x", "s", "speed", "acceleration", "held")
        return tuple(ca.MX.sym(n, k) for n, k in zip(names, sizes, strict=True))

    @cached_property
    def rhs(self) -> ca.Function:
        """dx/dt and the powers of the forces in `WORKS`, of the `symbols`."""
        x, *_ = symbols = self.symbols()
        forces, controllers = self.forces_on(*symbols)
        n, p = self.plant.size, self.plant
        rate = x[n : 2 * n]
        total = ca.sum2(forces) - ca.mtimes(_dm((p.K0 + p.K0.T) / 2.0), x[:n])
        return ca.Function(
            "rhs", list(symbols), [ca.vertcat(rate, total, controllers), ca.mtimes(forces.T, rate)], INLINE
        )

    @cached_property
    def forces_on(self) -> ca.Function:
        """Generalised forces in `WORKS`, one a column, and the controllers' rates, of the `symbols`."""
        p = self.plant
        x, s, speed, acceleration, held = symbols = self.symbols()
        xi, rate, pull, touch, controllers, *_ = self._parts(x, held, speed)
        times: Callable[[Array, Any], Any] = lambda matrix, column: ca.mtimes(_dm(matrix), column)  # noqa: E731
        damping = times(p.C0, rate) + times(p.C1, speed * rate + acceleration * xi)
        circulation = times((p.K0 - p.K0.T) / 2.0, xi) + speed * times(p.K1, xi)
        loads = [times(self.load[:, part], s[part]) for part in self._groups]
        magnetic, contact = times(p.actuators.T, pull), times(self.contact_places.T, touch)
        forces = ca.horzcat(*loads, magnetic, contact, -damping, -circulation)
        return ca.Function("forces", list(symbols), [forces, controllers], INLINE)

    @property
    def _groups(self) -> list[slice]:
        """Signals of unbalance, gravity, base motion and forces."""
        return [slice(0, 2), slice(2, 3), slice(3, 5), slice(5, self.load.shape[1])]

    @cached_property
    def contact_places(self) -> Array:
        """Displacements in y and z at the magnets for unit coordinates, shape (2 magnets, n)."""
        rows = [self.plant.row(float(m.position)) for m in self.machine.magnets]
        return np.vstack([np.zeros((0, self.plant.size)), *rows])


def clip01(value: Any) -> Any:
    """Value between 0 and 1."""
    return ca.fmin(ca.fmax(value, 0.0), 1.0)


def _dm(matrix: Array) -> ca.DM:
    return ca.sparsify(ca.DM(matrix))
