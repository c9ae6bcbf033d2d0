"""Rotating damping: exact stability thresholds and the shaft of Zorzi & Nelson. Sources and tolerances: cases/*.json."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.certificate import Crossing, Walk
from checks import within
from published.reference import case, uniform_shaft

RPM = ad.rpm(1.0)


def test_jeffcott_two_state_matrices() -> None:
    """The complex 2 x 2 system itself; "1e-8 on the 2-state matrices"."""
    reference = case("damping_jeffcott_exact")
    i, out = reference["inputs"], reference["outputs"]
    a0 = np.array([[0.0, 1.0], [-i["k"] / i["m"], -(i["c_nonrot"] + i["c_rot"]) / i["m"]]], complex)
    a1 = np.array([[0.0, 0.0], [1j * i["c_rot"] / i["m"], 0.0]])
    walk = Walk(a0, a1)
    crossings = [e for e in walk.events(3000.0) if isinstance(e, Crossing)]
    assert [c.onset for c in crossings] == [True]
    crossing = crossings[0]
    within(crossing.lower, out["Omega_threshold"], 1e-8, "Jeffcott, 2 states, threshold from below")
    within(crossing.upper, out["Omega_threshold"], 3e-8, "Jeffcott, 2 states, threshold from above")
    whirl = crossing.below.values[crossing.critical].imag
    within(whirl, out["whirl_at_threshold"], 1e-8, "Jeffcott, 2 states, whirl frequency")
    within(math.sqrt(i["k"] / i["m"]), out["omega_n"], 1e-12, "Jeffcott, natural frequency")


def jeffcott() -> ad.Machine:
    """The same from beam elements: a light pinned shaft with the disk and the external damper at midspan."""
    i = case("damping_jeffcott_exact")["inputs"]
    length, modulus, density = 1.0, 200e9, 100.0
    diameter = (64.0 / math.pi * i["k"] * length**3 / (48.0 * modulus)) ** 0.25
    shaft_mass = density * math.pi / 4.0 * diameter**2 * length
    return ad.Machine(
        name="Jeffcott",
        rotor=ad.Rotor(
            shaft=uniform_shaft(
                ad.Isotropic(E=modulus, nu=0.3, density=density),
                length,
                diameter,
                theory="euler-bernoulli",
                viscous_damping=i["c_rot"] / i["k"],
                elements=8,
            ),
            # 17/35 of a pinned shaft's mass moves with a disk at midspan, by the static deflection
            disks=(
                ad.Disk(
                    position=length / 2,
                    mass=i["m"] - 17.0 / 35.0 * shaft_mass,
                    diametral_inertia=0.01,
                    polar_inertia=0.01,
                ),
            ),
        ),
        bearings=(ad.Bearing(position=length / 2, damping=i["c_nonrot"]),),
        pins=(ad.Pin(position=0.0), ad.Pin(position=length)),
        operation=ad.Operation(top_speed=3000.0),
    )


@pytest.mark.parametrize("origin", ["inputs", "packaged"])
def test_jeffcott_from_beam_elements(origin: str) -> None:
    machine = ad.load("jeffcott") if origin == "packaged" else jeffcott()
    out = case("damping_jeffcott_exact")["outputs"]
    limit = ad.stability_limit(machine)
    assert limit.status == "limit found"
    assert limit.certified
    assert limit.mode is not None
    assert limit.mode.whirl == "forward"
    tolerance = 5e-4  # "5e-4 when built as a machine from beam elements"
    within(limit.speed, out["Omega_threshold"], tolerance, f"Jeffcott, beam, {origin}, threshold")
    within(limit.mode.frequency, out["whirl_at_threshold"], tolerance, f"Jeffcott, beam, {origin}, whirl frequency")
    undamped = ad.replace(machine, {"bearings": (), "rotor.shaft.viscous_damping": 0.0})
    lowest = ad.spectrum(undamped, modes=1)[0]
    within(lowest.frequency, out["omega_n"], tolerance, f"Jeffcott, beam, {origin}, natural frequency")


def test_simply_supported_shaft() -> None:
    """Three exact thresholds of the Euler-Bernoulli shaft; "1e-4 on 20 elements"."""
    reference = case("damping_simply_supported_exact")
    i, out = reference["inputs"], reference["outputs"]
    machine = ad.Machine(
        name="simply supported",
        rotor=ad.Rotor(
            shaft=uniform_shaft(
                ad.Isotropic(E=i["E"], nu=0.3, density=i["rho"]),
                i["L"],
                i["diameter"],
                theory="euler-bernoulli",
                viscous_damping=i["eta_V"],
                external_damping=i["c_external_per_length"],
                elements=20,
            )
        ),
        pins=(ad.Pin(position=0.0), ad.Pin(position=i["L"])),
        operation=ad.Operation(top_speed=1.1 * out["threshold_rad_s"][-1]),
    )
    limit = ad.stability_limit(machine)
    assert limit.certified
    assert [(o.unstable, o.count) for o in limit.onsets] == [(True, 1), (True, 2), (True, 3)]
    assert limit.speed == limit.onsets[0].speed
    tolerance = 1e-4
    within([o.speed for o in limit.onsets], out["threshold_rad_s"], tolerance, "simply supported, thresholds")
    within([o.mode.frequency for o in limit.onsets], out["omega_n"], tolerance, "simply supported, whirl at thresholds")


ZORZI = [("Rayleigh_20el", "rayleigh"), ("Timoshenko_nu0.3_20el", "timoshenko")]


def zorzi_nelson(theory: str, **damping: float) -> ad.Machine:
    i: dict[str, Any] = case("damping_zorzi_nelson")["inputs"]
    material = ad.Isotropic(E=i["E"], nu=i["nu_assumed"], density=i["rho"])
    return ad.Machine(
        name=f"Zorzi & Nelson, {theory}",
        rotor=ad.Rotor(shaft=uniform_shaft(material, i["L"], i["diameter"], theory=theory, elements=20, **damping)),
        bearings=tuple(ad.Bearing(position=x, stiffness=i["bearing_k"]) for x in (0.0, i["L"])),
        operation=ad.Operation(top_speed=25_000 * RPM),
    )


@pytest.mark.parametrize(("key", "theory"), ZORZI)
def test_zorzi_nelson_undamped(key: str, theory: str) -> None:
    out = case("damping_zorzi_nelson")["outputs"][key]
    machine = zorzi_nelson(theory)
    critical = [c.speed_rpm for c in ad.critical_speeds(machine)]
    tolerance = 1e-3  # "0.1 % on whirl speeds and viscous threshold, against the 20-element values"
    within(critical, out["undamped_sync_criticals_rpm"], tolerance, f"{machine.name}, critical speeds")
    modes = ad.spectrum(machine, 4000 * RPM, modes=6)
    expected = out["undamped_whirl_4000rpm_rad_s"]
    within([m.frequency for m in modes], expected, tolerance, f"{machine.name}, whirl at 4000 rpm")


@pytest.mark.parametrize(("key", "theory"), ZORZI)
def test_zorzi_nelson_viscous(key: str, theory: str) -> None:
    out = case("damping_zorzi_nelson")["outputs"][key]
    eta = case("damping_zorzi_nelson")["inputs"]["eta_V"]
    machine = zorzi_nelson(theory, viscous_damping=eta)
    tolerance = 1e-3
    expected = np.array([complex(*r) for r in out["viscous_eta2e4_eig_4000rpm"]])
    # eta_v overdamps the high modes: their slow halves, near -1/eta_v + i Omega, are no whirl
    whirling = [m for m in ad.spectrum(machine, 4000 * RPM) if m.damping_ratio < 0.5]
    computed = np.array([m.eigenvalue for m in whirling[: len(expected)]])
    within(computed.imag, expected.imag, tolerance, f"{machine.name}, damped whirl at 4000 rpm")
    if theory == "rayleigh":  # no tolerance is stated for real parts; this theory has no shear to be damped or not
        within(computed.real, expected.real, tolerance, f"{machine.name}, real parts at 4000 rpm")
    limit = ad.stability_limit(machine)
    assert limit.certified
    within(limit.speed_rpm, out["viscous_threshold_rpm"], tolerance, f"{machine.name}, viscous threshold")
    forward = next(c for c in ad.critical_speeds(zorzi_nelson(theory)) if c.whirl == "forward")
    within(limit.speed, forward.speed, tolerance, f"{machine.name}, threshold and first forward critical speed")


@pytest.mark.parametrize("theory", ["rayleigh", "timoshenko"])
def test_zorzi_nelson_hysteretic_damping_is_unstable_at_every_speed(theory: str) -> None:
    """Its circulation does not depend on the speed: forward whirl grows, even at rest."""
    eta = case("damping_zorzi_nelson")["inputs"]["eta_H"]
    limit = ad.stability_limit(zorzi_nelson(theory, hysteretic_damping=eta), first_only=True)
    assert limit.status == "unstable at rest"
    assert limit.speed == 0.0
    assert {m.whirl for m in limit.unstable_at_rest} == {"forward"}
