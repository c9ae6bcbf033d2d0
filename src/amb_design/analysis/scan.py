"""Roots and maxima of functions that are cheap at many points at once, from a grid that shows their features."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .system import Array

Function = Callable[[Array], Array]

SAME = 1e-10
"""Points closer than this part of themselves are one: conjugate eigenvalues are equal to rounding only."""

POINTS = 9
ROUNDS = 9
"""Each round of a zoom makes its interval four times smaller."""


def distinct(points: Array) -> Array:
    """Ascending points without those that rounding alone tells apart, between which nothing can be bracketed.

    Parameters
    ----------
    points : ndarray
        Not negative.
    """
    ordered = np.unique(points)
    return np.asarray(ordered[np.diff(ordered, prepend=-1.0) > SAME * ordered])


def maximum(function: Function, grid: Array, candidates: int = 8) -> tuple[float, float]:
    """Largest value of a function, and where.

    Parameters
    ----------
    function : callable
        Real values for an array of any shape.
    grid : ndarray, shape (m,)
        Ascending.
    candidates : int
        Local maxima of the grid that are looked into.

    Returns
    -------
    value, place : float
    """
    table = function(grid)
    padded = np.concatenate([[-np.inf], table, [-np.inf]])
    found = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    found = found[np.argsort(-table[found])][:candidates]
    places = zoomed(function, grid[np.maximum(found - 1, 0)], grid[np.minimum(found + 1, len(grid) - 1)])
    places = np.concatenate([places, grid[found]])
    values = function(places)
    k = int(np.argmax(values))
    return float(values[k]), float(places[k])


def zoomed(function: Function, lower: Array, upper: Array) -> Array:
    """Places of maxima between bounds, by closing in on the best of a few points.

    Parameters
    ----------
    function : callable
    lower, upper : ndarray, shape (k,)
    """
    spread, rows = np.linspace(0.0, 1.0, POINTS), np.arange(len(lower))
    best = np.zeros(len(lower), int)
    x = np.stack([lower, upper], axis=1)
    for _ in range(ROUNDS):
        x = lower[:, None] + (upper - lower)[:, None] * spread
        best = np.argmax(function(x.ravel()).reshape(x.shape), axis=1)
        lower, upper = x[rows, np.maximum(best - 1, 0)], x[rows, np.minimum(best + 1, POINTS - 1)]
    return np.asarray(x[rows, best])


def roots(function: Function, grid: Array) -> Array:
    """All sign changes of a function, also those that come in pairs between two points of the grid.

    Parameters
    ----------
    function : callable
        Real values for an array of shape (k,).
    grid : ndarray, shape (m,)
        Ascending; between neighbours the function has at most one extremum.

    Returns
    -------
    ndarray
        Ascending, to about twelve digits.
    """
    table = function(grid)
    side = np.where(table < 0.0, -1.0, 1.0)
    size = np.abs(table)
    near = np.flatnonzero(
        (side[1:-1] == side[:-2]) & (side[1:-1] == side[2:]) & (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    )
    near += 1
    if len(near):  # where it comes closest to zero, it may cross and return
        signs = side[near]
        closest = np.empty(len(near))
        for sign in (-1.0, 1.0):
            those = np.flatnonzero(signs == sign)
            if len(those):
                k = near[those]
                closest[those] = zoomed(lambda x, sign=sign: -sign * function(x), grid[k - 1], grid[k + 1])  # type: ignore[misc]
        grid = np.unique(np.concatenate([grid, closest]))
        side = np.where(function(grid) < 0.0, -1.0, 1.0)
    left = np.flatnonzero(side[1:] != side[:-1])
    lower, upper, below = grid[left], grid[left + 1], side[left]
    for _ in range(60):
        middle = (lower + upper) / 2.0
        same = np.where(function(middle) < 0.0, -1.0, 1.0) == below
        lower, upper = np.where(same, middle, lower), np.where(same, upper, middle)
    return np.asarray((lower + upper) / 2.0)
