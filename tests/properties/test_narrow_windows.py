"""Narrow windows of instability at known speeds: the certified walk finds every one, a sweep of 1000 speeds none.

A pair of modes with the matrix

    i w - d + [[i delta, c], [c, -i delta]],   delta = a (Omega - W)

has the eigenvalues i w - d +- sqrt(c^2 - delta^2): stable but for abs(Omega - W) < sqrt(c^2 - d^2)/a. It is affine in the
speed. Stable modes are set beside it, in half of the families one that becomes unstable for good at a known higher speed,
and a random similarity transformation mixes them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.linalg import block_diag

from amb_design.analysis.certificate import Crossing, Range, Walk
from amb_design.threads import one_thread

WIDTHS = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7]
FAMILIES = 24  # for each width, half of them real
SWEEP = 1000


@dataclass(frozen=True)
class Family:
    """A pencil A0 + Omega A1 with its crossings, (speed, becomes unstable), from low to high speed."""

    a0: np.ndarray
    a1: np.ndarray
    top: float
    crossings: tuple[tuple[float, bool], ...]


def family(width: float, seed: int) -> Family:
    """A window of this width, relative to the speed of its middle."""
    rng = np.random.default_rng([seed, round(-np.log10(width))])
    top = 10.0 ** rng.uniform(2.5, 4.0)
    spacing = top / SWEEP
    # the window lies between two speeds of the sweep and is narrower than their distance
    highest = min(0.9 * SWEEP, 0.95 / width)
    middle = (rng.integers(2, int(highest)) + 0.5) * spacing
    half = 0.5 * width * middle

    rate = rng.uniform(0.2, 1.0) * rng.choice([-1.0, 1.0])
    damping = middle * 10.0 ** rng.uniform(-4.0, -2.0)
    coupling = np.hypot(damping, rate * half)
    frequency = rng.uniform(0.1, 1.0) * middle
    turn = 1j * rate * np.diag([1.0, -1.0])
    blocks0 = [(1j * frequency - damping) * np.eye(2) - middle * turn + coupling * np.array([[0, 1], [1, 0]])]
    blocks1 = [turn]
    crossings = [(middle - half, True), (middle + half, False)]

    for _ in range(rng.integers(4, 12)):  # stable at every speed
        decay = top * 10.0 ** rng.uniform(-4.0, 0.0)
        blocks0.append(np.array([[-decay + 1j * rng.uniform(-2.0, 2.0) * top]]))
        blocks1.append(np.array([[1j * rng.uniform(-0.5, 0.5) - rng.uniform(0.0, 1e-3)]]))
    if seed % 4 < 2:  # unstable for good above a speed behind the window
        last = rng.uniform(middle + 2 * half, top)
        growth = 10.0 ** rng.uniform(-3.0, -1.0)
        blocks0.append(np.array([[-growth * last + 1j * rng.uniform(0.1, 1.0) * top]]))
        blocks1.append(np.array([[growth + 0.1j]]))
        crossings.append((last, True))

    a0, a1 = block_diag(*blocks0), block_diag(*blocks1)
    n = len(a0)
    mix = np.eye(n) + 0.3 * (rng.standard_normal((n, n)) + 1j * rng.standard_normal((n, n))) / np.sqrt(n)
    a0, a1 = (mix @ a @ np.linalg.inv(mix) for a in (a0, a1))
    if seed % 2:  # real matrices have the conjugate eigenvalues too
        a0, a1 = (np.block([[a.real, -a.imag], [a.imag, a.real]]) for a in (a0, a1))
        turned, _ = np.linalg.qr(rng.standard_normal((2 * n, 2 * n)))
        a0, a1 = turned.T @ a0 @ turned, turned.T @ a1 @ turned
    return Family(a0, a1, top, tuple(crossings))


def swept_onset(f: Family) -> float:
    """First speed of the sweep with an unstable eigenvalue; infinite if there is none."""
    speeds = np.linspace(0.0, f.top, SWEEP + 1)
    largest = np.linalg.eigvals(f.a0 + speeds[:, None, None] * f.a1).real.max(axis=1)
    unstable = np.flatnonzero(largest > 0.0)
    return float(speeds[unstable[0]]) if len(unstable) else np.inf


@one_thread
def check(width: float, seed: int) -> tuple[float, int]:
    """Worst relative error of the crossings, and eigendecompositions."""
    f = family(width, seed)
    onset, window_end = f.crossings[0][0], f.crossings[1][0]
    assert swept_onset(f) > window_end, "the sweep sees the window: it is planted wrongly"

    walk = Walk(f.a0, f.a1)
    events = list(walk.events(f.top))
    found = [e for e in events if isinstance(e, Crossing)]
    what = f"width {width:g}, seed {seed}"
    assert [c.onset for c in found] == [unstable for _, unstable in f.crossings], what
    errors = []
    for crossing, (speed, _) in zip(found, f.crossings, strict=True):
        assert crossing.lower <= speed * (1.0 + 1e-8), what
        assert crossing.upper >= speed * (1.0 - 1e-8), what
        errors.append(abs(crossing.lower / speed - 1.0))
    ranges = [e for e in events if isinstance(e, Range)]
    assert ranges[0].start == 0.0
    assert ranges[-1].stop == f.top
    per_crossing = 2 if np.isrealobj(f.a0) else 1
    assert [r.unstable // per_crossing for r in ranges] == [0, 1, 0, 1][: len(ranges)], what
    assert errors[0] <= 1e-6, what
    # the walk resolves 2e-8 of the speed, also where that is not much less than the window
    assert max(errors) <= 3e-8, what
    assert onset <= window_end
    return max(errors), walk.eigendecompositions


@pytest.mark.parametrize("width", WIDTHS)
def test_windows_are_found(width: float) -> None:
    results = [check(width, seed) for seed in range(FAMILIES)]
    errors, spent = zip(*results, strict=True)
    print(
        f"relative width {width:g}: {len(results)} of {FAMILIES} windows found, none by the sweep; worst error "
        f"{max(errors):.1e} of the speed; eigendecompositions {min(spent)} to {max(spent)}, mean {np.mean(spent):.0f}"
    )


def test_landing_on_a_crossing_exactly() -> None:
    """The tangent of an affine eigenvalue predicts its crossing to the last bit, where nothing can be certified."""
    walk = Walk(np.array([[-1.0]]), np.array([[2.0**-10]]), budget=20)
    assert walk.at(1024.0).values == 0.0
    events = list(walk.events(3000.0))
    crossings = [e for e in events if isinstance(e, Crossing)]
    assert [c.onset for c in crossings] == [True]
    assert 1024.0 * (1 - 3e-8) <= crossings[0].lower <= 1024.0 <= crossings[0].upper <= 1024.0 * (1 + 3e-8)
