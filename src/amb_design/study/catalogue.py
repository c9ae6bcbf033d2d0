"""What the Functions of a machine take and return: names, units and meaning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

Meanings = Mapping[str, tuple[str, str]]
"""Unit and meaning of inputs or outputs, by name."""

_P = {"p": ("", "parameters, SI units; see `parameters`")}
_MATRIX = {"re": ("SI", "real part"), "im": ("SI", "imaginary part; no entries in the real form")}
_SPEEDS = {**_P, "speed": ("rad/s", "spin speeds")}
_BASIS = "generalised forces over the coordinates"

FUNCTIONS: dict[str, tuple[str, Meanings, Meanings]] = {
    **{
        name: (meaning, _P, _MATRIX)
        for name, meaning in {
            "M": "mass matrix",
            "C0": "damping matrix at rest",
            "C1": "gyroscopic matrix G: what a rad/s of spin speed adds to the damping matrix",
            "K0": "stiffness matrix K at rest, the magnets' negative stiffness included",
            "K1": "circulatory matrix Kc of rotating damping: what a rad/s of spin speed adds to the stiffness matrix",
            "E": "of the pencil E dx/dt = (A0 + speed A1) x + B i, y = C x",
            "A0": "of the pencil: all that does not depend on the speed",
            "A1": "of the pencil: what a rad/s of spin speed adds",
            "B": "of the pencil: axes' control currents [A] added to those of the controllers",
            "C": "of the pencil: displacements of the shaft at the axes' sensors [m]",
        }.items()
    },
    "magnet_force": (
        "nonlinear force of every magnet",
        {
            **_P,
            "current": ("A", "control currents, magnets by two axes"),
            "displacement": ("m", "of the shaft at the magnets, towards the first horseshoe of each axis"),
        },
        {"force": ("N", "on the shaft along the axes")},
    ),
    "controller": (
        "all controllers in state space, real form",
        {
            **_P,
            "speed": ("rad/s", "spin speed, for gains that follow it"),
            "state": ("", "states, named by `controller_states`"),
            "displacement": ("m", "at the sensors, axis by axis"),
            "velocity": ("m/s", "at the sensors"),
        },
        {"rate": ("1/s", "time derivative of the state"), "current": ("A", "control currents of the axes")},
    ),
    "rhs": (
        "nonlinear equations of motion in real form",
        {
            **_P,
            "x": ("SI", "coordinates, their rates, controllers' states"),
            "speed": ("rad/s", "spin speed"),
            "acceleration": ("rad/s^2", "its rate"),
            "force": ("N", _BASIS),
        },
        {
            "rate": ("SI", "dx/dt"),
            "current": ("A", "control currents of the axes"),
            "displacement": ("m", "of the shaft at the magnets' axes"),
            "magnet_force": ("N", "on the shaft along the axes"),
        },
    ),
    "loads": (
        "forces of the disks' unbalances and of gravity, real form",
        {
            **_P,
            "angle": ("rad", "of the spin"),
            "speed": ("rad/s", "spin speed"),
            "acceleration": ("rad/s^2", "its rate"),
        },
        {"unbalance": ("N", _BASIS), "gravity": ("N", _BASIS)},
    ),
    "growth_rates": (
        "largest real parts of the eigenvalues, or the smoothed abscissa",
        _SPEEDS,
        {"values": ("1/s", "speed by speed, descending; negative where stable")},
    ),
    "damping_ratios": (
        "least damping ratios",
        _SPEEDS,
        {"values": ("", "speed by speed, ascending")},
    ),
    "sensitivity_peaks": (
        "highest peaks of the sensitivity of each control loop",
        _SPEEDS,
        {"values": ("", "speed by speed, loop by loop, descending")},
    ),
    "unbalance": (
        "what unbalances ask of the magnets",
        {**_P, "speed": ("rad/s", "spin speeds; of lists of peaks, ends of ranges that begin at rest")},
        {"values": ("SI", "speed by speed, pattern by pattern, magnet by magnet: at the speed, then peaks below it")},
    ),
    "stability_limit": (
        "speed up to which the machine is stable",
        _P,
        {"speed": ("rad/s", "zero if unstable at rest, the top speed if stable up to there, NaN if marginal")},
    ),
}


@dataclass(frozen=True)
class Port:
    """An input or output of a Function.

    Attributes
    ----------
    name : str
    shape : (int, int)
    unit, meaning : str
    """

    name: str
    shape: tuple[int, int]
    unit: str
    meaning: str


@dataclass(frozen=True)
class Described:
    """A Function in words.

    Attributes
    ----------
    name, meaning : str
    inputs, outputs : tuple of Port
    """

    name: str
    meaning: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]

    def __str__(self) -> str:
        lines = [f"{self.name}: {self.meaning}"]
        for title, ports in (("in ", self.inputs), ("out", self.outputs)):
            lines += [
                f"  {title} {q.name} {q.shape[0]} x {q.shape[1]}{f' [{q.unit}]' if q.unit else ''}: {q.meaning}"
                for q in ports
            ]
        return "\n".join(lines)


def described(name: str, function: Any) -> Described:
    """A Function in words.

    Parameters
    ----------
    name : str
        A key of `FUNCTIONS`.
    function : casadi.Function
    """
    meaning, inputs, outputs = FUNCTIONS[name]
    return Described(
        name,
        meaning,
        tuple(Port(n, tuple(function.size_in(n)), *inputs[n]) for n in function.name_in()),
        tuple(Port(n, tuple(function.size_out(n)), *outputs[n]) for n in function.name_out()),
    )


def names() -> str:
    """All Functions, for messages."""
    return ", ".join(FUNCTIONS)
