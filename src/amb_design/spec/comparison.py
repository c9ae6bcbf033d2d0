"""What a comparison holds alike for all designs: speeds, unbalance, noise, disturbances, tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..errors import SpecError
from .fields import Number, OptionalNumber, Spec, is_number, is_whole, number, part, with_unit
from .machine import Machine
from .parts import place

CORNERS = 5
"""Most tolerances of which all corners are looked at: 2^5 stability limits a design."""


@dataclass(frozen=True, kw_only=True)
class ForceStep(Spec):
    """A force across the shaft that begins suddenly and stays."""

    force: Number = number("N", "size", domain="positive")
    at: Any = part('part of the machine, such as "disk 2" or "magnets[0]", or a position')
    angle: Number = number("rad", "direction, from y towards z", default=0.0)

    def check(self) -> None:
        if not (is_number(self.at) or (isinstance(self.at, str) and self.at)):
            raise SpecError("is no place", field="at", got=self.at, remedy='name a part, such as "disk 1"')


@dataclass(frozen=True, kw_only=True)
class BaseShock(Spec):
    """An acceleration of the base: half a sine of some duration, or a step that stays."""

    acceleration: Number = number("m/s^2", "its largest value", domain="positive")
    duration: OptionalNumber = number("s", "of the half-sine; a step if left out", domain="positive", default=None)
    angle: Number = number("rad", "direction, from y towards z", default=0.0)


@dataclass(frozen=True, kw_only=True)
class Conditions(Spec):
    """The conditions of a comparison; what is left out is chosen from the machines, and the result says how."""

    speed: OptionalNumber = number("rad/s", "end of the operating range", domain="positive", default=None)
    top_speed: OptionalNumber = number(
        "rad/s", "stability limits are looked for up to this speed", domain="positive", default=None
    )
    modes: int = part("whirling modes whose damping is compared, from the lowest frequency on", default=6)
    sensitivity_up_to: OptionalNumber = number(
        "rad/s",
        "highest frequency of the sensitivities, where that is above 2 kHz and three times the speed",
        domain="positive",
        default=None,
    )
    unbalance: Mapping[str, Sequence[float]] | None = part(
        "residual unbalances by name, kg m with sign for each disk; the machine's own if left out", default=None
    )
    sensor_noise: Number = number(
        "m/sqrt(Hz)", "noise at every sensor, one-sided amplitude density", domain="positive", default=1e-8
    )
    force_step: ForceStep | None = part("a tenth of the weight at the heaviest disk if left out", default=None)
    base_shock: BaseShock | None = part("1 m/s^2 for 11 ms if left out", default=None)
    settled: Number = number("", "part of the peak within which a response has settled", default=0.05)
    tolerances: Mapping[str, float] | None = part("relative tolerances by path; usual ones if left out", default=None)
    samples: int = part("random machines within the tolerances", default=50)
    seed: int = part("of the random machines", default=0)

    def check(self) -> None:
        for name, least in (("modes", 1), ("samples", 0), ("seed", 0)):
            found = getattr(self, name)
            if not is_whole(found) or found < least:
                raise SpecError(
                    "must be a whole number", field=name, got=found, remedy=f"give {least} or a whole number above it"
                )
        if not 0.0 < self.settled < 1.0:
            raise SpecError("must lie between 0 and 1", field="settled", got=self.settled, remedy="0.05 stands for 5 %")
        if self.speed is not None and self.top_speed is not None and self.top_speed < self.speed:
            raise SpecError(
                "is below the end of the operating range",
                field="top_speed",
                got=with_unit(self.top_speed, "rad/s"),
                remedy="look further for stability limits than the machines run",
            )
        kinds: tuple[tuple[str, type[Spec]], ...] = (("force_step", ForceStep), ("base_shock", BaseShock))
        for name, wanted in kinds:
            if not isinstance(getattr(self, name), wanted | None):
                raise SpecError(
                    "has the wrong type", field=name, got=getattr(self, name), remedy=f"give an ad.{wanted.__name__}"
                )
        self._check_unbalance()
        self._check_tolerances()

    def _check_unbalance(self) -> None:
        for name, amounts in _mapping(self.unbalance, "unbalance").items():
            where = f"unbalance.{name}"
            if isinstance(amounts, str) or not isinstance(amounts, Sequence) or not all(is_number(a) for a in amounts):
                raise SpecError("must be a list of numbers", field=where, got=amounts, remedy="give kg m for each disk")
            if not any(amounts):
                raise SpecError("is zero at every disk", field=where, remedy="give mass times eccentricity in kg m")

    def _check_tolerances(self) -> None:
        given = _mapping(self.tolerances, "tolerances")
        if len(given) > CORNERS:
            raise SpecError(
                f"holds more than {CORNERS}, whose corners would be too many",
                field="tolerances",
                got=len(given),
                remedy="keep those that matter most, or tie some by a short path",
            )
        for path, tolerance in given.items():
            if not (is_number(tolerance) and 0.0 < tolerance < 1.0):
                raise SpecError(
                    "must lie between 0 and 1",
                    field=f"tolerances.{path}",
                    got=tolerance,
                    remedy="0.05 stands for 5 %",
                )

    def fit(self, machine: Machine) -> None:
        """Check that a machine has what the conditions speak of.

        Parameters
        ----------
        machine : Machine

        Raises
        ------
        SpecError
            If it has not.
        """
        disks = len(machine.rotor.disks)
        for name, amounts in (self.unbalance or {}).items():
            if len(amounts) != disks:
                raise SpecError(
                    f"gives {len(amounts)} amounts for the {disks} disks of {machine.name}",
                    field=f"unbalance.{name}",
                    remedy="list one for each disk in the order of rotor.disks; 0 for a balanced one",
                )
        if self.force_step is not None:
            try:
                place(machine, self.force_step.at)
            except SpecError as error:
                raise SpecError(
                    error.problem.replace("this machine", machine.name),
                    field="force_step.at",
                    got=error.got,
                    remedy=error.remedy,
                ) from None


@dataclass(frozen=True)
class Comparison:
    """Designs to be compared, with their conditions.

    Attributes
    ----------
    name, question : str
    designs : mapping of str to Machine
    seconds : mapping of str to float
        CPU time that went into a design [s], where it is known.
    conditions : Conditions
    source : mapping of str to str
        Where the conditions come from.
    """

    name: str
    designs: Mapping[str, Machine]
    conditions: Conditions
    seconds: Mapping[str, float] = field(default_factory=dict)
    question: str = ""
    source: Mapping[str, str] = field(default_factory=dict)


def _mapping(raw: Any, name: str) -> Mapping[str, Any]:
    if raw is None:
        return {}
    if not isinstance(raw, Mapping):
        raise SpecError("must be a table", field=name, got=raw, remedy="give names or paths with their numbers")
    return raw
