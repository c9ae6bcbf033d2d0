"""Loops with a digital controller: exact eigenvalues over one sampling period.

Rotor and amplifiers move continuously under commands that are held; filters and law work at the samples. From just before one sample
to just before the next the state of both, with the commands still on their way, is multiplied by one matrix, the monodromy
matrix. The loop is stable at a speed exactly if all eigenvalues of it, the multipliers, are smaller than one. Nothing is approximated but what
the digital controller itself approximates.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import scipy.linalg as sla

from ..errors import ModelError
from ..model.controller import hardware
from ..model.pair import Affine
from ..spec.controller import Chain, Controller, serves_all
from ..spec.machine import Machine
from ..spec.sampling import Sampling
from ..synthesis.design import synthesise
from .system import Array, dense, system

INSTANT = 1e-9
"""Times closer than this fraction of the period are one."""


def with_chains(machine: Machine, **changes: object) -> Machine:
    """The machine with fields of all its controllers changed.

    Parameters
    ----------
    machine : Machine
    **changes
        Fields of `Chain`: ``delay=0.0`` where sampling takes the place of the delay.
    """

    def changed(law: Controller | None) -> Controller | None:
        return replace(law, **changes) if isinstance(law, Chain) else law  # type: ignore[arg-type]

    magnets = tuple(
        replace(m, controller=changed(m.controller), controller_z=changed(m.controller_z)) for m in machine.magnets
    )
    return replace(
        machine, magnets=magnets, controller=changed(machine.controller), controller_z=changed(machine.controller_z)
    )


def discretised(a: Array, b: Array, c: Array, d: Array, sampling: Sampling) -> tuple[Array, Array, Array, Array]:
    """dx/dt = a x + b u, y = c x + d u as x+ = a' x + b' u, y = c' x + d' u at the samples.

    Parameters
    ----------
    a, b, c, d : ndarray
    sampling : Sampling

    Notes
    -----
    In equilibrium the state is that of the continuous law with either method.
    """
    t, n = sampling.period, len(a)
    if sampling.method == "hold":
        forward, held = held_step(a, b, t)
        return forward, held, c, d
    back = np.linalg.inv(np.eye(n) - 0.5 * t * a)
    return back @ (np.eye(n) + 0.5 * t * a), t * back @ b, c @ back, d + 0.5 * t * c @ back @ b


def held_step(a: Array, b: Array, time: float) -> tuple[Array, Array]:
    """Exact x(time) = first x(0) + second u of dx/dt = a x + b u for an input that is held."""
    n, m = b.shape
    whole = sla.expm(time * np.block([[a, b], [np.zeros((m, n + m))]]))
    return whole[:n, :n], whole[:n, n:]


class SampledLoop:
    """A machine whose controller is computed at discrete times.

    Parameters
    ----------
    machine : Machine
    sampling : Sampling
    complex_form : bool, optional
        Force the complex or the real form; chosen by the machine's symmetry if left out.

    Raises
    ------
    ModelError
        If the machine has no controller.
    """

    def __init__(self, machine: Machine, sampling: Sampling, complex_form: bool | None = None):
        designed = synthesise(machine)
        loop = system(with_chains(designed, delay=0.0, amplifier=None), complex_form=complex_form)
        plant = loop.plant
        if not plant.blocks:
            raise ModelError(f"{machine.name} has no controller, and so nothing that is sampled")
        self.machine, self.sampling = machine, sampling
        rotor = replace(loop, plant=replace(plant, blocks=()))
        axes = [k for block in plant.blocks for k in block.axes]
        push = rotor.from_rate @ dense(rotor.pencil.B)[:, axes]
        amplifiers = [_amplifier(designed, plant.axes[k].magnet, 0 if plant.complex_form else k % 2) for k in axes]
        a, b, c, d = (sla.block_diag(*[x[i] for x in amplifiers]) for i in range(4))
        n, m = rotor.size, len(a)
        self._constant = np.block([[rotor.A0, -push @ c], [np.zeros((m, n)), a]])
        self._rate = sla.block_diag(rotor.A1, np.zeros((m, m)))
        self._input = np.vstack([-push @ d, b])
        moved, size = rotor.to_state, rotor.displacements
        seen = [
            np.asarray(block.sensors.T) @ moved[k * size : (k + 1) * size] for block in plant.blocks for k in (0, 1)
        ]
        self._output = np.hstack([np.vstack(seen), np.zeros((sum(map(len, seen)), m))])
        self._laws = [block.law for block in plant.blocks]
        whole = sampling.delay / sampling.period
        self._late = math.floor(whole + INSTANT)
        """Whole periods of delay."""
        self._rest = max(whole - self._late, 0.0) if whole - self._late > INSTANT else 0.0

    def law(self, speed: float) -> tuple[Array, Array, Array, Array]:
        """Difference equations of all controllers, from displacements and velocities to commands [A]."""

        def numbers(part: Affine) -> Array:
            return np.asarray(dense(part.constant) + speed * dense(part.rate))

        parts = [[numbers(x) for x in (law.a, law.b, law.c, law.d)] for law in self._laws]
        a, b, c, d = (sla.block_diag(*[p[i] for p in parts]) for i in range(4))
        return discretised(a, b, c, d, self.sampling)

    def monodromy(self, speed: float) -> Array:
        """What one period multiplies the state with: rotor and amplifiers, controllers, commands on their way.

        Parameters
        ----------
        speed : float
            Spin speed [rad/s].
        """
        a, b, c, d = self.law(speed)
        continuous, period, y = self._constant + speed * self._rate, self.sampling.period, self._output
        n, m, u = len(continuous), len(a), len(c)
        early, late = held_step(continuous, self._input, (1.0 - self._rest) * period)
        waiting = self._late + (self._rest > 0.0)
        out = np.zeros((n + m + waiting * u,) * 2, np.result_type(continuous, a))
        out[:n, :n] = early
        if self._rest:
            first, held = held_step(continuous, self._input, self._rest * period)
            out[:n, :n] = early @ first
            out[:n, n + m + self._late * u :] = early @ held
        out[n : n + m, :n], out[n : n + m, n : n + m] = b @ y, a
        command = np.hstack([d @ y, c, np.zeros((u, waiting * u))])
        if self._late:
            acting = n + m + (self._late - 1) * u
            out[:n, acting : acting + u] += late
        else:
            out[:n] += late @ command
        if waiting:
            out[n + m : n + m + u] = command
            kept = (waiting - 1) * u
            out[n + m + u :, n + m : n + m + kept] = np.eye(kept)
        return out

    def multipliers(self, speed: float) -> Array:
        """Eigenvalues of the monodromy matrix."""
        return np.asarray(np.linalg.eigvals(self.monodromy(speed)))


def _amplifier(machine: Machine, magnet: int, plane: int) -> tuple[Array, Array, Array, Array]:
    """State space of the amplifier of an axis, from its command to the current."""
    law = machine.controller
    if law is None or not serves_all(law):
        law = machine.controllers_of(machine.magnets[magnet])[plane]
    if not isinstance(law, Chain):  # ideal state feedback
        return np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))
    _, behind = hardware(replace(law, low_pass=None, notches=(), delay=0.0))
    a, b, c, d = (dense(x.constant) for x in (behind.a, behind.b, behind.c, behind.d))
    return a, b[:, :1], c, d[:, :1]
