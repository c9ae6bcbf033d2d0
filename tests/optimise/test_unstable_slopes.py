"""Derivatives of how unstable a mode is: its frequency counts too."""

from __future__ import annotations

import numpy as np

import amb_design as ad
from amb_design.optimise.evaluation import Case
from amb_design.optimise.measures.modes import modes, stability


def test_unstable_modes_have_exact_derivatives() -> None:
    """Of the thesis rotor at twice its stability limit, against differences."""
    problem = ad.load_problem("thesis-codesign")
    case, p = Case(problem, None), np.array(list(problem.start().values()))
    end = 2.0 * ad.stability_limit(problem.machine).speed
    found = stability(modes(case.state(p), np.array([1.0]), end))
    k = int(np.argmin(found.values))
    assert found.values[k] < 0.0

    def value(p: np.ndarray, end: float) -> float:
        eigenvalues = case.state(p).eigenvalues(np.array([end]))[0]
        nearest = eigenvalues[np.argmin(np.abs(eigenvalues - found.marks[k]))]
        return float(-nearest.real / abs(nearest.imag))

    ranges = np.array([v.upper - v.lower for v in problem.variables])
    differences = []
    for j, width in enumerate([*ranges, end]):
        step = np.zeros(len(p) + 1)
        step[j] = 1e-4 * width
        f = [value(p + m * step[:-1], end + m * step[-1]) for m in (-2, -1, 1, 2)]
        differences.append((8.0 * (f[2] - f[1]) - (f[3] - f[0])) / 12e-4)
    slopes = np.append(found.slopes[k] * ranges, found.rates[k] * end)
    np.testing.assert_allclose(differences, slopes, rtol=0.0, atol=1e-6 * np.abs(slopes).max())
