"""What a design gains and what limits it, in short sentences and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..optimise.start import INFEASIBLE
from ..spec.quantities import QUANTITIES
from ..units import in_words
from .parts import Table, table

Document = Mapping[str, Any]


def headline(d: Document) -> str:
    """The answer in one line.

    Parameters
    ----------
    d : mapping
        From `amb_design.optimise.report.document`, as everywhere here.
    """
    if d["status"] == "infeasible":
        return "No design keeps all limits."
    if not d["verified"]:
        return "No design passed verification."
    held = sum(o["status"] != INFEASIBLE for o in d["starts"])
    value = in_words(d["objective"]["value"], _unit(d), speed=True)
    name = _spoken(d["objective"]["quantity"])
    what = "stable and within all limits up to" if name == "stability limit" else name
    if name == "stability limit" and d["after"]["stability_limit"]["status"] == "none below the top speed":
        value += ", where the search ends"
    return f"{d['status']}: {what} {value} ({held} of {len(d['starts'])} starts within the limits)"


def conflicts(d: Document) -> list[str]:
    """Why there is no design, a sentence for each condition.

    Parameters
    ----------
    d : mapping
    """
    lines = []
    total = max(sum(x["multiplier"] for x in d["conflicts"]), 1e-12)
    for c in d["conflicts"]:
        scenario = f", scenario {c['scenario']}" if c["scenario"] else ""
        lines.append(
            f"{_spoken(c['quantity'])}: beyond its limit by {100.0 * c['value']:.3g} % ({c['place']}{scenario}); weight "
            f"{c['multiplier'] / total:.2f}"
        )
    for reasons in d["rejected"]:
        lines += [
            f"rejected: {_spoken(r['quantity'])} beyond its limit by {100.0 * r['excess']:.3g} % on the full model"
            for r in reasons
        ]
    return lines


def tables(d: Document) -> list[Table]:
    """Everything of a verified design, empty tables left out.

    Parameters
    ----------
    d : mapping
    """
    fronts = (front(d, quantity, points) for quantity, points in d["pareto"].items())
    return [t for t in (before_and_after(d), variables(d), movers(d), relaxations(d), *fronts) if t.rows]


def before_and_after(d: Document) -> Table:
    """Every limit with its worst value, before and after.

    Parameters
    ----------
    d : mapping
    """
    before, after = d["before"], d["after"]
    rows = [["stability limit", _limit_text(before["stability_limit"]), _limit_text(after["stability_limit"]), "", ""]]
    if after["proof"] is not None:
        rows.append(["proven stable", "", f"to {after['proof']['stable_up_to_rpm']:.2f} rpm", "", "on its own mesh"])
    if "within_limits_up_to_rpm" in before:
        reach = before["within_limits_up_to_rpm"]
        then = f"to {reach:.0f} rpm" if reach else "nowhere"
        rows.append(["within all limits", then, f"to {d['speed_rpm']:.0f} rpm", "", ""])
    for row in d["limits"]:
        was = before["quantities"].get(row["quantity"], {}).get("value")
        remark = "active" if row["active"] else ""
        if row["active"] and abs(row["percent_per_percent"]) > 5e-4:
            remark += f", 1 % of it is worth {abs(row['percent_per_percent']):.2g} %"
        where = f" at {row['speed_rpm']:.0f} rpm" if row["speed_rpm"] else ""
        rows.append(
            [
                _spoken(row["quantity"]),
                "" if was is None else in_words(was, row["unit"]),
                in_words(row["value"], row["unit"]) + where,
                f"{row['kind']} {in_words(row['limit'], row['unit'])}",
                remark,
            ]
        )
    note = f"Quantities before are the worst up to {before['range_rpm']:.0f} rpm, after up to {after['range_rpm']:.0f} rpm."
    return table("Before and after", "lrrrl", ("", "before", "after", "limit", ""), rows, note)


def variables(d: Document) -> Table:
    """What was free to change.

    Parameters
    ----------
    d : mapping
    """
    rows = []
    for v in d["variables"]:
        unit = v["unit"]
        rows.append(
            [
                v["name"],
                in_words(v["before"], unit),
                "" if v["after"] is None else in_words(v["after"], unit),
                f"{in_words(v['lower'], unit)} to {in_words(v['upper'], unit)}",
                f"at its {v['at_bound']} bound" if v["at_bound"] else "",
            ]
        )
    return table("Variables", "lrrrl", ("variable", "before", "after", "bounds", ""), rows)


def movers(d: Document, count: int = 8) -> Table:
    """What moves the stability limit most.

    Parameters
    ----------
    d : mapping
    count : int
        Number of rows.
    """
    rows = [[s["number"], f"{s['percent_per_percent']:+.3f}"] for s in d["sensitivities"][:count]]
    return table("What moves the stability limit most", "lr", ("number", "% per %"), rows)


def relaxations(d: Document) -> Table:
    """What easing each active limit brings.

    Parameters
    ----------
    d : mapping
    """
    units = {row["quantity"]: row["unit"] for row in d["limits"]}
    rows = []
    for r in d["relaxations"]:
        unit = units[r["quantity"]]
        rows.append(
            [
                _spoken(r["quantity"]),
                in_words(r["limit"], unit),
                in_words(r["eased"], unit),
                in_words(r["predicted"], _unit(d), speed=True),
                "not verified" if r["solved"] is None else in_words(r["solved"], _unit(d), speed=True),
            ]
        )
    columns = ("limit", "from", "to", "predicted", "solved")
    return table("What easing a limit by 10 % brings", "lrrrr", columns, rows)


def front(d: Document, quantity: str, points: Sequence[Document]) -> Table:
    """The objective over the limit of a quantity.

    Parameters
    ----------
    d : mapping
    quantity : str
    points : sequence of mapping
    """
    rows = [
        [
            in_words(p["limit"], QUANTITIES[quantity].unit),
            "none found" if p["objective"] is None else in_words(p["objective"], _unit(d), speed=True),
        ]
        for p in points
    ]
    return table("Compromises", "lr", (_spoken(quantity), _spoken(d["objective"]["quantity"])), rows)


def starts(d: Document) -> Table:
    """How each start of the search ended.

    Parameters
    ----------
    d : mapping
    """
    rows = []
    for o in d["starts"]:
        told = (
            f"least violation {100.0 * o['violation']:.2g} %"
            if o["status"] == INFEASIBLE
            else in_words(o["objective"], _unit(d), speed=True)
        )
        rows.append([str(o["index"]), o["status"], told, f"{o['cpu_seconds']:.1f}"])
    return table("Starts", "rlrr", ("start", "status", "found", "CPU [s]"), rows)


def _unit(d: Document) -> str:
    return str(d["objective"]["unit"])


def _spoken(quantity: str) -> str:
    return quantity.replace("_", " ")


def _limit_text(limit: Document) -> str:
    if limit["status"] == "limit found":
        return f"{limit['speed_rpm']:.0f} rpm"
    if limit["status"] == "none below the top speed":
        return f"none below {limit['speed_rpm']:.0f} rpm"
    return str(limit["status"])
