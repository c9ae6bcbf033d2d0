"""Time histories that are sums of exponentials, piece by piece: exact at any instant, sampled only as finely as matters."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import SolveError
from .system import Array

PER_PERIOD = 24
"""Samples for each period of the fastest exponential that still matters."""

DROPPED = 1e-3
"""Exponentials that together stay below this part of the band are left out."""

MOST = 1_000_000
"""Samples before a history is given up; it then rings for tens of thousands of periods."""


@dataclass(frozen=True)
class Piece:
    """y(t) = sum of coefficients times exp(exponents (t - start)) from `start` to `stop`.

    Attributes
    ----------
    start, stop : float [s]
    exponents : ndarray of complex, shape (m,) [1/s]
    coefficients : ndarray of complex, shape (outputs, m)
    """

    start: float
    stop: float
    exponents: Array
    coefficients: Array

    def at(self, times: Array, those: Array | slice = slice(None)) -> Array:
        """Values, shape (outputs, times); of some of the exponentials only, if told."""
        waves = np.exp(np.multiply.outer(self.exponents[those], times - self.start))
        return np.asarray(self.coefficients[:, those] @ waves)


@dataclass(frozen=True)
class History:
    """Pieces that follow each other; zero before the first. The last one lasts for ever and decays to its constant part.

    Attributes
    ----------
    pieces : tuple of Piece
    """

    pieces: tuple[Piece, ...]

    @property
    def final(self) -> Array:
        """Where the outputs come to rest, shape (outputs,)."""
        last = self.pieces[-1]
        return np.asarray(last.coefficients[:, last.exponents == 0.0].sum(axis=1))

    def at(self, times: Array) -> Array:
        """Values at any times, shape (outputs, times)."""
        out = np.zeros((len(self.final), len(times)), complex)
        for piece in self.pieces:
            inside = (times >= piece.start) & (times < piece.stop)
            out[:, inside] = piece.at(times[inside])
        return out

    def scan(self, bands: Array) -> Iterator[tuple[Array, Array]]:
        """Follow the outputs until each stays within a band around its end.

        Parameters
        ----------
        bands : ndarray, shape (outputs,)
            Positive; deviations far below them do not matter.

        Yields
        ------
        times : ndarray, shape (k,)
            Ascending from one window to the next; at the last of all, the moduli of the decaying exponentials
            together are below the bands.
        values : ndarray, shape (outputs, k)

        Raises
        ------
        SolveError
            If that takes too many samples.
        """
        spent = 0
        for piece in self.pieces:
            stop = piece.stop if math.isfinite(piece.stop) else piece.start + settled_after(piece, bands)
            size = (np.abs(piece.coefficients) / bands[:, None]).max(axis=0)
            begin = piece.start
            while begin < stop:
                left = size * np.exp(piece.exponents.real * (begin - piece.start))
                order = np.argsort(left)
                matters = order[np.cumsum(left[order]) > DROPPED]
                fastest = float(np.abs(piece.exponents[matters]).max(initial=0.0))
                step = 2.0 * math.pi / PER_PERIOD / fastest if fastest else stop - begin
                # Windows grow with the time that has passed, but stay short enough to notice what has decayed.
                end = min(begin + max(begin - piece.start, 8.0 * PER_PERIOD * step), begin + 4096 * step, stop)
                times = np.linspace(begin, end, max(math.ceil((end - begin) / step), 4) + 1)
                spent += len(times)
                if spent > MOST:
                    raise SolveError(
                        f"the response has not settled after {begin:.3g} s: some mode has almost no damping"
                    )
                yield times, piece.at(times, matters)
                begin = end


def settled_after(piece: Piece, bands: Array) -> float:
    """Time [s] after which the decaying exponentials of a piece sum up to less than its band in every output."""
    decays = piece.exponents.real < 0.0
    rates, size = piece.exponents.real[decays], np.abs(piece.coefficients[:, decays]) / bands[:, None]

    def above(elapsed: float) -> bool:
        return bool((size @ np.exp(rates * elapsed)).max(initial=0.0) > 1.0)

    low, high = 0.0, 1.0 / float(np.abs(piece.exponents).max())
    while above(high):
        low, high = high, 2.0 * high
    for _ in range(30):
        middle = (low + high) / 2.0
        low, high = (middle, high) if above(middle) else (low, middle)
    return high


def step(leave: Array, loads: Array, values: Array) -> History:
    """Response to constant modal loads that begin at t = 0.

    Parameters
    ----------
    leave : ndarray, shape (outputs, n)
        Outputs for unit modes.
    loads : ndarray, shape (n,)
    values : ndarray, shape (n,)
        Eigenvalues, all with negative real parts.
    """
    moving = leave * (loads / values)
    return History((Piece(0.0, math.inf, np.append(values, 0.0), np.column_stack([moving, -moving.sum(axis=1)])),))


def half_sine(leave: Array, loads: Array, values: Array, duration: float) -> History:
    """Response to modal loads times sin(pi t/duration) for 0 < t < duration.

    Parameters
    ----------
    leave, loads, values
        As in `step`.
    duration : float [s]
    """
    w = math.pi / duration
    resonance = w / (w**2 + values**2)
    forced = np.stack([leave @ (loads / (2j * (1j * w - values))), leave @ (loads / (2j * (1j * w + values)))], axis=1)
    during = np.hstack([leave * (loads * resonance), forced])
    after = leave * (loads * resonance * (1.0 + np.exp(values * duration)))
    first = Piece(0.0, duration, np.concatenate([values, [1j * w, -1j * w]]), during)
    return History((first, Piece(duration, math.inf, values, after)))
