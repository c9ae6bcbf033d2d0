"""Balanced truncation of the synthesis plant: against SLICOT, its error bound, and its derivatives."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.synthesis.lqg import gains, law_of
from amb_design.synthesis.plant import Plant
from amb_design.synthesis.truncation import truncated, truncation
from amb_design.synthesis.tuned import TunedLaw
from synthesis.levitated import apart, lqg, rotor, small, synthesis_plant, uneven

NONE = np.zeros(0)
SPEED = 300.0
MACHINES = {"one plane": rotor(lqg()), "two planes": uneven(lqg())}
every_machine = pytest.mark.parametrize("name", MACHINES)


def response(a: np.ndarray, b: np.ndarray, c: np.ndarray, frequencies: np.ndarray) -> np.ndarray:
    s = 1j * frequencies[:, None, None] * np.eye(len(a))
    return np.asarray(c @ np.linalg.solve(s - a, np.broadcast_to(b, (len(frequencies), *b.shape))))


def plant_response(plant: Plant, frequencies: np.ndarray) -> np.ndarray:
    v = plant.values
    return response(v["A0"] + SPEED * v["A1"], v["B"], v["C"], frequencies)


def unstable(plant: Plant) -> np.ndarray:
    poles = np.linalg.eigvals(plant.values["A0"] + SPEED * plant.values["A1"])
    return poles[poles.real > 0.0]


@every_machine
def test_error_bound(name: str) -> None:
    """What is lost is at most twice the sum of the singular values left out, in the largest singular value at any frequency, and
    it is lost by the stable part alone: poles that do not stand stay to 1e-9."""
    plant = synthesis_plant(MACHINES[name])
    poles = np.abs(np.linalg.eigvals(plant.values["A0"] + SPEED * plant.values["A1"]).imag)
    frequencies = np.concatenate([np.geomspace(1.0, 1e6, 300), poles[poles > 1.0]])
    frequencies = np.concatenate([frequencies, -frequencies])
    whole, states = plant_response(plant, frequencies), plant.sizes[0] // plant.planes
    kept = len(unstable(plant))
    assert kept > 0
    least = -(-kept // plant.planes)
    tight = 0.0
    for order in range(max(least, 2), states, 3):
        few = truncated(plant, SPEED, NONE, order)
        assert few.sizes == (order * plant.planes, *plant.sizes[1:])
        hankel = truncation(plant, SPEED, NONE, order).hankel
        bound = 2.0 * hankel[order * plant.planes - kept :].sum()
        lost = np.linalg.norm(whole - plant_response(few, frequencies), 2, axis=(1, 2)).max()
        assert lost <= bound * (1.0 + 1e-6), f"{order} states: {lost:.3g} beyond {bound:.3g}"
        tight = max(tight, lost / bound)
        assert apart(unstable(plant), unstable(few)) <= 1e-9
    assert tight > 0.1  # the bound says something


def two_areas(shift: float) -> Plant:
    """The power system with two areas of the SLICOT library's example of AB09AD; its poles moved to the right."""
    a = np.array(
        [
            [-0.04165, 0.0, 4.92, -4.92, 0.0, 0.0, 0.0],
            [-5.21, -12.5, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 3.33, -3.33, 0.0, 0.0, 0.0, 0.0],
            [0.545, 0.0, 0.0, 0.0, -0.545, 0.0, 0.0],
            [0.0, 0.0, 0.0, 4.92, -0.04165, 0.0, 4.92],
            [0.0, 0.0, 0.0, 0.0, -5.21, -12.5, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 3.33, -3.33],
        ]
    ) + shift * np.eye(7)
    b, c = np.zeros((7, 2)), np.zeros((3, 7))
    b[1, 0] = b[5, 1] = 12.5
    c[0, 0] = c[1, 3] = c[2, 4] = 1.0
    values = {
        "A0": a.astype(complex),
        "A1": 0.0 * a,
        "B": b,
        "C": c,
        "Q": np.eye(7),
        "W": np.eye(7),
        "E": np.zeros((0, 3)),
    }
    return Plant(values, {name: np.zeros((0, *x.shape)) for name, x in values.items()})


SLICOT = {
    0.0: {
        0.5: [1.22820696 - 0.05015995j, 1.05630414 - 0.49735855j, 0.46789367 - 0.20774433j],
        2.0: [1.25961436 - 1.06072328j, -0.50965787 - 1.43066602j, 0.09690302 - 0.47661029j],
        6.0: [-0.47080902 - 0.082683j, 0.04726882 + 0.00446005j, -0.00966569 + 0.04837315j],
    },
    0.8: {
        0.5: [1.29232843 + 0.48287678j, 1.99431194 - 0.96740182j, 0.79436102 - 0.49931964j],
        2.0: [1.86635861 - 2.24625006j, 0.06237733 - 4.16127971j, 0.28159537 - 0.60664809j],
        6.0: [-0.57157009 + 0.12354407j, 0.04586732 - 0.03930864j, 0.02203864 + 0.05205485j],
    },
}
"""By shift and frequency [rad/s] the response of five states (first row; first entry of the second), of AB09MD through slycot 0.7.1 and
python-control 0.10.2's balred. A shift of 0.8 makes two poles unstable."""


@pytest.mark.parametrize("shift", SLICOT)
def test_slicot(shift: float) -> None:
    """The library's published singular values, to their digits, and the responses of its reduced systems, to 1e-7."""
    few = truncated(two_areas(shift), 0.0, NONE, 5).values
    frequencies = np.array(list(SLICOT[shift]))
    seen = response(few["A0"], few["B"], few["C"], frequencies)
    expected = np.array(list(SLICOT[shift].values()))
    assert np.abs(np.column_stack([seen[:, 0, 0], seen[:, 0, 1], seen[:, 1, 0]]) - expected).max() <= 1e-7
    if not shift:
        published = [2.5139, 2.0846, 1.9178, 0.7666, 0.5473, 0.0253, 0.0246]
        np.testing.assert_allclose(truncation(two_areas(0.0), 0.0, NONE, 5).hankel, published, atol=5e-5)


FREE = {
    "controller.current": "weight",
    "controller.force_noise": "noise",
    "controller.design_speed": "speed",
    "controller.low_pass.frequency": "hardware",
    "magnets[0].bias_current": "magnet",
    "rotor.disks[0].mass": "rotor",
}
TRUNCATED = {
    "fixed": rotor(lqg(order=7)),
    "scheduled": small(lqg(scheduled=True, design_speed=1500.0, order=6)),
    "real form": uneven(lqg(order=6), small),
}


@pytest.mark.parametrize("name", TRUNCATED)
def test_derivatives(name: str) -> None:
    """Of the law's frequency response, for its coordinates may turn as they like; against differences of fourth order, 1e-5."""
    machine = TRUNCATED[name]
    p = ca.SX.sym("p", len(FREE))
    law = TunedLaw(p, ad.replace(machine, {name: p[k] for k, name in enumerate(FREE)}), machine)
    values = dict(ad.numbers(machine))
    start = np.array([float(values[name]) for name in FREE])
    numbers, spin, frequencies = law.numbers, 200.0, np.geomspace(10.0, 2e4, 12)
    found, parts = law.machine.controller, {}
    for entry in "abc":
        re = getattr(found.law, entry) + (spin * getattr(found.law_rate, entry) if found.law_rate else 0.0)
        im = 0.0 * re
        if found.cross:
            im = getattr(found.cross, entry) + (spin * getattr(found.cross_rate, entry) if found.cross_rate else 0.0)
        re, im = ca.densify(re), ca.densify(im)
        parts[entry] = (*re.shape, ca.Function(entry, [numbers], [ca.vec(re), ca.vec(im)]))

    def read(entry: str, x: np.ndarray) -> np.ndarray:
        rows, columns, f = parts[entry]
        re, im = (y.full()[:, 0] for y in f(x))
        return (re + 1j * im).reshape(columns, rows).T

    def responses(x: np.ndarray) -> np.ndarray:
        return response(*(read(entry, law.at(x)[0]) for entry in "abc"), frequencies)

    at, slopes = law.at(start)
    a, b, c = (read(entry, at) for entry in "abc")
    inverse = np.linalg.inv(1j * frequencies[:, None, None] * np.eye(len(a)) - a)
    for k, free in enumerate(FREE):
        da, db, dc = (read(entry, slopes[:, k]) for entry in "abc")
        exact = dc @ inverse @ b + c @ inverse @ db + c @ inverse @ da @ inverse @ b
        error = np.inf
        for step in (1e-2, 1e-3):
            h = np.eye(len(FREE))[k] * step * start[k]
            near, far = (responses(start + i * h) - responses(start - i * h) for i in (1, 2))
            expected = (8.0 * near - far) / (12.0 * step * start[k])
            error = min(error, np.abs(exact - expected).max() / np.abs(expected).max())
        print(f"{name}, {free}: {error:.1e}")
        assert error <= 1e-5, free


@pytest.mark.parametrize(("order", "tolerance"), [(20, 1e-2), (25, 5e-3)])
def test_the_whole_machine_hardly_misses_the_last_states(order: int, tolerance: float) -> None:
    """Its stability limit is that of the law with all 26 states."""
    machine = rotor(lqg(integral=None))
    few = ad.replace(machine, {"controller.order": order})
    assert len(ad.synthesise(few).controller.law.a) == order
    assert ad.stability_limit(few).speed == pytest.approx(ad.stability_limit(machine).speed, rel=tolerance)


def test_truncated_laws_separate() -> None:
    """On the truncated plant the law has the poles of its regulator and observer; 1e-8."""
    plant = truncated(synthesis_plant(MACHINES["one plane"]), SPEED, NONE, 9)
    law, found, v = law_of(plant, SPEED, NONE, False), gains(plant, SPEED, NONE), plant.values
    a, b, c = (law.constant[k] for k in "abc")
    closed = np.block([[v["A0"] + SPEED * v["A1"], v["B"] @ c], [b @ v["C"], a]])
    expected = 1e3 * np.concatenate([found.regulator.poles, found.observer.poles.conj()])
    assert apart(expected, np.linalg.eigvals(closed)) <= 1e-8


@pytest.mark.parametrize(
    ("order", "said"),
    [
        (1, "controller.order = 1 keeps fewer than the"),
        (50, "controller.order = 50 is not below the 26 states of rotor and hardware in each plane; leave it out"),
    ],
)
def test_refused(order: int, said: str) -> None:
    with pytest.raises(ad.ModelError, match=f"levitated: {said}"):
        ad.synthesise(rotor(lqg(order=order)))


@pytest.mark.parametrize("order", [0, True, 2.5])
def test_no_order(order: object) -> None:
    with pytest.raises(ad.SpecError, match=r"order = .* must be a whole number from 1 to 256"):
        lqg(order=order)
