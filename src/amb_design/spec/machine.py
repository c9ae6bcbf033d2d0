"""The whole machine, and what must hold between its parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from ..errors import SpecError
from .bearing import Bearing, Pin
from .controller import Controller, StateFeedback, StateSpace, serves_all
from .disk import Disk
from .fields import Number, OptionalNumber, Spec, is_number, number, part, with_unit
from .magnet import Magnet
from .shaft import Shaft


@dataclass(frozen=True, kw_only=True)
class Rotor(Spec):
    """What rotates."""

    shaft: Shaft = part("the flexible shaft")
    disks: tuple[Disk, ...] = part("rigid disks", default=())


@dataclass(frozen=True, kw_only=True)
class Sensor(Spec):
    """A displacement sensor at a station of its own."""

    name: str = part("name that magnets refer to")
    position: Number = number("m", "distance from the left shaft end", domain="nonnegative")


@dataclass(frozen=True, kw_only=True)
class Operation(Spec):
    """How the machine is run."""

    top_speed: Number = number("rad/s", "analyses look up to this spin speed", domain="positive")
    service_speed: OptionalNumber = number("rad/s", "speed of normal service", domain="positive", default=None)
    gravity: Number = number(
        "m/s^2", "acceleration of gravity across the shaft, along -y", domain="nonnegative", default=9.80665
    )


@dataclass(frozen=True, kw_only=True)
class Machine(Spec):
    """A rotor on passive and magnetic bearings with its controller."""

    name: str = part("name in tables and plots")
    rotor: Rotor = part("what rotates")
    bearings: tuple[Bearing, ...] = part("springs and dampers to ground", default=())
    pins: tuple[Pin, ...] = part("points that cannot move sideways", default=())
    magnets: tuple[Magnet, ...] = part("radial magnetic bearings", default=())
    controller: Controller | None = part("controller of every magnet that has none of its own", default=None)
    controller_z: Controller | None = part("controller of the second axes; that of the first if left out", default=None)
    sensors: tuple[Sensor, ...] = part("displacement sensors", default=())
    operation: Operation = part("how it is run")
    source: Mapping[str, str] = field(
        default_factory=dict, metadata={"doc": "where the numbers come from"}, compare=False
    )

    def stations(self) -> Iterator[tuple[str, Number]]:
        """Path and position [m] of everything that sits at one place of the shaft."""
        for i, disk in enumerate(self.rotor.disks):
            yield f"rotor.disks[{i}].position", disk.position
        for name in ("bearings", "pins", "magnets", "sensors"):
            for i, item in enumerate(getattr(self, name)):
                yield f"{name}[{i}].position", item.position

    def controllers_of(self, magnet: Magnet) -> tuple[Controller | None, Controller | None]:
        """Controllers of the magnet's first and second axis (the same object where they are equal).

        Parameters
        ----------
        magnet : Magnet
        """
        first = magnet.controller or self.controller
        second = magnet.controller_z or (magnet.controller or self.controller_z or first)
        return first, second

    def without_controllers(self) -> Machine:
        """The same machine with its loops cut; magnets keep their bias."""
        bare = tuple(replace(m, controller=None, controller_z=None) for m in self.magnets)
        return replace(self, magnets=bare, controller=None, controller_z=None)

    def check(self) -> None:
        length = self.rotor.shaft.length
        if is_number(length):
            for path, position in self.stations():
                if is_number(position) and position > length * (1.0 + 1e-9):
                    what = path.rsplit("[", 1)[0].rsplit(".", 1)[-1].rstrip("s")
                    raise SpecError(
                        f"lies beyond the shaft ({length:.6g} m)",
                        field=path,
                        got=with_unit(position, "m"),
                        remedy=f"move the {what} or lengthen the shaft",
                    )
        self._check_disks_apart()
        self._check_loops()

    def _check_disks_apart(self) -> None:
        taken: list[tuple[float, float, str]] = []
        for i, disk in enumerate(self.rotor.disks):
            if not (is_number(disk.position) and is_number(disk.width)):
                continue
            left, right = disk.position - disk.width / 2.0, disk.position + disk.width / 2.0
            for a, b, other in taken:
                if min(b, right) - max(a, left) > 1e-9 * (right - left):
                    raise SpecError(
                        f"makes the disk overlap with {other} ({a:g} to {b:g} m)",
                        field=f"rotor.disks[{i}].position",
                        got=with_unit(disk.position, "m"),
                        remedy="move the disks apart or make them narrower",
                    )
            taken.append((left, right, f"rotor.disks[{i}]"))
        for name in ("bearings", "pins", "magnets"):
            seen: dict[float, int] = {}
            for i, item in enumerate(getattr(self, name)):
                if is_number(item.position):
                    j = seen.setdefault(round(item.position, 9), i)
                    if j != i:
                        raise SpecError(
                            f"is the station of {name}[{j}] too",
                            field=f"{name}[{i}].position",
                            got=with_unit(item.position, "m"),
                            remedy="merge the two or move one of them",
                        )

    def _check_loops(self) -> None:
        names = [s.name for s in self.sensors]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise SpecError(
                    "is used twice", field=f"sensors[{i}].name", got=name, remedy="give each sensor its own name"
                )
        for i, magnet in enumerate(self.magnets):
            if magnet.sensor and magnet.sensor not in names:
                known = ", ".join(names) or "none is defined"
                raise SpecError(
                    "names no sensor",
                    field=f"magnets[{i}].sensor",
                    got=magnet.sensor,
                    remedy=f"use one of the sensors: {known}",
                )
            first, second = self.controllers_of(magnet)
            if first is None and second is not None:
                raise SpecError(
                    "has a controller for its second axis only",
                    field=f"magnets[{i}]",
                    remedy="give the first axis one too",
                )
        for name in ("controller", "controller_z"):
            if getattr(self, name) is not None and not self.magnets:
                raise SpecError(
                    "has no magnet to act on", field=name, remedy="add [[magnets]] or remove the controller"
                )

        self._check_coupling()

    def _check_coupling(self) -> None:
        law = self.controller
        if self.controller_z is not None and serves_all(self.controller_z):
            raise SpecError(
                "serves both axes of all magnets",
                field="controller_z",
                got=self.controller_z.type,
                remedy="make it the controller",
            )
        if law is None or not serves_all(law):
            return
        own = [f"magnets[{i}]" for i, m in enumerate(self.magnets) if m.controller or m.controller_z]
        for place in [*(["controller_z"] if self.controller_z else []), *own]:
            raise SpecError(
                "has a controller of its own beside one that serves all magnets",
                field=place,
                remedy="remove one of the two",
            )
        wanted = len(self.magnets)
        if isinstance(law, StateSpace) and law.law.ports not in (wanted, 2 * wanted):
            raise SpecError(
                f"has {law.law.ports} inputs for {wanted} magnets",
                field="controller.law",
                remedy=f"give {wanted}, {2 * wanted} for both axes apart, or 1 without cross for each axis alone",
            )
        if isinstance(law, StateSpace) and law.law.ports == 2 * wanted and (law.cross or law.cross_rate):
            raise SpecError(
                "has no meaning where each axis has an input of its own",
                field="controller.cross",
                remedy="write the coupling of the axes into law",
            )
        if isinstance(law, StateFeedback) and len(law.position) != wanted:
            raise SpecError(
                f"has {len(law.position)} rows for {wanted} magnets",
                field="controller.position",
                remedy="give one row for each magnet",
            )

    def sensor_position(self, magnet: Magnet) -> Number:
        """Station [m] of the sensor that closes the loop of a magnet.

        Parameters
        ----------
        magnet : Magnet
        """
        for sensor in self.sensors:
            if sensor.name == magnet.sensor:
                return sensor.position
        return magnet.position
