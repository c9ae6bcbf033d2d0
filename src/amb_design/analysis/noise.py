"""Control current from the noise of the displacement sensors.

White noise of the one-sided amplitude spectral density n at each sensor, independent from loop to loop and from axis to axis,
makes currents of the variance n^2 times the integral of abs(H)^2 over the frequencies in Hz above zero, summed over the sensors:
H leads from a disturbance of a sensor to the current. The closed loop is dx/dt = A x + F u + G du/dt with i = C x; in
x - G u it has no derivative of the noise any more,

    A P + P A^H + B B^H = 0        B = F + A G        variance = n^2/2 diag(C P C^H)

In the complex form u and i hold two axes each, alike and independent: the same formula gives the variance of one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as sla

from ..errors import ModelError
from ..model.loop import ports
from ..spec.machine import Machine
from ..threads import one_thread
from .certificate import Walk
from .system import Array, System, dense, system


@one_thread
def noise_current(machine: Machine | System, noise: float, speed: float = 0.0) -> Array:
    """Control current that white noise of the displacement sensors causes at one spin speed.

    Parameters
    ----------
    machine : Machine or System
    noise : float
        One-sided amplitude spectral density of each sensor [m/sqrt(Hz)].
    speed : float
        Spin speed [rad/s].

    Returns
    -------
    ndarray, shape (loops,)
        Rms current of a physical axis of each control loop [A]; infinite where the closed loop is not stable.

    Raises
    ------
    ModelError
        If the machine has no control loop, or one that passes on noise of any frequency.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    names = [a.name for a in loop.plant.loops]
    count, ends = len(names), ports(loop.plant, loop.pencil)
    f, g, c = dense(ends.F), dense(ends.G), dense(ends.C)[count : 2 * count]
    check_filtered(c, g, loop.displacements, names)
    e = Walk(loop.A0, loop.A1).at(speed)
    if (e.values.real > -e.uncertainty).any():
        return np.full(count, np.inf)
    f, g = loop.from_rate @ f, loop.from_rate @ g
    b = f + e.matrix @ g
    c = c @ loop.to_state
    covariance = sla.solve_continuous_lyapunov(e.matrix, -b @ b.conj().T)
    variance = np.einsum("ij,jk,ik->i", c, covariance, c.conj()).real / 2.0
    return np.asarray(noise * np.sqrt(np.maximum(variance, 0.0)))


def check_filtered(currents: Array, rates: Array, displacements: int, names: Sequence[str]) -> None:
    """Refuse machines without loops, and loops in which white noise makes an infinite current.

    Parameters
    ----------
    currents : ndarray, shape (loops, states)
        Control currents of states q, dq/dt, controllers: rows of C.
    rates : ndarray, shape (states, loops)
        Of the rates of disturbances at the sensors: G.
    displacements : int
        Length of q.
    names : sequence of str
        Of the loops.

    Raises
    ------
    ModelError
    """
    if not names:
        raise ModelError("there is no control loop with a sensor, and so no noise in it")
    n = 2 * displacements
    direct = currents[:, :n].any(axis=1) | (currents[:, n:] @ rates[n:]).any(axis=1)
    if direct.any():
        raise ModelError(
            f"white noise of the sensors makes an infinite control current at {names[int(np.argmax(direct))]}, for nothing "
            "filters it; give the controller a low_pass or an amplifier"
        )
