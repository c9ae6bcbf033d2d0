"""Searches go round designs for which no law can be designed."""

from __future__ import annotations

import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise.evaluation import Rows
from amb_design.optimise.search import Settings, search
from amb_design.optimise.start import Starter
from synthesis.levitated import lqg, rotor


def test_a_search_comes_close_to_where_laws_end() -> None:
    """The level may be as high as x, but there is no law beyond 0.7."""

    def evaluate(x: np.ndarray, level: float) -> Rows:
        if x[0] > 0.7:
            raise ad.SolveError("the Riccati equation has no stabilising solution")
        names, one = ("bound",), np.zeros(1)
        return Rows(one + level - x[0], np.array([[-1.0, 1.0]]), names, ("",), ("",), one, (("bound",),), one + 0j)

    found = search(evaluate, np.array([0.2]), 0.1, Settings())
    assert 0.69 < found.level <= 0.7


def test_random_points_without_a_law_are_no_starts() -> None:
    """Designed for two states the law ends where a third one does not stand without control: beyond about 17 000 rpm."""
    problem = ad.DesignProblem(
        rotor(lqg(order=2)),
        maximise="stability_limit",
        free={"controller.design_speed": (ad.rpm(1e3), ad.rpm(60e3)), "controller.current": (0.1, 10.0, "log")},
    )
    starter = Starter(problem)
    with pytest.raises(ad.SolveError, match="order = 2 keeps fewer than the 4 states"):
        starter.evaluator.worst(np.array([1.0, 0.5]), 0.1, starter.modes, np.zeros(1))
    for index in (1, 2, 3):
        x = starter._first(0, index)
        starter.evaluator.worst(x, 0.1, starter.modes, np.zeros(1))  # there is a law
        assert x[0] < 0.5
