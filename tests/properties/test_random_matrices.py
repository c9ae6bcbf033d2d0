"""What must hold for the matrices of any machine: symmetries, rigid bodies, invariances, limits."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

import amb_design as ad
from amb_design.analysis.system import dense
from amb_design.model.laminate import Section, section_constants
from amb_design.spec.shaft import PLY_LAWS
from properties.machines import machines, orthotropic, plies, uniform

seeded = settings(
    max_examples=60, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
)
LAWS = st.sampled_from(PLY_LAWS)


def skewness(matrix: np.ndarray) -> float:
    return float(np.abs(matrix + matrix.conj().T).max()) / (float(np.abs(matrix).max()) or 1.0)


def asymmetry(matrix: np.ndarray) -> float:
    return float(np.abs(matrix - matrix.conj().T).max()) / (float(np.abs(matrix).max()) or 1.0)


@seeded
@given(machines())
def test_definiteness_and_symmetry(machine: ad.Machine) -> None:
    plant = ad.system(machine).plant
    mass, gyroscopic, damping, circulation = (dense(m) for m in (plant.M, plant.C1, plant.C0, plant.K1))
    assert asymmetry(mass) < 1e-15
    assert np.linalg.eigvalsh(mass).min() > 0.0
    assert skewness(gyroscopic) < 1e-15
    assert skewness(circulation) < 1e-14
    assert np.linalg.eigvalsh(damping + damping.conj().T).min() > -1e-9 * np.abs(damping).max()


@seeded
@given(machines(controlled=False))
def test_conservative_stiffness_is_hermitian(machine: ad.Machine) -> None:
    """Without hysteretic damping and skew cross-coupling, and positive semidefinite."""
    shaft = {"rotor.shaft.hysteretic_damping": 0.0}
    supports = tuple(ad.Bearing(position=b.position, stiffness=b.stiffness, kzz=b.kzz) for b in machine.bearings)
    plant = ad.system(ad.replace(machine, {**shaft, "bearings": supports})).plant
    stiffness = dense(plant.K0)
    assert asymmetry(stiffness) < 1e-14
    assert np.linalg.eigvalsh(stiffness).min() > -1e-12 * np.abs(stiffness).max()


@seeded
@given(machines(controlled=False))
def test_rigid_body_modes(machine: ad.Machine) -> None:
    """A free shaft neither resists nor dampens translation and tilt; its rigid-body inertia is that of its parts."""
    free = ad.replace(machine, {"bearings": (), "rotor.shaft.external_damping": 0.0})
    loop = ad.system(free)
    assert loop.complex_form
    plant, x = loop.plant, loop.node_positions
    n = 2 * len(x)
    sideways, tilt = np.zeros(n), np.zeros(n)
    sideways[0::2] = 1.0
    tilt[0::2], tilt[1::2] = x, 1.0  # r = x, slope 1
    # K1 and C0 hold eta_v times a stiffness, K0 the stiffness
    for name in ("K0", "K1", "C0"):
        matrix = dense(getattr(plant, name))
        for motion in (sideways, tilt):
            assert np.abs(matrix @ motion).max() <= 1e-12 * np.abs(matrix).max()
    mass, gyroscopic = dense(plant.M), dense(plant.C1)
    total = polar = moment = 0.0
    light = free.rotor.shaft.theory == "euler-bernoulli"  # without rotary inertia, but for a hundredth
    start = 0.0
    for segment in free.rotor.shaft.segments:
        section: Section = section_constants(segment, free.rotor.shaft.ply_law)
        m, i = float(section.mass), float(section.inertia)
        end = start + segment.length
        total += m * segment.length
        moment += m * (end**3 - start**3) / 3.0 + i * segment.length * (0.01 if light else 1.0)
        polar += 0.0 if light else 2.0 * i * segment.length
        start = end
    for disk in free.rotor.disks:
        diametral, axial = disk.inertias
        total += disk.total_mass
        moment += disk.total_mass * disk.position**2 + diametral
        polar += axial
    assert float(sideways @ mass @ sideways) == pytest.approx(total, rel=1e-12)
    assert float(tilt @ mass @ tilt) == pytest.approx(moment, rel=1e-12)
    assert complex(tilt @ gyroscopic @ tilt) == pytest.approx(-1j * polar, rel=1e-12)


@seeded
@given(machines(controlled=True), uniform(1.05, 20.0))
def test_uncontrolled_magnets_are_unstable(machine: ad.Machine, excess: float) -> None:
    """Where they push harder sideways than the bearings hold, whatever the rest of the machine."""
    holding = sum(max(m[0][0], m[1][1]) for m in (b.stiffness_matrix for b in machine.bearings))
    strength = excess * holding / len(machine.magnets)
    magnets = tuple(
        ad.Magnet(position=m.position, current_stiffness=100.0, negative_stiffness=strength) for m in machine.magnets
    )
    # skew cross-coupling and circulation do no work at rest in a real motion; they only whirl
    limit = ad.stability_limit(ad.replace(machine, {"magnets": magnets, "controller": None}), first_only=True)
    assert limit.status == "unstable at rest"
    assert limit.speed == 0.0
    assert limit.unstable_at_rest[0].eigenvalue.real > 0.0


@seeded
@given(machines(controlled=True))
def test_a_rotor_on_uncontrolled_magnets_alone_falls(machine: ad.Machine) -> None:
    floating = ad.replace(machine, {"bearings": (), "controller": None})
    limit = ad.stability_limit(floating, first_only=True)
    assert limit.status == "unstable at rest"


def assert_same(first: Section, second: Section, tolerance: float) -> None:
    for field in ("shear", "bending", "mass", "inertia"):
        assert float(getattr(first, field)) == pytest.approx(float(getattr(second, field)), rel=tolerance), field
    largest = float(first.shear) * math.sqrt(float(first.bending) / float(first.shear))
    assert float(first.coupling) == pytest.approx(float(second.coupling), abs=tolerance * largest)


@seeded
@given(plies(), LAWS, st.sampled_from([0.0, 0.03]), st.integers(-2, 2))
def test_half_turns_of_a_ply_change_nothing(wall: tuple[ad.Ply, ...], law: str, inner: float, turns: int) -> None:
    turned = tuple(ad.replace(p, {"angle": p.angle + turns * math.pi}) for p in wall)
    first, second = (
        section_constants(ad.Segment(length=1.0, inner_diameter=inner, plies=w), law) for w in (wall, turned)
    )
    assert_same(first, second, 1e-12)


@seeded
@given(plies(), LAWS)
def test_mirrored_plies_reverse_the_coupling(wall: tuple[ad.Ply, ...], law: str) -> None:
    mirrored = tuple(ad.replace(p, {"angle": -p.angle}) for p in wall)
    first, second = (section_constants(ad.Segment(length=1.0, plies=w), law) for w in (wall, mirrored))
    assert float(first.coupling) == pytest.approx(-float(second.coupling), rel=1e-12)
    for field in ("shear", "bending", "mass", "inertia"):
        assert float(getattr(first, field)) == pytest.approx(float(getattr(second, field)), rel=1e-12)


@seeded
@given(plies(), LAWS, uniform(0.1, 0.9))
def test_splitting_a_ply_changes_nothing(wall: tuple[ad.Ply, ...], law: str, part: float) -> None:
    first = wall[0]
    halves = tuple(ad.replace(first, {"thickness": first.thickness * f}) for f in (part, 1.0 - part))
    one, two = (section_constants(ad.Segment(length=1.0, plies=w), law) for w in (wall, (*halves, *wall[1:])))
    assert_same(one, two, 1e-12)


@seeded
@given(plies(), LAWS)
def test_a_vanishing_bore_is_a_solid_shaft(wall: tuple[ad.Ply, ...], law: str) -> None:
    solid = section_constants(ad.Segment(length=1.0, plies=wall), law)
    for bore in (1e-6, 1e-9):
        hollow = section_constants(ad.Segment(length=1.0, inner_diameter=bore, plies=wall), law)
        assert_same(solid, hollow, 20.0 * bore / wall[0].thickness)


@seeded
@given(orthotropic(), uniform(-1.6, 1.6), st.sampled_from(["hoop-free-ply", "hoop-free-laminate"]))
def test_a_ply_of_isotropic_material_is_an_isotropic_section(m: ad.Orthotropic, angle: float, law: str) -> None:
    """Where the hoop stress vanishes; the other laws stiffen the wall by 1/(1 - nu^2) and more."""
    metal = ad.Isotropic(E=m.E1, nu=m.nu12, density=m.density)
    tube = ad.Segment(length=1.0, inner_diameter=0.04, outer_diameter=0.05, material=metal)
    wall = ad.Segment(length=1.0, inner_diameter=0.04, plies=(ad.Ply(material=metal, angle=angle, thickness=0.005),))
    assert_same(section_constants(tube, law), section_constants(wall, law), 1e-11)
    stiffened = section_constants(wall, "plane-stress")
    assert float(stiffened.bending) == pytest.approx(float(section_constants(tube, law).bending) / (1 - m.nu12**2))


def spectrum(machine: ad.Machine, speed: float) -> np.ndarray:
    return np.asarray(np.linalg.eigvals(ad.system(machine).matrix(speed)))


def apart(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference of two sets, matched one to one, relative to the largest eigenvalue and to themselves."""
    cost = np.abs(first[:, None] - second) / (1e-4 * np.abs(first).max() + np.abs(first)[:, None])
    return float(cost[linear_sum_assignment(cost)].max())


@st.composite
def without_memory_of_direction(draw: st.DrawFn) -> ad.Machine:
    """Machines whose only sense of rotation is the spin: no skew coefficients, no hysteretic circulation."""
    machine = draw(machines(anisotropic=False))
    supports = tuple(
        ad.Bearing(position=b.position, stiffness=b.stiffness, damping=b.damping) for b in machine.bearings
    )
    return ad.replace(machine, {"bearings": supports, "rotor.shaft.hysteretic_damping": 0.0})


@seeded
@given(without_memory_of_direction(), uniform(10.0, 2000.0))
def test_the_mirror_image_spins_the_other_way(machine: ad.Machine, speed: float) -> None:
    """Ply angles mirrored and the spin reversed: every whirl is reversed."""
    if any(s.plies for s in machine.rotor.shaft.segments):
        flipped = {
            f"rotor.shaft.segments[{i}].plies[{j}].angle": -p.angle
            for i, s in enumerate(machine.rotor.shaft.segments)
            for j, p in enumerate(s.plies)
        }
        mirrored = ad.replace(machine, flipped)
    else:
        mirrored = machine
    assert apart(spectrum(machine, speed).conj(), spectrum(mirrored, -speed)) < 1e-8


@seeded
@given(without_memory_of_direction(), uniform(10.0, 2000.0))
def test_end_for_end(machine: ad.Machine, speed: float) -> None:
    """The shaft seen from its other end spins the other way; its layups keep their handedness."""
    length = float(machine.rotor.shaft.length)
    shaft = machine.rotor.shaft

    def over(items: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(ad.replace(item, {"position": max(0.0, length - item.position)}) for item in items)

    swapped = ad.replace(
        machine,
        {
            "rotor.shaft": ad.replace(shaft, {"segments": shaft.segments[::-1]}),
            "rotor.disks": over(machine.rotor.disks),
            "bearings": over(machine.bearings),
            "magnets": over(machine.magnets),
        },
    )
    assert apart(spectrum(machine, speed).conj(), spectrum(swapped, -speed)) < 1e-8


@seeded
@given(machines(controlled=False), uniform(0.1, 3.0))
def test_scaling_forces_and_masses_together(machine: ad.Machine, factor: float) -> None:
    """Every modulus, density, mass and support times the same factor: the same eigenvalues."""
    names = {
        *("E", "E1", "E2", "G12", "G13", "G23", "density", "mass", "diametral_inertia", "polar_inertia"),
        *("stiffness", "kzz", "kyz", "kzy", "damping", "czz", "cyz", "czy", "external_damping"),
    }
    scaled = {p: v * factor for p, v in ad.numbers(machine) if p.rpartition(".")[2] in names}
    assert apart(spectrum(machine, 300.0), spectrum(ad.replace(machine, scaled), 300.0)) < 1e-8
