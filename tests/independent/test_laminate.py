"""Section constants against integration over radius and angle, with ply stiffnesses turned as tensors of fourth order."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.system import dense
from amb_design.model.laminate import laminate_moduli, membrane_stiffness, section_constants
from amb_design.spec.shaft import PLY_LAWS

CARBON = ad.Orthotropic(E1=139e9, E2=11e9, G12=6.05e9, G13=5.5e9, G23=3.78e9, nu12=0.313, density=1578)
GLASS = ad.Orthotropic(E1=45e9, E2=14e9, G12=5.5e9, G13=5.2e9, G23=5.1e9, nu12=0.28, density=2000)
STEEL = ad.Isotropic(E=205e9, nu=0.29, density=7850)

WALLS = {
    "one ply": (ad.Ply(material=CARBON, angle=0.6, thickness=4e-3),),
    "three materials": (
        ad.Ply(material=CARBON, angle=0.4, thickness=3e-3),
        ad.Ply(material=STEEL, angle=0.0, thickness=1e-3),
        ad.Ply(material=GLASS, angle=-1.1, thickness=5e-3),
        ad.Ply(material=CARBON, angle=math.pi / 2, thickness=2e-3),
    ),
    "thesis": tuple(
        ad.Ply(material=CARBON, angle=math.radians(a), thickness=5e-3) for a in (90, 45, -45, 0, 0, 0, 0, 0, 0, 90)
    ),
}
VOIGT = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]  # 1 along the fibre, 2 across it in the wall, 3 radial


def stiffness_tensor(material: ad.Orthotropic | ad.Isotropic, plane_stress: bool) -> np.ndarray:
    """c_ijkl of a ply in its own axes [Pa]; under plane stress without the radial normal stress."""
    if isinstance(material, ad.Isotropic):
        g = material.E / (2 * (1 + material.nu))
        e1 = e2 = material.E
        nu12, nu23, g12, g13, g23 = material.nu, material.nu, g, g, g
    else:
        e1, e2, nu12 = material.E1, material.E2, material.nu12
        g12, g13, g23 = material.G12, material.G13, material.G23
        nu23 = e2 / (2 * g23) - 1
    compliance = np.diag([1 / e1, 1 / e2, 1 / e2, 1 / g23, 1 / g13, 1 / g12])
    compliance[0, 1] = compliance[1, 0] = compliance[0, 2] = compliance[2, 0] = -nu12 / e1
    compliance[1, 2] = compliance[2, 1] = -nu23 / e2
    stiffness = np.zeros((6, 6))
    keep = [0, 1, 3, 4, 5] if plane_stress else list(range(6))
    stiffness[np.ix_(keep, keep)] = np.linalg.inv(compliance[np.ix_(keep, keep)])
    c = np.zeros((3, 3, 3, 3))
    for a, b in itertools.product(range(6), repeat=2):
        (i, j), (k, m) = VOIGT[a], VOIGT[b]
        for p, q in {(i, j), (j, i)}:
            for r, s in {(k, m), (m, k)}:
                c[p, q, r, s] = stiffness[a, b]
    return c


def turned(ply: ad.Ply, plane_stress: bool) -> np.ndarray:
    """6 x 6 stiffness in shaft axes: 1 along the shaft, 2 around it, 3 radial."""
    c, s = math.cos(ply.angle), math.sin(ply.angle)
    # components along shaft axes of a vector given along the fibre and across it
    r = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    tensor = np.einsum("ip,jq,kr,ls,pqrs->ijkl", r, r, r, r, stiffness_tensor(ply.material, plane_stress))
    return np.array([[tensor[VOIGT[a] + VOIGT[b]] for b in range(6)] for a in range(6)])


def wall_stiffnesses(plies: tuple[ad.Ply, ...], law: str) -> list[tuple[float, float, float, float]]:
    """C11, C16, C66, C55 of each ply in shaft axes under a law."""
    if law == "hoop-free-laminate":
        membrane = sum(turned(p, True)[np.ix_([0, 1, 5], [0, 1, 5])] * p.thickness for p in plies)
        a = np.linalg.inv(membrane)
        t = sum(p.thickness for p in plies)
        ex, gxy = 1 / (a[0, 0] * t), 1 / (a[2, 2] * t)
        return [(ex, 0.0, gxy, gxy)] * len(plies)
    out = []
    for ply in plies:
        c = turned(ply, law != "three-dimensional")
        if law == "hoop-free-ply":  # static condensation of the hoop strain
            c = c - np.outer(c[:, 1], c[1, :]) / c[1, 1]
        out.append((c[0, 0], c[0, 5], c[5, 5], c[4, 4]))
    return out


@pytest.mark.parametrize("law", PLY_LAWS)
@pytest.mark.parametrize("wall", WALLS)
@pytest.mark.parametrize("inner", [0.0, 0.05])
def test_section_constants(wall: str, law: str, inner: float) -> None:
    """Strain energy, mass and inertia of the section under arbitrary curvatures and shear strains; 1e-12."""
    plies = WALLS[wall]
    section = section_constants(ad.Segment(length=1.0, inner_diameter=inner, plies=plies), law)
    x, w = np.polynomial.legendre.leggauss(4)
    phi = np.arange(16) * 2 * math.pi / 16  # exact for trigonometric polynomials below degree 16
    cos, sin = np.cos(phi), np.sin(phi)
    rng = np.random.default_rng(7)
    worst = 0.0
    for _ in range(5):
        ky, kz, gy, gz = rng.standard_normal(4) * [1.0, 1.0, 0.05, 0.05]
        energy = mass = second = 0.0
        r0 = inner / 2
        for ply, (c11, c16, c66, c55) in zip(plies, wall_stiffnesses(plies, law), strict=True):
            for xi, wi in zip(x, w, strict=True):
                r = r0 + ply.thickness * (1 + xi) / 2
                area = wi / 2 * ply.thickness * r * 2 * math.pi / 16
                axial = r * (ky * cos + kz * sin)  # bending
                around, radial = -gy * sin + gz * cos, gy * cos + gz * sin  # transverse shear in polar components
                density = c11 * axial**2 + 2 * c16 * axial * around + c66 * around**2 + c55 * radial**2
                energy += 0.5 * area * density.sum()
                mass += ply.material.density * area * 16
                second += ply.material.density * area * np.sum((r * cos) ** 2)
            r0 += ply.thickness
        expected = (
            float(section.bending) * (ky**2 + kz**2) / 2
            + float(section.shear) * (gy**2 + gz**2) / 2
            + float(section.coupling) / 2 * (ky * gz - kz * gy)
        )
        scale = float(section.bending) * (ky**2 + kz**2) / 2 + float(section.shear) * (gy**2 + gz**2) / 2
        worst = max(worst, abs(energy - expected) / scale)
        assert mass == pytest.approx(float(section.mass), rel=1e-12)
        assert second == pytest.approx(float(section.inertia), rel=1e-12)
    print(f"{wall}, {law}: strain energy agrees to {worst:.1e}")
    assert worst <= 1e-12


@pytest.mark.parametrize("wall", WALLS)
def test_lamination_theory(wall: str) -> None:
    """Membrane stiffness and engineering constants against tensors and numpy's inverse; 1e-12."""
    plies = WALLS[wall]
    a = sum(turned(p, True)[np.ix_([0, 1, 5], [0, 1, 5])] * p.thickness for p in plies)
    a11, a12, a22, a16, a26, a66 = (float(v) for v in membrane_stiffness(plies))
    got = np.array([[a11, a12, a16], [a12, a22, a26], [a16, a26, a66]])
    assert np.abs(got - a).max() <= 1e-12 * np.abs(a).max()
    t = sum(p.thickness for p in plies)
    inverse = np.linalg.inv(a)
    ex, gxy = (float(v) for v in laminate_moduli(plies))
    assert ex == pytest.approx(1 / (inverse[0, 0] * t), rel=1e-12)
    assert gxy == pytest.approx(1 / (inverse[2, 2] * t), rel=1e-12)


def test_isotropic_section() -> None:
    """A homogeneous tube: E I, G A and no coupling."""
    segment = ad.Segment(length=1.0, inner_diameter=0.03, outer_diameter=0.05, material=STEEL)
    section = section_constants(segment, "plane-stress")
    area, second = math.pi / 4 * (0.05**2 - 0.03**2), math.pi / 64 * (0.05**4 - 0.03**4)
    g = STEEL.E / (2 * (1 + STEEL.nu))
    assert float(section.bending) == pytest.approx(STEEL.E * second, rel=1e-12)
    assert float(section.shear) == pytest.approx(g * area, rel=1e-12)
    assert float(section.mass) == pytest.approx(STEEL.density * area, rel=1e-12)
    assert float(section.inertia) == pytest.approx(STEEL.density * second, rel=1e-12)
    assert section.coupling == 0.0


@pytest.mark.parametrize("law", PLY_LAWS)
def test_strain_energy_of_the_shaft(law: str) -> None:
    """The assembled stiffness under a quadratic deflection and linear slopes, which the element holds exactly; 1e-12.

    A slope r' in y moves the fibres by -y r': the curvatures of the section are minus the derivatives of the slopes.
    """
    length, correction, inner = 0.8, 0.6, 0.03
    plies = WALLS["three materials"]
    segment = ad.Segment(length=length, inner_diameter=inner, plies=plies)
    shaft = ad.Shaft(segments=(segment,), shear_correction=correction, ply_law=law, elements=3)
    machine = ad.Machine(name="energy", rotor=ad.Rotor(shaft=shaft), operation=ad.Operation(top_speed=100.0))
    loop = ad.system(machine)
    stiffness, x = dense(loop.plant.K0), loop.node_positions
    section = section_constants(segment, law)
    rng = np.random.default_rng(3)
    for _ in range(5):
        c = rng.standard_normal(3) + 1j * rng.standard_normal(3)
        d = rng.standard_normal(2) + 1j * rng.standard_normal(2)
        q = np.zeros(2 * len(x), complex)
        q[0::2], q[1::2] = c[0] + c[1] * x + c[2] * x**2, d[0] + d[1] * x
        points, weights = np.polynomial.legendre.leggauss(3)
        expected = 0.0
        for point, weight in zip(points, weights, strict=True):
            at = length * (1.0 + point) / 2.0
            shear = c[1] + 2.0 * c[2] * at - d[0] - d[1] * at
            bending, gy, gz = -d[1], shear.real, shear.imag
            expected += (
                weight
                * length
                / 2.0
                * (
                    float(section.bending) * abs(bending) ** 2 / 2.0
                    + correction * float(section.shear) * (gy**2 + gz**2) / 2.0
                    + correction * float(section.coupling) / 2.0 * (bending.real * gz - bending.imag * gy)
                )
            )
        assert (q.conj() @ stiffness @ q).real / 2.0 == pytest.approx(expected, rel=1e-12)
    if law != "hoop-free-laminate":
        assert abs(float(section.coupling)) > 1e-3 * math.sqrt(float(section.bending) * float(section.shear))
