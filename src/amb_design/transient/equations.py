"""The equations of motion as CasADi functions of state and loads.

State x = (xi, xi', law, amplifiers), the last axis by axis. Of sampled controllers only the amplifiers' states are here, and their
commands come in as numbers.

Loads of the signals s = (Omega^2 cos + Omega' sin, Omega^2 sin - Omega' cos, gravity, base y, base z, forces ...): the first two are
the unbalance, -(d/dt)^2 of exp(i angle), for any course of the speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
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

    @property
    def law(self) -> int:
        """Number of the controllers' states that are here."""
        return 0 if self.sampled else self.plant.law.states

    @property
    def amplifiers(self) -> int:
        """Number of the amplifiers' states."""
        return sum(a.states for a in self.actuators)

    @property
    def size(self) -> int:
        """Number of states."""
        return 2 * self.plant.size + self.law + self.amplifiers

    @cached_property
    def quantities(self) -> Array:
        """From the state to the first five inputs of `magnets`, one below the other."""
        p, n, axes = self.plant, self.plant.size, len(self.actuators)
        rows = np.zeros((4 * axes + self.amplifiers, self.size))
        rows[:axes, :n] = rows[axes : 2 * axes, n : 2 * n] = p.actuators
        if not self.sampled:
            rows[2 * axes : 4 * axes, : 2 * n + self.law] = np.vstack(list(p.law.commands))
        rows[4 * axes :, 2 * n + self.law :] = np.eye(self.amplifiers)
        return rows

    @cached_property
    def law_rates(self) -> Array:
        """From the state to the derivatives of the controllers' states: at rest and what a rad/s adds, shape (2, law, size)."""
        rows = np.zeros((2, self.law, self.size))
        if not self.sampled:
            rows[:, :, : 2 * self.plant.size + self.law] = self.plant.law.rates
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
        """All axes at once: displacements and velocities, the law's commands at rest and what a rad/s adds to them, amplifiers,
        commands of sampled controllers, speed.

        Returns axis forces, contact forces (y, z of each magnet), amplifiers' rates, currents, known current rates, flags.
        """
        count, places = len(self.actuators), len(self.machine.magnets)
        y, v, base, turning, held = (ca.SX.sym(name, count) for name in ("y", "v", "base", "turning", "held"))
        state, speed = ca.SX.sym("amplifiers", self.amplifiers), ca.SX.sym("speed")
        commands, answers, at = base + speed * turning + held, [], 0
        for k, actuator in enumerate(self.actuators):
            answers.append(actuator.respond(commands[k], state[at : at + actuator.states], y[k], v[k]))
            at += actuator.states
        touch = [self._touch(i, y, v, speed) for i in range(places)]
        flags = [ca.vertcat(*[ca.SX(a.saturated.get(f, 0)) for f in FLAGS[:3]]) for a in answers]
        by_magnet = [
            ca.vertcat(ca.fmax(flags[2 * i], flags[2 * i + 1]), ca.SX(touch[i][1]), ca.SX(touch[i][2]))
            for i in range(places)
        ]
        column: Callable[[list[Any]], Any] = lambda parts: ca.densify(ca.vertcat(ca.SX(0, 1), *parts))  # noqa: E731
        return ca.Function(
            "magnets",
            [y, v, base, turning, state, held, speed],
            [
                column([a.force for a in answers]),
                column([t[0] for t in touch]),
                column([a.rates for a in answers]),
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
        n = self.plant.size
        edges = np.cumsum([0, *(self.magnets.size1_in(k) for k in range(5))]).tolist()
        inputs = ca.vertsplit(ca.mtimes(_dm(self.quantities), x), edges)
        return x[:n], x[n : 2 * n], *self.magnets(*inputs, held, speed)

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
        """Generalised forces in `WORKS`, one a column, and the rates of law and amplifiers, of the `symbols`."""
        p = self.plant
        x, s, speed, acceleration, held = symbols = self.symbols()
        xi, rate, pull, touch, amplifiers, *_ = self._parts(x, held, speed)
        times: Callable[[Array, Any], Any] = lambda matrix, column: ca.mtimes(_dm(matrix), column)  # noqa: E731
        damping = times(p.C0, rate) + times(p.C1, speed * rate + acceleration * xi)
        circulation = times((p.K0 - p.K0.T) / 2.0, xi) + speed * times(p.K1, xi)
        loads = [times(self.load[:, part], s[part]) for part in self._groups]
        magnetic, contact = times(p.actuators.T, pull), times(self.contact_places.T, touch)
        forces = ca.horzcat(*loads, magnetic, contact, -damping, -circulation)
        law = times(self.law_rates[0], x) + speed * times(self.law_rates[1], x)
        return ca.Function("forces", list(symbols), [forces, ca.vertcat(law, amplifiers)], INLINE)

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
