"""One start of a search: a stable point first, then few modes, then the full model."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from ..analysis.system import Array
from ..errors import SolveError
from ..spec.problem import DesignProblem
from .evaluation import LOWEST, Evaluator, Rows
from .search import Settings, Trace, search

FOUND = "optimum"
INFEASIBLE = "infeasible"
UNFINISHED = "out of evaluations"

MODES = 16
"""Modes at rest that represent the rotor while the search is far from its goal, in each plane."""

LOOKED_AT = 24
"""Random points that are looked at for each start."""

QUICK = np.array([0.0, 0.5, 1.0])
"""Fractions of the range of speeds at which a random point is looked at."""

ALMOST = 1e-4
"""Violation that verification may still mend: the search keeps every limit with a margin of this size."""

MENDING = (0.999, 0.99)
"""Parts of the speed at which a search that ended beyond its limits tries to hold them, nearby."""

SHORTER = (0.995, 0.98, 0.95, 0.9, 0.8)
"""Parts of the range of speeds that are tried where a search ends beyond its limits."""

STRICT = 1e4
"""Worth of a violation of one, in levels, to a search that does not cross what is violated on the way."""

BLIND = 0.1
"""Violation on a more faithful model beyond which the point is not taken as it is."""

LOOKS = 4
"""How often a search goes on with speeds that it had overlooked."""

COMMON = 0.3
"""Level at which random points are compared."""


@dataclass(frozen=True)
class Effort:
    """How much work a start may take, in evaluations of all conditions.

    Attributes
    ----------
    feasible : int
        To reach a point within the limits.
    coarse : int
        On few modes.
    fine : int
        On the full model.
    """

    feasible: int = 60
    coarse: int = 120
    fine: int = 180


@dataclass(frozen=True)
class Outcome:
    """What one start arrived at.

    Attributes
    ----------
    index : int
    status : {"optimum", "out of evaluations", "infeasible"}
    values : mapping of str to float
        Variables in SI units.
    objective : float
        In SI units; for infeasible starts that of the point with the least violation.
    violation : float
        Largest violation of any condition, relative to its limit; of stability in damping ratio over `LIGHT`.
    conflicts : list of dict
        For infeasible starts the conditions that hold each other back: quantity, scenario, place, violation, weight.
    active : list of dict
        Conditions that hold the optimum: quantity, scenario, place, speed, multiplier (relative gain of the objective for each
        relative unit of the limit).
    history : list of [int, float, float]
        Eigendecompositions so far, objective, violation.
    eigensolves : mapping of str to int
        Eigendecompositions by size.
    cpu_seconds : float
    """

    index: int
    status: str
    values: Mapping[str, float]
    objective: float
    violation: float
    conflicts: list[dict[str, Any]] = field(default_factory=list)
    active: list[dict[str, Any]] = field(default_factory=list)
    history: list[list[float]] = field(default_factory=list)
    eigensolves: Mapping[str, int] = field(default_factory=dict)
    cpu_seconds: float = 0.0

    def document(self) -> dict[str, Any]:
        """The outcome as data."""
        return asdict(self)


class Starter:
    """Runs starts of one problem.

    Parameters
    ----------
    problem : DesignProblem
    effort : Effort
    """

    def __init__(self, problem: DesignProblem, effort: Effort | None = None):
        self.problem, self.effort = problem, effort or Effort()
        self.evaluator = Evaluator(problem)
        self._history: list[list[float]] = []

    def run(self, seed: int, index: int) -> Outcome:
        """One start.

        Parameters
        ----------
        seed : int
        index : int
            Start 0 begins at the machine as it is and ends no worse than that is; even ones begin at the best of a few random points,
            odd ones at the best of a few half way between such points and the machine.
        """
        clock = time.process_time()
        self.evaluator.afresh()
        self._history = []
        x = self._first(seed, index)
        outcome = self._from(index, x, clock)
        return outcome if index > 0 else self._no_worse(outcome, x, clock)

    def _no_worse(self, outcome: Outcome, x: Array, clock: float) -> Outcome:
        """Long ways lead elsewhere at times: if the first point was better than the last, begin there at short steps."""
        level = self.evaluator.level(outcome.objective)
        nearly = 10.0 * ALMOST  # verified designs may miss the search's own margins
        if outcome.status == INFEASIBLE or self.evaluator.rows(x, level).worst > nearly:
            return outcome
        again = self.polished(outcome.index, x, level, clock)
        better = again.status != INFEASIBLE and self.evaluator.level(again.objective) > level
        return again if better else outcome

    def _from(self, index: int, x: Array, clock: float) -> Outcome:
        """Feasible first, then fast on few modes, then on all."""
        settings = Settings(highest=1.0 if self.problem.seeks_speed else np.inf)
        level = self.evaluator.start_level(x, self.modes)
        low = level if self.problem.seeks_speed else -1e3
        held = Settings(steps=self.effort.feasible, highest=settings.highest)
        first = (
            self._search if self.problem.seeks_speed else self._settled
        )  # a short range hides nothing between its speeds
        trace = first(x, low, held, self.modes, frozen=True)
        if not self.problem.seeks_speed:  # what the point has, for nothing was asked of it
            level = trace.level = self.evaluator.start_level(trace.x, self.modes)
        if trace.rows.worst > settings.tolerance:
            return self._outcome(index, trace, INFEASIBLE, clock)
        coarse = Settings(
            steps=self.effort.coarse, tolerance=1e-6, progress=1e-4, highest=settings.highest, level_radius=self._reach
        )
        trace = self._settled(trace.x, level, coarse, self.modes)
        if trace.rows.worst > BLIND and self.problem.seeks_speed:  # stuck: once more from below
            stuck = trace
            x, level, _ = self._entered(trace.x, 0.7 * trace.level, self.modes)
            trace = self._settled(x, level, coarse, self.modes)
            if trace.rows.worst > BLIND:  # and again: back to what held all limits
                trace = max(stuck, trace, key=lambda t: t.feasible[1] if t.feasible is not None else 0.0)
                trace.retreat()
        x, level, near = self._entered(trace.x, trace.level, None)
        return self.polished(index, x, level, clock, hessian=trace.hessian if near else None)

    @property
    def modes(self) -> int:
        """Modes of the reduced model."""
        return MODES * (1 if all(case.loops.complex_form for case in self.evaluator.cases) else 2)

    def _entered(self, x: Array, level: float, modes: int | None) -> tuple[Array, float, bool]:
        """Where to go on, at a lower speed if the limits are far from held; and whether it is where we were."""
        if not self.problem.seeks_speed:
            return x, level, True
        for factor in (1.0, 0.7, 0.4):
            if self.evaluator.rows(x, factor * level, modes).worst <= BLIND:
                return x, factor * level, factor == 1.0
        low = Settings(steps=self.effort.feasible // 3, highest=1.0)
        trace = self._search(x, LOWEST, low, modes, frozen=True)
        return trace.x, LOWEST, False

    @property
    def _reach(self) -> float:
        return 2.0 if self.problem.seeks_speed else 20.0

    def polished(
        self,
        index: int,
        x: Array,
        level: float,
        clock: float | None = None,
        radius: float = 0.03,
        hessian: Array | None = None,
    ) -> Outcome:
        """Search on the full model, from a point near its optimum.

        Parameters
        ----------
        index : int
        x : ndarray
        level : float
        clock : float, optional
            When the start began, in CPU time.
        radius : float
            First trust region.
        hessian : ndarray, optional
            Curvature learnt before.
        """
        clock = time.process_time() if clock is None else clock
        highest = 1.0 if self.problem.seeks_speed else np.inf
        fine = Settings(self.effort.fine, radius, progress=3e-5, highest=highest, level_radius=self._reach)
        trace = self._settled(x, level, fine, None, hessian=hessian)
        if trace.rows.worst > ALMOST and self.problem.seeks_speed:
            self._mend(trace)
        if trace.rows.worst > ALMOST:
            trace.retreat()
        if trace.rows.worst > ALMOST and self.problem.seeks_speed:
            self._shorten(trace)
        if trace.rows.worst > ALMOST and self.problem.seeks_speed:
            trace = self._below(trace)
        feasible = trace.rows.worst <= ALMOST
        status = FOUND if trace.status == "settled" and feasible else UNFINISHED if feasible else INFEASIBLE
        return self._outcome(index, trace, status, clock)

    def _mend(self, trace: Trace) -> None:
        """Give up a little speed so that nearby limits hold, where going back to a point that held them would cost more."""
        held = 0.0 if trace.feasible is None else trace.feasible[1]
        for factor in MENDING:
            level = factor * trace.level
            if level <= held:
                return
            close = Settings(steps=self.effort.feasible // 4, radius=0.02, highest=1.0)
            mended = self._search(trace.x, level, close, None, frozen=True)
            if mended.rows.worst <= ALMOST:
                trace.x, trace.level, trace.rows, trace.multipliers = mended.x, level, mended.rows, np.zeros(0)
                return

    def _shorten(self, trace: Trace) -> None:
        """Take the limits that are violated at the end of the range for what they are: a shorter range."""
        for factor in SHORTER:
            rows = self.evaluator.rows(trace.x, factor * trace.level)
            if rows.worst <= ALMOST:
                trace.level, trace.rows, trace.multipliers = factor * trace.level, rows, np.zeros(0)
                return

    def _below(self, trace: Trace) -> Trace:
        """Take a resonance that cannot be crossed for the end of the range: from below, in steps that cross nothing."""
        if self.evaluator.rows(trace.x, LOWEST).worst > ALMOST:
            return trace
        careful = Settings(self.effort.fine, 0.1, penalty=STRICT, least_penalty=STRICT, progress=3e-5)
        found = self._settled(trace.x, LOWEST, careful, None)
        if found.rows.worst > ALMOST:
            found.retreat()
        return found if found.rows.worst <= ALMOST else trace

    def _first(self, seed: int, index: int) -> Array:
        machine = self.evaluator.scaling.point(np.array(list(self.problem.start().values())))
        if index == 0:
            return machine
        points = np.random.default_rng([seed, index]).random((LOOKED_AT, self.evaluator.variables))
        if index % 2:  # half way to the machine, whose designer knew something
            points = (points + machine) / 2.0
        return np.asarray(min(points, key=self._glimpse))

    def _glimpse(self, x: Array) -> float:
        """How unstable a point is; infinitely so where no law can be designed."""
        try:
            return self.evaluator.worst(x, COMMON, self.modes, QUICK)
        except SolveError:
            return np.inf

    def _settled(
        self,
        x: Array,
        level: float,
        settings: Settings,
        modes: int | None,
        frozen: bool = False,
        hessian: Array | None = None,
    ) -> Trace:
        """Search until nothing is overlooked between the speeds that are looked at."""
        ev = self.evaluator
        trace = self._search(x, level, settings, modes, frozen, hessian)
        for _ in range(LOOKS):
            if trace.rows.worst > ALMOST:
                break
            fractions, checked = ev.overlooked(trace.x, trace.level, modes)
            if not len(fractions) and not len(checked):
                break
            ev.fractions, ev.checked = np.union1d(ev.fractions, fractions), np.union1d(ev.checked, checked)
            trace = self._search(trace.x, trace.level, settings, modes, frozen, trace.hessian)
        return trace

    def _search(
        self,
        x: Array,
        level: float,
        settings: Settings,
        modes: int | None,
        frozen: bool = False,
        hessian: Array | None = None,
    ) -> Trace:
        ev = self.evaluator

        def evaluate(x: Array, level: float) -> Rows:
            rows = ev.rows(x, level, modes)
            if not frozen:
                spent = sum(ev.eigensolves.values())
                self._history.append([spent, ev.objective(level), rows.worst])
            return rows

        return search(evaluate, x, level, settings, frozen, hessian)

    def _outcome(self, index: int, trace: Trace, status: str, clock: float) -> Outcome:
        ev, rows = self.evaluator, trace.rows
        excesses = ev.excesses(rows)
        held = _held(rows, excesses, trace.multipliers / (abs(trace.level) or 1.0))
        if not self.problem.seeks_speed:  # what is sought is no limit
            held = [condition for condition in held if condition["quantity"] != self.problem.objective.quantity]
        return Outcome(
            index,
            status,
            dict(zip([v.name for v in self.problem.variables], ev.scaling.values(trace.x).tolist(), strict=True)),
            ev.objective(trace.level),
            float(excesses.max(initial=0.0)),
            conflicts=held if status == INFEASIBLE else [],
            active=[] if status == INFEASIBLE else held,
            history=self._history,
            eigensolves={str(k): n for k, n in sorted(ev.eigensolves.items())},
            cpu_seconds=time.process_time() - clock,
        )


def _held(rows: Rows, excesses: Array, multipliers: Array) -> list[dict[str, Any]]:
    """Conditions with multipliers, the heaviest of each quantity and scenario first."""
    out: dict[tuple[str, str], dict[str, Any]] = {}
    if not len(multipliers):
        return []
    for i in np.argsort(-multipliers):
        if multipliers[i] <= 1e-6 * max(multipliers.max(), 1e-12):
            break
        key = rows.quantities[i], rows.scenarios[i]
        if key in out:
            out[key]["multiplier"] += float(multipliers[i])
            continue
        out[key] = {
            "quantity": key[0],
            "scenario": key[1],
            "place": rows.places[i],
            "speed": None if np.isnan(rows.speeds[i]) else float(rows.speeds[i]),
            "value": float(excesses[i]),
            "multiplier": float(multipliers[i]),
        }
    return list(out.values())
