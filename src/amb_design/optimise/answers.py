"""Questions around an optimum: what would easing a limit bring, and what does one quantity cost in terms of another?"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SolveError
from ..spec.problem import DesignProblem
from ..threads import one_thread
from .design import Design
from .solve import starter
from .start import INFEASIBLE, Effort, Outcome
from .verification import Verified, verify


@dataclass(frozen=True)
class Relaxation:
    """What easing one limit brings.

    Attributes
    ----------
    quantity : str
    bound, eased : float
        SI units.
    predicted, solved : float
        Objective in SI units: from the multipliers, and from a new solution; NaN if that could not be verified.
    """

    quantity: str
    bound: float
    eased: float
    predicted: float
    solved: float


@dataclass(frozen=True)
class ParetoPoint:
    """One compromise between the objective and a limited quantity.

    Attributes
    ----------
    bound : float
        Limit of the quantity [SI].
    objective : float
        SI units; NaN if no verified design was found.
    values : mapping of str to float
        Variables.
    """

    bound: float
    objective: float
    values: Mapping[str, float]


@one_thread
def relaxations(
    design: Design,
    easing: float = 0.1,
    quantities: Sequence[str] | None = None,
    report: Callable[[Relaxation], None] | None = None,
) -> tuple[Relaxation, ...]:
    """Ease each active limit in turn and solve again from the optimum.

    Parameters
    ----------
    design : Design
    easing : float
        By how much, relative to the limit.
    quantities : sequence of str, optional
        All active limits if left out.
    report : callable, optional
        Called with each relaxation as it arrives.

    Returns
    -------
    tuple of Relaxation
        Those that bring most first.

    Raises
    ------
    SolveError
        If there is no verified design to begin with.
    """
    _demand(design)
    chosen = [r for r in design.limits if (r.active if quantities is None else r.quantity in quantities)]
    out = []
    for row in chosen:
        eased = row.bound * (1.0 + easing if row.upper else 1.0 - easing)
        found = _again(design.problem.with_limit(row.quantity, eased), design.values, design.objective)
        predicted = design.objective * (1.0 + _sign(design.problem) * row.worth * easing)
        solved = found.objective if found is not None and found.passed else np.nan
        out.append(Relaxation(row.quantity, row.bound, eased, predicted, solved))
        if report:
            report(out[-1])
    return tuple(sorted(out, key=lambda r: -_sign(design.problem) * np.nan_to_num(r.solved)))


@one_thread
def pareto(
    design: Design,
    quantity: str,
    bounds: Sequence[float],
    report: Callable[[ParetoPoint], None] | None = None,
) -> tuple[ParetoPoint, ...]:
    """Trade the objective against a quantity, by continuation from the design.

    Parameters
    ----------
    design : Design
    quantity : str
        Any quantity that can be limited: ``"bias_current"``, ``"mass"``, ``"copper_loss"``, ``"sensitivity_peak"``.
    bounds : sequence of float
        Limits of the quantity [SI], one compromise each.
    report : callable, optional
        Called with each point as it arrives.

    Returns
    -------
    tuple of ParetoPoint
        In the order of `bounds`, each verified like any other design.

    Raises
    ------
    SolveError
        If there is no verified design to begin with.
    SpecError
        If the quantity does not exist in this problem.
    """
    _demand(design)
    upper = design.problem.with_limit(quantity, float(bounds[0])).constraints[-1].kind.upper
    points: dict[float, ParetoPoint] = {}
    values, objective = dict(design.values), design.objective
    for bound in sorted(map(float, bounds), reverse=upper):  # from the loosest to the tightest
        found = _again(design.problem.with_limit(quantity, bound), values, objective)
        if found is not None and found.passed:
            values, objective = dict(found.outcome.values), found.objective
            points[bound] = ParetoPoint(bound, objective, values)
        else:
            points[bound] = ParetoPoint(bound, np.nan, {})
        if report:
            report(points[bound])
    return tuple(points[float(b)] for b in bounds)


def _demand(design: Design) -> None:
    if not design.verified:
        raise SolveError(f"{design.problem.name}: {design.status}; there is no design to ask about")


def _sign(problem: DesignProblem) -> float:
    return -1.0 if problem.objective.kind.upper else 1.0


def _again(problem: DesignProblem, values: Mapping[str, float], objective: float) -> Verified | None:
    """Solve from a design for a problem with another limit: feasible again first, then better."""
    made = starter(problem, Effort())
    x = made.evaluator.scaling.point(np.array(list(values.values())))
    level = objective / problem.top_speed if problem.seeks_speed else made.evaluator.start_level(x, None)
    outcome: Outcome = made.polished(0, x, level, radius=0.1)
    return None if outcome.status == INFEASIBLE else verify(made, outcome)
