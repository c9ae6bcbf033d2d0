"""The page of an analysis: of one machine, or of a machine and its variants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..analysis.outline import outline
from ..analysis.published import Comparison
from ..analysis.standards import FAILS, OPEN, PASSES, TOLERABLE
from ..analysis.summary import Analysis
from ..spec.files import loads
from ..words import analysis as words
from ..words import machine as described
from ..words.parts import Table
from .analysis_figures import drawings, machine_drawing
from .parts import Block, Bullets, Fold, Page, Picture, Section, Text
from .picture import picture, pictures
from .provenance import fingerprint, provenance, text_of

Document = Mapping[str, Any]


@dataclass(frozen=True)
class Account:
    """All that a page tells of one machine, as plain data that can come from another process.

    Attributes
    ----------
    document : dict
        Of the analysis.
    outline : dict
        Of the machine.
    text : str
        The machine as a file.
    pictures : tuple of Picture
    """

    document: dict[str, Any]
    outline: dict[str, Any]
    text: str = field(repr=False)
    pictures: tuple[Picture, ...] = field(repr=False)


def account(
    analysis: Analysis,
    folder: Path | None = None,
    formats: tuple[str, ...] = ("png",),
    *,
    main_only: bool = False,
    prefix: str = "",
) -> Account:
    """Gather what a page tells of one machine.

    Parameters
    ----------
    analysis : Analysis
    folder, formats, prefix
        As in `amb_design.report.picture.picture`.
    main_only : bool
        Of the figures only those that matter most go to files, and the Campbell diagram alone to the page.

    Returns
    -------
    Account
    """
    drawn = pictures(drawings(analysis, main_only=main_only), folder, formats, prefix)
    if main_only:  # a page of many variants has to stay small
        drawn = tuple(p for p in drawn if p.name == "campbell")
    return Account(analysis.document(), outline(analysis.machine), text_of(analysis.machine), drawn)


def analysis_page(
    accounts: Mapping[str, Account],
    comparisons: Sequence[Comparison] = (),
    *,
    date: str = "",
    inputs: Mapping[str, str] | None = None,
) -> Page:
    """Put the analysis of a machine, or of its variants, on one page.

    Parameters
    ----------
    accounts : mapping of str to Account
        By variant; the machine itself under the empty name.
    comparisons : sequence of Comparison
        Published figures.
    date : str
        Of the calculation.
    inputs : mapping of str to str
        What else belongs to the provenance.

    Returns
    -------
    Page
    """
    documents = {name: a.document for name, a in accounts.items()}
    first = next(iter(accounts.values()))
    single = len(accounts) == 1
    told, remarks = words.published(comparisons)
    published = [Section("Published figures", (told, Bullets(tuple(remarks))))] if told.rows or remarks else []
    hashes = {f"Machine{name and f', {name}'}": f"SHA-256 {fingerprint(a.text)}" for name, a in accounts.items()}
    entries = {**(inputs or {}), **(hashes if single else {}), "Numbers from": described.source(first.outline)}
    if single:
        d = first.document
        verdict, good, facts = answer(d)
        sections = [*_sections(first), *published]
        title = d["name"]
    else:
        verdict, good, facts = f"{len(accounts)} variants, side by side in the first table.", None, ()
        each = [
            Section(name or "The machine itself", (Text(_summary(a)),), tuple(_sections(a)))
            for name, a in accounts.items()
        ]
        shared = picture(*machine_drawing(loads(first.text)))
        sections = [Section("Variants", (words.overview(documents), shared)), *published, *each]
        title = first.document["name"].split(":")[0]
    return Page(
        title=title,
        subtitle=f"How fast may it spin, and what limits it? Analysis up to {first.document['top_speed_rpm']:.6g} rpm.",
        verdict=verdict,
        good=good,
        facts=tuple(facts),
        warnings=tuple(words.warnings(documents)),
        sections=tuple(sections),
        provenance=provenance(date, entries),
    )


def answer(d: Document) -> tuple[str, bool | None, tuple[str, ...]]:
    """The verdict on a machine: the stability limit, whether all standards are met, and what else to say at once.

    Parameters
    ----------
    d : mapping
        Document of an analysis.

    Returns
    -------
    verdict : str
    good : bool or None
        True if no standard is missed, False if one is; None if none could be judged.
    facts : tuple of str
    """
    limit = d["stability_limit"]
    sure = words.certificate(d)
    verdict = f"Stability limit: {words.limit_text(d)}{sure and f', {sure}'}."
    facts = []
    if limit["mode"]:
        facts.append(f"{'Undamped' if limit['status'] == 'marginal' else 'Set by'}: {limit['mode']}.")
    facts.append(standards(d["criteria"]))
    found = [c["verdict"] for c in d["criteria"]]
    good = False if FAILS in found else True if PASSES in found else None
    return verdict, good, tuple(facts)


def standards(criteria: Sequence[Document]) -> str:
    """How many demands are met, in a sentence.

    Parameters
    ----------
    criteria : sequence of mapping
    """
    counts = {v: sum(c["verdict"] == v for c in criteria) for v in (PASSES, TOLERABLE, FAILS, OPEN)}
    told = ", ".join(f"{n} {v}" if v != PASSES else f"{n} met" for v, n in counts.items() if n)
    missed = "; ".join(f"{c['standard']}: {c['subject']}" for c in criteria if c["verdict"] == FAILS)
    text = f"Demands of stability, ISO 14839 and API 617: {told.replace(FAILS, 'missed')}."
    return f"{text} Missed: {missed}." if missed else text


def _summary(a: Account) -> str:
    verdict, _, facts = answer(a.document)
    return " ".join((verdict, *facts))


def _sections(a: Account) -> list[Section]:
    """What there is to show of one machine."""
    d, drawn = a.document, {p.name: p for p in a.pictures}

    def shown(*names: str) -> list[Block]:
        return [drawn[name] for name in names if name in drawn]

    rows = (
        Section("Standards", (words.criteria(d),)),
        Section("The machine", (*shown("machine"), *machine_blocks(a.outline, a.text))),
        Section(
            "Stability",
            (Bullets(tuple(words.onsets(d))), *shown("real_part", "damping"), Text(words.equivalent(d))),
        ),
        Section("What moves the limit most", (words.movers(d),)),
        Section(
            "Vibration", (words.critical_speeds(d), *shown("campbell"), words.modes(d), *shown("modes", "unbalance"))
        ),
        Section(
            "Control loops",
            (words.sensitivities(d), *shown("sensitivity", "sensitivity_over_speed", "open_loop", "currents")),
        ),
    )
    return [s for s in map(filled, rows) if s.blocks]


def machine_blocks(outline: Document, text: str) -> tuple[Block, ...]:
    """A machine in words, tables and as a file.

    Parameters
    ----------
    outline : mapping
        From `amb_design.analysis.outline.outline`.
    text : str
        The machine as a file.
    """
    return (
        Text(" ".join(described.sentences(outline))),
        Bullets(tuple(outline["unusual"])),
        *described.tables(outline),
        Fold("The machine as a file", text),
    )


def filled(section: Section) -> Section:
    """A section without blocks that hold nothing.

    Parameters
    ----------
    section : Section
    """

    def holds(block: Block) -> bool:
        if isinstance(block, Table):
            return bool(block.rows)
        if isinstance(block, Bullets):
            return bool(block.lines)
        return not isinstance(block, Text) or bool(block.text)

    return Section(section.title, tuple(b for b in section.blocks if holds(b)), section.sections)
