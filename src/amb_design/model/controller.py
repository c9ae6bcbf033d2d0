"""State space of controllers.

A chain is a cascade. Each block takes signals and returns signals, adding states of its own; a signal is a linear
combination of states and of the inputs, displacements and velocities of the shaft at the sensors. A low-pass keeps the derivative
of its output as a state, so that the law behind it needs no extra pole; without a low-pass the ideal derivative uses the velocity.
Filter states are scaled by their corner frequencies.

Each coefficient has four parts: real, imaginary (what couples y and z of an isotropic machine), and what a rad/s of spin speed adds
to each of the two.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from ..spec.controller import PID, Chain, StateSpace, rows_of
from ..spec.fields import Number
from .pair import Affine, Matrix, Pair

REAL, IMAGINARY, RATE, IMAGINARY_RATE = PARTS = range(4)

_Signal = dict[tuple[Any, int], Number]
"""Coefficient of each part of each state (an int) and input ("s" or "v", axis)."""


@dataclass(frozen=True)
class Realisation:
    """dx/dt = a x + b [s, v], output = c x + d [s, v] for the displacements s and velocities v of m axes.

    Attributes
    ----------
    a, b, c, d : Affine, of shape (n, n), (n, 2 m), (m, n), (m, 2 m)
    states : name of each state
    """

    a: Affine
    b: Affine
    c: Affine
    d: Affine
    states: tuple[str, ...]

    @property
    def crosses(self) -> bool:
        """True if complex coordinates are turned: then y and z are coupled."""
        return any(x.constant.im.nnz() or x.rate.im.nnz() for x in (self.a, self.b, self.c, self.d))


def realise(chains: Sequence[Chain], complex_form: bool = False) -> Realisation:
    """State space of a controller from shaft displacements to currents, without the minus sign of the feedback.

    Parameters
    ----------
    chains : sequence of Chain
        PIDs: one, of an axis that is coupled to no other, or of a magnet in complex coordinates; or two, of both real axes of a
        magnet. A law of several inputs: itself for each of its axes; first all axes in y, then all in z.
    complex_form : bool
        True for complex axes.

    Returns
    -------
    Realisation
    """
    cascade, count = _Cascade(), len(chains)
    if count > 1 and isinstance(chains[0], PID):
        return _coupled([chain for chain in chains if isinstance(chain, PID)])
    sensed = [_front(cascade, chain, k) for k, chain in enumerate(chains)]
    first = chains[0]
    if isinstance(first, PID):
        signals = [cascade.pid(first, *sensed[0])]
    else:
        assert isinstance(first, StateSpace)
        signals = cascade.law(_split(first, complex_form, count), [signal for signal, _ in sensed])
    return cascade.realisation([_back(cascade, chain, signal) for chain, signal in zip(chains, signals, strict=True)])


def _coupled(pids: Sequence[PID]) -> Realisation:
    """Two real axes whose cross gains tie them: y gets minus what z sees."""
    cascade = _Cascade()
    sensed, signals = [], []
    for k, pid in enumerate(pids):
        cascade.axis = k
        sensed.append(_front(cascade, pid, k))
        signals.append(cascade.pid(pid, *sensed[k], crossing=False))
    for k, pid in enumerate(pids):
        other, sign = sensed[1 - k][0], (-1.0, 1.0)[k]
        crossed = _sum(_scaled(pid.kc, other), _scaled(pid.kc_rate, _moved(other, RATE)))
        signals[k] = _sum(signals[k], _scaled(sign * pid.total_gain, crossed))
    outputs = []
    for k, pid in enumerate(pids):
        cascade.axis = k
        outputs.append(_back(cascade, pid, signals[k]))
    return cascade.realisation(outputs)


def _front(cascade: _Cascade, chain: Chain, axis: int) -> tuple[_Signal, _Signal]:
    """What the law sees of an axis, and its derivative."""
    signal: _Signal = {(("s", axis), REAL): chain.sensor_gain}
    rate: _Signal = {(("v", axis), REAL): chain.sensor_gain}
    if chain.low_pass is None:
        return signal, rate
    return cascade.low_pass("low_pass", chain.low_pass.frequency, chain.low_pass.damping, signal)


def _back(cascade: _Cascade, chain: Chain, signal: _Signal) -> _Signal:
    """From the law's output to the current."""
    for k, notch in enumerate(chain.notches):
        signal = cascade.notch(f"notch[{k}]", notch.frequency, notch.damping, notch.width, signal)
    if not _is_zero(chain.delay):  # Pade 2 is an all-pass: a notch whose numerator damping is minus its denominator's
        half = math.sqrt(3.0) / 2.0
        signal = cascade.notch("delay", math.sqrt(12.0) / chain.delay, -half, half, signal)
    if chain.amplifier is not None:
        amplifier = chain.amplifier
        signal, _ = cascade.low_pass(
            "amplifier", amplifier.bandwidth, amplifier.damping, _scaled(amplifier.gain, signal)
        )
    return signal


_Law = dict[str, list[list[_Signal]]]
"""Entries of a, b, c, d, each with its parts."""


def _split(law: StateSpace, complex_form: bool, count: int) -> _Law:
    """Entries of a law for the coordinates at hand: real ones of both planes take a complex law apart."""
    doubled = not complex_form and 2 * law.law.ports == count
    planes = 2 if doubled else 1
    n, m = law.law.states, law.law.ports
    out: _Law = {}
    for name, (rows, columns) in {"a": (n, n), "b": (n, m), "c": (m, n), "d": (m, m)}.items():
        table: list[list[_Signal]] = [[{} for _ in range(planes * columns)] for _ in range(planes * rows)]
        for part, matrices in zip(PARTS, law.parts, strict=True):
            entries = () if matrices is None else rows_of(getattr(matrices, name))
            for i, row in enumerate(entries):
                for j, value in enumerate(row):
                    if _is_zero(value):
                        continue
                    if not doubled:
                        table[i][j][None, part] = value
                        continue
                    kind, turned = part - part % 2, part % 2
                    for k in range(2):  # real in, then imaginary in
                        sign = -1.0 if turned and k else 1.0
                        table[i + rows * ((k + turned) % 2)][j + columns * k][None, kind] = sign * value
        out[name] = table
    return out


@dataclass
class _Cascade:
    """Collects states while the blocks are laid one behind the other; they are ordered by the axis that they belong to."""

    axis: int = 0
    axes: list[int] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    rates: list[_Signal] = field(default_factory=list)

    def _states(self, *names: str) -> list[int]:
        first = len(self.names)
        self.names += names
        self.axes += [self.axis] * len(names)
        self.rates += [{} for _ in names]
        return list(range(first, len(self.names)))

    def low_pass(self, name: str, w: Number, damping: Number, signal: _Signal) -> tuple[_Signal, _Signal]:
        """Output and its derivative."""
        p, q = self._states(f"{name}.output", f"{name}.rate")
        self.rates[p] = {(q, REAL): w}
        self.rates[q] = _sum({(p, REAL): -w, (q, REAL): -2.0 * damping * w}, _scaled(w, signal))
        return {(p, REAL): 1.0}, {(q, REAL): w}

    def pid(self, pid: PID, signal: _Signal, rate: _Signal, crossing: bool = True) -> _Signal:
        total = _scaled(pid.kp, signal)
        if crossing and pid.crosses:
            total = _sum(total, _scaled(pid.kc, _moved(signal, IMAGINARY)))
            total = _sum(total, _scaled(pid.kc_rate, _moved(signal, IMAGINARY_RATE)))
        if not _is_zero(pid.ki):
            (integral,) = self._states("integral")
            self.rates[integral] = dict(signal)
            total = _sum(total, {(integral, REAL): pid.ki})
        if not _is_zero(pid.derivative_time):
            (smooth,) = self._states("derivative.filter")
            rate = _scaled(1.0 / pid.derivative_time, _sum(signal, {(smooth, REAL): -1.0}))
            self.rates[smooth] = dict(rate)
        if not _is_zero(pid.kd):
            total = _sum(total, _scaled(pid.kd, rate))
        return _scaled(pid.total_gain, total)

    def law(self, entries: _Law, signals: list[_Signal]) -> list[_Signal]:
        own = self._states(*[f"law[{k}]" for k in range(len(entries["a"]))])
        inputs: list[_Signal] = [{(k, REAL): 1.0} for k in own]

        def combined(first: list[_Signal], second: list[_Signal]) -> _Signal:
            total: _Signal = {}
            for row, sources in ((first, inputs), (second, signals)):
                for entry, source in zip(row, sources, strict=False):
                    for (_, part), value in entry.items():
                        total = _sum(total, _scaled(value, _moved(source, part)))
            return total

        for k, a, b in zip(own, entries["a"], entries["b"], strict=False):
            self.rates[k] = combined(a, b)
        return [combined(c, d) for c, d in zip(entries["c"], entries["d"], strict=True)]

    def notch(self, name: str, w: Number, numerator: Number, denominator: Number, signal: _Signal) -> _Signal:
        p, q = self._states(f"{name}.output", f"{name}.rate")
        self.rates[p] = {(q, REAL): w}
        self.rates[q] = _sum({(p, REAL): -w, (q, REAL): -2.0 * denominator * w}, _scaled(w, signal))
        return _sum(signal, {(q, REAL): 2.0 * (numerator - denominator)})

    def realisation(self, outputs: list[_Signal]) -> Realisation:
        n, m = len(self.names), len(outputs)
        order = sorted(range(n), key=self.axes.__getitem__)
        keys = [*order, *(("s", k) for k in range(m)), *(("v", k) for k in range(m))]
        rows = [*(self.rates[k] for k in order), *outputs]
        parts = []
        for part in PARTS:
            table = [[row.get((key, part), 0.0) for key in keys] for row in rows]
            parts.append(_matrix(table))

        def block(rows: slice, columns: slice) -> Affine:
            re, im, re_rate, im_rate = (x[rows, columns] for x in parts)
            return Affine(Pair(re, im), Pair(re_rate, im_rate))

        states, ports, out = slice(0, n), slice(n, n + 2 * m), slice(n, n + m)
        return Realisation(
            block(states, states),
            block(states, ports),
            block(out, states),
            block(out, ports),
            tuple(self.names[k] for k in order),
        )


def _matrix(table: list[list[Number]]) -> Matrix:
    """CasADi matrix without structural entries where the table holds the number zero."""
    entries = [(i, j, v) for i, row in enumerate(table) for j, v in enumerate(row) if not _is_zero(v)]
    if not entries:
        return ca.DM(len(table), len(table[0]))
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
    if _is_zero(factor):
        return {}
    return {key: factor * value for key, value in signal.items()}


def _moved(signal: _Signal, part: int) -> _Signal:
    """A real signal as another part."""
    if part == REAL:
        return signal
    assert all(old == REAL for _, old in signal), "the law stands first behind real filters"
    return {(source, part): value for (source, _), value in signal.items()}


def _is_zero(value: Number) -> bool:
    return isinstance(value, int | float) and value == 0


def hardware(chain: Chain) -> tuple[Realisation, Realisation]:
    """What stands before and behind the law of an axis, as state spaces of one axis each.

    Parameters
    ----------
    chain : Chain

    Returns
    -------
    before : Realisation
        From the shaft's displacement to what the law sees.
    behind : Realisation
        From what the law puts out, taken in the place of a displacement, to the current.
    """
    before, behind = _Cascade(), _Cascade()
    seen, _ = _front(before, chain, 0)
    current = _back(behind, chain, {(("s", 0), REAL): 1.0})
    return before.realisation([seen]), behind.realisation([current])
