"""No design is returned before it has been looked at with fresh eyes, on its own mesh and on finer ones."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..analysis.modes import WHIRL_FREQUENCY
from ..analysis.system import Array, system
from ..errors import SolveError
from ..proof.claims import Proof, prove_stability_limit
from ..spec.problem import DesignProblem
from ..synthesis.design import synthesise
from ..threads import one_thread
from .audit import Audit, audit, scenario_machine, stable_up_to
from .measures.noise import QUANTITIES as NOISY
from .measures.samples import rpm_text
from .meshes import Layout, four_times, halved, in_eighths, own, quartered, thrice, told, twice
from .start import INFEASIBLE, Outcome, Starter

TOLERANCE = 1e-6
"""Relative excess over a limit that counts as rounding."""

MARGIN = 1e-4
"""By how much the search tightens every limit from the beginning, for what a finer mesh may add."""

BESIDE = 1e-3
"""Parts of the range so close to each other are the same place."""

SETTLED = 1e-3
"""A quantity is settled that yet finer meshes change by less than this part of its limit..."""

AGAIN = 0.25
"""... which is at most this part of what the last one changed: a fifteenth where elements are cut in two and small enough."""

ELSEWHERE = (0.0, 0.5, 0.99)
"""Fractions of the range for modes of other meshes; the last not quite its end, where those that have converged may just become unstable."""

JUST_BELOW = 1.0 - SETTLED
"""Fraction of the range at which modes have to be stable where elements are cut in four."""

WATCHED = ("stability", "decay_rate", "damping_ratio", "sensitivity_peak")
"""What modes may break that only a finer mesh has."""

ROUNDS = 4
"""How often a design that fails is refined."""

RETREATS = (0.9995, 0.998, 0.995, 0.99, 0.98, 0.97)
"""Last resort: shorter ranges of speed for a design that fails at the end of its own."""


@dataclass(frozen=True)
class Excess:
    """A limit that an audit found violated.

    Attributes
    ----------
    quantity, scenario : str
    excess : float
        Relative to the bound.
    speed : float or None
    layout : callable
        Of the mesh.
    mode : str
        The one that is not stable, in words.
    """

    quantity: str
    scenario: str
    excess: float
    speed: float | None
    layout: Layout = own
    mode: str = ""

    @property
    def told(self) -> str:
        """What is violated and by how much, in words."""
        at = "" if self.speed is None else rpm_text(self.speed) if self.speed > 0.0 else "at rest"
        scenario = f"scenario {self.scenario}" if self.scenario else ""
        where = ", ".join(filter(None, (self.mode, at, f"on {told(self.layout)}", scenario)))
        if self.quantity == "stability":
            return f"not stable ({where})"
        return f"{self.quantity.replace('_', ' ')} beyond its limit by {100.0 * self.excess:.3g} % ({where})"


@dataclass(frozen=True)
class Verified:
    """An outcome that holds, or the reasons why it does not.

    Attributes
    ----------
    outcome : Outcome
        Possibly refined.
    objective : float
        As verified, in SI units.
    audits : tuple of Audit
        On the design's own mesh and on finer ones, as far as they went; from the third on of those quantities alone that the
        two before leave open.
    excesses : tuple of Excess
        Empty if the design holds.
    rounds : int
        How often it was refined.
    proof : Proof or None
        Of the stability of the machine as drawn, on the design's own mesh; None where it cannot be proven.
    """

    outcome: Outcome
    objective: float
    audits: tuple[Audit, ...]
    excesses: tuple[Excess, ...]
    rounds: int
    proof: Proof | None = None

    @property
    def passed(self) -> bool:
        """True if every limit holds on all meshes and the stability is certified."""
        return not self.excesses


def excesses(problem: DesignProblem, found: Audit) -> list[Excess]:
    """Limits that an audit found violated.

    Parameters
    ----------
    problem : DesignProblem
    found : Audit
    """
    out = []
    for name, limit in found.stability.items():
        reach = stable_up_to(limit)
        if reach < found.end * (1.0 - TOLERANCE) or not limit.certified:
            mode = "not certified" if limit.mode is None else limit.mode.describe()
            out.append(Excess("stability", name, 1.0 - reach / found.end, reach, found.layout, mode))
    bounds = {c.quantity: c for c in problem.constraints}
    for f in found.findings:
        if f.quantity not in bounds:
            continue
        c = bounds[f.quantity]
        excess = f.value / c.bound - 1.0 if c.kind.upper else 1.0 - f.value / c.bound
        if not excess <= TOLERANCE:
            out.append(Excess(f.quantity, f.scenario, float(excess), f.speed, found.layout))
    return out


def verify(starter: Starter, outcome: Outcome) -> Verified:
    """Verify an outcome, and refine it while it fails.

    Parameters
    ----------
    starter : Starter
        Of its problem; its evaluator's margins and speeds grow with what is found.
    outcome : Outcome
    """
    problem, ev = starter.problem, starter.evaluator
    ev.begin_at(outcome.objective)
    failed: set[str] = set()
    shorter = None
    for rounds in range(ROUNDS + 1):
        objective = outcome.objective
        audits, found = _audits(starter, outcome, objective)
        if not found or rounds == ROUNDS:
            break
        for e in found:
            _tighten(starter, e, audits[0].end, e.quantity in failed)
        failed |= {e.quantity for e in found}
        x = ev.scaling.point(np.array(list(outcome.values.values())))
        again = starter.polished(outcome.index, x, ev.level(outcome.objective), radius=0.01)
        if again.status == INFEASIBLE:
            break
        if problem.seeks_speed and again.objective < RETREATS[-1] * objective:
            shorter = _shorter(starter, outcome, found)  # which costs less than this refinement
            if shorter is not None:
                break
        outcome = dataclasses.replace(
            again,
            history=[*outcome.history, *again.history],
            cpu_seconds=outcome.cpu_seconds + again.cpu_seconds,
            eigensolves=again.eigensolves,
        )
    if found and problem.seeks_speed and shorter is None:
        shorter = _shorter(starter, outcome, found)
    if shorter is not None:
        (objective, audits), found = shorter, []
    if not problem.seeks_speed:
        upper = problem.objective.kind.upper
        values = [w.value for a in audits if (w := a.worst(problem.objective.quantity, upper)) is not None]
        objective = (max if upper else min)(values)
    proof = None if found else _proven(problem, outcome, objective if problem.seeks_speed else problem.top_speed)
    return Verified(outcome, objective, tuple(audits), tuple(found), rounds, proof)


def _shorter(starter: Starter, outcome: Outcome, found: Sequence[Excess]) -> tuple[float, list[Audit]] | None:
    """The end of a shorter range of speeds for which a design holds, with its audits."""
    lost = max((e.excess for e in found if e.quantity == "stability"), default=0.0)
    if lost >= 1.0:  # unstable at rest: no range is short enough
        return None
    for factor in [1.0 - lost - 2e-4, *RETREATS] if 0.0 < lost < 0.2 else RETREATS:
        audits, excess = _audits(starter, outcome, factor * outcome.objective)
        if not excess:
            return factor * outcome.objective, audits
    return None


def _proven(problem: DesignProblem, outcome: Outcome, end: float) -> Proof | None:
    """The proof of what the audits found of stability, if there is one."""
    try:
        proof = prove_stability_limit(problem.with_values(outcome.values), max(end, problem.top_speed))
    except SolveError:
        return None
    return proof if proof.lower >= end * (1.0 - 2.0 * TOLERANCE) else None


def _audits(starter: Starter, outcome: Outcome, objective: float) -> tuple[list[Audit], list[Excess]]:
    """A design on one mesh after the other, up to the first that refutes it."""
    problem, held = starter.problem, {mesh for _, mesh in starter.evaluator.watched}
    end = objective if problem.seeks_speed else problem.top_speed
    stable: list[Audit] = []
    for layout in (own, halved):  # what fails needs no further look
        stable.append(audit(problem, outcome.values, end, layout, ()))
        if found := excesses(problem, stable[-1]):
            return stable, found
    audits: list[Audit] = []
    for known in stable:
        coarser = audits[0] if audits else None
        audits.append(audit(problem, outcome.values, end, known.layout, None, known.stability, coarser))
        if found := excesses(problem, audits[-1]):
            return audits, found
    for layout in (twice, thrice, four_times):
        if found := _unresolved(problem, outcome.values, end, layout, ELSEWHERE):
            return audits, found
    delicate = sorted({JUST_BELOW, *(min(f, JUST_BELOW) for f in _just_stable(outcome, end))})
    for layout in (quartered, in_eighths) if quartered.__name__ in held else (quartered,):
        if found := _unresolved(problem, outcome.values, end, layout, delicate):
            return audits, found
    for layout in (quartered, in_eighths):
        if not (unsettled := _unsettled(problem, *audits[-2:])):
            break
        audits.append(audit(problem, outcome.values, end, layout, unsettled, coarser=audits[0]))
        if found := excesses(problem, audits[-1]):
            return audits, found
    return audits, []


def _just_stable(outcome: Outcome, end: float) -> list[float]:
    """Fractions of the range at which stability is what limits a design."""
    return [float(row["speed"]) / end for row in outcome.active if row["quantity"] == "stability"]


@one_thread
def _unresolved(
    problem: DesignProblem, values: Mapping[str, float], end: float, layout: Layout, fractions: Sequence[float]
) -> list[Excess]:
    """Modes that break a limit on another mesh, at few speeds: those that only this mesh has hardly depend on the speed."""
    base = synthesise(problem.with_values(values))
    least = next((c.bound for c in problem.constraints if c.quantity == "decay_rate"), 0.0)
    out = []
    for case in (None, *problem.cases):
        name, machine = "" if case is None else case.name, scenario_machine(base, case)
        loop = system(machine, layout(machine))
        for fraction in fractions:
            eigenvalues = np.linalg.eigvals(loop.matrix(fraction * end))
            whirls = eigenvalues[np.abs(eigenvalues.imag) > WHIRL_FREQUENCY]
            worst = max(whirls, key=lambda e: float(e.real), default=-math.inf)
            if worst.real > -(1.0 - SETTLED) * least:
                mode = f"mode at {abs(worst.imag) / (2.0 * math.pi):.4g} Hz"
                unstable = worst.real > 0.0
                excess = 1.0 - fraction if unstable else 1.0 + float(worst.real) / least
                quantity = "stability" if unstable else "decay_rate"
                out.append(Excess(quantity, name, excess, fraction * end, layout, mode))
                break
    return out


def _unsettled(problem: DesignProblem, coarse: Audit, fine: Audit) -> set[str]:
    """Quantities that a yet finer mesh may still change by as much as matters."""
    out = set()
    bounds = {c.quantity: c for c in problem.constraints}
    for b in fine.findings:
        a = coarse.at(b.quantity, b.scenario)
        c = bounds.get(b.quantity)
        doubt, scale = AGAIN * abs(b.value - a.value), abs(b.value if c is None else c.bound)
        if doubt > SETTLED * scale and (c is None or abs(c.bound - b.value) < doubt):
            out.add(a.quantity)
    return out


def _looked_at(fraction: float, fractions: Array) -> bool:
    return bool(np.abs(fractions - fraction).min() <= BESIDE)


def _tighten(starter: Starter, e: Excess, end: float, again: bool) -> None:
    """Hold the violated quantity down at the speed where it was found, and a little further than before."""
    ev = starter.evaluator
    fraction, new = None if e.speed is None else float(np.clip(e.speed / end, 0.0, 1.0)), False
    if e.layout is not own and e.quantity in WATCHED and fraction is not None:
        ev.watch(e.scenario, e.layout, fraction)  # perhaps in a mode of the finer mesh alone
        return
    if fraction is not None and e.quantity in ("stability", "damping_ratio", "decay_rate"):
        new = not _looked_at(fraction, ev.fractions)
        ev.fractions = np.unique(np.append(ev.fractions, fraction))
    if fraction is not None and e.quantity in ("sensitivity_peak", *NOISY):
        new = not _looked_at(fraction, ev.checked)
        ev.checked = np.unique(np.append(ev.checked, fraction))
    if e.quantity == "stability":  # how much damping is missing, nobody can say
        ev.margins["stability"] = 4.0 * ev.margins.get("stability", MARGIN)
    elif not new and (
        again or e.excess < 0.05
    ):  # what comes from speeds that were not looked at is mended by looking there
        ev.margins[e.quantity] = ev.margins.get(e.quantity, 0.0) + 1.5 * e.excess + 1e-6
