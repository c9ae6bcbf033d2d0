"""Every type of controller: complex against real form, python-control's connection of its pieces, and two ways to a response."""

from __future__ import annotations

import dataclasses

import casadi as ca
import control
import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.frequency import Loops
from amb_design.analysis.system import dense
from amb_design.analysis.unbalance import unbalance_forces
from amb_design.model.loop import ports
from amb_design.synthesis.plant import PlantFamily
from amb_design.synthesis.reduction import basis_of
from independent.test_control import real_plant, state_space
from synthesis.levitated import apart, laws, lqg, small, widened

LAWS = laws()
SPEEDS = (0.0, 420.0, 1600.0)
BEFORE = ("sensor_gain", "low_pass")
BEHIND = ("notches", "delay", "amplifier")

every_law = pytest.mark.parametrize("name", LAWS)
with_sensors = pytest.mark.parametrize("name", [n for n in LAWS if "LQR" not in n])
in_both_forms = pytest.mark.parametrize("name", [n for n in LAWS if n != "two inputs a magnet"])


@in_both_forms
def test_forms(name: str) -> None:
    """The complex form's eigenvalues and their conjugates are those of the real form; 1e-8."""
    one, two = (ad.system(small(LAWS[name]), complex_form=form) for form in (True, False))
    worst = 0.0
    for speed in SPEEDS:
        values = np.linalg.eigvals(one.matrix(speed)) - 1.0  # integrators lie at zero
        worst = max(worst, apart(np.concatenate([values, values.conj()]), np.linalg.eigvals(two.matrix(speed)) - 1.0))
    print(f"{name}: {worst:.1e}")
    assert worst <= 1e-8


def law_at(law: ad.StateSpace, speed: float) -> tuple[np.ndarray, ...]:
    """Complex a, b, c and d at a speed."""
    n, m = law.law.states, law.law.ports
    out = {"a": (n, n), "b": (n, m), "c": (m, n), "d": (m, m)}
    total = {name: np.zeros(shape, complex) for name, shape in out.items()}
    for factor, part in zip((1.0, 1j, speed, 1j * speed), law.parts, strict=True):
        for name in "abcd" if part else "":
            total[name] += factor * np.array(getattr(part, name) or 0.0)
    return tuple(total.values())


def connected(machine: ad.Machine, speed: float) -> control.StateSpace:
    """All controllers at a speed from their pieces, axes in the order of the magnets: first and second of each."""
    law = ad.synthesise(machine).controller
    count = len(machine.magnets)
    if isinstance(law, ad.PID):
        straight = state_space(ad.replace(law, {"kc": 0.0, "kc_rate": 0.0}))
        across = state_space(ad.replace(law, {"kp": law.kc + speed * law.kc_rate, "ki": 0.0, "kd": 0.0}))
        turn = control.ss([], [], [], np.kron(np.eye(count), [[0.0, -1.0], [1.0, 0.0]]))
        return control.append(*[straight] * 2 * count) + turn * control.append(*[across] * 2 * count)
    assert isinstance(law, ad.StateSpace)
    before = state_space(ad.PID(kp=1.0, sensor_gain=law.sensor_gain, low_pass=law.low_pass))
    behind = state_space(ad.PID(kp=1.0, notches=law.notches, delay=law.delay, amplifier=law.amplifier))
    a, b, c, d = law_at(law, speed)
    order = list(range(2 * count))
    if law.law.ports == 1:
        whole = control.append(*[control.ss(a.real, b.real, c.real, d.real)] * 2 * count)
    elif law.law.ports == count:  # a complex law sees all magnets in y, then all in z
        order = [2 * k + plane for plane in (0, 1) for k in range(count)]
        whole = control.ss(*map(widened, (a, b, c, d)))
    else:
        whole = control.ss(a.real, b.real, c.real, d.real)
    pick = control.ss([], [], [], np.eye(2 * count)[order])
    put = control.ss([], [], [], np.eye(2 * count)[:, order])
    return put * control.append(*[behind] * 2 * count) * whole * control.append(*[before] * 2 * count) * pick


@with_sensors
def test_connected_pieces(name: str) -> None:
    """Poles (1e-6, for some come in pairs) and sensitivities of all loops (1e-8) of plant, filters and law joined by python-control."""
    machine, speed = small(LAWS[name]), 420.0
    loop, plant, pieces = ad.system(machine, complex_form=False), real_plant(machine, speed), connected(machine, speed)
    axes = [a.name for a in loop.plant.axes]
    order = [axes.index(a.name) for a in loop.plant.loops]
    worst = 0.0
    for w in (60.0, 500.0, 2500.0, 9000.0):
        expected = np.linalg.inv(np.eye(len(axes)) + plant(1j * w) @ pieces(1j * w))[np.ix_(order, order)]
        found = Loops(loop.plant).at(w, speed).sensitivity
        worst = max(worst, float(np.abs(found - expected).max() / np.abs(expected).max()))
    print(f"{name}: sensitivities {worst:.1e}")
    assert worst <= 1e-8
    if not isinstance(machine.controller, ad.PID):  # whose cross path was built with filters of its own
        poles = control.feedback(plant, pieces).poles()
        error = apart(poles - 1.0, np.linalg.eigvals(loop.matrix(speed)) - 1.0)
        print(f"{name}: poles {error:.1e}")
        assert error <= 1e-6


@with_sensors
@pytest.mark.parametrize("complex_form", [True, False])
def test_sensitivity_from_eigenvalues(name: str, complex_form: bool) -> None:
    """1 + C (s - A)^-1 (F + s G) over the eigenvectors of the closed loop, against banded solutions of the open one; 1e-8."""
    if complex_form and name == "two inputs a magnet":
        pytest.skip("has the real form only")
    loop, speed = ad.system(small(LAWS[name]), complex_form=complex_form), 420.0
    seen = ports(loop.plant, loop.pencil)
    f, g, c = (dense(m) for m in (seen.F, seen.G, seen.C))
    values, right = np.linalg.eig(loop.matrix(speed))
    left = np.linalg.inv(right) @ loop.from_rate
    leave = c[: f.shape[1]] @ loop.to_state @ right
    worst = 0.0
    for w in (-3000.0, -200.0, 90.0, 700.0, 6000.0):
        s = 1j * w
        expected = np.eye(f.shape[1]) + leave @ ((left @ (f + s * g)) / (s - values)[:, None])
        found = Loops(loop.plant).at(w, speed).sensitivity
        worst = max(worst, float(np.abs(found - expected).max() / np.abs(expected).max()))
    print(f"{name}: {worst:.1e}")
    assert worst <= 1e-8


@every_law
def test_unbalance_response(name: str) -> None:
    """Displacements from the pencil (1e-8), currents from the displacements at the sensors and the joined pieces (1e-7)."""
    machine = small(LAWS[name])
    loop = ad.system(machine)
    result = ad.unbalance_response(loop, SPEEDS[1:])
    e, a0, a1 = (dense(m) for m in (loop.pencil.E, loop.pencil.A0, loop.pencil.A1))
    n, where = loop.displacements, loop.plant.mesh.node_of
    for k, speed in enumerate(SPEEDS[1:]):
        force = np.zeros(len(e), complex)
        force[n : 2 * n] = speed**2 * unbalance_forces(loop)
        q = np.linalg.solve(1j * speed * e - a0 - speed * a1, force)[:n]
        v, w = (q[0::2], -1j * q[0::2]) if loop.complex_form else (q[0::4], q[1::4])
        shape = np.stack([v, w], axis=1)
        assert np.abs(shape - result.displacements[k]).max() <= 1e-8 * np.abs(shape).max()
        if "LQR" in name:
            continue
        seen = np.concatenate([shape[where("sensors[0].position")], shape[where("magnets[1].position")]])
        currents = (-connected(machine, speed)(1j * speed) @ seen).reshape(2, 2)
        assert np.abs(currents - result.currents[k]).max() <= 1e-7 * np.abs(currents).max()


def test_the_plant_is_the_same_for_all() -> None:
    """Without its controller each machine is the same model, entry by entry."""
    models = {name: ad.open_loop(small(law)) for name, law in LAWS.items()}
    first = models["PID"]
    for name, model in models.items():
        for matrix in ("M", "C0", "C1", "K0", "K1", "E", "A0", "A1", "B", "C"):
            ours, theirs = (m.function(matrix)(ca.DM(0, 1)) for m in (first, model))
            for a, b in zip(ours, theirs, strict=True):
                assert (a.full() == b.full()).all(), f"{name}: {matrix}"


@pytest.mark.parametrize("name", ["LQG", "cross and rates"])
def test_law_of_both_planes_is_that_of_each_axis(name: str) -> None:
    """A complex law written out for all four axes, two inputs a magnet, gives the same machine."""
    machine = small(LAWS[name])
    law = ad.synthesise(machine).controller
    order = [0, 2, 1, 3]  # from all magnets in y, then in z, to the axes of each magnet
    fixed, moved = law_at(law, 0.0), law_at(law, 1.0)
    parts = []
    for a, b, c, d in (fixed, tuple(y - x for x, y in zip(fixed, moved, strict=True))):
        parts.append(
            ad.Matrices(a=widened(a), b=widened(b)[:, order], c=widened(c)[order], d=widened(d)[np.ix_(order, order)])
        )
    hardware = {k: getattr(law, k) for k in (*BEFORE, *BEHIND)}
    written_out = small(ad.StateSpace(law=parts[0], law_rate=parts[1], **hardware))
    for speed in SPEEDS:
        ours = np.linalg.eigvals(ad.system(machine, complex_form=False).matrix(speed))
        theirs = np.linalg.eigvals(ad.system(written_out).matrix(speed))
        assert apart(ours - 1.0, theirs - 1.0) <= 1e-8


def known(machine: ad.Machine, speed: float, frequencies: np.ndarray, rest: bool) -> np.ndarray:
    """From the law's output to its input, as the law has it; with or without what modes left out add statically."""
    basis = basis_of(machine, machine.controller.modes)
    basis = basis if rest else dataclasses.replace(basis, residual=0.0 * basis.residual)
    v = PlantFamily(ca.SX(0, 1), machine, basis).at(np.zeros(0)).values
    a = v["A0"] + speed * v["A1"]
    return np.array([v["C"] @ np.linalg.solve(1j * w * np.eye(len(a)) - a, v["B"]) for w in frequencies])


def true(machine: ad.Machine, speed: float, frequencies: np.ndarray) -> np.ndarray:
    """The same from the full model and the filters' transfer functions; a current acts with the minus sign of the feedback."""
    law = machine.controller
    chain = state_space(ad.PID(kp=1.0, **{k: getattr(law, k) for k in (*BEFORE, *BEHIND)}))
    loops = Loops(ad.system(machine).plant)
    return np.array([-loops.at(w, speed).plant * chain(1j * w) for w in frequencies])


def test_static_rest() -> None:
    """What the modes left out add statically brings the plant that the law knows closer to the true one; with all modes it is exact."""
    frequencies, speed = np.geomspace(30.0, 3e3, 30), 400.0
    errors = {}
    for modes in (3, 4, 6, 18):
        machine = small(lqg(modes=modes))
        expected = true(machine, speed, frequencies)
        size = np.abs(expected).max(axis=(1, 2), keepdims=True)
        for rest in (True, False):
            errors[modes, rest] = float((np.abs(known(machine, speed, frequencies, rest) - expected) / size).max())
    print("plant of the law against the full one:", {k: f"{v:.1e}" for k, v in errors.items()})
    for modes in (3, 4, 6):
        assert errors[modes, True] < 0.35 * errors[modes, False]
    assert errors[6, True] < errors[4, True] < errors[3, True] < 0.1
    assert errors[18, True] <= 1e-9
