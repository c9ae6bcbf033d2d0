"""Rigid disks on the shaft: impellers, sleeves, rotors of motors."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import SpecError
from .fields import Number, OptionalNumber, Spec, is_number, number, part, with_unit


@dataclass(frozen=True, kw_only=True)
class Disk(Spec):
    """A rigid disk: mass and inertias given, or a ring from which they follow.

    With geometry, the mass may be given or follow from the density; the inertias of a ring are
    Id = m/12 (3 (Ro^2 + Ri^2) + h^2) and Ip = m/2 (Ro^2 + Ri^2).
    """

    position: Number = number("m", "distance of the disk's middle from the left shaft end", domain="nonnegative")
    mass: OptionalNumber = number("kg", "mass", domain="positive", default=None)
    diametral_inertia: OptionalNumber = number(
        "kg m^2", "moment of inertia about a diameter", domain="nonnegative", default=None
    )
    polar_inertia: OptionalNumber = number(
        "kg m^2", "moment of inertia about the shaft axis", domain="nonnegative", default=None
    )
    outer_diameter: OptionalNumber = number("m", "outer diameter of the ring", domain="positive", default=None)
    inner_diameter: OptionalNumber = number("m", "inner diameter of the ring", domain="nonnegative", default=None)
    width: OptionalNumber = number("m", "width of the ring along the shaft", domain="positive", default=None)
    density: OptionalNumber = number("kg/m^3", "density of the ring", domain="positive", default=None)
    unbalance: Number = number("kg m", "unbalance: mass times eccentricity", domain="nonnegative", default=0.0)
    unbalance_phase: Number = number("rad", "angular position of the unbalance", default=0.0)
    name: str = part("name in tables and drawings", default="")

    def check(self) -> None:
        ring = (self.outer_diameter, self.inner_diameter, self.width)
        geometric = any(v is not None for v in ring)
        if geometric and any(v is None for v in ring):
            missing = ("outer_diameter", "inner_diameter", "width")[[v is None for v in ring].index(True)]
            raise SpecError("is missing", field=missing, remedy="a ring needs outer_diameter, inner_diameter and width")
        inner, outer = self.inner_diameter, self.outer_diameter
        if is_number(inner) and is_number(outer) and inner >= outer:
            raise SpecError(
                f"is not below the outer diameter ({outer:g} m)",
                field="inner_diameter",
                got=with_unit(inner, "m"),
                remedy="give the ring a width in the radial direction",
            )
        if self.mass is None and (not geometric or self.density is None):
            raise SpecError("is missing", field="mass", remedy="give the mass, or a ring with its density")
        if self.mass is not None and self.density is not None:
            raise SpecError(
                "is given beside the mass",
                field="density",
                got=with_unit(self.density, "kg/m^3"),
                remedy="give one of them",
            )
        if not geometric:
            for name in ("diametral_inertia", "polar_inertia"):
                if getattr(self, name) is None:
                    raise SpecError("is missing", field=name, remedy="give both inertias, or the ring's geometry")
        elif (self.diametral_inertia is None) != (self.polar_inertia is None):
            name = "diametral_inertia" if self.diametral_inertia is None else "polar_inertia"
            raise SpecError("is missing", field=name, remedy="give both inertias or none")
        diametral, polar = self.diametral_inertia, self.polar_inertia
        if is_number(diametral) and is_number(polar) and polar > 2.0 * diametral * (1.0 + 1e-9):
            raise SpecError(
                f"exceeds twice the diametral inertia ({diametral:g} kg m^2), which no rigid body can",
                field="polar_inertia",
                got=with_unit(polar, "kg m^2"),
                remedy="check whether the two were exchanged",
            )

    @property
    def total_mass(self) -> Number:
        """Mass [kg]."""
        if self.mass is not None:
            return self.mass
        density, inner, outer, width = self._ring
        return density * math.pi / 4.0 * (outer**2 - inner**2) * width

    @property
    def inertias(self) -> tuple[Number, Number]:
        """Diametral and polar moments of inertia [kg m^2]."""
        if self.diametral_inertia is not None:
            return self.diametral_inertia, self.polar_inertia
        _, inner, outer, width = self._ring
        radii = (outer**2 + inner**2) / 4.0
        m = self.total_mass
        return m / 12.0 * (3.0 * radii + width**2), m / 2.0 * radii

    @property
    def _ring(self) -> tuple[Number, Number, Number, Number]:
        return self.density, self.inner_diameter, self.outer_diameter, self.width
