"""The fields of a machine file and the quantities of a problem file as Markdown tables, from the specification itself.

``python -m amb_design.spec.reference`` prints all fields of a machine file, with the argument ``keys`` the keys of a problem file,
with ``quantities`` what it may limit and seek, with ``conditions`` those of a comparison. The site is built from the same tables.
"""

from __future__ import annotations

import dataclasses
import sys
from typing import Any, TypeAlias

from .bearing import Bearing, Pin
from .comparison import BaseShock, Conditions, ForceStep
from .controller import LQG, LQR, PID, Amplifier, LowPass, Matrices, Notch, StateSpace
from .disk import Disk
from .fields import Spec
from .machine import Machine, Operation, Sensor
from .magnet import Magnet
from .material import Isotropic, Orthotropic
from .problem_files import KEYS
from .quantities import QUANTITIES, Option
from .shaft import Ply, Segment, Shaft
from .tables import ALIASES, LAYUP

TABLES: dict[str, type[Spec]] = {
    "the file itself": Machine,
    "[operation]": Operation,
    "[materials.NAME], isotropic": Isotropic,
    "[materials.NAME], orthotropic": Orthotropic,
    "[layups.NAME], from the inside out": Ply,
    "[rotor.shaft]": Shaft,
    "[[rotor.shaft.segments]]": Segment,
    "[[rotor.disks]]": Disk,
    "[[bearings]]": Bearing,
    "[[pins]]": Pin,
    "[[magnets]]": Magnet,
    "[[sensors]]": Sensor,
    "[controller], [controller_z], or inside a magnet, type = 'pid'": PID,
    "[controller], type = 'lqg'": LQG,
    "[controller], type = 'lqr'": LQR,
    "[controller], type = 'state_space'": StateSpace,
    "[controller.law], [controller.law_rate], [controller.cross], [controller.cross_rate]": Matrices,
    "[controller.low_pass]": LowPass,
    "[[controller.notches]]": Notch,
    "[controller.amplifier]": Amplifier,
}


def field_reference() -> str:
    """Markdown tables of all fields.

    Returns
    -------
    str
    """
    return "\n".join(_table(heading, kind) for heading, kind in TABLES.items())


def condition_reference() -> str:
    """Markdown tables of the conditions of a comparison.

    Returns
    -------
    str
    """
    tables: dict[str, type[Spec]] = {
        "[conditions]": Conditions,
        "[conditions.force_step]": ForceStep,
        "[conditions.base_shock]": BaseShock,
    }
    return "\n".join(_table(heading, kind) for heading, kind in tables.items())


def _table(heading: str, kind: type[Spec]) -> str:
    rows = [f"### {heading}", "", "| field | unit | range | default | meaning |", "|---|---|---|---|---|"]
    written = {field: key for key, field in (LAYUP if kind is Ply else {}).items()}
    written |= {field: key for key, field in ALIASES.get(kind, {}).items()}
    for name, unit, values, default, meaning in field_rows(kind):
        rows.append(f"| `{written.get(name, name)}` | {unit} | {values} | {default} | {meaning} |")
    return "\n".join([*rows, ""])


def field_rows(kind: type[Spec]) -> list[tuple[str, str, str, str, str]]:
    """What each field of a specification class declares.

    Parameters
    ----------
    kind : type

    Returns
    -------
    list of tuple of str
        Name, unit ("1" for pure numbers, empty for what is no number), admissible values, default, meaning.
    """
    return [
        (f.name, _unit(f), _RANGES.get(f.metadata.get("domain", ""), ""), _default(f), _meaning(f))
        for f in dataclasses.fields(kind)
    ]


_RANGES = {"positive": "> 0", "nonnegative": ">= 0"}

_Field: TypeAlias = "dataclasses.Field[Any]"


def _unit(f: _Field) -> str:
    unit = f.metadata.get("unit")
    return "" if unit is None else unit or "1"


def _meaning(f: _Field) -> str:
    options = ", ".join(f"`{word}`" for word in f.metadata.get("options", ()))
    return f"{f.metadata.get('doc', '')}: {options}".removesuffix(": ")


def _default(f: _Field) -> str:
    if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING:
        return "required"
    if f.default in (None, "", ()) or f.default is dataclasses.MISSING:
        return ""
    if isinstance(f.default, bool):
        return str(f.default).lower()
    return f"{f.default:.6g}" if isinstance(f.default, float) else str(f.default)


def key_reference() -> str:
    """Markdown table of the keys of a problem file.

    Returns
    -------
    str
    """
    return "\n".join(["| key | meaning |", "|---|---|", *(f"| `{key}` | {doc} |" for key, doc in KEYS.items()), ""])


def quantity_reference() -> str:
    """Markdown table of all quantities.

    Returns
    -------
    str
    """
    rows = ["| quantity | unit | limit | objective | needs | meaning |", "|---|---|---|---|---|---|"]
    for q in QUANTITIES.values():
        objective = ("minimise" if q.upper else "maximise") if q.objective else ""
        needs = ", ".join(need.replace("_", " ") for need in q.needs)
        limit = "" if q.name == "stability_limit" else "upper" if q.upper else "lower"
        meaning = "; ".join([q.doc, *(_option(name, option) for name, option in q.options.items())])
        rows.append(f"| `{q.name}` | {q.unit or '1'} | {limit} | {objective} | {needs} | {meaning} |")
    return "\n".join([*rows, ""])


def _option(name: str, option: Option) -> str:
    unit = "" if option.unit in ("", "name") else f" [{option.unit}]"
    return f"{'required ' if option.default is None else ''}option `{name}`{unit}: {option.doc}"


REFERENCES = {
    "fields": field_reference,
    "keys": key_reference,
    "quantities": quantity_reference,
    "conditions": condition_reference,
}
"""By the word that asks for them."""

if __name__ == "__main__":
    print(REFERENCES[sys.argv[1] if sys.argv[1:] else "fields"](), end="")
