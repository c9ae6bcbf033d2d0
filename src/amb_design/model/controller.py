"""State space of a controller chain.

The chain is a cascade. Each block takes a signal and returns one, adding states of its own; a signal is a linear
combination of states and of the two inputs, displacement s and velocity v of the shaft at the sensor. A low-pass
keeps the derivative of its output as a state, so that the PID behind it needs no extra pole; without a low-pass the
ideal derivative uses v. Filter states are scaled by their corner frequencies.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from ..spec.controller import PID
from ..spec.fields import Number
from .pair import Matrix

_Signal = dict[Any, Number]
"""Coefficient of each state (an int) and input ("s", "v")."""


@dataclass(frozen=True)
class Realisation:
    """dx/dt = a x + b [s, v], output = c x + d [s, v].

    Attributes
    ----------
    a, b, c, d : CasADi matrices of shape (n, n), (n, 2), (1, n), (1, 2)
    states : name of each state
    """

    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix
    states: tuple[str, ...]


def realise(pid: PID) -> Realisation:
    """State space of the chain from shaft displacement to current, without the minus sign of the feedback.

    Parameters
    ----------
    pid : PID
        Numbers or CasADi scalars.

    Returns
    -------
    Realisation
    """
    cascade = _Cascade()
    signal: _Signal = {"s": pid.sensor_gain}
    rate: _Signal = {"v": pid.sensor_gain}
    if pid.low_pass is not None:
        signal, rate = cascade.low_pass("low_pass", pid.low_pass.frequency, pid.low_pass.damping, signal)
    signal = cascade.pid(pid, signal, rate)
    for k, notch in enumerate(pid.notches):
        signal = cascade.notch(f"notch[{k}]", notch.frequency, notch.damping, notch.width, signal)
    if not _is_zero(pid.delay):  # Pade 2 is an all-pass: a notch whose numerator damping is minus its denominator's
        half = math.sqrt(3.0) / 2.0
        signal = cascade.notch("delay", math.sqrt(12.0) / pid.delay, -half, half, signal)
    if pid.amplifier is not None:
        amplifier = pid.amplifier
        signal, _ = cascade.low_pass(
            "amplifier", amplifier.bandwidth, amplifier.damping, _scaled(amplifier.gain, signal)
        )
    return cascade.realisation(signal)


@dataclass
class _Cascade:
    """Collects states while the blocks are laid one behind the other."""

    names: list[str] = field(default_factory=list)
    rates: list[_Signal] = field(default_factory=list)

    def _states(self, *names: str) -> list[int]:
        first = len(self.names)
        self.names += names
        self.rates += [{} for _ in names]
        return list(range(first, len(self.names)))

    def low_pass(self, name: str, w: Number, damping: Number, signal: _Signal) -> tuple[_Signal, _Signal]:
        """Output and its derivative."""
        p, q = self._states(f"{name}.output", f"{name}.rate")
        self.rates[p] = {q: w}
        self.rates[q] = _sum({p: -w, q: -2.0 * damping * w}, _scaled(w, signal))
        return {p: 1.0}, {q: w}

    def pid(self, pid: PID, signal: _Signal, rate: _Signal) -> _Signal:
        total = _scaled(pid.kp, signal)
        if not _is_zero(pid.ki):
            (integral,) = self._states("integral")
            self.rates[integral] = dict(signal)
            total = _sum(total, {integral: pid.ki})
        if not _is_zero(pid.derivative_time):
            (smooth,) = self._states("derivative.filter")
            rate = _scaled(1.0 / pid.derivative_time, _sum(signal, {smooth: -1.0}))
            self.rates[smooth] = dict(rate)
        if not _is_zero(pid.kd):
            total = _sum(total, _scaled(pid.kd, rate))
        return _scaled(pid.total_gain, total)

    def notch(self, name: str, w: Number, numerator: Number, denominator: Number, signal: _Signal) -> _Signal:
        p, q = self._states(f"{name}.output", f"{name}.rate")
        self.rates[p] = {q: w}
        self.rates[q] = _sum({p: -w, q: -2.0 * denominator * w}, _scaled(w, signal))
        return _sum(signal, {q: 2.0 * (numerator - denominator)})

    def realisation(self, output: _Signal) -> Realisation:
        n = len(self.names)
        keys = [*range(n), "s", "v"]
        table = [[row.get(k, 0.0) for k in keys] for row in [*self.rates, output]]
        matrix = _matrix(table)
        return Realisation(matrix[:n, :n], matrix[:n, n:], matrix[n:, :n], matrix[n:, n:], tuple(self.names))


def _matrix(table: list[list[Number]]) -> Matrix:
    """CasADi matrix without structural entries where the table holds the number zero."""
    entries = [(i, j, v) for i, row in enumerate(table) for j, v in enumerate(row) if not _is_zero(v)]
    rows, columns = [i for i, _, _ in entries], [j for _, j, _ in entries]
    values = ca.vertcat(*[v for _, _, v in entries])
    order = ca.Sparsity.triplet(len(table), len(table[0]), rows, columns)
    where = {rc: k for k, rc in enumerate(zip(rows, columns, strict=True))}
    return type(values)(order, values[[where[rc] for rc in zip(*order.get_triplet(), strict=True)]])


def _sum(first: _Signal, second: _Signal) -> _Signal:
    out = dict(first)
    for key, value in second.items():
        out[key] = out[key] + value if key in out else value
    return out


def _scaled(factor: Number, signal: _Signal) -> _Signal:
    return {key: factor * value for key, value in signal.items()}


def _is_zero(value: Number) -> bool:
    return isinstance(value, int | float) and value == 0
