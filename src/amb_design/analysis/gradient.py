"""Exact derivatives of eigenvalues, stability limits and critical speeds with respect to every number of the machine.

A simple eigenvalue lam of E x' = A x with left and right vectors y, x (y^H E x = 1) moves by
d lam = y^H (dA0 + Omega dA1 - lam dE) x. The derivatives of the matrices with respect to all parameters at once come from
one reverse sweep of algorithmic differentiation through the CasADi model, so that a gradient costs a fraction of an
eigendecomposition, however many parameters there are.

Places of the machine that share a node move together: the parameter is named after the one that leads the node, and
what sits at a shaft end or step moves with the segments' lengths.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError
from ..model.loop import is_isotropic
from ..model.mesh import Mesh, plan
from ..model.parametric import parametric
from ..spec.machine import Machine
from ..spec.paths import find, is_switched_off, numbers, skeleton, value
from ..synthesis.design import synthesise
from ..threads import one_thread
from .critical import CriticalSpeed, critical_mode
from .modes import Mode
from .system import Array


class Differentiated:
    """The closed loop of a machine with its reverse sweep.

    The sweep depends on the machine's structure alone; machines that differ in numbers share it.

    Parameters
    ----------
    machine : Machine
        Numbers only.

    Attributes
    ----------
    members : dict of str to tuple of str
        Every number that can be varied by itself, with the paths that it moves.
    """

    def __init__(self, machine: Machine):
        mesh = plan(machine)
        self.machine = machine
        self.members = movable(machine, mesh)
        self._sweep = _sweep_of(_Structure(machine, mesh, self.members))
        self._nominal = [float(value(machine, path)) for path in self.members]
        re, im = self._sweep.a1(self._nominal)
        self._a1 = re.sparse() + 1j * im.sparse()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.members)

    def eigenvalue(self, mode: Mode) -> Array:
        """Derivative of a mode's eigenvalue with respect to all parameters.

        Parameters
        ----------
        mode : Mode
            Of this machine.

        Returns
        -------
        ndarray of complex, shape (parameters,)
            For the eigenvalue with positive imaginary part.
        """
        factors = (-mode.signed, 1.0, mode.speed)  # of E, A0 and A1 in d lam
        left, right = mode.left.conj(), mode.right
        weights = np.concatenate(
            [
                factor * unit * left[rows] * right[columns]
                for factor, places in zip(factors, self._sweep.places, strict=True)
                for unit, (rows, columns) in zip((1.0, 1j), places, strict=True)
            ]
        )
        re, im = (self._sweep.reverse(self._nominal, w).full()[:, 0] for w in (weights.real, weights.imag))
        return np.asarray(re + 1j * im if mode.signed.imag >= 0.0 else re - 1j * im)

    def speed_rate(self, mode: Mode) -> complex:
        """Derivative of a mode's eigenvalue with respect to the spin speed, for the positive imaginary part."""
        rate = complex(mode.left.conj() @ (self._a1 @ mode.right))
        return rate if mode.signed.imag >= 0.0 else rate.conjugate()

    def named(self, values: Array, free: Sequence[str] | None) -> dict[str, Any]:
        """Derivatives by name, those of tied numbers added up.

        Parameters
        ----------
        values : ndarray, shape (parameters,)
        free : sequence of str or None
            Full or short paths; all parameters if None.

        Raises
        ------
        ModelError
            If a number cannot be varied by itself.
        """
        each = dict(zip(self.members, values.tolist(), strict=True))
        if free is None:
            return each
        leaders = {path: name for name, members in self.members.items() for path in members}
        out = {}
        for path in free:
            paths = find(self.machine, path)
            fixed = [p for p in paths if p not in leaders]
            if fixed:
                raise ModelError(
                    f"{fixed[0]} cannot be varied by itself: it sits at a shaft end or step, or is zero and leaves its block out"
                )
            out[path] = sum(each[name] for name in dict.fromkeys(leaders[p] for p in paths))
        return out


@lru_cache(maxsize=4)
def differentiated(machine: Machine) -> Differentiated:
    """The differentiated loop of a machine, kept for the next question about it.

    Parameters
    ----------
    machine : Machine
        Numbers only. A law that is given by its weights is designed first, and then stays as it is.
    """
    return Differentiated(synthesise(machine))


@dataclass(frozen=True)
class _Structure:
    """A machine that stands for all machines of the same structure."""

    machine: Machine = field(compare=False)
    mesh: Mesh = field(compare=False)
    members: dict[str, tuple[str, ...]] = field(compare=False)
    key: Any = None

    def __post_init__(self) -> None:
        stations = tuple((s.leader, s.members) for s in self.mesh.stations)
        rest = (stations, self.mesh.divisions, self.mesh.segments, tuple(self.members), is_isotropic(self.machine))
        object.__setattr__(self, "key", (skeleton(self.machine), rest))


@dataclass(frozen=True)
class _Sweep:
    """Reverse sweep through E, A0 and A1, the places of their nonzeros, and A1 itself as a Function."""

    reverse: ca.Function
    places: tuple[tuple[Array, Array], ...]
    a1: ca.Function


@lru_cache(maxsize=16)
def _sweep_of(structure: _Structure) -> _Sweep:
    machine = structure.machine
    loop = parametric(machine, structure.members, structure.mesh, complex_form=is_isotropic(machine))
    matrices = (loop.pencil.E, loop.pencil.A0, loop.pencil.A1)
    values = ca.vertcat(*[ca.vertcat(ca.SX(m.re).nz[:], ca.SX(m.im).nz[:]) for m in matrices])
    weights = ca.SX.sym("w", values.shape[0])
    reverse = ca.Function("reverse", [loop.p, weights], [ca.jtimes(values, loop.p, weights, True)])
    return _Sweep(reverse, tuple((_places(m.re), _places(m.im)) for m in matrices), loop.matrix("A1"))


def _places(matrix: Any) -> Array:
    """Rows and columns of a CasADi matrix's nonzeros."""
    return np.array(matrix.sparsity().get_triplet(), int).reshape(2, -1)


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


@one_thread
def eigenvalue_gradient(machine: Machine, mode: Mode, free: Sequence[str] | None = None) -> Mapping[str, complex]:
    """Derivative of an eigenvalue at fixed speed.

    Parameters
    ----------
    machine : Machine
    mode : Mode
        From an analysis of this machine.
    free : sequence of str, optional
        Paths of the parameters, short ones tied; all numbers of the machine if left out.

    Returns
    -------
    mapping of str to complex
        d lam/dp [1/s per SI unit of p] of the eigenvalue with positive imaginary part.

    Raises
    ------
    ModelError
        If a number cannot be varied by itself.
    """
    model = differentiated(machine)
    return model.named(model.eigenvalue(mode), free)


@one_thread
def stability_gradient(machine: Machine, mode: Mode | None, free: Sequence[str] | None = None) -> Mapping[str, float]:
    """Derivative of a stability limit or any other onset speed.

    Parameters
    ----------
    machine : Machine
    mode : Mode
        The mode that limits: ``StabilityLimit.mode`` or ``Onset.mode``.
    free : sequence of str, optional
        Paths of the parameters, short ones tied; all numbers of the machine if left out.

    Returns
    -------
    mapping of str to float
        d Omega*/dp = -Re(dlam/dp)/Re(dlam/dOmega) [rad/s per SI unit of p].

    Raises
    ------
    ModelError
        If there is no such mode, because no limit was found, or a number cannot be varied by itself.
    """
    if mode is None:
        raise ModelError("there is no stability limit to differentiate: no mode becomes unstable below the top speed")
    model = differentiated(machine)
    return model.named(-model.eigenvalue(mode).real / model.speed_rate(mode).real, free)


@one_thread
def critical_speed_gradient(
    machine: Machine, critical: CriticalSpeed, free: Sequence[str] | None = None
) -> Mapping[str, float]:
    """Derivative of a critical speed, where the whirl frequency equals the spin speed.

    Parameters
    ----------
    machine : Machine
    critical : CriticalSpeed
        From `critical_speeds` of this machine.
    free : sequence of str, optional
        Paths of the parameters, short ones tied; all numbers of the machine if left out.

    Returns
    -------
    mapping of str to float
        d Omega/dp = Im(dlam/dp)/(1 - Im(dlam/dOmega)) [rad/s per SI unit of p].

    Raises
    ------
    ModelError
        If a number cannot be varied by itself.
    """
    model = differentiated(machine)
    mode = critical_mode(machine, critical)
    return model.named(model.eigenvalue(mode).imag / (1.0 - model.speed_rate(mode).imag), free)
