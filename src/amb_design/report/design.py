"""The page of a design: what was asked, what it gains, what limits it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..analysis.critical import critical_speeds
from ..analysis.findings import findings
from ..analysis.outline import outline
from ..analysis.standards import FAILS, criteria
from ..analysis.summary import criterion_document
from ..analysis.system import system
from ..analysis.worst_speed import telling_sensitivities
from ..optimise.answers import ParetoPoint, Relaxation
from ..optimise.design import Design
from ..optimise.report import document
from ..spec.machine import Machine
from ..words import analysis as judged
from ..words import design as words
from ..words import machine as described
from .analysis import filled, machine_blocks, standards
from .design_figures import drawings
from .parts import Bullets, Page, Picture, Section
from .picture import pictures
from .provenance import fingerprint, provenance, text_of


def design_page(
    design: Design,
    relaxed: Sequence[Relaxation] = (),
    fronts: Mapping[str, Sequence[ParetoPoint]] | None = None,
    *,
    folder: Path | None = None,
    formats: tuple[str, ...] = ("png",),
    date: str = "",
    inputs: Mapping[str, str] | None = None,
) -> Page:
    """Put a design on one page.

    Parameters
    ----------
    design : Design
        Verified or not: a page also says why there is none.
    relaxed : sequence of Relaxation
    fronts : mapping of str to sequence of ParetoPoint
        By quantity.
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
    d = document(design, relaxed, fronts)
    text = text_of(design.machine)
    drawn = {p.name: p for p in pictures(drawings(design, fronts or {}), folder, formats)} if design.verified else {}
    verdicts, warnings = _judged(design) if design.verified else ([], [])
    sections = [
        Section("What was asked", (Bullets(tuple(words.asked(design.problem))), words.variables(d))),
        *(_answer(d, drawn) if design.verified else _refusal(d)),
        Section("Standards", (judged.criteria({"criteria": verdicts}),)),
        Section(
            "The machine" if design.verified else "The machine as it was",
            (*_named(drawn, "machine"), *machine_blocks(outline(design.machine), text)),
        ),
        Section("The search", (words.starts(d), *_named(drawn, "convergence"))),
    ]
    entries = {
        **(inputs or {}),
        "Problem": design.problem.name,
        "Seed": f"{design.seed}, {len(design.outcomes)} starts",
        "Effort": f"{d['cpu_seconds']:.0f} s of CPU time, {sum(d['eigensolves'].values())} eigendecompositions",
        "Machine before": f"SHA-256 {fingerprint(text_of(design.problem.machine))}",
        "Machine found": f"SHA-256 {fingerprint(text)}" if design.verified else "",
        "Numbers from": described.source({"source": dict(design.machine.source)}),
    }
    proof = d["after"]["proof"] if design.verified else None
    facts = [standards(verdicts)] if verdicts else []
    if proof is not None:
        facts.append(f"Proven stable, on its own mesh, at every speed up to {proof['stable_up_to_rpm']:.2f} rpm.")
    return Page(
        title=design.problem.name,
        subtitle=design.problem.question,
        verdict=_sentence(words.headline(d)),
        good=design.verified and not any(c["verdict"] == FAILS for c in verdicts),
        facts=tuple(facts),
        warnings=tuple(warnings),
        sections=tuple(s for s in map(filled, sections) if s.blocks),
        provenance=provenance(date, entries),
    )


def _judged(design: Design) -> tuple[list[dict[str, Any]], list[str]]:
    """What standards say of the machine found, up to the end of its range of speeds, and its warnings."""
    machine: Machine = design.machine
    loop, limit = system(machine), design.stability_limit
    assert limit is not None
    end = min(float(machine.operation.service_speed or design.end), design.end)
    stable = limit.speed > 0.0
    peaks = telling_sensitivities(loop, end) if loop.plant.loops and stable else ()
    verdicts = [criterion_document(c) for c in criteria(loop, limit, peaks, end)]
    critical = critical_speeds(loop)
    return verdicts, [f.text for f in findings(loop, limit, critical)]


def _answer(d: Mapping[str, Any], drawn: Mapping[str, Picture]) -> list[Section]:
    fronts = [words.front(d, q, points) for q, points in d["pareto"].items()]
    shown = [name for name in drawn if name.startswith("pareto_")]
    return [
        Section(
            "What it gains",
            (words.before_and_after(d), *_named(drawn, "real_part", "campbell_before", "campbell_after")),
        ),
        Section("What moves the limit most", (*_named(drawn, "sensitivities"), words.movers(d), words.relaxations(d))),
        Section("Compromises", (*fronts, *_named(drawn, *shown))),
    ]


def _refusal(d: Mapping[str, Any]) -> list[Section]:
    return [Section("What holds what back", (Bullets(tuple(words.conflicts(d))),))]


def _named(drawn: Mapping[str, Picture], *names: str) -> list[Picture]:
    return [drawn[name] for name in names if name in drawn]


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
