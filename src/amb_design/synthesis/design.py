"""From a machine with a law that is given by its weights to the same machine with gains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError, SolveError
from ..spec.controller import LQG, LQR, Chain, Matrices, StateSpace, needs_design
from ..spec.machine import Machine
from .lqg import Law, law_of
from .plant import PlantFamily
from .reduction import Array, basis_of
from .regulator import state_feedback


@lru_cache(maxsize=64)
def synthesise(machine: Machine) -> Machine:
    """A machine whose controller has gains, whatever it is given by.

    Parameters
    ----------
    machine : Machine
        Numbers only.

    Returns
    -------
    Machine
        With a `StateSpace` in the place of an LQG, a `StateFeedback` in the place of an LQR; others as they are. The law is
        designed for this machine, on its lowest modes; whatever is changed afterwards, the law stays.

    Raises
    ------
    ModelError
        If a mode cannot be moved by the magnets or seen by the sensors, or the controller serves no magnet.
    """
    law = machine.controller
    if not needs_design(law):
        return machine
    if not machine.magnets:
        raise ModelError(f"{machine.name} has no magnet that a controller could act on")
    if isinstance(law, LQR):
        return replace(machine, controller=state_feedback(machine))
    assert isinstance(law, LQG)
    return replace(machine, controller=_with_gains(law, lqg_law(machine)))


def lqg_law(machine: Machine) -> Law:
    """The law of a machine's LQG controller, with the solutions of its Riccati equations.

    Parameters
    ----------
    machine : Machine
        Numbers only.

    Raises
    ------
    ModelError
        As in `synthesise`.
    """
    law = machine.controller
    assert isinstance(law, LQG)
    plant = PlantFamily(ca.SX(0, 1), machine, basis_of(machine, law.modes)).at(np.zeros(0))
    try:
        return law_of(plant, float(law.design_speed), np.zeros(0), law.scheduled)
    except SolveError:
        v, speed = plant.values, float(law.design_speed)
        raise ModelError(_obstacle(machine, v["A0"] + speed * v["A1"], v["B"], v["C"])) from None


def _obstacle(machine: Machine, A: Array, B: Array, C: Array) -> str:
    """Which mode keeps a controller from existing, by the test of Popov, Belevitch and Hautus."""
    values, right = np.linalg.eig(A)
    left = np.linalg.inv(right)
    for k in np.argsort(-values.real):
        moved = np.abs(left[k] @ B).max() * np.linalg.norm(right[:, k])
        seen = np.abs(C @ right[:, k]).max() * np.linalg.norm(left[k])
        for strength, most, what in ((moved, B, "be moved by the magnets"), (seen, C, "be seen by the sensors")):
            if values[k].real > -1e-3 and strength < 1e-9 * np.abs(most).max():
                mode = f"the mode at {abs(values[k].imag) / (2.0 * np.pi):.4g} Hz"
                return f"{machine.name}: {mode} cannot {what}; place them elsewhere or leave the mode to a bearing"
    return f"{machine.name}: no observer and regulator with these weights; weigh displacement, current and noise less differently"


def _with_gains(law: LQG, found: Law) -> StateSpace:
    parts = found.constant, found.rate
    cross = any(np.any(x.imag) for part in parts for x in part.values())
    return StateSpace(
        **hardware_of(law),
        law=_matrices(found.constant, np.real),
        cross=_matrices(found.constant, np.imag) if cross else None,
        law_rate=_matrices(found.rate, np.real) if found.rate else None,
        cross_rate=_matrices(found.rate, np.imag) if found.rate and cross else None,
    )


def hardware_of(chain: Chain) -> dict[str, Any]:
    """The fields of a controller that stand for its hardware.

    Parameters
    ----------
    chain : Chain
    """
    return {f.name: getattr(chain, f.name) for f in fields(Chain)}


def _matrices(parts: dict[str, Array], side: Callable[[Array], Array]) -> Matrices:
    return Matrices(**{name: tuple(map(tuple, side(x).tolist())) for name, x in parts.items()})
