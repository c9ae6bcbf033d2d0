"""What standards ask of a machine: ISO 14839-2 and -3 for magnetic bearings, API 617 for compressors.

The limits are those that are commonly quoted from ISO 14839-2:2004, ISO 14839-3:2006 and API 617 (the logarithmic decrement of a
level II stability analysis, and the separation margins); the edition that a contract names has the last word.

A machine is judged from rest to its running speed: the service speed or, where none is given, 90 % of the stability limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..units import RPM, in_words
from .critical import CriticalSpeed, critical_speeds
from .sensitivity import ZONES, Sensitivity, zone
from .spectrum import spectrum
from .stability import FOUND, MARGINAL, UNSTABLE, StabilityLimit
from .system import System
from .unbalance import major_axis, unbalance_response

PASSES, TOLERABLE, FAILS, OPEN = "passes", "tolerable", "fails", "not judged"

SENSITIVITY, DISPLACEMENT, API = "ISO 14839-3", "ISO 14839-2", "API 617"

LEAST_DECREMENT = 0.1
"""Logarithmic decrement that API 617 asks of forward modes below the running speed."""

HARMLESS = 2.5
"""Critical speeds with a smaller amplification factor need no separation margin (API 617)."""

DISPLACEMENT_ZONES = (("A", 0.3), ("B", 0.4), ("C", 0.5))
"""Upper limits of displacement over clearance (ISO 14839-2:2004); zone D lies above."""

MARGIN = 0.9
"""Part of the stability limit up to which a machine without service speed is judged."""


@dataclass(frozen=True)
class Criterion:
    """One demand of a standard.

    Attributes
    ----------
    standard, subject : str
    value, limit : float or None
        Dimensionless, or speeds in rad/s; None where there is nothing to compare.
    unit : str
        ``""`` or ``"rad/s"``.
    upper : bool
        True if the value must stay below the limit.
    verdict : {"passes", "tolerable", "fails", "not judged"}
        Tolerable: acceptable for long operation, but not what is expected of a new machine.
    where : str
        The speed, loop or mode that decides, or why nothing is judged.
    """

    standard: str
    subject: str
    value: float | None
    limit: float | None
    unit: str
    upper: bool
    verdict: str
    where: str


def running_speed(limit: StabilityLimit) -> float:
    """Speed up to which a machine is judged [rad/s].

    Parameters
    ----------
    limit : StabilityLimit

    Returns
    -------
    float
        The service speed; without one 90 % of the stability limit, or the top speed if no limit was found below it.
    """
    service = limit.machine.operation.service_speed
    return float(service) if service is not None else float(limit.speed) * (MARGIN if limit.status == FOUND else 1.0)


def criteria(
    loop: System,
    limit: StabilityLimit,
    sensitivities: Sequence[Sensitivity],
    speed: float | None = None,
) -> tuple[Criterion, ...]:
    """Hold a machine against the standards.

    Parameters
    ----------
    loop : System
    limit : StabilityLimit
    sensitivities : sequence of Sensitivity
        At rest and at the highest speed that counts; empty without control loops.
    speed : float, optional
        Running speed [rad/s]; `running_speed` if left out.

    Returns
    -------
    tuple of Criterion
        Stability first; alone, if the machine is not stable up to its running speed.
    """
    if limit.status in (UNSTABLE, MARGINAL):
        return (Criterion("stability", "stable at rest", None, None, "", False, FAILS, limit.status),)
    end = running_speed(limit) if speed is None else speed
    stable = limit.speed >= end
    where = limit.mode.describe() if limit.mode and not stable else "certified" if limit.certified else "not certified"
    found = [
        Criterion(
            "stability",
            f"stable up to {in_words(end, 'rad/s', speed=True)}",
            limit.speed,
            end,
            "rad/s",
            False,
            PASSES if stable else FAILS,
            where,
        )
    ]
    if stable:
        found += [
            *_sensitivity(sensitivities),
            *_displacement(loop, end),
            *_decrement(loop, end),
            *_separation(loop, end),
        ]
    return tuple(found)


def _of_zone(name: str) -> str:
    return {"A": PASSES, "B": TOLERABLE}.get(name, FAILS)


def _sensitivity(results: Sequence[Sensitivity]) -> Iterator[Criterion]:
    if not results:
        yield Criterion(SENSITIVITY, "peak sensitivity", None, ZONES[0][1], "", True, OPEN, "there is no control loop")
    for result in results:
        speed = f"at {in_words(result.speed, 'rad/s', speed=True)}" if result.speed else "at rest"
        peak = result.worst
        where = f"{peak.loop} at {in_words(peak.frequency, 'rad/s')}, zone {peak.zone}"
        yield Criterion(
            SENSITIVITY, f"peak sensitivity {speed}", peak.value, ZONES[0][1], "", True, _of_zone(peak.zone), where
        )


def _displacement(loop: System, end: float) -> Iterator[Criterion]:
    """Whirl at the magnets under the unbalance of the file, over the clearance of the backup bearings."""
    subject = "whirl over clearance"
    machine = loop.machine
    rooms = {i: float(m.clearance) for i, m in enumerate(machine.magnets) if m.clearance is not None}
    missing = (
        "there is no magnet"
        if not machine.magnets
        else "no magnet has a clearance"
        if not rooms
        else ""
        if any(d.unbalance for d in machine.rotor.disks)
        else "no disk has an unbalance"
    )
    if missing:
        yield Criterion(DISPLACEMENT, subject, None, DISPLACEMENT_ZONES[0][1], "", True, OPEN, missing)
        return
    near = [c.speed * (1.0 + k * c.damping_ratio) for c in critical_speeds(loop, end) for k in (-1.0, 0.0, 1.0)]
    speeds = np.union1d(np.linspace(end / 100.0, end, 100), [s for s in near if 0.0 < s < end])
    response = unbalance_response(loop, speeds)
    ratios = {i: major_axis(response.at(float(machine.magnets[i].position))) / room for i, room in rooms.items()}
    worst = max(ratios, key=lambda i: float(ratios[i].max()))
    k = int(np.argmax(ratios[worst]))
    value = float(ratios[worst][k])
    name = zone(value, DISPLACEMENT_ZONES)
    where = f"magnets[{worst}] at {in_words(float(speeds[k]), 'rad/s', speed=True)}, zone {name}"
    yield Criterion(DISPLACEMENT, subject, value, DISPLACEMENT_ZONES[0][1], "", True, _of_zone(name), where)


def _decrement(loop: System, end: float) -> Iterator[Criterion]:
    """The least damped forward mode of the rotor that whirls slower than it spins."""
    subject = f"logarithmic decrement at {in_words(end, 'rad/s', speed=True)}"
    modes = [
        m
        for m in spectrum(loop, end)
        if m.kind == "rotor" and m.whirl in ("forward", "planar") and 0.0 < m.frequency <= end
    ]
    if not modes:
        why = "no forward mode of the rotor whirls slower than it spins"
        yield Criterion(API, subject, None, LEAST_DECREMENT, "", False, OPEN, why)
        return
    least = min(modes, key=lambda m: m.logarithmic_decrement)
    value = least.logarithmic_decrement
    yield Criterion(
        API,
        subject,
        value,
        LEAST_DECREMENT,
        "",
        False,
        PASSES if value >= LEAST_DECREMENT else FAILS,
        least.describe(),
    )


def amplification(critical: CriticalSpeed) -> float:
    """Amplification factor 1/(2 zeta) of a critical speed; infinite without damping.

    Parameters
    ----------
    critical : CriticalSpeed
    """
    return 1.0 / (2.0 * critical.damping_ratio) if critical.damping_ratio > 0.0 else math.inf


def required_margin(factor: float, above: bool) -> float:
    """Separation margin that API 617 asks for, relative to the running speed.

    Parameters
    ----------
    factor : float
        Amplification factor.
    above : bool
        True for critical speeds above the running speed.

    Returns
    -------
    float
        17 (1 - 1/(AF - 1.5)) % and at most 16 % below it, 10 % more above it; zero for factors below 2.5.
    """
    if factor < HARMLESS:
        return 0.0
    margin = 0.17 * (1.0 - 1.0 / (factor - 1.5))
    return min(0.10 + margin, 0.26) if above else min(margin, 0.16)


def _separation(loop: System, end: float) -> Iterator[Criterion]:
    """Every critical speed that needs a margin, where a service speed is given; else there is nothing to keep away from."""
    if loop.machine.operation.service_speed is None:
        why = "no service speed is given"
        yield Criterion(API, "separation margin", None, None, "", False, OPEN, why)
        return
    reach = max(1.3 * end, float(loop.machine.operation.top_speed))
    demanding = [
        c
        for c in critical_speeds(loop, reach)
        if c.kind == "rotor" and c.whirl != "backward" and amplification(c) >= HARMLESS
    ]
    if not demanding:
        why = f"no critical speed up to {in_words(reach, 'rad/s', speed=True)} has an amplification factor above 2.5"
        yield Criterion(API, "separation margin", None, None, "", False, PASSES, why)
    for c in demanding:
        above = c.speed > end
        margin, asked = abs(c.speed - end) / end, required_margin(amplification(c), above)
        factor = amplification(c)
        size = f"{factor:.3g}" if math.isfinite(factor) else "infinite"
        yield Criterion(
            API,
            f"separation margin of the critical speed at {c.speed / RPM:.0f} rpm",
            margin,
            asked,
            "",
            False,
            PASSES if margin >= asked else FAILS,
            f"amplification factor {size}",
        )
