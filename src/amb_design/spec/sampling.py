"""How a controller is computed: at discrete times."""

from __future__ import annotations

from dataclasses import dataclass

from .fields import Number, Spec, choice, number


@dataclass(frozen=True, kw_only=True)
class Sampling(Spec):
    """A digital controller: everything before the amplifier works at discrete times, and its output is held.

    Filters and law are discretised by the trapezoidal rule (Tustin), s = 2/T (z - 1)/(z + 1), without prewarping, or exactly for
    inputs that are held between samples ("hold"). The chain's own `delay`, the continuous stand-in for this, is left out. A
    law that differentiates without a filter is given the sampled velocity of the shaft.
    """

    period: Number = number("s", "time between samples", domain="positive")
    delay: Number = number("s", "from a sample to its effect", domain="nonnegative", default=0.0)
    method: str = choice("discretisation of filters and law", ("tustin", "hold"), default="tustin")
