"""Eigenvalues, onsets and critical speeds of a numeric loop, to all the digits that its matrices hold.

A two-sided Rayleigh quotient squares the error of the vectors, so that with vectors from double precision its own rounding
is what remains; it is taken in extended precision where the platform has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

import amb_design as ad
from amb_design.analysis.certificate import Walk
from amb_design.analysis.system import dense
from amb_design.model.mesh import Mesh

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


@dataclass(frozen=True)
class Root:
    """An eigenvalue at a speed, with vectors of the pencil from which to look for its neighbours."""

    speed: float
    value: complex
    rate: complex  # derivative with respect to the speed
    right: Array
    left: Array


class Pencil:
    """The full model of a machine, E x' = (A0 + speed A1) x, and single roots of it by inverse iteration."""

    def __init__(self, machine: ad.Machine, mesh: Mesh | None = None, complex_form: bool | None = None):
        pencil = ad.system(machine, mesh, complex_form).pencil
        self.e, self.a0, self.a1 = (dense(m) for m in (pencil.E, pencil.A0, pencil.A1))

    def root(self, speed: float, value: complex, right: Array, left: Array) -> Root:
        """The eigenvalue next to an estimate; the vectors may be poor."""
        matrix = self.a0 + speed * self.a1
        factors = sla.lu_factor(matrix - (value + 1e-7 * abs(value)) * self.e)
        for _ in range(30):
            right = sla.lu_solve(factors, self.e @ right)
            left = sla.lu_solve(factors, self.e.conj().T @ left, trans=2)
            right, left = right / np.linalg.norm(right), left / np.linalg.norm(left)
            last, value = value, complex((left.conj() @ matrix @ right) / (left.conj() @ self.e @ right))
            if abs(value - last) <= 1e-13 * abs(value):
                break
            factors = sla.lu_factor(matrix - (value + 1e-9 * abs(value)) * self.e)
        x, y = right.astype(np.clongdouble), left.conj().astype(np.clongdouble)
        exact = self.a0.astype(np.clongdouble) + np.longdouble(speed) * self.a1.astype(np.clongdouble)
        norm = y @ (self.e.astype(np.clongdouble) @ x)
        return Root(speed, complex((y @ (exact @ x)) / norm), complex((y @ (self.a1 @ x)) / norm), right, left)

    def onset(self, start: Root) -> Root:
        """The speed at which the real part vanishes."""
        return self._newton(start, lambda r: -r.value.real / r.rate.real)

    def critical(self, start: Root) -> Root:
        """The speed that equals the whirl frequency."""
        sign = 1.0 if start.value.imag >= 0.0 else -1.0
        return self._newton(start, lambda r: (sign * r.value.imag - r.speed) / (1.0 - sign * r.rate.imag))

    def _newton(self, start: Root, correction: Callable[[Root], float]) -> Root:
        root = self.root(start.speed, start.value, start.right, start.left)
        for _ in range(20):
            step = correction(root)
            root = self.root(root.speed + step, root.value + root.rate * step, root.right, root.left)
            if abs(step) <= 1e-13 * root.speed:
                return root
        raise AssertionError(f"no root settles near {start.speed}")
