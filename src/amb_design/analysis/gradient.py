"""Exact derivatives of eigenvalues, stability limits and critical speeds with respect to every number of the machine.

A simple eigenvalue lam of E x' = A x with left and right vectors y, x (y^H E x = 1) moves by
d lam = y^H (dA0 + Omega dA1 - lam dE) x. The derivatives of the matrices with respect to all parameters at once come from
one reverse sweep of algorithmic differentiation through the CasADi model, so that a gradient costs a fraction of an
eigendecomposition, however many parameters there are.

Places of the machine that share a node move together: the parameter is named after the one that leads the node, and
what sits at a shaft end or step moves with the segments' lengths.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError
from ..model.loop import ClosedLoop, closed_loop, is_isotropic
from ..model.mesh import Mesh, plan
from ..spec.machine import Machine
from ..spec.paths import is_switched_off, numbers
from .critical import CriticalSpeed, critical_mode
from .modes import Mode
from .system import Array


class Differentiated:
    """The closed loop of a machine with its reverse sweep.

    Parameters
    ----------
    loop : ClosedLoop
        With the parameters of interest free.
    """

    def __init__(self, loop: ClosedLoop):
        self.loop = loop
        pencil = loop.pencil
        matrices = (pencil.E, pencil.A0, pencil.A1)
        self._places = [(_places(m.re), _places(m.im)) for m in matrices]
        values = ca.vertcat(*[ca.vertcat(ca.SX(m.re).nz[:], ca.SX(m.im).nz[:]) for m in matrices])
        weights = ca.SX.sym("w", values.shape[0])
        self._sweep = ca.Function(
            "reverse", [loop.p, weights], [ca.jtimes(values, loop.p, weights, True)], ["p", "w"], ["gradient"]
        )
        re, im = loop.function("A1")(loop.nominal)
        self.rate_matrix: Any = re.sparse() + 1j * im.sparse()

    def eigenvalue(self, mode: Mode) -> Array:
        """Derivative of a mode's eigenvalue with respect to the parameters.

        Parameters
        ----------
        mode : Mode
            Of this machine.

        Returns
        -------
        ndarray of complex, shape (np,)
            For the eigenvalue with positive imaginary part.
        """
        factors = (-mode.signed, 1.0, mode.speed)  # of E, A0 and A1 in d lam
        left, right = mode.left.conj(), mode.right
        re, im = [], []
        for factor, (real, imaginary) in zip(factors, self._places, strict=True):
            w = factor * left[real[0]] * right[real[1]]
            v = 1j * factor * left[imaginary[0]] * right[imaginary[1]]
            re += [w.real, v.real]
            im += [w.imag, v.imag]
        weights = np.stack([np.concatenate(re), np.concatenate(im)], axis=1)
        out = [self._sweep(self.loop.nominal, w).full()[:, 0] for w in weights.T]
        sign = 1.0 if mode.signed.imag >= 0.0 else -1.0
        return np.asarray(out[0] + 1j * sign * out[1])


def _places(matrix: Any) -> Array:
    """Rows and columns of a CasADi matrix's nonzeros."""
    return np.array(matrix.sparsity().get_triplet(), int).reshape(2, -1)


@lru_cache(maxsize=8)
def differentiated(machine: Machine, free: tuple[str, ...] | None = None) -> Differentiated:
    """The differentiated loop of a machine, built once.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    free : tuple of str, optional
        Paths of the parameters; every number that can move the eigenvalues if left out.

    Returns
    -------
    Differentiated
    """
    parameters = movable(machine, plan(machine)) if free is None else free
    return Differentiated(closed_loop(machine, parameters, complex_form=is_isotropic(machine)))


def movable(machine: Machine, mesh: Mesh) -> dict[str, tuple[str, ...]]:
    """Every number of the machine that can be varied by itself, with the paths that it moves.

    Parameters
    ----------
    machine : Machine
    mesh : Mesh
        Its plan.

    Returns
    -------
    dict of str to tuple of str
    """
    followers: dict[str, tuple[str, ...]] = {}
    for station in mesh.stations:
        for path in station.members:
            followers[path] = station.members if path == station.leader else ()
    groups = {}
    for path, _ in numbers(machine):
        if path.startswith("operation.") or is_switched_off(machine, path):
            continue
        members = followers.get(path, (path,))
        if members:
            groups[path] = members
    return groups


def _named(model: Differentiated, values: Array) -> Mapping[str, float]:
    return MappingProxyType({n: float(v) for n, v in zip(model.loop.names, values, strict=True)})


def eigenvalue_gradient(machine: Machine, mode: Mode, free: tuple[str, ...] | None = None) -> Mapping[str, complex]:
    """Derivative of an eigenvalue at fixed speed.

    Parameters
    ----------
    machine : Machine
    mode : Mode
        From an analysis of this machine.
    free : tuple of str, optional
        Paths of the parameters; all numbers of the machine if left out.

    Returns
    -------
    mapping of str to complex
        d lam/dp [1/s per SI unit of p] of the eigenvalue with positive imaginary part.
    """
    model = differentiated(machine, free)
    return MappingProxyType({n: complex(v) for n, v in zip(model.loop.names, model.eigenvalue(mode), strict=True)})


def stability_gradient(machine: Machine, mode: Mode | None, free: tuple[str, ...] | None = None) -> Mapping[str, float]:
    """Derivative of a stability limit or any other onset speed.

    Parameters
    ----------
    machine : Machine
    mode : Mode
        The mode that limits: ``StabilityLimit.mode`` or ``Onset.mode``.
    free : tuple of str, optional
        Paths of the parameters; all numbers of the machine if left out.

    Returns
    -------
    mapping of str to float
        d Omega*/dp = -Re(dlam/dp)/Re(dlam/dOmega) [rad/s per SI unit of p].

    Raises
    ------
    ModelError
        If there is no such mode, because no limit was found.
    """
    if mode is None:
        raise ModelError("there is no stability limit to differentiate: no mode becomes unstable below the top speed")
    model = differentiated(machine, free)
    return _named(model, -model.eigenvalue(mode).real / speed_rate(model, mode).real)


def critical_speed_gradient(
    machine: Machine, critical: CriticalSpeed, free: tuple[str, ...] | None = None
) -> Mapping[str, float]:
    """Derivative of a critical speed, where the whirl frequency equals the spin speed.

    Parameters
    ----------
    machine : Machine
    critical : CriticalSpeed
        From `critical_speeds` of this machine.
    free : tuple of str, optional
        Paths of the parameters; all numbers of the machine if left out.

    Returns
    -------
    mapping of str to float
        d Omega/dp = Im(dlam/dp)/(1 - Im(dlam/dOmega)) [rad/s per SI unit of p].
    """
    model = differentiated(machine, free)
    mode = critical_mode(machine, critical)
    return _named(model, model.eigenvalue(mode).imag / (1.0 - speed_rate(model, mode).imag))


def speed_rate(model: Differentiated, mode: Mode) -> complex:
    """Derivative of a mode's eigenvalue with respect to the spin speed."""
    rate = complex(mode.left.conj() @ (model.rate_matrix @ mode.right))
    return rate if mode.signed.imag >= 0.0 else rate.conjugate()
