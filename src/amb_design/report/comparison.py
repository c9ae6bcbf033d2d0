"""The page of a comparison: designs under the same conditions, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..analysis.findings import findings
from ..analysis.gradient import stability_gradient
from ..analysis.outline import outline
from ..analysis.standards import FAILS, OPEN, PASSES, TOLERABLE, Criterion, criteria
from ..analysis.summary import ranked
from ..comparison.assessment import Assessment
from ..comparison.table import ComparisonTable
from ..words import analysis as judged
from ..words import comparison as words
from ..words import machine as described
from ..words.parts import Table, table
from .analysis import filled
from .analysis_figures import machine_drawing
from .comparison_figures import drawings
from .parts import Bullets, Fold, Page, Section, Text
from .picture import picture, pictures
from .provenance import fingerprint, provenance, text_of


def comparison_page(
    result: ComparisonTable,
    *,
    folder: Path | None = None,
    formats: tuple[str, ...] = ("png",),
    date: str = "",
    inputs: Mapping[str, str] | None = None,
) -> Page:
    """Put a comparison on one page.

    Parameters
    ----------
    result : ComparisonTable
    folder : Path, optional
        Where the drawings are written to files too.
    formats : tuple of str
        Of these files.
    date : str
        Of the calculation.
    inputs : mapping of str to str
        What else belongs to the provenance.

    Returns
    -------
    Page
    """
    d, drawn = result.document(), pictures(drawings(result), folder, formats)
    texts = {name: text_of(a.machine) for name, a in result.designs.items()}
    first = next(iter(result.designs.values()))
    sections = (
        Section("Side by side", (words.lines(d), words.modes(d))),
        Section("Conditions and remarks", (Bullets(result.notes),)),
        Section("Standards", (_standards(result),)),
        Section("In pictures", drawn),
        Section(
            "The designs",
            (picture(*machine_drawing(first.machine)),),
            tuple(_design(n, result, texts[n]) for n in result.designs),
        ),
    )
    hashes = {f"Machine, {name}": f"SHA-256 {fingerprint(text)}" for name, text in texts.items()}
    seed = f"{result.conditions.seed}, {result.conditions.samples} random machines" if result.conditions.samples else ""
    best = next(row for row in result.rows if row.line.key == "stability_limit")
    told = "; ".join(f"{name} {best.cell(name)}" for name in result.designs)
    return Page(
        title=result.name,
        subtitle=result.question or f"{' against '.join(result.designs)} under the same conditions.",
        verdict=f"Stability limits: {told}.",
        good=None,
        facts=(f"All else is that up to {d['conditions']['speed_rpm']:.0f} rpm, the end of the operating range.",),
        warnings=tuple(_warnings(result)),
        sections=tuple(s for s in map(filled, sections) if s.blocks),
        provenance=provenance(date, {**(inputs or {}), "Seed": seed, **hashes}),
    )


def _warnings(result: ComparisonTable) -> list[str]:
    """Each kind of warning once, with the designs that it holds for."""
    found = {name: findings(a.loop, a.limit) for name, a in result.designs.items()}
    documents = {
        name: {"warnings": [f.text for f in each], "warning_topics": [f.topic for f in each]}
        for name, each in found.items()
    }
    return judged.warnings(documents)


def _standards(result: ComparisonTable) -> Table:
    rows = []
    for name, a in result.designs.items():
        found = _criteria(a)
        counts = [str(sum(c.verdict == v for c in found)) for v in (PASSES, TOLERABLE, FAILS, OPEN)]
        missed = "; ".join(f"{c.standard}: {c.subject}" for c in found if c.verdict == FAILS)
        rows.append([name, *counts, missed or "none"])
    columns = ("design", "met", TOLERABLE, "missed", OPEN, "which are missed")
    note = "Demands of stability, ISO 14839-2 and -3 and API 617 over the operating range, each machine with its own unbalance."
    return table("Standards", "lrrrrl", columns, rows, note)


def _criteria(a: Assessment) -> tuple[Criterion, ...]:
    peaks = (a.sensitivities[0], a.sensitivities[-1]) if a.runs and a.loop.plant.loops else ()
    return criteria(a.loop, a.limit, peaks, a.end)


def _design(name: str, result: ComparisonTable, text: str) -> Section:
    a = result.designs[name]
    gradient = (
        stability_gradient(a.machine, a.limit.mode) if a.limit.mode and a.stable_up_to < a.limit.top_speed else {}
    )
    told = outline(a.machine)
    blocks = (
        Text(" ".join(described.sentences(told))),
        judged.movers({"limit_sensitivities": ranked(a.machine, gradient)}),
        Fold(f"{name} as a file", text),
    )
    return filled(Section(name, blocks))
