"""One design under the conditions of a comparison. Nothing is computed before it is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.campbell import Campbell, campbell
from ..analysis.critical import critical_speeds
from ..analysis.disturbance import Response, base_shock, force_step
from ..analysis.margins import Margins, margins
from ..analysis.modes import OVERDAMPED, whirls
from ..analysis.noise import noise_current
from ..analysis.sampled_limit import sampled_stability_limit
from ..analysis.sensitivity import Sensitivity
from ..analysis.stability import FOUND, NONE, StabilityLimit
from ..analysis.system import Array, System, dense
from ..analysis.unbalance import UnbalanceResponse, major_axis, unbalance_response
from ..analysis.worst_speed import telling_sensitivities
from ..errors import ModelError
from ..model import strength
from ..optimise.audit import with_pattern
from ..spec.comparison import Conditions
from ..spec.controller import LQR, StateFeedback
from ..spec.machine import Machine
from ..spec.parts import stations
from ..spec.sampling import Sampling
from ..transient.simulate import simulate
from .robustness import Corner, corners, stable_share

SPEEDS = 33
"""Speeds of the operating range at which damping is looked at."""

LOOKED_AT = (0.0, 0.5, 1.0)
"""Parts of the operating range at which sensitivities are looked at in any case; margins, noise and disturbances at both ends."""

LIFTED = 0.5
"""Time that a rotor has to leave its backup bearings [s]."""

LIFT_MODES = 12
"""Modes of the rotor that is lifted, with static correction."""

WHIRL = 240
"""Speeds of the unbalance response, beside the critical ones."""


@dataclass(frozen=True)
class Whirl:
    """Unbalance responses of one design, and the largest of each of their values.

    Attributes
    ----------
    responses : mapping of str to UnbalanceResponse
        By pattern.
    """

    responses: Mapping[str, UnbalanceResponse]

    @staticmethod
    def radii(response: UnbalanceResponse) -> Array:
        """Largest orbit radius of all magnets and disks at each speed [m]."""
        places = [x for _, x in stations(response.machine, ("magnets", "disks"))]
        return np.asarray(np.max([major_axis(response.at(x)) for x in places], axis=0))

    @staticmethod
    def currents(response: UnbalanceResponse) -> Array:
        """Largest amplitude of all control currents at each speed [A]."""
        return np.asarray(response.peak_currents.max(axis=1, initial=0.0))

    @property
    def largest_radius(self) -> float:
        """Over speeds and patterns [m]."""
        return max(float(self.radii(r).max()) for r in self.responses.values())

    @property
    def largest_current(self) -> float:
        """Over speeds and patterns [A]."""
        return max(float(self.currents(r).max()) for r in self.responses.values())

    def largest_share(self, machine: Machine) -> float:
        """Largest control current over the bias current of its magnet."""
        bias = [m.bias_current for m in machine.magnets]
        if not bias or any(b is None for b in bias):
            raise ModelError(f"{machine.name} has magnets without a bias current")
        return max(float((r.peak_currents / np.array(bias, float)).max()) for r in self.responses.values())


class Assessment:
    """A design and what it is measured by.

    Parameters
    ----------
    name : str
        In the comparison.
    machine : Machine
        As given.
    loop : System
        Its closed loop.
    limit : StabilityLimit
        Up to the common top speed.
    conditions : Conditions
        Complete.
    seconds : float or None
        CPU time that went into the design.

    Notes
    -----
    What cannot be measured raises a ModelError that says why.
    """

    def __init__(
        self,
        name: str,
        machine: Machine,
        loop: System,
        limit: StabilityLimit,
        conditions: Conditions,
        seconds: float | None,
    ):
        self.name, self.machine, self.loop, self.limit = name, machine, loop, limit
        self.conditions, self._seconds = conditions, seconds
        self.end = float(conditions.speed)

    @property
    def stable_up_to(self) -> float:
        """Certified stable below this speed [rad/s]; zero if unstable at rest or undecided."""
        return self.limit.speed if self.limit.status in (FOUND, NONE) else 0.0

    @property
    def runs(self) -> bool:
        """True if the design is stable throughout the operating range."""
        return self.stable_up_to > self.end or (self.limit.status == NONE and self.stable_up_to >= self.end)

    def require_running(self) -> None:
        """Raise an UnstableError if the design is not stable throughout the operating range."""
        if not self.runs:
            raise UnstableError(f"{self.name} is not stable throughout the operating range")

    @property
    def is_reference(self) -> bool:
        """True for ideal state feedback, which nobody can build: it wins no line."""
        return isinstance(self.machine.controller, LQR | StateFeedback)

    def sampled_limit(self, period: float) -> float:
        """Stability limit with a digital controller that acts one period after it has sampled [rad/s]: a sweep, no certificate."""
        if self.is_reference:
            raise ModelError("ideal state feedback is not sampled")
        found = sampled_stability_limit(self.loop.machine, Sampling(period=period, delay=period), self.limit.top_speed)
        if found.status not in (FOUND, NONE):
            raise UnstableError(found.status)
        return found.speed

    @cached_property
    def damping(self) -> Campbell:
        """Modes over the operating range."""
        return campbell(self.loop, np.linspace(0.0, self.end, SPEEDS), modes=self.conditions.modes, critical=False)

    @property
    def least_damping(self) -> list[dict[str, Any]]:
        """Of each of the first modes: its frequency at rest, least damping ratio, and the speed of that [rad/s, rad/s]."""
        d = self.damping
        seen = [j for j in range(len(d.whirl)) if d.damping_ratios[:, j].min() < OVERDAMPED][: self.conditions.modes]
        out = []
        for j in seen:
            k = int(np.argmin(d.damping_ratios[:, j]))
            out.append(
                {
                    "frequency": float(d.frequencies[0, j]) if whirls(d.eigenvalues[0, j]) else 0.0,
                    "whirl": d.whirl[j],
                    "kind": d.kind[j],
                    "damping_ratio": float(d.damping_ratios[k, j]),
                    "speed": float(d.speeds[k]),
                }
            )
        return out

    @cached_property
    def sensitivities(self) -> tuple[Sensitivity, ...]:
        """At several speeds of the operating range, and where over the range it is worst."""
        self.require_running()
        return telling_sensitivities(self.loop, self.end, LOOKED_AT, self.conditions.sensitivity_up_to or 0.0)

    @cached_property
    def margins(self) -> tuple[Margins, ...]:
        """At rest and at the end of the operating range."""
        self.require_running()
        return tuple(margins(self.loop, s) for s in self._speeds())

    @cached_property
    def noise(self) -> tuple[Array, ...]:
        """Control currents from the sensors' noise at rest and at the end of the operating range, rms of each loop [A]."""
        self.require_running()
        return tuple(noise_current(self.loop, self.conditions.sensor_noise, s) for s in self._speeds())

    @cached_property
    def force_steps(self) -> tuple[Response, ...]:
        """At rest and at the end of the operating range."""
        self.require_running()
        c, f = self.conditions, self.conditions.force_step
        assert f is not None
        return tuple(force_step(self.loop, f.at, f.force, s, angle=f.angle, settled=c.settled) for s in self._speeds())

    @cached_property
    def base_shocks(self) -> tuple[Response, ...]:
        """At rest and at the end of the operating range."""
        self.require_running()
        c, b = self.conditions, self.conditions.base_shock
        assert b is not None
        return tuple(
            base_shock(self.loop, b.acceleration, b.duration, s, angle=b.angle, settled=c.settled)
            for s in self._speeds()
        )

    @cached_property
    def lift_off(self) -> float:
        """Time after which a rotor at rest touches its backup bearings no more, by nonlinear simulation [s]."""
        self.require_running()
        clearances = [m.clearance for m in self.machine.magnets]
        if not clearances or None in clearances:
            raise ModelError(f"{self.machine.name} has no backup bearings, that is magnets with a clearance")
        if not self.machine.operation.gravity:
            raise ModelError(f"{self.machine.name} has no weight to lift")
        run = simulate(self.machine, LIFTED, speed=0.0, modes=LIFT_MODES, start="resting", contact=True)
        touching = np.flatnonzero(run.contact_forces.any(axis=(1, 2)))
        if run.stopped or (len(touching) and touching[-1] == len(run.times) - 1):
            raise ModelError(
                f"{self.machine.name} is still on its backup bearings {LIFTED:g} s after its magnets are switched on"
            )
        return float(run.times[touching[-1]]) if len(touching) else 0.0

    @cached_property
    def whirl(self) -> Whirl:
        """Unbalance responses over the operating range, fine around their peaks."""
        self.require_running()
        patterns = {name: tuple(a) for name, a in (self.conditions.unbalance or {}).items()}
        machines = {name: with_pattern(self.loop.machine, amounts) for name, amounts in patterns.items()}
        if not patterns:
            if not any(d.unbalance for d in self.machine.rotor.disks):
                raise ModelError(f"{self.machine.name} has no unbalance, and the conditions give none")
            machines = {"own": self.loop.machine}
        near = [
            c.speed * (1.0 + k * max(c.damping_ratio, 1e-3))
            for c in critical_speeds(self.loop, self.end)
            for k in np.linspace(-1.0, 1.0, 9)
        ]
        grid = np.unique(
            np.concatenate([np.linspace(self.end / WHIRL, self.end, WHIRL), [s for s in near if 0.0 < s < self.end]])
        )
        return Whirl(
            {name: unbalance_response(System(m, self.loop.plant, self.loop.kept), grid) for name, m in machines.items()}
        )

    @cached_property
    def corners(self) -> tuple[Corner, ...]:
        """Stability limits at all corners of the tolerances."""
        if not self.conditions.tolerances:
            raise ModelError("no tolerances are given")
        if not self.stable_up_to:
            raise UnstableError(f"{self.name} is not stable at rest")
        return tuple(corners(self.machine, self.conditions.tolerances, float(self.conditions.top_speed)))

    @cached_property
    def stable_share(self) -> float:
        """Part of random machines that are stable throughout the operating range."""
        c = self.conditions
        if not (c.tolerances and c.samples):
            raise ModelError("no tolerances or no samples are given")
        if not self.stable_up_to:
            return 0.0
        return stable_share(self.machine, c.tolerances, c.samples, c.seed, self.end)

    @property
    def order(self) -> int:
        """States of all controllers, amplifiers and filters, counted in real numbers."""
        states = self.loop.pencil.A0.shape[0] - 2 * self.loop.displacements
        return states * (2 if self.loop.complex_form else 1)

    def unstable_poles(self, speed: float) -> int:
        """Poles of the controllers by themselves with positive real parts, counted as in `order`."""
        n = 2 * self.loop.displacements
        a0, a1 = dense(self.loop.pencil.A0), dense(self.loop.pencil.A1)
        own = (a0 + speed * a1)[n:, n:]
        values = np.linalg.eigvals(own) if len(own) else np.zeros(0)
        growing = values.real > 1e-9 * max(1.0, float(np.abs(values).max(initial=0.0)))
        return int(growing.sum()) * (2 if self.loop.complex_form else 1)

    @property
    def copper_loss(self) -> float:
        """At bias, of all coils [W]."""
        return float(ca.DM(strength.copper_loss(self.machine)))

    @property
    def bias_current(self) -> float:
        """The largest of any magnet [A]."""
        bias = [float(m.bias_current) for m in self.machine.magnets if m.bias_current is not None]
        if not bias:
            raise ModelError(f"{self.machine.name} has no magnet with a bias current")
        return max(bias)

    @property
    def seconds(self) -> float:
        """CPU time that went into the design [s]."""
        if self._seconds is None:
            raise UnknownError(f"{self.name} has no search behind it")
        return self._seconds

    def _speeds(self, parts: tuple[float, ...] = (0.0, 1.0)) -> list[float]:
        return [part * self.end for part in parts]


class UnknownError(ModelError):
    """Nobody has said it, and it cannot be computed."""


class UnstableError(ModelError):
    """Nothing can be measured where the machine is unstable."""
