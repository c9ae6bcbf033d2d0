"""Complex and real form of the same isotropic machine, and the real form of machines that have no other."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

import amb_design as ad
from amb_design.analysis.frequency import Loops
from independent.everything import anisotropic_machine, isotropic_machine
from synthesis import levitated

SPEEDS = [0.0, 150.0, 420.0, 980.0, 1600.0]


TURNED = {"magnets[0].axes_angle": 0.8, "magnets[1].axes_angle": -0.3}


def small(law: Any, **changes: float) -> ad.Machine:
    return ad.replace(levitated.small(law), changes)


def machines() -> dict[str, ad.Machine]:
    variants = ad.load_variants("thesis")
    coarse = {"rotor.shaft.elements": 6}
    return {
        "thesis row 1, passive": ad.replace(variants["row1-passive"], coarse),
        "thesis row 2, tuned": ad.replace(variants["row2-tuned"], coarse),
        "thesis row 3, unstable": ad.replace(variants["row3-controlled"], coarse),
        "thesis row 4, tuned": ad.replace(variants["row4-tuned"], coarse),
        "TUM rig": ad.replace(ad.load("tum-rig"), {"rotor.shaft.elements": 8}),
        "everything": isotropic_machine(),
        "LQG, magnets turned": small(levitated.lqg(scheduled=True), **TURNED),
        "cross and rates, magnets turned": small(levitated.laws()["cross and rates"], **TURNED),
    }


MACHINES = machines()
each_machine = pytest.mark.parametrize("name", MACHINES)


def both(machine: ad.Machine) -> tuple[ad.System, ad.System]:
    forms = ad.system(machine), ad.system(machine, complex_form=False)
    assert [f.complex_form for f in forms] == [True, False]
    assert forms[1].size == 2 * forms[0].size
    return forms


def distance(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference of two sets of numbers, matched one to one, relative to max(1, abs)."""
    assert len(first) == len(second)
    cost = np.abs(first[:, None] - second) / np.maximum(1.0, np.abs(first))[:, None]
    return float(cost[linear_sum_assignment(cost)].max())


@each_machine
def test_eigenvalues(name: str) -> None:
    """The complex form's eigenvalues with their conjugates are the real form's; tolerance 1e-8."""
    one, two = both(MACHINES[name])
    worst = 0.0
    for speed in SPEEDS:
        values = np.linalg.eigvals(one.matrix(speed))
        worst = max(worst, distance(np.concatenate([values, values.conj()]), np.linalg.eigvals(two.matrix(speed))))
    print(f"{name}: eigenvalues of the two forms agree to {worst:.1e}")
    assert worst <= 1e-8


@pytest.mark.parametrize("angles", [(0.7, 0.7), (0.8, -0.3)])
def test_ideal_feedback_is_in_y_and_z_wherever_the_magnets_point(angles: tuple[float, float]) -> None:
    turned = {f"magnets[{k}].axes_angle": angle for k, angle in enumerate(angles)}
    one, two = both(small(levitated.lqr(scheduled=True), **turned))
    values = np.linalg.eigvals(one.matrix(500.0))
    assert distance(np.concatenate([values, values.conj()]), np.linalg.eigvals(two.matrix(500.0))) <= 1e-8


@each_machine
def test_stability_limit(name: str) -> None:
    one, two = (ad.stability_limit(s, first_only=True) for s in both(MACHINES[name]))
    assert one.status == two.status
    assert one.speed == pytest.approx(two.speed, rel=1e-7)
    if one.mode is not None and two.mode is not None:
        assert one.mode.whirl == two.mode.whirl
    assert 2 * len(one.unstable_at_rest) == len(two.unstable_at_rest) + len(one.unstable_at_rest)


@each_machine
def test_critical_speeds(name: str) -> None:
    one, two = (ad.critical_speeds(s) for s in both(MACHINES[name]))
    assert [c.whirl for c in one] == [c.whirl for c in two]
    np.testing.assert_allclose([c.speed for c in one], [c.speed for c in two], rtol=1e-8)
    np.testing.assert_allclose([c.damping_ratio for c in one], [c.damping_ratio for c in two], atol=1e-8)


@each_machine
def test_unbalance_response(name: str) -> None:
    machine = MACHINES[name]
    if not any(d.unbalance for d in machine.rotor.disks):
        machine = ad.replace(machine, {"rotor.disks[0].unbalance": 1e-4, "rotor.disks[0].unbalance_phase": 0.7})
    one, two = (ad.unbalance_response(s, SPEEDS[1:]) for s in both(machine))
    for field in ("displacements", "currents", "bearing_forces", "magnet_forces"):
        a, b = getattr(one, field), getattr(two, field)
        assert a.shape == b.shape
        if a.size:
            assert np.abs(a - b).max() <= 1e-8 * np.abs(a).max(), field


@pytest.mark.parametrize("name", [n for n in MACHINES if "passive" not in n and "turned" not in n])
def test_sensitivity(name: str) -> None:
    frequencies = np.geomspace(20.0, 2e4, 40)
    for speed in (0.0, 700.0):
        one, two = (ad.sensitivity(s, speed, frequencies) for s in both(MACHINES[name]))
        magnets = len(MACHINES[name].magnets)
        assert one.sensitivity.shape == (len(frequencies), magnets)
        assert two.sensitivity.shape == (len(frequencies), 2 * magnets)
        for axis in (0, 1):  # a disturbance of one axis alone, all loops closed
            np.testing.assert_allclose(two.sensitivity[:, axis::2], one.sensitivity, rtol=1e-7)
        # and the whole matrices, the coupling of the axes included
        loops = [Loops(s.plant) for s in both(MACHINES[name])]
        for w in frequencies[::8]:
            ahead, back = (loops[0].at(f, speed).sensitivity for f in (w, -w))
            full = loops[1].at(w, speed).sensitivity
            # v + i w -> (forward, conjugate of backward) is unitary
            turn = np.kron(np.eye(magnets), np.array([[1.0, 1.0j], [1.0, -1.0j]]) / math.sqrt(2.0))
            expected = np.zeros((2 * magnets, 2 * magnets), complex)
            expected[0::2, 0::2], expected[1::2, 1::2] = ahead, back.conj()
            got = turn @ full @ turn.conj().T
            angles = np.array([m.axes_angle for m in MACHINES[name].magnets])
            shift = np.repeat(np.exp(1j * angles), 2)
            shift[1::2] = shift[1::2].conj()
            got = shift[:, None] * got / shift
            assert np.abs(got - expected).max() <= 1e-8 * np.abs(expected).max()


def test_anisotropic_machines_have_the_real_form_only() -> None:
    base = isotropic_machine()
    controller = base.controller
    assert controller is not None
    changes = {
        "kzz": {"bearings[0].kzz": 2e7},
        "czz": {"bearings[1].czz": 10.0},
        "one cross coefficient": {"bearings[1].kyz": 1e3},
        "second controller": {"controller_z": ad.replace(controller, {"kp": 2.0})},
    }
    for what, change in changes.items():
        machine = ad.replace(base, change)
        assert not ad.system(machine).complex_form, what
        with pytest.raises(ad.ModelError, match="anisotropic"):
            ad.closed_loop(machine, complex_form=True)


def test_second_controller_with_equal_numbers_changes_nothing() -> None:
    """A copy of the first controller for the second axes: the real form is taken, the machine is the same."""
    base = isotropic_machine()
    assert base.controller is not None
    machine = ad.replace(base, {"controller_z": ad.replace(base.controller, {"kp": float(base.controller.kp)})})
    loop = ad.system(machine)
    values = np.linalg.eigvals(ad.system(base).matrix(600.0))
    assert distance(np.concatenate([values, values.conj()]), np.linalg.eigvals(loop.matrix(600.0))) <= 1e-8


def test_turning_the_whole_machine_changes_no_eigenvalue() -> None:
    """Supports and magnet axes of an anisotropic machine turned by the same angle; tolerance 1e-8."""
    machine = anisotropic_machine()
    angle = 0.4
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    bearings = []
    for b in machine.bearings:
        k, d = (turn @ np.array(m, float) @ turn.T for m in (b.stiffness_matrix, b.damping_matrix))
        names = ("yy", "yz", "zy", "zz")
        values = {f"k{n}": float(v) for n, v in zip(names, k.ravel(), strict=True)}
        values |= {f"c{n}": float(v) for n, v in zip(names, d.ravel(), strict=True)}
        bearings.append(ad.Bearing(position=b.position, **values))
    magnets = tuple(ad.replace(m, {"axes_angle": m.axes_angle + angle}) for m in machine.magnets)
    turned = ad.replace(machine, {"bearings": tuple(bearings), "magnets": magnets})
    for speed in SPEEDS:
        first, second = (np.linalg.eigvals(ad.system(m).matrix(speed)) for m in (machine, turned))
        assert distance(first, second) <= 1e-8
    # turning the magnets alone does matter, for their axes have different controllers
    skew = ad.replace(machine, {"magnets": magnets})
    assert (
        distance(np.linalg.eigvals(ad.system(skew).matrix(0.0)), np.linalg.eigvals(ad.system(machine).matrix(0.0)))
        > 1e-6
    )


def test_planes_of_an_anisotropic_machine_part_at_rest() -> None:
    """Without rotation, cross coefficients and turned axes, y and z are two machines of their own."""
    base = ad.replace(
        isotropic_machine(),
        {"magnets": (), "controller": None, "sensors": (), "rotor.shaft.hysteretic_damping": 0.0},
    )
    base = ad.replace(base, {"rotor.shaft.segments[2].hysteretic_damping": 0.0})
    # balanced plies, for a laminate couples the planes: bending in one shears in the other
    base = ad.replace(base, {"plies.angle": 0.0})

    def supported(y: float, z: float) -> ad.Machine:
        return ad.replace(
            base,
            {
                "bearings": tuple(
                    ad.Bearing(position=x, kyy=k * y, kzz=k * z, cyy=c * y, czz=c * z)
                    for x, k, c in ((0.0, 9e6, 250.0), (0.78, 1.2e7, 200.0))
                )
            },
        )

    both_planes = np.linalg.eigvals(ad.system(supported(1.0, 3.0)).matrix(0.0))
    each = [np.linalg.eigvals(ad.system(supported(f, f)).matrix(0.0)) for f in (1.0, 3.0)]
    assert distance(np.concatenate(each), both_planes) <= 1e-8
