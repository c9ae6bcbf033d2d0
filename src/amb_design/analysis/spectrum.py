"""All modes of the machine at one spin speed."""

from __future__ import annotations

import numpy as np

from ..spec.machine import Machine
from ..threads import one_thread
from .certificate import Walk
from .modes import Mode, mode
from .system import System, system


@one_thread
def spectrum(machine: Machine | System, speed: float = 0.0, modes: int | None = None) -> tuple[Mode, ...]:
    """Modes at a spin speed, by rising whirl frequency.

    Parameters
    ----------
    machine : Machine or System
    speed : float
        Spin speed [rad/s].
    modes : int, optional
        Only so many with the lowest frequencies; all if left out.

    Returns
    -------
    tuple of Mode
        Real poles first; of a conjugate pair only one.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    e = Walk(loop.A0, loop.A1).at(speed)
    chosen = np.arange(len(e.values)) if loop.complex_form else np.flatnonzero(e.values.imag >= 0.0)
    order = chosen[np.argsort(np.abs(e.values.imag[chosen]), kind="stable")]
    return tuple(mode(loop, e, int(i)) for i in order[:modes])
