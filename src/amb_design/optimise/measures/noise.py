"""Control current from the noise of the displacement sensors, from the eigenvalues at hand.

The variance is a sum over pairs of modes (the Lyapunov equation in modal coordinates, see analysis/noise.py), and so is
its adjoint; with both, every derivative is a sum of bilinear forms of the matrices' derivatives, one for each mode.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from ...analysis.noise import check_filtered
from ...analysis.system import Array
from ...spec.problem_parts import Measure
from ..loop_family import LoopFamily
from ..state import State
from .modes import SLOW
from .samples import Samples, joined, rpm_text

QUANTITIES = ("noise_current", "noise_current_ratio")

LEAST = 1e-4
"""Damping, measured as stability is, below which a mode counts by the tangent of one over its damping. An unstable loop has no
variance; so it has one that falls towards stability."""


class NoiseMeasures:
    """Samples of the noise currents.

    Parameters
    ----------
    loops : LoopFamily
    measures : sequence of Measure
        Those of them that are in ``QUANTITIES``.
    above : mapping of str to float
        By quantity the value below which it need not be followed.

    Raises
    ------
    ModelError
        If a controller passes on noise of any frequency.
    """

    def __init__(self, loops: LoopFamily, measures: Sequence[Measure], above: Mapping[str, float]):
        self.loops, self.measures, self.above = loops, tuple(measures), above
        member = loops.family.at(np.array(list(loops.problem.start().values())))
        self.names = [axis.name for axis in loops.plant.loops]
        count = len(self.names)
        check_filtered(member.part("C")[count : 2 * count], member.part("G"), loops.displacements, self.names)
        bias = ca.SX(0, 1)
        if any(m.quantity == "noise_current_ratio" for m in measures):
            bias = ca.SX(ca.vertcat(*[loops.machine.magnets[k].bias_current for k in loops.axes]))
        self._bias = ca.Function("bias", [loops.p], [bias, ca.jacobian(bias, loops.p)])

    def samples(self, state: State, fractions: Array, end: float) -> dict[str, Samples]:
        """Noise currents of all loops.

        Parameters
        ----------
        state : State
        fractions : ndarray, shape (s,)
            Speeds as fractions of the end of the range.
        end : float
            End of the range [rad/s].
        """
        views = [_View(state, float(f), end, len(self.names)) for f in fractions]
        bias, slopes = (m.full() for m in self._bias(state.member.p))
        out = {}
        for m in self.measures:
            ratio = m.quantity == "noise_current_ratio"
            found = []
            for j in range(len(self.names)):
                scale = m.option("noise") / (bias[j, 0] if ratio else 1.0)
                relative = slopes[j] / bias[j, 0] if ratio else np.zeros(len(state.member.p))
                found += [
                    self._sample(view, j, scale, relative)
                    for view in views
                    if scale * view.sizes[j] >= self.above.get(m.quantity, 0.0)
                ]
            out[m.quantity] = joined(found, state.member.family.parameters)
        return out

    def heights(self, state: State, fractions: Array, end: float) -> dict[str, Array]:
        """Noise currents, shape (s, loops), for a look: without derivatives.

        Parameters
        ----------
        state, fractions, end
            As for `samples`.
        """
        sizes = np.array([_View(state, float(f), end, len(self.names)).sizes for f in fractions])
        bias = self._bias(state.member.p)[0].full()[:, 0]
        ratio = {m.quantity: m.quantity == "noise_current_ratio" for m in self.measures}
        return {m.quantity: m.option("noise") * sizes / (bias if ratio[m.quantity] else 1.0) for m in self.measures}

    def _sample(self, view: _View, loop: int, scale: float, relative: Array) -> Samples:
        value, (slopes, rate) = view.sizes[loop], view.slopes(loop)
        where = f"{self.names[loop]}, {rpm_text(view.speed)}"
        return Samples(
            np.array([scale * value]),
            scale * (slopes - value * relative)[None],
            np.array([scale * view.fraction * rate]),
            (where,),
            np.array([view.speed]),
            (f"{view.fraction} {loop}",),
            np.zeros(1, complex),
        )


class _View:
    """Currents at one speed, for noise of one m/sqrt(Hz)."""

    def __init__(self, state: State, fraction: float, end: float, loops: int):
        self.state, self.fraction, self.speed, self.loops = state, fraction, fraction * end, loops
        spectra = state.spectra(np.array([self.speed]))
        self.values, self.right, self.left = spectra.values[0], spectra.right[0], spectra.left[0]
        least = LEAST * np.maximum(np.abs(self.values.imag), SLOW)
        decay = -self.values.real
        bent = np.maximum(2.0 * least - decay, least) / least  # least over the decay that counts
        self.turned = np.where(decay < least, 1.0 / bent**2, 1.0)
        """Derivative of the decay that counts with respect to the true one."""
        counted = np.where(decay < least, -least / bent, -decay) + 1j * self.values.imag
        self.pairs = -1.0 / (counted[:, None] + counted.conj())
        f, g, c = state.ports
        self.enter = self.left @ f + self.values[:, None] * (self.left @ g)
        self.leave = c[loops : 2 * loops] @ self.right
        self.covariance = self.pairs * (self.enter @ self.enter.conj().T)
        self._slopes: dict[int, tuple[Array, float]] = {}

    @cached_property
    def _coupling(self) -> Array:
        return np.asarray(self.left @ self.state.a1 @ self.right)

    @cached_property
    def sizes(self) -> Array:
        """Rms current of each loop."""
        variance = ((self.leave @ self.covariance) * self.leave.conj()).sum(axis=1).real / 2.0
        return np.asarray(np.sqrt(np.maximum(variance, np.finfo(float).tiny)))

    def slopes(self, loop: int) -> tuple[Array, float]:
        """Derivatives of the rms current of a loop with respect to variables and speed."""
        if loop not in self._slopes:
            changes, rate = self._variance_slopes(loop)
            factor = 0.5 / self.sizes[loop]  # of 2 Re(...)/2 for the variance
            self._slopes[loop] = changes.real * factor, float(rate.real) * factor
        return self._slopes[loop]

    def _variance_slopes(self, loop: int) -> tuple[Array, complex]:
        """tr(Z dA P) + tr(Z dB B^H) + dC P C^H, with the adjoint Z of a loop's variance C P C^H."""
        state, member, out = self.state, self.state.member, self.leave[loop].conj()
        adjoint = self.pairs.conj() * np.outer(out, out.conj())
        weights = self.covariance @ adjoint
        own = np.diagonal(weights)
        np.fill_diagonal(weights, self.turned * own.real + 1j * own.imag)
        x, y = state.lifted(self.right.T, weights @ self.left)
        slopes = state.forms(y, x, self.values, np.full(len(y), self.speed)).sum(axis=0)
        rate = (weights.T * self._coupling).sum()
        more, faster = self._input_slopes(self.enter.conj().T @ adjoint)
        row = np.zeros((1, member.family.shapes["C"][0]))
        row[0, self.loops + loop] = 1.0
        seen, _ = state.lifted((self.right @ (self.covariance @ out))[None], self.left[:1])
        return slopes + more + member.form("C", row, seen)[0], rate + faster

    def _input_slopes(self, weights: Array) -> tuple[Array, complex]:
        """Sum over the sensors of w dB, for rows w in modal coordinates; B = F + A G."""
        state, member = self.state, self.state.member
        f, g, _ = state.ports
        matrix = state.a0 + self.speed * state.a1
        speeds, still, unit = np.full(self.loops, self.speed), np.zeros(self.loops), np.eye(self.loops)
        x, y = state.lifted((f + matrix @ g).T, weights @ self.left)
        slopes = member.form("F", y, unit)
        if "E" in member.family.shapes:
            slopes = slopes - member.form("E", y, x)
        if not g.any():
            return slopes.sum(axis=0), 0.0
        x, y_rate = state.lifted(g.T, (weights * self.values) @ self.left)
        slopes = slopes + state.forms(y, x, still, speeds) + member.form("G", y_rate, unit)
        if "E" in member.family.shapes:
            slopes = slopes - member.form("E", y_rate, x)
        return slopes.sum(axis=0), np.einsum("ki,ik->", weights @ self.left, state.a1 @ g)
