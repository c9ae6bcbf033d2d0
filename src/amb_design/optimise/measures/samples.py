"""What a measure returns: values of one quantity at the places that matter, with exact derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...analysis.system import Array


@dataclass(frozen=True)
class Samples:
    """Values of a quantity.

    Attributes
    ----------
    values : ndarray, shape (k,)
        In the quantity's SI unit.
    slopes : ndarray, shape (k, variables)
        Derivatives with respect to the variables.
    rates : ndarray, shape (k,)
        Derivatives with respect to the end of the range of speeds.
    places : tuple of str
        Where each value is found, in words.
    speeds : ndarray, shape (k,)
        Spin speed of each value [rad/s]; NaN where it has none.
    groups : tuple of str
        Values of the same group at two designs may be the same mode or peak...
    marks : ndarray of complex, shape (k,)
        ... and are where these agree best: the eigenvalue, frequency or speed.
    """

    values: Array
    slopes: Array
    rates: Array
    places: tuple[str, ...]
    speeds: Array
    groups: tuple[str, ...]
    marks: Array

    def __len__(self) -> int:
        return len(self.values)


def joined(samples: Sequence[Samples], variables: int) -> Samples:
    """All samples of several lots.

    Parameters
    ----------
    samples : sequence of Samples
    variables : int
        Number of variables, for the shape where there are no samples.
    """
    return Samples(
        np.concatenate([np.zeros(0), *[s.values for s in samples]]),
        np.concatenate([np.zeros((0, variables)), *[s.slopes for s in samples]]),
        np.concatenate([np.zeros(0), *[s.rates for s in samples]]),
        tuple(place for s in samples for place in s.places),
        np.concatenate([np.zeros(0), *[s.speeds for s in samples]]),
        tuple(group for s in samples for group in s.groups),
        np.concatenate([np.zeros(0, complex), *[s.marks for s in samples]]),
    )


def rpm_text(speed: float) -> str:
    """A speed for tables."""
    return f"{speed * 30.0 / np.pi:.0f} rpm"


def peaks(values: Array) -> Array:
    """Indices of the local maxima of a table, its ends included."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    return np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))


def zoomed(function: Callable[[Array], Array], lower: Array, upper: Array, rounds: int) -> Array:
    """Places of maxima between bounds, by closing in on the best of a few points, and at last by a parabola.

    Parameters
    ----------
    function : callable
        Values for an array of shape (k, points).
    lower, upper : ndarray, shape (k,)
    rounds : int
        Each makes the intervals four times smaller.
    """
    if not len(lower):
        return lower
    spread, rows = np.linspace(0.0, 1.0, 9), np.arange(len(lower))
    for _ in range(rounds):
        x = lower[:, None] + (upper - lower)[:, None] * spread
        best = np.argmax(function(x), axis=1)
        lower, upper = x[rows, np.maximum(best - 1, 0)], x[rows, np.minimum(best + 1, 8)]
    x = lower[:, None] + (upper - lower)[:, None] * spread
    values = function(x)
    best = np.argmax(values, axis=1)
    inner = np.clip(best, 1, 7)
    before, after = (values[rows, inner + k] - values[rows, inner] for k in (-1, 1))
    bend = np.minimum(before + after, -1e-300)
    step = np.where(best == inner, 0.5 * (after - before) / bend, 0.0)
    return np.asarray(x[rows, best] - np.clip(step, -0.5, 0.5) * (x[:, 1] - x[:, 0]))
