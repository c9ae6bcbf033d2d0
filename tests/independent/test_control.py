"""Controller chain, sensitivity and unbalance response against python-control and against dense solutions."""

from __future__ import annotations

import math

import casadi as ca
import control
import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.frequency import Controller
from amb_design.analysis.system import dense
from amb_design.analysis.unbalance import unbalance_forces
from amb_design.model.controller import realise
from independent.everything import anisotropic_machine, isotropic_machine

FREQUENCIES = np.concatenate([-np.geomspace(1.0, 1e6, 25), np.geomspace(1.0, 1e6, 60)])

LOW_PASS = ad.LowPass(frequency=6000.0, damping=0.65)
NOTCHES = (ad.Notch(frequency=1500.0, damping=0.1, width=1.0), ad.Notch(frequency=5200.0, damping=0.3, width=0.6))
AMPLIFIER = ad.Amplifier(gain=1.7, bandwidth=15000.0, damping=0.6)

CHAINS = {
    "gain": ad.PID(kp=2.0),
    "PID": ad.PID(kp=2.0, ki=30.0, kd=1e-3),
    "PD, filtered": ad.PID(kp=2.0, kd=1e-3, derivative_time=1e-4),
    "low-pass and PID": ad.PID(kp=2.0, ki=30.0, kd=1e-3, low_pass=LOW_PASS),
    "notches": ad.PID(kp=2.0, kd=1e-3, notches=NOTCHES),
    "delay": ad.PID(kp=2.0, ki=5.0, delay=1e-4),
    "amplifier": ad.PID(kp=2.0, kd=1e-3, amplifier=AMPLIFIER),
    "everything": ad.PID(
        sensor_gain=7000.0,
        low_pass=LOW_PASS,
        total_gain=0.3,
        kp=2.0,
        ki=30.0,
        kd=1e-3,
        derivative_time=3e-5,
        notches=NOTCHES,
        delay=1e-4,
        amplifier=AMPLIFIER,
    ),
}


def blocks(c: ad.PID) -> list[control.TransferFunction]:
    """S LP Kt (Kp + Ki/s + Kd s) N D AMP, block by block; the PID and its low-pass are one, for it may be improper."""
    tf = control.TransferFunction
    pid = tf([c.kp], [1.0])
    if c.ki:
        pid = pid + tf([c.ki], [1.0, 0.0])
    if c.kd:
        pid = pid + tf([c.kd, 0.0], [c.derivative_time, 1.0] if c.derivative_time else [1.0])
    if c.low_pass is not None:
        w, z = c.low_pass.frequency, c.low_pass.damping
        pid = pid * tf([w**2], [1.0, 2.0 * z * w, w**2])
    out = [tf([c.sensor_gain * c.total_gain], [1.0]), pid]
    for notch in c.notches:
        w = notch.frequency
        out.append(tf([1.0, 2.0 * notch.damping * w, w**2], [1.0, 2.0 * notch.width * w, w**2]))
    if c.delay:
        out.append(tf(*control.pade(c.delay, 2)))
    if c.amplifier is not None:
        w, z = c.amplifier.bandwidth, c.amplifier.damping
        out.append(tf([c.amplifier.gain * w**2], [1.0, 2.0 * z * w, w**2]))
    return out


def transfer_function(c: ad.PID) -> control.TransferFunction:
    """The whole chain from displacement to current, without the minus sign of the feedback."""
    g = control.TransferFunction([1.0], [1.0])
    for block in blocks(c):
        g = g * block
    return g


def state_space(c: ad.PID) -> control.StateSpace:
    """The same as a series of state-space models in controllable form: better conditioned than one high-order fraction."""
    g = control.ss([], [], [], [[1.0]])
    for block in blocks(c):
        num, den = block.num[0][0] / block.den[0][0][0], block.den[0][0] / block.den[0][0][0]
        order = len(den) - 1
        num = np.concatenate([np.zeros(order + 1 - len(num)), num])
        if not order:
            g = g * control.ss([], [], [], [[num[0]]])
            continue
        a = np.diag(np.ones(order - 1), 1)
        a[-1] = -den[:0:-1]
        b = np.zeros((order, 1))
        b[-1] = 1.0
        output = (num[1:] - num[0] * den[1:])[::-1]
        g = control.ss(a, b, output[None, :], [[num[0]]]) * g
    return g


@pytest.mark.parametrize("name", CHAINS)
def test_chain(name: str) -> None:
    """The realisation against the product of transfer functions, both signs of the frequency; 1e-9."""
    chain = Controller(realise([CHAINS[name]]))
    reference = transfer_function(CHAINS[name])
    computed = np.array([chain.at(float(w))[0, 0] for w in FREQUENCIES])
    expected = np.array([reference(1j * w) for w in FREQUENCIES])
    error = np.max(np.abs(computed - expected) / np.abs(expected))
    print(f"chain '{name}': {error:.1e} over {len(FREQUENCIES)} frequencies")
    assert error <= 1e-9


def test_delay_is_a_delay() -> None:
    """Pade of second order: modulus one, phase -w T to (w T)^5/720."""
    chain = Controller(realise([ad.PID(kp=1.0, delay=1e-4)]))
    for w in (10.0, 1e3, 5e3):
        got = chain.at(w)[0, 0]
        assert abs(got) == pytest.approx(1.0, rel=1e-12)
        assert abs(np.angle(got) + w * 1e-4) <= (w * 1e-4) ** 5 / 720.0 * 1.1 + 1e-12


def test_number_of_states() -> None:
    """Seven states an axis for the chain of the thesis; none for blocks that are left out."""
    thesis = ad.load("thesis").controller
    assert thesis is not None
    assert len(realise([thesis]).states) == 7
    expected = {"gain": 0, "PID": 1, "PD, filtered": 1, "low-pass and PID": 3, "notches": 4, "delay": 3, "amplifier": 2}
    assert {n: len(realise([CHAINS[n]]).states) for n in expected} == expected
    assert len(realise([CHAINS["everything"]]).states) == 2 + 1 + 1 + 4 + 2 + 2


def real_plant(machine: ad.Machine, speed: float) -> control.StateSpace:
    """From control currents to displacements at the sensors of all axes."""
    plant = ad.system(machine, complex_form=False).plant
    m, c0, c1, k0, k1 = (dense(x) for x in (plant.M, plant.C0, plant.C1, plant.K0, plant.K1))
    n, count = plant.size, len(plant.axes)
    inverse = np.linalg.inv(m)
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ (k0 + speed * k1), -inverse @ (c0 + speed * c1)]])
    push = np.hstack([float(x.current_stiffness) * ca.DM(x.actuator).full() for x in plant.axes])
    sense = np.hstack([ca.DM(x.sensor).full() for x in plant.axes])
    b = np.vstack([np.zeros((n, count)), inverse @ push])
    c = np.hstack([sense.T, np.zeros((count, n))])
    return control.ss(a, b, c, np.zeros((count, count)))


def real_loop(machine: ad.Machine, speed: float) -> tuple[control.StateSpace, control.StateSpace, int]:
    """Plant from control currents to sensor displacements, controllers, number of axes: state-space models."""
    controllers = []
    for magnet in machine.magnets:
        first, second = machine.controllers_of(magnet)
        assert first is not None
        assert second is not None
        controllers += [state_space(first), state_space(second)]
    return real_plant(machine, speed), control.append(*controllers), len(controllers)


@pytest.mark.parametrize("speed", [0.0, 700.0])
@pytest.mark.parametrize("kind", ["isotropic", "anisotropic"])
def test_sensitivity(kind: str, speed: float) -> None:
    """1/(1 + L) of each axis with all others closed, against feedback of state-space models; 1e-6."""
    machine = isotropic_machine() if kind == "isotropic" else anisotropic_machine()
    frequencies = np.geomspace(30.0, 2e4, 30)
    computed = ad.sensitivity(machine, speed, frequencies)
    plant, chains, count = real_loop(machine, speed)
    loop = control.feedback(control.ss([], [], [], np.eye(count)), plant * chains)
    response = np.stack([loop(1j * w) for w in frequencies])
    expected = np.diagonal(response, axis1=1, axis2=2)
    if kind == "isotropic":  # one loop a magnet: y and z are alike
        assert np.abs(expected[:, 0::2] - expected[:, 1::2]).max() <= 1e-6 * np.abs(expected).max()
        expected = expected[:, 0::2]
    error = float(np.max(np.abs(computed.sensitivity - expected) / np.abs(expected)))
    print(f"sensitivity, {kind}, {speed} rad/s: {error:.1e}")
    assert error <= 1e-6
    np.testing.assert_allclose(1.0 / (1.0 + computed.open_loop), computed.sensitivity, rtol=1e-12)


def test_one_loop_by_hand() -> None:
    """1/(1 + P G) in python-control for a machine with a single magnet at rest, and the peak by a dense grid."""
    base = isotropic_machine()
    machine = ad.replace(base, {"magnets": base.magnets[:1], "rotor.shaft.hysteretic_damping": 0.0})
    plant, chains, _ = real_loop(machine, 0.0)
    loop = control.feedback(control.ss([], [], [], np.eye(2)), plant * chains)
    result = ad.sensitivity(machine)
    w = np.linspace(0.98, 1.02, 201) * result.worst.frequency
    dense_grid = max(abs(loop(1j * x)[0, 0]) for x in w)
    assert result.worst.value == pytest.approx(dense_grid, rel=1e-6)
    everywhere = max(abs(loop(1j * x)[0, 0]) for x in np.geomspace(10.0, 1.2e4, 1000))
    assert result.worst.value >= everywhere * (1.0 - 1e-9)


@pytest.mark.parametrize(
    ("kind", "complex_form"),
    [("isotropic", True), ("isotropic", False), ("anisotropic", False), ("thesis", True), ("thesis", False)],
)
def test_unbalance_response(kind: str, complex_form: bool) -> None:
    """(i Omega E - A0 - Omega A1) x = F, solved densely on the pencil; 1e-9."""
    machine = {
        "isotropic": isotropic_machine,
        "anisotropic": anisotropic_machine,
        "thesis": lambda: ad.load("thesis-tuned"),
    }[kind]()
    machine = ad.replace(machine, {"rotor.disks[0].unbalance": 2e-4, "rotor.disks[0].unbalance_phase": 1.1})
    loop = ad.system(machine, complex_form=complex_form)
    speeds = [120.0, 500.0, 777.0, 1500.0]
    result = ad.unbalance_response(loop, speeds)
    e, a0, a1 = (dense(m) for m in (loop.pencil.E, loop.pencil.A0, loop.pencil.A1))
    n = loop.displacements
    worst = worst_current = 0.0
    for k, speed in enumerate(speeds):
        force = np.zeros(len(e), complex)
        force[n : 2 * n] = speed**2 * unbalance_forces(loop)
        q = np.linalg.solve(1j * speed * e - a0 - speed * a1, force)[:n]
        v, w = (q[0::2], -1j * q[0::2]) if complex_form else (q[0::4], q[1::4])
        shape = np.stack([v, w], axis=1)
        worst = max(worst, float(np.abs(shape - result.displacements[k]).max() / np.abs(shape).max()))
        # currents from the displacements at the sensors by the chains' transfer functions
        for i, magnet in enumerate(machine.magnets):
            path = next(
                (f"sensors[{j}].position" for j, s in enumerate(machine.sensors) if s.name == magnet.sensor), ""
            )
            u = shape[loop.plant.mesh.node_of(path or f"magnets[{i}].position")]
            c, s = math.cos(magnet.axes_angle), math.sin(magnet.axes_angle)
            for axis, seen in enumerate((c * u[0] + s * u[1], -s * u[0] + c * u[1])):
                controller = machine.controllers_of(magnet)[axis]
                assert controller is not None
                current = -transfer_function(controller)(1j * speed) * seen
                error = abs(current - result.currents[k, i, axis]) / np.abs(result.currents[k]).max()
                worst_current = max(worst_current, float(error))
    print(f"unbalance, {kind}: displacements {worst:.1e}, currents {worst_current:.1e}")
    assert worst <= 1e-9
    assert worst_current <= 1e-8
