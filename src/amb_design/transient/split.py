"""The equations cut in two: a linear part, and what a few quantities q = C x add to it.

x' = (A0 + Omega A1) x + B [u(q, held, speed), signals] - Omega' A2 x. The linear part holds rotor, controllers and amplifiers. The
remainder u holds what is not linear: the force law beyond k_i i + k_s y, contact, currents and rates at their limits, and the
commands of sampled controllers. Where the speed varies and the law follows it, u also holds what the law at an anchor speed lacks.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from .equations import WORKS, Equations
from .scales import scales

NOTHING = 1e-14
"""Of what follows the speed, parts below this fraction of the largest are rounding."""


class Split:
    """The two parts of a machine in motion.

    Parameters
    ----------
    equations : Equations
    varying : bool
        True if the speed varies.

    Attributes
    ----------
    equations : Equations
    A0, A1, A2 : ndarray, shape (size, size)
        The linear part about the centre: constant, by speed, by acceleration of the spin.
    turning : ndarray, shape (n, size)
        Part of A1 that is the rotor's, in the rows of its accelerations.
    B : ndarray, shape (size, inputs)
        Columns of the remainder, then those of the signals.
    C : ndarray, shape (quantities, size)
        From the state to the quantities that remainder and flags need.
    pull, current, change : ndarray, shape (2, axes, size)
        Linear parts of the magnets' forces along their axes, of their currents, and of the rates of these that amplifiers know:
        at rest, and what a rad/s adds.
    remainder : casadi.Function
        Of quantities, held commands, speed, and the anchor that the linear part of the law is for.
    flags : casadi.Function
        Of quantities, held commands and speed.
    count : int
        Number of remainders.
    owners : tuple of int
        For each input, which of `WORKS` it does; -1 for those that act inside controllers.
    """

    def __init__(self, equations: Equations, varying: bool):
        e = self.equations = equations
        n, axes, places = e.plant.size, len(e.actuators), len(e.contact_places)
        state, held, speed, answers, currents, flags = _expressions(e)
        slopes = _slopes(e, ca.vertcat(answers, currents), state, ca.vertcat(held, speed))
        self.pull, self.current, self.change = (
            slopes[:, rows] @ e.quantities
            for rows in (slice(axes), slice(-2 * axes, -axes), slice(slopes.shape[1] - axes, None))
        )
        linear = slopes[:, : answers.shape[0]]
        reach = np.zeros((e.size, answers.shape[0]))
        reach[n : 2 * n, :axes] = e.plant.actuators.T
        reach[n : 2 * n, axes : axes + places] = e.contact_places.T
        reach[2 * n + e.law :, axes + places :] = np.eye(e.amplifiers)
        loops = reach @ linear @ e.quantities
        loops[:, 2 * n : 2 * n + e.law] += e.law_rates
        self._linear(*loops)

        depends: Callable[..., Array] = lambda *what: np.array(ca.which_depends(*what), bool)  # noqa: E731
        bent = depends(answers, ca.vertcat(state, held), 2, True) | depends(answers, held, 1, True)
        rows = np.flatnonzero(bent)
        seen = ca.vertcat(answers[rows.tolist()], flags)
        used = np.flatnonzero(depends(seen, state, 1, False))
        columns, turns = self._following(loops[1]) if varying else (np.zeros((e.size, 0)), np.zeros((0, e.size)))
        q, turned, anchor = state[used.tolist()], ca.SX.sym("turned", len(turns)), ca.SX.sym("anchor")
        known_part = [ca.sparsify(ca.DM(matrix[np.ix_(rows, used)])) for matrix in linear]
        rest = answers[rows.tolist()] - ca.mtimes(known_part[0] + speed * known_part[1], q)
        self.C, self.count = np.vstack([e.quantities[used], turns]), len(rows) + len(turns)
        every, lacking = ca.vertcat(q, turned), ca.vertcat(rest, (speed - anchor) * turned)
        self.remainder = ca.Function("remainder", [every, held, speed, anchor], [ca.densify(lacking)])
        self.flags = ca.Function("flags", [every, held, speed], [ca.densify(flags)])
        loads = np.zeros((e.size, e.load.shape[1]))
        loads[n : 2 * n] = e.load
        self.B = np.hstack([reach[:, rows], columns, loads])
        inside = ["magnets"] * axes + ["contact"] * places + [""] * e.amplifiers
        outside = ["unbalance"] * 2 + ["gravity"] + ["base motion"] * 2 + ["forces"] * len(e.forces)
        names = [inside[k] for k in rows] + ["magnets"] * len(turns) + outside
        self.owners = tuple(WORKS.index(name) if name else -1 for name in names)

    def _linear(self, fixed: Array, following: Array) -> None:
        p = self.equations.plant
        n = p.size
        self.A0, self.A1, self.A2 = fixed, following.copy(), np.zeros_like(fixed)
        self.A0[:n, n : 2 * n] += np.eye(n)
        self.A0[n : 2 * n, : 2 * n] -= np.hstack([p.K0, p.C0])
        self.turning = np.zeros((n, len(fixed)))
        self.turning[:, : 2 * n] = -np.hstack([p.K1, p.C1])
        self.A1[n : 2 * n] += self.turning
        self.A2[n : 2 * n, :n] = p.C1

    def _following(self, following: Array) -> tuple[Array, Array]:
        """What follows the speed in controllers as a product of few columns and rows."""
        size = scales(self.equations)
        left, values, right = np.linalg.svd(following * size / size[:, None])
        few = values > NOTHING * values[0]
        return size[:, None] * left[:, few] * values[few], right[few] / size

    def forms(self, speed: float) -> dict[int, Array]:
        """Symmetric matrices of the powers that are quadratic in the state at a constant speed, by index in `WORKS`."""
        p, n = self.equations.plant, self.equations.plant.size
        rate = np.zeros((n, self.equations.size))
        rate[:, n : 2 * n] = np.eye(n)
        works: dict[str, Any] = {
            "magnets": (p.actuators @ rate).T @ (self.pull[0] + speed * self.pull[1]),
            "damping": -rate.T @ p.C0 @ rate,
            "circulation": -rate.T @ np.hstack([(p.K0 - p.K0.T) / 2.0 + speed * p.K1, np.zeros((n, len(self.A0) - n))]),
        }
        return {WORKS.index(k): (m + m.T) / 2.0 for k, m in works.items() if m.any()}


def _expressions(e: Equations) -> tuple[Any, ...]:
    """Quantities, held commands and speed; of these the forces, contact forces and rates of amplifiers; currents and known rates; flags."""
    sizes = [e.magnets.size1_in(k) for k in range(e.magnets.n_in())]
    state, held, speed = ca.SX.sym("state", sum(sizes[:5])), ca.SX.sym("held", sizes[5]), ca.SX.sym("speed")
    known = state * ca.DM(e.quantities.any(axis=1).astype(float))
    quantities = ca.vertsplit(known, np.cumsum([0, *sizes[:5]]).tolist())
    *answers, current, change, flags = e.magnets(*quantities, held if e.sampled else 0.0 * held, speed)
    return state, held, speed, ca.vertcat(*answers), ca.vertcat(current, change), flags


def _slopes(e: Equations, answers: Any, state: Any, given: Any) -> Array:
    """Derivatives by the quantities about the centre: at rest, and what a rad/s adds, shape (2, answers, quantities)."""
    slope, axes = ca.substitute(ca.jacobian(answers, state), given, ca.DM.zeros(given.shape[0])), len(e.actuators)
    steep = np.array(ca.Function("slope", [state], [slope])(np.zeros(state.shape[0])).full())
    follows = np.zeros_like(steep)  # commands at rest and what a rad/s adds to them count alike
    follows[:, 3 * axes : 4 * axes] = steep[:, 2 * axes : 3 * axes]
    return np.array([steep, follows])
