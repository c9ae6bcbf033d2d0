"""What a design gains and what limits it, in short sentences and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..optimise.design import missed
from ..optimise.start import INFEASIBLE
from ..spec.problem import DesignProblem
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
    limit = d["after"]["stability_limit"]
    searched = name == "stability limit" and limit["status"] == "none below the top speed"
    if searched and d["speed_rpm"] >= limit["speed_rpm"] * (1.0 - 1e-6):
        value += ", where the search ends"
    return f"{d['status']}: {what} {value} ({held} of {len(d['starts'])} starts within the limits)"


def asked(problem: DesignProblem) -> list[str]:
    """What was sought, within which limits, a sentence each.

    Parameters
    ----------
    problem : DesignProblem
    """
    sense = "smallest" if problem.objective.kind.upper else "largest"
    numbers = f"{len(problem.variables)} number{'' if len(problem.variables) == 1 else 's'}"
    lines = [f"The {sense} {_spoken(problem.objective.quantity)}, by changing {numbers} of the machine."]
    for c in problem.constraints:
        word = "at most" if c.kind.upper else "at least"
        lines.append(f"{_spoken(c.quantity).capitalize()} {word} {in_words(c.bound, c.kind.unit)}: {c.kind.doc}.")
    if problem.scenarios:
        lines.append(f"In {len(problem.scenarios)} scenarios as well: {', '.join(problem.scenarios)}.")
    return lines


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
            f"{_spoken(c['quantity'])}: missed by {missed(c['quantity'], c['value'])} ({c['place']}{scenario}); weight "
            f"{c['multiplier'] / total:.2f}"
        )
    for reasons in d["rejected"]:
        lines += [f"rejected: {r['told']}" for r in reasons]
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
    sought = d["objective"]
    if sought["quantity"] != "stability_limit":
        was = before["quantities"][sought["quantity"]]["value"]
        was = "" if was is None else in_words(was, sought["unit"])
        rows.append(
            [_spoken(sought["quantity"]), was, in_words(sought["value"], sought["unit"]), "", "what was sought"]
        )
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
    return table("Before and after", "lrrrl", ("quantity", "before", "after", "limit", "remark"), rows, note)


def variables(d: Document) -> Table:
    """What was free to change.

    Parameters
    ----------
    d : mapping
    """
    rows = []
    for v in d["variables"]:
        unit, turns = v["unit"], v["name"].endswith("speed")
        rows.append(
            [
                v["name"],
                " and ".join(in_words(x, unit, speed=turns) for x in [v["before"], *v["others_before"]]),
                "" if v["after"] is None else in_words(v["after"], unit, speed=turns),
                f"{in_words(v['lower'], unit, speed=turns)} to {in_words(v['upper'], unit, speed=turns)}",
                f"at its {v['at_bound']} bound" if v["at_bound"] else "",
            ]
        )
    return table("Variables", "lrrrl", ("variable", "before", "after", "bounds", "remark"), rows)


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
