"""What is said of an observer that makes the machine unstable: which mode, and what it does not know."""

from __future__ import annotations

import pytest

import amb_design as ad
from synthesis.levitated import lqg, rotor


@pytest.mark.parametrize(
    ("law", "said", "remedy"),
    [
        (lqg(modes=2), "Designed with 2 modes, the law makes the", "Raise controller.modes"),
        (lqg(order=4), "Designed with 5 modes and truncated to 4 states, the law makes the", "Raise controller.order"),
    ],
)
def test_spillover_names_its_cause(law: ad.LQG, said: str, remedy: str) -> None:
    machine = rotor(law)
    texts = [f.text for f in ad.findings(machine) if f.topic == "spillover"]
    (text,) = texts
    assert text.startswith(said)
    assert remedy in text
    assert "unstable at 2865 rpm" in text
