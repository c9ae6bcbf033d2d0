"""The controllers as a digital processor runs them: the difference equations that sampled analyses judge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.sampled import discretised, with_chains
from ..analysis.system import Array
from ..errors import ModelError
from ..model.parametric import parametric
from ..spec.controller import Chain
from ..spec.machine import Machine
from ..spec.sampling import Sampling
from ..synthesis.design import synthesise
from .control import controller_matrices


@dataclass(frozen=True)
class Discrete:
    """x[k+1] = a x[k] + b y[k], i[k] = c x[k] + d y[k].

    Attributes
    ----------
    a, b, c, d : ndarray
    sampling : Sampling
    inputs, outputs : tuple of str
        Displacements at the sensors [m], and the current commands that the amplifiers follow [A].
    """

    a: Array
    b: Array
    c: Array
    d: Array
    sampling: Sampling
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def run(self, displacements: Array) -> Array:
        """Commands for a sequence of samples, from rest.

        Parameters
        ----------
        displacements : ndarray, shape (samples, inputs)

        Returns
        -------
        ndarray, shape (samples, outputs)
        """
        x, out = np.zeros(len(self.a)), []
        for y in np.asarray(displacements, float):
            out.append(self.c @ x + self.d @ y)
            x = self.a @ x + self.b @ y
        return np.array(out)


def discrete(machine: Machine, sampling: Sampling, speed: float = 0.0) -> Discrete:
    """All controllers of a machine in front of their amplifiers, as `sampled_stability` and `simulate` have them.

    Parameters
    ----------
    machine : Machine
    sampling : Sampling
        Period and method. Its delay is the processor's, and no part of the law.
    speed : float
        Spin speed [rad/s], for gains that follow it.

    Returns
    -------
    Discrete
        With the sign of the feedback and the amplifiers' gain. The delay of the chain is left out: it stands for the sampling.

    Raises
    ------
    ModelError
        If there is no controller, or one differentiates without a low-pass.
    """
    machine = synthesise(machine)
    loop = parametric(with_chains(machine, amplifier=None, delay=0.0), complex_form=False)
    if not loop.plant.blocks:
        raise ModelError(f"{machine.name} has no controller")
    a, b, c, d = controller_matrices(loop, speed)
    axes = [x.name for x in loop.plant.axes]
    n = len(axes)
    if b[:, n:].any() or d[:, n:].any():
        raise ModelError(
            f"{machine.name} differentiates displacements without a low-pass, which no sampled controller can; give it one"
        )
    gains = np.array([[_gain(machine, k)] for k in range(n)])
    return Discrete(
        *discretised(a, b[:, :n], gains * c, gains * d[:, :n], sampling),
        sampling,
        tuple(f"displacement {x}" for x in axes),
        tuple(f"current {x}" for x in axes),
    )


def _gain(machine: Machine, axis: int) -> float:
    law = machine.controllers_of(machine.magnets[axis // 2])[axis % 2]
    return float(law.amplifier.gain) if isinstance(law, Chain) and law.amplifier is not None else 1.0
