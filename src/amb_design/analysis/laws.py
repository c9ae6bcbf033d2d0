"""What a law does beyond its design: its own poles, and modes that it does not know."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..spec.controller import LQG, LQR
from ..synthesis.reduction import basis_of
from ..units import in_words
from .certificate import Walk
from .modes import Mode, mode
from .stability import FOUND, NONE, StabilityLimit
from .system import Array, System, dense, system

GROWTH = 1e-2
"""Growth [1/s] below which a pole of a law counts as an integrator."""

NAMED = 3
"""Most poles that a warning names."""


def unstable_poles(loop: System, speed: float) -> Array:
    """Poles with positive real part of the controllers by themselves, hardware included.

    Parameters
    ----------
    loop : System
    speed : float
        Spin speed [rad/s].

    Returns
    -------
    ndarray of complex [1/s]
        The worst first.
    """
    matrices = [dense(block.law.a.constant) + speed * dense(block.law.a.rate) for block in loop.plant.blocks]
    poles = np.concatenate([np.zeros(0, complex), *[np.linalg.eigvals(a) for a in matrices if len(a)]])
    poles = poles[poles.real > GROWTH]
    return np.asarray(poles[np.argsort(-poles.real)])


@dataclass(frozen=True)
class Spillover:
    """A mode that is unstable at a speed for which its law was designed.

    Attributes
    ----------
    mode : Mode
    unknown : float
        Part of its kinetic energy that is in modes which the law does not know.
    """

    mode: Mode
    unknown: float


def spillover(loop: System) -> Spillover | None:
    """The worst instability at a speed for which a law was designed.

    With the modes that it knows the law is stable there; what is unstable owes it to those that it leaves out.

    Parameters
    ----------
    loop : System

    Returns
    -------
    Spillover or None
        None if the loop is stable at these speeds, or its law is not given by weights.
    """
    law = loop.machine.controller
    if not isinstance(law, LQG | LQR):
        return None
    loop, worst = system(loop.machine), None  # in the form that the law has
    for speed in dict.fromkeys((float(law.design_speed), 0.0)[: 1 + law.scheduled]):
        e = Walk(loop.A0, loop.A1).at(speed)
        k = int(np.argmax(e.values.real - e.uncertainty))
        if e.values[k].real > e.uncertainty[k] and (worst is None or e.values[k].real > worst.eigenvalue.real):
            worst = mode(loop, e, k)
    return None if worst is None else Spillover(worst, unknown_part(loop, worst))


def unknown_part(loop: System, mode: Mode) -> float:
    """Part of a mode's kinetic energy that is in modes of the rotor which its law does not know.

    Parameters
    ----------
    loop : System
        With an LQG or LQR, in the form that the machine has by itself.
    mode : Mode
        Of this loop.
    """
    law = loop.machine.controller
    assert isinstance(law, LQG | LQR)
    q, shapes = mode.right[: loop.displacements], basis_of(loop.machine, law.modes).shapes
    moved = loop.mass @ q
    return float(1.0 - np.linalg.norm(shapes.T @ moved) ** 2 / (q.conj() @ moved).real)


def about_poles(loop: System, limit: StabilityLimit) -> Iterator[str]:
    """What to say of controllers that are unstable by themselves, at rest or at the end of the stable speeds.

    Parameters
    ----------
    loop : System
    limit : StabilityLimit
    """
    end = limit.speed if limit.status in (FOUND, NONE) else 0.0
    for speed in dict.fromkeys((0.0, end)):
        poles = unstable_poles(loop, speed)
        if len(poles):
            more = f" and {len(poles) - NAMED} more" if len(poles) > NAMED else ""
            yield (
                f"The controller by itself is unstable {_at(speed)}, its poles grow with {', '.join(map(_pole, poles[:NAMED]))}{more}: "
                "it works in the closed loop only, and runs away where a sensor fails or currents saturate."
            )
            return


def about_unknown_modes(loop: System, limit: StabilityLimit) -> Iterator[str]:
    """What to say of modes that a law does not know and the loop makes unstable.

    Parameters
    ----------
    loop : System
    limit : StabilityLimit
    """
    law, found = loop.machine.controller, spillover(loop)
    if not isinstance(law, LQG | LQR):
        return
    if found is not None:
        m, part = found.mode, found.unknown
        order = law.order if isinstance(law, LQG) else None
        known = "these modes alone are" if order is None else "what it keeps is"
        why, remedy = f": {_percent(part)} of its energy is in modes that the law does not know", "modes"
        if order is not None and part < 0.5:
            why, remedy = "", "order"
        yield (
            f"Designed with {law.modes} modes{'' if order is None else f' and truncated to {order} states'}, the law makes the {m.describe()} "
            f"unstable {_at(m.speed)} ({m.eigenvalue.real:+.3g} 1/s), where {known} stable{why}. "
            f"Raise controller.{remedy}, or let the law act more slowly."
        )
    elif limit.status == FOUND and limit.mode is not None and loop.complex_form == system(loop.machine).complex_form:
        part = unknown_part(loop, limit.mode)
        if part > 0.5:
            yield (
                f"The {limit.mode.describe()} that limits the speed is one that the law does not know: {_percent(part)} of its energy is "
                f"in modes beyond the {law.modes} of controller.modes."
            )


def _at(speed: float) -> str:
    return f"at {in_words(speed, 'rad/s', speed=True)}" if speed else "at rest"


def _pole(value: complex) -> str:
    oscillates = abs(value.imag) > 1.0
    return f"{value.real:.3g} 1/s" + (f" at {in_words(abs(value.imag), 'rad/s')}" if oscillates else "")


def _percent(part: float) -> str:
    return f"{100.0 * part:.2g} %"
