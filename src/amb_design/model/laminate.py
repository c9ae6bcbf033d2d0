"""Section constants of homogeneous and laminated tubes, under four ply laws.

Notation: C11, C16, C66 are the in-plane stiffnesses of a ply turned by its angle from the shaft axis, C55 its
transverse shear stiffness; r_i are the ply radii. Source: Ahmad 2014, appendix; Chang et al. 2004 for the
three-dimensional law.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import casadi as ca

from ..spec.fields import Number
from ..spec.material import Isotropic, Material
from ..spec.shaft import Ply, Segment


@dataclass(frozen=True)
class Section:
    """Constants of a cross-section.

    Attributes
    ----------
    shear : A55 + A66 [N], before the shear correction factor
    coupling : A16 [N m], couples bending and transverse shear in unbalanced laminates
    bending : B11 [N m^2]
    mass : Im [kg/m]
    inertia : Id [kg m], per length about a diameter; the polar one is twice as large
    """

    shear: Number
    coupling: Number
    bending: Number
    mass: Number
    inertia: Number


def section_constants(segment: Segment, law: str) -> Section:
    """Stiffness and inertia of a shaft section.

    Parameters
    ----------
    segment : Segment
        Diameters with a material, or plies from the inside out; numbers or CasADi scalars.
    law : str
        One of ``spec.shaft.PLY_LAWS``; without effect on homogeneous sections.

    Returns
    -------
    Section
    """
    inner = segment.inner_diameter / 2.0
    if not segment.plies:
        m = segment.material
        assert m is not None
        layers = [(_Stiffness(m.E, 0.0, m.shear_modulus, m.shear_modulus), m.density, segment.outer / 2.0)]
    else:
        stiffnesses = _laminate(segment.plies) if law == "hoop-free-laminate" else [_ply(p, law) for p in segment.plies]
        layers, radius = [], inner
        for ply, stiffness in zip(segment.plies, stiffnesses, strict=True):
            radius = radius + ply.thickness
            layers.append((stiffness, ply.material.density, radius))
    shear = coupling = bending = mass = inertia = 0.0
    for c, density, outer in layers:
        r2, r3, r4 = (outer**n - inner**n for n in (2, 3, 4))
        shear = shear + math.pi / 2.0 * (c.c55 + c.c66) * r2
        coupling = coupling + 2.0 * math.pi / 3.0 * c.c16 * r3
        bending = bending + math.pi / 4.0 * c.c11 * r4
        mass = mass + math.pi * density * r2
        inertia = inertia + math.pi / 4.0 * density * r4
        inner = outer
    return Section(shear, coupling, bending, mass, inertia)


def cowper(segment: Segment) -> Number:
    """Cowper's shear correction factor of a homogeneous circular section, solid or hollow.

    Parameters
    ----------
    segment : Segment
        With an isotropic material.

    Returns
    -------
    float or CasADi scalar
        Cowper 1966: 6 (1 + nu)/(7 + 6 nu) for a solid circle.
    """
    assert segment.material is not None
    nu = segment.material.poisson
    ratio = segment.inner_diameter / segment.outer
    ring = (1.0 + ratio**2) ** 2
    return 6.0 * (1.0 + nu) * ring / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * ratio**2)


@dataclass(frozen=True)
class _Stiffness:
    """Stiffnesses of a ply in shaft axes [Pa]."""

    c11: Number
    c16: Number
    c66: Number
    c55: Number


@dataclass(frozen=True)
class _Reduced:
    """Stiffnesses of a ply in its own axes [Pa]."""

    q11: Number
    q22: Number
    q12: Number
    q66: Number


def _constants(material: Material) -> tuple[Number, Number, Number, Number, Number, Number]:
    """E1, E2, nu12, G12, G13, G23 of any material."""
    if isinstance(material, Isotropic):
        g = material.shear_modulus
        return material.E, material.E, material.poisson, g, g, g
    return material.E1, material.E2, material.nu12, material.G12, material.G13, material.G23


def _reduced(material: Material, law: str) -> _Reduced:
    e1, e2, nu12, g12, _, g23 = _constants(material)
    if law == "three-dimensional":  # inverse of the transversely isotropic compliance, after Chang et al. 2004
        nu23 = e2 / (2.0 * g23) - 1.0
        both = nu12**2 * e2 / e1
        det = 1.0 - nu23 - 2.0 * both
        return _Reduced((1.0 - nu23) * e1 / det, e2 * (1.0 - both) / ((1.0 + nu23) * det), nu12 * e2 / det, g12)
    det = 1.0 - nu12**2 * e2 / e1
    return _Reduced(e1 / det, e2 / det, nu12 * e2 / det, g12)


def _turned(q: _Reduced, angle: Number) -> tuple[Number, Number, Number, Number, Number, Number]:
    """C11, C12, C22, C16, C26, C66 of a ply turned by `angle`."""
    c, s = ca.cos(angle), ca.sin(angle)
    c11 = q.q11 * c**4 + 2.0 * (q.q12 + 2.0 * q.q66) * s**2 * c**2 + q.q22 * s**4
    c22 = q.q11 * s**4 + 2.0 * (q.q12 + 2.0 * q.q66) * s**2 * c**2 + q.q22 * c**4
    c12 = (q.q11 + q.q22 - 4.0 * q.q66) * s**2 * c**2 + q.q12 * (s**4 + c**4)
    along, across = q.q11 - q.q12 - 2.0 * q.q66, q.q12 - q.q22 + 2.0 * q.q66
    c16 = along * c**3 * s + across * c * s**3
    c26 = along * c * s**3 + across * c**3 * s
    c66 = (q.q11 + q.q22 - 2.0 * q.q12 - 2.0 * q.q66) * s**2 * c**2 + q.q66 * (s**4 + c**4)
    return c11, c12, c22, c16, c26, c66


def _ply(ply: Ply, law: str) -> _Stiffness:
    _, _, _, _, g13, g23 = _constants(ply.material)
    c11, c12, c22, c16, c26, c66 = _turned(_reduced(ply.material, law), ply.angle)
    if law == "hoop-free-ply":  # no hoop stress in each ply by itself
        c11, c16, c66 = c11 - c12**2 / c22, c16 - c12 * c26 / c22, c66 - c26**2 / c22
    return _Stiffness(c11, c16, c66, g13 * ca.cos(ply.angle) ** 2 + g23 * ca.sin(ply.angle) ** 2)


def membrane_stiffness(plies: tuple[Ply, ...]) -> tuple[Number, ...]:
    """Membrane stiffnesses of classical lamination theory.

    Parameters
    ----------
    plies : tuple of Ply

    Returns
    -------
    tuple
        A11, A12, A22, A16, A26, A66 [N/m].
    """
    total: list[Number] = [0.0] * 6
    for ply in plies:
        turned = _turned(_reduced(ply.material, "plane-stress"), ply.angle)
        total = [t + c * ply.thickness for t, c in zip(total, turned, strict=True)]
    return tuple(total)


def laminate_moduli(plies: tuple[Ply, ...]) -> tuple[Number, Number]:
    """Engineering constants Ex = 1/(a11 t) and Gxy = 1/(a66 t) of the whole wall [Pa].

    Parameters
    ----------
    plies : tuple of Ply

    Returns
    -------
    ex, gxy : float or CasADi scalar
        `a` is the inverse of the membrane stiffness: hoop and the other membrane forces vanish.
    """
    a11, a12, a22, a16, a26, a66 = membrane_stiffness(plies)
    thickness: Number = 0.0
    for ply in plies:
        thickness = thickness + ply.thickness
    det = a11 * (a22 * a66 - a26**2) - a12 * (a12 * a66 - a16 * a26) + a16 * (a12 * a26 - a22 * a16)
    return det / ((a22 * a66 - a26**2) * thickness), det / ((a11 * a22 - a12**2) * thickness)


def _laminate(plies: tuple[Ply, ...]) -> list[_Stiffness]:
    ex, gxy = laminate_moduli(plies)
    return [_Stiffness(ex, 0.0, gxy, gxy)] * len(plies)
