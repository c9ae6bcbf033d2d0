"""Why a controller cannot exist."""

from __future__ import annotations

import numpy as np

from .riccati import Array

STILL = 1e-3
"""Modes that decay more slowly than this [1/s] need control."""

LOST = 1e-7
"""A mode closer to being out of reach than this fraction of the plant's norm counts as such."""

WEIGHTS = "no regulator and observer are found with these weights; make weights and noises less extreme"
"""What remains to be said if every mode is in reach."""

SLOW = 0.01
"""Frequency [Hz] below which a computed one is taken for zero."""


def obstacle(A: Array, B: Array, C: Array | None = None) -> str:
    """Which mode keeps a stabilising controller from existing, by the test of Popov, Belevitch and Hautus.

    Parameters
    ----------
    A, B : ndarray
        Plant, and what moves it; time in seconds.
    C : ndarray, optional
        What is seen of it; all if left out.

    Returns
    -------
    str
        What is wrong and what to do; empty if every mode is in reach.
    """
    size = np.linalg.norm(A, 2)

    def lost(value: complex, x: Array, axis: int) -> bool:
        joined = np.concatenate([A - value * np.eye(len(A)), x * (size / (np.linalg.norm(x, 2) or 1.0))], axis=axis)
        return bool(np.linalg.svd(joined, compute_uv=False)[-1] < LOST * size)

    for value in sorted(np.linalg.eigvals(A), key=lambda v: -v.real):
        if value.real < -STILL:
            break
        hertz = abs(value.imag) / (2.0 * np.pi)
        mode = f"the mode at {hertz:.4g} Hz" if hertz > SLOW else "a motion that does not oscillate"
        remedy = "place them elsewhere or leave it to a bearing"
        if lost(value, B, 1):
            return f"{mode} cannot be moved by the magnets; {remedy}"
        if C is not None and lost(value, C, 0):
            return f"{mode} cannot be seen by the sensors; {remedy}"
    return ""
