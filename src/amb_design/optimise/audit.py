"""Every quantity of a design problem by the analyses of the package, which share nothing with the search but the model.

The search takes sensitivities and responses from sums over modes at a few speeds; here they come from banded solutions of the
full model at speeds of their own, the stability limit from its certificate, and peaks are refined by another method.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ..analysis.critical import critical_speeds
from ..analysis.noise import noise_current
from ..analysis.sensitivity import CHECKED_TO, sensitivity
from ..analysis.stability import FOUND, NONE, StabilityLimit, stability_limit
from ..analysis.system import Array, System, system
from ..analysis.unbalance import UnbalanceResponse, major_axis, unbalance_response
from ..analysis.worst_speed import most_sensitive_speeds, worst_speeds
from ..model import magnet as magnetics
from ..model import strength
from ..spec.machine import Machine
from ..spec.paths import find, replace, value
from ..spec.problem import DesignProblem
from ..spec.problem_parts import Measure, Scenario
from ..synthesis.design import synthesise
from ..threads import one_thread
from .measures.critical import AMPLIFIED
from .measures.noise import QUANTITIES as NOISY
from .measures.whirl import QUANTITIES as DRIVEN
from .meshes import Layout, own

LOOPS = np.array([0.0, 0.311, 0.643, 0.93, 1.0])
"""Fractions of the range at which sensitivities and noise currents are looked at, beside those where they are worst."""

WHIRL = 240
"""Speeds of the unbalance response, beside the critical ones."""


@dataclass(frozen=True)
class Finding:
    """One quantity of one scenario.

    Attributes
    ----------
    quantity, scenario : str
    value : float
        In SI units: the worst over the range of speeds.
    speed : float or None
        Where it occurs [rad/s].
    """

    quantity: str
    scenario: str
    value: float
    speed: float | None


@dataclass(frozen=True)
class Audit:
    """A design looked at with fresh eyes.

    Attributes
    ----------
    end : float
        End of the range of speeds [rad/s].
    findings : tuple of Finding
        One a quantity and scenario.
    stability : mapping of str to StabilityLimit
        By scenario; "" is the machine as drawn.
    layout : callable
        Of the mesh.
    """

    end: float
    findings: tuple[Finding, ...]
    stability: Mapping[str, StabilityLimit]
    layout: Layout = own

    def worst(self, quantity: str, upper: bool) -> Finding | None:
        """The worst of a quantity over all scenarios."""
        found = [f for f in self.findings if f.quantity == quantity]
        return (max if upper else min)(found, key=lambda f: f.value, default=None)

    def at(self, quantity: str, scenario: str) -> Finding:
        """The finding of a quantity in a scenario."""
        return next(f for f in self.findings if (f.quantity, f.scenario) == (quantity, scenario))


@one_thread
def audit(
    problem: DesignProblem,
    values: Mapping[str, float],
    end: float,
    layout: Layout = own,
    quantities: Collection[str] | None = None,
    known: Mapping[str, StabilityLimit] | None = None,
    coarser: Audit | None = None,
) -> Audit:
    """Compute the quantities of a problem at a design.

    Parameters
    ----------
    problem : DesignProblem
    values : mapping of str to float
        Variables in SI units.
    end : float
        End of the range of speeds [rad/s].
    layout : callable
        Lays out the mesh of a machine, like those of `amb_design.optimise.meshes`; the machine's own if left out.
    quantities : collection of str, optional
        Those to compute besides stability; all if left out.
    known : mapping of str to StabilityLimit, optional
        Stability limits by scenario, where an earlier audit of the same design on the same mesh found them.
    coarser : Audit, optional
        Of the same design on its own mesh: sensitivities and noise currents are looked at where they were worst there, and no
        longer sought over the range.
    """
    base = synthesise(problem.with_values(values))  # a law of the nominal machine, whatever the scenario
    measures = list(problem.constraints)
    asked: list[Measure] = [*measures] if problem.seeks_speed else [*measures, problem.objective]
    if quantities is not None:
        asked = [m for m in asked if m.quantity in quantities]
    findings: list[Finding] = []
    limits = {}
    for case in (None, *problem.cases):
        name = "" if case is None else case.name
        machine = scenario_machine(base, case)
        loop = system(machine, layout(machine))
        top = max(problem.top_speed, end)
        limits[name] = known[name] if known else stability_limit(loop, top, first_only=True)
        driven = [m.quantity for m in asked if m.quantity in DRIVEN]
        found = _driven(problem, case, loop, driven, end) if driven else {}
        for m in asked:
            near = None if coarser is None else coarser.at(m.quantity, name).speed
            v, speed = found[m.quantity] if m.quantity in found else _value(loop, m, end, near)
            findings.append(Finding(m.quantity, name, float(v), speed))
    return Audit(end, tuple(findings), limits, layout)


def scenario_machine(machine: Machine, case: Scenario | None) -> Machine:
    """The machine as a scenario has it; its unbalances are those of the problem's patterns and stay."""
    if case is None:
        return machine
    paths = {path: factor for name, factor in case.factors for path in find(machine, name)}
    return replace(machine, {path: factor * value(machine, path) for path, factor in paths.items()})


def stable_up_to(limit: StabilityLimit) -> float:
    """Speed up to which a machine is stable [rad/s]; the end of the search if no limit was found."""
    return limit.speed if limit.status in (FOUND, NONE) else 0.0


def _value(loop: System, measure: Measure, end: float, near: float | None) -> tuple[float, float | None]:
    """A quantity and its speed; `near` is a speed at which it may be worst, if that is known."""
    q, machine = measure.quantity, loop.machine
    if q in ("damping_ratio", "decay_rate"):
        return _damping(loop, measure, end)
    if q == "sensitivity_peak":
        return _sensitivity(loop, measure, end, near)
    if q in NOISY:
        places = worst_speeds(lambda s: np.array([_noise(loop, measure, s)]), end) if near is None else [near]
        return max((_noise(loop, measure, float(s)), float(s)) for s in np.union1d(LOOPS * end, places))
    if q == "separation_margin":
        service = float(machine.operation.service_speed)
        found = [
            (abs(c.speed / service - 1.0), c.speed)
            for c in critical_speeds(loop, 3.0 * service)
            if (c.whirl != "backward" or not loop.complex_form) and c.damping_ratio < AMPLIFIED
        ]
        return min(found, default=(math.inf, None))
    if q == "torsional_ratio":
        stiffness, inertia = (ca.DM(m).full() for m in strength.torsion(machine, loop.plant.mesh))
        return math.sqrt(sla.eigh(stiffness, inertia, eigvals_only=True)[1]) / end, end
    if q == "mass":
        return float(ca.DM(strength.rotor_mass(machine))), None
    if q == "copper_loss":
        return float(strength.copper_loss(machine)), None
    if q == "bias_current":
        return max(float(m.bias_current) for m in machine.magnets), None
    if q == "hoop_strain":
        return max(float(ca.DM(e)) for e in strength.hoop_strain(machine, measure.option("overspeed") * end)), end
    return max(float(v) for v in strength.surface_speed(machine, end, measure.option("disks"))), end


def _sensitivity(loop: System, measure: Measure, end: float, near: float | None) -> tuple[float, float]:
    def highest(speed: float) -> float:
        return max(CHECKED_TO, 3.0 * speed, float(measure.option("up_to")))

    places = most_sensitive_speeds(loop, end, highest) if near is None else [near]
    speeds = map(float, np.union1d(LOOPS * end, places))
    peaks = [(sensitivity(loop, s, highest=highest(s)).worst, s) for s in speeds]
    return max((peak.value, s) for peak, s in peaks)


def _damping(loop: System, measure: Measure, end: float) -> tuple[float, float]:
    """Least damping ratio in the window, or decay rate, refined around the worst of a grid of speeds."""
    lower, upper = measure.option("window") if measure.quantity == "damping_ratio" else (1.0, math.inf)

    def least(speed: float) -> float:
        values = np.linalg.eigvals(loop.matrix(speed))
        frequency = np.abs(values.imag)
        inside = values[(frequency >= max(lower, 1.0)) & (frequency <= upper)]
        if measure.quantity == "decay_rate":
            return float(np.min(-inside.real, initial=math.inf))
        return float(np.min(-inside.real / np.abs(inside), initial=math.inf))

    return min((least(float(s)), float(s)) for s in worst_speeds(lambda s: -np.array([least(s)]), end))


def _noise(loop: System, measure: Measure, speed: float) -> float:
    """Largest noise current of any loop, or ratio of it to the bias, at one speed."""
    currents = noise_current(loop, measure.option("noise"), speed)
    if measure.quantity == "noise_current_ratio":
        currents = currents / [float(loop.machine.magnets[a.magnet].bias_current) for a in loop.plant.loops]
    return float(currents.max())


def with_pattern(machine: Machine, amounts: tuple[float, ...], factor: float = 1.0) -> Machine:
    """The machine with one residual unbalance pattern on its disks."""
    changes: dict[str, Any] = {}
    for i, amount in enumerate(amounts):
        changes[f"rotor.disks[{i}].unbalance"] = abs(amount) * factor
        changes[f"rotor.disks[{i}].unbalance_phase"] = 0.0 if amount >= 0.0 else math.pi
    return replace(machine, changes)


def _driven(
    problem: DesignProblem, case: Scenario | None, loop: System, quantities: Sequence[str], end: float
) -> dict[str, tuple[float, float]]:
    """Largest value and its speed of each quantity that the residual unbalance drives."""
    factor = 1.0 if case is None else case.unbalance
    near = [
        c.speed * (1.0 + k * max(c.damping_ratio, 1e-3)) for c in critical_speeds(loop, end) for k in (-0.5, 0.0, 0.5)
    ]
    grid = np.unique(np.concatenate([np.linspace(end / WHIRL, end, WHIRL), [s for s in near if 0.0 < s < end]]))
    best = dict.fromkeys(quantities, (0.0, end))
    for machine in _unbalanced(problem, loop.machine, factor):
        rig = System(machine, loop.plant, loop.kept)
        response = unbalance_response(rig, grid)
        for q in quantities:
            table = _curve(response, q)
            k = int(np.argmax(table))
            best[q] = max(best[q], (float(table[k]), float(grid[k])))
            if 0 < k < len(grid) - 1:  # closer to the peak
                fine = np.linspace(grid[k - 1], grid[k + 1], 21)
                table = _curve(unbalance_response(rig, fine), q)
                best[q] = max(best[q], (float(table.max()), float(fine[int(np.argmax(table))])))
    return best


def _unbalanced(problem: DesignProblem, machine: Machine, factor: float) -> Iterator[Machine]:
    """The machine with each residual unbalance, or with its own."""
    if problem.patterns:
        for pattern in problem.patterns:
            yield with_pattern(machine, pattern.amounts, factor)
    else:
        own = {f"rotor.disks[{i}].unbalance": d.unbalance * factor for i, d in enumerate(machine.rotor.disks)}
        yield replace(machine, own)


def _curve(response: UnbalanceResponse, quantity: str) -> Array:
    """The quantity's largest value over the magnets at each speed."""
    speeds, out = response.speeds, np.zeros(len(response.speeds))
    for i, m in enumerate(response.machine.magnets):
        current = response.peak_currents[:, i]
        motion = major_axis(response.at(float(m.position)))
        if quantity == "control_current":
            values = current
        elif quantity == "control_current_ratio":
            values = current / float(m.bias_current)
        elif quantity == "total_current":
            values = float(m.bias_current) + current
        elif quantity == "displacement_ratio":
            values = motion / float(m.gap if m.clearance is None else m.clearance)
        elif quantity == "flux_density":
            values = np.array([float(magnetics.flux_density(m, c, y)) for c, y in zip(current, motion, strict=True)])
        else:
            values = np.array(
                [float(magnetics.voltage(m, s, c, y)) for s, c, y in zip(speeds, current, motion, strict=True)]
            )
        out = np.maximum(out, values)
    return out
