"""What an experienced reader stops at in a machine file: slips of units, and choices with consequences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..spec.controller import Chain
from ..spec.machine import Machine
from ..spec.material import Isotropic
from ..units import RPM

ROUGH = 16e-3
"""Eccentricity times speed [m/s] above which a rotor counts as hardly balanced: grade G 16 of ISO 21940-11."""

STIFFEST, DENSEST = 1.0e12, 23.0e3
"""Young's modulus [Pa] and density [kg/m^3] that no shaft exceeds."""

SOFTEST, LIGHTEST = 1.0e8, 500.0
"""And what none stays below."""

Outline = Mapping[str, Any]


def unusual(machine: Machine, outline: Outline) -> Iterator[str]:
    """Say what deserves a second look.

    Parameters
    ----------
    machine : Machine
    outline : mapping
        From `amb_design.analysis.outline.outline`.

    Yields
    ------
    str
        A sentence each, slips of units first.
    """
    yield from _materials(machine)
    yield from _unbalance(machine)
    yield from _damping(machine)
    yield from _load(outline)
    yield from _flux(machine, outline)
    yield from _stiffness(machine, outline)
    yield from _phase(outline)
    yield from _chain(machine)


def _materials(machine: Machine) -> Iterator[str]:
    seen = set()
    for i, segment in enumerate(machine.rotor.shaft.segments):
        for material in (segment.material, *(p.material for p in segment.plies)):
            if material is None or material in seen:
                continue
            seen.add(material)
            modulus = material.E if isinstance(material, Isotropic) else material.E1
            where = f"rotor.shaft.segments[{i}]"
            if not SOFTEST <= modulus <= STIFFEST:
                yield f"{where}: a Young's modulus of {modulus:.3g} Pa; is the unit right? Steel has 2.1e11 Pa."
            if not LIGHTEST <= material.density <= DENSEST:
                yield f"{where}: a density of {material.density:.4g} kg/m^3; is the unit right? Steel has 7850 kg/m^3."


def _unbalance(machine: Machine) -> Iterator[str]:
    speed = float(machine.operation.service_speed or machine.operation.top_speed)
    disks = machine.rotor.disks
    grades = [abs(float(d.unbalance)) / float(d.total_mass) * speed for d in disks]
    if not any(grades):
        yield "No disk has an unbalance: there will be no unbalance response, and no currents to judge the magnets by."
    elif max(grades) > ROUGH:
        i = grades.index(max(grades))
        yield (
            f"rotor.disks[{i}] has an eccentricity of {1e6 * grades[i] / speed:.3g} um: balancing grade G {1e3 * grades[i]:.3g} at "
            f"{speed / RPM:.0f} rpm, where G 2.5 is usual."
        )


def _damping(machine: Machine) -> Iterator[str]:
    shaft = machine.rotor.shaft
    if not any(shaft.viscous_damping_of(s) or shaft.hysteretic_damping_of(s) for s in shaft.segments):
        yield (
            "The shaft has no internal damping. It is what makes fast rotors unstable: without it the stability limit comes out too "
            "high, or there is none. Set viscous_damping."
        )
    if any(shaft.hysteretic_damping_of(s) for s in shaft.segments):
        yield "Hysteretic damping acts against the whirl at every speed here; real shafts do so only above the whirl frequency."


def _load(outline: Outline) -> Iterator[str]:
    """Magnets beside the weight that they would have to carry."""
    shares = {
        f"magnets[{i}]": m["load_of_an_axis_n"] / m["capacity_n"]
        for i, m in enumerate(outline["magnets"])
        if "capacity_n" in m and m["load_of_an_axis_n"] > 0.5 * m["capacity_n"]
    }
    if not shares:
        return
    heavy = max(shares.values()) > 1.0
    rest = (
        "little is left for dynamic forces"
        if not heavy
        else "the passive bearings have to stay"
        if outline["supported"]
        else "they cannot lift the rotor"
    )
    told = _and([f"{x:.3g}" for x in shares.values()])
    yield f"{_and(list(shares))}: the share of the weight is {told} times what an axis can pull; {rest}."


def _flux(machine: Machine, outline: Outline) -> Iterator[str]:
    for i, (magnet, m) in enumerate(zip(machine.magnets, outline["magnets"], strict=True)):
        bound = float(magnet.max_flux_density or 1.5)
        flux = m.get("bias_flux_density_t", 0.0)
        if flux > 0.6 * bound:
            told = "its limit" if magnet.max_flux_density is not None else "what iron bears"
            yield f"magnets[{i}]: the bias alone makes {flux:.3g} T, {100.0 * flux / bound:.0f} % of {told} ({bound:.3g} T)."
        if magnet.clearance is not None and magnet.gap is not None and magnet.clearance > 0.7 * magnet.gap:
            yield f"magnets[{i}]: the backup bearing leaves {1e6 * magnet.clearance:.0f} of {1e6 * magnet.gap:.0f} um of air gap."


def _stiffness(machine: Machine, outline: Outline) -> Iterator[str]:
    soft = [d["loop"] for d in outline["loops"] if d["net_stiffness_n_per_m"] <= 0.0]
    if soft:
        rest = " Only the passive bearings hold the rotor." if outline["supported"] else " The rotor will not levitate."
        yield f"{_and(soft)}: the loop is softer than the magnet's negative stiffness.{rest}"
    if machine.magnets and not outline["loops"] and machine.controller is None:
        yield "The magnets have bias, but no controller: they only push outward."
    elif machine.magnets and not outline["loops"]:
        yield "The whole state is fed back ideally: a reference that nobody can build, without loops to judge."
    free = not outline["supported"] and machine.operation.gravity
    if free and outline["loops"] and not any(d["integral_action"] for d in outline["loops"]):
        d = outline["loops"][0]
        sag = outline["magnets"][d["magnet"]]["load_of_an_axis_n"] / max(d["net_stiffness_n_per_m"], 1e-300)
        if d["net_stiffness_n_per_m"] > 0.0 and sag > 0.0:
            yield f"No loop has integral action: the weight makes the rotor sag, by {1e6 * sag:.3g} um at {d['loop']}."


def _phase(outline: Outline) -> Iterator[str]:
    """Flexible modes of which the loops take more than half of their damping."""
    for m in outline["rotor_modes"]:
        own, added = m["own_damping_ratio"], m.get("damping_ratio_from_loops", 0.0)
        if added < 0.0 and own + added < 0.5 * own:
            yield (
                f"At rest the loops take damping from the mode at {m['frequency_hz']:.4g} Hz ({100.0 * added:.2g} % of critical, to "
                f"first order), which has {100.0 * own:.2g} % of its own: their phase is wrong there, or sensor and magnet lie on opposite "
                "sides of a node."
            )


def _chain(machine: Machine) -> Iterator[str]:
    chains = [c for m in machine.magnets for c in machine.controllers_of(m) if isinstance(c, Chain)]
    if chains and all(c.amplifier is None and not c.delay for c in chains):
        yield (
            "The controller has neither amplifier nor delay: real ones cost phase, and the stability of bending modes depends on it."
        )
    if machine.magnets and not all(m.has_geometry for m in machine.magnets):
        yield "Magnets given by k_i and k_s alone have no force law: flux and voltage are not judged."
    if any(math.isclose(float(m.position), 0.0) for m in machine.magnets) and not machine.bearings:
        yield "A magnet sits at the very end of the shaft, where its laminations would overhang."


def _and(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
