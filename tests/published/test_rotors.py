"""Published rotors: whirl frequencies, damped roots and critical speeds. Sources and tolerances are in cases/*.json."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import amb_design as ad
from checks import within, within_absolute
from published.reference import case, uniform_shaft

RPM = ad.rpm(1.0)
ELEMENTS = 24  # converged to 1e-5: see test_meshes_are_converged


def steel_shaft(inputs: dict[str, Any], elements: int = ELEMENTS) -> ad.Shaft:
    shaft = inputs["shaft"]
    material = {"rho": "density"}
    fields = {material.get(k, k): v for k, v in inputs["material"].items()}
    return uniform_shaft(ad.Isotropic(**fields), shaft["L"], shaft["diameter"], elements=elements)


def friswell_two_disks(name: str, elements: int = ELEMENTS) -> ad.Machine:
    """Examples 5.9.1 and 5.9.5: two disks at the thirds of a shaft on two bearings at its ends."""
    inputs = case(name)["inputs"]
    step = inputs["shaft"]["L"] / inputs["shaft"]["n_elements"]
    bearing = inputs["bearings"]
    assert bearing["kxx"] == bearing["kyy"]
    assert bearing.get("cxx") == bearing.get("cyy")
    return ad.Machine(
        name=name,
        rotor=ad.Rotor(
            shaft=steel_shaft(inputs, elements),
            disks=tuple(
                ad.Disk(
                    position=d["node"] * step,
                    outer_diameter=d["od"],
                    inner_diameter=d["id"],
                    width=d["width"],
                    density=inputs["material"]["rho"],
                )
                for d in inputs["discs"]
            ),
        ),
        bearings=tuple(
            ad.Bearing(position=n * step, stiffness=bearing["kxx"], damping=bearing.get("cxx", 0.0))
            for n in bearing["nodes"]
        ),
        operation=ad.Operation(top_speed=4500 * RPM),
    )


def friswell_5_9_1(origin: str) -> ad.Machine:
    return ad.load("friswell-5-9-1") if origin == "packaged" else friswell_two_disks("rotor_friswell_5_9_1")


@pytest.mark.parametrize("origin", ["inputs", "packaged"])
def test_friswell_5_9_1(origin: str) -> None:
    machine = friswell_5_9_1(origin)
    outputs = case("rotor_friswell_5_9_1")["outputs"]
    tolerance = 1e-3  # "0.1 % on a converged mesh"
    lists = [
        (2000.0, outputs["ross_wn_rad_s"]["2000rpm_first_5"], 1.0),
        (4000.0, outputs["ross_wn_rad_s"]["4000rpm"], 1.0),
        (0.0, outputs["ross_Hz"]["0rpm"], 2.0 * np.pi),
        (4000.0, outputs["ross_Hz"]["4000rpm"], 2.0 * np.pi),
    ]
    for speed, expected, unit in lists:
        modes = ad.spectrum(machine, speed * RPM, modes=len(expected))
        within([m.frequency / unit for m in modes], expected, tolerance, f"Friswell 5.9.1, {origin}, {speed:.0f} rpm")


def test_friswell_5_9_1_with_damped_bearings() -> None:
    machine = friswell_two_disks("rotor_friswell_5_9_5_damped")
    outputs = case("rotor_friswell_5_9_5_damped")["outputs"]
    frequencies, real_parts = 3e-3, 1e-2  # "0.3 % on a converged mesh (frequencies), 1 % on real parts"
    for key, expected in outputs["ross_abs_lambda_rpm"].items():
        modes = ad.spectrum(machine, float(key.removesuffix("rpm")) * RPM, modes=len(expected))
        sizes = sorted(abs(m.eigenvalue) / RPM for m in modes)
        within(sizes, expected, frequencies, f"Friswell 5.9.5, abs(lambda), {key}")
    for speed, roots in outputs["recomputed_eig"].items():
        computed = np.array([m.eigenvalue for m in ad.spectrum(machine, float(speed) * RPM, modes=len(roots))])
        expected = np.array([complex(*r) for r in roots])
        within(computed.imag, expected.imag, frequencies, f"Friswell 5.9.5, frequencies, {speed} rpm")
        within(computed.real, expected.real, real_parts, f"Friswell 5.9.5, real parts, {speed} rpm")


def overhung(inputs: dict[str, Any], left: int, right: int, elements: int = ELEMENTS) -> ad.Machine:
    step = inputs["shaft"]["L"] / inputs["shaft"]["n_elements"]
    disc = inputs["disc"]
    bearings = []
    for node, number in zip(inputs["bearing_nodes"], (left, right), strict=True):
        kxx, kyy, cxx, cyy = inputs["bearing_cases_MN_m_and_kNs_m"][str(number)]
        bearings.append(ad.Bearing(position=node * step, kyy=kxx * 1e6, kzz=kyy * 1e6, cyy=cxx * 1e3, czz=cyy * 1e3))
    return ad.Machine(
        name="Friswell 6.8.1",
        rotor=ad.Rotor(
            shaft=steel_shaft(inputs, elements),
            disks=(
                ad.Disk(
                    position=disc["node"] * step,
                    mass=disc["m"],
                    diametral_inertia=disc["Id"],
                    polar_inertia=disc["Ip"],
                ),
            ),
        ),
        bearings=tuple(bearings),
        operation=ad.Operation(top_speed=3000 * RPM),
    )


@pytest.mark.parametrize("row", range(5))
def test_friswell_6_8_1(row: int) -> None:
    reference = case("rotor_friswell_6_8_1")
    rows = reference["outputs"]["table_rows_rpm_left_right_roots"]
    assert len(rows) == 5
    speed, left, right, roots = rows[row]
    machine = overhung(reference["inputs"], left, right)
    loop = ad.system(machine)
    assert loop.complex_form == (row == 0)  # the other bearings differ in y and z
    for form in [loop] if row else [loop, ad.system(machine, complex_form=False)]:
        whirling = [m for m in ad.spectrum(form, speed * RPM) if m.whirl != "none"]  # dampers add real poles
        computed = np.array([m.eigenvalue for m in whirling[: len(roots)]])
        expected = np.array([complex(*r) for r in roots])
        what = f"Friswell 6.8.1, row {row + 1}, {'complex' if form.complex_form else 'real'} form"
        # "0.1 % on frequencies, 0.002 1/s on real parts, converged mesh"
        within(computed.imag, expected.imag, 1e-3, f"{what}, frequencies")
        within_absolute(computed.real, expected.real, 0.002, f"{what}, real parts")


def nelson_mcvaugh() -> ad.Machine:
    inputs = case("rotor_nelson_mcvaugh")["inputs"]
    stations = [z * 1e-2 for z in inputs["station_z_cm"]]
    material = ad.Isotropic(E=inputs["E"], nu=0.3, density=inputs["rho"])
    segments = [
        ad.Segment(length=b - a, outer_diameter=2e-2 * outer, inner_diameter=2e-2 * inner, material=material)
        for a, b, outer, inner in zip(
            stations, stations[1:], inputs["outer_radius_cm"], inputs["inner_radius_cm"], strict=False
        )
    ]
    disc = inputs["disc"]
    return ad.Machine(
        name="Nelson & McVaugh",
        rotor=ad.Rotor(
            shaft=ad.Shaft(segments=tuple(segments), theory="rayleigh", elements=36),
            disks=(
                ad.Disk(
                    position=stations[disc["station"] - 1],
                    mass=disc["m"],
                    diametral_inertia=disc["Id"],
                    polar_inertia=disc["Ip"],
                ),
            ),
        ),
        bearings=tuple(
            ad.Bearing(position=stations[s - 1], stiffness=inputs["bearings"]["isotropic_k"])
            for s in inputs["bearings"]["stations_1based"]
        ),
        operation=ad.Operation(top_speed=100_000 * RPM),
    )


@pytest.mark.parametrize("origin", ["inputs", "packaged"])
def test_nelson_mcvaugh(origin: str) -> None:
    machine = ad.load("nelson-mcvaugh") if origin == "packaged" else nelson_mcvaugh()
    outputs = case("rotor_nelson_mcvaugh")["outputs"]
    computed = ad.critical_speeds(machine)
    assert [c.whirl for c in computed] == ["backward", "forward"] * 3
    speeds = [c.speed_rpm for c in computed]
    for key in ("isotropic_critical_rpm_published", "isotropic_critical_rpm_recomputed_rayleigh"):
        what = f"Nelson & McVaugh, {origin}, {key.rsplit('_', 1)[1]}"
        # "0.3 % for first five; 0.7 % for sixth"
        within(speeds[:5], outputs[key][:5], 3e-3, f"{what}, first five")
        within(speeds[5:], outputs[key][5:], 7e-3, f"{what}, sixth")


def rotor5() -> ad.Machine:
    inputs = case("rotor_ross_rotor5_criticals")["inputs"]
    step = inputs["shaft"]["L"] / inputs["shaft"]["n_elements"]
    parts = inputs["rotor5"]
    return ad.Machine(
        name="rotor5",
        rotor=ad.Rotor(
            shaft=steel_shaft(inputs, 40),
            disks=tuple(
                ad.Disk(
                    position=node * step,
                    width=width,
                    inner_diameter=inner,
                    outer_diameter=outer,
                    density=inputs["material"]["rho"],
                )
                for node, width, inner, outer in parts["discs"]
            ),
        ),
        bearings=tuple(ad.Bearing(position=n * step, stiffness=parts["k"]) for n in parts["bearing_nodes"]),
        operation=ad.Operation(top_speed=2500 * RPM),
    )


def test_ross_rotor5_critical_speeds() -> None:
    expected = case("rotor_ross_rotor5_criticals")["outputs"]["rotor5_crit_rad_s"]
    computed = [c.speed for c in ad.critical_speeds(rotor5())]
    within(computed, expected, 2e-4, "ROSS rotor5, critical speeds")  # "2e-4 relative on a converged mesh"


def test_meshes_are_converged() -> None:
    """Half as many elements change the roots by 2e-4; what the full number leaves is sixteen times smaller."""
    inputs = case("rotor_friswell_6_8_1")["inputs"]
    pairs = [
        [friswell_two_disks("rotor_friswell_5_9_5_damped", n) for n in (ELEMENTS // 2, ELEMENTS)],
        [overhung(inputs, 2, 3, n) for n in (ELEMENTS // 2, ELEMENTS)],
    ]
    for pair in pairs:
        coarse, fine = (
            [m.eigenvalue for m in ad.spectrum(machine, 4000 * RPM) if m.whirl != "none"][:6] for machine in pair
        )
        within(coarse, fine, 2e-4, f"{pair[0].name}, half as many elements")
