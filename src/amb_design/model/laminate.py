"""Section constants of homogeneous and laminated tubes, under four ply laws.

Notation: C11, C16, C66 are the in-plane stiffnesses of a ply turned by its angle from the shaft axis, C55 its
transverse shear stiffness; r_i are the ply radii. Source: Ahmad 2014, appendix; Chang et al. 2004 for the
three-dimensional law.

The plies of a section are computed together: each quantity of the plies is a CasADi column, from the inside out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import casadi as ca

from ..spec.fields import Number
from ..spec.material import Isotropic, Material
from ..spec.shaft import Ply, Segment
from .pair import Matrix


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
    radius = segment.inner_diameter / 2.0
    if segment.plies:
        thickness = _column([p.thickness for p in segment.plies])
        density = _column([p.material.density for p in segment.plies])
        c = _laminate(segment.plies) if law == "hoop-free-laminate" else _stiffness(segment.plies, law)
        outer = radius + ca.cumsum(thickness)
        inner = outer - thickness
    else:
        m = segment.material
        assert m is not None
        density, c = m.density, _Stiffness(m.E, 0.0, m.shear_modulus, m.shear_modulus)
        inner, outer = radius, segment.outer / 2.0
    r2, r3, r4 = (outer**n - inner**n for n in (2, 3, 4))
    return Section(
        shear=math.pi / 2.0 * ca.dot(c.c55 + c.c66, r2),
        coupling=2.0 * math.pi / 3.0 * ca.dot(c.c16, r3),
        bending=math.pi / 4.0 * ca.dot(c.c11, r4),
        mass=math.pi * ca.dot(density, r2),
        inertia=math.pi / 4.0 * ca.dot(density, r4),
    )


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
    """Stiffnesses of the plies in shaft axes [Pa]."""

    c11: Matrix
    c16: Matrix
    c66: Matrix
    c55: Matrix


@dataclass(frozen=True)
class _Reduced:
    """Stiffnesses of the plies in their own axes [Pa]."""

    q11: Matrix
    q22: Matrix
    q12: Matrix
    q66: Matrix


def _column(values: Iterable[Number]) -> Matrix:
    return ca.vertcat(*values)


def _constants(material: Material) -> tuple[Number, Number, Number, Number, Number, Number]:
    """E1, E2, nu12, G12, G13, G23 of any material."""
    if isinstance(material, Isotropic):
        g = material.shear_modulus
        return material.E, material.E, material.poisson, g, g, g
    return material.E1, material.E2, material.nu12, material.G12, material.G13, material.G23


def _columns(plies: tuple[Ply, ...]) -> Iterator[Matrix]:
    """E1, E2, nu12, G12, G13, G23 of the plies."""
    return map(_column, zip(*[_constants(p.material) for p in plies], strict=True))


def _reduced(plies: tuple[Ply, ...], law: str) -> _Reduced:
    e1, e2, nu12, g12, _, g23 = _columns(plies)
    if law == "three-dimensional":  # inverse of the transversely isotropic compliance, after Chang et al. 2004
        nu23 = e2 / (2.0 * g23) - 1.0
        both = nu12**2 * e2 / e1
        det = 1.0 - nu23 - 2.0 * both
        return _Reduced((1.0 - nu23) * e1 / det, e2 * (1.0 - both) / ((1.0 + nu23) * det), nu12 * e2 / det, g12)
    det = 1.0 - nu12**2 * e2 / e1
    return _Reduced(e1 / det, e2 / det, nu12 * e2 / det, g12)


def _turned(plies: tuple[Ply, ...], law: str) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix, Matrix]:
    """C11, C12, C22, C16, C26, C66 of the plies turned by their angles."""
    q = _reduced(plies, law)
    angle = _column([p.angle for p in plies])
    c, s = ca.cos(angle), ca.sin(angle)
    c11 = q.q11 * c**4 + 2.0 * (q.q12 + 2.0 * q.q66) * s**2 * c**2 + q.q22 * s**4
    c22 = q.q11 * s**4 + 2.0 * (q.q12 + 2.0 * q.q66) * s**2 * c**2 + q.q22 * c**4
    c12 = (q.q11 + q.q22 - 4.0 * q.q66) * s**2 * c**2 + q.q12 * (s**4 + c**4)
    along, across = q.q11 - q.q12 - 2.0 * q.q66, q.q12 - q.q22 + 2.0 * q.q66
    c16 = along * c**3 * s + across * c * s**3
    c26 = along * c * s**3 + across * c**3 * s
    c66 = (q.q11 + q.q22 - 2.0 * q.q12 - 2.0 * q.q66) * s**2 * c**2 + q.q66 * (s**4 + c**4)
    return c11, c12, c22, c16, c26, c66


def _stiffness(plies: tuple[Ply, ...], law: str) -> _Stiffness:
    c11, c12, c22, c16, c26, c66 = _turned(plies, law)
    if law == "hoop-free-ply":  # no hoop stress in each ply by itself
        c11, c16, c66 = c11 - c12**2 / c22, c16 - c12 * c26 / c22, c66 - c26**2 / c22
    *_, g13, g23 = _columns(plies)
    angle = _column([p.angle for p in plies])
    return _Stiffness(c11, c16, c66, g13 * ca.cos(angle) ** 2 + g23 * ca.sin(angle) ** 2)


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
    thickness = _column([p.thickness for p in plies])
    return tuple(ca.dot(c, thickness) for c in _turned(plies, "plane-stress"))


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
    ex, _, gxy = _moduli(plies)
    return ex, gxy


def hoop_modulus(plies: tuple[Ply, ...]) -> Number:
    """Young's modulus around the wall, 1/(a22 t) [Pa]: the other membrane forces vanish.

    Parameters
    ----------
    plies : tuple of Ply
    """
    return _moduli(plies)[1]


def torsional_stiffness(segment: Segment) -> Number:
    """GJ of a section [N m^2]: torque per twist and length.

    Parameters
    ----------
    segment : Segment
        Numbers or CasADi scalars.

    Returns
    -------
    float or CasADi scalar

    Notes
    -----
    A shaft that is twisted may grow longer and wider: nothing holds back its mean axial and hoop strain. The plies are bonded, so
    that these two strains are common to all of them, while the shear strain of a ply is its radius times the twist. The strain
    energy is smallest, with plies in plane stress, at the strains that leave no axial and no hoop force. In balanced laminates
    they nearly vanish and GJ is the sum of C66 pi/2 <r^4>; in thin walls of any layup GJ is Gxy = 1/(a66 t) of the laminate
    times the polar second moment. ``ply_law`` has no say: it is about bending and transverse shear.
    """
    radius = segment.inner_diameter / 2.0
    if segment.material is not None:
        return segment.material.shear_modulus * math.pi / 2.0 * ((segment.outer / 2.0) ** 4 - radius**4)
    thickness = _column([p.thickness for p in segment.plies])
    outer = radius + ca.cumsum(thickness)
    inner = outer - thickness
    c11, c12, c22, c16, c26, c66 = _turned(segment.plies, "plane-stress")
    r2, r3, r4 = (outer**n - inner**n for n in (2, 3, 4))
    axial, mixed, hoop = (math.pi * ca.dot(c, r2) for c in (c11, c12, c22))
    axial_twist, hoop_twist = (2.0 * math.pi / 3.0 * ca.dot(c, r3) for c in (c16, c26))
    released = axial_twist**2 * hoop - 2.0 * axial_twist * hoop_twist * mixed + hoop_twist**2 * axial
    return math.pi / 2.0 * ca.dot(c66, r4) - released / (axial * hoop - mixed**2)


def _moduli(plies: tuple[Ply, ...]) -> tuple[Number, Number, Number]:
    """Ex, Ey and Gxy of the whole wall [Pa], x along the shaft and y around it."""
    a11, a12, a22, a16, a26, a66 = membrane_stiffness(plies)
    thickness = ca.sum1(_column([p.thickness for p in plies]))
    det = a11 * (a22 * a66 - a26**2) - a12 * (a12 * a66 - a16 * a26) + a16 * (a12 * a26 - a22 * a16)
    minors = (a22 * a66 - a26**2, a11 * a66 - a16**2, a11 * a22 - a12**2)
    ex, ey, gxy = (det / (minor * thickness) for minor in minors)
    return ex, ey, gxy


def _laminate(plies: tuple[Ply, ...]) -> _Stiffness:
    ex, gxy = laminate_moduli(plies)
    ones = ca.DM.ones(len(plies))
    return _Stiffness(ex * ones, 0.0 * ones, gxy * ones, gxy * ones)
