"""Ideal linear quadratic regulator: the whole state is known and currents follow at once."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from ..errors import ModelError, SolveError
from ..model.loop import structure
from ..model.pair import Pair
from ..spec.controller import LQR, StateFeedback
from ..spec.machine import Machine
from .obstacle import WEIGHTS, obstacle
from .plant import MOTION, PACE
from .reduction import Array, Basis, basis_of, reduced
from .riccati import Data, Solution, solve


def regulator(machine: Machine, speed: float | None = None) -> tuple[Data, Solution]:
    """The regulator on the reduced rotor.

    Parameters
    ----------
    machine : Machine
        Isotropic, numbers only, with an LQR controller.
    speed : float, optional
        Spin speed [rad/s]; that of the design if left out.

    Returns
    -------
    data : Data
        States are modal coordinates and their rates, scaled as in `plant`; time in 1/PACE seconds; inputs in amperes.
    solution : Solution

    Raises
    ------
    ModelError
        If the machine is anisotropic, or there is no such regulator.
    """
    law = machine.controller
    assert isinstance(law, LQR)
    speed = float(law.design_speed) if speed is None else speed
    basis = basis_of(machine, law.modes)
    if not basis.complex_form:
        raise ModelError(f"{machine.name} is anisotropic; ideal state feedback is there for isotropic machines only")
    rotor, k = reduced(machine, basis), basis.size
    scale = _scale(basis)
    A = np.zeros((2 * k, 2 * k), complex)
    A[:k, k:] = np.eye(k)
    A[k:, :k] = -(_numbers(rotor.K0) + speed * _numbers(rotor.K1))
    A[k:, k:] = -(_numbers(rotor.C0) + speed * _numbers(rotor.C1))
    B = np.vstack([np.zeros((k, rotor.push.shape[1])), _real(rotor.push)])
    moved, nothing = _real(rotor.moved), np.zeros((rotor.moved.shape[0], k))
    rows = [np.hstack([moved / law.displacement, nothing])]
    if law.velocity is not None:
        rows.append(np.hstack([nothing, moved / law.velocity]))
    if law.modal_velocity is not None:
        rows.append(np.hstack([np.zeros((k, k)), np.diag(basis.heights / law.modal_velocity)]))
    weighed = np.vstack(rows) * scale * law.current  # an ampere of control weighs one
    data = Data(
        A / scale[:, None] * scale / PACE,
        B / scale[:, None] / PACE,
        weighed.T @ weighed,
        np.ones(B.shape[1]),
    )
    try:
        return data, solve(data)
    except SolveError:
        raise ModelError(f"{machine.name}: {obstacle(data.A * PACE, data.B * PACE) or WEIGHTS}") from None


def state_feedback(machine: Machine) -> StateFeedback:
    """The regulator's gains on the nodes of the machine's own mesh.

    Parameters
    ----------
    machine : Machine
        As in `regulator`.
    """
    law = machine.controller
    assert isinstance(law, LQR)
    speed = float(law.design_speed)
    there = _on_nodes(machine, law, speed)
    if not law.scheduled:
        return _feedback(there)
    rest = _on_nodes(machine, law, 0.0)
    return replace(_feedback(rest), per_speed=_feedback((there - rest) / speed))


def _on_nodes(machine: Machine, law: LQR, speed: float) -> Array:
    """Gains on the displacements and slopes of all nodes, and on their rates, shape (2, magnets, 2 nodes)."""
    _, solution = regulator(machine, speed)
    basis = basis_of(machine, law.modes)
    plant = structure(machine.without_controllers(), basis.mesh)
    coordinates = np.zeros((basis.size, 2 * basis.mesh.nodes))
    coordinates[:, list(plant.free)] = basis.shapes.T @ _real(plant.M.re)
    # The regulator is told of currents that push, the machine's law has its minus sign outside.
    gains = solution.K / _scale(basis)
    return np.array([gains[:, : basis.size] @ coordinates, gains[:, basis.size :] @ coordinates])


def _feedback(gains: Array) -> StateFeedback:
    position, rate = gains

    def rows(x: Array) -> tuple[tuple[float, ...], ...]:
        return tuple(map(tuple, x.tolist()))

    return StateFeedback(
        position=rows(position.real),
        rate=rows(rate.real),
        position_cross=rows(position.imag),
        rate_cross=rows(rate.imag),
    )


def _scale(basis: Basis) -> Array:
    amplitude = MOTION / basis.heights
    return np.concatenate([amplitude, PACE * amplitude])


def _numbers(pair: Pair) -> Array:
    return np.asarray(_real(pair.re) + 1j * _real(pair.im))


def _real(matrix: ca.DM) -> Array:
    return np.asarray(ca.DM(matrix).full())
