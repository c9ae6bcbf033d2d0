"""A law whose weights are design variables: its gains as symbols, and their values and derivatives as numbers.

No expression leads from weights to gains. The model therefore holds a symbol for each entry of the law, and the chain rule joins the
model's derivatives with those of the Riccati equations.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import casadi as ca
import numpy as np

from ..errors import ModelError, SolveError
from ..spec.controller import LQG, Matrices, StateSpace
from ..spec.machine import Machine
from .design import hardware_of
from .lqg import LAW, law_of
from .plant import PlantFamily
from .reduction import Array, basis_of

PARTS = ("law", "cross", "law_rate", "cross_rate")
"""Of a `StateSpace`, in the order of the numbers."""


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
        law = machine.controller
        if not isinstance(law, LQG):
            raise ModelError(f"{nominal.name} has no LQG controller to tune")
        basis = basis_of(nominal, law.modes)
        self._name, self._scheduled, self._cross = nominal.name, law.scheduled, basis.complex_form
        self._plant = PlantFamily(p, machine, basis)
        speed = ca.SX(law.design_speed)
        self._speed = ca.Function("speed", [p], [speed, ca.jacobian(speed, p)])
        self._integrals = 0 if law.integral is None else self._plant.shapes["B"][1]
        n, m = self._plant.shapes["B"]
        size = n + self._integrals
        shapes = {"a": (size, size), "b": (size, m), "c": (m, size)}
        symbols: list[ca.SX] = []
        sides = []
        for part in range(2 if law.scheduled else 1):
            for _ in range(2 if self._cross else 1):
                matrices = {}
                for name in LAW:
                    rows, columns = shapes[name]
                    free = (
                        n if name == "a" or (name == "b" and part == 1) else rows
                    )  # integrals follow what is sensed alone
                    entries = ca.SX.sym(f"{name}{len(symbols)}", free, columns)
                    symbols.append(ca.vec(entries))
                    matrices[name] = ca.vertcat(entries, ca.SX(rows - free, columns))
                sides.append(Matrices(**matrices))
        self.numbers = ca.vertcat(*symbols)
        names = [
            name for name in PARTS if (self._cross or "cross" not in name) and (law.scheduled or "rate" not in name)
        ]
        parts = dict(zip(names, sides, strict=True))
        self.machine = replace(machine, controller=StateSpace(**hardware_of(law), **parts))

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
            law = law_of(plant, float(speed[0, 0]), moves[0], self._scheduled)
        except SolveError as error:
            raise SolveError(f"{self._name}: {error}") from None
        n = plant.sizes[0]
        values = np.concatenate(list(self._flat(law.constant, law.rate, n)))
        slopes = np.concatenate(list(self._flat(law.d_constant, law.d_rate, n)), axis=-1)
        return values, slopes.T

    def _flat(self, constant: dict[str, Array], rate: dict[str, Array], n: int) -> Iterator[Array]:
        """Entries in the order of the numbers, along the last axis."""
        for part, matrices in enumerate((constant, rate)[: 2 if self._scheduled else 1]):
            for side in (np.real, np.imag)[: 2 if self._cross else 1]:
                for name in LAW:
                    x = side(matrices[name])
                    free = n if name == "a" or (name == "b" and part == 1) else x.shape[-2]
                    kept = x[..., :free, :].swapaxes(-1, -2)  # column by column, as CasADi has it
                    yield kept.reshape(*kept.shape[:-2], -1)
