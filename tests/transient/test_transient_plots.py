"""What is drawn is what was simulated."""

from __future__ import annotations

import math
from collections.abc import Iterator

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

import amb_design as ad
from amb_design.plots.transient import LABELS
from transient.rotors import levitated, passive


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def lift() -> ad.Transient:
    return ad.simulate(levitated(), 0.03, speed=200.0, modes=6, start="resting", contact=True)


@pytest.fixture(scope="module")
def run_up() -> ad.Transient:
    return ad.simulate(passive(), 1.0, speed=([0.0, 1.0], [0.0, 600.0]), modes=6, step=1e-3, linear=True)


@pytest.mark.parametrize("quantity", LABELS)
def test_histories_show_the_values_over_time(lift: ad.Transient, quantity: str) -> None:
    ax = ad.plots.history(lift, quantity)
    assert ax.get_xlabel() == "time [ms]"
    assert "[" in ax.get_ylabel()
    line = ax.lines[0]
    assert np.allclose(line.get_xdata(), 1e3 * lift.times)
    expected = {
        "radius": 1e6 * lift.radius(0.05),
        "current": lift.currents[:, 0, 0],
        "speed": lift.speeds * 30.0 / math.pi,
    }
    if quantity in expected:
        assert np.allclose(line.get_ydata(), expected[quantity])
    ax.figure.canvas.draw()


def test_orbits_lie_inside_the_picture(lift: ad.Transient) -> None:
    ax = ad.plots.orbits(lift, ["disk 1", 0.3])
    ax.figure.canvas.draw()
    assert np.allclose(ax.lines[0].get_ydata(), 1e6 * lift.at(0.2)[:, 0])
    assert ax.get_ylim()[0] < -250.0 < 250.0 < ax.get_ylim()[1]
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["disk 1", "x = 0.3 m"]
    last = ad.plots.orbits(lift, turns=0.5)
    assert len(last.lines[0].get_xdata()) < len(lift.times)


def test_envelopes_and_waterfalls(run_up: ad.Transient) -> None:
    ax = ad.plots.envelope(run_up, ["disk 2"])
    found = run_up.envelope(0.45)
    assert np.allclose(ax.lines[0].get_ydata(), 1e6 * found.radii)
    steady = ad.unbalance_response(passive(), [100.0, 200.0, 300.0])
    ax = ad.plots.envelope(run_up, ["disk 2"], steady=steady)
    assert np.allclose(ax.lines[1].get_ydata(), 1e6 * np.abs(steady.at(0.45)).max(axis=1), rtol=1e-6)
    assert "linear and steady" in ax.lines[1].get_label()
    ax = ad.plots.waterfall(run_up, "disk 1", windows=12)
    ax.figure.canvas.draw()
    assert len(ax.lines) == 12 + 2  # the spectra, the spin frequency and zero
    with pytest.raises(ad.ModelError, match="too few for 500 windows"):
        ad.plots.waterfall(run_up, "disk 1", windows=500)


def test_unknown_names_are_refused(run_up: ad.Transient) -> None:
    with pytest.raises(ad.ModelError, match="no quantity 'colour'"):
        ad.plots.history(run_up, "colour")
    with pytest.raises(ad.ModelError, match="has no magnets, and so no current"):
        ad.plots.history(run_up, "current")
    with pytest.raises(ad.ModelError, match="nothing called 'wheel'"):
        ad.plots.history(run_up, "y", ["wheel"])
    assert not plt.get_fignums()
