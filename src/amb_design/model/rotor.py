"""The passive rotor: M q'' + (C0 + Omega C1) q' + (K0 + Omega K1) q = F.

Shaft, disks and passive bearings with rotating damping after Zorzi & Nelson 1977. In complex coordinates, with
h = sqrt(1 + eta_h^2) and Kb the bending stiffness,

    C0 = Cb + eta_v Kb      C1 = -i G      K0 = (1 + eta_h)/h K + Kbear - i eta_h/h Kb      K1 = -i eta_v Kb
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from ..spec.fields import Number
from ..spec.machine import Machine
from ..spec.shaft import Segment
from .element import assemble
from .laminate import cowper, section_constants
from .mesh import Mesh, element_lengths
from .pair import Map, Matrix, Pair

# Limits of the element for beams without shear or without rotary inertia: the shear stiffness is raised to that of a
# material with G = 100 E and the rotary inertia lowered to a hundredth. More would only add rounding noise.
STIFF_SHEAR = 100.0
SMALL_INERTIA = 0.01

# Damping of bending alone leaves thickness-shear modes undamped where no bending reaches them (a uniform shaft on pins), and
# the machine would be "marginal". A trace of the viscous damping on shear, below any stated digit elsewhere, keeps them stable.
SHEAR_LOSS = 1e-6


@dataclass(frozen=True)
class Rotor:
    """Matrices of the passive rotor over the nodes' complex coordinates (r, phi), from left to right.

    Each is a real-linear map; the J parts vanish when the bearings are isotropic. C1 and K1 multiply the spin speed.
    """

    M: Map
    C0: Map
    C1: Map
    K0: Map
    K1: Map


def rotor(machine: Machine, mesh: Mesh) -> Rotor:
    """Assemble shaft, disks and passive bearings.

    Parameters
    ----------
    machine : Machine
        Numbers or CasADi scalars of one kind.
    mesh : Mesh
        Plan of the machine or of the numeric one behind it.

    Returns
    -------
    Rotor
    """
    shaft = machine.rotor.shaft
    sections = [section_constants(s, shaft.ply_law) for s in shaft.segments]
    lengths = element_lengths(machine, mesh)
    where = mesh.segment_of_elements()

    def each(values: list[Number]) -> Matrix:
        """One value a segment -> one value an element."""
        return ca.vertcat(*[values[s] for s in where])

    correction = [_shear_correction(machine, s) for s in shaft.segments]
    bending = each([c.bending for c in sections])
    inertia = each([c.inertia for c in sections])
    mass = each([c.mass for c in sections])
    if shaft.theory != "timoshenko":  # S = 100 B11 A/I: no shear deformation
        shear = STIFF_SHEAR * bending * mass / inertia
        coupling = 0.0 * bending
    else:
        shear = each([k * c.shear for k, c in zip(correction, sections, strict=True)])
        coupling = each([k * c.coupling / 2.0 for k, c in zip(correction, sections, strict=True)])
    without_rotary = shaft.theory == "euler-bernoulli"
    diametral = SMALL_INERTIA * inertia if without_rotary else inertia
    polar = 0.0 * inertia if without_rotary else 2.0 * inertia

    viscous = each([shaft.viscous_damping_of(s) for s in shaft.segments])
    eta = each([shaft.hysteretic_damping_of(s) for s in shaft.segments])
    h = ca.sqrt(1.0 + eta**2)
    elastic = (1.0 + eta) / h

    stiffness = Pair(
        assemble("shear_rr", elastic * shear / lengths)
        + assemble("shear_rp", elastic * shear)
        + assemble("shear_pp", elastic * shear * lengths)
        + assemble("bending", elastic * bending / lengths),
        assemble("coupling_rp", elastic * coupling / lengths)
        + assemble("coupling_pp", elastic * coupling)
        - assemble("bending", eta / h * bending / lengths),
    )
    damping = assemble("bending", viscous * bending / lengths)
    loss = SHEAR_LOSS * viscous
    damping = (
        damping
        + assemble("shear_rr", loss * shear / lengths)
        + assemble("shear_rp", loss * shear)
        + assemble("shear_pp", loss * shear * lengths)
    )
    external = assemble("translation", shaft.external_damping * lengths)
    gyroscopic = assemble("rotation", polar * lengths)
    inertias = assemble("translation", mass * lengths) + assemble("rotation", diametral * lengths)

    n = inertias.shape[0]
    disks = [(mesh.node_of(f"rotor.disks[{i}].position"), d) for i, d in enumerate(machine.rotor.disks)]
    inertias = inertias + diagonal(n, [2 * k for k, _ in disks], [d.total_mass for _, d in disks])
    inertias = inertias + diagonal(n, [2 * k + 1 for k, _ in disks], [d.inertias[0] for _, d in disks])
    gyroscopic = gyroscopic + diagonal(n, [2 * k + 1 for k, _ in disks], [d.inertias[1] for _, d in disks])

    places = [2 * mesh.node_of(f"bearings[{i}].position") for i in range(len(machine.bearings))]
    zero = type(inertias)(n, n)
    none = Pair(zero, zero)
    return Rotor(
        M=Map(Pair(inertias, zero), none),
        C0=Map(Pair(damping + external, zero), none)
        + _supports(n, places, [b.damping_matrix for b in machine.bearings]),
        C1=Map(Pair(zero, -gyroscopic), none),
        K0=Map(stiffness, none) + _supports(n, places, [b.stiffness_matrix for b in machine.bearings]),
        K1=Map(Pair(zero, -damping), none),
    )


def diagonal(n: int, places: list[int], values: list[Number]) -> Matrix:
    """Square matrix with values added up at some places of the diagonal."""
    if not places:
        return ca.DM(n, n)
    select = ca.DM.triplet(places, list(range(len(places))), ca.DM.ones(len(places)), n, len(places))
    return ca.mtimes([select, ca.diag(ca.vertcat(*values)), select.T])


def split(matrix: tuple[tuple[Number, Number], tuple[Number, Number]]) -> tuple[Number, Number, Number, Number]:
    """Real 2 x 2 matrix on (v, w) as r -> H r + J conj(r): Re H, Im H, Re J, Im J."""
    (yy, yz), (zy, zz) = matrix
    return (yy + zz) / 2.0, (zy - yz) / 2.0, (yy - zz) / 2.0, (yz + zy) / 2.0


def _supports(n: int, places: list[int], matrices: list[tuple[tuple[Number, Number], tuple[Number, Number]]]) -> Map:
    parts = [split(m) for m in matrices]
    column: Callable[[int], Matrix] = lambda k: diagonal(n, places, [p[k] for p in parts])  # noqa: E731
    return Map(Pair(column(0), column(1)), Pair(column(2), column(3)))


def _shear_correction(machine: Machine, segment: Segment) -> Number:
    given = machine.rotor.shaft.shear_correction
    return cowper(segment) if isinstance(given, str) else given
