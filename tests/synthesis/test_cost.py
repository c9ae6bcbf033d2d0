"""What the weights and noise densities of a law mean, in metres, amperes and newtons of the whole machine.

Costs come from Lyapunov equations of the closed loop of the machine, in which outputs and noises are written down anew; with
all modes of the mesh in the law they must be the optimal costs, which follow from the Riccati solutions. White noise of
the one-sided amplitude density s has the intensity s^2/2.
"""

from __future__ import annotations

import dataclasses
import itertools

import casadi as ca
import numpy as np
import pytest
import scipy.linalg as sla

import amb_design as ad
from amb_design.analysis.system import dense
from amb_design.model.loop import structure
from amb_design.synthesis.lqg import gains, observer_data, regulator_data
from amb_design.synthesis.plant import PACE
from amb_design.synthesis.reduction import basis_of
from amb_design.synthesis.regulator import regulator
from amb_design.synthesis.riccati import Data, solve
from checks import within
from synthesis.levitated import lqg, lqr, rotor, small, synthesis_plant

NONE = np.zeros(0)
ALL = 18
SPEED = 300.0


def columns(loop: ad.System, what: str) -> np.ndarray:
    return np.hstack([ca.DM(getattr(axis, what)).full() for axis in loop.plant.axes])


class Loop:
    """x' = A x of a whole machine, modes at rest without magnets, and what its regulator weighs."""

    def __init__(self, machine: ad.Machine):
        self.loop = ad.system(machine)
        pencil, n = self.loop.pencil, self.loop.displacements
        e, a0, a1 = (dense(m) for m in (pencil.E, pencil.A0, pencil.A1))
        self.E, self.n, self.size = e, n, len(e)
        self.A = np.linalg.solve(e, a0 + SPEED * a1)
        self.balanced = self.loop.matrix(SPEED)
        bare = dense(structure(ad.replace(machine, {"magnets.negative_stiffness": 0.0}).without_controllers()).K0).real
        mass = e[n : 2 * n, n : 2 * n].real
        _, shapes = sla.eigh((bare + bare.T) / 2.0, mass)
        self.heights = np.abs(shapes[0::2]).max(axis=0)
        self.modal = shapes.T @ mass

    def weighed(self, law: ad.LQR | ad.LQG, currents: np.ndarray) -> np.ndarray:
        """Rows whose squares the regulator adds up."""
        n, at = self.n, columns(self.loop, "actuator").T
        rows = np.zeros((2 * len(at) + n, self.size), complex)
        rows[: len(at), :n] = at / law.displacement
        rows[len(at) : 2 * len(at), n : 2 * n] = at / law.velocity
        rows[2 * len(at) :, n : 2 * n] = self.heights[:, None] * self.modal / law.modal_velocity
        return np.vstack([rows, currents / law.current])

    def energy(self, rows: np.ndarray) -> np.ndarray:
        """P of the integral z0^H P z0 of all squares, in balanced coordinates."""
        seen = rows @ self.loop.to_state
        return np.asarray(sla.solve_continuous_lyapunov(self.balanced.conj().T, -seen.conj().T @ seen))

    def mean(self, rows: np.ndarray, noises: np.ndarray) -> float:
        """Mean of the sum of squares under white noises of unit intensity."""
        shaken, seen = self.loop.from_rate @ self.E @ noises, rows @ self.loop.to_state
        covariance = sla.solve_continuous_lyapunov(self.balanced, -shaken @ shaken.conj().T)
        return float(np.trace(seen @ covariance @ seen.conj().T).real)


def given_by_coefficients(machine: ad.Machine) -> ad.Machine:
    """Magnets without geometry, whose negative stiffness can be taken away for the modes."""
    left = ad.replace(machine.magnets[1], {"position": 0.05, "sensor": "left", "current_stiffness": 75.0})
    return ad.replace(machine, {"magnets": (left, machine.magnets[1])})


def test_ideal_regulator_of_the_whole_machine() -> None:
    """The integral of the weighed squares from any start is x0^H X x0 of the Riccati equation; 1e-8."""
    machine = given_by_coefficients(small(lqr(modes=ALL)))
    loop, law = Loop(machine), machine.controller
    assert isinstance(law, ad.LQR)
    fed_back = loop.loop.plant.blocks[0]
    d = dense(fed_back.law.d.constant)
    sense, inputs = ca.DM(fed_back.sensors).full().T, fed_back.sensors.shape[1]
    currents = -np.hstack([d[:, :inputs] @ sense, d[:, inputs:] @ sense])
    found = loop.energy(loop.weighed(law, currents))
    _, solution = regulator(machine)
    basis = basis_of(machine, ALL)
    scale = np.concatenate([1e-5 / basis.heights, PACE * 1e-5 / basis.heights])
    modal = basis.shapes.T @ loop.E[loop.n : 2 * loop.n, loop.n : 2 * loop.n]
    turn = sla.block_diag(modal, modal) / scale[:, None]
    rng = np.random.default_rng(0)
    starts = np.linalg.solve(turn, rng.normal(size=(2 * ALL, 6)) + 1j * rng.normal(size=(2 * ALL, 6)))
    expected = np.einsum("ik,ij,jk->k", (turn @ starts).conj(), solution.X, turn @ starts).real
    z = np.linalg.solve(loop.loop.to_state, starts)
    computed = np.einsum("ik,ij,jk->k", z.conj(), found, z).real
    within(computed * law.current**2 * PACE, expected, 1e-8, "cost of the ideal regulator")


def test_observer_based_law_of_the_whole_machine() -> None:
    """Under all noises the weighed squares have the mean tr(X W) + tr(P K^H R K), the least there is; 1e-6."""
    machine = given_by_coefficients(small(lqg(modes=ALL, integral=None)))
    loop, law = Loop(machine), machine.controller
    assert isinstance(law, ad.LQG)
    n, block = loop.n, loop.loop.plant.blocks[0]
    names = block.law.states
    own = 2 * n + np.flatnonzero([name.startswith("law") for name in names])
    gain = law.amplifier.gain
    law_c = np.array(ad.synthesise(machine).controller.law.c) + 1j * np.array(ad.synthesise(machine).controller.cross.c)
    law_b = np.array(ad.synthesise(machine).controller.law.b) + 1j * np.array(ad.synthesise(machine).controller.cross.b)
    told = np.zeros((2, loop.size), complex)
    told[:, own] = law_c * gain
    amplifiers = 2 * n + np.flatnonzero([name == "amplifier.output" for name in names])
    rows = np.vstack([loop.weighed(law, told), loop.A[amplifiers] / law.current_rate])
    # noises: forces at the magnets, on the modes, currents where the law's output enters, sensors behind their low-pass
    forces = np.zeros((loop.size, 2 + n), complex)
    mass = loop.E[n : 2 * n, n : 2 * n]
    forces[n : 2 * n, :2] = np.linalg.solve(mass, columns(loop.loop, "actuator")) * law.force_noise
    forces[n : 2 * n, 2:] = np.linalg.solve(mass, loop.modal.T) * loop.heights * law.modal_noise
    enters = loop.A[:, own] @ np.linalg.pinv(law_c)
    enters[own] = 0.0
    seen = np.zeros((loop.size, 2), complex)
    seen[own] = law_b * law.sensor_gain * law.sensor_noise
    noises = np.hstack([forces, enters * law.current_noise / gain, seen]) / np.sqrt(2.0)
    computed = loop.mean(rows, noises)
    plant = synthesis_plant(machine)
    found = gains(plant, SPEED, NONE)
    weights, noise = regulator_data(plant, SPEED, NONE)[0], observer_data(plant, SPEED, NONE)[0]
    x, p, k = found.regulator.X, found.observer.X, found.K
    expected = np.trace(x @ noise.Q).real + np.trace(p @ k.conj().T * weights.R @ k).real
    expected *= (
        plant.values["R"][0] * plant.values["V"][0] / 2.0 / PACE
    )  # the data are in units of current and sensor noise
    within(computed, expected, 1e-6, "mean of the weighed squares under noise")


def mean_square(weights: Data, noise: Data, K: np.ndarray, L: np.ndarray) -> float:
    """Cost of the law x' = (A - B K - L C) x + L y, o = -K x on the synthesis plant; `noise` holds the adjoint of A and C."""
    A, B, C = weights.A, weights.B, noise.B.conj().T
    closed = np.block([[A, -B @ K], [L @ C, A - B @ K - L @ C]])
    shaken = sla.block_diag(noise.Q, L * noise.R @ L.conj().T)
    covariance = sla.solve_continuous_lyapunov(closed, -shaken)
    return float(np.trace(sla.block_diag(weights.Q, K.conj().T * weights.R @ K) @ covariance).real)


def data_of(machine: ad.Machine) -> tuple[Data, Data]:
    plant = synthesis_plant(machine)
    return regulator_data(plant, SPEED, NONE)[0], observer_data(plant, SPEED, NONE)[0]


def test_no_law_is_better() -> None:
    """Any change of the gains makes the mean of the weighed squares larger, by the square of the change."""
    weights, noise = data_of(rotor(lqg(integral=None)))
    K, L = solve(weights).K, solve(noise).K.conj().T
    best = mean_square(weights, noise, K, L)
    rng = np.random.default_rng(1)
    for _ in range(5):
        way = [g * (rng.normal(size=g.shape) + 1j * rng.normal(size=g.shape)) for g in (K, L)]
        more = [mean_square(weights, noise, K + h * way[0], L + h * way[1]) / best - 1.0 for h in (1e-3, 2e-3)]
        assert more[0] > 0.0
        assert more[1] / more[0] == pytest.approx(4.0, rel=0.2)


def test_perfect_sensors_leave_the_cost_of_the_regulator() -> None:
    """With a sensor for each state the observer's share of the cost vanishes with the amplitude of their noise.

    With the two sensors that there are it stays, for they see through the low-pass.
    """
    weights, noise = data_of(rotor(lqg(integral=None)))
    regulated = solve(weights)
    ideal = float(np.trace(regulated.X @ noise.Q).real)

    def excess(seen: Data) -> float:
        return mean_square(weights, seen, regulated.K, solve(seen).K.conj().T) / ideal - 1.0

    n = len(weights.A)
    full = [excess(Data(noise.A, np.eye(n), noise.Q, np.full(n, size))) for size in (1e6, 1e4, 1e2)]
    own = [excess(dataclasses.replace(noise, R=noise.R * size)) for size in (1.0, 1e-2, 1e-4)]
    print("excess over the regulator's cost:", *(f"{x:.2e}" for x in full), "own sensors:", *(f"{x:.2e}" for x in own))
    for earlier, later in itertools.pairwise(full):
        assert earlier / later == pytest.approx(10.0, rel=0.02)
    assert 0.0 < full[-1] < 1e-5
    for earlier, later in itertools.pairwise(own):
        assert 0.3 * earlier < later < earlier
