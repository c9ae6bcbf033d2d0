"""Sequential quadratic programming in a trust region, for a level to be maximised under many smooth conditions.

Each step linearises all conditions near the current point, whatever modes, speeds and frequencies they come from. The
curvature of the active ones is learnt from their exact gradients at successive points: the same mode or peak is recognised
at both. A penalty on the largest violation keeps every subproblem solvable. Conditions found at rejected points
stay as cuts until a step is accepted, so that a mode that shows up only further along is not forgotten.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..errors import SolveError
from .evaluation import Rows

Evaluate = Callable[[Array, float], Rows]

SOFT = 1e-6
"""Least curvature of a subproblem, which makes its solution unique."""


@dataclass(frozen=True)
class Settings:
    """How long and how finely to search.

    Attributes
    ----------
    steps : int
        Largest number of evaluations.
    radius : float
        First half width of the trust region, of the unit cube.
    smallest : float
        The search ends when the trust region is smaller.
    level_radius : float
        Largest change of the level in a step, over the radius.
    penalty : float
        Worth of a violation of one, in levels, to begin with.
    least_penalty : float
        Its least value.
    tolerance : float
        Violation that counts as none.
    progress : float
        The search ends when three steps in a row bring less than this part of the level.
    highest : float
        Largest level.
    curvature : bool
        Learn the curvature of the active conditions; without it the subproblems are linear programs in effect.
    """

    steps: int = 80
    radius: float = 0.15
    smallest: float = 1e-5
    level_radius: float = 2.0
    penalty: float = 3.0
    least_penalty: float = 0.05
    tolerance: float = 1e-7
    progress: float = 1e-5
    highest: float = 1.0
    curvature: bool = True


@dataclass
class Trace:
    """One search.

    Attributes
    ----------
    x : ndarray
    level : float
    rows : Rows
        At the last accepted point.
    status : str
    history : list of (int, float, float)
        Evaluations so far, level, and worst violation of each accepted point.
    evaluations : int
    multipliers : ndarray
        Of the rows at the last point: levels per unit of each condition.
    feasible : tuple or None
        Point, level and rows of the best point without violations.
    hessian : ndarray or None
        Curvature of the active conditions, as far as it was learnt.
    """

    x: Array
    level: float
    rows: Rows
    status: str = "running"
    history: list[tuple[int, float, float]] = field(default_factory=list)
    evaluations: int = 1
    multipliers: Array = field(default_factory=lambda: np.zeros(0))
    feasible: tuple[Array, float, Rows] | None = None
    hessian: Array | None = None

    def see(self, x: Array, level: float, rows: Rows, tolerance: float) -> None:
        """Remember the best point without violations."""
        if rows.worst <= tolerance and (self.feasible is None or level > self.feasible[1]):
            self.feasible = x, level, rows

    def retreat(self) -> None:
        """Go back to the best point without violations, if the last one has some."""
        if self.feasible is not None and self.feasible[1] > 0.0:
            self.x, self.level, self.rows = self.feasible
            self.multipliers = np.zeros(0)


def search(
    evaluate: Evaluate,
    x: Array,
    level: float,
    settings: Settings,
    frozen_level: bool = False,
    hessian: Array | None = None,
) -> Trace:
    """Maximise the level, or with a frozen level remove violations.

    Parameters
    ----------
    evaluate : callable
        Rows at (x, level). Steps to where it raises a SolveError are taken shorter.
    x : ndarray
        Start in the unit cube.
    level : float
        Start.
    settings : Settings
    frozen_level : bool
        Keep the level and minimise the largest violation instead, until there is none.
    hessian : ndarray, shape (variables + 1, variables + 1), optional
        Curvature learnt before.
    """
    rows = evaluate(x, level)
    trace = Trace(x, level, rows, history=[(1, level, rows.worst)])
    trace.see(x, level, rows, 10.0 * settings.tolerance)
    radius, penalty, idle = settings.radius, settings.penalty, 0
    hessian = np.zeros((len(x) + 1, len(x) + 1)) if hessian is None else hessian
    cuts: list[tuple[Array, Array]] = []  # of rejected points: value at z = 0, and slope
    while trace.evaluations < settings.steps:
        if frozen_level and trace.rows.worst <= 0.0:
            trace.status = "feasible"
            return trace
        if radius < settings.smallest or idle >= 3:
            trace.status = "settled"
            return trace
        violation = trace.rows.worst if frozen_level else max(trace.rows.worst, 0.0)
        program = _Program(trace, cuts, radius, settings, hessian, frozen_level)
        step, slack, multipliers = program.solve(penalty)
        if cuts and slack > 0.3 * violation + settings.tolerance:  # cuts contradict each other: forget them
            cuts, radius = [], 0.5 * radius
            continue
        while not frozen_level and slack > 0.3 * violation + settings.tolerance and penalty < 1e5:
            penalty *= 4.0  # a weak penalty trades violation for speed
            step, smaller, multipliers = program.solve(penalty)
            if smaller > 0.9 * slack:
                break
            slack = smaller
        trace.multipliers = multipliers
        if slack <= settings.tolerance:  # no more than what the conditions are worth
            penalty = max(settings.least_penalty, 2.0 * program.worth, 0.5 * penalty)
        gain = 0.0 if frozen_level else step[-1] - 0.5 * step @ hessian @ step
        predicted = gain + (1.0 if frozen_level else penalty) * (violation - slack)
        if not predicted > 1e-3 * settings.progress:
            cuts, radius = [], 0.25 * radius
            continue
        new_x, new_level = np.clip(trace.x + step[:-1], 0.0, 1.0), float(trace.level + step[-1])
        trace.evaluations += 1
        try:
            rows = evaluate(new_x, new_level)
        except SolveError:  # no law can be designed there
            cuts, radius = [], 0.25 * radius
            continue
        trace.see(new_x, new_level, rows, 10.0 * settings.tolerance)
        after = rows.worst if frozen_level else max(rows.worst, 0.0)
        won = (0.0 if frozen_level else step[-1]) + (1.0 if frozen_level else penalty) * (violation - after)
        ratio = won / predicted
        if settings.curvature and not frozen_level:
            trace.hessian = hessian = _learnt(hessian, step, trace.rows, rows, multipliers)
        if ratio > 0.05:
            small = won < settings.progress * max(abs(trace.level), 1e-3)
            idle = idle + 1 if small and after <= 100.0 * settings.tolerance else 0
            trace.x, trace.level, trace.rows = new_x, new_level, rows
            trace.history.append((trace.evaluations, new_level, rows.worst))
            cuts = []
            if ratio > 0.6:
                radius = min(2.0 * radius, 0.5)
            elif ratio < 0.2:
                radius *= 0.5
        else:
            z = np.append(new_x, new_level)
            near = rows.values > -0.05
            cuts = [*cuts[-3:], (rows.values[near] - rows.slopes[near] @ z, rows.slopes[near])]
            if len(cuts) > 1:  # the first cut alone corrects for curvature
                used = max(float(np.abs(step[:-1]).max(initial=0.0)), abs(float(step[-1])) / settings.level_radius)
                radius = 0.4 * min(radius, used)
    trace.status = "out of evaluations"
    return trace


class _Program:
    """The quadratic program of one step: minimise -dlevel + d H d/2 + penalty slack."""

    def __init__(
        self,
        trace: Trace,
        cuts: list[tuple[Array, Array]],
        radius: float,
        settings: Settings,
        hessian: Array,
        frozen: bool,
    ):
        n, rows = len(trace.x), trace.rows
        self.frozen, self.own, self.worth = frozen, len(rows.values), 0.0
        z = np.append(trace.x, trace.level)
        values = np.concatenate([rows.values, *[v + s @ z for v, s in cuts]])
        slopes = np.vstack([rows.slopes, *[s for _, s in cuts]])
        wide = min(settings.level_radius * radius, 1e3)
        reach = np.abs(slopes[:, :n]).sum(axis=1) * radius + np.abs(slopes[:, n]) * (0.0 if frozen else wide)
        least = rows.worst - 0.5 * abs(rows.worst) if frozen else 0.0
        self.active = np.flatnonzero(values + 1.5 * reach > least)
        self.scale = np.maximum(np.abs(slopes[self.active]).max(axis=1, initial=0.0), 0.1)
        self.matrix = np.hstack([slopes[self.active], -np.ones((len(self.active), 1))]) / self.scale[:, None]
        self.unit = (
            radius  # the program is solved in units of the radius, so that small steps are as exact as large ones
        )
        self.bound = -values[self.active] / self.scale / radius
        up = 0.0 if frozen else max(min(wide, settings.highest - trace.level), 0.0)
        down = 0.0 if frozen else min(wide, trace.level if np.isfinite(settings.highest) else np.inf)
        self.lower = np.concatenate([np.maximum(-radius, -trace.x), [-down, -1e3 if frozen else 0.0]]) / radius
        self.upper = np.concatenate([np.minimum(radius, 1.0 - trace.x), [up, 1e3]]) / radius
        self.hessian = np.zeros((n + 2, n + 2))
        self.hessian[: n + 1, : n + 1] = hessian * radius
        self.hessian += SOFT * np.eye(n + 2)

    def solve(self, penalty: float) -> tuple[Array, float, Array]:
        """Step, slack, and multipliers of the point's own rows."""
        n = len(self.lower) - 2
        cost = np.zeros(n + 2)
        cost[n], cost[n + 1] = (0.0, 1.0) if self.frozen else (-1.0, penalty)
        count = -(-max(len(self.active), 1) // 32) * 32
        matrix, bound = np.zeros((count, n + 2)), np.full(count, np.inf)
        matrix[: len(self.active)], bound[: len(self.active)] = self.matrix, self.bound
        solver = _solver(n + 2, count)
        found = solver(h=self.hessian, g=cost, a=matrix, lba=-np.inf, uba=bound, lbx=self.lower, ubx=self.upper)
        solution = found["x"].full()[:, 0]
        multipliers = np.zeros(self.own)
        if not solver.stats()["success"] or not np.isfinite(solution).all():
            return np.zeros(n + 1), np.inf, multipliers
        own = self.active < self.own
        dual = found["lam_a"].full()[: len(self.active), 0] / self.scale
        self.worth = float(np.maximum(dual, 0.0).sum())
        multipliers[self.active[own]] = np.maximum(dual[own], 0.0)
        step = self.unit * np.clip(solution, self.lower, self.upper)
        return step[: n + 1], float(step[n + 1]), multipliers


@lru_cache(maxsize=64)
def _solver(variables: int, rows: int) -> Any:
    shapes = {"h": ca.Sparsity.dense(variables, variables), "a": ca.Sparsity.dense(rows, variables)}
    return ca.conic("step", "daqp", shapes, {"error_on_fail": False})


def _learnt(hessian: Array, step: Array, old: Rows, new: Rows, multipliers: Array) -> Array:
    """Damped BFGS update with the change of the Lagrangian's gradient over the conditions found at both points."""
    change = np.zeros(len(step))
    index: dict[Any, list[int]] = {}
    for i, key in enumerate(new.keys):
        index.setdefault(key, []).append(i)
    for i in np.flatnonzero(multipliers > 1e-9).tolist():
        candidates = index.get(old.keys[i], [])
        if not candidates:
            continue
        distances = np.abs(new.marks[candidates] - old.marks[i])
        j = candidates[int(np.argmin(distances))]
        if distances.min() <= 0.3 * abs(old.marks[i]) + 1e-12:
            change += multipliers[i] * (new.slopes[j] - old.slopes[i])
    size = step @ step
    if size < 1e-24 or not np.isfinite(change).all():
        return hessian
    curvature = step @ change
    if not hessian.any():
        if curvature <= 0.0:
            return hessian
        hessian = np.eye(len(step)) * min(curvature / size, change @ change / curvature)
    image = hessian @ step
    along = step @ image
    if along <= 0.0:
        return hessian
    if curvature < 0.2 * along:  # Powell's damping keeps the matrix positive definite
        theta = 0.8 * along / (along - curvature)
        change = theta * change + (1.0 - theta) * image
        curvature = step @ change
    updated = hessian - np.outer(image, image) / along + np.outer(change, change) / curvature
    return np.asarray((updated + updated.T) / 2.0)
