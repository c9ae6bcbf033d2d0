"""BFGS with a weak Wolfe line search, which minimises functions that have kinks (Lewis & Overton 2013).

Where gradients jump, BFGS learns large curvature across the kink and goes on along it. The strong Wolfe condition cannot be met
at a kink; the weak one can, by bisection. A box is kept by an exact penalty.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..analysis.system import Array

Function = Callable[[Array], tuple[float, Array]]

PATIENCE = 10
"""Iterations in a row with little progress before the search ends."""

HALVINGS = 50
"""Bisections of one line search."""


@dataclass(frozen=True)
class Minimum:
    """Where a search ended.

    Attributes
    ----------
    x : ndarray
        Inside the box.
    value : float
    converged : bool
        False if evaluations ran out.
    """

    x: Array
    value: float
    converged: bool


def minimise(
    function: Function,
    x: Array,
    lower: Array,
    upper: Array,
    *,
    unit: Array,
    evaluations: int,
    tolerance: float = 1e-9,
    enough: float = -np.inf,
) -> Minimum:
    """Minimise a function over a box.

    Parameters
    ----------
    function : callable
        Value and gradient at a point of the box.
    x : ndarray
        Start.
    lower, upper : ndarray
    unit : ndarray
        Typical change of each variable; the first step is a tenth of it.
    evaluations : int
        Largest number.
    tolerance : float
        Ten iterations that each lower the value by less than this, relatively, end the search.
    enough : float
        So does a value below this.
    """
    spent = 0
    penalty = 0.0

    def boxed(z: Array) -> tuple[float, Array]:
        """The function inside the box, growing outside of it."""
        nonlocal spent
        spent += 1
        inside = np.clip(z * unit, lower, upper)
        value, slope = function(inside)
        out = z - inside / unit
        outside = np.abs(out) > 1e-15 * np.abs(z)
        excess = penalty * float(np.abs(out[outside]).sum())
        return value + excess, np.where(outside, penalty * np.sign(out), slope * unit)

    z = x / unit
    value, slope = boxed(z)
    penalty = max(float(np.linalg.norm(slope)), 1e-6 * abs(value), np.finfo(float).tiny)
    inverse, fresh, idle = np.eye(len(z)), True, 0
    while spent < evaluations and value > enough:
        direction = -inverse @ slope
        rate = float(slope @ direction)
        step = min(1.0, 0.1 / max(float(np.linalg.norm(direction)), 1e-300)) if fresh else 1.0
        found = _line_search(boxed, z, direction, value, rate, step) if rate < 0.0 else None
        if found is None:
            if fresh:  # no descent along the gradient: a minimum, to rounding
                return _end(z, unit, lower, upper, value, True)
            inverse, fresh = np.eye(len(z)), True
            continue
        new_z, new_value, new_slope = found
        idle = idle + 1 if value - new_value < tolerance * max(abs(new_value), 1e-9) else 0
        s, y = new_z - z, new_slope - slope
        z, value, slope = new_z, new_value, new_slope
        if idle >= PATIENCE:
            return _end(z, unit, lower, upper, value, True)
        curvature = float(s @ y)
        if curvature > 0.0:
            if fresh:
                inverse, fresh = np.eye(len(z)) * (curvature / float(y @ y)), False
            image = inverse @ y
            inverse = (
                inverse
                + np.outer(s, s) * (1.0 + float(y @ image) / curvature) / curvature
                - (np.outer(image, s) + np.outer(s, image)) / curvature
            )
    return _end(z, unit, lower, upper, value, value <= enough)


def _line_search(
    function: Function, z: Array, direction: Array, value: float, rate: float, step: float
) -> tuple[Array, float, Array] | None:
    """A point that meets the weak Wolfe conditions, or the lowest one that only descends."""
    below, above = 0.0, np.inf
    kept = None
    for _ in range(HALVINGS):
        point = z + step * direction
        new_value, new_slope = function(point)
        if not new_value < value + 1e-4 * step * rate:
            above = step
        elif float(new_slope @ direction) < 0.9 * rate:
            below, kept = step, (point, new_value, new_slope)
        else:
            return point, new_value, new_slope
        step = 2.0 * step if np.isinf(above) else 0.5 * (below + above)
        if above - below <= 1e-15 * above:
            break
    return kept


def _end(z: Array, unit: Array, lower: Array, upper: Array, value: float, converged: bool) -> Minimum:
    return Minimum(np.clip(z * unit, lower, upper), value, converged)
