"""Peak sensitivity of every loop, from the eigenvalues at hand.

The closed loop's response to a disturbance added to a sensor is a sum over its modes, so that a whole table of
frequencies costs next to nothing once the modes are known; peaks are then refined until they no longer move.
"""

from __future__ import annotations

import numpy as np

from ...analysis.sensitivity import CHECKED_TO, telling_frequencies
from ...analysis.system import Array
from ..state import State
from .samples import Samples, joined, peaks, rpm_text, zoomed

POINTS = 240
"""Frequencies of the net."""

PEAKS = 8
"""Peaks that are followed in each loop at each speed."""

ZOOMS = 5


def sensitivity(
    state: State,
    fractions: Array,
    end: float,
    loops: int,
    complex_form: bool,
    above: float = 0.0,
    up_to: float = 0.0,
    count: int = PEAKS,
) -> Samples:
    """Peaks of the sensitivity functions.

    Parameters
    ----------
    state : State
    fractions : ndarray, shape (s,)
        Speeds as fractions of the end of the range.
    end : float
        End of the range [rad/s].
    loops : int
        Number of control loops.
    complex_form : bool
        Then a physical axis sees the mean of the forward and the backward sensitivity.
    above : float
        Lower peaks are left out, except for the highest.
    up_to : float
        Highest frequency [rad/s], where that is above the standard's.
    count : int
        Largest number of peaks of a loop at a speed.
    """
    views = [_View(state, float(f), end, loops, complex_form) for f in fractions]
    found = [_peaks(view, j, above, max(CHECKED_TO, up_to), count) for view in views for j in range(loops)]
    return joined(found, state.member.family.parameters)


def heights(state: State, fractions: Array, end: float, loops: int, complex_form: bool, up_to: float) -> Array:
    """Highest peak of each loop at each speed, shape (s, loops): for a look, without derivatives.

    Parameters
    ----------
    state, fractions, end, loops, complex_form, up_to
        As for `sensitivity`.
    """
    out = np.empty((len(fractions), loops))
    for k, fraction in enumerate(fractions):
        view = _View(state, float(fraction), end, loops, complex_form)
        top = max(CHECKED_TO, up_to, 3.0 * view.speed)
        out[k] = [np.abs(view.at(_tops(view, j, top, 0.0, 1), j)).max() for j in range(loops)]
    return out


class _View:
    """Sensitivities at one speed."""

    def __init__(self, state: State, fraction: float, end: float, loops: int, complex_form: bool):
        self.state, self.fraction, self.speed, self.complex_form = state, fraction, fraction * end, complex_form
        spectra = state.spectra(np.array([self.speed]))
        self.values, self.right, self.left = spectra.values[0], spectra.right[0], spectra.left[0]
        f, g, c = state.ports
        self.enter, self.rate, self.leave = self.left @ f, self.left @ g, c[:loops] @ self.right

    def complex_at(self, w: Array, loop: int) -> Array:
        """Sensitivity of a loop at frequencies of either sign."""
        modes = 1.0 / (1j * w[:, None] - self.values)
        enter, rate = (modes @ (self.leave[loop] * x[:, loop]) for x in (self.enter, self.rate))
        return np.asarray(1.0 + enter + 1j * w * rate)

    def at(self, w: Array, loop: int) -> Array:
        """Sensitivity of a physical axis at positive frequencies."""
        ahead = self.complex_at(w, loop)
        return np.asarray((ahead + self.complex_at(-w, loop).conj()) / 2.0) if self.complex_form else ahead

    def frequency_rates(self, w: Array, loop: int) -> Array:
        """Derivatives of the complex sensitivity with respect to the frequency."""
        s = 1j * w[:, None]
        outer = self.leave[loop] / (s - self.values)
        inner = self.rate[:, loop] - (self.enter[:, loop] + s * self.rate[:, loop]) / (s - self.values)
        return np.asarray(1j * (outer * inner).sum(axis=1))

    def slopes(self, w: Array, loop: int) -> tuple[Array, Array]:
        """Derivatives of the complex sensitivity with respect to variables and speed."""
        s = 1j * w[:, None]
        inner = (self.enter[:, loop] + s * self.rate[:, loop]) / (s - self.values)
        outer = self.leave[loop] / (s - self.values)
        x, y = inner @ self.right.T, outer @ self.left
        full_x, full_y = self.state.lifted(x, y)
        speeds = np.full(len(w), self.speed)
        slopes = self.state.forms(full_y, full_x, 1j * w, speeds)
        member = self.state.member
        unit = np.zeros((len(w), member.family.shapes["F"][1]))
        unit[:, loop] = 1.0
        slopes = slopes + member.form("F", full_y, unit) + s * member.form("G", full_y, unit)
        row = np.zeros((len(w), member.family.shapes["C"][0]))
        row[:, loop] = 1.0
        slopes = slopes + member.form("C", row, full_x)
        return slopes, self.fraction * ((y @ self.state.a1) * x).sum(axis=1)


def _tops(view: _View, loop: int, top: float, above: float, count: int) -> Array:
    """Frequencies of the highest peaks: the highest of all, and others above a value."""
    grid = telling_frequencies(view.values, top, POINTS)
    size = np.abs(view.at(grid, loop))
    found = peaks(size)
    found = found[np.argsort(-size[found])][:count]
    found = found[(size[found] >= above) | (np.arange(len(found)) == 0)]
    lower, upper = grid[np.maximum(found - 1, 0)], grid[np.minimum(found + 1, len(grid) - 1)]
    return zoomed(lambda x: np.abs(view.at(x.ravel(), loop)).reshape(x.shape), lower, upper, ZOOMS)


def _peaks(view: _View, loop: int, above: float, least: float, count: int) -> Samples:
    top = max(least, 3.0 * view.speed)
    w = _tops(view, loop, top, above, count)
    value = view.at(w, loop)
    slopes, rates = view.slopes(w, loop)
    # A peak stays where the derivative is zero, but at the end of the frequencies it moves with that end.
    moves = 3.0 * view.fraction * ((w >= top * (1.0 - 1e-9)) & (top > least))
    rates = rates + moves * view.frequency_rates(w, loop)
    if view.complex_form:
        back, back_rates = view.slopes(-w, loop)
        back_rates = back_rates - moves * view.frequency_rates(-w, loop)
        slopes, rates = (slopes + back.conj()) / 2.0, (rates + back_rates.conj()) / 2.0
    turn = value.conj() / np.abs(value)
    where = tuple(f"loop {loop} at {x / (2.0 * np.pi):.4g} Hz, {rpm_text(view.speed)}" for x in w)
    speeds, groups = np.full(len(w), view.speed), (f"{view.fraction} {loop}",) * len(w)
    return Samples(np.abs(value), (turn[:, None] * slopes).real, (turn * rates).real, where, speeds, groups, w + 0j)
