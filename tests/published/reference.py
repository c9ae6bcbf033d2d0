"""The published cases beside this file: one JSON file each, with inputs, outputs, source and tolerance."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import amb_design as ad

CASES = Path(__file__).parent / "cases"


def case(name: str) -> dict[str, Any]:
    """A case by the name of its file."""
    content: dict[str, Any] = json.loads((CASES / f"{name}.json").read_text(encoding="utf-8"))
    assert content["source"], f"{name} cites no source"
    return content


def uniform_shaft(material: ad.Isotropic, length: float, diameter: float, **fields: Any) -> ad.Shaft:
    """A solid shaft of one material and one diameter."""
    return ad.Shaft(segments=(ad.Segment(length=length, outer_diameter=diameter, material=material),), **fields)
