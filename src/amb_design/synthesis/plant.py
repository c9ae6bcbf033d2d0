"""What an observer-based controller is designed for: reduced rotor, magnets, and the hardware around the law.

    x' = (A0 + Omega A1) x + B o,   y = C x,   x = [q, q', states behind the law, states before it] of all axes

with o what the law puts out and y what it sees, both in the law's units. States are scaled to the size that they have when the rotor moves
by ten micrometres at a thousand radians a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from ..model.controller import hardware
from ..model.pair import Pair
from ..spec.controller import LQG
from ..spec.machine import Machine
from .reduction import Array, Basis, reduced

MOTION, PACE = 1e-5, 1e3
"""Displacement [m] and frequency [rad/s] by which states are scaled."""

INTEGRAL = MOTION * 1e-2
"""Integral of a displacement by which the integrators are scaled [m s]."""

NAMES = ("A0", "A1", "B", "C", "E", "Q", "R", "W", "V")


@dataclass(frozen=True)
class Plant:
    """The data of regulator and observer at some values of the variables, with derivatives.

    Attributes
    ----------
    values : dict of str to ndarray
        A0, A1 (n, n), B (n, m), C (m, n), E (e, m) from what the law sees to its integrals; weights Q (n + e, n + e), R (m); noise W (n, n), V (m). e is m with integral action, else 0.
    changes : dict of str to ndarray
        Their derivatives, along a first axis.
    """

    values: dict[str, Array]
    changes: dict[str, Array]

    @property
    def sizes(self) -> tuple[int, int, int]:
        """States n, inputs m, integrals e."""
        n, m = self.values["B"].shape
        return n, m, len(self.values["Q"]) - n

    @property
    def planes(self) -> int:
        """Planes that the states stand for: one complex coordinate for both is one, y and z are two."""
        return 1 if np.iscomplexobj(self.values["A0"]) else 2

    def at(self, speed: float, moves: Array) -> Plant:
        """The plant at one speed: its A0 is A0 + speed A1, and it has no A1.

        Parameters
        ----------
        speed : float
            Spin speed [rad/s].
        moves : ndarray, shape (k,)
            Derivative of the speed with respect to the variables.
        """
        values, changes = dict(self.values), dict(self.changes)
        rate, turned = values.pop("A1"), changes.pop("A1")
        values["A0"] = values["A0"] + speed * rate
        changes["A0"] = changes["A0"] + speed * turned + moves[:, None, None] * rate
        return Plant(values, changes)


class PlantFamily:
    """The synthesis plant in terms of variables.

    Parameters
    ----------
    p : casadi.SX
        Column of variables, possibly empty.
    machine : Machine
        With expressions in p, and an LQG controller.
    basis : Basis
    nominal : LQG, optional
        The controller in numbers, which sizes of states are taken from; the machine's own if left out.
    """

    def __init__(self, p: ca.SX, machine: Machine, basis: Basis, nominal: LQG | None = None):
        law = machine.controller
        assert isinstance(law, LQG)
        pairs = _assembled(machine, law, basis, nominal or law)
        self.complex_form = basis.complex_form
        self.shapes = {name: pair.shape for name, pair in pairs.items()}
        both = [ca.SX(ca.densify(part)) for pair in pairs.values() for part in (pair.re, pair.im)]
        values = ca.vertcat(*[ca.vec(x) for x in both])
        self._function = ca.Function("plant", [p], [values, ca.jacobian(values, p)])

    def at(self, p: Array) -> Plant:
        """Numbers at given variables.

        Parameters
        ----------
        p : ndarray, shape (parameters,)
        """
        values, slopes = (x.full() for x in self._function(p))
        return Plant(self._split(values[:, 0]), self._split(slopes.T))

    def _split(self, flat: Array) -> dict[str, Array]:
        """Matrices from entries along the last axis, column by column."""
        out, start = {}, 0
        for name, (rows, columns) in self.shapes.items():
            size = rows * columns
            parts = [flat[..., start + k * size : start + (k + 1) * size] for k in range(2)]
            re, im = (x.reshape(*x.shape[:-1], columns, rows).swapaxes(-1, -2) for x in parts)
            matrix = re + 1j * im if self.complex_form else re
            out[name] = matrix[..., 0].real if name in ("R", "V") else matrix
            start += 2 * size
        return out


@dataclass(frozen=True)
class _Layout:
    """Where the states of the reduced rotor and of the hardware lie."""

    modes: int
    axes: int
    behind: int
    before: int

    @cached_property
    def size(self) -> int:
        return 2 * self.modes + self.axes * (self.behind + self.before)

    def place(self, block: str, axis: int = 0) -> slice:
        start = {"q": 0, "rate": self.modes, "behind": 2 * self.modes + axis * self.behind}
        start["before"] = 2 * self.modes + self.axes * self.behind + axis * self.before
        length = {"q": self.modes, "rate": self.modes, "behind": self.behind, "before": self.before}[block]
        return slice(start[block], start[block] + length)


def _assembled(machine: Machine, law: LQG, basis: Basis, nominal: LQG) -> dict[str, Pair]:
    rotor = reduced(machine, basis)
    before, behind = ({name: getattr(part, name).constant.re for name in "abcd"} for part in hardware(law))
    m = rotor.push.shape[1]
    at = _Layout(basis.size, m, behind["a"].shape[0], before["a"].shape[0])
    n = at.size
    re: dict[str, ca.SX] = {"A0": ca.SX(n, n), "A1": ca.SX(n, n), "B": ca.SX(n, m), "C": ca.SX(m, n)}
    im = {name: ca.SX(*x.shape) for name, x in re.items()}
    q, rate = at.place("q"), at.place("rate")
    re["A0"][q, rate] = ca.SX.eye(at.modes)
    for name, k, c in (("A0", rotor.K0, rotor.C0), ("A1", rotor.K1, rotor.C1)):
        re[name][rate, q], re[name][rate, rate] = -k.re, -c.re
        im[name][rate, q], im[name][rate, rate] = -k.im, -c.im
    for j in range(m):
        own = at.place("behind", j)
        re["A0"][own, own] = behind["a"]
        re["B"][own, j] = behind["b"][:, 0]
        re["A0"][rate, own] = -ca.mtimes(rotor.push[:, j], behind["c"])
    for i in range(m):
        own = at.place("before", i)
        re["A0"][own, own] = before["a"]
        re["A0"][own, q] = ca.mtimes(before["b"][:, 0], rotor.seen[i, :])
        for j in range(m):
            re["A0"][own, at.place("behind", j)] = -ca.mtimes(before["b"][:, 0] * rotor.residual[i, j], behind["c"])
        re["C"][i, own] = before["c"]
    weights, noise = _weights(law, rotor.moved, basis, behind, at), _noise(law, rotor.force, basis, re["B"], at)
    scale = _scale(nominal, basis, at)
    grow, shrink = ca.diag(scale), ca.diag(1.0 / scale)
    for x in (re, im):
        x["A0"], x["A1"] = (ca.mtimes([shrink, x[name], grow]) for name in ("A0", "A1"))
        x["B"], x["C"] = ca.mtimes(shrink, x["B"]), ca.mtimes(x["C"], grow)
    whole = ca.diag(ca.vertcat(scale, ca.DM.ones(weights["Q"].shape[0] - n) * INTEGRAL))
    re["Q"] = ca.mtimes([whole, weights["Q"], whole])
    re["W"] = ca.mtimes([shrink, noise["W"], shrink])
    re["R"], re["V"] = weights["R"], noise["V"]
    integrals = weights["Q"].shape[0] - n
    re["E"] = ca.SX.eye(m)[:integrals, :] / (law.sensor_gain * INTEGRAL)
    return {name: Pair(re[name], im.get(name, ca.SX(*re[name].shape))) for name in NAMES}


def _weights(law: LQG, moved: ca.SX, basis: Basis, behind: dict[str, ca.SX], at: _Layout) -> dict[str, ca.SX]:
    """Q over the plant's states and the integrals [m s], R over the outputs of the law."""
    q, rate = at.place("q"), at.place("rate")
    integrals = 0 if law.integral is None else at.axes
    rows: list[ca.SX] = []

    def row(value: ca.SX, where: slice) -> None:
        full = ca.SX(1, at.size + integrals)
        full[0, where] = value
        rows.append(full)

    for j in range(at.axes):
        row(moved[j, :] / law.displacement, q)
        if law.velocity is not None:
            row(moved[j, :] / law.velocity, rate)
        if law.current_rate is not None:
            row(ca.mtimes(behind["c"], behind["a"]) / law.current_rate, at.place("behind", j))
        if law.integral is not None:
            row(1.0 / law.integral, slice(at.size + j, at.size + j + 1))
    if law.modal_velocity is not None:
        for k in range(at.modes):
            row(basis.heights[k] / law.modal_velocity, slice(at.modes + k, at.modes + k + 1))
    chosen = ca.vertcat(*rows)
    gain = 1.0 if law.amplifier is None else law.amplifier.gain
    return {"Q": ca.mtimes(chosen.T, chosen), "R": ca.SX.ones(at.axes, 1) * (gain / law.current) ** 2}


def _noise(law: LQG, force: ca.SX, basis: Basis, inputs: ca.SX, at: _Layout) -> dict[str, ca.SX]:
    """W over the plant's states and V over the sensors, whose noise is taken to enter behind the low-pass."""
    gain = 1.0 if law.amplifier is None else law.amplifier.gain
    columns = ca.SX(at.size, 2 * at.axes + at.modes)
    columns[at.place("rate"), : at.axes] = force * law.force_noise
    columns[:, at.axes : 2 * at.axes] = inputs * (law.current_noise / gain)
    columns[at.place("rate"), 2 * at.axes :] = ca.diag(ca.DM(basis.heights)) * law.modal_noise
    return {
        "W": ca.mtimes(columns, columns.T),
        "V": ca.SX.ones(at.axes, 1) * (law.sensor_gain * law.sensor_noise) ** 2,
    }


def _scale(law: LQG, basis: Basis, at: _Layout) -> ca.DM:
    """Size of each state."""
    amplitude = MOTION / np.maximum(basis.heights, 1e-12)
    sensed = MOTION * abs(law.sensor_gain)
    rest = np.concatenate([np.full(at.axes * at.behind, law.current), np.full(at.axes * at.before, sensed)])
    return ca.DM(np.concatenate([amplitude, PACE * amplitude, rest]))
