"""Eigenvalues, onsets and critical speeds of a numeric loop to more digits than double precision leaves.

A two-sided Rayleigh quotient squares the error of the vectors, so that with vectors from double precision its own rounding
is what remains; it is taken in extended precision where the platform has it.
"""

from __future__ import annotations

import numpy as np

from amb_design.analysis.certificate import Walk

Array = np.ndarray


def eigenvalue(a0: Array, a1: Array, speed: float, near: complex) -> tuple[complex, complex]:
    """The eigenvalue of A0 + speed A1 nearest to an estimate, and its derivative with respect to the speed."""
    e = Walk(a0, a1).at(float(speed))
    k = int(np.argmin(np.abs(e.values - near)))
    matrix = a0.astype(np.clongdouble) + np.longdouble(speed) * a1.astype(np.clongdouble)
    right, left = e.right[:, k].astype(np.clongdouble), e.left[k].astype(np.clongdouble)
    value = (left @ (matrix @ right)) / (left @ right)
    return complex(value), complex((left @ (a1 @ right)) / (left @ right))


def onset(a0: Array, a1: Array, speed: float, near: complex, steps: int = 20) -> float:
    """The speed at which the real part of an eigenvalue vanishes, to rounding."""
    for _ in range(steps):
        near, rate = eigenvalue(a0, a1, speed, near)
        step = -near.real / rate.real
        speed, near = speed + step, near + rate * step
        if abs(step) <= 1e-14 * abs(speed):
            break
    return speed


def critical(a0: Array, a1: Array, speed: float, near: complex, steps: int = 20) -> float:
    """The speed that equals the modulus of an eigenvalue's imaginary part, to rounding."""
    sign = 1.0 if near.imag >= 0.0 else -1.0
    for _ in range(steps):
        near, rate = eigenvalue(a0, a1, speed, near)
        step = (sign * near.imag - speed) / (1.0 - sign * rate.imag)
        speed, near = speed + step, near + rate * step
        if abs(step) <= 1e-14 * abs(speed):
            break
    return speed
