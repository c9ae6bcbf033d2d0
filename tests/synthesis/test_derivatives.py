"""Derivatives of Riccati solutions, laws and closed loops against differences of fourth order."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.optimise.loop_family import LoopFamily, loop_family
from amb_design.synthesis.riccati import Data, derivatives, solve
from amb_design.synthesis.tuned import TunedLaw
from synthesis.levitated import lqg, rotor, small, uneven

TOLERANCE = 1e-5

WEIGHTS = (
    *("displacement", "velocity", "modal_velocity", "current", "current_rate", "integral"),
    *("sensor_noise", "force_noise", "modal_noise", "current_noise", "design_speed"),
)
HARDWARE = ("low_pass.frequency", "notches[0].damping", "delay", "amplifier.bandwidth", "sensor_gain")
ROTOR = (
    *(
        "magnets[0].bias_current",
        "rotor.disks[0].mass",
        "rotor.shaft.segments[0].outer_diameter",
        "sensors[0].position",
    ),
    *("rotor.shaft.segments[0].material.E", "rotor.shaft.viscous_damping"),
)
FREE = (*(f"controller.{name}" for name in (*WEIGHTS, *HARDWARE)), *ROTOR)

STEPS = (0.01, 0.03, 0.001)
"""Of the differences, in terms of the number; the best counts, for places along the shaft want small steps and gains large ones."""

DAMPED = {"rotor.shaft.hysteretic_damping": 0.01}
"""So much that the imaginary parts of the observer at rest, which come of it alone, stand out of the rounding of the real ones."""

DOUBLE_POLE = {"controller.notches": (ad.Notch(frequency=5200.0, damping=0.35),)}
"""A notch of width 1, whose poles share an eigenvector: then the observer has no basis of eigenvectors."""

CASES = {
    "fixed": rotor(lqg()),
    "scheduled": ad.replace(small(lqg(scheduled=True, design_speed=1500.0)), DAMPED),
    "real form": uneven(lqg(scheduled=True), small),
    "double poles": ad.replace(small(lqg()), DOUBLE_POLE),
}


def differences(f: Callable[[np.ndarray], np.ndarray], p: np.ndarray, k: int, h: float) -> np.ndarray:
    step = np.zeros(len(p))
    step[k] = h
    near, far = (f(p + i * step) - f(p - i * step) for i in (1, 2))
    return np.asarray((8.0 * near - far) / (12.0 * h))


@pytest.mark.parametrize("seed", range(3))
def test_riccati(seed: int) -> None:
    """Random complex data, unstable, in three parameters; relative to the largest entry."""
    rng = np.random.default_rng(seed)

    def random(*shape: int) -> np.ndarray:
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    n, m = 8, 2
    a, b, c, r = random(4, n, n), random(4, n, m), random(4, n, n), rng.uniform(1.0, 2.0, size=(4, m))

    def at(p: np.ndarray) -> Data:
        a_p, b_p, c_p, r_p = (x[0] + 0.1 * np.tensordot(p, x[1:], 1) for x in (a, b, c, r))
        return Data(a_p, b_p, c_p.conj().T @ c_p, r_p)

    def slopes(p: np.ndarray) -> Data:
        c_p = c[0] + 0.1 * np.tensordot(p, c[1:], 1)
        half = 0.1 * c_p.conj().T @ c[1:]
        return Data(0.1 * a[1:], 0.1 * b[1:], half + half.conj().swapaxes(1, 2), 0.1 * r[1:])

    p = rng.normal(size=3)
    dX, dK = derivatives(at(p), slopes(p), solve(at(p)))
    for k in range(3):
        for name, exact in (("X", dX), ("K", dK)):
            expected = differences(lambda q, name=name: getattr(solve(at(q)), name), p, k, 1e-2)
            error = np.abs(exact[k] - expected).max() / np.abs(expected).max()
            assert error <= 1e-6, f"d{name}: {error:.1e}"


def tuned(machine: ad.Machine) -> tuple[TunedLaw, np.ndarray]:
    p = ca.SX.sym("p", len(FREE))
    symbolic = ad.replace(machine, {name: p[k] for k, name in enumerate(FREE)})
    values = dict(ad.numbers(machine))
    return TunedLaw(p, symbolic, machine), np.array([float(values[name]) for name in FREE])


def matrices(law: TunedLaw) -> dict[str, np.ndarray]:
    """Which numbers belong to the same matrix."""
    owners = np.array([str(x).split("_")[0] for x in law.numbers.elements()])
    return {owner: np.flatnonzero(owners == owner) for owner in dict.fromkeys(owners)}


def off(exact: np.ndarray, expected: np.ndarray, values: np.ndarray, number: float) -> float:
    """Error of derivatives, relative to the largest, or to what moves the values by a thousandth."""
    largest = max(np.abs(expected).max(), 1e-3 * np.abs(values).max() / number)
    return float(np.abs(exact - expected).max() / largest)


@pytest.mark.parametrize("name", CASES)
def test_law(name: str) -> None:
    """Entries of a, b and c of each part of the law, relative to the largest change in the same matrix.

    Of matrices that a number moves by less than a thousandth of themselves (the integrals' gains by the low-pass, for one) the
    error is relative to that.
    """
    law, p = tuned(CASES[name])
    values, slopes = law.at(p)
    assert values.shape == law.numbers.shape[:1]
    worst = (0.0, "")
    names = FREE if name in ("fixed", "scheduled") else FREE[::3]
    for free in names:
        k = FREE.index(free)
        error = 1.0
        for step in STEPS:
            expected = differences(lambda q: law.at(q)[0], p, k, step * p[k])
            error = min(error, max(off(slopes[w, k], expected[w], values[w], p[k]) for w in matrices(law).values()))
            if error < 0.1 * TOLERANCE:
                break
        worst = max(worst, (error, free))
        assert error <= TOLERANCE, f"{free}: {error:.1e}"
    print(f"law, {name}, {len(names)} numbers: worst error {worst[0]:.1e} ({worst[1]})")


@pytest.mark.parametrize("name", CASES)
def test_tuned_law_is_the_designed_one(name: str) -> None:
    """At the machine's own numbers the entries are those of `synthesise`."""
    law, p = tuned(CASES[name])
    values, _ = law.at(p)
    designed, symbolic = ad.synthesise(CASES[name]).controller, law.machine.controller
    for part in ("law", "cross", "law_rate", "cross_rate"):
        ours, theirs = getattr(symbolic, part), getattr(designed, part)
        assert (ours is None) == (theirs is None)
        for entry in "abc" if ours else "":
            found = ca.Function("f", [law.numbers], [getattr(ours, entry)])(values).full()
            expected = np.array(getattr(theirs, entry))
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8 * np.abs(expected).max())


SOUGHT = (
    *("controller.displacement", "controller.current", "controller.force_noise", "controller.design_speed"),
    *("controller.amplifier.bandwidth", "magnets[0].bias_current", "rotor.shaft.segments[0].outer_diameter"),
)


def problem(machine: ad.Machine, sought: tuple[str, ...]) -> ad.DesignProblem:
    values = dict(ad.numbers(machine))
    return ad.DesignProblem(
        machine,
        maximise="stability_limit",
        free={name: (0.9 * float(values[name]), 1.1 * float(values[name])) for name in sought},
        scenarios={"hot": {"magnets[0].gap": 1.04, "controller.delay": 1.1}},
    )


@pytest.mark.parametrize(
    ("name", "scenario", "sought"), [("scheduled", False, SOUGHT), ("real form", True, SOUGHT[3:6])]
)
def test_family(name: str, scenario: bool, sought: tuple[str, ...]) -> None:
    """Nonzeros of all matrices of the closed loop, and an eigenvalue, in terms of weights and machine."""
    task = problem(CASES[name], sought)
    loops = loop_family(task, task.cases[0] if scenario else None)
    p = np.array(list(task.start().values()))
    member = loops.family.at(p)
    jacobian = member.jacobian.toarray()
    worst = 0.0
    for k, free in enumerate(sought):
        expected = differences(lambda q: loops.family.at(q).values, p, k, STEPS[0] * p[k])
        for where, *_ in loops.family.slots.values():
            if where.stop > where.start:
                error = off(jacobian[where, k], expected[where], member.values[where], p[k])
                worst = max(worst, error)
                assert error <= TOLERANCE, f"{free}: {error:.1e}"
    print(f"family, {name}, scenario {scenario}: worst error {worst:.1e}")
    eigenvalue_moves(loops, p)


def eigenvalue_moves(loops: LoopFamily, p: np.ndarray, speed: float = 200.0) -> None:
    """The least damped eigenvalue below 10 kHz against differences."""

    def matrix(q: np.ndarray) -> np.ndarray:
        m = loops.family.at(q)
        return np.linalg.solve(m.part("E"), m.part("A0") + speed * m.part("A1"))

    values, right = np.linalg.eig(matrix(p))
    slow = np.flatnonzero((np.abs(values.imag) < 6e4) & (np.abs(values.imag) > 1.0))
    k = int(slow[np.argmax(values.real[slow])])
    member = loops.family.at(p)
    x = right[:, k]
    left = np.linalg.inv(right)[k] @ np.linalg.inv(member.part("E"))
    exact = member.form("A0", left[None], x[None]) + speed * member.form("A1", left[None], x[None])
    exact = (exact - values[k] * member.form("E", left[None], x[None]))[0]

    def near(q: np.ndarray) -> np.ndarray:
        found = np.linalg.eigvals(matrix(q))
        return found[[int(np.argmin(np.abs(found - values[k])))]]

    expected = np.array([differences(near, p, i, STEPS[0] * p[i])[0] for i in range(len(p))])
    errors = np.abs((exact - expected) * p) / np.abs(expected * p).max()
    assert np.abs(expected * p).min() > 1e-6 * abs(values[k])
    print(f"eigenvalue {values[k]:.4g}: {errors.max():.1e}")
    assert errors.max() <= TOLERANCE
