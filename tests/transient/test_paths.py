"""Many ways to one result: tolerances, restarts, interruptions, closed form, sampled and continuous controllers, files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from checks import within, within_absolute
from transient.rotors import levitated, passive, pid


def orbit(result: ad.Transient) -> Any:
    return np.hstack([result.at(x) for x in (0.05, 0.3, 0.55)])


def test_errors_fall_with_the_tolerance() -> None:
    run = {"speed": 400.0, "modes": 8, "start": "levitated", "step": 1e-3}
    exact = orbit(ad.simulate(levitated(), 0.05, tolerance=1e-11, **run))
    errors = [
        np.abs(orbit(ad.simulate(levitated(), 0.05, tolerance=t, **run)) - exact).max() for t in (1e-5, 1e-7, 1e-9)
    ]
    print("errors [m]", errors)
    assert errors[1] < errors[0] / 10.0
    assert errors[2] < errors[1] / 10.0
    assert errors[0] < 0.02 * np.abs(exact).max()


@pytest.mark.parametrize("machine", [passive(anisotropic=True), levitated()], ids=["passive", "magnets"])
def test_closed_form_equals_cvodes(machine: ad.Machine) -> None:
    """A profile of speeds that happen to be almost equal goes through the integrator."""
    forces = [
        ad.Force(position=0.3, y=30.0, start=0.0123, stop=0.0217),
        ad.Force(position=0.1, z=5.0, frequency=700.0, start=0.005),
        ad.Impulse(position=0.5, y=0.02, z=-0.01, time=0.02),
        ad.Shaking(z=3.0, frequency=500.0, phase=1.0),
        ad.BaseMotion(times=[0.01, 0.0151, 0.02], y=[0.0, 10.0, 0.0], z=[0.0, 0.0, 5.0]),
    ]
    run = {"modes": 6, "linear": True, "disturbances": forces, "step": 5e-4, "tolerance": 1e-9}
    exact = ad.simulate(machine, 0.04, speed=500.0, **run)
    found = ad.simulate(machine, 0.04, speed=([0.0, 1.0], [500.0, 500.0 + 1e-9]), **run)
    size = np.abs(orbit(exact)).max()
    within_absolute(orbit(found) / size, orbit(exact) / size, 1e-6, "displacements over their peak")
    fine = ad.simulate(machine, 0.04, speed=500.0, **(run | {"step": 2e-5}))
    within_absolute(orbit(fine)[::25] / size, orbit(exact) / size, 1e-9, "with other steps")
    gross = sum(np.ptp(w) for w in found.works.values())
    for name, work in fine.works.items():
        within_absolute(work[::25] / gross, found.works[name] / gross, 1e-5, f"work of {name}")


@pytest.mark.parametrize("sampled", [False, True])
def test_a_restart_goes_on_as_if_nothing_had_happened(sampled: bool) -> None:
    blow = [ad.Impulse(position=0.3, y=0.05, time=0.02)]
    options: dict[str, Any] = {
        "speed": ([0.0, 1.0], [300.0, 600.0]),
        "modes": 6,
        "disturbances": blow,
        "tolerance": 1e-9,
    }
    if sampled:
        options |= {"sampling": ad.Sampling(period=1e-4, delay=1.3e-4), "speed": 400.0, "linear": True}
    whole = ad.simulate(levitated(), 0.04, **(options | {"step": 1e-3}))
    first = ad.simulate(levitated(), 0.02, **(options | {"step": 1e-3}))
    second = ad.simulate(levitated(), 0.02, start=first.final, **(options | {"step": 1e-3}))
    assert second.times[0] == first.times[-1] == 0.02
    size = np.abs(orbit(whole)).max()
    joined = np.vstack([orbit(first), orbit(second)[1:]])
    within_absolute(joined / size, orbit(whole) / size, 1e-6, "displacements over their peak")
    within(np.concatenate([first.angles, second.angles[1:]])[1:], whole.angles[1:], 1e-12, "angles")


def test_an_interrupted_run_is_resumed(tmp_path: Path) -> None:
    class InterruptionError(Exception):
        pass

    def interrupt(done: float) -> None:
        if done > 0.5:
            raise InterruptionError

    run: dict[str, Any] = {"speed": 400.0, "modes": 6, "step": 1e-3, "chunk": 10, "start": "levitated"}
    seen: list[float] = []
    whole = ad.simulate(levitated(), 0.05, progress=seen.append, **run)
    assert seen[-1] == 1.0
    assert len(seen) == 5
    with pytest.raises(InterruptionError):
        ad.simulate(levitated(), 0.05, path=tmp_path, progress=interrupt, **run)
    assert len(list(tmp_path.glob("chunk-*.npz"))) == 3
    seen.clear()
    resumed = ad.simulate(levitated(), 0.05, path=tmp_path, resume=True, progress=seen.append, **run)
    assert len(seen) == 2
    for name in ("times", "coordinates", "rates", "currents", "magnet_forces", "kinetic"):
        a, b = getattr(resumed, name), getattr(whole, name)
        within_absolute(a / np.abs(b).max(), b / np.abs(b).max(), 1e-9, name)
    within_absolute(resumed.works["magnets"], whole.works["magnets"], 1e-12, "work")
    again = ad.simulate(levitated(), 0.05, path=tmp_path, resume=True, **run)
    assert np.array_equal(again.coordinates, resumed.coordinates)
    with pytest.raises(ad.ModelError, match="already holds chunks"):
        ad.simulate(levitated(), 0.05, path=tmp_path, **run)
    with pytest.raises(ad.ModelError, match="another run"):
        ad.simulate(levitated(), 0.05, path=tmp_path, resume=True, **(run | {"speed": 401.0}))


def test_a_quickly_sampled_controller_approaches_the_continuous_one() -> None:
    machine = levitated(controller=pid(delay=3e-5))
    run: dict[str, Any] = {"speed": 400.0, "modes": 6, "step": 1e-3, "linear": True}
    exact = orbit(ad.simulate(levitated(), 0.05, **run))
    errors = [
        np.abs(orbit(ad.simulate(machine, 0.05, sampling=ad.Sampling(period=p), **run)) - exact).max()
        / np.abs(exact).max()
        for p in (1e-4, 5e-5, 2.5e-5)
    ]
    print("relative errors", errors)
    assert errors[2] < 0.6 * errors[1] < 0.36 * errors[0]
    quick = ad.Sampling(period=5e-6, delay=2.75e-5)  # holding takes another half period on average
    late = ad.simulate(machine, 0.05, sampling=quick, **run)
    smooth = orbit(ad.simulate(machine, 0.05, **run))
    within_absolute(orbit(late) / np.abs(smooth).max(), smooth / np.abs(smooth).max(), 1e-5, "delay against Pade")


def test_a_sampled_controller_is_the_same_with_linear_and_nonlinear_magnets_for_small_motion() -> None:
    run: dict[str, Any] = {"speed": 400.0, "modes": 6, "step": 1e-3, "gravity": False, "tolerance": 1e-10}
    run["sampling"] = ad.Sampling(period=5e-5, delay=7e-5)
    machine = ad.replace(levitated(unbalance=1e-6), {"rotor.shaft.viscous_damping": 1e-4})
    exact, found = (orbit(ad.simulate(machine, 0.02, linear=k, **run)) for k in (True, False))
    within_absolute(found / np.abs(exact).max(), exact / np.abs(exact).max(), 1e-5, "displacements over their peak")


def test_a_slowly_sampled_controller_loses_the_rotor() -> None:
    run: dict[str, Any] = {"speed": 100.0, "modes": 6, "start": "levitated", "tolerance": 1e-5}
    for period, lost in ((1e-4, False), (2e-3, True)):
        result = ad.simulate(levitated(), 0.04, sampling=ad.Sampling(period=period), **run)
        assert ("clearance" in {s.kind for s in result.saturations}) == lost


def test_results_survive_a_file(tmp_path: Path) -> None:
    result = ad.simulate(levitated(), 0.02, speed=400.0, modes=6, start="resting", contact=True)
    result.save(tmp_path / "run.npz")
    found = ad.load_transient(tmp_path / "run.npz")
    assert np.array_equal(found.at(0.3), result.at(0.3))
    assert found.saturations == result.saturations
    assert found.works.keys() == result.works.keys()
    assert found.machine == result.machine
    again, before = (ad.simulate(r.machine, 0.005, speed=400.0, modes=6, start=r.final) for r in (found, result))
    assert np.array_equal(again.coordinates, before.coordinates)
