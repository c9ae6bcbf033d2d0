"""Linear algebra runs on one thread, whatever the environment says: more make small eigenproblems many times slower."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import ThreadpoolController

import amb_design as ad
from amb_design.analysis.outline import outline
from amb_design.optimise.design import Design

CONTROLLER = ThreadpoolController()


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Threads that BLAS might use at each call of some of its functions."""
    seen: list[int] = []

    def watched(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            seen.append(max(library["num_threads"] for library in CONTROLLER.select(user_api="blas").info()))
            return function(*args, **kwargs)

        return call

    for module in (np.linalg, scipy.linalg):
        for name in ("eig", "eigh", "eigvals", "inv", "solve"):
            monkeypatch.setattr(module, name, watched(getattr(module, name)))
    return seen


def before(machine: ad.Machine) -> float:
    problem = ad.load_problem("thesis-pid").starting_at(machine)
    return Design(problem, None, (), (), 0).reach_before


CALLS: dict[str, Callable[[ad.Machine], Any]] = {
    "spectrum": lambda machine: ad.spectrum(machine, 100.0),
    "stability_limit": ad.stability_limit,
    "critical_speeds": ad.critical_speeds,
    "campbell": ad.campbell,
    "sensitivity": lambda machine: ad.sensitivity(machine, 100.0),
    "prove_stability_limit": ad.prove_stability_limit,
    "simulate": lambda machine: ad.simulate(machine, 0.01, speed=100.0),
    "synthesise": lambda machine: ad.synthesise(
        replace(machine, controller=ad.LQG.with_hardware_of(machine.controller, current=0.5, force_noise=0.1))
    ),
    "Design.reach_before": before,
}


@pytest.mark.parametrize("name", CALLS)
def test_linear_algebra_runs_on_one_thread(threads: list[int], name: str) -> None:
    machine = ad.load_optimum("thesis-pid")
    with CONTROLLER.limit(limits=2, user_api="blas"):
        CALLS[name](machine)
    assert threads
    assert set(threads) == {1}


def test_commands_run_on_one_thread(threads: list[int], run: Callable[..., tuple[int, str, str]], monkeypatch) -> None:
    def outlined(machine: ad.Machine) -> dict[str, Any]:
        np.linalg.inv(np.eye(2))
        return outline(machine)

    monkeypatch.setattr("amb_design.analysis.outline.outline", outlined)
    with CONTROLLER.limit(limits=2, user_api="blas"):
        status, _, _ = run("check", "jeffcott")
    assert status == 0
    assert threads
    assert set(threads) == {1}
