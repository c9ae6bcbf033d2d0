"""One step of the collocation as matrices: inputs that are parabolas in time move the linear part exactly."""

from __future__ import annotations

import math

import numpy as np

from ..analysis.system import Array
from .ladder import MOMENTS, Ladder, blocks

PARABOLA = np.array([[1.0, 0.0, 0.0], [-3.0, 4.0, -1.0], [4.0, -8.0, 4.0]])
"""From values at 0, h/2, h to f, h f' and h^2 f'' at 0."""

BUBBLE = 64.0 / 3.0 * np.array([0.0, 0.5, -1.5, 1.0])
"""The cubic in t/h that vanishes at 0, 1/2 and 1 and is 1 at 1/4, by powers."""


class Step:
    """Matrices of a step from ladder and speed, for scaled states and the inputs at 0, h/2 and h.

    Attributes
    ----------
    move, push : of state and inputs to the state at the end
    place, known, unknown : of the state, the inputs at 0, those at h/2 and h, to the rows at h/2 and h
    quarter : of the state and all inputs to the rows at h/4
    works, velocities : see `Ledger`
    inverse : of the Jacobian in Newton's method, for as long as it serves
    """

    def __init__(self, ladder: Ladder, owners: list[int], rows: Array, h: float):
        n, b = ladder.states, ladder.inputs
        self.h, self.owners, self.inverse = h, owners, np.zeros((0, 0))
        quarter, half, rung = (ladder.at(h * c) for c in (0.25, 0.5, 1.0))  # one makes the next
        nodes = PARABOLA / h ** np.arange(3)[:, None]

        def nodal(matrix: Array) -> Array:  # of values at the nodes instead of derivatives
            return np.concatenate([matrix[..., :n], blocks(matrix[..., n:], nodes)], axis=-1)

        motion = nodal(rung.motion)
        self.move, self.push = np.ascontiguousarray(motion[:, :n]), np.ascontiguousarray(motion[:, n:])
        self.quarter = nodal(rows @ quarter.motion)
        both = np.vstack([nodal(rows @ half.motion), rows @ motion])
        self.place, self.known, self.unknown = (
            np.ascontiguousarray(part) for part in np.split(both, [n, n + b], axis=1)
        )
        self.works = nodal(nodal(rung.works).transpose(0, 2, 1))
        shapes = np.zeros((4, MOMENTS))  # parabolas of the nodes and the bubble, by powers of time
        shapes[:3, :3], shapes[3] = nodes.T, BUBBLE * [math.factorial(j) / h**j for j in range(MOMENTS)]
        self.velocities = np.tensordot(shapes, nodal(rung.moments), 1)
