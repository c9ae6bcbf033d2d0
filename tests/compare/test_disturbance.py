"""Force steps and shocks against matrix exponentials of the real form and against the transient simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.linalg as sla

import amb_design as ad
from amb_design.analysis.system import dense
from checks import within, within_absolute
from compare.loops import jeffcott, levitated
from independent.everything import anisotropic_machine, isotropic_machine


def stepped(machine: ad.Machine, speed: float, node: int, direction: int, step: float, count: int) -> np.ndarray:
    """Displacements of all real coordinates after a unit force step, by powers of one matrix exponential."""
    loop = ad.system(machine, complex_form=False)
    e, a0, a1 = (dense(m).real for m in (loop.pencil.E, loop.pencil.A0, loop.pencil.A1))
    load = np.zeros(len(e))
    load[loop.displacements + 4 * node + direction] = 1.0
    a, b = np.linalg.solve(e, a0 + speed * a1), np.linalg.solve(e, load)
    whole = sla.expm(step * np.block([[a, b[:, None]], [np.zeros((1, len(a) + 1))]]))
    x, out = np.append(np.zeros(len(a)), 1.0), []
    for _ in range(count):
        x = whole @ x
        out.append(x[:-1])
    return np.array(out)


@pytest.mark.parametrize("make", [levitated, isotropic_machine, anisotropic_machine])
def test_force_step_against_matrix_exponential(make) -> None:
    machine, speed, force, step, count = make(), 400.0, 50.0, 2e-4, 400
    response = ad.force_step(machine, "disks[1]", force, speed)
    mesh = ad.system(machine, complex_form=False).plant.mesh
    node = mesh.node_of("rotor.disks[1].position")
    x = force * stepped(machine, speed, node, 0, step, count)
    times = step * np.arange(1, count + 1)
    moved = response.displacements(times)
    scale = np.abs(x[:, 4 * node : 4 * node + 2]).max()
    for place, path in (
        ("disk 2", "rotor.disks[1].position"),
        ("disk 1", "rotor.disks[0].position"),
        ("magnet 1", "magnets[0].position"),
    ):
        k = response.watched.places.index(place)
        at = 4 * mesh.node_of(path)
        within_absolute(moved[:, k] / scale, x[:, at : at + 2] / scale, 1e-8, f"{machine.name}: {place}")


@pytest.mark.parametrize("make", [levitated, anisotropic_machine])
def test_peaks_and_settling_time_by_brute_force(make) -> None:
    machine, speed = make(), 300.0
    response = ad.force_step(machine, "magnets[0]", 10.0, speed, settled=0.02)
    t = np.linspace(0.0, 1.2 * response.settling_time, 20001)
    moved = response.displacements(t)
    radius = np.linalg.norm(moved, axis=2)
    within(response.peaks, np.maximum(radius.max(axis=0), np.linalg.norm(response.final, axis=1)), 1e-4, "peaks")
    assert response.peak_place == response.watched.places[int(radius.max(axis=0).argmax())]
    assert abs(response.peak_time - t[radius.max(axis=1).argmax()]) <= 2.0 * t[1]
    away = np.linalg.norm(moved - response.final, axis=2).max(axis=1)
    last = t[np.flatnonzero(away > 0.02 * response.peak)[-1]]
    assert last <= response.settling_time <= last + 2.0 * t[1]
    t = np.linspace(0.0, 30.0 * response.settling_time, 60001)
    within(response.peak_current, np.abs(response.axis_currents(t)).max(), 1e-3, "peak current")


@pytest.mark.parametrize("make", [levitated, anisotropic_machine])
def test_final_places_and_currents_are_static(make) -> None:
    """A x + b = 0 solved on the pencil; an integrator brings the shaft back to the centre of its sensor."""
    machine, speed = make(), 250.0
    response = ad.force_step(machine, "disk 1", 100.0, speed)
    loop = ad.system(machine, complex_form=False)
    a0, a1 = dense(loop.pencil.A0), dense(loop.pencil.A1)
    mesh = loop.plant.mesh
    load = np.zeros(len(a0))
    load[loop.displacements + 4 * mesh.node_of("rotor.disks[0].position")] = 100.0
    x = np.linalg.solve(a0 + speed * a1, -load)
    at = [4 * mesh.node_of(f"magnets[{i}].position") for i in range(2)]
    at += [4 * mesh.node_of(f"rotor.disks[{i}].position") for i in range(len(machine.rotor.disks))]
    expected = np.array([x[k : k + 2] for k in at])
    within_absolute(response.final / response.peak, expected / response.peak, 1e-8, "final places")
    if machine.name == "levitated":  # its first magnet has its sensor where it pulls
        assert np.linalg.norm(response.final[0]) <= 1e-8 * response.peak


def test_shock_against_the_transient_simulation() -> None:
    """A half-sine of the base as a fine table, by the simulation with linear magnets; and its currents."""
    machine, duration, speed = levitated(unbalance=0.0), 0.012, 350.0
    response = ad.base_shock(machine, 4.0, duration, speed)
    table = np.linspace(0.0, duration, 241)
    pulse = ad.BaseMotion(times=table, y=4.0 * np.sin(math.pi * table / duration))
    run = ad.simulate(
        machine, 0.04, speed=speed, gravity=False, linear=True, disturbances=[pulse], step=2.5e-4, tolerance=1e-9
    )
    moved = response.displacements(run.times)
    for k, x in enumerate(response.watched.positions):
        within_absolute(moved[:, k] / response.peak, run.at(x) / response.peak, 2e-4, response.watched.places[k])
    scale = response.peak_current
    got = response.axis_currents(run.times).reshape(-1, 2, 2)
    within_absolute(got / scale, run.currents / scale, 2e-4, "currents")
    assert not response.final.any()


def test_step_of_the_base_is_weight() -> None:
    """An acceleration that stays acts like gravity across the shaft."""
    machine = levitated(unbalance=0.0)
    response = ad.base_shock(machine, 9.80665, angle=math.pi / 2.0)
    run = ad.simulate(machine, 0.2, speed=0.0, linear=True, step=1e-3)
    start = response.displacements(run.times)
    scale = response.peak
    for k, x in enumerate(response.watched.positions):  # gravity acts along -y, an acceleration in z along -z
        within_absolute(start[:, k, 1] / scale, run.at(x)[:, 0] / scale, 1e-4, response.watched.places[k])


def test_pinned_shaft_feels_the_base() -> None:
    """The mass near pins moves with them: sums of inertia loads against the static deflection under gravity."""
    machine = jeffcott()
    response = ad.base_shock(machine, 9.80665)
    heavy = ad.simulate(machine, 0.2, speed=0.0, linear=True, step=1e-3)
    k = response.watched.places.index("disk")
    moved = response.displacements(heavy.times)[:, k, 0] / response.peak
    within_absolute(moved, heavy.at(response.watched.positions[k])[:, 0] / response.peak, 1e-4, "disk")


def test_both_forms_say_the_same() -> None:
    machine = isotropic_machine()
    loops = [ad.system(machine, complex_form=form) for form in (True, False)]
    for answer in (
        lambda loop: ad.force_step(loop, 0.41, 20.0, 500.0, angle=0.7),
        lambda loop: ad.base_shock(loop, 5.0, 0.01, 500.0, angle=0.3),
    ):
        one, two = map(answer, loops)
        within(one.peaks, two.peaks, 1e-6, "peaks")
        within(one.settling_time, two.settling_time, 1e-5, "settling time")
        within(one.peak_current, two.peak_current, 1e-6, "peak current")
        assert one.watched.places == two.watched.places


def test_places_and_wrong_input() -> None:
    machine = levitated()
    assert "x = 0.33 m" in ad.force_step(machine, 0.33, 1.0).watched.places
    assert "right sensor" in ad.force_step(machine, "right sensor", 1.0).watched.places
    for at in ("disk 1", "disks[0]", "rotor.disks[0]", 0.2):
        assert ad.force_step(machine, at, 1.0).peak == ad.force_step(machine, "disk 1", 1.0).peak
    for arguments, words in (
        (("disk 3", 1.0), "at = 'disk 3' names no part of this machine; known are disk 1, disk 2, magnet 1"),
        ((0.7, 1.0), "at = 0.7 is not on the shaft (0 to 0.6 m)"),
        (("disk 1", 0.0), "force = 0 must be positive"),
    ):
        with pytest.raises(ad.SpecError) as error:
            ad.force_step(machine, *arguments)
        assert words in str(error.value)
    with pytest.raises(ad.ModelError, match="is not stable"):
        ad.force_step(levitated(controller=ad.PID(kp=1.0)), "disk 1", 1.0)
    with pytest.raises(ad.SpecError, match="settled = 5 must lie between 0 and 1"):
        ad.base_shock(machine, 1.0, settled=5.0)
