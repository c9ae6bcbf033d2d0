"""Quadratic regulator with Kalman observer and integral action, as one law with exact derivatives.

    x^' = (A0 + Omega A1 - B K - L C) x^ - B Ke e + L y,   e' = y,   o = -K x^ - Ke e

K regulates rotor, hardware and integrals; L observes rotor and hardware. Gains that follow the speed run linearly from those
designed at rest to those designed at the design speed, so that the whole law does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .plant import PACE, Plant
from .reduction import Array
from .riccati import Data, Solution, adjoint, derivatives, solve

LAW = ("a", "b", "c")
"""Parts of the law; it passes nothing straight through."""


@dataclass(frozen=True)
class Gains:
    """Gains at one speed, and their derivatives along a first axis.

    Attributes
    ----------
    K : ndarray, shape (m, n + e)
    L : ndarray, shape (n, m)
    dK, dL : ndarray
    regulator, observer : Solution
        The observer's is that of the adjoint problem; its poles are conjugates of the observer's.
    """

    K: Array
    L: Array
    dK: Array
    dL: Array
    regulator: Solution
    observer: Solution


@dataclass(frozen=True)
class Law:
    """State space of the law and its derivatives.

    Attributes
    ----------
    constant, rate : dict of str to ndarray
        a, b and c at rest, and what a rad/s adds; the latter empty if nothing.
    d_constant, d_rate : dict of str to ndarray
        Derivatives along a first axis.
    gains : tuple of Gains
        Of the speeds of the design.
    """

    constant: dict[str, Array]
    rate: dict[str, Array]
    d_constant: dict[str, Array]
    d_rate: dict[str, Array]
    gains: tuple[Gains, ...]


def regulator_data(plant: Plant, speed: float, moves: Array) -> tuple[Data, Data]:
    """Riccati data of the regulator with integrals, in time scaled by `PACE`, and their derivatives.

    Parameters
    ----------
    plant : Plant
    speed, moves
        As in `Plant.at`.
    """
    n, m, e = plant.sizes
    there = plant.at(speed, moves)
    v, d = there.values, there.changes
    unit = v["R"][0]

    def widened(A: Array, integrated: Array) -> Array:
        out = np.zeros((*A.shape[:-2], n + e, n + e), A.dtype)
        out[..., :n, :n] = A
        if e:
            out[..., n:, :n] = integrated
        return out / PACE

    def tall(B: Array) -> Array:
        return np.concatenate([B, np.zeros((*B.shape[:-2], e, m))], axis=-2) / PACE

    return (
        Data(widened(v["A0"], v["E"] @ v["C"]), tall(v["B"]), v["Q"] / unit, v["R"] / unit),
        Data(widened(d["A0"], d["E"] @ v["C"] + v["E"] @ d["C"]), tall(d["B"]), d["Q"] / unit, d["R"] / unit),
    )


def observer_data(plant: Plant, speed: float, moves: Array) -> tuple[Data, Data]:
    """Riccati data of the observer, transposed, in time scaled by `PACE`, and their derivatives.

    Parameters
    ----------
    plant, speed, moves
        As in `regulator_data`.
    """
    there = plant.at(speed, moves)
    v, d = there.values, there.changes
    unit = v["V"][0]

    def turned(x: Array) -> Array:
        return adjoint(x) / PACE

    return (
        Data(turned(v["A0"]), turned(v["C"]), v["W"] / unit, v["V"] / unit),
        Data(turned(d["A0"]), turned(d["C"]), d["W"] / unit, d["V"] / unit),
    )


def gains(plant: Plant, speed: float, moves: Array) -> Gains:
    """Gains of regulator and observer at a speed.

    Parameters
    ----------
    plant, speed, moves
        As in `regulator_data`.

    Raises
    ------
    SolveError
        If one of the two has no stabilising solution.
    """
    data, changes = regulator_data(plant, speed, moves)
    regulator = solve(data)
    _, dK = derivatives(data, changes, regulator)
    data, changes = observer_data(plant, speed, moves)
    observer = solve(data)
    _, dL = derivatives(data, changes, observer)
    return Gains(regulator.K, observer.K.conj().T, dK, adjoint(dL), regulator, observer)


def law_of(plant: Plant, speed: float, moves: Array, scheduled: bool) -> Law:
    """The law.

    Parameters
    ----------
    plant : Plant
    speed : float
        Spin speed of the design [rad/s].
    moves : ndarray, shape (k,)
        Derivative of that speed with respect to the variables.
    scheduled : bool
        True if gains and observer follow the spin speed.

    Raises
    ------
    SolveError
        If regulator or observer have no stabilising solution.
    """
    if not scheduled:
        one = gains(plant, speed, moves)
        constant, d_constant = _blocks(plant.at(speed, moves), "A0", one.K, one.L, one.dK, one.dL, True)
        return Law(constant, {}, d_constant, {}, (one,))
    rest, there = gains(plant, 0.0, np.zeros_like(moves)), gains(plant, speed, moves)
    K, L = ((b - a) / speed for a, b in ((rest.K, there.K), (rest.L, there.L)))
    dK, dL = (
        (b - a - moves[:, None, None] * slope) / speed
        for a, b, slope in ((rest.dK, there.dK, K), (rest.dL, there.dL, L))
    )
    constant, d_constant = _blocks(plant, "A0", rest.K, rest.L, rest.dK, rest.dL, True)
    rate, d_rate = _blocks(plant, "A1", K, L, dK, dL, False)
    return Law(constant, rate, d_constant, d_rate, (rest, there))


def _blocks(
    plant: Plant, name: str, K: Array, L: Array, dK: Array, dL: Array, integrates: bool
) -> tuple[dict[str, Array], dict[str, Array]]:
    """a, b and c from the rotor's matrix of that name and gains, and their derivatives."""
    n, m, e = plant.sizes
    v, d = plant.values, plant.changes
    B, C = v["B"], v["C"]
    a = np.zeros((n + e, n + e), B.dtype)
    a[:n] = -B @ K
    a[:n, :n] += v[name] - L @ C
    da = np.zeros((len(dK), n + e, n + e), B.dtype)
    da[:, :n] = -d["B"] @ K - B @ dK
    da[:, :n, :n] += d[name] - dL @ C - L @ d["C"]
    b, db = np.zeros((n + e, m), B.dtype), np.zeros((len(dK), n + e, m), B.dtype)
    b[:n], db[:, :n] = L, dL
    if e and integrates:
        b[n:], db[:, n:] = v["E"], d["E"]
    return {"a": a, "b": b, "c": -K}, {"a": da, "b": db, "c": -dK}
