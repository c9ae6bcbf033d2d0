"""Analysis documents as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from .analysis.published import Comparison

Document = Mapping[str, Any]


@contextmanager
def working(text: str) -> Iterator[None]:
    """A spinner on standard error for what has no steps to count."""
    with Console(stderr=True).status(text):
        yield


def terminal() -> Console:
    """Where tables go: standard output, as wide as tables need if it is no terminal."""
    console = Console(highlight=False, soft_wrap=False)
    # A pipe has no width; tables must not be squeezed into a guess of 80 columns.
    return console if console.is_terminal else Console(highlight=False, width=max(console.width, 118))


@contextmanager
def progress(total: int) -> Iterator[Callable[[str], None]]:
    """Progress bar on standard error for several jobs.

    Parameters
    ----------
    total : int
        Number of jobs.

    Yields
    ------
    callable
        To be called with the name of each job that is done.
    """
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    with bar:
        task = bar.add_task("analysing", total=total)

        def advance(name: str) -> None:
            bar.update(task, advance=1, description=f"analysed {name}" if name else "analysed")

        yield advance


def problems(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print the packaged problems.

    Parameters
    ----------
    rows : sequence of mapping
        With ``name``, ``source``, ``variants`` (of the machine), ``optimise`` and ``design_variants``.
    """
    table = Table("problem", "commands", "source", "variants", box=None, pad_edge=False)
    for row in rows:
        commands = "analyse, optimise" if row["optimise"] else "analyse"
        lists = {"machine": row["variants"], "design": row["design_variants"]}
        variants = "\n".join(f"{what}: {', '.join(names)}" for what, names in lists.items() if names)
        table.add_row(*(escape(t) for t in (row["name"], commands, row["source"], variants)))
    terminal().print(table)


def outlines(documents: Mapping[str, Document]) -> None:
    """Print what machine files describe.

    Parameters
    ----------
    documents : mapping of str to mapping
        Results of `amb_design.analysis.outline.outline` by variant.
    """
    console = terminal()
    for d in documents.values():
        console.print(f"[bold]{escape(d['name'])}[/]")
        console.print(
            f"  rotor of {d['mass_kg']:.4g} kg and {d['length_m']:.4g} m: shaft {d['shaft_mass_kg']:.4g} kg"
            + (f", disks {', '.join(f'{m:.4g}' for m in d['disk_masses_kg'])} kg" if d["disk_masses_kg"] else "")
        )
        for i, s in enumerate(d["segments"][:4]):
            plies = f", plies {s['plies_deg']} deg" if s["plies_deg"] else ""
            console.print(
                f"  segment {i}: {s['outer_diameter_m'] * 1e3:.4g}/{s['inner_diameter_m'] * 1e3:.4g} mm, bending stiffness "
                f"{s['bending_stiffness_nm2']:.4g} N m^2, shear {s['shear_stiffness_n']:.4g} N{plies}",
                soft_wrap=True,
            )
        if len(d["segments"]) > 4:
            console.print(f"  and {len(d['segments']) - 4} more segments")
        for b in d["bearings"]:
            (kyy, kyz), (kzy, kzz) = b["stiffness_n_per_m"]
            (cyy, _), (_, czz) = b["damping_ns_per_m"]
            cross = f", cross {kyz:.4g} and {kzy:.4g} N/m" if kyz or kzy else ""
            both = f"{kyy:.4g} N/m" if kyy == kzz else f"{kyy:.4g} and {kzz:.4g} N/m"
            damping = f"{cyy:.4g}" if cyy == czz else f"{cyy:.4g} and {czz:.4g}"
            console.print(f"  bearing at {b['position_m']:.4g} m: {both}{cross}, {damping} N s/m")
        for x in d["pins_m"]:
            console.print(f"  pin at {x:.4g} m")
        for m in d["magnets"]:
            text = (
                f"  magnet at {m['position_m']:.4g} m: k_i {m['current_stiffness_n_per_a']:.4g} N/A, k_s "
                f"{m['negative_stiffness_n_per_m']:.4g} N/m"
            )
            if "capacity_n" in m:
                text += f", can pull {m['capacity_n']:.4g} N an axis, {m['bias_flux_density_t']:.3g} T at bias"
            if "controller_states" in m:
                text += (
                    f"; loop of {m['controller_states']} states, at 50 Hz {m['loop_stiffness_at_50_hz_n_per_m']:.4g} N/m "
                    f"and {m['loop_damping_at_50_hz_ns_per_m']:.4g} N s/m"
                )
            console.print(text, soft_wrap=True)
        form = "complex, y and z alike" if d["form"] == "complex" else "real, y and z apart"
        console.print(
            f"  model: {d['elements']} elements, {d['states']} states ({form}), up to {d['top_speed_rpm']:.6g} rpm\n"
        )


def analyses(documents: Mapping[str, Document], comparisons: Sequence[Comparison], out: Path | None) -> None:
    """Print analyses.

    Parameters
    ----------
    documents : mapping of str to mapping
        Analysis documents by variant.
    comparisons : sequence of Comparison
        Published figures.
    out : Path or None
        Where figures were written.
    """
    console = terminal()
    if len(documents) == 1:
        _details(console, next(iter(documents.values())))
    else:
        _overview(console, documents)
    _warnings(console, documents)
    if comparisons:
        _comparison(console, comparisons)
    if out is not None:
        console.print(f"Figures and analysis.json are in {out}{'/ and its subfolders' if len(documents) > 1 else '/'}")


def limit_text(document: Document) -> str:
    """The stability limit in a few words: ``9382 rpm``, ``unstable at rest``.

    Parameters
    ----------
    document : mapping
        Analysis document.
    """
    limit = document["stability_limit"]
    if limit["status"] == "limit found":
        return f"{limit['speed_rpm']:.0f} rpm"
    if limit["status"] == "none below the top speed":
        return f"none below {document['top_speed_rpm']:.0f} rpm"
    return str(limit["status"])


def _overview(console: Console, documents: Mapping[str, Document]) -> None:
    equivalent = any("equivalent_coefficients" in d for d in documents.values())
    table = Table(title="Speeds in rpm; each limit with the frequency of the mode that sets it", title_justify="left")
    table.add_column("variant")
    table.add_column("critical, forward", justify="right")
    table.add_column("stability limit", justify="right")
    table.add_column("at", justify="right")
    table.add_column("later onsets", justify="right")
    if equivalent:
        table.add_column("equivalent coefficients claim", justify="right")
    for name, d in documents.items():
        limit = d["stability_limit"]
        hz = limit["whirl_frequency_hz"]
        row = [
            escape(name or "(base)"),
            ", ".join(f"{c:.0f}" for c in d["critical_speeds_rpm"][:2]),
            limit_text(d).removesuffix(" rpm"),
            f"{hz:.4g} Hz" if hz and limit["status"] != "marginal" else "",
            ", ".join(f"{o['speed_rpm']:.0f}" + ("" if o["becomes"] == "unstable" else "(-)") for o in d["onsets"][1:3])
            if limit["status"] == "limit found"
            else "",
        ]
        if equivalent:
            row.append(_claim(d.get("equivalent_coefficients")))
        table.add_row(*row)
    console.print(table)


def _claim(equivalent: Document | None) -> str:
    if equivalent is None:
        return ""
    changes = []
    for i, c in enumerate(equivalent["changes"]):
        words = "unstable from" if c["becomes"] == "unstable" else "stable again from" if i else "unstable below"
        changes.append(f"{words} {c['speed_rpm']:.0f}")
    return ", ".join(changes) or "stable"


def _details(console: Console, d: Document) -> None:
    limit = d["stability_limit"]
    certified = " (certified at every speed below)" if limit["certified"] and limit["status"] != "marginal" else ""
    console.print(f"[bold]{escape(d['name'])}[/]: {d['states']} states, {d['form']} form")
    console.print(
        f"[bold]stability limit: {limit_text(d)}[/]{certified if limit['status'] != 'unstable at rest' else ''}"
    )
    if limit["mode"]:
        verb = "undamped" if limit["status"] == "marginal" else "set by"
        console.print(f"  {verb}: {limit['mode']}")
    for o in d["onsets"]:
        console.print(
            f"  {o['speed_rpm']:.0f} rpm: {o['mode']} becomes {o['becomes']} ({o['unstable_modes_above']} unstable above)"
        )
    if d["critical_speeds"]:
        table = Table(
            "critical speed [rpm]", "whirl", "damping ratio", "mode", title="Critical speeds", title_justify="left"
        )
        for c in d["critical_speeds"]:
            table.add_row(f"{c['speed_rpm']:.1f}", c["whirl"], f"{c['damping_ratio']:.4f}", c["kind"])
        console.print(table)
    if d["modes_at_rest"]:
        table = Table(
            "frequency [Hz]",
            "whirl",
            "damping ratio",
            "log. decrement",
            "mode",
            title="Modes at rest",
            title_justify="left",
        )
        for m in d["modes_at_rest"]:
            decrement = m["logarithmic_decrement"]
            table.add_row(
                f"{m['frequency_hz']:.3f}",
                m["whirl"],
                f"{m['damping_ratio']:.4f}",
                "" if decrement is None else f"{decrement:.3f}",
                m["kind"],
            )
        console.print(table)
    if d["sensitivity"]:
        table = Table(
            "speed [rpm]", "loop", "peak", "at [Hz]", "zone", title="Sensitivity (ISO 14839-3)", title_justify="left"
        )
        for s in d["sensitivity"]:
            table.add_row(f"{s['speed_rpm']:.0f}", s["loop"], f"{s['peak']:.3f}", f"{s['frequency_hz']:.1f}", s["zone"])
        console.print(table)
    if d["limit_sensitivities"]:
        table = Table(
            "number", "value", "rpm per 1 %", title="What moves the stability limit most", title_justify="left"
        )
        for r in d["limit_sensitivities"][:10]:
            table.add_row(r["number"], f"{r['value']:.5g} {r['unit']}", f"{r['rpm_per_percent']:+.2f}")
        console.print(table)
    if "equivalent_coefficients" in d:
        console.print(
            f"For comparison, equivalent coefficients would claim: {_claim(d['equivalent_coefficients'])} rpm. They take the loop "
            "at the spin speed, although a rotor at its threshold whirls near a natural frequency, and see no controller mode."
        )


def _warnings(console: Console, documents: Mapping[str, Document]) -> None:
    """Each kind of warning once: in the words of the last variant that it holds for, with the names of the others."""
    if len(documents) == 1:
        lines = [text for d in documents.values() for text in d["warnings"]]
    else:
        found: dict[str, dict[str, str]] = {}
        for name, d in documents.items():
            for topic, text in zip(d["warning_topics"], d["warnings"], strict=True):
                found.setdefault(topic, {}).setdefault(name, text)
        lines = [_for_all(texts) for texts in found.values()]
    if lines:
        console.print("[bold]Warnings[/]")
    for line in lines:
        console.print(escape(f"- {line}"), soft_wrap=not console.is_terminal)
    if lines:
        console.print()


def _for_all(texts: Mapping[str, str]) -> str:
    *others, (name, text) = texts.items()
    also = f" Likewise {', '.join(n or '(base)' for n, _ in others)}." if others else ""
    return f"{name or '(base)'}: {text}{also}"


def comparison_row(comparison: Comparison) -> dict[str, Any]:
    """A comparison with a published figure as plain data.

    Parameters
    ----------
    comparison : Comparison
    """
    f = comparison.figure
    return {
        "variant": f.variant,
        "quantity": f.quantity,
        "label": f.label,
        "published": f.published,
        "here": comparison.here,
        "difference": comparison.difference,
        "tolerance": f.tolerance,
        "agrees": comparison.agrees,
        "reason": f.reason,
        "source": f.source,
    }


def _comparison(console: Console, comparisons: Sequence[Comparison]) -> None:
    reasons: list[str] = []
    summaries = _summaries(comparisons)
    table = Table(title="Published figures", title_justify="left")
    for heading, justify in (
        ("variant", "left"),
        ("quantity", "left"),
        ("published", "right"),
        ("here", "right"),
        ("difference", "right"),
        ("", "left"),
        ("source", "left"),
    ):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    for c in comparisons:
        f = c.figure
        if f.source in summaries:
            continue
        if f.reason and f.reason not in reasons:
            reasons.append(f.reason)
        mark = f"differs [{reasons.index(f.reason) + 1}]" if f.reason else "agrees" if c.agrees else "DISAGREES"
        table.add_row(
            f.variant,
            f.label,
            f"{f.published:.6g}",
            "none" if c.here is None else f"{c.here:.6g}",
            "" if c.difference is None else f"{100.0 * c.difference:+.2f} %",
            escape(mark),
            f.source,
        )
    if table.row_count:
        console.print(table)
    for i, reason in enumerate(reasons):
        console.print(escape(f"[{i + 1}] {reason}"), soft_wrap=not console.is_terminal)
    for summary in summaries.values():
        console.print(summary)


def _summaries(comparisons: Sequence[Comparison], many: int = 8) -> dict[str, str]:
    """Sources with many figures that all agree, in one line each."""
    out = {}
    for source in dict.fromkeys(c.figure.source for c in comparisons):
        group = [c for c in comparisons if c.figure.source == source]
        if len(group) > many and all(c.agrees for c in group):
            worst = max(abs(c.difference or 0.0) for c in group)
            out[source] = (
                f"All {len(group)} figures of the {source} agree; the largest difference is {100.0 * worst:.2f} %."
            )
    return out
