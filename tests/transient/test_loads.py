"""Base motion, forces, run-ups, and sentences for what cannot be simulated."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.transient.collocation import Collocation
from checks import within, within_absolute
from transient.rotors import levitated, passive, shaft


def rigid(damping: float = 400.0) -> ad.Machine:
    """A stiff, light shaft that carries one mass in its middle between equal bearings."""
    material = ad.Isotropic(E=5e13, nu=0.3, density=1.0)
    segments = (ad.Segment(length=0.4, outer_diameter=0.05, material=material),)
    return ad.Machine(
        name="rigid",
        rotor=ad.Rotor(
            shaft=ad.Shaft(segments=segments, elements=2),
            disks=(ad.Disk(position=0.2, mass=10.0, diametral_inertia=0.02, polar_inertia=0.02),),
        ),
        bearings=tuple(ad.Bearing(position=x, stiffness=2e5, damping=damping / 2.0) for x in (0.0, 0.4)),
        operation=ad.Operation(top_speed=500.0),
    )


@pytest.mark.parametrize("linear", [True, False])
def test_a_shaken_rigid_rotor_is_a_mass_on_a_spring(linear: bool) -> None:
    mass, k, c, w, a = 10.0 + np.pi / 4 * 0.05**2 * 0.4, 4e5, 400.0, 120.0, 3.0
    result = ad.simulate(
        rigid(),
        1.0,
        speed=0.0,
        modes=4,
        gravity=False,
        linear=linear,
        disturbances=[ad.Shaking(y=a, z=-a / 2, frequency=w)],
        step=1e-3,
    )
    response = -mass * a / (k - mass * w**2 + 1j * w * c)
    late = result.times > 0.6
    expected = (response * np.exp(1j * w * result.times[late])).real
    within_absolute(result.at(0.2)[late, 0] / abs(response), expected / abs(response), 1e-4, "motion in y")
    within_absolute(result.at(0.2)[late, 1] / abs(response), -expected / 2.0 / abs(response), 1e-4, "motion in z")
    transmitted = abs((k + 1j * w * c) / (k - mass * w**2 + 1j * w * c))  # absolute motion over that of the base
    absolute = abs(response - a / w**2) / (a / w**2)
    within(absolute, transmitted, 1e-9, "transmissibility")


def test_a_table_of_base_accelerations() -> None:
    """Half a sine as a table against its exact response (undamped oscillator, Duhamel's integral)."""
    mass, k = 10.0 + np.pi / 4 * 0.05**2 * 0.4, 4e5
    t = np.linspace(0.0, 0.05, 201)
    pulse = ad.BaseMotion(times=t, y=5.0 * np.sin(np.pi * t / 0.05))
    result = ad.simulate(
        rigid(1e-6), 0.05, speed=0.0, modes=4, linear=True, gravity=False, disturbances=[pulse], step=1e-3
    )
    w0, w = math.sqrt(k / mass), np.pi / 0.05
    expected = -5.0 / (w0**2 - w**2) * (np.sin(w * result.times) - w / w0 * np.sin(w0 * result.times))
    within_absolute(result.at(0.2)[:, 0] / np.abs(expected).max(), expected / np.abs(expected).max(), 1e-3, "motion")


def test_run_up_through_a_critical_speed() -> None:
    """The quicker, the lower and the later the peak."""
    machine = ad.replace(passive(), {"bearings.damping": 300.0})
    steady = ad.unbalance_response(machine, np.linspace(250.0, 450.0, 401))
    radius = np.abs(steady.at(0.2)).max(axis=1)
    peak, critical = radius.max(), steady.speeds[np.argmax(radius)]
    found = []
    for duration in (1.0, 4.0):
        result = ad.simulate(
            machine, duration, speed=([0.0, duration], [0.0, 700.0]), modes=6, gravity=False, step=1e-3, linear=True
        )
        envelope = result.envelope(0.2)
        k = np.argmax(envelope.radii)
        found.append((envelope.radii[k] / peak, envelope.speeds[k] / critical))
        within_absolute(result.energy_error, np.zeros(len(result.times)), 1e-4, "energy over gross work")
    print("peak over steady one, speed over critical one", found)
    assert found[0][0] < found[1][0] < 1.0
    assert found[0][1] > found[1][1] > 1.0


def test_the_angle_and_the_speed_follow_the_profile() -> None:
    times, speeds = [0.0, 0.1, 0.3, 0.4], [100.0, 300.0, 300.0, 0.0]
    result = ad.simulate(passive(), 0.4, speed=(times, speeds), modes=4, step=1e-3)
    within_absolute(result.speeds, np.interp(result.times, times, speeds), 1e-9, "speed")
    within(result.angles[-1], 20.0 + 60.0 + 15.0, 1e-12, "angle")


def run(**changed: Any) -> ad.Transient:
    options: dict[str, Any] = {"machine": levitated(), "duration": 0.01, "speed": 100.0, "modes": 4}
    return ad.simulate(**(options | changed))


@pytest.mark.parametrize(
    ("changed", "error", "words"),
    [
        ({"duration": -1.0}, ad.SpecError, "duration = -1 must be positive"),
        ({"duration": math.inf}, ad.SpecError, "duration = inf must be positive and finite"),
        ({"step": 0.0}, ad.SpecError, "step = 0 must be positive"),
        ({"tolerance": -1e-6}, ad.SpecError, "tolerance"),
        ({"speed": math.nan}, ad.SpecError, "speed = nan must be finite"),
        (
            {"speed": ([0.0, 0.005], [0.0, 10.0])},
            ad.SpecError,
            "covers 0 to 0.005 s, but the run lasts from 0 to 0.01 s",
        ),
        ({"speed": ([0.0, 0.0, 1.0], [0.0, 1.0, 2.0])}, ad.SpecError, "each later than the one before"),
        ({"speed": ([0.0, 1.0], [0.0, 1.0, 2.0])}, ad.SpecError, "one finite speed for each time"),
        ({"speed": "fast"}, ad.SpecError, "neither a number nor a pair"),
        ({"start": "flying"}, ad.ModelError, "no start 'flying'"),
        ({"start": "resting"}, ad.ModelError, "contact and gravity"),
        ({"modes": 0}, ad.ModelError, "modes = 0 is not between 1 and"),
        ({"contact": True, "linear": True}, ad.SpecError, "does not go with contact"),
        ({"contact": True, "machine": passive()}, ad.SpecError, "magnets with a clearance"),
        ({"contact": True, "machine": levitated(clearance=None)}, ad.SpecError, r"magnets\[0\].clearance is missing"),
        ({"disturbances": [ad.Force(position=7.0, y=1.0)]}, ad.ModelError, "x = 7 m is not on the shaft"),
    ],
)
def test_what_is_impossible_is_said_in_a_sentence(changed: dict[str, Any], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=words):
        run(**changed)


def test_loads_check_themselves() -> None:
    with pytest.raises(ad.SpecError, match="not after the start"):
        ad.Force(position=0.1, start=1.0, stop=0.5)
    with pytest.raises(ad.SpecError, match="2 entries for 3 times"):
        ad.BaseMotion(times=[0.0, 1.0, 2.0], y=[0.0, 1.0])
    with pytest.raises(ad.SpecError, match="each later than the one before"):
        ad.BaseMotion(times=[0.0, 1.0, 0.5], y=[0.0, 1.0, 1.0])


def test_a_state_belongs_to_its_machine() -> None:
    state = run().final
    finer = ad.replace(levitated(), {"rotor.shaft": shaft(elements=12)})
    with pytest.raises(ad.ModelError, match="displacements"):
        run(machine=finer, start=state)
    other = ad.replace(levitated(), {"controller": dataclasses.replace(levitated().controller, ki=0.0)})
    with pytest.raises(ad.ModelError, match="other controllers"):
        run(machine=other, start=state)


def test_a_failure_of_the_integrator_keeps_what_was_finished(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = run(duration=0.03, step=1e-3, chunk=10)
    march = Collocation.run

    def fail(self: Collocation, x: Any, held: Any, piece: Any, start: float, *rest: Any) -> Any:
        if start > 0.015:
            raise RuntimeError("too much work")
        return march(self, x, held, piece, start, *rest)

    monkeypatch.setattr(Collocation, "run", fail)
    with pytest.raises(ad.SolveError, match=r"gave up after 0\.02 s") as failure:
        run(duration=0.03, step=1e-3, chunk=10)
    kept = failure.value.result  # type: ignore[attr-defined]
    assert np.array_equal(kept.times, whole.times[:21])
    assert np.array_equal(kept.coordinates, whole.coordinates[:21])
    assert kept.final.time == 0.02


def test_too_heavy_a_rotor_cannot_levitate() -> None:
    heavy = ad.replace(levitated(), {"rotor.disks.mass": 80.0})
    with pytest.raises(ad.SolveError, match="do not carry the weight"):
        run(machine=heavy, start="levitated")
