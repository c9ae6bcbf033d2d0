"""Laminates: constants of lamination theory, and the tube of Zinberg & Symonds. Sources, tolerances: cases/*.json."""

from __future__ import annotations

import math

import pytest

import amb_design as ad
from amb_design.model.laminate import laminate_moduli, membrane_stiffness, section_constants
from checks import within, within_absolute
from published.reference import case

RPM = ad.rpm(1.0)


def ply_material(m: dict[str, float], g13: float, g23: float) -> ad.Orthotropic:
    return ad.Orthotropic(E1=m["E1"], E2=m["E2"], G12=m["G12"], G13=g13, G23=g23, nu12=m["nu12"], density=m["rho"])


def test_lamination_theory_constants() -> None:
    """Membrane stiffness, moduli and section of the Zinberg laminate; "1e-8 relative"."""
    reference = case("composite_clt_constants")
    i, out = reference["inputs"], reference["outputs"]
    g = i["material"]["G12"]
    plies = ad.layup(ply_material(i["material"], g, g), [math.radians(a) for a in i["layup_deg"]], i["ply_thickness"])
    a11, a12, a22, a16, a26, a66 = (float(a) for a in membrane_stiffness(plies))
    expected = out["A_N_per_m"]
    tolerance = 1e-8
    within([a11, a12, a22, a66], [expected[0][0], expected[0][1], expected[1][1], expected[2][2]], tolerance, "CLT, A")
    # A16 and A26 cancel: 1e-8 of A66
    within_absolute([a16, a26], [expected[0][2], expected[1][2]], tolerance * expected[2][2], "CLT, A16 and A26")
    ex, gxy = (float(v) for v in laminate_moduli(plies))
    within([ex, gxy], [out["Ex_Pa"], out["Gxy_Pa"]], tolerance, "CLT, Ex and Gxy")
    within(a11 / sum(p.thickness for p in plies), out["A11_over_h"], tolerance, "CLT, A11/h")
    geometry = case("composite_zinberg_symonds")["inputs"]["geometry"]
    tube = ad.Segment(length=1.0, inner_diameter=geometry["mean_diameter"] - geometry["wall"], plies=plies)
    section = section_constants(tube, "hoop-free-laminate")
    density = i["material"]["rho"]
    within(float(section.mass) / density, out["area_m2"], tolerance, "CLT, area of the tube")
    within(float(section.inertia) / density, out["I_m4"], tolerance, "CLT, second moment of area, from Id")
    within(float(section.bending), out["Ex_Pa"] * out["I_m4"], tolerance, "CLT, bending stiffness")
    within(float(section.shear), 2.0 * out["Gxy_Pa"] * out["area_m2"] / 2.0, tolerance, "CLT, shear stiffness")


def zinberg_symonds(law: str, theory: str = "timoshenko") -> ad.Machine:
    i = case("composite_zinberg_symonds")["inputs"]
    geometry, material = i["geometry"], ply_material(i["material"], i["G13"], i["G23"])
    angles = [math.radians(a) for a in geometry["layup_deg_inner_to_outer"]]
    return ad.Machine(
        name=f"Zinberg & Symonds, {law}, {theory}",
        rotor=ad.Rotor(
            shaft=ad.Shaft(
                segments=(
                    ad.Segment(
                        length=geometry["L"],
                        inner_diameter=geometry["mean_diameter"] - geometry["wall"],
                        plies=ad.layup(material, angles, geometry["ply_thickness"]),
                    ),
                ),
                shear_correction=0.5,
                ply_law=law,
                theory=theory,
            )
        ),
        bearings=tuple(ad.Bearing(position=x, stiffness=1.74e9) for x in (0.0, geometry["L"])),
        operation=ad.Operation(top_speed=8000 * RPM),
    )


def first_critical(machine: ad.Machine, whirl: str) -> float:
    return next(c.speed_rpm for c in ad.critical_speeds(machine) if c.whirl == whirl)


TOLERANCE = 1e-2  # "1 % to 5760 rpm, first FORWARD critical"; "Do not demand better than 1 %"


@pytest.mark.parametrize("law", ["hoop-free-laminate", "plane-stress"])
def test_zinberg_symonds_first_forward_critical(law: str) -> None:
    literature = case("composite_zinberg_symonds")["outputs"]["first_critical_rpm_literature"]
    machine = zinberg_symonds(law)
    computed = first_critical(machine, "forward")
    within(computed, literature["Boukhalfa_p_version"], TOLERANCE, f"{machine.name}, first forward critical speed")
    low, high = literature["experiment_range"]
    assert low < computed < high


def test_zinberg_symonds_packaged() -> None:
    literature = case("composite_zinberg_symonds")["outputs"]["first_critical_rpm_literature"]
    computed = first_critical(ad.load("zinberg-symonds"), "forward")
    within(computed, literature["Boukhalfa_p_version"], TOLERANCE, "Zinberg & Symonds, packaged")
    within(computed, first_critical(zinberg_symonds("hoop-free-laminate"), "forward"), 1e-9, "packaged, as built here")


RECOMPUTED = [
    ("EB_no_rotary", "hoop-free-laminate", "euler-bernoulli", "forward"),
    ("Rayleigh_forward", "hoop-free-laminate", "rayleigh", "forward"),
    ("Rayleigh_backward", "hoop-free-laminate", "rayleigh", "backward"),
    ("Timoshenko_k05_forward", "hoop-free-laminate", "timoshenko", "forward"),
    ("Timoshenko_k05_backward", "hoop-free-laminate", "timoshenko", "backward"),
    ("layerwise_EI_GA_uncoupled_forward", "hoop-free-ply", "timoshenko", "forward"),
]


@pytest.mark.parametrize(("key", "law", "theory", "whirl"), RECOMPUTED)
def test_zinberg_symonds_recomputed(key: str, law: str, theory: str, whirl: str) -> None:
    expected = case("composite_zinberg_symonds")["outputs"]["first_critical_rpm_recomputed"][key]
    computed = first_critical(zinberg_symonds(law, theory), whirl)
    within(computed, expected, TOLERANCE, f"Zinberg & Symonds, {key}")


def test_zinberg_symonds_at_rest() -> None:
    expected = case("composite_zinberg_symonds")["outputs"]["first_critical_rpm_recomputed"]
    frequency = ad.spectrum(zinberg_symonds("hoop-free-laminate"), 0.0, modes=1)[0].frequency
    within(frequency / RPM, expected["Timoshenko_k05_nonrotating"], TOLERANCE, "Zinberg & Symonds, at rest")


def test_ply_wise_law_is_no_pass() -> None:
    """Without hoop stress in each ply by itself the tube comes out 4 % low, as reported (5513 rpm)."""
    computed = first_critical(zinberg_symonds("hoop-free-ply"), "forward")
    assert computed == pytest.approx(5513, abs=1)
    assert abs(computed / 5760 - 1) > 4 * TOLERANCE
