"""Of starts that claim much the same, the one that keeps its claim is shown."""

from __future__ import annotations

import dataclasses

import pytest

from amb_design.optimise import solve as solving
from amb_design.optimise.start import FOUND, Effort, Outcome
from amb_design.optimise.verification import Verified
from optimise.interrupted import small_problem


@pytest.mark.parametrize(
    ("kept", "shown", "asked"),
    [
        ({0: 0.6, 1: 0.999, 2: 1.0}, 1, [0, 1]),  # the second holds: the third is the same once more
        ({0: 0.6, 1: 0.6, 2: 0.999}, 2, [0, 1, 2]),
        ({0: 0.999, 1: 1.0, 2: 1.0}, 0, [0]),
    ],
)
def test_a_start_that_breaks_down_does_not_stand_for_others(kept, shown, asked, monkeypatch):
    claims = {0: 1905.0, 1: 1904.6, 2: 1904.4}
    ranked = [Outcome(i, FOUND, {}, claim, 0.0) for i, claim in claims.items()]
    looked_at = []

    def verify(starter, outcome):
        looked_at.append(outcome.index)
        end = kept[outcome.index] * outcome.objective
        return Verified(dataclasses.replace(outcome, objective=end), end, (), (), 1)  # refined, as failing designs are

    monkeypatch.setattr(solving, "starter", lambda *_: None)
    monkeypatch.setattr(solving, "verify", verify)
    best, rejected = solving._first_verified(small_problem(), Effort(), ranked)
    assert best is not None
    assert (best.outcome.index, looked_at, rejected) == (shown, asked, ())
