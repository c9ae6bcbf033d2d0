"""How the levitated rotor answers a force step and a shock of its base: the linear closed loop, in closed form.

Displacements and currents are sums of exponentials, one a mode, and exact at every instant; peaks are refined between samples.
The largest displacement of any watched place is the peak; the response has settled once all of them stay within a part
of that peak around their final places. With integral action at a magnet the final place is the centre, without it is not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import ModelError, SpecError
from ..spec.machine import Machine
from ..spec.parts import place, stations
from ..threads import one_thread
from . import places
from .exponentials import History, Piece, half_sine, settled_after, step
from .modal import ModalLoop, Signals
from .modes import whirls
from .scan import zoomed
from .system import Array, System, system

NEARLY = 0.98
"""With 24 samples a period, maxima lie less than one per cent above the samples around them."""

SETTLED = 0.05
"""A response has settled once it stays within this part of its peak around its final value."""


class Watched:
    """Displacements of some places and the control currents, as outputs of a closed loop.

    Parameters
    ----------
    modal : ModalLoop
    extra : mapping of str to float
        Places to watch beside magnets and disks [m].

    Attributes
    ----------
    places : tuple of str
    positions : tuple of float [m]
    currents : tuple of str
        Names of the magnets' axes.
    leave : ndarray, shape (outputs, n)
        Outputs for unit modes.
    """

    def __init__(self, modal: ModalLoop, extra: dict[str, float]):
        loop = modal.loop
        known = stations(loop.machine, ("magnets", "disks"))
        taken = [position for _, position in known]
        known += [(name, position) for name, position in extra.items() if position not in taken]
        if not known:
            raise ModelError(f"{loop.machine.name} has neither magnets nor disks to watch")
        self._loop = loop
        self.places, self.positions = tuple(n for n, _ in known), tuple(x for _, x in known)
        moved = np.concatenate([modal.motion(x) for x in self.positions])
        self._moved = len(moved)
        self._signals = Signals.of(loop)
        self.leave = np.concatenate([moved, self._signals.currents @ modal.right])
        self.currents = self._signals.axis_currents(loop, np.zeros(len(self._signals.names)))[1]

    def split(self, outputs: Array) -> tuple[Array, Array]:
        """Outputs that are displacements, and those that are currents."""
        return outputs[: self._moved], outputs[self._moved :]

    def each(self, displacement: float, current: float) -> Array:
        """One number for each output; tiny ones in place of zero, where nothing moves."""
        counts = self._moved, len(self.leave) - self._moved
        return np.asarray(np.maximum(np.repeat([displacement, current], counts), np.finfo(float).tiny))

    def displacements(self, outputs: Array) -> Array:
        """v and w of the places [m], shape (places, 2, times), from outputs (outputs, times)."""
        moved = self.split(outputs)[0]
        if self._loop.complex_form:
            return np.stack([moved.real, moved.imag], axis=1)
        return np.asarray(moved.real.reshape(len(self.places), 2, -1))

    def axis_currents(self, outputs: Array) -> Array:
        """Control currents of the physical axes [A], shape (axes, times)."""
        return self._signals.axis_currents(self._loop, self.split(outputs)[1])[0]


@dataclass(frozen=True)
class Response:
    """Result of `force_step` and `base_shock`: displacements relative to the base, and control currents, from t = 0 on.

    Attributes
    ----------
    speed : float
        Spin speed [rad/s].
    peaks : ndarray, shape (places,)
        Largest radius of each place [m].
    peak_time : float
        When the largest of them occurs [s]; infinite if it is approached in the end.
    settling_time : float
        From then on every place stays within `settled` times the peak around its final one [s].
    settled : float
    peak_current : float
        Largest control current of any axis [A], those at the end included; zero without control loops.
    final : ndarray, shape (places, 2)
        Where the places come to rest, v and w [m].
    watched : Watched
        With the names of ``places`` and ``currents``.
    history : History
    machine : Machine
    """

    speed: float
    peaks: Array
    peak_time: float
    settling_time: float
    settled: float
    peak_current: float
    final: Array
    watched: Watched = field(repr=False)
    history: History = field(repr=False)
    machine: Machine = field(repr=False)

    @property
    def peak(self) -> float:
        """Largest radius of any place [m]."""
        return float(self.peaks.max())

    @property
    def peak_place(self) -> str:
        """Where it occurs."""
        return self.watched.places[int(self.peaks.argmax())]

    @property
    def ringing_time(self) -> float:
        """From then on the whirling modes together move no place by more than `settled` times the peak [s], a bound.

        What is left then creeps, as the integral of a controller does.
        """
        last = self.history.pieces[-1]
        moving = np.flatnonzero(whirls(last.exponents))
        coefficients = self.watched.split(last.coefficients)[0][:, moving]
        if not coefficients.any():
            return 0.0
        part = Piece(last.start, last.stop, last.exponents[moving], coefficients)
        return last.start + settled_after(part, np.full(len(coefficients), self.settled * self.peak))

    def displacements(self, times: Sequence[float] | Array) -> Array:
        """Displacements v and w of the places [m], shape (times, places, 2).

        Parameters
        ----------
        times : array_like [s]
        """
        values = self.history.at(np.asarray(times, float))
        return np.moveaxis(self.watched.displacements(values), 2, 0)

    def axis_currents(self, times: Sequence[float] | Array) -> Array:
        """Control currents of the magnets' axes [A], shape (times, axes).

        Parameters
        ----------
        times : array_like [s]
        """
        return self.watched.axis_currents(self.history.at(np.asarray(times, float))).T


@one_thread
def force_step(
    machine: Machine | System,
    at: str | float,
    force: float,
    speed: float = 0.0,
    *,
    angle: float = 0.0,
    settled: float = SETTLED,
) -> Response:
    """Response to a force that begins at t = 0 and stays.

    Parameters
    ----------
    machine : Machine or System
    at : str or float
        Where it acts: ``"disk 2"``, ``"magnets[0]"``, or a position [m].
    force : float [N]
    speed : float
        Spin speed [rad/s].
    angle : float
        Direction of the force, from y towards z [rad].
    settled : float
        Part of the peak within which the response counts as settled.

    Returns
    -------
    Response
        Of magnets, disks and the place where the force acts.

    Raises
    ------
    SpecError
        If there is no such place, or a number makes no sense.
    ModelError
        If the machine is not stable at this speed.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    _check(force, "force", "give newtons")
    position = place(loop.machine, at)
    modal = ModalLoop(loop, speed)
    modal.require_stable()
    watched = Watched(modal, {at if isinstance(at, str) else f"x = {at:g} m": position})
    loads = force * modal.load(places.force(loop, position, angle))
    return _measured(modal, watched, step(watched.leave, loads, modal.values), settled)


@one_thread
def base_shock(
    machine: Machine | System,
    acceleration: float,
    duration: float | None = None,
    speed: float = 0.0,
    *,
    angle: float = 0.0,
    settled: float = SETTLED,
) -> Response:
    """Response to an acceleration of the base, which carries magnets, sensors and bearings.

    Parameters
    ----------
    machine : Machine or System
    acceleration : float
        Its largest value [m/s^2].
    duration : float, optional
        Of a half-sine pulse [s]; a step that stays if left out.
    speed : float
        Spin speed [rad/s].
    angle : float
        Direction of the acceleration, from y towards z [rad].
    settled : float
        Part of the peak within which the response counts as settled.

    Returns
    -------
    Response
        Of magnets and disks, relative to the base.

    Raises
    ------
    SpecError
        If a number makes no sense.
    ModelError
        If the machine is not stable at this speed, or has neither magnets nor disks.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    _check(acceleration, "acceleration", "give m/s^2")
    if duration is not None:
        _check(duration, "duration", "give the length of the pulse in s, or leave it out for a step")
    modal = ModalLoop(loop, speed)
    modal.require_stable()
    watched = Watched(modal, {})
    loads = -acceleration * modal.load(places.inertia(loop, angle))
    if duration is None:
        history = step(watched.leave, loads, modal.values)
    else:
        history = half_sine(watched.leave, loads, modal.values, duration)
    return _measured(modal, watched, history, settled)


def _check(number: float, name: str, remedy: str) -> None:
    if not 0.0 < number < math.inf:
        raise SpecError("must be positive", field=name, got=number, remedy=remedy)


def _measured(modal: ModalLoop, watched: Watched, history: History, settled: float) -> Response:
    """Peaks and settling time of a history."""
    if not 0.0 < settled < 1.0:
        raise SpecError("must lie between 0 and 1", field="settled", got=settled, remedy="0.05 stands for 5 %")
    final = watched.displacements(history.final[:, None])[:, :, 0]

    def radii(t: Array) -> Array:
        return np.asarray(np.linalg.norm(watched.displacements(history.at(t)), axis=1))

    def away(t: Array) -> Array:
        moved = watched.displacements(history.at(t))
        return np.asarray(np.linalg.norm(moved - final[:, :, None], axis=1).max(axis=0))

    def current(t: Array) -> Array:
        return np.asarray(np.abs(watched.axis_currents(history.at(t))).max(axis=0, initial=0.0))

    carried = float(np.abs(watched.axis_currents(history.final[:, None])).max(initial=0.0))
    sums = np.max([np.abs(p.coefficients).sum(axis=1) for p in history.pieces], axis=0)
    bands = settled * watched.each(float(watched.split(sums)[0].max()), float(watched.split(sums)[1].max(initial=0.0)))
    while True:  # the bands are known once the peaks are
        windows = [(t, *_sizes(watched, y, final)) for t, y in history.scan(bands)]
        times, radius, off, driven = (np.concatenate([w[k] for w in windows], axis=-1) for k in range(4))
        peak = max(float(radius.max()), float(np.linalg.norm(final, axis=1).max()))
        wanted = settled * watched.each(peak, max(float(driven.max()), carried))
        if (bands <= wanted).all():
            break
        bands = 0.9 * wanted
    found = [_refined(times, row, lambda t, k=k: radii(t)[k]) for k, row in enumerate(radius)]  # type: ignore[misc]
    rests = np.linalg.norm(final, axis=1)
    peaks = np.maximum([value for value, _ in found], rests)
    worst = int(np.argmax(peaks))
    return Response(
        speed=modal.speed,
        peaks=peaks,
        peak_time=found[worst][1] if found[worst][0] >= rests[worst] else math.inf,
        settling_time=_last_above(times, off, settled * float(peaks.max()), away),
        settled=settled,
        peak_current=max(_refined(times, driven, current)[0], carried),
        final=final,
        watched=watched,
        history=history,
        machine=modal.loop.machine,
    )


def _sizes(watched: Watched, outputs: Array, final: Array) -> tuple[Array, Array, Array]:
    """Radius of each place, largest distance from the final places, largest current."""
    moved = watched.displacements(outputs)
    away = np.linalg.norm(moved - final[:, :, None], axis=1).max(axis=0)
    return (
        np.linalg.norm(moved, axis=1),
        away,
        np.abs(watched.axis_currents(outputs)).max(axis=0, initial=0.0),
    )


def _refined(times: Array, table: Array, function: Callable[[Array], Array]) -> tuple[float, float]:
    """Largest value and its time, between the samples around the largest sample."""
    k = int(np.argmax(table))
    ends = times[[max(k - 1, 0)]], times[[min(k + 1, len(times) - 1)]]
    t = zoomed(function, *ends)
    return float(function(t)[0]), float(t[0])


def _last_above(times: Array, off: Array, band: float, function: Callable[[Array], Array]) -> float:
    """When a distance falls below a band for good."""
    above = np.flatnonzero(off > band)
    low, k = (float(times[above[-1]]), int(above[-1])) if len(above) else (0.0, 0)
    # A maximum between two samples may exceed the band where its neighbours do not.
    inner = np.flatnonzero((off[1:-1] >= off[:-2]) & (off[1:-1] >= off[2:]) & (off[1:-1] > NEARLY * band)) + 1
    inner = inner[inner > k]
    tops = zoomed(function, times[inner - 1], times[inner + 1])
    higher = np.flatnonzero(function(tops) > band)
    if len(higher):
        low, k = float(tops[higher[-1]]), int(inner[higher[-1]])
    elif not len(above):
        return 0.0
    high = float(times[min(k + 1, len(times) - 1)])
    for _ in range(40):
        middle = (low + high) / 2.0
        low, high = (middle, high) if function(np.array([middle]))[0] > band else (low, middle)
    return high
