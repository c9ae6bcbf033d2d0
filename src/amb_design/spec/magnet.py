"""Radial magnetic bearings: two perpendicular axes, each with a pair of horseshoe magnets."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import SpecError
from .controller import Controller, serves_all
from .fields import Number, OptionalNumber, Spec, is_number, number, part, with_unit

_GEOMETRY = ("turns", "pole_area", "gap", "bias_current")


@dataclass(frozen=True, kw_only=True)
class Magnet(Spec):
    """A radial magnetic bearing, by its geometry or by k_i and k_s alone.

    With geometry k_i = mu0 N^2 Ag i0 cos(alpha)/g0^2 and k_s = k_i i0/g0. The limits and coil data
    are needed only by the checks that use them.
    """

    position: Number = number("m", "distance from the left shaft end", domain="nonnegative")
    turns: OptionalNumber = number("", "turns of a horseshoe (both poles)", domain="positive", default=None)
    pole_area: OptionalNumber = number("m^2", "area of one pole", domain="positive", default=None)
    half_angle: Number = number("rad", "angle between pole and axis", domain="nonnegative", default=0.0)
    gap: OptionalNumber = number("m", "nominal air gap", domain="positive", default=None)
    bias_current: OptionalNumber = number("A", "bias current i0", domain="positive", default=None)
    current_stiffness: OptionalNumber = number("N/A", "k_i, instead of the geometry", domain="positive", default=None)
    negative_stiffness: OptionalNumber = number(
        "N/m", "k_s >= 0, instead of the geometry; pushes the rotor outward", domain="nonnegative", default=None
    )
    max_current: OptionalNumber = number("A", "largest total current of a coil", domain="positive", default=None)
    max_flux_density: OptionalNumber = number("T", "saturation flux density", domain="positive", default=None)
    resistance: OptionalNumber = number("ohm", "resistance of a coil", domain="nonnegative", default=None)
    leakage_inductance: Number = number("H", "inductance beside mu0 N^2 Ag/(2 g0)", domain="nonnegative", default=0.0)
    link_voltage: OptionalNumber = number("V", "voltage of the amplifier's DC link", domain="positive", default=None)
    clearance: OptionalNumber = number("m", "clearance of the backup bearing", domain="positive", default=None)
    axes_angle: Number = number("rad", "angle from y (up) to the first magnet axis", default=0.0)
    sensor: str = part("name of the sensor that closes this loop; at the magnet if left out", default="")
    controller: Controller | None = part("controller of this magnet; the machine's if left out", default=None)
    controller_z: Controller | None = part("controller of the second axis; that of the first if left out", default=None)
    name: str = part("name in tables and drawings", default="")

    def check(self) -> None:
        geometry = [getattr(self, n) is not None for n in _GEOMETRY]
        linear = [self.current_stiffness is not None, self.negative_stiffness is not None]
        if any(linear):
            if not all(linear):
                name = "current_stiffness" if not linear[0] else "negative_stiffness"
                raise SpecError("is missing", field=name, remedy="give both k_i and k_s, or the magnet's geometry")
            for n in ("turns", "pole_area"):
                if getattr(self, n) is not None:
                    raise SpecError(
                        "is given beside k_i and k_s",
                        field=n,
                        got=with_unit(getattr(self, n), ""),
                        remedy="describe the magnet by its geometry or by k_i and k_s, not by both",
                    )
        elif not all(geometry):
            raise SpecError(
                "is missing",
                field=_GEOMETRY[geometry.index(False)],
                remedy="a magnet needs turns, pole_area, gap and bias_current, or k_i and k_s",
            )
        for name in ("controller", "controller_z"):
            if getattr(self, name) is not None and serves_all(getattr(self, name)):
                raise SpecError(
                    "connects several magnets",
                    field=name,
                    got=getattr(self, name).type,
                    remedy="make it the controller of the machine",
                )
        if is_number(self.half_angle) and not self.half_angle < 1.5707963:
            raise SpecError(
                "must be below 90 degrees",
                field="half_angle",
                got=with_unit(self.half_angle, "rad"),
                remedy="give radians, or a string such as '22.5 deg'",
            )
        if is_number(self.gap) and is_number(self.clearance) and self.clearance > self.gap:
            raise SpecError(
                f"exceeds the air gap ({self.gap:g} m)",
                field="clearance",
                got=with_unit(self.clearance, "m"),
                remedy="the backup bearing has to touch first",
            )
        if is_number(self.max_current) and is_number(self.bias_current) and self.bias_current > self.max_current:
            raise SpecError(
                f"exceeds max_current ({self.max_current:g} A)",
                field="bias_current",
                got=with_unit(self.bias_current, "A"),
                remedy="lower the bias or raise the limit",
            )

    @property
    def has_geometry(self) -> bool:
        """True if the force law, and not only its linearisation, is known."""
        return self.current_stiffness is None
