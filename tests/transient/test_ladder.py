"""Doubling short steps gives what other methods find for long ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg as sla
from scipy.integrate import quad_vec

import amb_design as ad
from amb_design.transient import ladder
from checks import within_absolute


@pytest.mark.parametrize("large", [0, 10_000])
def test_motion_works_and_moments(monkeypatch: pytest.MonkeyPatch, large: int) -> None:
    monkeypatch.setattr(ladder, "LARGE", large)
    random = np.random.default_rng(3)
    n, b, h = 5, 2, 0.7
    A, B = random.standard_normal((n, n)) - 2.0 * np.eye(n), random.standard_normal((n, b))
    forms = random.standard_normal((3, n, n))
    forms, velocities = forms + forms.transpose(0, 2, 1), random.standard_normal((b, n))
    rung = ladder.Ladder(A, B, forms, velocities).at(h)
    F = np.zeros((n + 3 * b, n + 3 * b))
    F[:n, : n + b], F[n : n + 2 * b, n + b :] = np.hstack([A, B]), np.eye(2 * b)
    within_absolute(rung.motion, sla.expm(h * F)[:n], 1e-12, "motion")

    def moving(t: float) -> np.ndarray:
        x = sla.expm(t * F)[:n]
        powers = np.array([t**j / math.factorial(j) for j in range(ladder.MOMENTS)])
        return np.concatenate([(x.T @ forms @ x).ravel(), np.multiply.outer(powers, velocities @ x).ravel()])

    expected, _ = quad_vec(moving, 0.0, h, epsabs=1e-13, epsrel=1e-13)
    found = np.concatenate([rung.works.ravel(), rung.moments.ravel()])
    within_absolute(found, expected, 1e-11, "integrals")


def test_a_machine_without_magnets_and_damping() -> None:
    """No input but the loads, no work but theirs."""
    machine = ad.replace(ad.load("friswell-5-9-1"), {"rotor.disks[0].unbalance": 1e-3, "rotor.shaft.elements": 6})
    exact = ad.simulate(machine, 0.05, speed=100.0, linear=True, step=1e-3)
    found = ad.simulate(machine, 0.05, speed=100.0, step=1e-3)
    size = exact.radius(0.5).max()
    within_absolute(found.at(0.5) / size, exact.at(0.5) / size, 1e-6, "motion")
    within_absolute(found.energy_error, np.zeros(51), 1e-6, "energy over gross work")
