"""Every packaged problem against the published figures of its ``expected.toml``."""

from __future__ import annotations

import tomllib

import pytest

import amb_design as ad
from amb_design.analysis.published import FILE_NAME, compare, published_figures
from amb_design.analysis.summary import analyse

PROBLEMS = ad.packaged()
MACHINES = [name for name, folder in PROBLEMS.items() if (folder / "machine.toml").is_file()]


@pytest.mark.parametrize("name", MACHINES)
def test_published_figures(name):
    folder = PROBLEMS[name]
    figures = published_figures(folder)
    assert figures, f"{name} has no {FILE_NAME}"
    machines = {"": ad.load(folder), **ad.load_variants(folder)}
    documents = {v: analyse(machines[v]).document() for v in dict.fromkeys(f.variant for f in figures)}
    comparisons = compare(figures, documents)
    assert len(comparisons) == len(figures)
    for c in comparisons:
        print(
            f"{c.figure.variant} {c.figure.label}: published {c.figure.published:g}, here {c.here}, {c.figure.source}"
        )
    wrong = [c for c in comparisons if c.figure.tolerance is not None and not c.agrees]
    assert not wrong
    # A figure that is said not to hold must not hold, or the reason is out of date.
    assert not [c for c in comparisons if c.figure.reason and abs(c.difference or 1.0) < 0.01]


@pytest.mark.parametrize("name", PROBLEMS)
def test_each_problem_has_a_question_an_answer_and_a_source(name):
    folder = PROBLEMS[name]
    readme = (folder / "README.md").read_text(encoding="utf-8")
    assert "**Question.**" in readme
    assert "**Answer.**" in readme
    files = [folder / file for file in ("machine.toml", "problem.toml") if (folder / file).is_file()]
    assert files
    assert all(tomllib.loads(file.read_text(encoding="utf-8"))["source"]["title"] for file in files)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[figures]]\nquantity = 'x'\npublished = 1\nsource = 's'", "needs either a tolerance or a reason"),
        ("[[figures]]\nquantity = 'x'\nsource = 's'\ntolerance = 1", "figures[0].published is missing"),
        ("[[figures]]\nquantum = 'x'", "figures[0].quantum is unknown"),
        ("[[figures", "is no TOML"),
        ("figures = 3", "must hold [[figures]] and nothing else"),
        ("[[figures]]\nquantity = 'x'\npublished = 0\nsource = 's'\ntolerance = 1", "must be a number other than zero"),
        ("[[figures]]\nquantity = 5\npublished = 1\nsource = 's'\ntolerance = 1", "must be a text"),
    ],
)
def test_malformed_expectations(tmp_path, text, words):
    (tmp_path / FILE_NAME).write_text(text)
    with pytest.raises(ad.SpecError, match=words.replace("[", r"\[")):
        published_figures(tmp_path)
