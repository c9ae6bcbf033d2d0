"""What an analysis found, in short sentences and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..analysis.published import Comparison
from .parts import Table, table

Document = Mapping[str, Any]

MANY = 8
"""Sources with more figures than this, all of which agree, are told in one line."""


def limit_text(document: Document) -> str:
    """The stability limit in a few words: ``9382 rpm``, ``unstable at rest``.

    Parameters
    ----------
    document : mapping
        Of an analysis.
    """
    limit = document["stability_limit"]
    if limit["status"] == "limit found":
        return f"{limit['speed_rpm']:.0f} rpm"
    if limit["status"] == "none below the top speed":
        return f"none below {document['top_speed_rpm']:.0f} rpm"
    return str(limit["status"])


def certificate(document: Document) -> str:
    """What is known of the speeds below the limit; empty if there is nothing to say.

    Parameters
    ----------
    document : mapping
    """
    limit = document["stability_limit"]
    if limit["status"] in ("marginal", "unstable at rest"):
        return ""
    return "certified at every speed below" if limit["certified"] else "not certified"


def onsets(document: Document) -> list[str]:
    """Speeds at which modes become unstable or stable again, a sentence each.

    Parameters
    ----------
    document : mapping
    """
    return [
        f"{o['speed_rpm']:.0f} rpm: {o['mode']} becomes {o['becomes']} ({o['unstable_modes_above']} unstable above)"
        for o in document["onsets"]
    ]


def tables(document: Document) -> list[Table]:
    """Everything of one machine, empty tables left out.

    Parameters
    ----------
    document : mapping
    """
    makers = (criteria, critical_speeds, modes, sensitivities, movers)
    return [t for t in (make(document) for make in makers) if t.rows]


def criteria(document: Document) -> Table:
    """What standards ask, and the verdicts.

    Parameters
    ----------
    document : mapping
    """
    rows = []
    for c in document["criteria"]:
        unit = f" {c['unit']}" if c["unit"] else ""
        size = "{:.0f}" if unit else "{:.3g}"
        rows.append(
            [
                c["standard"],
                c["subject"],
                "" if c["value"] is None else size.format(c["value"]) + unit,
                "" if c["limit"] is None else f"{c['kind']} {size.format(c['limit'])}{unit}",
                c["verdict"],
                c["where"],
            ]
        )
    note = (
        "Limits as commonly quoted from ISO 14839-2:2004, ISO 14839-3:2006 and API 617 (level II); the edition that a contract names has "
        "the last word. Whirl is that under the unbalance of the file."
    )
    return table("Standards", "llrrll", ("standard", "what", "found", "limit", "verdict", "where"), rows, note)


def critical_speeds(document: Document) -> Table:
    """Critical speeds.

    Parameters
    ----------
    document : mapping
    """
    return table(
        "Critical speeds",
        "rlrl",
        ("critical speed [rpm]", "whirl", "damping ratio", "mode"),
        [
            [f"{c['speed_rpm']:.1f}", c["whirl"], f"{c['damping_ratio']:.4f}", c["kind"]]
            for c in document["critical_speeds"]
        ],
    )


def modes(document: Document) -> Table:
    """Modes at rest.

    Parameters
    ----------
    document : mapping
    """
    return table(
        "Modes at rest",
        "rlrrl",
        ("frequency [Hz]", "whirl", "damping ratio", "log. decrement", "mode"),
        [
            [
                f"{m['frequency_hz']:.3f}",
                m["whirl"],
                f"{m['damping_ratio']:.4f}",
                "" if m["logarithmic_decrement"] is None else f"{m['logarithmic_decrement']:.3f}",
                m["kind"],
            ]
            for m in document["modes_at_rest"]
        ],
    )


def sensitivities(document: Document) -> Table:
    """Peak sensitivities of all loops.

    Parameters
    ----------
    document : mapping
    """
    return table(
        "Sensitivity (ISO 14839-3)",
        "rlrrl",
        ("speed [rpm]", "loop", "peak", "at [Hz]", "zone"),
        [
            [f"{s['speed_rpm']:.0f}", s["loop"], f"{s['peak']:.3f}", f"{s['frequency_hz']:.1f}", s["zone"]]
            for s in document["sensitivity"]
        ],
    )


def movers(document: Document, count: int = 10) -> Table:
    """What moves the stability limit most.

    Parameters
    ----------
    document : mapping
    count : int
        Number of rows.
    """
    return table(
        "What moves the stability limit most",
        "lrr",
        ("number", "value", "rpm per 1 %"),
        [
            [r["number"], f"{r['value']:.5g} {r['unit']}", f"{r['rpm_per_percent']:+.2f}"]
            for r in document["limit_sensitivities"][:count]
        ],
    )


def equivalent(document: Document) -> str:
    """What the equivalent-coefficient method would say; empty where it does not apply.

    Parameters
    ----------
    document : mapping
    """
    if "equivalent_coefficients" not in document:
        return ""
    return (
        f"For comparison, equivalent coefficients would claim: {_claim(document['equivalent_coefficients'])} rpm. They take the loop "
        "at the spin speed, although a rotor at its threshold whirls near a natural frequency, and see no controller mode."
    )


def overview(documents: Mapping[str, Document]) -> Table:
    """Variants of a machine side by side.

    Parameters
    ----------
    documents : mapping of str to mapping
        By variant.
    """
    claimed = any("equivalent_coefficients" in d for d in documents.values())
    columns = ["variant", "critical, forward", "stability limit", "at", "later onsets"]
    rows = []
    for name, d in documents.items():
        limit = d["stability_limit"]
        hz = limit["whirl_frequency_hz"]
        later = d["onsets"][1:3] if limit["status"] == "limit found" else []
        row = [
            name or "(base)",
            ", ".join(f"{c:.0f}" for c in d["critical_speeds_rpm"][:2]),
            limit_text(d).removesuffix(" rpm"),
            f"{hz:.4g} Hz" if hz and limit["status"] != "marginal" else "",
            ", ".join(f"{o['speed_rpm']:.0f}" + ("" if o["becomes"] == "unstable" else "(-)") for o in later),
        ]
        rows.append([*row, _claim(d.get("equivalent_coefficients"))] if claimed else row)
    return table(
        "Speeds in rpm; each limit with the frequency of the mode that sets it",
        "lrrrr" + "r" * claimed,
        [*columns, *["equivalent coefficients claim"] * claimed],
        rows,
    )


def _claim(found: Document | None) -> str:
    if found is None:
        return ""
    changes = []
    for i, c in enumerate(found["changes"]):
        words = "unstable from" if c["becomes"] == "unstable" else "stable again from" if i else "unstable below"
        changes.append(f"{words} {c['speed_rpm']:.0f}")
    return ", ".join(changes) or "stable"


def warnings(documents: Mapping[str, Document]) -> list[str]:
    """Each kind of warning once: in the words of the last variant that it holds for, with the names of the others.

    Parameters
    ----------
    documents : mapping of str to mapping
        By variant.
    """
    if len(documents) == 1:
        return [text for d in documents.values() for text in d["warnings"]]
    found: dict[str, dict[str, str]] = {}
    for name, d in documents.items():
        for topic, text in zip(d["warning_topics"], d["warnings"], strict=True):
            found.setdefault(topic, {}).setdefault(name, text)
    return [_for_all(texts) for texts in found.values()]


def _for_all(texts: Mapping[str, str]) -> str:
    *others, (name, text) = texts.items()
    also = f" Likewise {', '.join(n or '(base)' for n, _ in others)}." if others else ""
    return f"{name or '(base)'}: {text}{also}"


def published(comparisons: Sequence[Comparison]) -> tuple[Table, list[str]]:
    """Published figures beside those found here.

    Parameters
    ----------
    comparisons : sequence of Comparison

    Returns
    -------
    table : Table
        Without the figures of sources that are told in one line.
    remarks : list of str
        Reasons of disagreements by their numbers, and sources with many figures that all agree.
    """
    reasons: list[str] = []
    summaries = _summaries(comparisons)
    rows = []
    for c in comparisons:
        f = c.figure
        if f.source in summaries:
            continue
        if f.reason and f.reason not in reasons:
            reasons.append(f.reason)
        mark = f"differs [{reasons.index(f.reason) + 1}]" if f.reason else "agrees" if c.agrees else "DISAGREES"
        rows.append(
            [
                f.variant,
                f.label,
                f"{f.published:.6g}",
                "none" if c.here is None else f"{c.here:.6g}",
                "" if c.difference is None else f"{100.0 * c.difference:+.2f} %",
                mark,
                f.source,
            ]
        )
    columns = ("variant", "quantity", "published", "here", "difference", "", "source")
    remarks = [f"[{i + 1}] {reason}" for i, reason in enumerate(reasons)]
    return table("Published figures", "llrrrll", columns, rows), [*remarks, *summaries.values()]


def _summaries(comparisons: Sequence[Comparison]) -> dict[str, str]:
    out = {}
    for source in dict.fromkeys(c.figure.source for c in comparisons):
        group = [c for c in comparisons if c.figure.source == source]
        if len(group) > MANY and all(c.agrees for c in group):
            worst = max(abs(c.difference or 0.0) for c in group)
            out[source] = (
                f"All {len(group)} figures of the {source} agree; the largest difference is {100.0 * worst:.2f} %."
            )
    return out
