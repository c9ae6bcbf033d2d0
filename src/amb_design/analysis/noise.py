"""Control currents that the noise of the sensors makes, from the Lyapunov equation of the closed loop.

Noise n of the sensors enters as E x' = A x + F n + G n'. With white noise of the one-sided density N [m/sqrt(Hz)] at every
sensor, P = (N^2/2) times the solution of A P + P A^H + (F + A G)(F + A G)^H = 0 is the covariance of x - G n. In modal
coordinates it is an elementwise division. In the complex form the noises in y and z are independent, the complex one is
circular, and half of its variance belongs to each axis.

Where the noise reaches a current unfiltered, as through an ideal derivative with neither low-pass nor amplifier behind it, its
variance is infinite, and so is the result.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..errors import SpecError
from ..spec.machine import Machine
from .modal import ModalLoop, Signals
from .system import Array, System, dense, system
from .threads import one_thread


@dataclass(frozen=True)
class NoiseCurrents:
    """Result of `noise_currents`.

    Attributes
    ----------
    speed : float
        Spin speed [rad/s].
    density : float
        Of the noise of every sensor [m/sqrt(Hz)], one-sided.
    names : tuple of str
        Of the currents: ``"magnets[0] y"``; in the complex form both axes are alike.
    currents : ndarray
        Root mean square of each physical axis [A]; infinite where the noise is not filtered.
    machine : Machine
    """

    speed: float
    density: float
    names: tuple[str, ...]
    currents: Array
    machine: Machine = field(repr=False)

    @property
    def worst(self) -> float:
        """The largest of them [A]."""
        return float(self.currents.max())


@one_thread
def noise_currents(machine: Machine | System, density: float, speed: float = 0.0) -> NoiseCurrents:
    """Root mean square of the control currents under white noise of the sensors.

    Parameters
    ----------
    machine : Machine or System
    density : float
        One-sided amplitude density at every sensor and axis [m/sqrt(Hz)], all independent: a band of 1 Hz has the variance
        density squared.
    speed : float
        Spin speed [rad/s].

    Returns
    -------
    NoiseCurrents

    Raises
    ------
    SpecError
        If the density is not positive and finite.
    ModelError
        If the machine has no control loop or is not stable at this speed.
    """
    if not 0.0 < density < math.inf:
        raise SpecError("must be positive", field="density", got=density, remedy="give m/sqrt(Hz), such as 1e-8")
    loop = machine if isinstance(machine, System) else system(machine)
    signals = Signals.of(loop)
    signals.require_loops(loop)
    modal = ModalLoop(loop, speed)
    modal.require_stable()
    enter = modal.left @ signals.enter + modal.values[:, None] * (modal.left @ signals.rate)
    sums = modal.values[:, None] + modal.values.conj()
    leave = signals.currents @ modal.right
    covariance = leave @ (-(enter @ enter.conj().T) / sums) @ leave.conj().T
    power = density**2 / 2.0 * np.diagonal(covariance).real
    # Of complex noise n_y + i n_z twice the intensity enters, and half of the variance is that of one axis.
    variance = np.where(_unfiltered(loop, signals), np.inf, np.maximum(power, 0.0))
    return NoiseCurrents(speed, density, signals.names, np.sqrt(variance), loop.machine)


def _unfiltered(loop: System, signals: Signals) -> Array:
    """Which currents hold white noise: those that a sensor's noise, or its rate, moves at once."""
    n = loop.displacements
    push = dense(loop.pencil.B)[n : 2 * n]
    jumps = _rows(signals.currents @ np.linalg.solve(dense(loop.pencil.E), signals.rate))
    forces = np.hstack([signals.enter[n : 2 * n], signals.rate[n : 2 * n]])
    moved = _rows(np.linalg.lstsq(push, forces, rcond=None)[0])
    axes = [a.name for a in loop.plant.axes]
    return np.asarray(jumps | moved[[axes.index(name) for name in signals.names]])


def _rows(matrix: Array) -> Array:
    """Which rows are not zero, beyond rounding."""
    size = np.abs(matrix)
    return np.asarray((size > 1e-12 * size.max(initial=0.0)).any(axis=1))
