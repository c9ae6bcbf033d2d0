"""Quantities that need no dynamics of the loop: mass, losses, strength, torsion."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ...analysis.system import Array
from ...model import strength
from ...spec.problem_parts import Measure
from ..loop_family import LoopFamily
from .samples import Samples, rpm_text

QUANTITIES = ("mass", "copper_loss", "bias_current", "hoop_strain", "surface_speed", "torsional_ratio")


class Statics:
    """Samples of static quantities.

    Parameters
    ----------
    loops : LoopFamily
    measures : sequence of Measure
        Those of them that are in ``QUANTITIES``.
    """

    def __init__(self, loops: LoopFamily, measures: Sequence[Measure]):
        self.names = [m.quantity for m in measures]
        machine, end = loops.machine, ca.SX.sym("end")
        self._functions = {}
        for m in measures:
            if m.quantity == "torsional_ratio":
                continue
            out = ca.SX(ca.vertcat(*_formula(m, machine, end)))
            self._functions[m.quantity] = ca.Function(
                m.quantity, [loops.p, end], [out, ca.jacobian(out, loops.p), ca.jacobian(out, end)]
            )
        self._torsion = None
        if "torsional_ratio" in self.names:
            stiffness, inertia = (ca.SX(x) for x in strength.torsion(machine, loops.plant.mesh))
            a, b = (ca.SX.sym(n, stiffness.shape[0]) for n in ("a", "b"))
            forms = [ca.bilin(x, a, b) for x in (stiffness, inertia)]
            slopes = [ca.jacobian(f, loops.p) for f in forms]
            self._torsion = ca.Function("torsion", [loops.p, a, b], [stiffness, inertia, *slopes])
            self._nodes = stiffness.shape[0]

    def samples(self, p: Array, end: float) -> dict[str, Samples]:
        """Values at a design and an end of the range of speeds [rad/s]."""
        out = {}
        for name, f in self._functions.items():
            values, slopes, rates = (x.full() for x in f(p, end))
            k = len(values)
            where = tuple(f"{name.replace('_', ' ')} {i}" if k > 1 else name.replace("_", " ") for i in range(k))
            depends = rates.any()
            speeds = np.full(k, end if depends else np.nan)
            out[name] = Samples(values[:, 0], slopes, rates[:, 0], where, speeds, where, np.zeros(k, complex))
        if self._torsion is not None:
            out["torsional_ratio"] = self._torsional(p, end)
        return out

    def _torsional(self, p: Array, end: float) -> Samples:
        assert self._torsion is not None
        zero = np.zeros(self._nodes)
        stiffness, inertia = (x.full() for x in self._torsion(p, zero, zero)[:2])
        squares, shapes = sla.eigh(stiffness, inertia, subset_by_index=(1, 1))
        v = shapes[:, 0]
        _, _, dk, dj = (x.full() for x in self._torsion(p, v, v))
        frequency = float(np.sqrt(squares[0]))
        slope = (dk - squares[0] * dj)[0] / (2.0 * frequency)
        ratio = frequency / end
        where = f"torsion at {frequency / (2.0 * np.pi):.4g} Hz, {rpm_text(end)}"
        rate = np.array([-ratio / end])
        return Samples(
            np.array([ratio]), slope[None] / end, rate, (where,), np.array([end]), ("",), np.zeros(1, complex)
        )


def _formula(measure: Measure, machine, end: ca.SX) -> list:  # type: ignore[no-untyped-def, type-arg]
    if measure.quantity == "mass":
        return [strength.rotor_mass(machine)]
    if measure.quantity == "copper_loss":
        return [strength.copper_loss(machine)]
    if measure.quantity == "bias_current":
        return [m.bias_current for m in machine.magnets]
    if measure.quantity == "hoop_strain":
        return strength.hoop_strain(machine, measure.option("overspeed") * end)
    return strength.surface_speed(machine, end, measure.option("disks"))
