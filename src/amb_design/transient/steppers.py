"""Two ways through a piece of the run: CVODES for any motion, the matrix exponential for linear motion at constant speed."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ..analysis.system import Array
from .equations import WORKS, Equations
from .schedule import Piece, Schedule

SMALL = 1e-5
"""Displacement [m] to which tolerances refer: a tolerance of 1e-6 also means 10 pm."""

TYPICAL = 300.0
"""Frequency [rad/s] that turns displacements into velocities there; faster modes are as precise in energy."""

FAST = 1e4
"""Modes above this frequency [rad/s] are granted the same displacements as one of it; most of them only ring."""


class Stepper(Protocol):
    """Moves the state through a piece."""

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> tuple[Array, Array]:
        """States and works done after 1 ... count equal steps from a time inside the piece, one a row."""
        ...


def scales(e: Equations) -> Array:
    """Sizes of all states when the shaft moves by SMALL; modes with equal sizes have equal energies."""
    p = e.plant
    place = SMALL * np.sqrt(np.sum(p.inertia**2) / 2.0)
    quick = np.maximum(p.frequencies, TYPICAL)
    speed = place * TYPICAL * np.maximum(1.0, quick / FAST)
    sizes = [speed / quick, speed, np.ones(e.controllers)]
    w = 1j * np.logspace(1.0, 4.0, 31)[:, None]
    for actuator, block in zip(e.actuators, e.blocks, strict=True):
        chain = actuator.chain
        if chain is None:
            continue
        front = 0 if e.sampled else chain.front
        identity = np.eye(chain.front)
        answer = [np.abs(np.linalg.solve(s * identity - chain.a, chain.b @ [1.0, s[0]])) for s in w]
        command = max(
            float(np.abs(chain.c @ a + chain.d @ [1.0, s[0]]).max()) for a, s in zip(answer, np.abs(w), strict=True)
        )
        own = np.full(front + chain.back, SMALL * command)
        own[:front] = SMALL * np.max(answer, axis=0)[:front]
        sizes[2][block] = np.where(own > 0.0, own, 1.0)
    return np.concatenate(sizes)


@dataclass
class Cvodes:
    """Variable-order BDF with exact Jacobians, of SUNDIALS.

    The time inside is counted in output steps, so that one integrator serves steps of any length.
    """

    equations: Equations
    schedule: Schedule
    tolerance: float
    _integrators: dict[int, Any] = field(default_factory=dict)

    @cached_property
    def _dae(self) -> dict[str, Any]:
        e, size = self.equations, self.scale
        z, sigma = ca.MX.sym("z", e.size), ca.MX.sym("sigma")
        times = ca.MX.sym("times", 2)  # start and step
        numbers, held = ca.MX.sym("numbers", self.schedule.signals.size1_in(1)), ca.MX.sym("held", len(e.actuators))
        signals, speed, rate = self.schedule.signals(times[0] + times[1] * sigma, numbers)
        change, power = e.rhs(ca.DM(size) * z, signals, speed, rate, held)
        return {
            "x": z,
            "t": sigma,
            "p": ca.vertcat(times, numbers, held),
            "ode": times[1] * change / ca.DM(size),
            "quad": times[1] * power,
        }

    @cached_property
    def scale(self) -> Array:
        """Sizes of the states."""
        return scales(self.equations)

    def _integrator(self, count: int) -> Any:
        if count not in self._integrators:
            options = {
                "reltol": self.tolerance,
                "abstol": self.tolerance,
                "max_num_steps": 200_000,
                "linear_solver": "lapacklu" if ca.has_linsol("lapacklu") else "qr",
                "show_eval_warnings": False,
            }
            self._integrators[count] = ca.integrator(
                "motion", "cvodes", self._dae, 0, list(range(1, count + 1)), options
            )
        return self._integrators[count]

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> tuple[Array, Array]:
        """See `Stepper`. Raises RuntimeError if the integrator gives up."""
        p = np.concatenate([[start, step], piece.numbers, held])
        found = self._integrator(count)(x0=x / self.scale, p=p)
        return np.array(found["xf"].full()).T * self.scale, np.array(found["qf"].full()).T


@dataclass
class ClosedForm:
    """x' = A x + E s + H held with signals that obey a linear law themselves: one matrix exponential for each length of step.

    Works are the integrals of powers sampled at the output times, by the trapezoidal rule corrected with their derivatives: of
    fourth order in the output step.
    """

    equations: Equations
    schedule: Schedule
    speed: float
    _steps: dict[float, Array] = field(default_factory=dict)

    @cached_property
    def _linear(self) -> tuple[Array, Array]:
        """dx/dt and the forces of `WORKS`, one below the other, as matrices on state, w and held commands together."""
        e = self.equations
        x, s, _, _, held = symbols = e.symbols()
        values = [e.rhs(*symbols)[0], ca.vec(e.forces_on(*symbols)[0])]
        slopes = ca.Function("slopes", list(symbols), [ca.jacobian(v, to) for v in values for to in (x, s, held)])
        found = slopes(np.zeros(e.size), np.zeros(s.shape[0]), self.speed, 0.0, np.zeros(len(e.actuators)))
        _, out = self.schedule.generator(self.speed)
        matrices = [np.array(m.full()) for m in found]
        change, forces = (np.hstack([a, b @ out, c]) for a, b, c in (matrices[:3], matrices[3:]))
        return change, forces

    @cached_property
    def matrix(self) -> Array:
        """Of state, w and held commands together."""
        change, _ = self._linear
        law, _ = self.schedule.generator(self.speed)
        n, m = len(change), len(law)
        whole = np.zeros((change.shape[1], change.shape[1]))
        whole[:n], whole[n : n + m, n : n + m] = change, law
        return whole

    def _exponential(self, step: float) -> Array:
        key = float(f"{step:.12e}")  # steps that differ by rounding share one
        if key not in self._steps:
            size = np.concatenate([scales(self.equations), np.ones(len(self.matrix) - self.equations.size)])
            self._steps[key] = sla.expm(step * self.matrix * size / size[:, None]) * size[:, None] / size
        return self._steps[key]

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> tuple[Array, Array]:
        """See `Stepper`."""
        matrix, e = self._exponential(step), self.equations
        z = np.empty((count + 1, len(matrix)))
        z[0] = np.concatenate([x, self.schedule.state(piece, start), held])
        for k in range(count):
            z[k + 1] = matrix @ z[k]
        dz, forces = z @ self.matrix.T, self._linear[1]
        pull, change = ((part @ forces.T).reshape(count + 1, len(WORKS), e.plant.size) for part in (z, dz))
        rate, faster = (part[:, e.plant.size : 2 * e.plant.size, None] for part in (z, dz))
        power, slope = (pull @ rate)[..., 0], (change @ rate + pull @ faster)[..., 0]
        work = step / 2.0 * (power[1:] + power[:-1]) - step**2 / 12.0 * np.diff(slope, axis=0)
        return z[1:, : e.size], np.cumsum(work, axis=0)
