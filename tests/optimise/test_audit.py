"""What the search sees, the audit finds too: two ways to every quantity, with nothing in common but the model.

The search takes sensitivities from sums over modes and responses from dense matrices in modal coordinates; the audit takes
both from banded solutions of the full model at speeds of its own. Limits are set so low that the search follows all peaks,
and both look at the same end of the range.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise import audit as auditing
from amb_design.optimise.evaluation import Case
from optimise.rigs import LIMITS

TOLERANCE = 2e-3
"""What is left between speeds that only one of the two looks at."""

FRACTIONS = np.linspace(0.0, 1.0, 31)
DRIVEN = ("control_current", "control_current_ratio", "total_current", "flux_density", "voltage", "displacement_ratio")
ALL = {**LIMITS, **dict.fromkeys(DRIVEN, 1e-6)}


@pytest.fixture(autouse=True)
def coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer speeds for the audit: peaks lie near critical speeds, which it looks at in any case."""
    monkeypatch.setattr(auditing, "WHIRL", 60)


def with_resistance(name: str, changes: dict[str, Any]) -> ad.Machine:
    machine = ad.load(name)
    magnets = tuple(ad.replace(m, {"resistance": 0.3}) for m in machine.magnets)
    return ad.replace(machine, {"magnets": magnets, **changes})


def compare(problem: ad.DesignProblem, end: float, only: tuple[str, ...] = ()) -> None:
    """Worst samples beside the audit's findings, for the machine as drawn and in all scenarios."""
    p = np.array(list(problem.start().values()))
    found = auditing.audit(problem, problem.start(), end)
    upper = {c.quantity: c.kind.upper for c in problem.constraints}
    off = []
    for scenario in (None, *problem.cases):
        case = Case(problem, scenario)
        seen = case.samples(case.state(p), end, FRACTIONS, auditing.LOOPS)
        findings = {f.quantity: f.value for f in found.findings if f.scenario == case.name}
        assert set(findings) == set(upper)
        for quantity in only or findings:
            values = seen[quantity].values
            worst = values.max() if upper[quantity] else values.min()
            error = abs(worst / findings[quantity] - 1.0)
            print(f"{case.name or 'as drawn'}: {quantity} {worst:.6g}, off by {error:.1e}")
            if not error <= TOLERANCE:
                off.append(f"{case.name}: {quantity} is {worst:.6g}, the audit says {findings[quantity]:.6g}")
    assert not off, "\n".join(off)


GAINS = {"controller.kp": (0.5, 2.0), "controller.kd": (0.01, 0.06)}
PATTERNS = {"static": [3e-7] * 3, "couple": [3e-7, 0.0, -3e-7]}
SOFT = {"magnets.gap": 1.05, "bearings.damping": 0.9, "unbalance": 1.4}


def test_composite_spindle_with_its_own_unbalance() -> None:
    problem = ad.DesignProblem(
        ad.load("composite-spindle"),
        maximise="stability_limit",
        free={"controller.kp": (1e4, 3e4)},
        limits=ALL,
        scenarios={"soft": {"magnets.gap": 1.05, "plies.material.E1": 0.95, "unbalance": 1.3}},
    )
    compare(problem, 3600.0)


def test_thesis_rotor_with_patterns() -> None:
    problem = ad.DesignProblem(
        with_resistance("thesis-tuned", {"operation.service_speed": 700.0}),
        maximise="stability_limit",
        free=GAINS,
        limits=ALL,
        unbalance=PATTERNS,
        scenarios={"soft": SOFT},
    )
    compare(problem, 900.0)


@pytest.fixture(scope="module")
def two_planes() -> ad.Machine:
    """Other bearings and other controllers in y than in z; a backward critical speed just above the service speed."""
    changes = {"operation.service_speed": 650.0, "controller_z.kp": 0.8, "controller_z.kd": 0.02}
    return ad.replace(with_resistance("thesis-anisotropic", changes), {"magnets.axes_angle": 0.3})


def test_anisotropic_rotor_with_its_own_controllers_per_axis(two_planes: ad.Machine) -> None:
    problem = ad.DesignProblem(
        two_planes, maximise="stability_limit", free=GAINS, limits=ALL, unbalance={"bow": [3e-7, -2e-7, 1e-7]}
    )
    compare(problem, 900.0)


def test_anisotropic_scenario(two_planes: ad.Machine) -> None:
    limits = {
        q: ALL[q]
        for q in ("decay_rate", "damping_ratio", "sensitivity_peak", "displacement_ratio", "separation_margin")
    }
    problem = ad.DesignProblem(
        two_planes,
        maximise="stability_limit",
        free=GAINS,
        limits=limits,
        unbalance={"bow": [3e-7, -2e-7, 1e-7]},
        scenarios={"soft": SOFT},
    )
    compare(problem, 900.0)
