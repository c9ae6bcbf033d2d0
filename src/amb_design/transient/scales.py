"""Sizes of the states, to which tolerances refer."""

from __future__ import annotations

import numpy as np

from ..analysis.system import Array
from .equations import Equations

SMALL = 1e-5
"""Displacement [m] to which tolerances refer: a tolerance of 1e-6 also means 10 pm."""

TYPICAL = 300.0
"""Frequency [rad/s] that turns displacements into velocities there; faster modes are as precise in energy."""

FAST = 1e4
"""Modes above this frequency [rad/s] are granted the same displacements as one of it; most of them only ring."""


PACES = 1j * np.logspace(1.0, 4.0, 31)[:, None, None]
"""Of the motion that controllers answer to [rad/s]."""


def scales(e: Equations) -> Array:
    """Sizes of all states when the shaft moves by SMALL; modes with equal sizes have equal energies."""
    p = e.plant
    place = SMALL * np.sqrt(np.sum(p.inertia**2) / 2.0)
    quick = np.maximum(p.frequencies, TYPICAL)
    speed = place * TYPICAL * np.maximum(1.0, quick / FAST)
    states, commands = _answers(e)
    amplifiers = np.repeat(commands, [a.states for a in e.actuators])
    own = SMALL * np.concatenate([states[: e.law], amplifiers])
    return np.concatenate([speed / quick, speed, np.where(own > 0.0, own, 1.0)])


def _answers(e: Equations) -> tuple[Array, Array]:
    """Largest states of the controllers, and commands of each axis, for any seen displacement of one, at rest or at top speed."""
    law = e.plant.law
    inputs, found = len(law.sensors), [(np.zeros(law.states), np.zeros(len(e.actuators)))]
    seen = np.concatenate([np.eye(inputs) * np.ones_like(PACES), np.eye(inputs) * PACES], axis=1)
    for speed in (0.0, float(e.machine.operation.top_speed)) if inputs else ():
        a, b, c, d = law.at(speed)
        states = np.linalg.solve(PACES * np.eye(law.states) - a, b @ seen)
        found.append(tuple(np.abs(answer).max(axis=(0, 2)) for answer in (states, c @ states + d @ seen)))
    first, second = (np.max(group, axis=0) for group in zip(*found, strict=True))
    return first, second
