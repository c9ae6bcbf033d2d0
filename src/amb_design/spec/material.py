"""Materials: isotropic, and the orthotropic ply of a laminate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from ..errors import SpecError
from .fields import Number, OptionalNumber, Spec, is_number, number, with_unit


@dataclass(frozen=True, kw_only=True)
class Isotropic(Spec):
    """An isotropic material; give the shear modulus or Poisson's ratio."""

    E: Number = number("Pa", "Young's modulus", domain="positive")
    G: OptionalNumber = number("Pa", "shear modulus", domain="positive", default=None)
    nu: OptionalNumber = number("", "Poisson's ratio", default=None)
    density: Number = number("kg/m^3", "density", domain="positive")

    def check(self) -> None:
        if (self.G is None) == (self.nu is None):
            raise SpecError("needs exactly one of G and nu", field="G", remedy="give the one that was measured")
        if is_number(self.nu) and not -1.0 < self.nu < 0.5:
            raise SpecError(
                "is no admissible Poisson's ratio", field="nu", got=self.nu, remedy="give a value in (-1, 0.5)"
            )

    @property
    def shear_modulus(self) -> Number:
        """Shear modulus [Pa]."""
        return self.G if self.nu is None else self.E / (2.0 * (1.0 + self.nu))

    @property
    def poisson(self) -> Number:
        """Poisson's ratio [-]."""
        return self.nu if self.G is None else self.E / (2.0 * self.G) - 1.0


@dataclass(frozen=True, kw_only=True)
class Orthotropic(Spec):
    """A unidirectional ply, transversely isotropic about the fibre direction 1."""

    E1: Number = number("Pa", "Young's modulus along the fibres", domain="positive")
    E2: Number = number("Pa", "Young's modulus across the fibres", domain="positive")
    G12: Number = number("Pa", "in-plane shear modulus", domain="positive")
    G13: Number = number("Pa", "transverse shear modulus along the fibres", domain="positive")
    G23: Number = number("Pa", "transverse shear modulus across the fibres", domain="positive")
    nu12: Number = number("", "major Poisson's ratio")
    density: Number = number("kg/m^3", "density", domain="positive")

    def check(self) -> None:
        if all(is_number(v) for v in (self.E1, self.E2, self.nu12)) and not self.nu12**2 * self.E2 < self.E1:
            bound = (self.E1 / self.E2) ** 0.5
            raise SpecError(
                "is inadmissible: nu12^2 must be below E1/E2",
                field="nu12",
                got=with_unit(self.nu12, ""),
                remedy=f"give a value in (-{bound:.3g}, {bound:.3g}) or check E1 and E2",
            )


Material: TypeAlias = Isotropic | Orthotropic
"""Any material."""
