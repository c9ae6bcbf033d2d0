"""A law whose weights are design variables: its gains as symbols, and their values and derivatives as numbers.

No expression leads from weights to gains. The model therefore holds a symbol for each entry of the law, and the chain rule joins the
model's derivatives with those of the Riccati equations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError, SolveError
from ..spec.controller import LQG, Matrices, StateSpace
from ..spec.machine import Machine
from .design import hardware_of
from .lqg import LAW, law_of
from .plant import PlantFamily
from .reduction import Array, basis_of
from .truncation import truncated

PARTS = ("law", "cross", "law_rate", "cross_rate")
"""Of a `StateSpace`: real and imaginary part, then what a rad/s adds to each."""


class TunedLaw:
    """The law of a machine in terms of variables.

    Parameters
    ----------
    p : casadi.SX
        Column of the variables.
    machine : Machine
        With expressions in p, and an LQG controller.
    nominal : Machine
        Numbers only: the rotor whose modes the law knows.

    Attributes
    ----------
    numbers : casadi.SX
        Column of the law's entries.
    machine : Machine
        With these in a `StateSpace`.
    """

    def __init__(self, p: ca.SX, machine: Machine, nominal: Machine):
        law, own = machine.controller, nominal.controller
        if not (isinstance(law, LQG) and isinstance(own, LQG)):
            raise ModelError(f"{nominal.name} has no LQG controller to tune")
        basis = basis_of(nominal, law.modes)
        self._name, self._scheduled = nominal.name, law.scheduled
        self._plant = PlantFamily(p, machine, basis, own)
        speed = ca.SX(law.design_speed)
        self._speed = ca.Function("speed", [p], [speed, ca.jacobian(speed, p)])
        n, m = self._plant.shapes["B"]
        self._order = law.order
        if law.order is not None:
            n = law.order * basis.planes
        size = n + (0 if law.integral is None else m)
        shapes = {"a": (size, size), "b": (size, m), "c": (m, size)}
        # Integrals follow what is sensed alone, whatever the gains and the speed.
        self._entries = [
            (rate, imaginary, name, n if name == "a" or (name == "b" and rate) else shapes[name][0])
            for rate in range(2 if law.scheduled else 1)
            for imaginary in range(2 if basis.complex_form else 1)
            for name in LAW
        ]
        symbols = [ca.SX.sym(f"{name}{k}", rows, shapes[name][1]) for k, (*_, name, rows) in enumerate(self._entries)]
        self.numbers = ca.vertcat(*[ca.vec(x) for x in symbols])
        parts: dict[str, dict[str, ca.SX]] = {}
        for (rate, imaginary, name, rows), x in zip(self._entries, symbols, strict=True):
            below = ca.SX(shapes[name][0] - rows, x.shape[1])
            parts.setdefault(PARTS[2 * rate + imaginary], {})[name] = ca.vertcat(x, below)
        matrices: dict[str, Any] = {part: Matrices(**found) for part, found in parts.items()}
        self.machine = replace(machine, controller=StateSpace(**hardware_of(law), **matrices))

    def at(self, p: Array) -> tuple[Array, Array]:
        """Values of the numbers, and their derivatives.

        Parameters
        ----------
        p : ndarray, shape (variables,)

        Returns
        -------
        values : ndarray, shape (k,)
        slopes : ndarray, shape (k, variables)

        Raises
        ------
        SolveError
            If there is no such law.
        """
        speed, moves = (x.full() for x in self._speed(p))
        plant = self._plant.at(p)
        try:
            if self._order is not None:
                plant = truncated(plant, float(speed[0, 0]), moves[0], self._order)
            law = law_of(plant, float(speed[0, 0]), moves[0], self._scheduled)
        except SolveError as error:
            raise SolveError(f"{self._name}: {error}") from None
        values = np.concatenate(list(self._flat(law.constant, law.rate)))
        slopes = np.concatenate(list(self._flat(law.d_constant, law.d_rate)), axis=-1)
        return values, slopes.T

    def _flat(self, *parts: dict[str, Array]) -> Iterator[Array]:
        """Entries in the order of the numbers, along the last axis."""
        for rate, imaginary, name, rows in self._entries:
            x = (np.imag if imaginary else np.real)(parts[rate][name])
            kept = x[..., :rows, :].swapaxes(-1, -2)  # column by column, as CasADi has it
            yield kept.reshape(*kept.shape[:-2], -1)
