"""Critical speeds: spin speeds that equal a whirl frequency.

A forward critical speed is a crossing Im lam(Omega) = Omega of a forward branch; backward ones are listed apart, since
unbalance does not excite them. Undamped passive rotors have them as eigenvalues of a synchronous Hermitian problem. In
general the condition lam = i Omega with complex Omega, A0 x = Omega (i - A1) x, is again an eigenproblem: its solutions near
the real axis start a Newton iteration on the full sparse model for the crossing of the damped branch.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from ..errors import SolveError
from ..spec.machine import Machine
from ..threads import one_thread
from .certificate import Walk
from .modes import Mode, circular, mode, refined, unpinned
from .polish import Polisher
from .system import Array, System, dense, system

SETTLED = 1e-7
"""Relative step of the Newton iteration below which a critical speed has arrived; rounding on fine meshes allows no less."""

STEEPEST = 0.6
"""Solutions with a larger ratio of imaginary to real part belong to modes too damped to have a critical speed."""


@dataclass(frozen=True)
class CriticalSpeed:
    """A spin speed that equals a whirl frequency.

    Attributes
    ----------
    speed : float [rad/s]
    whirl : {"forward", "backward", "planar"}
    damping_ratio : float
        Of the mode there; zero for undamped machines.
    kind : {"rotor", "controller"}
    """

    speed: float
    whirl: str
    damping_ratio: float
    kind: str

    @property
    def speed_rpm(self) -> float:
        """Speed [rpm]."""
        return self.speed * 30.0 / math.pi


@one_thread
def critical_speeds(machine: Machine | System, top_speed: float | None = None) -> tuple[CriticalSpeed, ...]:
    """All critical speeds up to a top speed.

    Parameters
    ----------
    machine : Machine or System
    top_speed : float, optional
        [rad/s]; the machine's own top speed if left out.

    Returns
    -------
    tuple of CriticalSpeed
        In order of speed, forward and backward ones.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    top = loop.machine.operation.top_speed if top_speed is None else top_speed
    if not top > 0.0:
        return ()
    found = _synchronous(loop, top) if is_conservative(loop) else _crossings(loop, top)
    return tuple(sorted(found, key=lambda c: c.speed))


def is_conservative(loop: System) -> bool:
    """True if nothing in the machine dissipates or feeds energy: then its critical speeds follow from one eigenproblem."""
    plant = loop.plant
    if plant.blocks:
        return False
    c0, k1, k0, c1 = (dense(m) for m in (plant.C0, plant.K1, plant.K0, plant.C1))
    symmetric = np.allclose(k0, k0.conj().T, rtol=0.0, atol=1e-12 * np.abs(k0).max())
    gyroscopic = np.allclose(c1, -c1.conj().T, rtol=0.0, atol=1e-12 * (np.abs(c1).max() or 1.0))
    return symmetric and gyroscopic and not c0.any() and not k1.any()


def _synchronous(loop: System, top: float) -> list[CriticalSpeed]:
    """K0 q = Omega^2 (M -+ G) q, upper sign forward, in the real form for both directions at once."""
    plant = loop.plant
    m, k, c = dense(plant.M), dense(plant.K0), dense(plant.C1)
    found = []
    for sign, whirl in ((1.0, "forward"), (-1.0, "backward")) if loop.complex_form else ((1.0, ""),):
        inertia = np.real_if_close(m - sign * 1j * c, tol=1)
        try:  # the inertia may be indefinite (Ip > Id), the stiffness of a supported rotor is not
            inverse, vectors = sla.eigh(inertia, k, subset_by_value=(top**-2, np.inf))
        except np.linalg.LinAlgError:  # free bodies: stiffness only semidefinite
            return _crossings(loop, top)
        for mu, vector in zip(inverse, vectors.T, strict=True):
            if mu * top**2 >= 1.0:
                found.append(CriticalSpeed(1.0 / math.sqrt(mu), whirl or _whirl(loop, vector), 0.0, "rotor"))
    return found


def _whirl(loop: System, q: Array) -> str:
    full = unpinned(loop, q)
    forward, backward = circular(np.stack([full[0::4], full[1::4]], axis=1))
    ahead, back = np.sum(np.abs(forward) ** 2), np.sum(np.abs(backward) ** 2)
    return "planar" if abs(ahead - back) < 1e-6 * (ahead + back) else "forward" if ahead > back else "backward"


def _crossings(loop: System, top: float) -> list[CriticalSpeed]:
    polisher = Polisher(loop.pencil)
    found: list[Mode] = []
    for sign in (1.0, -1.0) if loop.complex_form else (1.0,):
        inertia = sign * 1j * np.eye(loop.size) - loop.A1
        speeds, left, right = sla.eig(np.linalg.solve(inertia, loop.A0), left=True, right=True)
        left = np.linalg.solve(inertia.conj().T, left)
        near = np.flatnonzero((np.abs(speeds.imag) < STEEPEST * speeds.real) & (speeds.real < 1.2 * top))
        for k in near:
            start = _start(loop, complex(speeds[k]), sign, right[:, k], left[:, k])
            crossing = _newton(loop, polisher, *start, sign)
            if crossing is None or not 0.0 < crossing.speed <= top:
                continue
            if all(
                abs(crossing.speed - c.speed) > 1e-8 * top or abs(crossing.signed - c.signed) > 1e-6 * top
                for c in found
            ):
                found.append(crossing)
    return [CriticalSpeed(m.speed, m.whirl, m.damping_ratio, m.kind) for m in found]


def _start(loop: System, speed: complex, sign: float, right: Array, left: Array) -> tuple[float, complex, Array, Array]:
    """Continue the branch from lam = i Omega at a complex speed to its real part."""
    rate = (left.conj() @ loop.A1 @ right) / (left.conj() @ right)
    value = sign * 1j * speed + rate * (speed.real - speed)
    return speed.real, complex(value), loop.to_state @ right, (left.conj() @ loop.from_rate).conj()


def _newton(
    loop: System, polisher: Polisher, speed: float, value: complex, right: Array, left: Array, sign: float
) -> Mode | None:
    """Move the speed until the frequency of the branch equals it; None if the branch gets lost."""
    for _ in range(12):
        try:
            value, right, left = polisher.eigenpair(speed, value, right, left)
        except SolveError:
            return None
        rate = complex(left.conj() @ (polisher.a1 @ right))
        step = (sign * value.imag - speed) / (1.0 - sign * rate.imag)
        if abs(step) <= SETTLED * speed:
            return refined(loop, speed, value, right, left)
        if abs(step) > 0.5 * speed:
            return None
        speed, value = speed + step, value + rate * step
    return None


@one_thread
def critical_mode(machine: Machine | System, critical: CriticalSpeed) -> Mode:
    """The mode at a critical speed, refined so that its frequency equals the spin speed.

    Parameters
    ----------
    machine : Machine or System
    critical : CriticalSpeed
        From `critical_speeds` of this machine.

    Returns
    -------
    Mode
        Its ``speed`` is the critical speed to rounding.

    Raises
    ------
    SolveError
        If the iteration does not settle.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    sign = -1.0 if loop.complex_form and critical.whirl == "backward" else 1.0
    e = Walk(loop.A0, loop.A1).at(critical.speed)
    ratio = -e.values.real / np.maximum(np.abs(e.values), 1e-300)
    distance = np.abs(e.values.imag - sign * critical.speed) + np.abs(ratio - critical.damping_ratio) * critical.speed
    start = mode(loop, e, int(np.argmin(distance)))
    found = _newton(loop, Polisher(loop.pencil), critical.speed, start.signed, start.right, start.left, sign)
    if found is None:
        raise SolveError(f"the critical speed near {critical.speed_rpm:.5g} rpm does not settle")
    return found
