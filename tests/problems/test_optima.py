"""The stored optima of the packaged problems hold, and a short search still finds its way."""

from __future__ import annotations

import tomllib

import pytest

import amb_design as ad
from amb_design.optimise.audit import audit
from amb_design.optimise.meshes import halved, own
from amb_design.optimise.solve import starter
from amb_design.optimise.start import INFEASIBLE, Effort
from amb_design.optimise.verification import excesses

FOLDERS = {name: folder for name, folder in ad.packaged().items() if (folder / "problem.toml").is_file()}
OPTIMA = {
    (name, variant): optimum
    for name, folder in FOLDERS.items()
    if (folder / "optimum.toml").is_file()
    for variant, optimum in tomllib.loads((folder / "optimum.toml").read_text(encoding="utf-8"))["optima"].items()
}

COMPARED = {name for name in FOLDERS if name.endswith("-vs-lqg")}
"""Their base problems are those of their parents with one limit more; what is new in them are the variants."""

SHORT = Effort(feasible=40, coarse=40, fine=12)
SCENARIOS = Effort(feasible=40, coarse=15, fine=2)
"""Every evaluation counts as many times as there are scenarios."""


def test_every_problem_stores_an_optimum():
    assert {name for name, _ in OPTIMA} == set(FOLDERS)


@pytest.mark.parametrize(("name", "variant"), [key for key in OPTIMA if key not in {(n, "base") for n in COMPARED}])
def test_stored_optimum_holds(name, variant):
    """Base problems on a twice finer mesh, variants on their own: when they were found all were verified on both."""
    problem = ad.load_problem(name, None if variant == "base" else variant)
    optimum = OPTIMA[name, variant]
    assert set(optimum["values"]) == {v.name for v in problem.variables}
    for v in problem.variables:
        assert v.lower * (1.0 - 1e-12) - 1e-12 <= optimum["values"][v.name] <= v.upper * (1.0 + 1e-12) + 1e-12
    found = audit(problem, optimum["values"], optimum["objective"], halved if variant == "base" else own)
    assert excesses(problem, found) == []


@pytest.mark.parametrize("name", [name for name in FOLDERS if name not in COMPARED])
def test_one_short_start_comes_near_the_stored_optimum(name):
    problem = ad.load_problem(name)
    outcome = starter(problem, SHORT if not problem.cases else SCENARIOS).run(0, 0)
    assert outcome.status != INFEASIBLE
    assert outcome.objective >= 0.6 * OPTIMA[name, "base"]["objective"]
