"""Figures of a comparison show what was computed."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt

import amb_design as ad
from amb_design import plots
from amb_design.comparison.table import shown
from compare.loops import levitated, pid


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def table():
    machines = {"soft": levitated(), "stiff": levitated(controller=pid(kp=20000.0))}
    return ad.compare(machines, speed=300.0, top_speed=900.0, samples=0, tolerances={"magnets.negative_stiffness": 0.1})


def curves(ax):
    return [line for line in ax.lines if line.get_gid() == "curve"]


def test_campbell_diagrams_share_their_axes(table) -> None:
    speeds = np.linspace(0.0, 900.0, 7)
    diagrams = {n: ad.campbell(a.loop, speeds, critical=False) for n, a in table.designs.items()}
    axes = plots.campbells(diagrams, {n: a.limit for n, a in table.designs.items()})
    assert [ax.get_title() for ax in axes] == ["soft", "stiff"]
    assert axes[0].get_ylim() == axes[1].get_ylim()
    figure = axes[0].figure
    figure.canvas.draw()
    assert len(figure.legends) == 1
    assert len(figure.axes) == 3  # two diagrams and one colour bar
    for one, other in combinations(axes, 2):
        assert not one.get_window_extent().overlaps(other.get_window_extent())


def test_sensitivities(table) -> None:
    found = [{n: a.sensitivities[k] for n, a in table.designs.items()} for k in (0, -1)]
    axes = plots.sensitivities(found)
    for ax, each in zip(axes, found, strict=True):
        for line, s in zip(curves(ax), each.values(), strict=True):
            np.testing.assert_allclose(line.get_ydata(), 20.0 * np.log10(np.abs(s.sensitivity).max(axis=1)))
            assert f"{s.worst.value:.2f} at" in line.get_label()
    assert any("2865 rpm" in t.get_text() for t in axes[1].texts)


def test_whirl(table) -> None:
    upper, lower = plots.whirls_compared({n: a.whirl for n, a in table.designs.items()})
    for ax, key, scale in ((upper, "unbalance_radius", 1e6), (lower, "unbalance_current", 1.0)):
        for line, value in zip(curves(ax), table[key].values(), strict=True):
            assert np.nanmax(line.get_ydata()) == pytest.approx(scale * value)


def test_responses(table) -> None:
    found = {n: a.base_shocks[-1] for n, a in table.designs.items()}
    upper, lower = plots.responses(found)
    largest = max(found.values(), key=lambda r: r.peak)
    assert largest.peak_place in upper.get_ylabel()
    for line, r in zip(curves(upper), found.values(), strict=True):
        t = 1e-3 * line.get_xdata()
        k = r.watched.places.index(largest.peak_place)
        np.testing.assert_allclose(line.get_ydata(), 1e6 * r.displacements(t)[:, k, 0])
        assert shown(r.settling_time, "s") in line.get_label()
    assert len(curves(lower)) == 2
    assert "at 2865 rpm" in lower.get_xlabel()


def test_a_creeping_response_is_drawn_while_it_rings(table) -> None:
    """A slow integral settles after minutes; the drawing shows the whirl."""
    slow = ad.force_step(levitated(controller=pid(ki=50.0)), "disk 1", 10.0)
    assert slow.settling_time > 20.0 * slow.ringing_time
    upper, _ = plots.responses({"slow": slow})
    assert 1e3 * slow.ringing_time < upper.get_xlim()[1] < 1e3 * 0.25 * slow.settling_time


def test_corners(table) -> None:
    ax = plots.corners(table.designs)
    dots = [line for line in ax.lines if line.get_gid() == "corner"]
    drawn = [line.get_xdata() for line in dots]
    for values, a in zip(drawn, list(table.designs.values())[::-1], strict=True):
        np.testing.assert_allclose(np.sort(values), np.sort([c.stable_up_to * 30.0 / np.pi for c in a.corners]))
    assert [t.get_text() for t in ax.get_yticklabels()] == ["stiff", "soft"]


def test_the_dot_at_a_limit_has_the_colour_of_its_curve(table) -> None:
    speeds = np.linspace(0.0, 900.0, 7)
    diagrams = {n: ad.campbell(a.loop, speeds, critical=False) for n, a in table.designs.items()}
    ax = plots.real_parts(diagrams, {n: a.limit for n, a in table.designs.items()})
    dots = [line for line in ax.lines if line.get_marker() == "o"]
    found = {line.get_color() for line in curves(ax)}
    assert all(dot.get_color() in found for dot in dots)
