"""Somebody else's optimal control around our equations of motion arrives where our simulation agrees."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "optimal-run-up.md").read_text(encoding="utf-8")


def test_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    known: dict = {}
    with mpl.rc_context({"backend": "agg"}):
        for block in re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL):
            exec(compile(block, "optimal-run-up.md", "exec"), known)
        mpl.pyplot.close("all")
    knots, profile, claimed = known["knots"], known["profile"], known["claimed"]
    accelerations = np.diff(profile) / np.diff(knots)
    assert -1.0 < accelerations.min() < accelerations.max() < known["fastest"] + 1.0
    assert profile[-1] == pytest.approx(known["top"], rel=1e-3)
    needed, before = known["needed"].max(), known["before"].max()
    assert needed == pytest.approx(claimed, rel=0.02)  # eight modes, another integrator
    assert known["simulated"](knots, profile, 2)[1].max() == pytest.approx(claimed, rel=0.02)
    assert needed < 0.65 * before
    assert known["best"].saturations == known["usual"].saturations == ()
    assert (tmp_path / "run_up.png").stat().st_size > 10_000
