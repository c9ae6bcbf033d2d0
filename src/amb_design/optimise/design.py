"""The answer to a design problem, and what it says."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..analysis.gradient import stability_gradient
from ..analysis.stability import FOUND as LIMIT_FOUND
from ..analysis.stability import NONE, StabilityLimit
from ..errors import SolveError
from ..proof.claims import Proof, prove_stability_limit
from ..spec.machine import Machine
from ..spec.paths import numbers
from ..spec.problem import DesignProblem
from ..spec.problem_parts import Limit
from ..threads import one_thread
from .audit import Audit, audit, stable_up_to
from .evaluation import LIGHT, LOWEST, Evaluator
from .start import FOUND, INFEASIBLE, Outcome
from .verification import Verified

SUCCESS = "verified optimum"
UNCONVERGED = "verified, but the search ran out of evaluations"
REJECTED = "rejected"
CONFLICT = "infeasible"

ACTIVE = 2e-3
"""A limit is active if its quantity comes this close to it."""


def missed(quantity: str, excess: float) -> str:
    """By how much a condition was missed, in words.

    Parameters
    ----------
    quantity : str
    excess : float
        As in `Outcome.conflicts`.
    """
    if quantity == "stability":
        return f"a damping ratio of {LIGHT * excess:.2g}"
    return f"{100.0 * excess:.3g} %"


@dataclass(frozen=True)
class LimitRow:
    """One limit of a design.

    Attributes
    ----------
    quantity, unit : str
    upper : bool
    bound : float
    value : float
        The worst over scenarios, speeds and meshes.
    speed : float or None
        Where [rad/s].
    scenario : str
    active : bool
    worth : float
        Relative gain of the objective for each relative unit by which the limit is eased.
    """

    quantity: str
    unit: str
    upper: bool
    bound: float
    value: float
    speed: float | None
    scenario: str
    active: bool
    worth: float


@dataclass(frozen=True)
class Design:
    """Result of `solve`.

    Attributes
    ----------
    problem : DesignProblem
    best : Verified or None
        None if no start could be verified.
    rejected : tuple of Verified
        Better ranked outcomes that verification refused.
    outcomes : tuple of Outcome
        All starts, ranked.
    seed : int
    """

    problem: DesignProblem
    best: Verified | None
    rejected: tuple[Verified, ...]
    outcomes: tuple[Outcome, ...]
    seed: int

    @property
    def verified(self) -> bool:
        """True if every limit holds on the full model and on finer meshes, and stability is certified on all of them."""
        return self.best is not None

    @property
    def status(self) -> str:
        """ "verified optimum", "verified, but the search ran out of evaluations", "rejected" or "infeasible"."""
        if self.best is None:
            return REJECTED if self.rejected else CONFLICT
        return SUCCESS if self.best.outcome.status == FOUND else UNCONVERGED

    @property
    def values(self) -> Mapping[str, float]:
        """Variables in SI units; those of the start if there is no design."""
        return self.best.outcome.values if self.best else self.problem.start()

    @property
    def machine(self) -> Machine:
        """The machine with the design's numbers."""
        return self.problem.with_values(self.values)

    @cached_property
    def proof(self) -> Proof:
        """Proof of the stability limit of the design's machine, on its own mesh.

        Raises
        ------
        SolveError
            If there is no design, or its stability limit cannot be proven.
        """
        if self.best is None:
            raise SolveError(f"{self.problem.name}: {self.status}: there is nothing to prove")
        return self.best.proof or prove_stability_limit(self.machine)

    @property
    def objective(self) -> float:
        """Verified value of the objective in SI units; NaN if there is no design."""
        return self.best.objective if self.best else math.nan

    @property
    def end(self) -> float:
        """End of the range of speeds over which all limits hold [rad/s]."""
        return self.objective if self.problem.seeks_speed else self.problem.top_speed

    @property
    def stability_limit(self) -> StabilityLimit | None:
        """Certified stability limit of the machine as drawn; it may lie beyond `end`, where other limits bind."""
        return self.best.audits[0].stability[""] if self.best else None

    @cached_property
    def limits(self) -> tuple[LimitRow, ...]:
        """Every limit with its worst value, those that are worth most first."""
        if self.best is None:
            return ()
        rows = [self._row(c) for c in self.problem.constraints]
        return tuple(sorted(rows, key=lambda r: (not r.active, -abs(r.worth), r.quantity)))

    def _row(self, c: Limit) -> LimitRow:
        assert self.best is not None
        upper = c.kind.upper
        found = [w for a in self.best.audits if (w := a.worst(c.quantity, upper)) is not None]
        worst = (max if upper else min)(found, key=lambda f: f.value)
        near = worst.value / c.bound - 1.0 if upper else 1.0 - worst.value / c.bound
        weight = sum(a["multiplier"] for a in self.best.outcome.active if a["quantity"] == c.quantity)
        active = near > -ACTIVE and (weight > 0.0 or near > -0.5 * ACTIVE)
        return LimitRow(
            c.quantity,
            c.kind.unit,
            upper,
            c.bound,
            worst.value,
            worst.speed,
            worst.scenario,
            active,
            weight if active else 0.0,
        )

    @cached_property
    def sensitivities(self) -> tuple[tuple[str, float], ...]:
        """Exact relative derivatives of the stability limit: per cent of speed for a per cent of the number, the largest first.

        Every number of the machine that can be varied by itself is there; angles count per radian. Empty if no mode becomes
        unstable below the top speed.
        """
        limit = self.stability_limit
        if limit is None or limit.status != LIMIT_FOUND:
            return ()
        machine = self.machine
        values = dict(numbers(machine))
        out = []
        for path, slope in stability_gradient(machine, limit.mode).items():
            size = 1.0 if path.endswith("angle") else abs(float(values[path]))
            out.append((path, float(slope) * size / limit.speed))
        return tuple(sorted(out, key=lambda item: -abs(item[1])))

    @cached_property
    def before(self) -> Audit:
        """The machine as it was, up to the design's own speed or as far as it is stable."""
        problem = self.problem.as_drawn()
        start = problem.start()
        limit = audit(problem, start, problem.top_speed * 1e-6, quantities=()).stability[""]
        reach = stable_up_to(limit) * (1.0 if limit.status == NONE else 0.99)
        end = self.end if self.best is not None else problem.top_speed
        return audit(problem, start, max(min(end, reach), 1e-6 * problem.top_speed))

    def explanation(self) -> str:
        """In one sentence why there is no verified design; empty if there is one."""
        if self.verified:
            return ""
        if self.rejected:
            worst = max(self.rejected[0].excesses, key=lambda e: e.excess)
            return f"verification refused it: {worst.told}"
        told = [
            f"{c['quantity'].replace('_', ' ')} by {missed(c['quantity'], c['value'])} ({c['place']})"
            for c in self.conflicts
        ]
        what = " against ".join(told) or f"all of them, by {100.0 * self.outcomes[0].violation:.3g} % at best"
        return f"limits that cannot be held together: {what}"

    @cached_property
    @one_thread
    def reach_before(self) -> float:
        """Speed up to which the machine as it was is stable and within all limits [rad/s], as the search sees it."""
        if not self.problem.seeks_speed:
            return math.nan
        problem = self.problem.as_drawn()
        evaluator = Evaluator(problem)
        evaluator.fractions = evaluator.checked = np.array([0.0, 1.0])  # what lies between has been an end before
        x = evaluator.scaling.point(np.array(list(problem.start().values())))

        def held(level: float) -> bool:
            return evaluator.rows(x, level).worst <= 0.0

        grid = np.linspace(LOWEST, 1.0, 40)
        last = next((i for i, level in enumerate(grid) if not held(float(level))), len(grid)) - 1
        if last < 0:
            return 0.0
        if last == len(grid) - 1:
            return self.problem.top_speed
        low, high = float(grid[last]), float(grid[last + 1])
        for _ in range(8):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if held(middle) else (low, middle)
        return low * self.problem.top_speed

    @property
    def eigensolves(self) -> dict[str, int]:
        """Eigendecompositions of all starts, by size of the matrix."""
        total: dict[str, int] = {}
        for outcome in self.outcomes:
            for size, count in outcome.eigensolves.items():
                total[size] = total.get(size, 0) + count
        return total

    @property
    def conflicts(self) -> list[dict[str, Any]]:
        """Which conditions hold each other back where no start became feasible, of the start that came closest."""
        worst = self.outcomes[0]
        return worst.conflicts if worst.status == INFEASIBLE else []
