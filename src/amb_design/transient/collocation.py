"""Any motion, step by step: the linear part exactly, the rest by collocation.

Over a step h every input of the linear part (see `split`) is a parabola through its values at 0, h/2 and h. With such inputs the motion
is known exactly (see `ladder`), and Newton's method makes the parabolas agree with the equations at their nodes. At h/4 they may
differ: that difference, as it would move the state, is the error estimate. Steps are output steps, halved where it is too large. For
smooth motion the method is of fourth order; linear motion at constant speed has no error but that of the loads, and stiffness costs nothing.

M. Hochbruck, A. Ostermann: Exponential integrators. Acta Numerica 19 (2010) 209-286.
"""

from __future__ import annotations

import math

import casadi as ca
import numpy as np

from ..analysis.system import Array
from .compiled import Compiled
from .ladder import LARGE, Ladder
from .ledger import Entry, Ledger
from .scales import scales
from .schedule import Piece, Schedule
from .split import Split
from .step import Step

DEEPEST = 20
"""Halvings of an output step before the integrator gives up."""

PATIENCE = 12
"""Iterations of Newton's method; the Jacobian is renewed after each four."""

CLOSE = 0.01
"""Fraction of the tolerance at which Newton's method stops."""

EASY = 1.0 / 40.0
"""Fraction of the tolerance below which steps grow again: less than that of two halvings."""

WINDOWS = 4
"""Linear parts that cover a varying speed."""

QUARTER = np.array([0.375, 0.75, -0.125])
"""From the same values to that at h/4."""

NEXT = np.array([[1.0, -3.0, 3.0], [3.0, -8.0, 6.0]])
"""From the same values to those at 3/2 h and 2 h."""


class Collocation:
    """See the module.

    Parameters
    ----------
    split : Split
    schedule : Schedule
    tolerance : float
        For each step, of displacements of 10 um and relative.
    """

    def __init__(self, split: Split, schedule: Schedule, tolerance: float):
        equations = split.equations
        self.schedule, self.tolerance, self.split = schedule, tolerance, split
        self.size, self.ledger, self._row = scales(equations), Ledger(self.split), 0
        n = equations.plant.size
        self._varying = 0 if schedule.spin.constant else n
        free = np.eye(equations.size)[:, n : n + self._varying]  # any change of the rates
        self.B = np.hstack([split.B, free])
        self._reach = np.abs(self.B) / self.size[:, None]
        leaning = [split.turning, split.A2[n : 2 * n]] if self._varying else []
        self._rows = np.vstack([split.C, *leaning]) * self.size
        self._window, self._anchor = max(schedule.spin.fastest / WINDOWS, 1.0), math.nan
        self._ladders: dict[float, tuple[Ladder, list[int]]] = {}
        self._steps: dict[float, dict[float, Step]] = {}
        self._levels: dict[float, int] = {}
        self._now: Array | None = None
        self._past: Array | None = None
        self._compile()

    def _compile(self) -> None:
        remainder, signals = self.split.remainder, self.schedule.signals
        given = [ca.SX.sym(name, remainder.size1_in(i)) for i, name in enumerate(("q", "held", "speed", "anchor"))]
        u = remainder(*given)
        bent = ca.Function("bent", given, [u, ca.densify(ca.jacobian(u, given[0]))])
        self._one, self._two, self._bent = (Compiled(f) for f in (remainder, remainder.map(2), bent.map(2)))
        start, h, numbers = (ca.SX.sym(name, k) for name, k in (("t", 1), ("h", 1), ("p", signals.size1_in(1))))
        at = [signals(start + c * h, numbers) for c in (0.0, 0.25, 0.5, 1.0)]
        found = [ca.horzcat(*[a[0] for a in at]), ca.vertcat(*[a[1] for a in at]), at[0][2]]
        self._signals = Compiled(ca.Function("loads", [start, h, numbers], [ca.densify(f) for f in found]))

    def run(self, x: Array, held: Array, piece: Piece, start: float, step: float, count: int) -> Array:
        """See `Stepper`."""
        self._one.inputs[1][:] = held
        self._two.inputs[1][:] = self._bent.inputs[1][:] = held[:, None]
        self._signals.inputs[2][:] = piece.numbers
        self._now, self._past = None, None
        step = float(f"{step:.12e}")  # steps that differ by rounding share their matrices
        states, z = np.empty((count, len(x))), x / self.size
        for k in range(count):
            z = self._output_step(z, start + k * step, step)
            states[k] = z * self.size
        return states

    def drain(self) -> tuple[Array, Array]:
        """See `Stepper`."""
        self._row = 0
        return self.ledger.drain()

    def _output_step(self, z: Array, start: float, whole: float) -> Array:
        """Go through an output step, in as many steps as it needs."""
        level, done = self._levels.get(whole, 0), 0
        begin, _, speed, rate = self._signals.inputs[2][:4]
        self._near(float(speed + rate * (start + whole / 2.0 - begin)))
        while done < 2**level:
            h = whole / 2**level
            step = self._step(h)
            entry, error = self._attempt(step, z, start + done * h)
            if entry is None or not error <= self.tolerance:
                level, done, self._past = level + 1, 2 * done, None
                if level > DEEPEST:
                    raise RuntimeError("steps became too short")
                continue
            self.ledger.add(self._row, h / whole, entry)
            z = step.move @ z + step.push @ entry.inputs
            self._past, self._now = entry.inputs, entry.inputs[-self.B.shape[1] :]
            done += 1
            if level and done % 2 == 0 and error < EASY * self.tolerance:
                level, done, self._past = level - 1, done // 2, None
        self._levels[whole] = level
        self._row += 1
        return z

    def _attempt(self, step: Step, z: Array, start: float) -> tuple[Entry | None, float]:
        """A step with inputs that agree with the equations at its nodes, and its error; None if Newton's method fails."""
        self._signals.inputs[0][0], self._signals.inputs[1][0] = start, step.h
        self._signals()
        signals, speeds, (rate,) = self._signals.outputs
        ends, weight = speeds[2:].copy(), step.h / (1.0 + np.abs(z))
        if self._now is None:
            self._now = self._inputs(self._rows @ z, signals[:, 0], speeds[0], rate)
        b, m, q, n = len(self._now), self.split.count, len(self.split.C), self._varying
        guess = np.array([self._now, self._now]) if self._past is None else NEXT @ self._past.reshape(3, b)
        guess[:, m : m + len(signals)] = signals[:, 2:].T
        change, base = np.zeros((2, b)), step.place @ z + step.known @ self._now
        for trial in range(PATIENCE):
            rows = (base + step.unknown @ guess.ravel()).reshape(2, -1)
            change[:, :m] = self._remainders(step, rows[:, :q], ends, trial) - guess[:, :m]
            if n:
                change[:, -n:] = self._turning(rows[:, q:], ends, rate) - guess[:, -n:]
            if self._size(np.abs(change[0]) + np.abs(change[1]), weight) <= CLOSE * self.tolerance:
                break
            change[:, :m] = (step.inverse @ change[:, :m].ravel()).reshape(2, m)
            guess += change
        else:
            step.inverse = np.zeros((0, 0))
            return None, np.inf
        inputs = np.concatenate([self._now, (guess + change).ravel()])
        quarter = self._inputs(step.quarter @ np.concatenate([z, inputs]), signals[:, 1], speeds[1], rate)
        defect = quarter - QUARTER @ inputs.reshape(3, b)
        leaning = np.zeros((3, n))
        if n:
            leaning[0], leaning[1:] = -rate * (self._rows[q + n :] @ z), -rate * rows[:, q + n :]
        entry = Entry(step, z, inputs, defect, leaning, rows[:, :q], ends, self._one.inputs[1].copy())
        return entry, self._size(np.abs(defect), weight)

    def _inputs(self, rows: Array, signals: Array, speed: float, rate: float) -> Array:
        """All inputs at an instant."""
        q = len(self.split.C)
        self._one.inputs[0][:], self._one.inputs[2][0] = rows[:q], speed
        self._one()
        parts = [self._one.outputs[0], signals]
        if self._varying:
            parts.append(self._turning(rows[None, q:], np.array([speed]), rate)[0])
        return np.concatenate(parts)

    def _remainders(self, step: Step, quantities: Array, speeds: Array, trial: int) -> Array:
        """Remainders at h/2 and h, and sometimes a new Jacobian."""
        m, q = self.split.count, quantities.shape[1]
        renew = m > 0 and (not len(step.inverse) or trial % 4 == 3)
        function = self._bent if renew else self._two
        function.inputs[0][:], function.inputs[2][:] = quantities.T, speeds
        function()
        if renew:
            b, each = self.B.shape[1], len(step.unknown) // 2
            inner = step.unknown[:, np.r_[:m, b : b + m]]
            slopes = function.outputs[1]
            product = np.vstack([slopes[:, :q] @ inner[:q], slopes[:, q:] @ inner[each : each + q]])
            step.inverse = np.linalg.inv(np.eye(2 * m) - product)
        return function.outputs[0].T

    def _turning(self, rows: Array, speeds: Array, rate: float) -> Array:
        """What the linear part lacks because speed and its rate are not those that it was made for, at some instants."""
        n = self._varying
        return (speeds - self._anchor)[:, None] * rows[:, :n] - rate * rows[:, n:]

    def _size(self, change: Array, weight: Array) -> float:
        """Of a change of inputs: what it would do to the state in a step, root mean square."""
        moved = weight * (self._reach @ change)
        return math.sqrt(moved @ moved / len(moved))

    def _near(self, speed: float) -> None:
        """Take a linear part that is good near a speed."""
        anchor = speed if not self._varying else self._window * round(speed / self._window)
        if anchor == self._anchor:
            return
        self._anchor, self._now, self._past = anchor, None, None
        for function in (self._one, self._two, self._bent):
            function.inputs[3][:] = anchor
        if anchor not in self._ladders:
            if any(ladder.size > LARGE for ladder, _ in self._ladders.values()):
                self._ladders.clear()
                self._steps.clear()
            self._ladders[anchor] = self._ladder(anchor)
            self._steps[anchor] = {}

    def _ladder(self, speed: float) -> tuple[Ladder, list[int]]:
        """Of the linear part at a speed, and which works its forms are."""
        split, n, size = self.split, self.split.equations.plant.size, self.size
        forms = split.forms(speed)
        velocities = np.zeros((self.B.shape[1], len(size)))
        velocities[:, n : 2 * n] = self.B[n : 2 * n].T
        ladder = Ladder(
            (split.A0 + speed * split.A1) * size / size[:, None],
            self.B / size[:, None],
            np.array([size[:, None] * form * size for form in forms.values()]).reshape(-1, len(size), len(size)),
            velocities * size,
        )
        return ladder, list(forms)

    def _step(self, h: float) -> Step:
        steps = self._steps[self._anchor]
        if h not in steps:
            steps[h] = Step(*self._ladders[self._anchor], self._rows, h)
        return steps[h]
