"""Separation of critical speeds from the service speed."""

from __future__ import annotations

import numpy as np

from ...analysis.system import Array
from ..state import State
from .samples import Samples, joined, rpm_text

AMPLIFIED = 1.0 / (2.0 * 2.5)
"""Modes with a larger damping ratio have an amplification factor below 2.5 and need no margin (API 617)."""


def separation(state: State, service: float, complex_form: bool) -> Samples:
    """Distance of the critical speeds from the service speed, relative to it.

    Parameters
    ----------
    state : State
    service : float
        Service speed [rad/s].
    complex_form : bool
        Then forward critical speeds have positive frequencies; in the real form both directions count.
    """
    unit = 1j * np.eye(state.size) - state.a1
    candidates = np.linalg.eigvals(np.linalg.solve(unit, state.a0))
    near = candidates.real[(candidates.real > 0.2 * service) & (candidates.real < 3.0 * service)]
    near = near[np.abs(candidates.imag[np.isin(candidates.real, near)]) < 0.5 * near]
    found: list[tuple[float, Samples]] = []
    for start in near:
        sample = _crossing(state, float(start), service)
        if sample is not None and all(abs(sample[0] - other) > 1e-6 * service for other, _ in found):
            found.append(sample)
    return joined([s for _, s in found], state.member.family.parameters)


def _crossing(state: State, speed: float, service: float) -> tuple[float, Samples] | None:
    for _ in range(8):
        spectra = state.spectra(np.array([speed]))
        values = spectra.values[0]
        k = int(np.argmin(np.abs(values.imag - speed) + 0.1 * np.abs(values.real)))
        right, left = spectra.right[0][:, k], spectra.left[0][k]
        rate = left @ state.a1 @ right
        step = (values[k].imag - speed) / (1.0 - rate.imag)
        if abs(step) < 1e-10 * service:
            break
        if abs(step) > 0.5 * speed:
            return None
        speed += float(step)
    else:
        return None
    if -values[k].real > AMPLIFIED * abs(values[k]):
        return None
    slopes, _ = state.eigenvalue_slopes(values[k : k + 1], np.array([speed]), right[None], left[None])
    moves: Array = slopes.imag / (1.0 - rate.imag) / service
    side = 1.0 if speed > service else -1.0
    where = f"critical speed at {rpm_text(speed)}"
    margin = np.array([side * (speed / service - 1.0)])
    at = np.array([speed])
    return speed, Samples(margin, side * moves, np.zeros(1), (where,), at, ("",), at + 0j)
