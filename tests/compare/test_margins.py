"""Margins against python-control, and against the stability of machines whose loop was changed by just that much."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.modal import LoopView, ModalLoop, Signals
from amb_design.analysis.outline import outline
from amb_design.analysis.scan import maximum, roots
from checks import within
from compare.loops import apart, is_stable, jeffcott, levitated, loop_alone
from independent.everything import anisotropic_machine, isotropic_machine

CASES = {
    "jeffcott": (jeffcott, 0.0),
    "levitated": (levitated, 400.0),
    "everything": (isotropic_machine, 500.0),
    "anisotropic": (anisotropic_machine, 500.0),
}


@pytest.mark.parametrize("name", CASES)
def test_gain_margins_are_where_stability_ends(name: str) -> None:
    """The gain of one axis alone, a hundredth of a per cent to either side of each margin."""
    make, speed = CASES[name]
    machine = make()
    found = ad.margins(machine, speed)
    complex_form = ad.system(machine).complex_form
    free = apart(machine)
    tried = 0
    for k, m in enumerate(found.loops):
        index, axis = (k, "controller") if complex_form else (k // 2, ("controller", "controller_z")[k % 2])
        path = f"magnets[{index}].{axis}.total_gain"
        own = getattr(free.magnets[index], axis).total_gain
        for factor, inside in ((m.gain_up, 1.0 - 1e-4), (m.gain_down, 1.0 + 1e-4)):
            if 0.0 < factor < math.inf:
                assert is_stable(ad.replace(free, {path: own * factor * inside}), speed), (m, factor)
                assert not is_stable(ad.replace(free, {path: own * factor / inside}), speed), (m, factor)
                tried += 1
        for factor in (0.3, 3.0):  # no margin is missed in between
            between = m.gain_down < factor < m.gain_up
            assert is_stable(ad.replace(free, {path: own * factor}), speed) or not between
    assert tried


@pytest.mark.parametrize("name", CASES)
def test_phase_and_disk_margins_against_python_control(name: str) -> None:
    make, speed = CASES[name]
    machine = make()
    found = ad.margins(machine, speed)
    step = 2 if ad.system(machine).complex_form else 1
    w = np.geomspace(1.0, 3e4, 500)
    for k, m in enumerate(found.loops[:2]):
        loop = loop_alone(machine, speed, step * k)
        near = m.disk_at * np.linspace(0.999, 1.001, 21)
        response = loop(1j * w)
        crossing = np.flatnonzero((np.abs(response[1:]) > 1.0) != (np.abs(response[:-1]) > 1.0))
        angles = np.pi - np.abs(np.angle(response[[crossing, crossing + 1]]))
        assert m.phase <= angles.max(axis=0).min(initial=np.inf) + 1e-9
        at = loop(1j * m.phase_at)
        assert abs(at) == pytest.approx(1.0, abs=1e-6)
        assert m.phase == pytest.approx(np.pi - abs(np.angle(at)), abs=1e-6)
        disk, _, _ = control.disk_margins(loop, np.sort(np.concatenate([w, near])))
        print(f"{name} {m.loop}: disk margin {m.disk:.4f}, python-control {float(disk):.4f}")
        assert m.disk == pytest.approx(float(disk), rel=1e-4)


def test_static_margin_of_a_loop_without_integrator() -> None:
    """A rotor that can only turn about a pin falls where k_i k_p no longer outweighs k_s."""
    base = levitated()
    pivoted = {"controller": jeffcott(ki=0.0).controller, "magnets": base.magnets[:1], "pins": (ad.Pin(position=0.55),)}
    machine = ad.replace(base, pivoted)
    magnet = outline(machine)["magnets"][0]
    found = ad.margins(machine).loops[0]
    assert found.gain_down_at == 0.0
    expected = magnet["negative_stiffness_n_per_m"] / (magnet["current_stiffness_n_per_a"] * machine.controller.kp)
    within(found.gain_down, expected, 1e-8, "smallest gain that holds the rotor")


def test_both_forms_say_the_same() -> None:
    machine = isotropic_machine()
    one = ad.margins(ad.system(machine), 500.0)
    two = ad.margins(ad.system(machine, complex_form=False), 500.0)
    for k, m in enumerate(one.loops):
        for name in ("gain_up", "gain_down", "phase", "disk"):
            assert getattr(m, name) == pytest.approx(getattr(two.loops[2 * k], name), rel=1e-6)
            assert getattr(m, name) == pytest.approx(getattr(two.loops[2 * k + 1], name), rel=1e-6)


def test_sensitivity_as_a_sum_over_modes() -> None:
    """Against the banded solution."""
    for machine in (isotropic_machine(), anisotropic_machine()):
        loop = ad.system(machine)
        w = np.geomspace(1.0, 1e5, 200)
        direct = ad.sensitivity(loop, 600.0, w).sensitivity
        view = LoopView(ModalLoop(loop, 600.0), Signals.of(loop))
        for j in range(len(view.names)):
            assert np.abs(view.sensitivity(w, j) - direct[:, j]).max() <= 1e-8


def test_margins_need_a_stable_loop() -> None:
    with pytest.raises(ad.ModelError, match="is not stable at 0 rpm"):
        ad.margins(levitated(controller=ad.PID(kp=1.0)))
    with pytest.raises(ad.ModelError, match="no control loop"):
        ad.margins(ad.load("jeffcott"))


def test_roots_in_pairs_between_two_points() -> None:
    grid = np.linspace(0.0, 10.0, 12)
    wanted = np.array([3.30, 3.34, 7.0])
    found = roots(lambda x: (x - wanted[0]) * (x - wanted[1]) * (x - wanted[2]), grid)
    np.testing.assert_allclose(found, wanted, atol=1e-10)
    value, place = maximum(lambda x: np.exp(-((x - 3.14159) ** 2)), grid)
    assert value == pytest.approx(1.0)
    assert place == pytest.approx(3.14159, abs=1e-4)
