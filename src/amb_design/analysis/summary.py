"""Everything an analysis says of a machine, as one result and as one plain document.

The document (nested dicts, lists, strings and finite numbers, ready for JSON) is what the command line prints, what
published figures are compared with, and what other programs may rely on; speeds are in rpm there, frequencies in Hz.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..errors import ModelError
from ..spec.machine import Machine
from ..spec.paths import metadata, value
from ..threads import one_thread
from .critical import CriticalSpeed, critical_speeds
from .equivalent import Equivalent, equivalent_coefficients
from .findings import Finding, findings
from .gradient import stability_gradient
from .modes import OVERDAMPED, Mode
from .sensitivity import Sensitivity
from .spectrum import spectrum
from .stability import FOUND, MARGINAL, UNSTABLE, Onset, StabilityLimit, stability_limit
from .standards import MARGIN, Criterion, criteria, running_speed
from .system import system
from .worst_speed import telling_sensitivities

RPM = 30.0 / math.pi


@dataclass(frozen=True)
class Analysis:
    """Result of `analyse`.

    Attributes
    ----------
    machine : Machine
    size : int
        Number of states.
    complex_form : bool
        True if y and z are one complex coordinate.
    limit : StabilityLimit
    critical : tuple of CriticalSpeed
    modes : tuple of Mode
        At rest, with the lowest whirl frequencies.
    sensitivities : tuple of Sensitivity
        At rest and at speed; empty without control loops or where the machine is unstable.
    gradient : mapping of str to float
        Derivative of the stability limit with respect to every number of the machine [rad/s per SI unit]; empty if no
        limit was found.
    equivalent : Equivalent or None
        What the equivalent-coefficient method would say; None where it does not apply.
    criteria : tuple of Criterion
        What standards ask, and whether the machine answers.
    findings : tuple of Finding
    """

    machine: Machine = field(repr=False)
    size: int
    complex_form: bool
    limit: StabilityLimit
    critical: tuple[CriticalSpeed, ...]
    modes: tuple[Mode, ...]
    sensitivities: tuple[Sensitivity, ...]
    gradient: Mapping[str, float]
    equivalent: Equivalent | None
    criteria: tuple[Criterion, ...]
    findings: tuple[Finding, ...]

    def document(self) -> dict[str, Any]:
        """The result as nested dicts, lists, strings and finite numbers."""
        limit = self.limit
        out: dict[str, Any] = {
            "name": self.machine.name,
            "states": self.size,
            "form": "complex" if self.complex_form else "real",
            "top_speed_rpm": limit.top_speed * RPM,
            "stability_limit": limit_document(limit),
            "onsets_rpm": [o.speed * RPM for o in limit.onsets if o.unstable],
            "onsets": [_onset(o) for o in limit.onsets],
            "unstable_at_rest": [
                {"growth_per_s": m.eigenvalue.real, "frequency_hz": m.frequency_hz, "mode": m.describe()}
                for m in limit.unstable_at_rest
            ],
            "critical_speeds_rpm": [c.speed_rpm for c in self.critical if c.whirl != "backward" and c.kind == "rotor"],
            "critical_speeds": [
                {"speed_rpm": c.speed_rpm, "whirl": c.whirl, "damping_ratio": c.damping_ratio, "kind": c.kind}
                for c in self.critical
            ],
            "modes_at_rest": [
                {
                    "frequency_hz": m.frequency_hz,
                    "damping_ratio": m.damping_ratio,
                    "logarithmic_decrement": _finite(m.logarithmic_decrement),
                    "whirl": m.whirl,
                    "kind": m.kind,
                }
                for m in self.modes
            ],
            "sensitivity": [
                {
                    "speed_rpm": s.speed * RPM,
                    "loop": p.loop,
                    "peak": p.value,
                    "frequency_hz": p.frequency / (2 * math.pi),
                    "zone": p.zone,
                }
                for s in self.sensitivities
                for p in s.peaks
            ],
            "criteria": [criterion_document(c) for c in self.criteria],
            "limit_sensitivities": ranked(self.machine, self.gradient),
            "warnings": [f.text for f in self.findings],
            "warning_topics": [f.topic for f in self.findings],
        }
        if self.equivalent is not None:
            e = self.equivalent
            out["equivalent_coefficients"] = {
                "critical_speed_rpm": _finite(e.critical_speed * RPM),
                "stability_limit_rpm": _finite(e.stability_limit * RPM),
                "changes": [{"speed_rpm": s * RPM, "becomes": "unstable" if u else "stable"} for s, u in e.changes],
            }
        return out


@one_thread
def analyse(machine: Machine, modes: int = 8) -> Analysis:
    """Run the standard analysis of a machine.

    Parameters
    ----------
    machine : Machine
    modes : int
        Number of modes at rest to list.

    Returns
    -------
    Analysis
    """
    loop = system(machine)
    limit = stability_limit(loop)
    critical = critical_speeds(loop)
    controlled = bool(loop.plant.loops)
    speeds: list[float] = []
    if controlled and limit.status not in (UNSTABLE, MARGINAL):
        speeds = [0.0, min(running_speed(limit), limit.speed * (MARGIN if limit.status == FOUND else 1.0))]
    sensitivities = telling_sensitivities(loop, speeds[1]) if speeds else ()
    equivalent = None
    if controlled:
        try:
            equivalent = equivalent_coefficients(machine)
        except ModelError:  # anisotropic or not collocated: the method has nothing to say
            equivalent = None
    return Analysis(
        machine=machine,
        size=loop.size,
        complex_form=loop.complex_form,
        limit=limit,
        critical=critical,
        modes=tuple(m for m in spectrum(loop) if m.whirl != "none" and m.damping_ratio < OVERDAMPED)[:modes],
        sensitivities=sensitivities,
        gradient=stability_gradient(machine, limit.mode) if limit.status == FOUND else {},
        equivalent=equivalent,
        criteria=criteria(loop, limit, sensitivities),
        findings=findings(loop, limit, critical, modes),
    )


def ranked(machine: Machine, gradient: Mapping[str, float]) -> list[dict[str, Any]]:
    """What moves the stability limit, the strongest first: its change for one per cent of each number.

    Parameters
    ----------
    machine : Machine
    gradient : mapping of str to float
        Derivatives of the stability limit by path [rad/s per SI unit].
    """
    rows = []
    for path, slope in gradient.items():
        nominal = float(value(machine, path))
        if slope and nominal:
            rows.append(
                {
                    "number": path,
                    "value": nominal,
                    "unit": metadata(machine, path)["unit"],
                    "rpm_per_unit": slope * RPM,
                    "rpm_per_percent": slope * RPM * nominal / 100.0,
                }
            )
    return sorted(rows, key=lambda r: -abs(r["rpm_per_percent"]))


def criterion_document(criterion: Criterion) -> dict[str, Any]:
    """A criterion as data, speeds in rpm.

    Parameters
    ----------
    criterion : Criterion
    """
    speed = criterion.unit == "rad/s"

    def number(x: float | None) -> float | None:
        return None if x is None or not math.isfinite(x) else x * RPM if speed else x

    return {
        "standard": criterion.standard,
        "subject": criterion.subject,
        "value": number(criterion.value),
        "limit": number(criterion.limit),
        "unit": "rpm" if speed else criterion.unit,
        "kind": "at most" if criterion.upper else "at least",
        "verdict": criterion.verdict,
        "where": criterion.where,
    }


def limit_document(limit: StabilityLimit) -> dict[str, Any]:
    """A stability limit as data.

    Parameters
    ----------
    limit : StabilityLimit
    """
    return {
        "speed_rpm": _finite(limit.speed * RPM),
        "status": limit.status,
        "certified": limit.certified,
        "whirl_frequency_hz": limit.mode.frequency_hz if limit.mode else None,
        "mode": limit.mode.describe() if limit.mode else None,
        "eigendecompositions": limit.eigendecompositions,
    }


def _onset(onset: Onset) -> dict[str, Any]:
    return {
        "speed_rpm": onset.speed * RPM,
        "becomes": "unstable" if onset.unstable else "stable",
        "unstable_modes_above": onset.count,
        "whirl_frequency_hz": onset.mode.frequency_hz,
        "mode": onset.mode.describe(),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
