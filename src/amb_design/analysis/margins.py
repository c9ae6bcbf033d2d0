"""Gain, phase and disk margins of each control loop, with all others closed.

A loop L = 1/S - 1 is broken at its sensor. It is real where S is, and of modulus one where Re S = 1/2, so that all crossings are
roots of bounded functions: no peak of L has to be resolved. The disk margin (Seiler, Packard & Gahinet, IEEE Control Systems
Magazine 40(5), 2020, with skew zero) is alpha = 1/max |S - 1/2| = 2/max |S - T|: the loop stays stable if it is multiplied by
any (1 + d/2)/(1 - d/2) with complex |d| < alpha, hence by any gain between (2 - alpha)/(2 + alpha) and its reciprocal, and
under any phase below 2 atan(alpha/2), and under some of both at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..spec.machine import Machine
from ..threads import one_thread
from .modal import LoopView, ModalLoop, Signals
from .scan import maximum, roots
from .system import Array, System, system

NEGLIGIBLE = 1e-3
"""Where L stays below this modulus nothing is looked for: gain margins above 60 dB, up or down, count as none."""

STATIC = 1e-9
"""A sensitivity below this at frequency zero is that of an integrator: the static gain is infinite."""


@dataclass(frozen=True)
class LoopMargins:
    """Margins of one loop.

    Attributes
    ----------
    loop : str
        ``"magnets[0] y"``.
    gain_up : float
        Smallest factor above one that makes the loop unstable; infinite if none up to 1000 does.
    gain_down : float
        Largest factor below one that makes it unstable; zero if none down to 0.001 does. Levitated rotors fall below some
        gain.
    phase : float
        Smallest lag or lead that makes it unstable [rad]; infinite if none does.
    disk : float
        Disk margin alpha, between 0 and 2.
    gain_up_at, gain_down_at, phase_at, disk_at : float
        Frequencies where that happens [rad/s]; NaN where there is none.
    """

    loop: str
    gain_up: float
    gain_down: float
    phase: float
    disk: float
    gain_up_at: float
    gain_down_at: float
    phase_at: float
    disk_at: float

    @property
    def gain(self) -> float:
        """The smaller of gain_up and 1/gain_down."""
        return min(self.gain_up, 1.0 / self.gain_down if self.gain_down else math.inf)


@dataclass(frozen=True)
class Margins:
    """Result of `margins`.

    Attributes
    ----------
    speed : float
        Spin speed [rad/s].
    loops : tuple of LoopMargins
    machine : Machine
    """

    speed: float
    loops: tuple[LoopMargins, ...]
    machine: Machine = field(repr=False)

    def worst(self, name: str) -> LoopMargins:
        """The loop with the smallest margin.

        Parameters
        ----------
        name : {"gain", "gain_up", "phase", "disk"}
        """
        return min(self.loops, key=lambda m: float(getattr(m, name)))


@one_thread
def margins(machine: Machine | System, speed: float = 0.0) -> Margins:
    """Stability margins of each control loop at one spin speed.

    Parameters
    ----------
    machine : Machine or System
    speed : float
        Spin speed [rad/s].

    Returns
    -------
    Margins
        From all crossings at all frequencies, not only the first.

    Raises
    ------
    ModelError
        If the machine has no control loop or is not stable at this speed.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    signals = Signals.of(loop)
    signals.require_loops(loop)
    modal = ModalLoop(loop, speed)
    modal.require_stable()
    view = LoopView(modal, signals)
    grid = view.grid()
    found = tuple(_margins(lambda w, j=j: view.sensitivity(w, j), grid, name) for j, name in enumerate(view.names))  # type: ignore[misc]
    return Margins(speed, found, loop.machine)


def _margins(s: Callable[[Array], Array], grid: Array, name: str) -> LoopMargins:
    acting = np.flatnonzero(np.abs(s(grid) - 1.0) > NEGLIGIBLE)
    grid = grid[: acting[-1] + 2] if len(acting) else grid[:2]
    place = np.concatenate([[0.0], roots(lambda w: s(w).imag, grid)])
    values = s(place)
    real = values.real
    with np.errstate(divide="ignore", invalid="ignore"):
        factors = np.where(np.abs(values) > STATIC, real / (real - 1.0), np.nan)  # -1/L
    up, up_at = _nearest(factors, place, lambda k: k > 1.0, min, math.inf)
    down, down_at = _nearest(factors, place, lambda k: (k > NEGLIGIBLE) & (k < 1.0), max, 0.0)
    ones = roots(lambda w: s(w).real - 0.5, grid)
    at = s(ones)
    angles = np.pi - np.abs(np.angle((1.0 - at) / at))
    k = int(np.argmin(angles)) if len(angles) else -1
    peak, peak_at = maximum(lambda w: np.abs(s(w) - 0.5), grid)
    return LoopMargins(
        name,
        up,
        down,
        float(angles[k]) if len(angles) else math.inf,
        min(1.0 / peak, 2.0),
        up_at,
        down_at,
        float(ones[k]) if len(angles) else math.nan,
        peak_at,
    )


def _nearest(
    factors: Array, places: Array, inside: Callable[[Array], Array], best: Callable[..., float], none: float
) -> tuple[float, float]:
    chosen = np.flatnonzero(inside(factors))
    if not len(chosen):
        return none, math.nan
    k = best(chosen, key=lambda i: factors[i])
    return float(factors[int(k)]), float(places[int(k)])
