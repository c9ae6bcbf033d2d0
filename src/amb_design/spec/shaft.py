"""The shaft: segments from left to right, each of one material or of plies wound from the inside out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import SpecError
from .fields import Number, OptionalNumber, Spec, choice, is_number, is_whole, number, part, with_unit
from .material import Isotropic, Material, Orthotropic

THEORIES = ("timoshenko", "rayleigh", "euler-bernoulli")
PLY_LAWS = ("plane-stress", "three-dimensional", "hoop-free-ply", "hoop-free-laminate")


@dataclass(frozen=True, kw_only=True)
class Ply(Spec):
    """One layer of a laminated tube."""

    material: Material = part("orthotropic or isotropic material")
    angle: Number = number("rad", "fibre angle from the shaft axis")
    thickness: Number = number("m", "thickness", domain="positive")


def layup(material: Material, angles: Sequence[Number], thickness: Number | Sequence[Number]) -> tuple[Ply, ...]:
    """Plies of one material, from the inside out.

    Parameters
    ----------
    material : Orthotropic or Isotropic
        Material of every ply.
    angles : sequence of float or CasADi scalar
        Fibre angles from the shaft axis [rad].
    thickness : float or sequence of float
        Thickness of each ply [m]; one number for equal plies.

    Returns
    -------
    tuple of Ply

    Raises
    ------
    SpecError
        If the numbers of angles and thicknesses differ.
    """
    each = list(thickness) if isinstance(thickness, Sequence) else [thickness] * len(angles)
    if len(each) != len(angles):
        raise SpecError(
            f"has {len(each)} entries for {len(angles)} angles",
            field="thickness",
            remedy="give one thickness for all plies, or one for each angle",
        )
    return tuple(Ply(material=material, angle=a, thickness=t) for a, t in zip(angles, each, strict=True))


@dataclass(frozen=True, kw_only=True)
class Segment(Spec):
    """A piece of shaft with one cross-section: a material with diameters, or plies on an inner diameter."""

    length: Number = number("m", "length", domain="positive")
    inner_diameter: Number = number("m", "inner diameter; zero for a solid shaft", domain="nonnegative", default=0.0)
    outer_diameter: OptionalNumber = number("m", "outer diameter (not with plies)", domain="positive", default=None)
    material: Isotropic | None = part("material of a homogeneous section", default=None)
    plies: tuple[Ply, ...] = part("plies from the inside out", default=())
    viscous_damping: OptionalNumber = number(
        "s", "rotating viscous damping eta_v; the shaft's value if left out", domain="nonnegative", default=None
    )
    hysteretic_damping: OptionalNumber = number(
        "", "rotating hysteretic damping eta_h; the shaft's value if left out", domain="nonnegative", default=None
    )

    def check(self) -> None:
        if bool(self.plies) == (self.material is not None):
            raise SpecError(
                "needs either a material or plies",
                field="material",
                remedy="give material and outer_diameter, or a layup",
            )
        if self.plies and self.outer_diameter is not None:
            raise SpecError(
                "follows from the plies",
                field="outer_diameter",
                got=with_unit(self.outer_diameter, "m"),
                remedy="remove it: inner_diameter and the ply thicknesses define the section",
            )
        if self.material is not None:
            if not isinstance(self.material, Isotropic):
                raise SpecError("must be isotropic", field="material", remedy="use a layup for an orthotropic material")
            if self.outer_diameter is None:
                raise SpecError("is missing", field="outer_diameter", remedy="give the outer diameter of the segment")
            inner, outer = self.inner_diameter, self.outer_diameter
            if is_number(inner) and is_number(outer) and inner >= outer:
                raise SpecError(
                    f"is not below the outer diameter ({outer:g} m)",
                    field="inner_diameter",
                    got=with_unit(inner, "m"),
                    remedy="leave a wall",
                )

    @property
    def outer(self) -> Number:
        """Outer diameter [m]."""
        if self.material is not None:
            return self.outer_diameter
        outer = self.inner_diameter
        for ply in self.plies:
            outer = outer + 2.0 * ply.thickness
        return outer


@dataclass(frozen=True, kw_only=True)
class Shaft(Spec):
    """The flexible shaft, from x = 0 to the sum of its segments' lengths."""

    segments: tuple[Segment, ...] = part("segments from left to right")
    shear_correction: Number | str = number(
        "",
        "shear correction factor, or 'cowper' for isotropic sections",
        domain="positive",
        options=("cowper",),
        default="cowper",
    )
    viscous_damping: Number = number("s", "rotating viscous damping eta_v", domain="nonnegative", default=0.0)
    hysteretic_damping: Number = number("", "rotating hysteretic damping eta_h", domain="nonnegative", default=0.0)
    external_damping: Number = number(
        "N s/m^2", "external damping force per velocity and length", domain="nonnegative", default=0.0
    )
    theory: str = choice("beam theory", THEORIES, default="timoshenko")
    ply_law: str = choice("how plies become section constants", PLY_LAWS, default="plane-stress")
    elements: int = part("least number of three-node elements over the whole shaft", default=16)

    def check(self) -> None:
        if not self.segments:
            raise SpecError("is empty", field="segments", remedy="give at least one segment")
        if not (is_whole(self.elements) and 1 <= self.elements <= 2000):
            raise SpecError(
                "must be a whole number from 1 to 2000",
                field="elements",
                got=self.elements,
                remedy="16 suits most shafts",
            )
        if isinstance(self.shear_correction, str):
            for i, s in enumerate(self.segments):
                if s.plies:
                    raise SpecError(
                        f"'cowper' does not hold for the laminate of segments[{i}]",
                        field="shear_correction",
                        remedy="give a number: about 0.5 for a thin tube, 0.56 in the solid shaft of Ahmad 2014",
                    )
        if self.ply_law == "three-dimensional":
            for i, s in enumerate(self.segments):
                for j, ply in enumerate(s.plies):
                    m = ply.material
                    if isinstance(m, Orthotropic) and all(map(is_number, (m.E1, m.E2, m.G23, m.nu12))):
                        nu23 = m.E2 / (2.0 * m.G23) - 1.0
                        # positive definite stiffness of a transversely isotropic ply
                        if not (-1.0 < nu23 < 1.0 and 1.0 - nu23 - 2.0 * m.nu12**2 * m.E2 / m.E1 > 0.0):
                            raise SpecError(
                                f"gives nu23 = E2/(2 G23) - 1 = {nu23:.3g}, outside what a three-dimensional ply admits",
                                field=f"segments[{i}].plies[{j}].material.G23",
                                got=with_unit(m.G23, "Pa"),
                                remedy="correct G23 or choose another ply_law",
                            )

    @property
    def length(self) -> Number:
        """Length of the shaft [m]."""
        total: Number = 0.0
        for segment in self.segments:
            total = total + segment.length
        return total

    def viscous_damping_of(self, segment: Segment) -> Number:
        """eta_v [s] of a segment of this shaft.

        Parameters
        ----------
        segment : Segment
        """
        return self.viscous_damping if segment.viscous_damping is None else segment.viscous_damping

    def hysteretic_damping_of(self, segment: Segment) -> Number:
        """eta_h [-] of a segment of this shaft.

        Parameters
        ----------
        segment : Segment
        """
        return self.hysteretic_damping if segment.hysteretic_damping is None else segment.hysteretic_damping
