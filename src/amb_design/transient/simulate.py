"""Simulate a machine in time."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ..analysis.system import Array
from ..errors import ModelError, SolveError, SpecError
from ..spec.fields import is_symbolic
from ..spec.machine import Machine
from ..spec.paths import numbers
from ..spec.sampling import Sampling
from ..threads import one_thread
from .actuator import Actuator
from .closed_form import ClosedForm
from .collocation import Collocation
from .equations import Equations
from .evaluation import evaluated
from .history import Chunks
from .idas import Idas
from .loads import Contact, Disturbance, Force, Spin
from .plant import plant_of
from .result import Transient
from .run import Progress, Run, travel
from .sampled import Sampler
from .schedule import Schedule
from .split import Split
from .start import continuous, initial
from .state import State
from .stepper import Stepper

INTEGRATORS: dict[str, Callable[[Split, Schedule, float], Stepper]] = {"collocation": Collocation, "idas": Idas}

COARSEST = 2e-4
"""Between outputs [s], at most: five for each period of 1 kHz."""

Speed = float | tuple[Sequence[float], Sequence[float]]


@one_thread
def simulate(
    machine: Machine,
    duration: float,
    *,
    speed: Speed,
    modes: int | None = None,
    step: float | None = None,
    start: str | State = "centred",
    gravity: bool = True,
    linear: bool = False,
    contact: Contact | bool = False,
    disturbances: Sequence[Disturbance] = (),
    sampling: Sampling | None = None,
    tolerance: float = 1e-5,
    integrator: str = "collocation",
    chunk: int | None = None,
    path: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> Transient:
    """Motion of the rotor in time, with nonlinear magnets and the limits of their currents, voltages and fluxes.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    duration : float
        [s]
    speed : float, or pair of sequences (times, speeds)
        Spin speed [rad/s]; a table is linear in between and must cover the run.
    modes : int, optional
        Keep the lowest modes of the rotor at rest on its passive bearings (a free rotor's first four are rigid), with static
        correction at magnets, bearings and forces. All modes if left out, which costs little unless the speed varies.
    step : float, optional
        Between outputs [s], shortened to divide the duration; if left out 0.2 ms or, if that is less, 1/40 of the shortest
        turn or 1/200 of the duration; for sampled controllers the next number of samples, or part of one.
    start : {"centred", "resting", "levitated"} or State
        At rest in the centre; at rest on the backup bearings under gravity, controllers and bias switched on at once;
        levitated in static equilibrium; or ``previous.final``, whose time the run continues.
    gravity : bool
        Along -y, of the size that the machine states.
    linear : bool
        Magnets pull with k_i i + k_s y and have no limits. At constant speed the motion is then known in closed form.
    contact : Contact or bool
        Backup bearings at the magnets with a clearance; True for those with default properties.
    disturbances : sequence of Force, Impulse, Shaking, BaseMotion
    sampling : Sampling, optional
        Controllers work at discrete times.
    tolerance : float
        Relative, and of displacements of 10 um, for each step of the integrator.
    integrator : {"collocation", "idas"}
        How the motion is found, but for linear magnets at constant speed, where it is known in closed form: by collocation, in which
        all that is linear is exact, or by IDAS of SUNDIALS, for comparison.
    chunk : int, optional
        Number of outputs between two integrator starts; if left out 1/50 of all, at least 50 and at most 1000,
        or 5000 in closed form.
    path : path, optional
        Folder for finished chunks.
    resume : bool
        Go on after the last finished chunk in that folder.
    progress : callable, optional
        Gets the fraction that is done after each chunk.

    Returns
    -------
    Transient
        If the rotor leaves the air gap (or, without one, the clearance) of a magnet, the motion up to then, and `stopped`
        says when.

    Raises
    ------
    SpecError
        If duration, step, speed profile, tolerance or contact are not possible.
    ModelError
        If the state belongs to another machine, the folder to another run, or there is no such start or integrator.
    SolveError
        If there is no equilibrium to start from, or the integrator gives up: its attribute `result` then holds the
        finished chunks.

    References
    ----------
    Schweitzer & Maslen, Magnetic Bearings (2009); Genta, Dynamics of Rotating Systems (2005).
    """
    given = {"duration": duration, "tolerance": tolerance, "step": step, "chunk": chunk}
    _check_numbers(machine, **{name: value for name, value in given.items() if value is not None})
    origin = start.time if isinstance(start, State) else 0.0
    spin = Spin.of(speed, origin, origin + duration)
    backup = _backup(machine, contact, linear)
    equations = _equations(machine, modes, tuple(disturbances), backup, linear, sampling, gravity)
    turned, first, _ = spin.at(origin)
    state = start if isinstance(start, State) else _state(equations, start, first)
    _check_state(equations, state)
    schedule = Schedule(spin, state.angle - turned, tuple(disturbances))
    split = Split(equations, varying=not spin.constant)
    stepper = _stepper(split, schedule, tolerance, integrator, linear)
    sampler = None if sampling is None else Sampler(equations, sampling, spin, state.law, state.held, state.pending)
    times = origin + _outputs(duration, step, spin.fastest, sampling)
    chunk = chunk or (5000 if isinstance(stepper, ClosedForm) else min(max(len(times) // 50, 50), 1000))
    options = (
        duration,
        spin,
        modes,
        len(times),
        gravity,
        linear,
        backup,
        disturbances,
        sampling,
        tolerance,
        integrator,
        chunk,
    )
    begin = {k: v.tolist() for k, v in state.arrays().items()}
    chunks = Chunks(None if path is None else Path(path), repr((machine, options, begin)))
    try:
        history, final, stopped = travel(
            Run(equations, schedule, stepper, state, sampler), times, chunk, chunks, resume, progress
        )
    except SolveError as error:
        if hasattr(error, "history"):
            error.result = evaluated(split, schedule, error.history, error.state, str(error))  # type: ignore[attr-defined]
        raise
    return evaluated(split, schedule, history, final, stopped)


def _check_numbers(machine: Machine, **positive: float) -> None:
    for name, value in positive.items():
        if not (math.isfinite(value) and value > 0.0):
            raise SpecError("must be positive and finite", field=name, got=value, remedy="give a number above zero")
    symbolic = next((path for path, found in numbers(machine) if is_symbolic(found)), None)
    if symbolic is not None:
        raise ModelError(f"{symbolic} is a symbol; a simulation needs numbers")


def _backup(machine: Machine, contact: Contact | bool, linear: bool) -> Contact | None:
    if not contact:
        return None
    if linear:
        raise SpecError("does not go with contact", field="linear", got=True, remedy="leave one of the two out")
    if not machine.magnets:
        raise SpecError("needs magnets with a clearance", field="contact", got=True, remedy="leave it out")
    for i, magnet in enumerate(machine.magnets):
        if magnet.clearance is None:
            raise SpecError(
                "is missing, but contact is asked for",
                field=f"magnets[{i}].clearance",
                remedy="give it, or contact=False",
            )
    return Contact() if contact is True else contact


def _equations(
    machine: Machine,
    modes: int | None,
    disturbances: tuple[Disturbance, ...],
    contact: Contact | None,
    linear: bool,
    sampling: Sampling | None,
    gravity: bool,
) -> Equations:
    plant = plant_of(machine, modes, disturbances, sampling is not None)
    return Equations(
        plant=plant,
        actuators=tuple(
            Actuator.of(axis, amplifier, machine.magnets[axis.magnet], linear)
            for axis, amplifier in zip(plant.axes, plant.amplifiers, strict=True)
        ),
        forces=tuple(d for d in disturbances if isinstance(d, Force)),
        contact=contact,
        sampled=sampling is not None,
        gravity=float(machine.operation.gravity) if gravity else 0.0,
    )


def _stepper(split: Split, schedule: Schedule, tolerance: float, integrator: str, linear: bool) -> Stepper:
    if integrator not in INTEGRATORS:
        raise ModelError(f"there is no integrator {integrator!r}; choose one of {', '.join(INTEGRATORS)}")
    if linear and schedule.spin.constant and not split.equations.sampled:
        return ClosedForm(split, schedule, schedule.spin.speeds[0])
    return INTEGRATORS[integrator](split, schedule, tolerance)


def _state(e: Equations, name: str, speed: float) -> State:
    xi, inner = initial(continuous(e), name, speed)
    law, held = inner[: e.plant.law.states], np.zeros(len(e.actuators) if e.sampled else 0)
    if e.sampled and name == "levitated":
        _, _, c, d = e.plant.law.at(speed)
        held = c @ law + d @ e.plant.law.seen(xi, np.zeros(len(xi)))
    q, none = e.plant.basis @ xi, np.zeros((0, 1 + len(e.actuators)))
    return State(0.0, 0.0, q, np.zeros(len(q)), law, inner[len(law) :], held, none)


def _check_state(e: Equations, state: State) -> None:
    wanted = e.plant.law.states, e.amplifiers, len(e.actuators) if e.sampled else 0
    if (len(state.law), len(state.amplifiers), len(state.held)) != wanted:
        raise ModelError("the saved state belongs to other controllers; restart with those that it was saved from")


def _outputs(duration: float, step: float | None, fastest: float, sampling: Sampling | None) -> Array:
    """Times of the outputs, from zero."""
    if step is None:
        turn = 2.0 * math.pi / fastest if fastest else math.inf
        step = min(duration / 200.0, COARSEST, turn / 40.0)
        period = None if sampling is None else float(sampling.period)
        if period is not None and period < duration:  # few lengths of step: each needs its matrices
            step = period * round(step / period) if step > period else period / math.ceil(period / step)
            return np.append(np.arange(0.0, duration - 1e-9 * step, step), duration)
    count = max(1, math.ceil(duration / step * (1.0 - 1e-9)))
    return np.linspace(0.0, duration, count + 1)
