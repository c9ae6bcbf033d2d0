"""The example on eigenvalue optimisation runs and prints what the page says."""

from __future__ import annotations

import doctest
import re
from pathlib import Path

import pytest

from amb_design.optimise import abscissa, stable_speed

PAGE = (Path(__file__).parents[2] / "docs" / "eigenvalue-optimisation.md").read_text(encoding="utf-8")


def test_page(capsys: pytest.CaptureFixture[str]) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    (printed,) = re.findall(r"```text\n(.*?)```", PAGE, flags=re.DOTALL)
    exec(compile(code, "eigenvalue-optimisation.md", "exec"), {})
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize("module", [abscissa, stable_speed])
def test_docstrings(module) -> None:
    assert doctest.testmod(module).failed == 0
