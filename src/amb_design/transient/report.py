"""A simulation as plain data: what the command line prints and writes as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..units import RPM
from .result import Transient


def document(result: Transient) -> dict[str, Any]:
    """Where the run went and what it met.

    Parameters
    ----------
    result : Transient
        From `amb_design.simulate`.

    Returns
    -------
    dict
        Units are in the names of the keys. Times count as the run does; peaks are those at the output times.
    """
    machine, peaks = result.machine, result.peaks
    magnets = [
        {
            "part": f"magnets[{i}]",
            "name": m.name,
            "position_m": float(m.position),
            "radius_m": float(peaks["magnet radius"][i]),
            "clearance_m": None if m.clearance is None else float(m.clearance),
            "current_a": float(peaks["current"][i]),
            "bias_current_a": None if m.bias_current is None else float(m.bias_current),
            "voltage_v": float(peaks["voltage"][i]) if m.has_geometry else None,
            "force_n": float(peaks["magnet force"][i]),
            "contact_force_n": float(peaks["contact force"][i]),
        }
        for i, m in enumerate(machine.magnets)
    ]
    disks = [
        {"part": f"rotor.disks[{i}]", "name": d.name, "position_m": float(d.position), "radius_m": float(radius)}
        for i, (d, radius) in enumerate(zip(machine.rotor.disks, peaks["disk radius"], strict=True))
    ]
    return {
        "name": machine.name,
        "start_s": float(result.times[0]),
        "end_s": float(result.times[-1]),
        "stopped": result.stopped,
        "outputs": len(result.times),
        "coordinates": int(result.coordinates.shape[1]),
        "speed_rpm": [float(result.speeds[k]) / RPM for k in (0, -1)],
        "turns": float(abs(result.angles[-1] - result.angles[0]) / (2.0 * np.pi)),
        "magnets": magnets,
        "disks": disks,
        "limits_met": [
            {"kind": s.kind, "magnet": s.magnet, "first_s": s.first, "share": s.share} for s in result.saturations
        ],
        "energy_error": float(np.abs(result.energy_error).max()),
    }
