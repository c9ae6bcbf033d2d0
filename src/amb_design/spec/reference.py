"""The fields of a machine file and the quantities of a problem file as Markdown tables, from the specification itself.

``python -m amb_design.spec.reference`` prints the tables that docs/machine-files.md holds, with the argument ``quantities``
the one of docs/problem-files.md, with ``conditions`` those of docs/comparison.md.
"""

from __future__ import annotations

import dataclasses
import sys

from .bearing import Bearing, Pin
from .comparison import BaseShock, Conditions, ForceStep
from .controller import LQG, LQR, PID, Amplifier, LowPass, Matrices, Notch, StateSpace
from .disk import Disk
from .fields import Spec
from .machine import Machine, Operation, Sensor
from .magnet import Magnet
from .material import Isotropic, Orthotropic
from .quantities import QUANTITIES, Option
from .shaft import Segment, Shaft

TABLES: dict[str, type[Spec]] = {
    "the file itself": Machine,
    "[operation]": Operation,
    "[materials.NAME], isotropic": Isotropic,
    "[materials.NAME], orthotropic": Orthotropic,
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
    rows = [f"### {heading}", "", "| field | unit | default | meaning |", "|---|---|---|---|"]
    for f in dataclasses.fields(kind):
        unit = f.metadata.get("unit")
        meaning = f.metadata.get("doc", "")
        if "options" in f.metadata:
            meaning += ": " + ", ".join(f.metadata["options"])
        rows.append(f"| `{f.name}` | {'' if unit is None else unit or '1'} | {_default(f)} | {meaning} |")
    return "\n".join([*rows, ""])


def _default(f: dataclasses.Field) -> str:  # type: ignore[type-arg]
    if f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING:
        return "required"
    if f.default in (None, "", ()) or f.default is dataclasses.MISSING:
        return ""
    return f"{f.default:.6g}" if isinstance(f.default, float) else str(f.default)


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


if __name__ == "__main__":
    references = {"quantities": quantity_reference, "conditions": condition_reference}
    chosen = next((references[word] for word in sys.argv[1:] if word in references), field_reference)
    print(chosen(), end="")
