"""Linear motion at constant speed: one matrix exponential."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.linalg as sla

from ..analysis.system import Array
from .equations import FLAGS, WORKS
from .scales import scales
from .schedule import Piece, Schedule
from .split import Split


class ClosedForm:
    """x' = A x + E s with signals that obey a linear law themselves: exact for steps of any length.

    Works are integrals of powers sampled at the output times, by the trapezoidal rule corrected with their derivatives: of
    fourth order in the output step.

    Parameters
    ----------
    split : Split
        Of linear magnets with continuous controllers.
    schedule : Schedule
    speed : float
        [rad/s]
    """

    def __init__(self, split: Split, schedule: Schedule, speed: float):
        self.equations, self.speed, self.split = split.equations, speed, split
        self.schedule, (law, self._out) = schedule, schedule.generator(speed)
        n = self.equations.size
        self.matrix = np.zeros((n + len(law), n + len(law)))
        """Of state and w together (see `Schedule.generator`)."""
        self.matrix[:n, :n] = self.split.A0 + speed * self.split.A1
        self.matrix[:n, n:] = self.split.B @ self._out
        self.matrix[n:, n:] = law
        self._pull = split.pull[0] + speed * split.pull[1]
        self._moves: dict[float, list[Array]] = {}
        self._booked: list[tuple[Array, Array]] = []

    @cached_property
    def _size(self) -> Array:
        return np.concatenate([scales(self.equations), np.ones(len(self.matrix) - self.equations.size)])

    def _doubled(self, step: float, times: int) -> Array:
        """Transposed matrix of 2**times steps."""
        known = self._moves.setdefault(float(f"{step:.12e}"), [])  # steps that differ by rounding share one
        size = self._size
        if not known:
            scaled = sla.expm(step * self.matrix * size / size[:, None])
            known.append(np.ascontiguousarray((scaled * size[:, None] / size).T))
        while len(known) <= times:
            known.append(known[-1] @ known[-1])
        return known[times]

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> Array:
        """See `Stepper`."""
        z = np.empty((count + 1, len(self.matrix)))
        z[0] = np.concatenate([x, self.schedule.state(piece, start)])
        done = 1
        while done <= count:  # what is known, moved on by as many steps, is as much again
            k = min(done, count + 1 - done)
            z[done : done + k] = z[:k] @ self._doubled(step, (done - 1).bit_length())
            done += k
        power, slope = self._powers(z)
        work = step / 2.0 * (power[1:] + power[:-1]) - step**2 / 12.0 * np.diff(slope, axis=0)
        states = z[1:, : self.equations.size]
        self._booked.append((work, self._beyond(states)))
        return states

    def _beyond(self, states: Array) -> Array:
        """Flags: of linear magnets only the clearance may be used up."""
        e, flags = self.equations, np.zeros((len(states), len(self.equations.machine.magnets), len(FLAGS)))
        places = (states[:, : e.plant.size] @ e.contact_places.T).reshape(len(states), -1, 2)
        for i, magnet in enumerate(e.machine.magnets):
            if magnet.clearance is not None:
                flags[:, i, FLAGS.index("clearance")] = np.hypot(*places[:, i].T) > magnet.clearance
        return flags.reshape(len(states), -1)

    def drain(self) -> tuple[Array, Array]:
        """See `Stepper`."""
        works, flags = (np.vstack(part) for part in zip(*self._booked, strict=True))
        self._booked = []
        return works, flags

    def _powers(self, z: Array) -> tuple[Array, Array]:
        """Powers of the forces in `WORKS` and their derivatives, one row for each state."""
        e, p, n = self.equations, self.equations.plant, self.equations.plant.size
        xi, rate, change, w = z[:, :n], z[:, n : 2 * n], z @ self.matrix[n : 2 * n].T, z[:, e.size :]
        law, pull = self.matrix[e.size :, e.size :], self._pull
        power, slope = np.zeros((len(z), len(WORKS))), np.zeros((len(z), len(WORKS)))

        def add(owners: list[int], velocity: Array, force: Array, faster: Array, stronger: Array) -> None:
            for k, owner in enumerate(owners):
                power[:, owner] += velocity[:, k] * force[:, k]
                slope[:, owner] += faster[:, k] * force[:, k] + velocity[:, k] * stronger[:, k]

        loads = list(self.split.owners[self.split.count :])
        add(loads, rate @ e.load, w @ self._out.T, change @ e.load, w @ (self._out @ law).T)
        moving = self.matrix[: e.size]
        axes, magnets = p.actuators.T, [WORKS.index("magnets")] * len(p.actuators)
        add(magnets, rate @ axes, z[:, : e.size] @ pull.T, change @ axes, z @ (pull @ moving).T)
        damped = rate @ (p.C0 + p.C0.T)
        power[:, WORKS.index("damping")] -= 0.5 * np.einsum("ki,ki->k", rate, damped)
        slope[:, WORKS.index("damping")] -= np.einsum("ki,ki->k", change, damped)
        circulation = ((p.K0 - p.K0.T) / 2.0 + self.speed * p.K1).T
        if circulation.any():
            force = xi @ circulation
            power[:, WORKS.index("circulation")] -= np.einsum("ki,ki->k", rate, force)
            slope[:, WORKS.index("circulation")] -= np.einsum("ki,ki->k", change, force)
            slope[:, WORKS.index("circulation")] -= np.einsum("ki,ki->k", rate, rate @ circulation)
        return power, slope
