"""Designs side by side, in tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..comparison.table import EMPTY, digits
from .parts import BETTER, Table, table

Document = Mapping[str, Any]

SAID = ("force step", "base shock", "unbalance", "noise")
"""Groups without which a label says too little."""


def lines(d: Document) -> Table:
    """Every line of which something is known; the better entry has a star.

    Parameters
    ----------
    d : mapping
        From `amb_design.comparison.table.ComparisonTable.document`.
    """
    rows = []
    for line in d["lines"]:
        if all(text in EMPTY for text in line["text"].values()):
            continue
        label = f"{line['group']}: {line['label']}" if line["group"] in SAID else line["label"]
        rows.append([label, *(text + BETTER * (name in line["best"]) for name, text in line["text"].items())])
    title = f"Operating range up to {d['conditions']['speed_rpm']:.0f} rpm; the better entry has a star"
    return table(title, "l" + "r" * len(d["designs"]), ("measure", *d["designs"]), rows)


def modes(d: Document) -> Table:
    """Damping of the first modes of each design.

    Parameters
    ----------
    d : mapping
    """
    designs = d["designs"]
    rows = []
    for k in range(max(len(design["modes"]) for design in designs.values())):
        texts = [_mode(design["modes"][k]) if k < len(design["modes"]) else "" for design in designs.values()]
        rows.append([str(k + 1), *texts])
    title = "First modes: least damping ratio, frequency at rest"
    return table(title, "l" + "r" * len(designs), ("mode", *designs), rows)


def _mode(m: Document) -> str:
    kind = " (controller)" if m["kind"] == "controller" else ""
    return f"{digits(100.0 * m['least_damping_ratio'])} %, {digits(m['frequency_hz'])} Hz {m['whirl']}{kind}"
