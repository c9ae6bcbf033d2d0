"""python-control: the machine and its parts as state-space systems and transfer functions with named signals."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array, System, dense, system
from ..errors import ModelError
from ..model.loop import Structure
from ..model.motion import controller, state_names
from ..model.parametric import parametric
from ..spec.controller import Chain, Matrices, StateSpace
from ..spec.machine import Machine
from ..synthesis.design import synthesise
from .late import package

PARTS = ("closed_loop", "plant", "controller")


def to_ss(machine: Machine, speed: float = 0.0, part: str = "closed_loop", modes: int | None = None) -> Any:
    """A machine at a spin speed as a python-control system, in real form.

    Parameters
    ----------
    machine : Machine
    speed : float
        [rad/s]
    part : {"closed_loop", "plant", "controller"}
        The plant is the rotor on its bearings and on magnets with bias: from control currents [A] to displacements at the sensors
        [m]. The closed loop has the same inputs, which add to the currents of its controllers. The controller leads from displacements
        (and velocities, where a law without low-pass differentiates) to currents, the sign of the feedback included.
    modes : int, optional
        Lowest modes at rest that are kept, in each plane; all if left out.

    Returns
    -------
    control.StateSpace
        With names such as ``current magnets[0] y``, ``displacement magnets[0] y``, ``mode 3 rate``.

    Raises
    ------
    ModelError
        If there is no such part.
    SolveError
        If python-control is not installed.
    """
    control = package("control", "control")
    if part not in PARTS:
        raise ModelError(f"there is no part {part!r}; choose one of {', '.join(PARTS)}")
    machine = synthesise(machine)
    if part == "controller":
        matrices, states, inputs, outputs = _controller(machine, speed)
    else:
        bare = machine.without_controllers() if part == "plant" else machine
        loop = system(bare, complex_form=False)
        if modes is not None:
            loop = loop.truncated(min(2 * modes, loop.displacements))
        matrices, states = _rotor(loop, speed), [*_modes(loop), *_law_states(loop.plant)]
        names = [a.name for a in loop.plant.axes]
        inputs, outputs = [f"current {n}" for n in names], [f"displacement {n}" for n in names]
    if not inputs:
        raise ModelError(f"{machine.name} has no magnet, and so neither inputs nor outputs")
    return control.ss(*matrices, inputs=_legal(inputs), outputs=_legal(outputs), states=_legal(states), name=part)


def to_tf(
    machine: Machine, output: str, input: str, speed: float = 0.0, part: str = "closed_loop", modes: int = 6
) -> Any:
    """One transfer function of a machine at a spin speed.

    Parameters
    ----------
    machine : Machine
    output, input : str
        Signals as `to_ss` names them.
    speed, part
        As in `to_ss`.
    modes : int
        Lowest modes that are kept, in each plane. Polynomials of many modes lose their digits: keep few, or stay with `to_ss`.

    Returns
    -------
    control.TransferFunction
    """
    control = package("control", "control")
    whole = to_ss(machine, speed, part, modes)
    for name, known in ((output, whole.output_labels), (input, whole.input_labels)):
        if name not in known:
            raise ModelError(f"there is no signal {name!r}; choose one of {', '.join(known)}")
    single = whole[whole.output_labels.index(output), whole.input_labels.index(input)]
    zeros, poles = np.asarray(single.zeros()), np.asarray(single.poles())
    at = 1j * (1.0 + max(1.0, float(np.median(np.abs(poles)))))
    unit = np.exp(np.sum(np.log(at - zeros)) - np.sum(np.log(at - poles)))
    gain = float((complex(np.squeeze(single(at))) / unit).real)
    return control.tf(gain * np.poly(zeros).real, np.poly(poles).real, inputs=[input], outputs=[output])


def from_ss(system: Any, hardware_of: Chain | None = None) -> StateSpace:
    """A controller from a linear system of python-control, whoever designed it.

    Parameters
    ----------
    system : control.StateSpace or control.TransferFunction
        Continuous, from displacements at the sensors [m] to control currents [A] with the sign of the feedback included, i = K y, as `to_ss`
        gives the controller. One input serves each axis by itself, one for each magnet y and z alike, two for each magnet
        are its first and second axis.
    hardware_of : Controller, optional
        Whose sensors, low-pass, delay and amplifier stand around it; it then leads from what the sensors send to what the amplifiers are told.

    Returns
    -------
    StateSpace

    Raises
    ------
    ModelError
        If it is sampled or sees velocities; or a transfer function that is improper, has poles that its zeros cancel, or several
        inputs or outputs.
    SpecError
        If it has not as many inputs as outputs.
    SolveError
        If python-control is not installed.
    """
    found = _state_space(system)
    if found.dt not in (0, None):
        raise ModelError(f"the controller is sampled every {found.dt:g} s; give a continuous one")
    seen = [name for name in found.input_labels if name.startswith("velocity ")]
    if seen:
        raise ModelError(
            f"the controller sees {seen[0]!r}, which no sensor reports; give it a low-pass or a filtered derivative"
        )
    law = Matrices(a=found.A, b=found.B, c=-found.C, d=-found.D)
    return StateSpace(law=law) if hardware_of is None else StateSpace.with_hardware_of(hardware_of, law=law)


def _state_space(system: Any) -> Any:
    """A system as python-control's state space; transfer functions as few states as they need, or not at all."""
    control = package("control", "control")
    if isinstance(system, control.TransferFunction):
        shape = (system.noutputs, system.ninputs)
        if shape != (1, 1):
            raise ModelError(
                f"the transfer function has {shape[0]} outputs and {shape[1]} inputs; give one of a single axis, or a state space"
            )
        above, below = (len(np.trim_zeros(np.ravel(p[0][0]), "f")) - 1 for p in (system.num, system.den))
        if above > below:
            raise ModelError(
                f"the transfer function is improper: degree {above} over degree {below}; add poles beyond the frequencies that matter"
            )
        cancelled = below - len(control.minreal(system, verbose=False).poles())
        if cancelled > 0:
            raise ModelError(
                f"zeros of the transfer function cancel {cancelled} of its {below} poles; give control.minreal of it"
            )
    return control.ss(system)


def _rotor(loop: System, speed: float) -> tuple[Array, Array, Array, Array]:
    inputs = loop.from_rate @ dense(loop.pencil.B)
    outputs = dense(loop.pencil.C) @ loop.to_state
    return loop.matrix(speed), inputs, outputs, np.zeros((len(outputs), inputs.shape[1]))


def _modes(loop: System) -> list[str]:
    return [f"mode {k} {what}" for what in ("place", "rate") for k in range(loop.kept)]


def _law_states(plant: Structure) -> list[str]:
    """Numbered, for python-control wants them all different."""
    return [f"{name} {k}" for k, name in enumerate(state_names(plant))]


def _controller(machine: Machine, speed: float) -> tuple[tuple[Array, ...], list[str], list[str], list[str]]:
    loop = parametric(machine, complex_form=False)
    a, b, c, d = controller_matrices(loop, speed)
    axes = [x.name for x in loop.plant.axes]
    inputs = [f"displacement {n}" for n in axes] + [f"velocity {n}" for n in axes]
    if not (b[:, len(axes) :].any() or d[:, len(axes) :].any()):
        b, d, inputs = b[:, : len(axes)], d[:, : len(axes)], inputs[: len(axes)]
    return (a, b, c, d), _law_states(loop.plant), inputs, [f"current {n}" for n in axes]


def controller_matrices(loop: Any, speed: float) -> tuple[Array, Array, Array, Array]:
    """Matrices of all controllers at a speed: from displacements and velocities at the sensors to currents.

    Parameters
    ----------
    loop : Parametric
        In real form, without parameters.
    speed : float
        [rad/s]
    """
    law = controller(loop)
    n, axes = law.size1_in("state"), law.size1_out("current")
    x, seen = ca.SX.sym("x", n), ca.SX.sym("seen", 2 * axes)
    rate, current = law(ca.SX(0, 1), speed, x, seen[:axes], seen[axes:])
    parts = [ca.jacobian(out, by) for out in (rate, current) for by in (x, seen)]
    a, b, c, d = (np.asarray(ca.DM(ca.evalf(m)).full()) for m in parts)
    return a, b, c, d


def _legal(names: list[str]) -> list[str]:
    """python-control keeps dots for the names of systems."""
    return [name.replace(".", "_") for name in names]
