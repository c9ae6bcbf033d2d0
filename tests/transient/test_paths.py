"""Many ways to one result: tolerances, restarts, interruptions, closed form, sampled and continuous controllers, files."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.transient.equations import WORKS
from checks import within, within_absolute
from transient.rotors import levitated, passive, pid


def orbit(result: ad.Transient) -> Any:
    return np.hstack([result.at(x) for x in (0.05, 0.3, 0.55)])


WHIRL: dict[str, Any] = {"speed": 400.0, "modes": 8, "start": "levitated"}


def test_errors_fall_with_the_tolerance_of_idas() -> None:
    run = WHIRL | {"step": 1e-3, "integrator": "idas"}
    exact = orbit(ad.simulate(levitated(), 0.05, **(WHIRL | {"step": 1e-4, "tolerance": 1e-9})))[::10]
    errors = [
        np.abs(orbit(ad.simulate(levitated(), 0.05, tolerance=t, **run)) - exact).max() for t in (1e-5, 1e-7, 1e-9)
    ]
    print("errors [m]", errors)
    assert errors[1] < errors[0] / 10.0
    assert errors[2] < errors[1] / 10.0
    assert errors[0] < 0.02 * np.abs(exact).max()


def test_collocation_is_of_fourth_order() -> None:
    """Without a tolerance the output steps are the steps; a wide orbit, so that the force law bends."""
    machine = levitated(unbalance=3e-4)
    steps = (2e-4, 1e-4, 5e-5)
    orbits = [
        orbit(ad.simulate(machine, 0.02, tolerance=1e9, **(WHIRL | {"step": h})))[:: round(2e-4 / h)]
        for h in (*steps, 1.25e-5)
    ]
    size = np.abs(orbits[-1]).max()
    assert size > 5e-5
    errors = [np.abs(o - orbits[-1]).max() / size for o in orbits[:-1]]
    orders = [math.log2(a / b) for a, b in pairwise(errors)]
    print("errors over the orbit", errors, "orders", orders)
    assert min(orders) > 3.5
    assert errors[-1] < 1e-5


def test_collocation_agrees_with_idas_where_everything_happens_at_once() -> None:
    """Saturation, contact with friction, an accelerated spin, steps of force: motion, works and what was met."""
    machine = levitated(unbalance=4e-5, link_voltage=60.0, max_flux_density=0.6)
    run: dict[str, Any] = {
        "speed": ([0.0, 0.02, 1.0], [200.0, 300.0, 600.0]),
        "modes": 6,
        "start": "resting",
        "contact": True,
        "disturbances": [ad.Force(position=0.3, y=150.0, z=-250.0, start=0.01, stop=0.02)],
        "step": 2e-4,
    }
    a = ad.simulate(machine, 0.03, **run)
    b = ad.simulate(machine, 0.03, integrator="idas", tolerance=1e-8, **run)
    assert {s.kind for s in a.saturations} == {"current", "voltage", "flux", "contact", "clearance"}
    within_absolute(orbit(a), orbit(b), 1e-8, "places [m]")
    gross = sum(np.ptp(w) for w in b.works.values())
    for name in WORKS:
        within_absolute(a.works[name] / gross, b.works[name] / gross, 1e-5, f"work of {name}")
    shares = [{(s.kind, s.magnet): s.share for s in r.saturations} for r in (a, b)]
    assert shares[0].keys() == shares[1].keys()
    for key, share in shares[0].items():
        within_absolute(share, shares[1][key], 0.01, f"share of the time at {key}")


def test_limits_that_are_met_between_outputs_are_seen() -> None:
    blow = [ad.Impulse(position=0.05, y=-0.3, time=0.0012)]
    run: dict[str, Any] = {"speed": 0.0, "modes": 6, "start": "levitated", "disturbances": blow}
    for integrator in ("collocation", "idas"):
        fine, coarse = (
            ad.simulate(levitated(link_voltage=60.0), 0.02, step=h, integrator=integrator, **run) for h in (1e-5, 5e-3)
        )
        found = [{s.kind: s for s in r.saturations if s.magnet == 0} for r in (fine, coarse)]
        assert found[0].keys() == found[1].keys() == {"current", "voltage"}
        for kind, met in found[0].items():
            assert met.share < 0.2
            within_absolute(found[1][kind].share, met.share, 2e-3, f"share of the time, {kind}")
            assert found[1][kind].first <= met.first < found[1][kind].first + 5e-3


@pytest.mark.parametrize("machine", [passive(anisotropic=True), levitated()], ids=["passive", "magnets"])
def test_closed_form_equals_the_integrator(machine: ad.Machine) -> None:
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
    exact = orbit(ad.simulate(levitated(), 0.02, **run))
    errors = [
        np.abs(orbit(ad.simulate(machine, 0.02, sampling=ad.Sampling(period=p), **run)) - exact).max()
        / np.abs(exact).max()
        for p in (1e-4, 5e-5, 2.5e-5)
    ]
    print("relative errors", errors)
    assert errors[2] < 0.6 * errors[1] < 0.36 * errors[0]
    quick = ad.Sampling(period=5e-6, delay=2.75e-5)  # holding takes another half period on average
    late = ad.simulate(machine, 0.02, sampling=quick, **run)
    smooth = orbit(ad.simulate(machine, 0.02, **run))
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
