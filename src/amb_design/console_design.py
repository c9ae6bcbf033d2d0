"""Design documents as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from .console import terminal
from .optimise.start import INFEASIBLE, Outcome
from .units import in_words

Document = Mapping[str, Any]


@contextmanager
def progress(total: int, unit: str) -> Iterator[Callable[[Outcome], None]]:
    """Progress of the starts on standard error.

    Parameters
    ----------
    total : int
        Number of starts.
    unit : str
        Of the objective; rad/s is a spin speed.

    Yields
    ------
    callable
        To be called with each outcome.
    """
    console = Console(stderr=True)
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        console=console,
        transient=True,
    )
    with bar:
        task = bar.add_task("searching", total=total)

        def advance(o: Outcome) -> None:
            if o.status == INFEASIBLE:
                text = f"no point within the limits; least violation {100.0 * o.violation:.2g} %"
            else:
                text = in_words(o.objective, unit, speed=True)
            bar.console.print(escape(f"start {o.index}: {text} ({o.status}, {o.cpu_seconds:.1f} s)"), highlight=False)
            bar.update(task, advance=1)

        yield advance


def design(d: Document, out: Path | None) -> None:
    """Print a design.

    Parameters
    ----------
    d : mapping
        From `amb_design.optimise.report.document`.
    out : Path or None
        Where it was written.
    """
    console = terminal()
    console.print(f"[bold]{escape(d['name'])}[/]: {escape(d['question'])}" if d["question"] else d["name"])
    console.print(f"[bold]{_headline(d)}[/]")
    if not d["verified"]:
        _conflicts(console, d)
        return
    _comparison(console, d)
    _variables(console, d)
    _sensitivities(console, d)
    _relaxations(console, d)
    for quantity, points in d["pareto"].items():
        _front(console, d, quantity, points)
    if out is not None:
        console.print(f"The design is in {out}/design.toml, all of its data in design.json, figures beside them.")


def _unit(d: Document) -> str:
    return str(d["objective"]["unit"])


def _headline(d: Document) -> str:
    if d["status"] == "infeasible":
        return "No design keeps all limits."
    if not d["verified"]:
        return "No design passed verification."
    held = sum(o["status"] != INFEASIBLE for o in d["starts"])
    value = in_words(d["objective"]["value"], _unit(d), speed=True)
    name = d["objective"]["quantity"].replace("_", " ")
    what = "stable and within all limits up to" if name == "stability limit" else f"{name}"
    if name == "stability limit" and d["after"]["stability_limit"]["status"] == "none below the top speed":
        value += ", where the search ends"
    return f"{d['status']}: {what} {value} ({held} of {len(d['starts'])} starts within the limits)"


def _conflicts(console: Console, d: Document) -> None:
    if d["conflicts"]:
        console.print("Closest to feasible, these conditions hold each other back:")
        for c in d["conflicts"]:
            scenario = f", scenario {c['scenario']}" if c["scenario"] else ""
            share = c["multiplier"] / max(sum(x["multiplier"] for x in d["conflicts"]), 1e-12)
            console.print(
                escape(
                    f"- {c['quantity'].replace('_', ' ')}: beyond its limit by {100.0 * c['value']:.3g} % ({c['place']}"
                    f"{scenario}); weight {share:.2f}"
                )
            )
    for reasons in d["rejected"]:
        for r in reasons:
            name = r["quantity"].replace("_", " ")
            console.print(
                escape(f"- rejected: {name} beyond its limit by {100.0 * r['excess']:.3g} % on the full model")
            )


def _limit_text(limit: Document) -> str:
    if limit["status"] == "limit found":
        return f"{limit['speed_rpm']:.0f} rpm"
    if limit["status"] == "none below the top speed":
        return f"none below {limit['speed_rpm']:.0f} rpm"
    return str(limit["status"])


def _comparison(console: Console, d: Document) -> None:
    before, after = d["before"], d["after"]
    table = Table(title="Before and after", title_justify="left")
    for heading, justify in (("", "left"), ("before", "right"), ("after", "right"), ("limit", "right"), ("", "left")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    table.add_row(
        "stability limit", _limit_text(before["stability_limit"]), _limit_text(after["stability_limit"]), "", ""
    )
    if after["proof"] is not None:
        table.add_row("proven stable", "", f"to {after['proof']['stable_up_to_rpm']:.2f} rpm", "", "on its own mesh")
    if "within_limits_up_to_rpm" in before:
        reach = before["within_limits_up_to_rpm"]
        table.add_row(
            "within all limits", f"to {reach:.0f} rpm" if reach else "nowhere", f"to {d['speed_rpm']:.0f} rpm", "", ""
        )
    for row in d["limits"]:
        q = row["quantity"]
        was = before["quantities"].get(q, {}).get("value")
        note = "active" if row["active"] else ""
        if row["active"] and abs(row["percent_per_percent"]) > 5e-4:
            note += f", 1 % of it is worth {abs(row['percent_per_percent']):.2g} %"
        where = f" at {row['speed_rpm']:.0f} rpm" if row["speed_rpm"] else ""
        table.add_row(
            q.replace("_", " "),
            "" if was is None else in_words(was, row["unit"]),
            in_words(row["value"], row["unit"]) + where,
            f"{row['kind']} {in_words(row['limit'], row['unit'])}",
            note,
        )
    console.print(table)
    span = before["range_rpm"]
    console.print(f"Quantities before are the worst up to {span:.0f} rpm, after up to {after['range_rpm']:.0f} rpm.")


def _variables(console: Console, d: Document) -> None:
    table = Table("variable", title="Variables", title_justify="left")
    for heading in ("before", "after", "bounds"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for v in d["variables"]:
        unit = v["unit"]
        bounds = f"{in_words(v['lower'], unit)} to {in_words(v['upper'], unit)}"
        note = f"at its {v['at_bound']} bound" if v["at_bound"] else ""
        table.add_row(v["name"], in_words(v["before"], unit), in_words(v["after"], unit), bounds, note)
    console.print(table)


def _sensitivities(console: Console, d: Document) -> None:
    if not d["sensitivities"]:
        return
    table = Table("number", title="What moves the stability limit most", title_justify="left")
    table.add_column("% per %", justify="right")
    for s in d["sensitivities"][:8]:
        table.add_row(s["number"], f"{s['percent_per_percent']:+.3f}")
    console.print(table)


def _relaxations(console: Console, d: Document) -> None:
    if not d["relaxations"]:
        return
    table = Table("limit", title="What easing a limit by 10 % brings", title_justify="left")
    for heading in ("from", "to", "predicted", "solved"):
        table.add_column(heading, justify="right")
    units = {row["quantity"]: row["unit"] for row in d["limits"]}
    for r in d["relaxations"]:
        unit = units[r["quantity"]]
        solved = "not verified" if r["solved"] is None else in_words(r["solved"], _unit(d), speed=True)
        table.add_row(
            r["quantity"].replace("_", " "),
            in_words(r["limit"], unit),
            in_words(r["eased"], unit),
            in_words(r["predicted"], _unit(d), speed=True),
            solved,
        )
    console.print(table)


def _front(console: Console, d: Document, quantity: str, points: list[Document]) -> None:
    from .spec.quantities import QUANTITIES

    table = Table(quantity.replace("_", " "), title="Compromises", title_justify="left")
    table.add_column(d["objective"]["quantity"].replace("_", " "), justify="right")
    for p in points:
        value = "none found" if p["objective"] is None else in_words(p["objective"], _unit(d), speed=True)
        table.add_row(in_words(p["limit"], QUANTITIES[quantity].unit), value)
    console.print(table)
