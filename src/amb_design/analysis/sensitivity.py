"""ISO 14839-3: peak sensitivity of each control loop, with the others closed, and the open-loop frequency response."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import ModelError
from ..model.loop import Structure
from ..spec.machine import Machine
from ..threads import one_thread
from .certificate import Walk
from .frequency import Loops
from .scan import distinct
from .system import Array, System, ascending, system

ZONES = (("A", 3.0), ("B", 4.0), ("C", 5.0))
"""Upper limits of the peak sensitivity of the zones (ISO 14839-3:2006); zone D lies above."""

CHECKED_TO = 2.0 * math.pi * 2000.0
"""Peaks are sought up to this frequency [rad/s], or three times the speed if that is higher."""


LOWEST = 2.0 * math.pi * 1e-4
"""Peaks are sought from this frequency [rad/s] on, or from well below the slowest pole if that is higher."""

PER_DECADE = 15
"""Frequencies of a net below the slowest oscillation."""


def zone(peak: float, zones: tuple[tuple[str, float], ...] = ZONES) -> str:
    """Zone of ISO 14839-3 of a peak sensitivity.

    Parameters
    ----------
    peak : float
        Largest modulus of the sensitivity function.
    zones : tuple of (str, float)
        Zones of another quantity with their upper limits.

    Returns
    -------
    {"A", "B", "C", "D"}
    """
    return next((name for name, limit in zones if peak < limit), "D")


@dataclass(frozen=True)
class Peak:
    """Largest sensitivity of one loop.

    Attributes
    ----------
    loop : str
        ``"magnets[0] y"``.
    value : float
    frequency : float [rad/s]
    """

    loop: str
    value: float
    frequency: float

    @property
    def zone(self) -> str:
        """Zone of ISO 14839-3."""
        return zone(self.value)


@dataclass(frozen=True)
class Sensitivity:
    """Result of `sensitivity`.

    Attributes
    ----------
    speed : float
        Spin speed [rad/s].
    frequencies : ndarray, shape (m,)
        [rad/s], refined around the resonances.
    loops : tuple of str
        Name of each loop.
    sensitivity : ndarray of complex, shape (m, loops)
        1/(1 + L) of each loop with all others closed.
    open_loop : ndarray of complex, shape (m, loops)
        L of each loop with all others closed, broken at the sensor.
    peaks : tuple of Peak
        One a loop.
    stable : bool
        True if the closed loop is stable at this speed.
    machine : Machine
    """

    speed: float
    frequencies: Array
    loops: tuple[str, ...]
    sensitivity: Array
    open_loop: Array
    peaks: tuple[Peak, ...]
    stable: bool
    machine: Machine = field(repr=False)

    @property
    def worst(self) -> Peak:
        """The largest peak of all loops."""
        return max(self.peaks, key=lambda p: p.value)

    @property
    def zone(self) -> str:
        """Zone of ISO 14839-3 of the worst loop; ``"unstable"`` where the closed loop is, for then the peaks mean nothing."""
        return self.worst.zone if self.stable else "unstable"


@one_thread
def sensitivity(
    machine: Machine | System,
    speed: float = 0.0,
    frequencies: Sequence[float] | Array | None = None,
    highest: float | None = None,
) -> Sensitivity:
    """Sensitivity of each control loop at one spin speed.

    Parameters
    ----------
    machine : Machine or System
    speed : float
        Spin speed [rad/s].
    frequencies : array_like, optional
        Frequencies to tabulate [rad/s]; a logarithmic grid with the loop's own resonances if left out.
    highest : float, optional
        Upper end of the grid [rad/s]; the larger of 2 kHz and three times the speed if left out.

    Returns
    -------
    Sensitivity

    Raises
    ------
    ModelError
        If the machine has no control loop.

    Notes
    -----
    A loop is one axis of one magnet, broken at its sensor while all others stay closed. The values mean something only
    where the closed loop is stable.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    view = Axes(loop, speed)
    e = Walk(loop.A0, loop.A1).at(speed)
    top = max(CHECKED_TO, 3.0 * speed) if highest is None else highest
    grid = telling_frequencies(e.values, top) if frequencies is None else ascending(frequencies)
    table = np.array([view.at(float(w)) for w in grid])
    peaks = [_refine(view, grid, np.abs(table[:, j]), j, name) for j, name in enumerate(view.names)]
    if frequencies is None:  # where nothing happens is not told
        lowest = min(_lowest_told(e.values, top), *(0.3 * p.frequency for p in peaks))
        grid, table = grid[grid >= lowest], table[grid >= lowest]
    return Sensitivity(
        speed=speed,
        frequencies=grid,
        loops=view.names,
        sensitivity=table,
        open_loop=1.0 / table - 1.0,
        peaks=tuple(peaks),
        stable=not (e.values.real > e.uncertainty).any(),
        machine=loop.machine,
    )


def no_loop(plant: Structure) -> str:
    """What is missing where no loop can be opened.

    Parameters
    ----------
    plant : Structure
    """
    return "sensor at which its ideal state feedback could be opened" if plant.blocks else "control loop"


class Axes:
    """Sensitivity of each physical axis at one speed.

    Parameters
    ----------
    loop : System
    speed : float [rad/s]

    Notes
    -----
    In the complex form a disturbance in y alone is half a forward and half a backward one, hence the mean of the complex
    sensitivity at +w and the conjugate of that at -w; y and z are then alike.
    """

    def __init__(self, loop: System, speed: float):
        self.loops = Loops(loop.plant)
        if not self.loops.loops:
            raise ModelError(f"{loop.machine.name} has no {no_loop(loop.plant)}, and so no sensitivity")
        self.speed = speed
        self.complex_form = loop.complex_form
        self.names = tuple(a.name for a in loop.plant.loops)
        self._opened = list(self.loops.loops)

    def at(self, frequency: float) -> Array:
        """Sensitivities of all loops at a frequency."""
        ahead = np.diagonal(self.loops.at(frequency, self.speed).sensitivity)[self._opened]
        if not self.complex_form:
            return np.asarray(ahead)
        back = np.diagonal(self.loops.at(-frequency, self.speed).sensitivity)[self._opened]
        return np.asarray((ahead + back.conj()) / 2.0)


def telling_frequencies(values: Array, top: float, points: int = 300) -> Array:
    """Frequencies between which no peak hides: a net, with more around every mode.

    Parameters
    ----------
    values : ndarray of complex
        Eigenvalues of the closed loop.
    top : float
        The highest [rad/s].
    points : int
        Of the net above the slowest oscillation, evenly on a logarithmic scale.
    """
    usual = _lowest_told(values, top)
    bottom = min(max(1e-3 * float(np.abs(values).min()), LOWEST), usual)
    near, width = np.abs(values.imag), np.abs(values.real)
    around = np.concatenate([near, near - width, near + width])
    slow = np.geomspace(bottom, usual, 1 + math.ceil(PER_DECADE * math.log10(usual / bottom)))
    return distinct(
        np.concatenate([slow, np.geomspace(usual, top, points), around[(around > bottom) & (around < top)]])
    )


def _lowest_told(values: Array, top: float) -> float:
    """Lowest frequency of a table: well below the slowest oscillation."""
    slowest = float(np.abs(values[np.abs(values.imag) > 1.0]).min(initial=top))
    return max(0.03 * slowest, 1e-4 * top)


def _refine(view: Axes, grid: Array, size: Array, j: int, name: str) -> Peak:
    """Polish the highest local maxima of a tabulated sensitivity."""
    from scipy.optimize import minimize_scalar  # imported late: slow to load

    inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])) + 1
    best = Peak(name, float(size.max()), float(grid[int(size.argmax())]))
    for k in inner[np.argsort(-size[inner])][:6]:
        found = minimize_scalar(
            lambda w: -abs(view.at(float(w))[j]),
            bounds=(grid[k - 1], grid[k + 1]),
            method="bounded",
            options={"xatol": 1e-6 * grid[k]},
        )
        if -found.fun > best.value:
            best = Peak(name, float(-found.fun), float(found.x))
    return best


@dataclass(frozen=True)
class SensitivityOverSpeed:
    """Result of `sensitivity_over_speed`.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        Spin speeds [rad/s].
    loops : tuple of str
    peaks : ndarray, shape (m, loops)
        Peak sensitivity of each loop.
    frequencies : ndarray, shape (m, loops)
        Where the peaks lie [rad/s].
    stable : bool
        True if the closed loop is stable at all these speeds.
    machine : Machine
    """

    speeds: Array
    loops: tuple[str, ...]
    peaks: Array
    frequencies: Array
    stable: bool
    machine: Machine = field(repr=False)

    @property
    def worst(self) -> float:
        """Largest peak over all loops and speeds."""
        return float(self.peaks.max())

    @property
    def zone(self) -> str:
        """Zone of ISO 14839-3 of the worst loop at the worst speed; ``"unstable"`` if the closed loop is so anywhere."""
        return zone(self.worst) if self.stable else "unstable"


def sensitivity_over_speed(machine: Machine | System, speeds: Sequence[float] | Array) -> SensitivityOverSpeed:
    """Peak sensitivity of each loop over the spin speed.

    Parameters
    ----------
    machine : Machine or System
    speeds : array_like
        Spin speeds [rad/s].

    Returns
    -------
    SensitivityOverSpeed
    """
    loop = machine if isinstance(machine, System) else system(machine)
    grid = ascending(speeds)
    results = [sensitivity(loop, float(s)) for s in grid]
    return SensitivityOverSpeed(
        speeds=grid,
        loops=results[0].loops,
        peaks=np.array([[p.value for p in r.peaks] for r in results]),
        frequencies=np.array([[p.frequency for p in r.peaks] for r in results]),
        stable=all(r.stable for r in results),
        machine=loop.machine,
    )
