"""The equations cut in two: a linear part, and what a few quantities q = C x add to it.

x' = (A0 + Omega A1) x + B [u(q, held, speed), signals] - Omega' A2 x. The remainder u holds what is not linear: the force law
beyond k_i i + k_s y, contact, currents and rates at their limits, and the commands of sampled controllers.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from .equations import WORKS, Equations


class Split:
    """The two parts of a machine in motion.

    Attributes
    ----------
    equations : Equations
    A0, A1, A2 : ndarray, shape (size, size)
        The linear part about the centre: constant, by speed, by acceleration of the spin.
    B : ndarray, shape (size, inputs)
        Columns of the remainder, then those of the signals.
    C : ndarray, shape (quantities, size)
        From the state to the quantities that remainder and flags need.
    pull, current, change : ndarray, shape (axes, size)
        Linear parts of the magnets' forces along their axes, of their currents, and of the rates of these that amplifiers know.
    remainder, flags : casadi.Function
        Of quantities, held commands and speed.
    count : int
        Number of remainders.
    owners : tuple of int
        For each input, which of `WORKS` it does; -1 for those that act inside controllers.
    """

    def __init__(self, equations: Equations):
        e = self.equations = equations
        n, axes = e.plant.size, len(e.actuators)
        *quantities, held, speed = (ca.SX.sym(f"i{k}", e.magnets.size1_in(k)) for k in range(e.magnets.n_in()))
        state = ca.vertcat(*quantities)
        force, touch, rates, current, change, flags = e.magnets(*quantities, held, speed)
        answers, given = ca.vertcat(force, touch, rates), ca.vertcat(held, speed)
        slope = ca.substitute(
            ca.jacobian(ca.vertcat(answers, current, change), state), given, ca.DM.zeros(given.shape[0])
        )
        law = np.array(ca.Function("law", [state], [slope])(np.zeros(state.shape[0])).full())
        self.pull, self.current, self.change = (
            law[rows] @ e.quantities for rows in (slice(axes), slice(-2 * axes, -axes), slice(len(law) - axes, None))
        )
        law = law[: answers.shape[0]]
        reach = np.zeros((e.size, answers.shape[0]))
        reach[n : 2 * n, :axes] = e.plant.actuators.T
        reach[n : 2 * n, axes : axes + touch.shape[0]] = e.contact_places.T
        reach[2 * n :, axes + touch.shape[0] :] = np.eye(e.controllers)
        self._linear(reach @ law @ e.quantities)

        depends: Callable[..., Array] = lambda *what: np.array(ca.which_depends(*what), bool)  # noqa: E731
        bent = depends(answers, ca.vertcat(state, held), 2, True) | depends(answers, held, 1, True)
        rows = np.flatnonzero(bent)
        seen = ca.vertcat(answers[rows.tolist()], flags)
        used = np.flatnonzero(depends(seen, state, 1, False))
        q = state[used.tolist()]
        rest = answers[rows.tolist()] - ca.mtimes(ca.sparsify(ca.DM(law[np.ix_(rows, used)])), q)
        self.C, self.count = e.quantities[used], len(rows)
        self.remainder = ca.Function("remainder", [q, held, speed], [ca.densify(rest)])
        self.flags = ca.Function("flags", [q, held, speed], [ca.densify(flags)])
        loads = np.zeros((e.size, e.load.shape[1]))
        loads[n : 2 * n] = e.load
        self.B = np.hstack([reach[:, rows], loads])
        inside = ["magnets"] * axes + ["contact"] * touch.shape[0] + [""] * rates.shape[0]
        outside = ["unbalance"] * 2 + ["gravity"] + ["base motion"] * 2 + ["forces"] * len(e.forces)
        names = [inside[k] for k in rows] + outside
        self.owners = tuple(WORKS.index(name) if name else -1 for name in names)

    def _linear(self, loops: Array) -> None:
        p = self.equations.plant
        n = p.size
        self.A0, self.A1, self.A2 = loops, np.zeros_like(loops), np.zeros_like(loops)
        self.A0[:n, n : 2 * n] += np.eye(n)
        self.A0[n : 2 * n, : 2 * n] -= np.hstack([p.K0, p.C0])
        self.A1[n : 2 * n, : 2 * n] = -np.hstack([p.K1, p.C1])
        self.A2[n : 2 * n, :n] = p.C1

    def forms(self, speed: float) -> dict[int, Array]:
        """Symmetric matrices of the powers that are quadratic in the state at a constant speed, by index in `WORKS`."""
        p, n = self.equations.plant, self.equations.plant.size
        rate = np.zeros((n, self.equations.size))
        rate[:, n : 2 * n] = np.eye(n)
        works: dict[str, Any] = {
            "magnets": (p.actuators @ rate).T @ self.pull,
            "damping": -rate.T @ p.C0 @ rate,
            "circulation": -rate.T @ np.hstack([(p.K0 - p.K0.T) / 2.0 + speed * p.K1, np.zeros((n, len(self.A0) - n))]),
        }
        return {WORKS.index(k): (m + m.T) / 2.0 for k, m in works.items() if m.any()}
