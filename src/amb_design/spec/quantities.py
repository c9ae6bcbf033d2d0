"""What a design problem can be about: the quantities that may be limited, maximised or minimised."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Option:
    """A further setting of a limit.

    Attributes
    ----------
    unit : str
        SI unit of its numbers; "name" for texts.
    many : int
        How many values it takes; 0 for one value, -1 for any number of them.
    default : object
        If left out; None for an option that must be given.
    doc : str
    """

    unit: str
    many: int
    default: object
    doc: str


@dataclass(frozen=True)
class Quantity:
    """A figure of merit of a machine over its range of speeds.

    Attributes
    ----------
    name : str
    unit : str
        SI unit.
    upper : bool
        True if a limit bounds it from above, and small values are good.
    doc : str
        One line for the reader of the reference.
    needs : tuple of str
        What the machine or the problem must have: "loops", "unbalance", "bias", "geometry", "resistance", "room", "disks",
        "service_speed".
    options : mapping of str to Option
    objective : bool
        True if it can be maximised or minimised.
    """

    name: str
    unit: str
    upper: bool
    doc: str
    needs: tuple[str, ...] = ()
    options: Mapping[str, Option] = field(default_factory=dict)
    objective: bool = False


_WINDOW = Option("rad/s", 2, (1.0, 1e9), "whirl frequencies between which modes count")
_DISKS = Option("name", -1, (), "names of the disks that count; all that have an outer diameter if left out")
_UP_TO = Option(
    "rad/s", 0, 0.0, "highest frequency, where that is above 2 kHz and three times the speed, the range of ISO 14839-3"
)
_OVERSPEED = Option("", 0, 1.0, "factor on the highest speed of the range")
_NOISE = Option("m/sqrt(Hz)", 0, None, "one-sided amplitude spectral density of the white noise of each sensor")

QUANTITIES: dict[str, Quantity] = {
    q.name: q
    for q in (
        Quantity("stability_limit", "rad/s", False, "stable, and within all limits, up to this speed", objective=True),
        Quantity("decay_rate", "1/s", False, "least decay rate of any whirling mode over the range of speeds"),
        Quantity(
            "damping_ratio",
            "",
            False,
            "least damping ratio of any mode in the window, over the range of speeds",
            options={"window": _WINDOW},
            objective=True,
        ),
        Quantity(
            "sensitivity_peak",
            "",
            True,
            "ISO 14839-3 peak sensitivity of every loop, at rest and over the range of speeds",
            ("loops",),
            options={"up_to": _UP_TO},
            objective=True,
        ),
        Quantity("bias_current", "A", True, "largest bias current of any magnet", ("bias",), objective=True),
        Quantity(
            "control_current", "A", True, "largest control current under the residual unbalance", ("loops", "unbalance")
        ),
        Quantity(
            "control_current_ratio",
            "",
            True,
            "control current under the residual unbalance over the bias current",
            ("loops", "unbalance", "bias"),
        ),
        Quantity(
            "total_current",
            "A",
            True,
            "bias plus control current under the residual unbalance",
            ("loops", "unbalance", "bias"),
        ),
        Quantity(
            "noise_current",
            "A",
            True,
            "rms control current of any magnet axis from noise of the displacement sensors, over the range of speeds",
            ("loops",),
            options={"noise": _NOISE},
            objective=True,
        ),
        Quantity(
            "noise_current_ratio",
            "",
            True,
            "rms control current from noise of the displacement sensors over the bias current",
            ("loops", "bias"),
            options={"noise": _NOISE},
        ),
        Quantity(
            "flux_density",
            "T",
            True,
            "flux density of any pole under the residual unbalance",
            ("unbalance", "geometry"),
        ),
        Quantity(
            "voltage",
            "V",
            True,
            "amplifier voltage under the residual unbalance: inductive, resistive and motion-induced",
            ("loops", "unbalance", "geometry"),
        ),
        Quantity(
            "displacement_ratio",
            "",
            True,
            "whirl at the magnets under the residual unbalance over the clearance of the backup bearings",
            ("unbalance", "room"),
        ),
        Quantity(
            "separation_margin",
            "",
            False,
            "distance of critical speeds with amplification above 2.5 from the service speed, over the service speed",
            ("service_speed",),
        ),
        Quantity(
            "hoop_strain",
            "",
            True,
            "hoop strain of the shaft's outermost fibre from its own rotation",
            options={"overspeed": _OVERSPEED},
        ),
        Quantity("torsional_ratio", "", False, "first free torsional frequency over the highest speed", ("disks",)),
        Quantity(
            "surface_speed", "m/s", True, "surface speed of disks and sleeves", ("disks",), options={"disks": _DISKS}
        ),
        Quantity("mass", "kg", True, "mass of the rotor", objective=True),
        Quantity(
            "copper_loss", "W", True, "loss of all coils at bias: four a magnet", ("bias", "resistance"), objective=True
        ),
    )
}
"""By name."""
