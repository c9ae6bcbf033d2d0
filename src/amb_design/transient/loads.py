"""What acts on the rotor from outside: forces, impulses, a moving base, backup bearings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from ..analysis.system import Array
from ..errors import SpecError
from ..spec.fields import Number, OptionalNumber, Spec, number


@dataclass(frozen=True, kw_only=True)
class Force(Spec):
    """A force on the shaft: a step, a pulse if it stops again, harmonic if it has a frequency."""

    position: Number = number("m", "distance from the left shaft end", domain="nonnegative")
    y: Number = number("N", "component in y (up)", default=0.0)
    z: Number = number("N", "component in z", default=0.0)
    start: Number = number("s", "acts from this time on", default=0.0)
    stop: OptionalNumber = number("s", "acts up to this time; for good if left out", default=None)
    frequency: Number = number("rad/s", "0 for a constant force", domain="nonnegative", default=0.0)
    phase: Number = number("rad", "factor cos(frequency (t - start) + phase)", default=0.0)

    def check(self) -> None:
        if self.stop is not None and self.stop <= self.start:
            raise SpecError("is not after the start", field="stop", got=self.stop, remedy="let the force last")


@dataclass(frozen=True, kw_only=True)
class Impulse(Spec):
    """A blow that changes velocities at once."""

    position: Number = number("m", "distance from the left shaft end", domain="nonnegative")
    y: Number = number("N s", "component in y (up)", default=0.0)
    z: Number = number("N s", "component in z", default=0.0)
    time: Number = number("s", "when", default=0.0)


@dataclass(frozen=True, kw_only=True)
class Shaking(Spec):
    """Harmonic acceleration of the base, y cos(frequency t + phase) and z cos(frequency t + phase)."""

    y: Number = number("m/s^2", "amplitude in y (up)", default=0.0)
    z: Number = number("m/s^2", "amplitude in z", default=0.0)
    frequency: Number = number("rad/s", "frequency", domain="nonnegative")
    phase: Number = number("rad", "phase at t = 0", default=0.0)


@dataclass(frozen=True, kw_only=True)
class BaseMotion:
    """Acceleration of the base by a table, linear in between and zero outside.

    Motions are measured from the base, which all supports and sensors stand on: each mass feels -mass times acceleration.

    Attributes
    ----------
    times : sequence of float, ascending [s]
    y, z : sequence of float
        Accelerations [m/s^2]; zero if left out.
    """

    times: Sequence[float]
    y: Sequence[float] = ()
    z: Sequence[float] = ()

    def __post_init__(self) -> None:
        ascending(self.times, "times")
        for name in ("y", "z"):
            values = getattr(self, name)
            if len(values) and len(values) != len(self.times):
                raise SpecError(
                    f"has {len(values)} entries for {len(self.times)} times", field=name, remedy="give one for each"
                )

    def at(self, start: float, stop: float) -> tuple[float, float, float, float]:
        """Accelerations in y and z at the start of an interval between two entries [m/s^2], and their slopes [m/s^3].

        Parameters
        ----------
        start, stop : float
            The interval [s].
        """
        if start < self.times[0] or stop > self.times[-1]:
            return 0.0, 0.0, 0.0, 0.0
        values = [np.interp([start, stop], self.times, v) if len(v) else np.zeros(2) for v in (self.y, self.z)]
        (y0, y1), (z0, z1) = values
        return float(y0), float(z0), float((y1 - y0) / (stop - start)), float((z1 - z0) / (stop - start))


Disturbance: TypeAlias = Force | Impulse | Shaking | BaseMotion


@dataclass(frozen=True, kw_only=True)
class Contact(Spec):
    """Backup bearings: rings that the shaft touches at the magnets beyond their clearance.

    With penetration d and its rate d': normal force max(0, stiffness d + damping s d'), where s rises smoothly from 0 to 1
    over the first hundredth of the clearance; friction times it against the slip of the shaft's surface, with the sign
    smoothed over slip_speed. Friction drags the shaft sideways (backward whirl); its torque on the spin is left out.
    """

    stiffness: Number = number("N/m", "of a backup bearing and its mount", domain="positive", default=2e7)
    damping: Number = number("N s/m", "during contact", domain="nonnegative", default=2e3)
    friction: Number = number("", "coefficient of dry friction", domain="nonnegative", default=0.1)
    slip_speed: Number = number("m/s", "slip at which friction has 3/4 of its size", domain="positive", default=0.01)


@dataclass(frozen=True)
class Spin:
    """Spin speed over time: constant, or linear between the entries of a table.

    Attributes
    ----------
    times : ndarray [s]
        One entry for a constant speed.
    speeds : ndarray [rad/s]
    """

    times: tuple[float, ...]
    speeds: tuple[float, ...]

    @classmethod
    def of(cls, speed: float | tuple[Sequence[float], Sequence[float]], start: float, stop: float) -> Spin:
        """From a number or a pair (times, speeds) that has to cover the run."""
        if isinstance(speed, int | float):
            if not math.isfinite(speed):
                raise SpecError("must be finite", field="speed", got=speed, remedy="give a speed in rad/s")
            return cls((start,), (float(speed),))
        try:
            times, speeds = (tuple(float(v) for v in part) for part in speed)
        except (TypeError, ValueError):
            raise SpecError(
                "is neither a number nor a pair of tables", field="speed", remedy="give rad/s, or (times, speeds)"
            ) from None
        ascending(times, "speed[0]")
        if len(times) != len(speeds) or not np.isfinite(speeds).all():
            raise SpecError("must hold one finite speed for each time", field="speed[1]", got=f"{len(speeds)} entries")
        if times[0] > start + 1e-12 or times[-1] < stop - 1e-9 * max(stop, 1.0):
            raise SpecError(
                f"covers {times[0]:g} to {times[-1]:g} s, but the run lasts from {start:g} to {stop:g} s",
                field="speed",
                remedy="extend the profile or shorten the run",
            )
        return cls(times, speeds)

    @property
    def constant(self) -> bool:
        """True if the speed never changes."""
        return len(set(self.speeds)) == 1

    @property
    def fastest(self) -> float:
        """Largest size of the speed [rad/s]."""
        return max(abs(s) for s in self.speeds)

    def at(self, t: float) -> tuple[float, float, float]:
        """Angle turned since the first entry [rad], speed and, from t on, its derivative."""
        angles, speeds, rates = self.over(np.array([t]))
        return float(angles[0]), float(speeds[0]), float(rates[0])

    def over(self, times: Array) -> tuple[Array, Array, Array]:
        """The same at many times."""
        start, speed, rate = np.array(self.times), np.array(self.speeds), np.zeros(1)
        turned = np.zeros(1)
        if len(start) > 1:
            rate = np.diff(speed) / np.diff(start)
            turned = np.concatenate([[0.0], np.cumsum(np.diff(start) * (speed[1:] + speed[:-1]) / 2.0)])
        k = np.clip(np.searchsorted(start, times, side="right") - 1, 0, len(rate) - 1)
        tau = times - start[k]
        return turned[k] + (speed[k] + 0.5 * rate[k] * tau) * tau, speed[k] + rate[k] * tau, rate[k]


def ascending(values: Sequence[float], field: str) -> None:
    """Check a table's times: two or more finite numbers, each larger than the one before."""
    table = np.asarray(values, float)
    if table.ndim != 1 or len(table) < 2 or not np.isfinite(table).all() or (np.diff(table) <= 0.0).any():
        raise SpecError("must be two or more finite times, each later than the one before", field=field)
