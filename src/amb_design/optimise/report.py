"""A design as data: what `amb-design optimise --json` prints and what is kept beside the figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..analysis.stability import StabilityLimit
from ..analysis.summary import limit_document
from ..spec.paths import find, metadata, value
from .answers import ParetoPoint, Relaxation
from .audit import Audit
from .design import Design

RPM = 30.0 / math.pi


def document(
    design: Design, relaxed: Sequence[Relaxation] = (), fronts: Mapping[str, Sequence[ParetoPoint]] | None = None
) -> dict[str, Any]:
    """A design as data, speeds in rpm beside SI units.

    Parameters
    ----------
    design : Design
    relaxed : sequence of Relaxation
    fronts : mapping of str to sequence of ParetoPoint
        By quantity.
    """
    problem = design.problem
    kind = problem.objective.kind
    out: dict[str, Any] = {
        "name": problem.name,
        "question": problem.question,
        "objective": {"quantity": kind.name, "unit": kind.unit, "value": _number(design.objective)},
        "status": design.status,
        "verified": design.verified,
        "speed_rpm": _number(design.end * RPM) if design.verified else None,
        "before": _state(design, design.before, problem.as_drawn().start()),
        "after": None,
        "variables": [_variable(design, v) for v in problem.variables],
        "limits": [_limit(row) for row in design.limits],
        "conflicts": design.conflicts,
        "rejected": [
            [{"quantity": e.quantity, "scenario": e.scenario, "excess": e.excess, "told": e.told} for e in v.excesses]
            for v in design.rejected
        ],
        "starts": [o.document() for o in design.outcomes],
        "seed": design.seed,
        "eigensolves": design.eigensolves,
        "cpu_seconds": sum(o.cpu_seconds for o in design.outcomes),
    }
    if problem.seeks_speed:
        out["objective"]["value_rpm"] = out["speed_rpm"]
        out["before"]["within_limits_up_to_rpm"] = design.reach_before * RPM
    if design.best is not None:
        out["after"] = _state(design, design.best.audits[0], design.values)
        out["after"]["proof"] = design.best.proof.document() if design.best.proof else None
        out["after"]["finer_mesh"] = _state(design, design.best.audits[1], design.values)
        out["sensitivities"] = [{"number": path, "percent_per_percent": s} for path, s in design.sensitivities]
    out["relaxations"] = [
        {
            "quantity": r.quantity,
            "limit": r.bound,
            "eased": r.eased,
            "predicted": _number(r.predicted),
            "solved": _number(r.solved),
        }
        for r in relaxed
    ]
    out["pareto"] = {
        q: [{"limit": p.bound, "objective": _number(p.objective), "values": dict(p.values)} for p in points]
        for q, points in (fronts or {}).items()
    }
    return out


def _number(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


def _state(design: Design, found: Audit, values: Mapping[str, float]) -> dict[str, Any]:
    upper = {m.quantity: m.kind.upper for m in (*design.problem.constraints, design.problem.objective)}
    quantities = {}
    for q in dict.fromkeys(f.quantity for f in found.findings):
        worst = found.worst(q, upper[q])
        assert worst is not None
        speed = None if worst.speed is None else worst.speed * RPM
        quantities[q] = {"value": _number(worst.value), "speed_rpm": speed, "scenario": worst.scenario}
    limits: dict[str, StabilityLimit] = dict(found.stability)
    return {
        "stability_limit": limit_document(limits.pop("")),
        "stability_limits_of_scenarios": {name: limit_document(limit) for name, limit in limits.items()},
        "range_rpm": found.end * RPM,
        "quantities": quantities,
        "values": dict(values),
    }


def _variable(design: Design, v: Any) -> dict[str, Any]:
    machine = design.problem.machine
    path, *others = find(machine, v.name)
    after = design.values[v.name] if design.verified else None
    span = v.upper - v.lower
    at = None
    if after is not None:
        at = "lower" if after - v.lower < 1e-4 * span else "upper" if v.upper - after < 1e-4 * span else ""
    return {
        "name": v.name,
        "unit": metadata(machine, path)["unit"],
        "before": float(value(machine, path)),
        "others_before": sorted({float(value(machine, p)) for p in others} - {float(value(machine, path))}),
        "after": after,
        "lower": v.lower,
        "upper": v.upper,
        "at_bound": at,
    }


def _limit(row: Any) -> dict[str, Any]:
    return {
        "quantity": row.quantity,
        "unit": row.unit,
        "kind": "at most" if row.upper else "at least",
        "limit": row.bound,
        "value": _number(row.value),
        "speed_rpm": None if row.speed is None else row.speed * RPM,
        "scenario": row.scenario,
        "active": row.active,
        "percent_per_percent": row.worth,
    }
