"""The set of figures that belongs to an analysis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .. import plots
from ..analysis.campbell import campbell
from ..analysis.modes import OVERDAMPED
from ..analysis.sensitivity import sensitivity_over_speed
from ..analysis.spectrum import spectrum
from ..analysis.stability import FOUND, MARGINAL, UNSTABLE
from ..analysis.summary import Analysis
from ..analysis.system import System, system
from ..analysis.unbalance import unbalance_response
from ..spec.machine import Machine
from ..words.analysis import limit_text
from .picture import Drawn

SPEEDS = 46
"""Speeds of the Campbell diagram."""


def machine_drawing(machine: Machine) -> Drawn:
    """The machine to scale.

    Parameters
    ----------
    machine : Machine
    """
    parts = {
        "disk": len(machine.rotor.disks),
        "passive bearing": len(machine.bearings),
        "pin": len(machine.pins),
        "magnetic bearing": len(machine.magnets),
        "sensor": len(machine.sensors),
    }
    told = ", ".join(f"{n} {what}{'s' if n > 1 else ''}" for what, n in parts.items() if n)
    length = f"{float(machine.rotor.shaft.length):.4g} m"
    alt = f"Longitudinal section of the machine: a shaft of {length} with {told or 'nothing on it'}."
    return "machine", "The machine in section; magnets and springs are symbols.", alt, plots.machine(machine)


def drawings(analysis: Analysis, *, main_only: bool = False) -> Iterator[Drawn]:
    """Draw what an analysis has to show.

    Parameters
    ----------
    analysis : Analysis
    main_only : bool
        Only the Campbell diagram, the damping ratios and the largest real part.
    """
    machine, limit, critical = analysis.machine, analysis.limit, analysis.critical
    loop = system(machine)
    if not main_only:
        yield machine_drawing(machine)
    diagram = campbell(loop, np.linspace(0.0, limit.top_speed, SPEEDS), critical=False)
    top = f"up to {limit.top_speed * 30.0 / np.pi:.0f} rpm"
    document = analysis.document()
    told = f"Stability limit: {limit_text(document)}."
    forward = ", ".join(f"{c:.0f}" for c in document["critical_speeds_rpm"]) or "none"
    yield (
        "campbell",
        f"Whirl frequencies over the spin speed {top}: the Campbell diagram.",
        f"Campbell diagram of {len(diagram.whirl)} modes {top}. {told} Forward critical speeds in rpm: {forward}.",
        plots.campbell(replace(diagram, critical=critical), limit=limit),
    )
    yield (
        "damping",
        "Damping ratio of each mode over the spin speed.",
        f"Damping ratios of {len(diagram.whirl)} modes {top}. {told}",
        plots.damping_ratios(diagram, limit=limit),
    )
    yield (
        "real_part",
        "Largest real part of all modes over the spin speed; the machine is unstable where it is positive.",
        f"Largest real part of all eigenvalues {top}. {told}",
        plots.real_part(diagram, limit=limit),
    )
    if not main_only:
        yield from _shapes(analysis, loop)
        yield from _responses(analysis, loop)
        yield from _loops(analysis, loop)


def _shapes(analysis: Analysis, loop: System) -> Iterator[Drawn]:
    """The mode that limits, and the lowest ones beside it."""
    limit = analysis.limit
    at = limit.speed if limit.status == FOUND else 0.0
    modes = [m for m in spectrum(loop, at) if m.whirl != "none" and m.damping_ratio < OVERDAMPED]
    limiting = [limit.mode] if at and limit.mode is not None and limit.mode.whirl != "none" else []
    others = [
        m for m in modes if not any(abs(m.eigenvalue - x.eigenvalue) < 1e-3 * abs(x.eigenvalue) for x in limiting)
    ]
    chosen = [*limiting, *others][:4]
    where = "at the stability limit" if at else "at rest"
    first = "the mode that sets it, then the lowest others" if limiting else "the lowest modes"
    yield (
        "modes",
        f"Mode shapes {where}: {first}.",
        f"Mode shapes {where}: {'; '.join(m.describe() for m in chosen)}.",
        plots.mode_shapes(chosen, loop),
    )


def _responses(analysis: Analysis, loop: System) -> Iterator[Drawn]:
    machine, limit, critical = analysis.machine, analysis.limit, analysis.critical
    if limit.status in (UNSTABLE, MARGINAL) or not any(d.unbalance for d in machine.rotor.disks):
        return
    response = unbalance_response(loop, np.linspace(limit.speed / 500.0, limit.speed, 500))
    reach = f"up to {limit.speed_rpm:.0f} rpm"
    yield (
        "unbalance",
        "Orbits under the unbalance of the file over the spin speed.",
        f"Orbit radii under unbalance {reach}, at most {1e6 * float(response.amplitudes.max()):.3g} micrometres on the shaft.",
        plots.unbalance(response, critical=critical),
    )
    if machine.magnets:
        yield (
            "currents",
            "Control currents under the same unbalance, with the bias current that they must stay below.",
            f"Control currents under unbalance {reach}, at most {float(response.peak_currents.max()):.3g} A.",
            plots.currents(response, critical=critical),
        )


def _loops(analysis: Analysis, loop: System) -> Iterator[Drawn]:
    if not analysis.sensitivities:
        return
    rest, fast = analysis.sensitivities[0], analysis.sensitivities[-1]
    yield (
        "sensitivity",
        "Sensitivity of each loop at rest with the zones of ISO 14839-3.",
        f"Sensitivity at rest: peak {rest.worst.value:.3g} of {rest.worst.loop}, zone {rest.zone}.",
        plots.sensitivity(rest),
    )
    yield (
        "open_loop",
        "Open loops at rest, all others closed.",
        f"Bode diagram of the open loops {', '.join(rest.loops)} at rest.",
        plots.open_loop(rest),
    )
    over = sensitivity_over_speed(loop, np.linspace(0.0, fast.speed, 9))
    yield (
        "sensitivity_over_speed",
        "Peak sensitivity over the spin speed with the zones of ISO 14839-3.",
        f"Peak sensitivities up to {fast.speed * 30.0 / np.pi:.0f} rpm, at most {over.worst:.3g}, zone {over.zone}.",
        plots.sensitivity_over_speed(over),
    )
