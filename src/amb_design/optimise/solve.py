"""Many starts side by side, ranked; the best that can be verified is the answer."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context, parent_process
from pathlib import Path
from threading import Thread
from typing import Any

from ..errors import SpecError
from ..spec.problem import DesignProblem
from ..threads import one_thread
from .design import Design
from .start import INFEASIBLE, Effort, Outcome, Starter
from .verification import MARGIN, Verified, verify

FORMAT = "amb_design/start/2"

Report = Callable[[Outcome], None]


SAME = 1e-3
"""Starts that claim objectives so close to each other count as one optimum."""

KEPT = 5e-3
"""An optimum that lost less in verification is as good as it claimed; one that lost more may have a better one beside it."""


@one_thread
def solve(
    problem: DesignProblem,
    starts: int = 8,
    seed: int = 0,
    *,
    workers: int = 1,
    effort: Effort | None = None,
    folder: str | os.PathLike[str] | None = None,
    resume: bool = False,
    report: Report | None = None,
) -> Design:
    """Solve a design problem from several starts, and verify the best.

    Parameters
    ----------
    problem : DesignProblem
    starts : int
        The first begins at the machine as it is, the others at random points or half way to them.
    seed : int
        Of the random points. Equal seeds give equal results, whatever the number of workers.
    workers : int
        Processes.
    effort : Effort, optional
        Evaluations a start may take.
    folder : str or path, optional
        Where finished starts are kept as they arrive.
    resume : bool
        Take finished starts from the folder instead of running them again.
    report : callable, optional
        Called with each outcome as it arrives.

    Returns
    -------
    Design
        Its ``verified`` says whether it may be believed; `Design.conflicts` what is in the way if there is none.

    Raises
    ------
    SpecError
        If the folder holds starts of another problem.
    """
    if starts < 1:
        raise SpecError("must be at least 1", field="starts", got=starts, remedy="8 suits most problems")
    effort = effort or Effort()
    outcomes = dict(_kept(problem, seed, effort, folder)) if resume and folder is not None else {}
    outcomes = {i: o for i, o in outcomes.items() if i < starts}
    if folder is not None:
        Path(folder).mkdir(parents=True, exist_ok=True)
        if not resume:
            for file in Path(folder).glob("start-*.json"):
                file.unlink()
    for outcome in outcomes.values():
        if report:
            report(outcome)
    missing = [i for i in range(starts) if i not in outcomes]
    for outcome in _run(problem, seed, effort, missing, workers):
        outcomes[outcome.index] = outcome
        if folder is not None:
            _keep(problem, seed, effort, outcome, Path(folder))
        if report:
            report(outcome)
    ranked = rank(problem, outcomes.values())
    return Design(problem, *_first_verified(problem, effort, ranked), tuple(ranked), seed)


def rank(problem: DesignProblem, outcomes: Any) -> list[Outcome]:
    """Outcomes, the best first; feasible before infeasible, equal ones in the order of their starts."""
    sign = 1.0 if problem.objective.kind.upper else -1.0

    def key(o: Outcome) -> tuple[Any, ...]:
        if o.status == INFEASIBLE:
            return (True, o.violation, o.index)
        return (False, sign * o.objective, o.index)

    return sorted(outcomes, key=key)


def starter(problem: DesignProblem, effort: Effort) -> Starter:
    """A starter with the margins that verification wants."""
    made = Starter(problem, effort)
    made.evaluator.margins = {"stability": MARGIN, **{c.quantity: MARGIN for c in problem.constraints}}
    return made


def _first_verified(
    problem: DesignProblem, effort: Effort, ranked: list[Outcome]
) -> tuple[Verified | None, tuple[Verified, ...]]:
    sign = 1.0 if problem.objective.kind.upper else -1.0
    best: Verified | None = None
    rejected: list[Verified] = []
    settled: list[float] = []  # claims that held
    for outcome in ranked:
        if outcome.status == INFEASIBLE:
            break
        if any(abs(outcome.objective - claim) <= SAME * abs(claim) for claim in settled):
            continue  # the same optimum once more
        if best is not None and sign * best.objective <= sign * outcome.objective:
            break  # the next one claims no more than what has been verified
        verified = verify(starter(problem, effort), outcome)
        if verified.passed and abs(verified.objective - outcome.objective) <= KEPT * abs(outcome.objective):
            settled.append(outcome.objective)
        if not verified.passed:
            rejected.append(verified)
        elif best is None or sign * verified.objective < sign * best.objective:
            best = verified
    return best, tuple(rejected)


def _run(problem: DesignProblem, seed: int, effort: Effort, indices: list[int], workers: int) -> Iterator[Outcome]:
    if min(workers, len(indices)) <= 1:
        made = starter(problem, effort)
        for i in indices:
            yield made.run(seed, i)
        return
    with ProcessPoolExecutor(
        min(workers, len(indices)), mp_context=get_context("spawn"), initializer=_follow_parent
    ) as pool:
        futures = [pool.submit(_one, problem, seed, effort, i) for i in indices]
        try:
            for future in as_completed(futures):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _follow_parent() -> None:
    """End a worker whose parent was killed: it would wait for work forever."""
    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    Thread(target=watch, daemon=True).start()


_made: dict[str, Starter] = {}


@one_thread
def _one(problem: DesignProblem, seed: int, effort: Effort, index: int) -> Outcome:
    key = fingerprint(problem, seed, effort)
    if key not in _made:  # a worker builds the model once
        _made.clear()
        _made[key] = starter(problem, effort)
    return _made[key].run(seed, index)


def fingerprint(problem: DesignProblem, seed: int, effort: Effort) -> str:
    """What identifies the starts of a problem."""
    from .. import __version__

    parts = (problem.machine, problem.objective, problem.variables, problem.followers, problem.constraints)
    text = repr((__version__, parts, problem.patterns, problem.cases, problem.speed, seed, effort))
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def _keep(problem: DesignProblem, seed: int, effort: Effort, outcome: Outcome, folder: Path) -> None:
    """Write a start so that an interruption leaves either all of it or nothing."""
    document = {"format": FORMAT, "problem": fingerprint(problem, seed, effort), "outcome": outcome.document()}
    file = folder / f"start-{outcome.index:04d}.json"
    partial = file.with_suffix(".partial")
    partial.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    os.replace(partial, file)


def _kept(
    problem: DesignProblem, seed: int, effort: Effort, folder: str | os.PathLike[str]
) -> Iterator[tuple[int, Outcome]]:
    key = fingerprint(problem, seed, effort)
    for file in sorted(Path(folder).glob("start-*.json")):
        try:
            document: Mapping[str, Any] = json.loads(file.read_text(encoding="utf-8"))
            outcome = Outcome(**document["outcome"])
        except (OSError, ValueError, KeyError, TypeError):
            raise SpecError(
                "is no finished start", file=str(file), remedy="remove it, or start again without --resume"
            ) from None
        if document.get("format") != FORMAT or document.get("problem") != key:
            raise SpecError(
                "belongs to another problem, seed or version",
                file=str(file),
                remedy="name another folder, or start again without --resume",
            )
        yield outcome.index, outcome
