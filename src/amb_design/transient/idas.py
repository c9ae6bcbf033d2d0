"""Any motion by SUNDIALS' IDAS: slower than collocation, and independent of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from .equations import WORKS
from .scales import scales
from .schedule import Piece, Schedule
from .split import Split

RINGING = 4e4
"""Above this frequency [rad/s] modes only ring."""


@dataclass
class Idas:
    """Backward differences of variable order and step with exact Jacobians.

    Beyond order 2 they are unstable next to the imaginary axis: a single undamped mode far above all that matters would
    dictate the step. Where there are such modes the order stays at 2, which damps them out and is less precise.

    The time inside is counted in output steps, so that one integrator serves steps of any length.
    """

    split: Split
    schedule: Schedule
    tolerance: float
    _integrators: dict[int, Any] = field(default_factory=dict)
    _booked: list[Array] = field(default_factory=list)

    @cached_property
    def _dae(self) -> dict[str, Any]:
        e, size, split = self.split.equations, self.scale, self.split
        z, sigma = ca.MX.sym("z", e.size), ca.MX.sym("sigma")
        times = ca.MX.sym("times", 2)  # start and step
        numbers, held = ca.MX.sym("numbers", self.schedule.signals.size1_in(1)), ca.MX.sym("held", len(e.actuators))
        signals, speed, rate = self.schedule.signals(times[0] + times[1] * sigma, numbers)
        x = ca.DM(size) * z
        change, power = e.rhs(x, signals, speed, rate, held)
        flags = split.flags(ca.mtimes(ca.sparsify(ca.DM(split.C)), x), held, speed)
        return {
            "x": z,
            "t": sigma,
            "p": ca.vertcat(times, numbers, held),
            "ode": times[1] * change / ca.DM(size),
            "quad": ca.vertcat(times[1] * power, flags),
        }

    @cached_property
    def scale(self) -> Array:
        """Sizes of the states."""
        return scales(self.split.equations)

    def _integrator(self, count: int) -> Any:
        if count not in self._integrators:
            options = {
                "reltol": self.tolerance,
                "abstol": self.tolerance,
                "max_num_steps": 200_000,
                "linear_solver": "lapacklu" if ca.has_linsol("lapacklu") else "qr",
                "max_multistep_order": 5 if self.split.equations.plant.frequencies[-1] < RINGING else 2,
                "show_eval_warnings": False,
            }
            self._integrators[count] = ca.integrator("motion", "idas", self._dae, 0, list(range(1, count + 1)), options)
        return self._integrators[count]

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> Array:
        """See `Stepper`."""
        p = np.concatenate([[start, step], piece.numbers, held])
        found = self._integrator(count)(x0=x / self.scale, p=p)
        sums = np.array(found["qf"].full())
        self._booked.append(np.diff(sums, prepend=0.0).T)
        return np.array(found["xf"].full()).T * self.scale

    def drain(self) -> tuple[Array, Array]:
        """See `Stepper`."""
        booked, self._booked = np.vstack(self._booked), []
        return booked[:, : len(WORKS)], np.clip(booked[:, len(WORKS) :], 0.0, 1.0)
