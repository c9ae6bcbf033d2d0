"""The lines of a comparison: what is measured, in which unit, and which way is better.

A further line is one more `Line` in ``LINES``: a function of an `Assessment`, which raises a ModelError where there is nothing
to measure.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..analysis.sensitivity import zone
from ..analysis.stability import FOUND, NONE, StabilityLimit
from .assessment import Assessment, UnstableError

HIGHER, LOWER, NEITHER = "higher", "lower", ""


@dataclass(frozen=True)
class Line:
    """One line of a comparison.

    Attributes
    ----------
    key : str
        Its name in documents.
    group, label : str
        For tables.
    unit : str
        SI unit; "rpm" stands for a spin speed in rad/s, "dB" for a factor, "deg" for an angle in rad.
    better : {"higher", "lower", ""}
    value : callable
        From an Assessment; a number in SI units, which may be infinite.
    remark : callable, optional
        A word behind the number.
    """

    key: str
    group: str
    label: str
    unit: str
    better: str
    value: Callable[[Assessment], float]
    remark: Callable[[Assessment], str] = lambda a: ""


def _stability_limit(a: Assessment) -> float:
    if a.limit.status not in (FOUND, NONE):
        raise UnstableError(a.limit.status)
    return a.limit.speed


def _remark(limit: StabilityLimit) -> str:
    if limit.status == NONE:
        return "and beyond"
    return "" if limit.certified else "not certified"


def _least_damping(a: Assessment) -> float:
    a.require_running()
    return min(float(m["damping_ratio"]) for m in a.least_damping)


def _worst_limit(a: Assessment) -> float:
    return min(c.stable_up_to for c in a.corners)


def _worst_remark(a: Assessment) -> str:
    return _remark(min(a.corners, key=lambda c: c.stable_up_to).limit)


def _smallest(name: str) -> Callable[[Assessment], float]:
    return lambda a: min(float(getattr(m.worst(name), name)) for m in a.margins)


def _gain_reduction(a: Assessment) -> float:
    largest = max(m.gain_down for found in a.margins for m in found.loops)
    return 1.0 / largest if largest else math.inf


def _peak_sensitivity(a: Assessment) -> float:
    return max(s.worst.value for s in a.sensitivities)


def _sampled(period: float) -> Line:
    """The stability limit of a digital controller that acts one period after it has sampled."""
    key, label = f"sampled_{period * 1e6:.0f}us", f"stability limit, sampled every {period * 1e6:.0f} µs"
    return Line(key, "stability", label, "rpm", HIGHER, lambda a: a.sampled_limit(period))


_SAMPLED = tuple(_sampled(period) for period in (100e-6, 50e-6, 25e-6))

LINES = (
    Line(
        "stability_limit",
        "stability",
        "stability limit speed, certified",
        "rpm",
        HIGHER,
        _stability_limit,
        lambda a: _remark(a.limit),
    ),
    *_SAMPLED,
    Line("least_damping_ratio", "stability", "least damping ratio of the first modes", "%", HIGHER, _least_damping),
    Line(
        "worst_stability_limit",
        "robustness",
        "stability limit at the worst corner",
        "rpm",
        HIGHER,
        _worst_limit,
        _worst_remark,
    ),
    Line("stable_share", "robustness", "random machines that are stable", "%", HIGHER, lambda a: a.stable_share),
    Line(
        "sensitivity_peak",
        "loops",
        "peak sensitivity (zone)",
        "",
        LOWER,
        _peak_sensitivity,
        lambda a: f"({zone(_peak_sensitivity(a))})",
    ),
    Line("gain_margin", "loops", "gain margin", "dB", HIGHER, _smallest("gain_up")),
    Line("gain_reduction_margin", "loops", "gain reduction margin", "dB", HIGHER, _gain_reduction),
    Line("phase_margin", "loops", "phase margin", "deg", HIGHER, _smallest("phase")),
    Line("disk_margin", "loops", "disk margin", "", HIGHER, _smallest("disk")),
    Line("unbalance_radius", "unbalance", "largest orbit radius", "m", LOWER, lambda a: a.whirl.largest_radius),
    Line("unbalance_current", "unbalance", "largest control current", "A", LOWER, lambda a: a.whirl.largest_current),
    Line(
        "unbalance_current_ratio",
        "unbalance",
        "control over bias current",
        "%",
        LOWER,
        lambda a: a.whirl.largest_share(a.machine),
    ),
    Line("force_peak", "force step", "peak displacement", "m", LOWER, lambda a: max(r.peak for r in a.force_steps)),
    Line(
        "force_whirl",
        "force step",
        "whirl has died away after",
        "s",
        LOWER,
        lambda a: max(r.ringing_time for r in a.force_steps),
    ),
    Line(
        "force_settling",
        "force step",
        "settling time",
        "s",
        LOWER,
        lambda a: max(r.settling_time for r in a.force_steps),
    ),
    Line(
        "force_current", "force step", "peak current", "A", LOWER, lambda a: max(r.peak_current for r in a.force_steps)
    ),
    Line("base_peak", "base shock", "peak displacement", "m", LOWER, lambda a: max(r.peak for r in a.base_shocks)),
    Line(
        "base_settling",
        "base shock",
        "settling time",
        "s",
        LOWER,
        lambda a: max(r.settling_time for r in a.base_shocks),
    ),
    Line(
        "base_current", "base shock", "peak current", "A", LOWER, lambda a: max(r.peak_current for r in a.base_shocks)
    ),
    Line("lift_off", "backup bearings", "time to lift off", "s", LOWER, lambda a: a.lift_off),
    Line("noise_current", "noise", "control current, rms", "A", LOWER, lambda a: max(float(n.max()) for n in a.noise)),
    Line("bias_current", "cost", "largest bias current", "A", NEITHER, lambda a: a.bias_current),
    Line("copper_loss", "cost", "copper loss at bias", "W", LOWER, lambda a: a.copper_loss),
    Line("controller_order", "cost", "states of the controllers", "", LOWER, lambda a: float(a.order)),
    Line(
        "unstable_controller_poles",
        "cost",
        "unstable poles of the controllers alone",
        "",
        LOWER,
        lambda a: float(max(a.unstable_poles(0.0), a.unstable_poles(a.end))),
    ),
    Line("design_time", "cost", "CPU time of the design", "s", LOWER, lambda a: a.seconds),
)
