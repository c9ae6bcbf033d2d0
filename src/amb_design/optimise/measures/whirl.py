"""What the residual unbalance asks of magnets and amplifiers, over the range of speeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import casadi as ca
import numpy as np

from ...analysis.system import Array
from ...model import magnet as magnetics
from ...model.loop import Structure
from ...spec.machine import Machine
from ...spec.magnet import Magnet
from ..state import State
from .samples import Samples, joined, peaks, rpm_text, zoomed

POINTS = 72
ZOOMS = 5
PEAKS = 3

QUANTITIES = (
    "control_current",
    "control_current_ratio",
    "total_current",
    "flux_density",
    "voltage",
    "displacement_ratio",
)


class Driven(Protocol):
    """What the measures need to know of a machine in terms of parameters; a `LoopFamily` is one."""

    @property
    def p(self) -> ca.SX: ...
    @property
    def machine(self) -> Machine: ...
    @property
    def plant(self) -> Structure: ...
    @property
    def axes(self) -> tuple[int, ...]: ...
    @property
    def pushed(self) -> tuple[int, ...]: ...
    @property
    def unbalance(self) -> Array: ...
    @property
    def patterns(self) -> tuple[str, ...]: ...


class Magnets:
    """Quantities of each magnet as functions of its amplitudes of current and displacement.

    Parameters
    ----------
    loops : Driven
    quantities : sequence of str
    """

    def __init__(self, loops: Driven, quantities: Sequence[str]):
        self.quantities = tuple(quantities)
        current, motion, speed = (ca.SX.sym(name) for name in ("current", "motion", "speed"))
        self._functions: list[ca.Function] = []
        self._maps: dict[tuple[int, int], ca.Function] = {}
        for magnet in loops.machine.magnets:
            out = ca.vertcat(*[_formula(q, magnet, current, motion, speed) for q in self.quantities])
            inputs = ca.vertcat(current, motion, speed)
            args = [loops.p, current, motion, speed]
            self._functions.append(
                ca.Function("magnet", args, [out, ca.jacobian(out, inputs), ca.jacobian(out, loops.p)])
            )

    def at(self, magnet: int, p: Array, current: Array, motion: Array, speed: Array) -> tuple[Array, Array, Array]:
        """Values (q, k), their derivatives to current, motion and speed (q, k, 3), and to the variables (q, k, n)."""
        k, q = len(current), len(self.quantities)
        if (magnet, k) not in self._maps:
            self._maps[magnet, k] = self._functions[magnet].map(k)
        found = self._maps[magnet, k](np.tile(p[:, None], k), current[None], motion[None], speed[None])
        values, inner, outer = (m.full() for m in found)
        return values, inner.reshape(q, k, 3), outer.reshape(q, k, len(p))


def _formula(quantity: str, m: Magnet, current: ca.SX, motion: ca.SX, speed: ca.SX) -> Any:
    if quantity == "control_current":
        return current
    if quantity == "control_current_ratio":
        return current / m.bias_current
    if quantity == "total_current":
        return m.bias_current + current
    if quantity == "flux_density":
        return magnetics.flux_density(m, current, motion)
    if quantity == "voltage":
        return magnetics.voltage(m, speed, current, motion)
    return motion / (m.gap if m.clearance is None else m.clearance)


class _Outputs:
    """What is looked at under one unbalance pattern, as a sum over modes: cheap, and exact enough to find peaks."""

    def __init__(self, state: State, force: Array):
        self.values, right, left = state.critical
        self.weights = (state.ports[2] @ right) * (left @ force)

    def at(self, speeds: Array) -> Array:
        """Amplitudes at some speeds, shape (k, outputs)."""
        return np.asarray((speeds**2)[:, None] * ((1.0 / (speeds[:, None] - self.values)) @ self.weights.T))


class UnbalanceMeasures:
    """Samples of all quantities that the residual unbalance drives.

    Parameters
    ----------
    loops : Driven
    bounds : dict of str to float
        Quantity and the value below which it need not be followed.
    """

    def __init__(self, loops: Driven, bounds: dict[str, float]):
        self.loops, self.bounds = loops, bounds
        self.magnets = Magnets(loops, tuple(bounds))

    def samples(self, state: State, end: float, points: int = POINTS, zooms: int = ZOOMS) -> dict[str, Samples]:
        """The highest peaks up to the end of the range, and the values at its end.

        Parameters
        ----------
        state : State
        end : float
            End of the range [rad/s].
        points, zooms : int
            Fineness of the search.
        """
        critical = np.sort(state.critical[0].real)  # where peaks may lie
        inside = critical[(critical > 0.01 * end) & (critical < end)]
        grid = np.unique(np.concatenate([np.linspace(0.0, end, points + 1)[1:], inside]))
        force = state.lower @ self.loops.unbalance
        out: dict[str, list[Samples]] = {q: [] for q in self.bounds}
        for j in range(force.shape[1]):
            outputs = _Outputs(state, force[:, j])
            for i in range(len(self.loops.machine.magnets)):
                values, _, _ = self._quantities(state, i, grid, outputs.at(grid))
                for k, name in enumerate(self.bounds):
                    chosen = self._refined(state, i, k, grid, values[k], outputs, self.bounds[name], zooms)
                    out[name].append(self.sample(state, i, k, j, chosen, force, end))
        n = state.member.family.parameters
        return {name: joined(found, n) for name, found in out.items()}

    def _amplitudes(self, magnet: int, y: Array) -> list[tuple[Array, Array]]:
        """Current and motion of a magnet, each with the weights w of its derivative Re(w dC x); weights are over C's rows."""
        loops = self.loops
        seen = len(loops.plant.loops)
        first = seen + len(loops.axes)
        controlled = [k for k, m in enumerate(loops.axes) if m == magnet]
        moved = [first + k for k, m in enumerate(loops.pushed) if m == magnet]
        zero = np.zeros(len(y)), np.zeros(y.shape, complex)
        return [
            self._largest(y, [seen + k for k in controlled]) if controlled else zero,
            self._orbit(y, moved),
        ]

    @staticmethod
    def _largest(y: Array, rows: list[int]) -> tuple[Array, Array]:
        size = np.abs(y[:, rows])
        best = np.array(rows)[np.argmax(size, axis=1)]
        k = np.arange(len(y))
        weights = np.zeros(y.shape, complex)
        weights[k, best] = y[k, best].conj() / np.maximum(np.abs(y[k, best]), 1e-300)
        return size.max(axis=1), weights

    @staticmethod
    def _orbit(y: Array, rows: list[int]) -> tuple[Array, Array]:
        """Largest radius: of a complex coordinate its modulus, of two real ones the sum of their circular parts."""
        weights = np.zeros(y.shape, complex)
        if len(rows) == 1:
            weights[:, rows[0]] = y[:, rows[0]].conj() / np.maximum(np.abs(y[:, rows[0]]), 1e-300)
            return np.abs(y[:, rows[0]]), weights
        v, w = y[:, rows[0]], y[:, rows[1]]
        total = np.zeros(len(y))
        for sign in (1.0, -1.0):
            part = (v + sign * 1j * w) / 2.0
            turn = part.conj() / np.maximum(np.abs(part), 1e-300) / 2.0
            total = total + np.abs(part)
            weights[:, rows[0]] += turn
            weights[:, rows[1]] += sign * 1j * turn
        return total, weights

    def _quantities(self, state: State, magnet: int, speeds: Array, y: Array) -> tuple[Array, Array, Array]:
        (current, _), (motion, _) = self._amplitudes(magnet, y)
        return self.magnets.at(magnet, state.member.p, current, motion, speeds)

    def _refined(
        self,
        state: State,
        magnet: int,
        k: int,
        grid: Array,
        values: Array,
        outputs: _Outputs,
        above: float,
        zooms: int,
    ) -> Array:
        """Speeds of the highest peaks, and the end of the range."""
        found = peaks(values)
        found = found[found < len(grid) - 1]
        found = found[np.argsort(-values[found])][:PEAKS]
        found = found[values[found] >= above]

        def value(x: Array) -> Array:
            speeds = x.ravel()
            return np.asarray(self._quantities(state, magnet, speeds, outputs.at(speeds))[0][k].reshape(x.shape))

        return np.append(zoomed(value, grid[np.maximum(found - 1, 0)], grid[found + 1], zooms), grid[-1])

    def sample(self, state: State, magnet: int, k: int, j: int, speeds: Array, force: Array, end: float) -> Samples:
        """Values at given speeds.

        Parameters
        ----------
        state : State
        magnet, k, j : int
            Magnet, quantity and unbalance pattern.
        speeds : ndarray, shape (m,)
            [rad/s]
        force : ndarray, shape (states, patterns)
            Of the patterns, in the coordinates of the state.
        end : float
            End of the range: of these speeds, the one that moves with it.
        """
        f, member = force[:, j], state.member
        matrices = 1j * speeds[:, None, None] * np.eye(state.size) - state.a0 - speeds[:, None, None] * state.a1
        states = np.linalg.solve(matrices, (speeds**2)[:, None, None] * f[:, None])[:, :, 0]
        amplitudes = self._amplitudes(magnet, states @ state.ports[2].T)
        values, inner, outer = self.magnets.at(magnet, member.p, amplitudes[0][0], amplitudes[1][0], speeds)
        weights: Array = inner[k, :, 0, None] * amplitudes[0][1] + inner[k, :, 1, None] * amplitudes[1][1]
        adjoint = np.linalg.solve(matrices.transpose(0, 2, 1), (weights @ state.ports[2])[:, :, None])[:, :, 0]
        x, y = state.lifted(states, adjoint)
        slopes = state.forms(y, x, 1j * speeds, speeds) + member.form("C", weights, x)
        to_end = ((adjoint @ state.a1) * states).sum(axis=1) - 1j * (adjoint * states).sum(axis=1)
        to_end = (to_end + 2.0 * speeds * (adjoint @ f)).real + inner[k, :, 2]
        where = tuple(f"magnets[{magnet}], {self.loops.patterns[j]}, {rpm_text(s)}" for s in speeds)
        groups = tuple(f"{magnet} {j} {'end' if s == end else 'peak'}" for s in speeds)
        rates = np.where(speeds == end, to_end, 0.0)
        return Samples(values[k], slopes.real + outer[k], rates, where, speeds, groups, speeds + 0j)
