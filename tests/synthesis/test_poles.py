"""Poles of regulator and observer against python-control, and where they are found again in closed loops."""

from __future__ import annotations

import dataclasses

import control
import numpy as np
import pytest

import amb_design as ad
from amb_design.synthesis.lqg import Gains, gains, law_of, observer_data, regulator_data
from amb_design.synthesis.plant import PACE
from amb_design.synthesis.regulator import regulator
from synthesis.levitated import apart, lqg, lqr, rotor, small, synthesis_plant, uneven, widened

NONE = np.zeros(0)
MACHINES = {
    "fixed": rotor(lqg()),
    "scheduled": rotor(lqg(scheduled=True)),
    "designed at rest, no integrals": rotor(lqg(integral=None, design_speed=0.0)),
    "few weights": rotor(
        lqg(velocity=None, modal_velocity=None, current_rate=None, modal_noise=0.0, current_noise=0.0)
    ),
    "real form": uneven(lqg()),
}
every_machine = pytest.mark.parametrize("name", MACHINES)


def speeds(machine: ad.Machine) -> list[float]:
    law = machine.controller
    return [0.0, law.design_speed] if law.scheduled else [law.design_speed]


def doubled(poles: np.ndarray) -> np.ndarray:
    return np.concatenate([poles, poles.conj()])


@every_machine
def test_against_python_control(name: str) -> None:
    """Complex matrices are widened, for python-control is real; tolerance 1e-8."""
    plant = synthesis_plant(MACHINES[name])
    worst = 0.0
    for speed in speeds(MACHINES[name]):
        found = gains(plant, speed, NONE)
        data, _ = regulator_data(plant, speed, NONE)
        a, b, q = widened(data.A), widened(data.B), widened(data.Q)
        _, _, poles = control.lqr(a, b, q, np.diag(np.tile(data.R, 2)))
        worst = max(worst, apart(doubled(found.regulator.poles), poles))
        data, _ = observer_data(plant, speed, NONE)
        a, c, w = widened(data.A.conj().T), widened(data.B.conj().T), widened(data.Q)
        _, _, poles = control.lqe(a, np.eye(len(a)), c, (w + w.T) / 2.0, np.diag(np.tile(data.R, 2)))
        worst = max(worst, apart(doubled(found.observer.poles), poles))
    print(f"poles, {name}: {worst:.1e}")
    assert worst <= 1e-8


def test_ideal_regulator_against_python_control() -> None:
    data, solution = regulator(rotor(lqr()))
    _, _, poles = control.lqr(widened(data.A), widened(data.B), widened(data.Q), np.diag(np.tile(data.R, 2)))
    error = apart(doubled(solution.poles), poles)
    print(f"poles of the ideal regulator: {error:.1e}")
    assert error <= 1e-8


def poles_of(found: Gains) -> np.ndarray:
    """Regulator's and observer's; the observer solves the adjoint equation."""
    return np.asarray(PACE * np.concatenate([found.regulator.poles, found.observer.poles.conj()]))


def closed(plant, law, speed: float) -> np.ndarray:
    """Eigenvalues of the synthesis plant with a law."""
    v = plant.values
    a, b, c = (law.constant[k] + (speed * law.rate[k] if law.rate else 0.0) for k in "abc")
    return np.linalg.eigvals(np.block([[v["A0"] + speed * v["A1"], v["B"] @ c], [b @ v["C"], a]]))


@every_machine
def test_separation(name: str) -> None:
    """The reduced plant with its law has the poles of regulator and observer, integrals included; tolerance 1e-8."""
    machine = MACHINES[name]
    plant = synthesis_plant(machine)
    law = law_of(plant, machine.controller.design_speed, NONE, machine.controller.scheduled)
    for speed, found in zip(speeds(machine), law.gains, strict=True):
        expected = poles_of(found)
        error = apart(expected, closed(plant, law, speed))
        print(f"separation, {name}, {speed} rad/s: {error:.1e}")
        assert error <= 1e-8


@pytest.mark.parametrize("machine", [small(lqg()), small(lqg(scheduled=True)), uneven(lqg(), small)])
def test_whole_machine(machine: ad.Machine) -> None:
    """With all modes of the mesh nothing is left out: then the machine itself has these poles; tolerance 1e-8."""
    modes = 18
    machine = ad.replace(machine, {"controller": dataclasses.replace(machine.controller, modes=modes)})
    loop = ad.system(machine)
    assert loop.displacements == modes * (1 if loop.complex_form else 2)
    plant = synthesis_plant(machine)
    law = law_of(plant, machine.controller.design_speed, NONE, machine.controller.scheduled)
    for speed, found in zip(speeds(machine), law.gains, strict=True):
        expected = poles_of(found)
        error = apart(expected, np.linalg.eigvals(loop.matrix(speed)))
        print(f"whole machine, {machine.name}, scheduled {machine.controller.scheduled}, {speed} rad/s: {error:.1e}")
        assert error <= 1e-8


def test_between_the_speeds_of_a_schedule() -> None:
    """Half way gains are the mean; the loop is affine in the speed, which certificates rest on."""
    machine = rotor(lqg(scheduled=True))
    plant = synthesis_plant(machine)
    law = law_of(plant, 300.0, NONE, True)
    rest, there = law.gains
    K, L = (rest.K + there.K) / 2.0, (rest.L + there.L) / 2.0
    v, n = plant.values, plant.sizes[0]
    a = law.constant["a"] + 150.0 * law.rate["a"]
    np.testing.assert_allclose(law.constant["c"] + 150.0 * law.rate["c"], -K, rtol=1e-12)
    expected = v["A0"] + 150.0 * v["A1"] - v["B"] @ K[:, :n] - L @ v["C"]
    np.testing.assert_allclose(a[:n, :n], expected, atol=1e-12 * np.abs(expected).max())
    loop = ad.system(machine)
    np.testing.assert_array_equal(loop.matrix(150.0), loop.A0 + 150.0 * loop.A1)
