"""From a machine with a law that is given by its weights to the same machine with gains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError, SolveError
from ..spec.controller import LQG, LQR, Chain, Matrices, StateSpace, ideal_law, needs_design
from ..spec.machine import Machine
from ..threads import one_thread
from .lqg import Law, law_of
from .obstacle import WEIGHTS, obstacle
from .plant import PlantFamily
from .reduction import Array, basis_of
from .regulator import state_feedback
from .truncation import truncated


@lru_cache(maxsize=64)
@one_thread
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
        designed for this machine, on its lowest modes and of these on what matters most where it has an order; whatever is changed afterwards, the law stays.

    Raises
    ------
    ModelError
        If a mode cannot be moved by the magnets or seen by the sensors, the controller serves no magnet, or its order is too low or high.
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


def ideal(machine: Machine) -> Machine:
    """A machine of an LQG under its regulator alone: the whole state known, currents without delay and noise.

    Parameters
    ----------
    machine : Machine
        With an LQG controller.

    Returns
    -------
    Machine
        With an LQR of the same weights: what observer, integral action and hardware cost shows beside it.

    Raises
    ------
    SpecError
        If the controller is no LQG.
    """
    return replace(machine, name=f"{machine.name}, ideal regulator", controller=ideal_law(machine.controller))


@one_thread
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
    nothing, speed = np.zeros(0), float(law.design_speed)
    plant = PlantFamily(ca.SX(0, 1), machine, basis_of(machine, law.modes)).at(nothing)
    if law.order is not None:
        try:
            plant = truncated(plant, speed, nothing, law.order)
        except SolveError as error:
            raise ModelError(f"{machine.name}: {error}") from None
    try:
        return law_of(plant, speed, nothing, law.scheduled)
    except SolveError:
        v, speeds = plant.values, (speed, 0.0)[: 1 + law.scheduled]
        reasons = (obstacle(v["A0"] + s * v["A1"], v["B"], v["C"]) for s in speeds)
        raise ModelError(f"{machine.name}: {next(filter(None, reasons), WEIGHTS)}") from None


def _with_gains(law: LQG, found: Law) -> StateSpace:
    cross = np.iscomplexobj(found.constant["a"])
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
