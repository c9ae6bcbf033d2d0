"""One axis of a magnet with its amplifier: nonlinear force, and what current, voltage and flux allow.

Current: the amplifier's command and its output stay within the smaller of bias_current and max_current - bias_current.
Voltage: the output i of an amplifier changes no faster than its link allows at either coil of the pair,
    abs(L di/dt + R (i0 + i) + k_u y') <= U  and  abs(-L di/dt + R (i0 - i) - k_u y') <= U,
with L and k_u at the nominal gap. Where no amplifier is given it is ideal: its voltage is reported and not limited.
Flux: that of a pole, B = mu0 N i/(2 g), grows in proportion up to max_flux_density and no further; force is proportional to B^2.
Gap: a twentieth of it is the least that the law sees, lest the force become infinite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..model.loop import Axis
from ..model.magnet import MU0, back_emf_constant, inductance, negative_stiffness
from ..spec.controller import Amplifier
from ..spec.magnet import Magnet

NARROWEST = 0.05
"""Least gap in the force law, as a fraction of the nominal one."""


@dataclass(frozen=True)
class Response:
    """What an axis answers, as CasADi expressions.

    Attributes
    ----------
    force, current : [N], [A]
    rates : derivatives of the amplifier's states
    current_rate : di/dt [A/s] where an amplifier knows it, else None
    saturated : dict
        Of "current", "voltage", "flux": true (1) or false (0).
    """

    force: Any
    current: Any
    rates: Any
    current_rate: Any
    saturated: dict[str, Any]


@dataclass(frozen=True)
class Actuator:
    """A magnet axis. Linear ones, and magnets known by k_i and k_s alone, pull with k_i i + k_s y and have no limits but
    the current's, where bias or largest current are known."""

    magnet: Magnet
    gain: float
    amplifier: Amplifier | None
    linear: bool

    @classmethod
    def of(cls, axis: Axis, amplifier: Amplifier | None, magnet: Magnet, linear: bool) -> Actuator:
        """From an axis of the loop."""
        return cls(magnet, float(ca.DM(axis.current_stiffness)), amplifier, linear)

    @property
    def states(self) -> int:
        """Number of states: of an amplifier its output and the scaled rate of that."""
        return 0 if self.amplifier is None else 2

    @property
    def largest_current(self) -> float:
        """Limit of the control current [A]; infinite if nothing limits it."""
        m = self.magnet
        if self.linear:
            return math.inf
        bias = math.inf if m.bias_current is None else float(m.bias_current)
        return min(bias, math.inf if m.max_current is None else float(m.max_current) - (m.bias_current or 0.0))

    def respond(self, command: Any, amplifier: Any, y: Any, velocity: Any) -> Response:
        """Force and current for a command of the controller [A], without the minus sign of the feedback.

        Parameters
        ----------
        command : scalar expression [A]
        amplifier : column of the amplifier's states, or empty
        y, velocity : of the shaft along the axis [m], [m/s]
        """
        top = self.largest_current
        wanted = clip(command, -top, top)
        saturated: dict[str, Any] = {"current": ca.fabs(command) >= top}
        rates, current_rate = ca.SX(0, 1), None
        if self.amplifier is not None:
            w, damping = float(self.amplifier.bandwidth), float(self.amplifier.damping)
            out, rate = amplifier[0], w * amplifier[1]
            current = -clip(out, -top, top)
            low, high = self._rate_limits(current, velocity)
            current_rate = clip(-rate, low, high)
            rates = ca.vertcat(-current_rate, w * (wanted - out) - 2.0 * damping * rate)
            saturated["current"] = ca.logic_or(saturated["current"], ca.fabs(out) >= top)
            saturated["voltage"] = ca.logic_or(-rate < low, -rate > high)
        else:
            current = -wanted
        force, saturated["flux"] = self._force(current, y)
        return Response(force, current, rates, current_rate, saturated)

    def voltages(self, current: Array, current_rate: Array, velocity: Array) -> Array:
        """Voltages of the two coils of the pair [V], shape (m, 2); zeros for magnets without geometry."""
        m = self.magnet
        if not m.has_geometry:
            return np.zeros((len(current), 2))
        changing = float(inductance(m)) * current_rate + float(ca.DM(back_emf_constant(m))) * velocity
        r, i0 = float(m.resistance or 0.0), float(m.bias_current or 0.0)
        return np.stack([changing + r * (i0 + current), -changing + r * (i0 - current)], axis=1)

    @property
    def limits_voltage(self) -> bool:
        """True if the link's voltage limits the rate of the current."""
        return not self.linear and self.magnet.has_geometry and self.magnet.link_voltage is not None

    def _rate_limits(self, current: Any, velocity: Any) -> tuple[Any, Any]:
        m = self.magnet
        if not self.limits_voltage:
            return -math.inf, math.inf
        u, r = m.link_voltage, m.resistance or 0.0
        moved = float(ca.DM(back_emf_constant(m))) * velocity
        high = u - r * (m.bias_current + current) - moved
        low = -u + r * (m.bias_current - current) - moved
        return low / float(inductance(m)), high / float(inductance(m))

    def _force(self, current: Any, y: Any) -> tuple[Any, Any]:
        """Force [N], and whether a pole is saturated."""
        m = self.magnet
        if self.linear or not m.has_geometry:
            return self.gain * current + float(ca.DM(negative_stiffness(m))) * y, 0
        pulls, full = [], []
        top = math.inf if m.max_flux_density is None else float(m.max_flux_density)
        for sign in (1.0, -1.0):
            gap = ca.fmax(m.gap - sign * y, NARROWEST * m.gap)
            flux = MU0 * m.turns * (m.bias_current + sign * current) / (2.0 * gap)
            pulls.append(ca.fmin(flux, top) ** 2)
            full.append(flux >= top)
        area = m.pole_area * math.cos(m.half_angle) / MU0
        return area * (pulls[0] - pulls[1]), ca.logic_or(*full)


def clip(value: Any, low: Any, high: Any) -> Any:
    """Value between two bounds; infinite ones leave it alone."""
    if isinstance(low, float) and isinstance(high, float) and math.isinf(low) and math.isinf(high):
        return value
    return ca.fmin(ca.fmax(value, low), high)
