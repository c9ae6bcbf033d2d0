"""python-control sees the same machine."""

from __future__ import annotations

import numpy as np
import pytest

import amb_design as ad
from amb_design.errors import ModelError
from amb_design.interop.control import from_ss, to_ss, to_tf
from checks import within, within_absolute

control = pytest.importorskip("control", reason="python-control is not installed")
SPEED = 500.0


@pytest.fixture(scope="module")
def machine() -> ad.Machine:
    return ad.replace(ad.load("thesis-tuned"), {"rotor.shaft.elements": 6})


def test_poles_are_the_eigenvalues(machine: ad.Machine) -> None:
    found = to_ss(machine, SPEED)
    expected = np.linalg.eigvals(ad.system(machine, complex_form=False).matrix(SPEED))
    near = np.abs(found.poles()[:, None] - expected).min(axis=1) / np.abs(expected).max()
    within_absolute(near, np.zeros(len(near)), 1e-10, "poles")
    assert found.input_labels[:2] == ["current magnets[0] y", "current magnets[0] z"]
    assert found.output_labels[3] == "displacement magnets[1] z"
    assert found.state_labels[0] == "mode 0 place"
    assert len(set(found.state_labels)) == found.nstates


def test_feedback_of_plant_and_controller_is_the_closed_loop(machine: ad.Machine) -> None:
    plant, law = to_ss(machine, SPEED, "plant"), to_ss(machine, SPEED, "controller")
    names = [n.removeprefix("displacement ") for n in plant.output_labels]
    assert law.input_labels == plant.output_labels
    assert law.output_labels == plant.input_labels
    closed = control.feedback(plant, law, sign=1)
    frequencies = np.array([10.0, 300.0, 2000.0])
    whole = to_ss(machine, SPEED)
    assert whole.state_labels[-law.nstates :] == law.state_labels
    a, b = (s.frequency_response(frequencies).complex for s in (closed, whole))
    assert a.shape == (len(names), len(names), 3)
    within_absolute(a / np.abs(b).max(), b / np.abs(b).max(), 1e-9, "closed loop")


def test_sensitivity_from_python_control(machine: ad.Machine) -> None:
    plant, law = to_ss(machine, SPEED, "plant"), to_ss(machine, SPEED, "controller")
    ours = ad.sensitivity(machine, SPEED, [200.0, 900.0])
    for k, w in enumerate((200.0, 900.0)):
        loop = np.eye(4) - plant(1j * w) @ law(1j * w)
        theirs = np.linalg.inv(loop)[0, 0]
        assert abs(theirs) == pytest.approx(abs(ours.sensitivity[k, 0]), rel=1e-7)


def test_transfer_function(machine: ad.Machine) -> None:
    single = to_tf(machine, "displacement magnets[0] y", "current magnets[0] y", SPEED, "plant", modes=3)
    whole = to_ss(machine, SPEED, "plant", modes=3)
    w = np.array([5.0, 80.0, 700.0])
    found, expected = single(1j * w), np.array([whole(1j * x)[0, 0] for x in w])
    within(np.abs(found), np.abs(expected), 1e-5, "transfer function")
    assert single.input_labels == ["current magnets[0] y"]


def test_controllers_come_back(machine: ad.Machine) -> None:
    back = ad.replace(machine, {"controller": from_ss(to_ss(machine, part="controller"))})
    expected = np.linalg.eigvals(ad.system(machine, complex_form=False).matrix(SPEED))
    found = np.linalg.eigvals(ad.system(back, complex_form=False).matrix(SPEED))
    near = np.abs(found[:, None] - expected).min(axis=1) / np.abs(expected).max()
    within_absolute(near, np.zeros(len(expected)), 1e-9, "eigenvalues")


def test_a_law_of_python_control_behind_our_hardware(machine: ad.Machine) -> None:
    """A PID with a filtered derivative, as a transfer function for each axis."""
    ours = ad.replace(machine, {"controller.derivative_time": 1e-4, "controller.notches": ()})
    pid, s = ours.controller, control.tf("s")
    law = -pid.total_gain * (pid.kp + pid.ki / s + pid.kd * s / (pid.derivative_time * s + 1.0))
    theirs = ad.replace(machine, {"controller": from_ss(law, hardware_of=pid)})
    limits = [ad.stability_limit(m) for m in (ours, theirs)]
    assert limits[0].status == "limit found"
    assert limits[1].speed == pytest.approx(limits[0].speed, rel=1e-8)


def test_foreign_controllers_that_do_not_fit(machine: ad.Machine) -> None:
    with pytest.raises(ModelError, match=r"is sampled every 0\.001 s; give a continuous one"):
        from_ss(control.ss(0.5, 1.0, 1.0, 0.0, dt=1e-3))
    with pytest.raises(ModelError, match=r"sees 'velocity magnets\[0\] y', which no sensor reports"):
        from_ss(to_ss(ad.load("tum-rig"), part="controller"))
    s = control.tf("s")
    with pytest.raises(ModelError, match=r"is improper: degree 2 over degree 1; add poles beyond"):
        from_ss((1.0 + s) ** 2 / (1e-4 * s + 1.0))
    with pytest.raises(ModelError, match=r"cancel 1 of its 3 poles; give control\.minreal of it"):
        from_ss((s - 30.0) * (s + 50.0) / ((s - 30.0) * (s + 1e3) * (s + 2e3)))
    with pytest.raises(ModelError, match=r"2 outputs and 2 inputs; give one of a single axis, or a state space"):
        from_ss(control.tf([[[1.0], [0.0]], [[0.0], [1.0]]], [[[1.0, 1.0], [1.0]], [[1.0], [1.0, 1.0]]]))
    with pytest.raises(ad.SpecError, match="give as many inputs as outputs"):
        from_ss(control.ss([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]]))


def test_mistakes_are_named(machine: ad.Machine) -> None:
    with pytest.raises(ModelError, match="choose one of closed_loop, plant, controller"):
        to_ss(machine, part="loop")
    with pytest.raises(ModelError, match="there is no signal 'x'; choose one of displacement magnets"):
        to_tf(machine, "x", "current magnets[0] y")
    with pytest.raises(ModelError, match="has no magnet"):
        to_ss(ad.load("jeffcott"))
