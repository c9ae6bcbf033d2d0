"""A mode of the machine: eigenvalue, whirl direction, shape, and whether it lives in the rotor or in the controller."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .certificate import Eigensystem
from .system import Array, System

WHIRL_FREQUENCY = 1.0
"""Eigenvalues with a smaller imaginary part [rad/s] are real poles and do not whirl."""

OVERDAMPED = 0.7
"""Modes with a larger damping ratio show in no response; they are left out where modes are listed."""


@dataclass(frozen=True)
class Mode:
    """One mode at one spin speed.

    Attributes
    ----------
    speed : float
        Spin speed [rad/s].
    eigenvalue : complex
        [1/s]; the imaginary part is the whirl frequency, taken positive.
    whirl : {"forward", "backward", "planar", "none"}
        Direction of the whirl, seen along the axis with the spin positive; "none" for real poles.
    controller_share : float
        Participation of the controllers' states, between 0 (rotor mode) and 1 (controller mode).
    shape : ndarray, shape (nodes, 2)
        Complex amplitudes of the displacements v and w along the shaft, largest component 1.
    right, left : ndarray
        Vectors of the pencil with left^H E right = 1; complex form: of the eigenvalue with its sign.
    signed : complex
        The eigenvalue to which `right` and `left` belong.
    """

    speed: float
    eigenvalue: complex
    whirl: str
    controller_share: float
    shape: Array
    right: Array
    left: Array
    signed: complex

    @property
    def frequency(self) -> float:
        """Whirl frequency [rad/s]."""
        return self.eigenvalue.imag

    @property
    def frequency_hz(self) -> float:
        """Whirl frequency [Hz]."""
        return self.frequency / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float:
        """-Re/abs of the eigenvalue."""
        return damping_ratio(self.eigenvalue)

    @property
    def logarithmic_decrement(self) -> float:
        """-2 pi Re/abs(Im); infinite for a real pole."""
        return -2.0 * math.pi * self.eigenvalue.real / self.frequency if self.frequency else math.inf

    @property
    def kind(self) -> str:
        """``"controller"`` or ``"rotor"``, after the larger participation."""
        return "controller" if self.controller_share > 0.5 else "rotor"

    def describe(self) -> str:
        """The mode in words: ``forward rotor mode at 53.2 Hz``."""
        if abs(self.eigenvalue) < 1e-2 and self.kind == "rotor":
            return "rigid-body mode"
        if self.whirl == "none":
            return f"real {self.kind} pole at {self.eigenvalue.real:.3g} 1/s"
        return f"{self.whirl} {self.kind} mode at {self.frequency_hz:.4g} Hz"


def whirls(values: Array) -> Array:
    """Which eigenvalues oscillate; the others are real poles, or nearly so.

    Parameters
    ----------
    values : ndarray of complex
    """
    return np.asarray(np.abs(values.imag) > np.maximum(WHIRL_FREQUENCY, 0.01 * np.abs(values.real)))


def damping_ratio(eigenvalue: complex) -> float:
    """-Re/abs of an eigenvalue; zero for an eigenvalue of zero."""
    size = abs(eigenvalue)
    return -eigenvalue.real / size if size else 0.0


def mode(system: System, e: Eigensystem, index: int) -> Mode:
    """Describe one eigenvalue of a decomposition.

    Parameters
    ----------
    system : System
    e : Eigensystem
        Of ``system.matrix(e.speed)``.
    index : int

    Returns
    -------
    Mode
    """
    right = system.to_state @ e.right[:, index]
    left = (e.left[index] @ system.from_rate).conj()
    return refined(system, e.speed, complex(e.values[index]), right, left)


def refined(system: System, speed: float, value: complex, right: Array, left: Array) -> Mode:
    """Describe an eigenvalue given with the vectors of the pencil.

    Parameters
    ----------
    system : System
    speed : float [rad/s]
    value : complex [1/s]
    right, left : ndarray
        With left^H E right = 1.

    Returns
    -------
    Mode
    """
    n = system.displacements
    weights = np.abs(right * left)
    weights[n : 2 * n] = np.abs(left[n : 2 * n] * (system.mass @ right[n : 2 * n]))
    share = float(weights[2 * n :].sum() / weights.sum())
    shape = _shape(system, right[:n], value)
    return Mode(
        speed, complex(value.real, abs(value.imag)), _whirl(system, shape, value), share, shape, right, left, value
    )


def unpinned(system: System, q: Array) -> Array:
    """Displacements of all degrees of freedom, zeros at the pins, from those of the free ones."""
    width = 2 if system.complex_form else 4
    full = np.zeros((width * system.plant.mesh.nodes, *q.shape[1:]), complex)
    full[list(system.plant.free)] = q
    return full


def _shape(system: System, q: Array, value: complex) -> Array:
    full = unpinned(system, q)
    if system.complex_form:  # r exp(lambda t) as real motions v and w with positive frequency
        r = full[0::2]
        shape = np.stack([r, -1j * r] if value.imag >= 0.0 else [r.conj(), 1j * r.conj()], axis=1)
    else:
        shape = np.stack([full[0::4], full[1::4]], axis=1)
        shape = shape if value.imag >= 0.0 else shape.conj()
    flat = shape.ravel()
    largest = flat[np.argmax(np.abs(flat))]
    return np.asarray(shape / largest) if largest != 0.0 else shape


def _whirl(system: System, shape: Array, value: complex) -> str:
    if not whirls(np.array(value)):
        return "none"
    if system.complex_form:
        return "forward" if value.imag > 0.0 else "backward"
    forward, backward = circular(shape)
    ahead, back = float(np.sum(np.abs(forward) ** 2)), float(np.sum(np.abs(backward) ** 2))
    if abs(ahead - back) < 1e-6 * (ahead + back):
        return "planar"
    return "forward" if ahead > back else "backward"


def circular(shape: Array) -> tuple[Array, Array]:
    """Forward and backward circular components of amplitudes (v, w).

    Parameters
    ----------
    shape : ndarray, shape (..., 2)
        Complex amplitudes of v and w.

    Returns
    -------
    forward, backward : ndarray, shape (...,)
        r = forward exp(i w t) + conj(backward) exp(-i w t); the orbit's half axes are their moduli's sum and difference.
    """
    v, w = shape[..., 0], shape[..., 1]
    return (v + 1j * w) / 2.0, (v - 1j * w) / 2.0
