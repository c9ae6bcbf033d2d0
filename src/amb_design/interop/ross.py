"""ROSS: its rotors become machines, and machines its rotors; lateral motion alone, for axial and torsional motion is not modelled here.

ROSS turns about z with lateral axes x and y; here the shaft lies along x. Its x is our y, its y our z, so that the spin keeps its sense. Its
TOML files are read and written without ROSS; only `to_ross` needs the package (3.1.0 needs Python 3.13).
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from ..errors import ModelError, SpecError
from ..model.mesh import plan
from ..spec.bearing import Bearing
from ..spec.disk import Disk
from ..spec.machine import Machine, Operation, Rotor
from ..spec.material import Isotropic
from ..spec.shaft import Segment, Shaft
from .late import package

VERSION = "3.1.0"

SHAFT = ("L", "idl", "odl", "idr", "odr", "n", "axial_force", "torque", "alpha", "beta")
FLAGS = ("shear_effects", "rotary_inertia", "gyroscopic")
DISK = ("n", "m", "Id", "Ip", "tag")
COEFFICIENTS = tuple(f"{kind}{pair}" for kind in "kcm" for pair in ("xx", "xy", "yx", "yy"))

Record = dict[str, Any]


def from_ross(source: Any, top_speed: float = 1000.0, name: str = "") -> Machine:
    """A machine from a ROSS rotor.

    Parameters
    ----------
    source : ross.Rotor, or path
        Of a TOML file that ROSS saved.
    top_speed : float
        [rad/s] ROSS has none.
    name : str, optional

    Returns
    -------
    Machine
        With one segment for each run of equal elements, as many elements as ROSS has, and its bearings.

    Raises
    ------
    SpecError
        If the rotor holds what has no counterpart: tapered or nested elements, axial force, proportional damping, bearings whose coefficients
        change with the speed or that stand on other nodes, seals, couplings.
    """
    path = Path(source) if isinstance(source, str | os.PathLike) else None
    parts = _read(path) if path else _taken(source)
    shaft = sorted(parts["shaft"], key=lambda e: e["n"])
    if [e["n"] for e in shaft] != list(range(len(shaft))):
        raise _refused("shaft elements that lie in one another", "join them into one section")
    for e in shaft:
        _check_element(e)
    positions = np.concatenate([[0.0], np.cumsum([e["L"] for e in shaft])])
    return Machine(
        name=name or (path.stem if path else str(getattr(source, "tag", None) or "rotor of ROSS")),
        source={"title": f"ROSS {VERSION}: {path.name if path else 'a rotor object'}"},
        operation=Operation(top_speed=top_speed),
        rotor=Rotor(
            shaft=Shaft(segments=_segments(shaft), elements=max(len(shaft), 4)),
            disks=tuple(
                Disk(
                    position=float(positions[d["n"]]),
                    mass=float(d["m"]),
                    diametral_inertia=float(d["Id"]),
                    polar_inertia=float(d["Ip"]),
                    name=str(d.get("tag") or ""),
                )
                for d in parts["disks"]
            ),
        ),
        bearings=tuple(_bearing(b, positions) for b in parts["bearings"]),
    )


def to_ross(machine: Machine, elements: int = 1) -> Any:
    """A ROSS rotor from a machine.

    Parameters
    ----------
    machine : Machine
        With segments of one material, disks and passive bearings; magnets and controllers have no counterpart.
    elements : int
        Factor on the number of elements. Those of ROSS have two nodes and need about twice as many for the same accuracy.

    Returns
    -------
    ross.Rotor

    Raises
    ------
    SpecError
        If the machine holds what has no counterpart.
    SolveError
        If ROSS is not installed.
    """
    ross = package("ross", "ross-rotordynamics")
    parts = _records(machine, elements)
    shaft = [
        ross.ShaftElement(
            **{k: e[k] for k in ("L", "idl", "odl", "n")},
            material=ross.Material(**{k: v for k, v in e["material"].items() if k != "color"}),
        )
        for e in parts["shaft"]
    ]
    disks = [ross.DiskElement(**{k: d[k] for k in DISK}) for d in parts["disks"]]
    bearings = [
        ross.BearingElement(b["n"], tag=b["tag"], **{k: b[k][0] for k in COEFFICIENTS if k[0] != "m"})
        for b in parts["bearings"]
    ]
    return ross.Rotor(shaft, disks, bearings)


def save_ross(machine: Machine, file: str | os.PathLike[str], elements: int = 1) -> None:
    """Write a machine as a TOML file that ROSS loads, without ROSS.

    Parameters
    ----------
    machine, elements
        As in `to_ross`.
    file : path

    Raises
    ------
    SpecError
        If the machine holds what has no counterpart.
    """
    parts = _records(machine, elements)
    document: Record = {
        "ross_version": VERSION,
        "parameters": {"default_damping_ratio": 0.0, "alpha": 0.0, "beta": 0.0},
    }
    for kind, title in (("shaft", "ShaftElement"), ("disks", "DiskElement"), ("bearings", "BearingElement")):
        for record in parts[kind]:
            document[f"{title}_{record['tag']}"] = record
    Path(file).write_text(tomli_w.dumps(document), encoding="utf-8")


def _read(path: Path) -> dict[str, list[Record]]:
    """Elements of a file that ROSS saved."""
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SpecError(
            "cannot be read", field=str(path), got=error.strerror, remedy="name a file that ROSS saved"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SpecError(
            f"is no TOML file ({error})", field=str(path), remedy="save it with rotor.save of ROSS"
        ) from None
    parts: dict[str, list[Record]] = {"shaft": [], "disks": [], "bearings": []}
    kinds = {"ShaftElement": "shaft", "DiskElement": "disks", "BearingElement": "bearings"}
    proportional = document.get("parameters", {})
    if any(proportional.get(k) for k in ("default_damping_ratio", "alpha", "beta")):
        raise _refused("proportional or modal damping", "set it to zero")
    for title, record in document.items():
        if title in ("ross_version", "parameters"):
            continue
        kind = title.partition("_")[0]
        if kind not in kinds or not isinstance(record, Mapping):
            raise _refused(f"the entry {title!r}", "remove it")
        parts[kinds[kind]].append(dict(record))
    return _complete(parts)


def _taken(rotor: Any) -> dict[str, list[Record]]:
    """Elements of a rotor object."""
    try:
        shaft, disks, bearings = rotor.shaft_elements, rotor.disk_elements, rotor.bearing_elements
    except AttributeError:
        raise SpecError(
            "is no ROSS rotor", field="source", got=type(rotor).__name__, remedy="give a ross.Rotor or a file"
        ) from None
    if getattr(rotor, "point_mass_elements", None):
        raise _refused("point masses", "make them disks")
    for b in bearings:
        if type(b).__name__ not in ("BearingElement", "BallBearingElement", "RollerBearingElement"):
            raise _refused(f"a {type(b).__name__}", "replace it by a BearingElement")
    if any(getattr(rotor, k, 0) for k in ("alpha", "beta", "default_damping_ratio")):
        raise _refused("proportional or modal damping", "set it to zero")
    parts = {
        "shaft": [
            {k: getattr(e, k) for k in (*SHAFT, *FLAGS, "shear_method_calc")}
            | {"material": {k: getattr(e.material, k) for k in ("name", "rho", "E", "G_s")}}
            for e in shaft
        ],
        "disks": [{k: getattr(d, k) for k in DISK} for d in disks],
        "bearings": [{k: getattr(b, k) for k in (*COEFFICIENTS, "n", "n_link", "tag")} for b in bearings],
    }
    return _complete(parts)


def _complete(parts: dict[str, list[Record]]) -> dict[str, list[Record]]:
    if not parts["shaft"]:
        raise _refused("no shaft", "give it one")
    return parts


def _check_element(e: Record) -> None:
    if any(e.get(k) for k in ("axial_force", "torque", "alpha", "beta")):
        raise _refused("axial force, torque or proportional damping", "set them to zero")
    if e["idl"] != e["idr"] or e["odl"] != e["odr"]:
        raise _refused("tapered elements", "make them steps")
    if not all(e.get(k, True) for k in FLAGS) or e.get("shear_method_calc", "cowper") != "cowper":
        raise _refused(
            "elements without shear, rotary inertia or gyroscopic moments, or with another shear factor",
            "use the defaults",
        )


def _segments(shaft: Sequence[Record]) -> tuple[Segment, ...]:
    runs: list[list[Any]] = []
    for e in shaft:
        m = e["material"]
        key = (e["idl"], e["odl"], m["rho"], m["E"], m["G_s"])
        if runs and runs[-1][0] == key:
            runs[-1][1] += e["L"]
        else:
            runs.append([key, e["L"]])
    return tuple(
        Segment(
            length=float(length),
            inner_diameter=float(inner),
            outer_diameter=float(outer),
            material=Isotropic(E=float(E), G=float(G), density=float(rho)),
        )
        for (inner, outer, rho, E, G), length in runs
    )


def _bearing(b: Record, positions: Any) -> Bearing:
    values = {k: np.atleast_1d(np.asarray(b.get(k, 0.0), float)) for k in COEFFICIENTS}
    if any(len(v) != 1 for v in values.values()):
        raise _refused("bearings whose coefficients change with the speed", "take them at one speed")
    if b.get("n_link") is not None or not 0 <= b["n"] < len(positions):
        raise _refused("bearings on supports of their own", "stand them on the ground")
    if any(values[k][0] for k in COEFFICIENTS if k[0] == "m"):
        raise _refused("bearings with added mass", "set it to zero")
    turned = {"xx": "yy", "xy": "yz", "yx": "zy", "yy": "zz"}
    ours = {f"{k}{mine}": float(values[f"{k}{theirs}"][0]) for k in "kc" for theirs, mine in turned.items()}
    return Bearing(position=float(positions[b["n"]]), name=str(b.get("tag") or ""), **ours)


def _records(machine: Machine, elements: int) -> dict[str, list[Record]]:
    """Elements for ROSS."""
    _check_machine(machine)
    mesh = plan(machine).finer(elements)
    nodes = {path: mesh.node_of(path) // 2 for station in mesh.stations for path in station.members}
    spans = zip(mesh.stations, mesh.stations[1:], mesh.divisions, strict=False)
    lengths = [(b.position - a.position) / n for a, b, n in spans for _ in range(n)]
    segments = machine.rotor.shaft.segments
    return {
        "shaft": [
            _shaft_record(k, length, i, segments[i])
            for k, (length, i) in enumerate(zip(lengths, mesh.segment_of_elements(), strict=True))
        ],
        "disks": [
            _disk_record(disk, nodes[f"rotor.disks[{i}].position"], f"Disk {i}")
            for i, disk in enumerate(machine.rotor.disks)
        ],
        "bearings": [
            _bearing_record(bearing, nodes[f"bearings[{i}].position"], f"Bearing {i}")
            for i, bearing in enumerate(machine.bearings)
        ],
    }


def _check_machine(machine: Machine) -> None:
    shaft = machine.rotor.shaft
    if machine.magnets or machine.pins:
        raise _refused_here("magnets" if machine.magnets else "pins", "replace them by bearings with a stiffness")
    if any(s.material is None for s in shaft.segments):
        raise _refused_here("laminates", "give the segment an equivalent material")
    lossy: tuple[Shaft | Segment, ...] = (shaft, *shaft.segments)
    if any(part.viscous_damping or part.hysteretic_damping for part in lossy):
        raise _refused_here("rotating damping", "set it to zero")
    if shaft.theory != "timoshenko" or shaft.shear_correction != "cowper":
        raise _refused_here("another beam theory or shear correction", "use the defaults")
    if not machine.bearings:
        raise ModelError(f"{machine.name} has no bearing, without which ROSS makes no rotor")


def _shaft_record(k: int, length: Any, index: int, segment: Segment) -> Record:
    material = segment.material
    assert material is not None
    inner, outer = float(segment.inner_diameter), float(segment.outer)
    return {
        "L": float(length),
        "idl": inner,
        "odl": outer,
        "idr": inner,
        "odr": outer,
        "n": k,
        "axial_force": 0,
        "torque": 0,
        **dict.fromkeys(FLAGS, True),
        "shear_method_calc": "cowper",
        "tag": f"Shaft {k}",
        "alpha": 0.0,
        "beta": 0.0,
        "material": {
            "name": f"material_{index}",
            "rho": float(material.density),
            "E": float(material.E),
            "G_s": float(material.shear_modulus),
            "color": "#525252",
        },
    }


def _disk_record(disk: Disk, node: int, tag: str) -> Record:
    diametral, polar = disk.inertias
    return {
        "n": node,
        "m": float(disk.total_mass),
        "Id": float(diametral),
        "Ip": float(polar),
        "tag": disk.name or tag,
        "scale_factor": 1.0,
        "color": "Firebrick",
    }


def _bearing_record(bearing: Bearing, node: int, tag: str) -> Record:
    record: Record = {k: [0.0] for k in (*COEFFICIENTS, "kzz", "czz", "mzz")}
    for kind, matrix in (("k", bearing.stiffness_matrix), ("c", bearing.damping_matrix)):
        for pair, value in zip(("xx", "xy", "yx", "yy"), (*matrix[0], *matrix[1]), strict=True):
            record[kind + pair] = [float(value)]
    return {
        **record,
        "n": node,
        "tag": bearing.name or tag,
        "scale_factor": 1,
        "color": "#355d7a",
        "interpolation": "pchip",
    }


def _refused(what: str, remedy: str) -> SpecError:
    return SpecError(f"holds {what}, which has no counterpart here", field="the ROSS rotor", remedy=remedy)


def _refused_here(what: str, remedy: str) -> SpecError:
    return SpecError(f"holds {what}, which ROSS does not have", field="the machine", remedy=remedy)
