"""Tolerances: how the matrix of the closed loop moves with numbers of the machine."""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca
import numpy as np

from ..analysis.system import Array, System
from ..errors import SpecError
from ..model.loop import close, structure
from ..model.magnet import current_stiffness, negative_stiffness
from ..spec.machine import Machine
from ..spec.paths import find, replace, value
from ..synthesis.design import synthesise


def directions(loop: System, within: Mapping[str, float]) -> dict[str, Array]:
    """Derivatives of A with respect to relative changes of numbers of the machine.

    Parameters
    ----------
    loop : System
    within : mapping of str to float
        Relative tolerances by path. ``magnets.current_stiffness`` and ``magnets.negative_stiffness`` are there for magnets with
        geometry too.

    Returns
    -------
    dict of str to ndarray, shape (n, n)
        A moves by d times the matrix if the numbers grow by the part d.

    Raises
    ------
    SpecError
        If a path fits nothing, a tolerance is not positive, or the matrix is not affine in the numbers.
    """
    machine = linear(loop.machine)
    d = ca.SX.sym("d", len(within))
    symbols: dict[str, ca.SX] = {}
    for k, (path, tolerance) in enumerate(within.items()):
        if not 0.0 < tolerance < 1.0:
            raise SpecError("must lie between 0 and 1", field=path, got=tolerance, remedy="0.05 stands for 5 %")
        for member in find(machine, path):
            if member in symbols:
                raise SpecError("has two tolerances", field=member, remedy="name each number once")
            if value(machine, member) == 0:
                raise SpecError("is zero, of which no part can vary", field=path, got=member, remedy="leave it out")
            symbols[member] = value(machine, member) * (1.0 + d[k])
    pencil = close(structure(replace(synthesise(machine), symbols), loop.plant.mesh, loop.complex_form))
    moving = ca.vertcat(*[m.nz[:] for m in (ca.SX(pencil.A0.re), ca.SX(pencil.A0.im))])
    fixed = [ca.SX(m) for part in (pencil.E, pencil.A1) for m in (part.re, part.im)]
    if ca.depends_on(ca.vertcat(*[m.nz[:] for m in fixed]), d):
        raise SpecError(
            "moves the mass or what goes with the speed",
            field=", ".join(within),
            remedy="leave geometry and density out",
        )
    if not ca.is_linear(moving, d):
        raise SpecError(
            "do not enter the matrix linearly",
            field=", ".join(within),
            remedy="leave out all but one of a product's factors",
        )
    both = ca.Function("A0", [d], [ca.SX(pencil.A0.re), ca.SX(pencil.A0.im)])
    base = [m.full() for m in both(np.zeros(len(within)))]
    out = {}
    for k, path in enumerate(within):
        moved = [m.full() for m in both(np.eye(len(within))[k])]
        change = moved[0] - base[0] + 1j * (moved[1] - base[1])
        change = change if change.imag.any() else change.real
        if not change.any():
            remedy = "of magnets take magnets.current_stiffness and magnets.negative_stiffness"
            raise SpecError("does not enter the matrix linearly, or not at all", field=path, remedy=remedy)
        out[path] = np.asarray(loop.from_rate @ change @ loop.to_state)
    return out


def linear(machine: Machine) -> Machine:
    """The same machine with magnets by k_i and k_s instead of their geometry."""
    changes = {}
    for i, m in enumerate(machine.magnets):
        if m.has_geometry:
            numbers = {"current_stiffness": current_stiffness(m), "negative_stiffness": negative_stiffness(m)}
            cleared = dict.fromkeys(("turns", "pole_area"))
            changes[f"magnets[{i}]"] = replace(m, {**cleared, **{k: float(v) for k, v in numbers.items()}})
    return replace(machine, changes) if changes else machine
