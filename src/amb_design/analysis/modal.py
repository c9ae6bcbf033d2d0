"""The closed loop at one speed as a sum over its modes, which makes any number of frequencies and instants cheap.

From disturbances d of the sensors and loads f on the shaft to displacements and currents y,

    E x' = (A0 + Omega A1) x + F d + G d' + f        y = C x

becomes y = sum of c_k (l_k F + s l_k G) d/(s - lambda_k), with the right and left vectors in the balanced coordinates of the
closed loop. Everything comes from the matrices of the loop alone, whatever the controller is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from ..model.loop import ports
from . import places
from .certificate import Walk
from .scan import distinct
from .system import Array, System, dense


@dataclass(frozen=True)
class Signals:
    """Where disturbances of the sensors enter the pencil, and what is looked at.

    Attributes
    ----------
    enter, rate : ndarray, shape (states, loops)
        Of disturbances added to the sensors [m], and of their rates.
    sensed : ndarray, shape (loops, states)
        Displacements at the sensors [m].
    currents : ndarray, shape (currents, states)
        Control currents [A].
    loops : tuple of str
        Names of the loops, each broken at its sensor; ideal state feedback has none.
    magnets : tuple of int
        Index of the magnet of each current.
    names : tuple of str
        Names of the currents.
    """

    enter: Array
    rate: Array
    sensed: Array
    currents: Array
    loops: tuple[str, ...]
    magnets: tuple[int, ...]
    names: tuple[str, ...]

    @classmethod
    def of(cls, loop: System) -> Signals:
        """Those of a numeric loop."""
        found = ports(loop.plant, loop.pencil)
        f, g, c = dense(found.F), dense(found.G), dense(found.C)
        loops, driven = loop.plant.loops, loop.plant.driven
        ends = np.cumsum([0, len(loops), len(driven)])
        return cls(
            f,
            g,
            c[: ends[1]],
            c[ends[1] : ends[2]],
            tuple(a.name for a in loops),
            tuple(a.magnet for a in driven),
            tuple(a.name for a in driven),
        )

    def require_loops(self, loop: System) -> None:
        """Raise a ModelError if there is no sensor at which a loop could be opened."""
        if not self.loops:
            raise ModelError(f"{loop.machine.name} has no control loop that passes a sensor")

    def axis_currents(self, loop: System, values: Array) -> tuple[Array, tuple[str, ...]]:
        """Currents of the physical axes as time histories, from those of the model's.

        Parameters
        ----------
        loop : System
        values : ndarray, shape (currents, ...)
            In the complex form i = i_y + i i_z in the plane of the machine.

        Returns
        -------
        ndarray, shape (axes, ...)
            Real.
        names : tuple of str
            ``magnets[0] y`` is the first axis of the magnet.
        """
        if not loop.complex_form:
            return np.asarray(values.real), self.names
        angles = [float(loop.machine.magnets[m].axes_angle) for m in self.magnets]
        turned = values * np.exp(-1j * np.array(angles)).reshape(-1, *[1] * (values.ndim - 1))
        both = np.stack([turned.real, turned.imag], axis=1)
        return both.reshape(-1, *values.shape[1:]), tuple(f"{n} {axis}" for n in self.names for axis in "yz")


class ModalLoop:
    """Modes of the closed loop at a speed, and how disturbances reach them.

    Parameters
    ----------
    loop : System
    speed : float
        Spin speed [rad/s].

    Attributes
    ----------
    values : ndarray, shape (n,)
        Eigenvalues [1/s].
    right : ndarray, shape (states, n)
        States of the pencil for unit modes.
    left : ndarray, shape (n, states)
        Modal loads of unit right-hand sides of the pencil.
    stable : bool
        True if every eigenvalue lies to the left of the axis beyond rounding.
    """

    def __init__(self, loop: System, speed: float):
        e = Walk(loop.A0, loop.A1).at(speed)
        self.loop, self.speed, self.values = loop, speed, e.values
        self.right = loop.to_state @ e.right
        self.left = e.left @ loop.from_rate
        self.stable = bool((e.values.real < -e.uncertainty).all())

    def require_stable(self) -> None:
        """Raise a ModelError if responses grow without end."""
        if not self.stable:
            raise ModelError(f"{self.loop.machine.name} is not stable at {self.speed * 30.0 / math.pi:.0f} rpm")

    def motion(self, position: float) -> Array:
        """Displacements at a place of the shaft for unit modes, as in `places.motion`."""
        return places.motion(self.loop, self.right[: self.loop.displacements], position)

    def load(self, forces: Array) -> Array:
        """Modal loads of a force over the free degrees of freedom."""
        n = self.loop.displacements
        return np.asarray(self.left[:, n : 2 * n] @ forces)


class LoopView:
    """Sensitivities of the physical axes at one speed as rational functions of the frequency.

    Parameters
    ----------
    modal : ModalLoop
    signals : Signals
    """

    def __init__(self, modal: ModalLoop, signals: Signals):
        self.modal, self.names = modal, signals.loops
        self._enter, self._rate = modal.left @ signals.enter, modal.left @ signals.rate
        self._leave = signals.sensed @ modal.right

    def sensitivity(self, frequencies: Array, loop: int) -> Array:
        """1/(1 + L) of a loop with all others closed.

        Parameters
        ----------
        frequencies : ndarray, shape (m,)
            Not negative [rad/s].
        loop : int

        Returns
        -------
        ndarray of complex, shape (m,)
            In the complex form the mean of that of +w and the conjugate of that of -w, as in `sensitivity.Axes`.
        """
        ahead = self._one(frequencies, loop)
        if not self.modal.loop.complex_form:
            return ahead
        return np.asarray((ahead + self._one(-frequencies, loop).conj()) / 2.0)

    def _one(self, frequencies: Array, loop: int) -> Array:
        s = 1j * frequencies[:, None]
        constant = self._leave[loop] * self._enter[:, loop]
        linear = self._leave[loop] * self._rate[:, loop]
        return np.asarray(1.0 + ((constant + s * linear) / (s - self.modal.values)).sum(axis=1))

    def grid(self) -> Array:
        """Frequencies that resolve every mode: many around each, in steps of its width, and a logarithmic net [rad/s]."""
        values = self.modal.values
        size, width = np.abs(values), np.maximum(np.abs(values.real), 1e-9 * np.abs(values))
        steps = np.concatenate([[0.0], np.geomspace(0.1, 30.0, 9)])
        around = (np.abs(values.imag)[:, None] + width[:, None] * np.concatenate([-steps, steps])).ravel()
        lowest, highest = 1e-3 * float(size[size > 0.0].min()), 3.0 * float(size.max())
        net = np.geomspace(lowest, highest, 400)
        return distinct(np.concatenate([net, around[(around > lowest) & (around < highest)]]))
