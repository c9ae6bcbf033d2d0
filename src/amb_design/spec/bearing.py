"""Passive supports: springs and dampers with all eight coefficients, and pins."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SpecError
from .fields import Number, OptionalNumber, Spec, is_number, number, part


@dataclass(frozen=True, kw_only=True)
class Bearing(Spec):
    """Linear spring and damper to ground.

    `stiffness` and `damping` describe an isotropic bearing. The coefficients kyy ... czz replace
    them one by one where the bearing differs in y and z; force on the shaft F = -K u - C u'.
    """

    position: Number = number("m", "distance from the left shaft end", domain="nonnegative")
    stiffness: Number = number("N/m", "direct stiffness in y and z", default=0.0)
    damping: Number = number("N s/m", "direct damping in y and z", default=0.0)
    kyy: OptionalNumber = number("N/m", "stiffness in y; `stiffness` if left out", default=None)
    kyz: Number = number("N/m", "force in y for a displacement in z", default=0.0)
    kzy: Number = number("N/m", "force in z for a displacement in y", default=0.0)
    kzz: OptionalNumber = number("N/m", "stiffness in z; `stiffness` if left out", default=None)
    cyy: OptionalNumber = number("N s/m", "damping in y; `damping` if left out", default=None)
    cyz: Number = number("N s/m", "force in y for a velocity in z", default=0.0)
    czy: Number = number("N s/m", "force in z for a velocity in y", default=0.0)
    czz: OptionalNumber = number("N s/m", "damping in z; `damping` if left out", default=None)
    name: str = part("name in tables and drawings", default="")

    def check(self) -> None:
        coefficients = (self.kyy, self.kzz, self.cyy, self.czz, self.stiffness, self.damping, self.kyz, self.kzy)
        if all(c is None or (is_number(c) and c == 0) for c in coefficients):
            raise SpecError("is missing", field="stiffness", remedy="give the bearing a stiffness or a damping")

    @property
    def stiffness_matrix(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """((kyy, kyz), (kzy, kzz)) [N/m]."""
        return self._matrix(self.stiffness, self.kyy, self.kyz, self.kzy, self.kzz)

    @property
    def damping_matrix(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """((cyy, cyz), (czy, czz)) [N s/m]."""
        return self._matrix(self.damping, self.cyy, self.cyz, self.czy, self.czz)

    @staticmethod
    def _matrix(
        both: Number, yy: Number, yz: Number, zy: Number, zz: Number
    ) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        return ((both if yy is None else yy, yz), (zy, both if zz is None else zz))


@dataclass(frozen=True, kw_only=True)
class Pin(Spec):
    """A point of the shaft that cannot move sideways but may tilt."""

    position: Number = number("m", "distance from the left shaft end", domain="nonnegative")
