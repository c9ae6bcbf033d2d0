"""What the eigenvalue optimiser promises for any matrix family."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest

from amb_design.errors import ModelError
from amb_design.model.pair import Pair
from amb_design.optimise.abscissa import Descent, bounds, minimise_abscissa
from amb_design.optimise.dense import DenseFamily
from amb_design.optimise.family import Family
from amb_design.optimise.multiplicity import coalesced, groups
from amb_design.optimise.nonsmooth import minimise
from amb_design.optimise.smoothed import SmoothedAbscissa
from amb_design.optimise.stable_speed import crossing, largest_stable
from checks import within


def random_family(seed: int, size: int = 5, parameters: int = 3, complex_part: bool = False) -> Family:
    """E(p) dx/dt = (A0(p) + Omega A1(p)) x with bilinear and trigonometric entries."""
    rng = np.random.default_rng(seed)
    p = ca.SX.sym("p", parameters)

    def part(scale: float) -> ca.SX:
        out = ca.SX(ca.DM(rng.normal(size=(size, size))))
        for k in range(parameters):
            out += p[k] * ca.DM(rng.normal(size=(size, size)))
        return scale * (out + ca.sin(p[0] * p[-1]) * ca.DM(rng.normal(size=(size, size))))

    a1 = Pair(part(0.3), part(0.3)) if complex_part else part(0.3)
    return Family(p, {"E": ca.DM.eye(size) + part(0.05), "A0": part(1.0), "A1": a1})


def differences(function, p: np.ndarray, step: float = 1e-5) -> np.ndarray:
    return np.array([(function(p + step * e) - function(p - step * e)) / (2.0 * step) for e in np.eye(len(p))])


@pytest.mark.parametrize("complex_part", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_gradients(seed: int, complex_part: bool) -> None:
    family, p = random_family(seed, complex_part=complex_part), np.random.default_rng(seed).normal(size=3)
    abscissa = Descent(family, bounds(family, -9.0, 9.0), (0.0, 1.3))
    within(abscissa(p)[1], differences(lambda q: abscissa(q)[0], p), 1e-5, "abscissa")
    smoothed = SmoothedAbscissa(abscissa.dense, (0.0, 1.3), 1e3)
    within(smoothed(p)[1], differences(lambda q: smoothed(q)[0], p), 1e-5, "smoothed abscissa")


@pytest.mark.parametrize("seed", range(3))
def test_smoothed_abscissa_tends_to_the_abscissa_from_above(seed: int) -> None:
    family, p = random_family(seed), np.random.default_rng(seed).normal(size=3)
    dense = DenseFamily(family)
    exact = np.linalg.eigvals(dense.at(p).matrix(0.7)).real.max()
    values = [SmoothedAbscissa(dense, (0.7,), energy)(p)[0] - exact for energy in (1e1, 1e3, 1e5, 1e7)]
    assert all(a > 5.0 * b > 0.0 for a, b in pairwise(values))


def test_scaled_coordinates_change_nothing() -> None:
    family, p = random_family(4), np.array([0.3, -0.2, 0.5])
    plain, scaled = DenseFamily(family), DenseFamily(family, 10.0 ** np.arange(-2.0, 3.0))
    a, b = (np.sort_complex(np.linalg.eigvals(d.at(p).matrix(1.0))) for d in (plain, scaled))
    within(b, a, 1e-9, "eigenvalues")
    within(scaled.at(p).slope(np.eye(5), 1.0), plain.at(p).slope(np.eye(5), 1.0), 1e-10, "slope of the trace")


def test_nonsmooth_bfgs_finds_the_end_of_a_kink_and_stays_in_the_box() -> None:
    def function(x: np.ndarray) -> tuple[float, np.ndarray]:
        kink = x[1] - x[0] ** 2
        return 8.0 * abs(kink) + (1.0 - x[0]) ** 2, np.array(
            [-16.0 * x[0] * np.sign(kink) - 2.0 * (1.0 - x[0]), 8.0 * np.sign(kink)]
        )

    for upper, expected in ((5.0, [1.0, 1.0]), (0.5, [0.5, 0.25])):
        box = np.full(2, -5.0), np.array([upper, 5.0])
        found = minimise(function, np.array([-1.0, 2.0]), *box, unit=np.ones(2), evaluations=2000)
        assert found.converged
        assert np.allclose(found.x, expected, atol=1e-4)
        assert found.x[0] <= upper


def test_newton_finds_a_defective_eigenvalue_exactly() -> None:
    """s^3 + p s^2 + q s + 1 has the triple root -1 at p = q = 3."""
    p = ca.SX.sym("p", 2)
    family = Family(p, {"A0": ca.blockcat([[0, 1, 0], [0, 0, 1], [-1, -p[1], -p[0]]])})
    dense, box = DenseFamily(family), np.array([[0.0, 0.0], [9.0, 9.0]])
    near = min(
        coalesced(dense, np.array([2.5, 3.6]), *box, (0.0,), np.ones(2)), key=lambda q: float(np.abs(q - 3.0).max())
    )
    within(near, [3.0, 3.0], 1e-8, "coefficients")
    (group,) = groups(dense, near, (0.0,), 0.1)
    within(group.mean, -1.0, 1e-8, "mean of the group")


@pytest.mark.parametrize("seed", range(4))
def test_no_random_point_is_better(seed: int) -> None:
    family = random_family(seed, size=4)
    result = minimise_abscissa(family, -2.0, 2.0, starts=6, seed=seed)
    abscissa = Descent(family, bounds(family, -2.0, 2.0), (0.0,)).abscissa
    points = np.random.default_rng(seed).uniform(-2.0, 2.0, (300, 3))
    assert np.abs(result.p).max() <= 2.0
    assert result.abscissa <= min(abscissa(p) for p in points)
    again = minimise_abscissa(family, -2.0, 2.0, starts=6, seed=seed)
    assert again == again.__class__(**{**vars(result), "p": again.p, "groups": again.groups})
    assert (again.p == result.p).all()


def test_several_speeds_and_a_spent_budget() -> None:
    family = random_family(7, size=4)
    result = minimise_abscissa(family, -2.0, 2.0, speeds=(0.0, 1.0, 2.0), starts=4)
    m = family.at(result.p)
    matrices = [np.linalg.solve(m.part("E"), m.part("A0") + s * m.part("A1")) for s in (0.0, 1.0, 2.0)]
    within(result.abscissa, max(np.linalg.eigvals(a).real.max() for a in matrices), 1e-9, "worst abscissa")
    short = minimise_abscissa(family, -2.0, 2.0, budget=5)
    assert len(short.starts) == 1
    assert short.eigendecompositions < 2000


@pytest.mark.parametrize("seed", range(4))
def test_crossing_is_on_the_axis(seed: int) -> None:
    family = random_family(seed, complex_part=bool(seed % 2))
    p = np.zeros(3)
    found = crossing(family, p, 50.0)
    assert found.bracket[0] <= found.speed <= found.bracket[1] or abs(found.speed - found.bracket[0]) < 1e-7
    m = family.at(p)
    values = np.linalg.eigvals(np.linalg.solve(m.part("E"), m.part("A0") + found.speed * m.part("A1")))
    assert np.abs(values - 1j * found.frequency).min() <= 1e-10 * np.abs(values).max()


def test_no_crossing_and_wrong_input() -> None:
    c = ca.SX.sym("c")
    family = Family(c, {"A0": -ca.DM.eye(2) * (1.0 + c**2), "A1": ca.DM([[0, 1], [-1, 0]])})
    assert crossing(family, 1.0, 10.0).status == "no crossing below the top"
    assert largest_stable(family, -1.0, 1.0, 10.0, starts=1).status == "stable up to the top"
    with pytest.raises(ModelError, match="top"):
        crossing(family, 1.0, 0.0)
    with pytest.raises(ModelError, match="bounds"):
        minimise_abscissa(family, [0.0, 1.0], [1.0, 2.0])
    with pytest.raises(ModelError, match="bounds"):
        minimise_abscissa(family, 1.0, 0.0)


def whirling(real: bool) -> Family:
    """A rotor with internal damping 0.1: stable up to sqrt(k) (1 + c/0.1), here with k = 4 - c."""
    c = ca.SX.sym("c")
    A0, turn = ca.blockcat([[0, 1], [c - 4, -c - 0.1]]), ca.DM([[0, 0], [0.1, 0]])
    if not real:
        return Family(c, {"A0": A0, "A1": Pair(ca.SX(2, 2), turn)})
    return Family(c, {"A0": ca.diagcat(A0, A0), "A1": ca.blockcat([[ca.DM(2, 2), -turn], [turn, ca.DM(2, 2)]])})


@pytest.mark.parametrize("real", [False, True])
def test_largest_stable_speed_of_a_rotor_with_internal_damping(real: bool) -> None:
    c = 39.5 / 15.0
    result = largest_stable(whirling(real), 0.0, 3.9, 100.0, starts=3)
    assert result.status == "converged"
    assert result.certified
    within(result.speed, np.sqrt(4.0 - c) * (1.0 + 10.0 * c), 1e-6, "speed")


@pytest.mark.parametrize("seed", range(3))
def test_largest_stable_speed_of_random_matrices(seed: int) -> None:
    """Stable everywhere below, and above what random points reach."""
    rng = np.random.default_rng(seed)
    p = ca.SX.sym("p", 2)
    moves = [ca.DM(rng.normal(size=(4, 4))) for _ in range(4)]
    A0 = -3.0 * ca.DM.eye(4) + p[0] * moves[0] + p[1] * moves[1]
    family = Family(p, {"A0": A0, "A1": moves[2] + p[0] * p[1] * moves[3]})
    result = largest_stable(family, -3.0, 3.0, 20.0, starts=3, seed=seed)
    assert result.certified
    m = family.at(result.p)
    for speed in np.linspace(0.0, result.speed * (1.0 - 1e-6), 100):
        assert np.linalg.eigvals(m.part("A0") + speed * m.part("A1")).real.max() < 0.0
    climbs = [_first(family, q) for q in rng.uniform(-3.0, 3.0, (40, 2))]
    assert result.speed >= max(climbs) * (1.0 - 1e-6)


def _first(family: Family, p: np.ndarray) -> float:
    m = family.at(p)
    if np.linalg.eigvals(m.part("A0")).real.max() >= 0.0:
        return 0.0
    found = crossing(family, p, 20.0)
    return found.speed if found.status == "crossing found" else 20.0
