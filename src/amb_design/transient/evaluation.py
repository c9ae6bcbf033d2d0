"""From the raw history of a run to its result."""

from __future__ import annotations

import casadi as ca
import numpy as np

from ..analysis.system import Array
from .compiled import many
from .equations import FLAGS, WORKS
from .history import History
from .result import Saturation, Transient
from .schedule import HEAD, Schedule
from .split import Split
from .state import State


def evaluated(split: Split, schedule: Schedule, history: History, final: State, stopped: str) -> Transient:
    """All results.

    Parameters
    ----------
    split, schedule, history
    final : State
    stopped : str
        Why the run stopped early, if it did.
    """
    e = split.equations
    p, n, times, x = e.plant, e.plant.size, history.times, history.states
    count, magnets = len(times), len(e.machine.magnets)
    angles, speeds, _ = schedule.spin.over(times)
    quantities = np.split(x @ e.quantities.T, np.cumsum([e.magnets.size1_in(k) for k in range(4)]), axis=1)
    if e.sampled or not all(a.linear for a in e.actuators):
        pull, touch, _, current, change, _ = many(e.magnets, *quantities, history.held, speeds[:, None])
    else:
        pull, current, change = (
            x @ at_rest.T + speeds[:, None] * (x @ follows.T)
            for at_rest, follows in (split.pull, split.current, split.change)
        )
        touch = np.zeros((count, 2 * magnets))
    ideal = [k for k, a in enumerate(e.actuators) if a.amplifier is None]
    if any(e.actuators[k].magnet.has_geometry for k in ideal):
        change[:, ideal] = _current_rates(split, schedule, history, quantities)[:, ideal]
    voltages = np.zeros((count, magnets, 2, 2))
    for k, actuator in enumerate(e.actuators):
        voltages[:, k // 2, k % 2] = actuator.voltages(current[:, k], change[:, k], quantities[1][:, k])
    xi, rate = x[:, :n], x[:, n : 2 * n]
    return Transient(
        times=times,
        speeds=speeds,
        angles=angles + schedule.angle,
        positions=p.positions,
        currents=current.reshape(count, magnets, 2),
        voltages=voltages,
        magnet_forces=pull.reshape(count, magnets, 2),
        contact_forces=touch.reshape(count, magnets, 2),
        kinetic=0.5 * np.sum(rate**2, axis=1),
        potential=0.5 * np.sum((xi @ ((p.K0 + p.K0.T) / 2.0)) * xi, axis=1),
        works={name: history.works[:, k] for k, name in enumerate(WORKS)},
        saturations=_met(times, history.shares.reshape(count, magnets, len(FLAGS))),
        final=final,
        stopped=stopped,
        machine=e.machine,
        coordinates=xi,
        rates=rate,
        shapes=p.shapes,
    )


def _current_rates(split: Split, schedule: Schedule, history: History, quantities: list[Array]) -> Array:
    """Rates of the currents of ideal amplifiers, from the motion."""
    e, times, x = split.equations, history.times, history.states
    numbers = np.zeros((len(times), HEAD + len(schedule.forces)))
    pieces = list(schedule.pieces(float(times[0]), float(times[-1]), e.plant)) if len(times) > 1 else []
    for piece in reversed(pieces):  # an instant between two belongs to the earlier one
        numbers[(times >= piece.start) & (times <= piece.stop)] = piece.numbers
    signals, speeds, rates = many(schedule.signals, times[:, None], numbers)
    (rest,) = many(split.remainder, x @ split.C.T, history.held, speeds, speeds)
    moving = (
        x @ split.A0.T + speeds * (x @ split.A1.T) - rates * (x @ split.A2.T) + np.hstack([rest, signals]) @ split.B.T
    )
    inputs = [ca.SX.sym(f"i{k}", e.magnets.size1_in(k)) for k in range(e.magnets.n_in())]
    along = [ca.SX.sym(f"d{k}", e.magnets.size1_in(k)) for k in range(5)]
    faster = ca.SX.sym("faster")
    change = ca.jtimes(e.magnets(*inputs)[3], ca.vertcat(*inputs[:5], inputs[-1]), ca.vertcat(*along, faster))
    function = ca.Function("rates", [*inputs, *along, faster], [ca.densify(change)])
    directions = np.split(moving @ e.quantities.T, np.cumsum([q.shape[1] for q in quantities])[:-1], axis=1)
    (found,) = many(function, *quantities, history.held, speeds, *directions, rates)
    return found


def _met(times: Array, shares: Array) -> tuple[Saturation, ...]:
    if len(times) < 2:
        return ()
    found, steps = [], np.diff(times)
    for i in range(shares.shape[1]):
        for k, kind in enumerate(FLAGS):
            share = shares[1:, i, k]
            if share.any():
                first = float(times[int(np.argmax(share > 0.0))])
                found.append(Saturation(kind, i, first, float(share @ steps / steps.sum())))
    return tuple(sorted(found, key=lambda s: s.first))
