"""The equivalent-coefficient method, for comparison only.

It replaces each magnet loop by a stiffness k_eq = -k_s + k_i Re G(i Omega) and a damping c_eq = k_i Im G(i Omega)/Omega, taken
at the spin speed. That is right for the synchronous response of a stable loop and wrong for stability: at the threshold the
rotor whirls near a natural frequency, whatever the speed; an unstable controller mode stays invisible; and with
Kd < Ki/w^2 it invents an instability at low speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..errors import ModelError
from ..model.loop import structure
from ..model.magnet import negative_stiffness
from ..spec.machine import Machine
from ..synthesis.design import synthesise
from ..threads import one_thread
from .frequency import Loops
from .modes import whirls
from .system import Array, System, system


@dataclass(frozen=True)
class Equivalent:
    """Result of `equivalent_coefficients`.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        Spin speeds [rad/s].
    stiffness, damping : ndarray, shape (m, axes)
        k_eq [N/m] and c_eq [N s/m] of each loop.
    largest_real_part : ndarray, shape (m,)
        What the method takes for the stability of the machine [1/s].
    changes : tuple of (float, bool)
        Speeds [rad/s] at which the method's machine becomes unstable (True) or stable again (False).
    critical_speed : float
        First forward critical speed of the method's machine [rad/s]; NaN if there is none below the last speed.
    machine : Machine
    """

    speeds: Array
    stiffness: Array
    damping: Array
    largest_real_part: Array
    changes: tuple[tuple[float, bool], ...]
    critical_speed: float
    machine: Machine = field(repr=False)

    @property
    def stability_limit(self) -> float:
        """First onset [rad/s]; NaN if the method finds none."""
        return next((s for s, unstable in self.changes if unstable), math.nan)


@one_thread
def equivalent_coefficients(machine: Machine, top_speed: float | None = None, points: int = 100) -> Equivalent:
    """What the equivalent-coefficient method says of a machine.

    Parameters
    ----------
    machine : Machine
        Isotropic, with control loops.
    top_speed : float, optional
        Last speed [rad/s]; the machine's top speed if left out.
    points : int
        Speeds of the sweep; the changes are then refined by bisection.

    Returns
    -------
    Equivalent

    Raises
    ------
    ModelError
        If the machine has no control loop, is anisotropic, or senses away from its magnets.
    """
    loops = Loops(structure(synthesise(machine)))
    if not loops.axes:
        raise ModelError(f"{machine.name} has no control loop to replace by equivalent coefficients")
    if not loops.plant.complex_form:
        raise ModelError(
            f"{machine.name} is anisotropic; equivalent coefficients are implemented for isotropic machines"
        )
    if any(machine.sensor_position(m) != m.position for m in machine.magnets):
        raise ModelError(
            f"{machine.name} senses away from its magnets; equivalent coefficients need collocated sensors"
        )
    if any(len(block.axes) > 1 or block.ideal or block.law.crosses for block in loops.plant.blocks):
        raise ModelError(
            f"{machine.name} has a controller that couples axes, which no stiffness and damping of a magnet can stand for"
        )
    model = _Model(loops, system(machine.without_controllers()))
    top = machine.operation.top_speed if top_speed is None else top_speed
    grid = np.linspace(top / points, top, points)
    real_parts, leads = zip(*(model.at(float(s)) for s in grid), strict=True)
    changes = []
    for a, b, ra, rb in zip(grid, grid[1:], real_parts, real_parts[1:], strict=False):
        if (ra > 0.0) != (rb > 0.0):
            changes.append((_root(lambda s: model.at(s)[0], float(a), float(b)), rb > 0.0))
    critical = math.nan
    for a, b, la, lb in zip(grid, grid[1:], leads, leads[1:], strict=False):
        if la > 0.0 >= lb:
            critical = _root(lambda s: model.at(s)[1], float(a), float(b))
            break
    coefficients = np.array([model.added(float(s)) for s in grid])
    outward = [float(negative_stiffness(machine.magnets[a.magnet])) for a in loops.axes]
    return Equivalent(
        speeds=grid,
        stiffness=coefficients[:, 0] - outward,
        damping=coefficients[:, 1],
        largest_real_part=np.array(real_parts),
        changes=tuple(changes),
        critical_speed=critical,
        machine=machine,
    )


class _Model:
    """Open loop plus the equivalent coefficients of each speed."""

    def __init__(self, loops: Loops, open_loop: System):
        self.loops, self.open = loops, open_loop
        n = open_loop.displacements
        self.rows = open_loop.to_state[:n].T @ loops.sense  # displacements at the magnets
        self.rates = open_loop.to_state[n : 2 * n].T @ loops.sense
        self.columns = open_loop.from_rate[:, n : 2 * n] @ loops.sense  # unit force at the magnets
        self.gains = np.array([float(a.current_stiffness) for a in loops.axes])

    def added(self, speed: float) -> tuple[Array, Array]:
        """k_i Re G [N/m] and k_i Im G/Omega [N s/m] of each axis."""
        force = self.gains * np.diagonal(self.loops.controller(speed, speed))
        return force.real, force.imag / speed

    def at(self, speed: float) -> tuple[float, float]:
        """Largest real part over the whirling modes, and lead of the lowest forward whirl frequency over the speed."""
        k, c = self.added(speed)
        matrix = self.open.matrix(speed) - self.columns @ (k[:, None] * self.rows.T + c[:, None] * self.rates.T)
        values = np.linalg.eigvals(matrix)
        whirling = values[whirls(values)]
        forward = whirling[(whirling.imag > 0.0) & (np.abs(whirling.real) < 0.5 * whirling.imag)]
        return float(whirling.real.max()), float(forward.imag.min() - speed)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Bisection on the sign of a function that may jump."""
    sign = function(low) > 0.0
    while high - low > 1e-7 * high:
        middle = (low + high) / 2.0
        low, high = (middle, high) if (function(middle) > 0.0) == sign else (low, middle)
    return (low + high) / 2.0
