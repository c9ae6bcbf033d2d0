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


def scales(e: Equations) -> Array:
    """Sizes of all states when the shaft moves by SMALL; modes with equal sizes have equal energies."""
    p = e.plant
    place = SMALL * np.sqrt(np.sum(p.inertia**2) / 2.0)
    quick = np.maximum(p.frequencies, TYPICAL)
    speed = place * TYPICAL * np.maximum(1.0, quick / FAST)
    sizes = [speed / quick, speed, np.ones(e.controllers)]
    for actuator, block in zip(e.actuators, e.blocks, strict=True):
        chain = actuator.chain
        if chain is None:
            continue
        front = 0 if e.sampled else chain.front
        s = 1j * np.logspace(1.0, 4.0, 31)[:, None, None]
        seen = np.concatenate([np.ones_like(s), s], axis=1)
        answer = np.abs(np.linalg.solve(s * np.eye(chain.front) - chain.a, chain.b @ seen))
        command = np.abs(chain.c @ answer + chain.d @ np.abs(seen)).max()
        own = np.full(front + chain.back, SMALL * command)
        own[:front] = SMALL * answer.max(axis=0)[:front, 0]
        sizes[2][block] = np.where(own > 0.0, own, 1.0)
    return np.concatenate(sizes)
