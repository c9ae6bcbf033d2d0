"""The controller chain of one magnet axis: sensor, low-pass, PID, notches, delay, amplifier.

Blocks that are left out pass the signal on. Gains are in the units that the chain's ends imply: with
a sensor in V/m and an amplifier in A/V the PID gains are V/V, V/(V s) and V s/V; with both left out they
are A/m, A/(m s) and A s/m.
"""

from __future__ import annotations

from dataclasses import dataclass

from .fields import Number, Spec, choice, number, part


@dataclass(frozen=True, kw_only=True)
class LowPass(Spec):
    """Second-order low-pass w^2/(s^2 + 2 z w s + w^2)."""

    frequency: Number = number("rad/s", "corner frequency", domain="positive")
    damping: Number = number("", "damping ratio", domain="positive", default=0.7)


@dataclass(frozen=True, kw_only=True)
class Notch(Spec):
    """Notch (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2)."""

    frequency: Number = number("rad/s", "notch frequency", domain="positive")
    damping: Number = number("", "numerator damping ratio zn: the depth", domain="nonnegative", default=0.1)
    width: Number = number("", "denominator damping ratio zd", domain="positive", default=1.0)


@dataclass(frozen=True, kw_only=True)
class Amplifier(Spec):
    """Current amplifier: gain times a second-order low-pass."""

    gain: Number = number("A/V", "gain at low frequency", default=1.0)
    bandwidth: Number = number("rad/s", "corner frequency", domain="positive")
    damping: Number = number("", "damping ratio; 1/sqrt(2) is Butterworth", domain="positive", default=0.5**0.5)


@dataclass(frozen=True, kw_only=True)
class PID(Spec):
    """PID chain of an axis: i = -S LP Kt (Kp + Ki/s + Kd s) N D AMP y."""

    type: str = choice("kind of controller", ("pid",), default="pid")
    sensor_gain: Number = number("V/m", "sensor gain; 1 if the gains refer to metres", default=1.0)
    low_pass: LowPass | None = part("low-pass before the PID", default=None)
    total_gain: Number = number("", "factor on the three gains", default=1.0)
    kp: Number = number("", "proportional gain")
    ki: Number = number("1/s", "integral gain; 0 drops the integrator", default=0.0, switch=True)
    kd: Number = number("s", "derivative gain", default=0.0)
    derivative_time: Number = number(
        "s", "filter kd s/(t s + 1); 0 is the ideal derivative", domain="nonnegative", default=0.0, switch=True
    )
    notches: tuple[Notch, ...] = part("notch filters after the PID", default=())
    delay: Number = number(
        "s",
        "computation and sampling delay (Pade approximation of order 2)",
        domain="nonnegative",
        default=0.0,
        switch=True,
    )
    amplifier: Amplifier | None = part("current amplifier", default=None)
