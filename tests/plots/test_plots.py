"""What is drawn is what was computed; labels keep apart; nothing is left open or changed behind the caller's back."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import combinations
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

mpl.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation

import amb_design as ad
from amb_design import plots
from amb_design.plots.base import RED, spread, unstable_windows
from amb_design.plots.campbell_diagram import drawn, pieces
from amb_design.plots.ply_stack import angle_colour
from amb_design.plots.stations import stations

NAMES = ("thesis-tuned", "friswell-5-9-1", "nelson-mcvaugh", "tum-rig", "zinberg-symonds")
RPM = np.pi / 30.0


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    yield
    plt.close("all")


@dataclasses.dataclass(frozen=True)
class Case:
    """A machine with coarse results, computed once."""

    machine: ad.Machine
    loop: ad.System
    campbell: ad.Campbell
    limit: ad.StabilityLimit


def coarse(name: str, elements: int, speeds: int) -> Case:
    machine = ad.load(name)
    shaft = dataclasses.replace(machine.rotor.shaft, elements=elements)
    machine = dataclasses.replace(machine, rotor=dataclasses.replace(machine.rotor, shaft=shaft))
    loop = ad.system(machine)
    diagram = ad.campbell(loop, np.linspace(0.0, machine.operation.top_speed, speeds), modes=8)
    return Case(machine, loop, diagram, ad.stability_limit(loop, first_only=name != "thesis-tuned"))


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    """All machines; only that of the thesis on its own mesh, whose numbers are asserted."""
    return {name: coarse(name, 12, 21) if name == "thesis-tuned" else coarse(name, 4, 4) for name in NAMES}


@pytest.fixture(scope="module")
def thesis(cases: dict[str, Case]) -> Case:
    return cases["thesis-tuned"]


@pytest.fixture(scope="module")
def response(thesis: Case) -> ad.UnbalanceResponse:
    return ad.unbalance_response(thesis.loop, np.linspace(50.0, thesis.machine.operation.top_speed, 40))


@pytest.fixture(scope="module")
def loops(thesis: Case) -> ad.Sensitivity:
    return ad.sensitivity(thesis.loop, 300.0)


def texts(ax: Axes) -> list[str]:
    return [t.get_text() for t in ax.texts]


def found(ax: Axes, gid: str) -> list[Any]:
    return [a for a in ax.get_children() if a.get_gid() == gid]


def legend(ax: Axes) -> list[str]:
    box = ax.get_legend()
    return [t.get_text() for t in box.get_texts()] if box else []


def assert_apart(ax: Axes) -> None:
    """No text of the axes covers another one."""
    ax.figure.canvas.draw()
    boxes = [(t.get_text(), t.get_window_extent()) for t in ax.texts if t.get_text()]
    for (one, a), (other, b) in combinations(boxes, 2):
        inside = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(inside) <= 1.5, f"{one!r} and {other!r} overlap by {inside} pixels"


# ------------------------------------------------------------------------------------------- all machines, all drawings


@pytest.mark.parametrize("name", NAMES)
def test_every_machine_can_be_drawn(name: str, cases: dict[str, Case]) -> None:
    case = cases[name]
    for ax in (
        plots.campbell(case.campbell, limit=case.limit),
        plots.damping_ratios(case.campbell, limit=case.limit),
        plots.real_part(case.campbell, limit=case.limit),
    ):
        assert_apart(ax)  # draws


@pytest.mark.parametrize("name", NAMES)
def test_labels_of_the_machine_keep_apart(name: str, cases: dict[str, Case]) -> None:
    ax = plots.machine(cases[name].machine)
    assert_apart(ax)
    shown = ", ".join(t.get_text() for t in ax.texts)
    assert all(label in shown for label, _ in stations(cases[name].machine))


# ------------------------------------------------------------------------------------------------------------- Campbell


def test_campbell_draws_every_mode_in_range(thesis: Case) -> None:
    ax = plots.campbell(thesis.campbell)
    end = ax.get_ylim()[1] * 2.0 * np.pi
    modes = drawn(thesis.campbell, end)
    assert modes
    for j in modes:
        (line,) = found(ax, f"mode {j}")
        points = np.concatenate(line.get_segments())
        on_grid = np.interp(thesis.campbell.speeds / RPM, points[:, 0], points[:, 1])
        whirling = thesis.campbell.frequencies[:, j] > 1.0
        expected = thesis.campbell.frequencies[:, j] / (2.0 * np.pi)
        np.testing.assert_allclose(on_grid[whirling], expected[whirling], rtol=1e-9)


def test_campbell_marks_critical_speeds_on_the_synchronous_line(thesis: Case) -> None:
    ax = plots.campbell(thesis.campbell)
    assert len(thesis.campbell.critical) >= 6
    for whirl in ("forward", "backward"):
        marks = found(ax, f"critical {whirl}")
        expected = [c.speed for c in thesis.campbell.critical if c.whirl == whirl]
        assert [m.get_xdata()[0] for m in marks] == pytest.approx([s / RPM for s in expected])
        assert [m.get_ydata()[0] for m in marks] == pytest.approx([s / (2.0 * np.pi) for s in expected])
        assert {m.get_markerfacecolor() == "white" for m in marks} == {whirl == "backward"}
    assert {f"{c.speed_rpm:.0f}" for c in thesis.campbell.critical} <= set(texts(ax))
    assert_apart(ax)


def test_crowded_critical_speeds_are_labelled_nearby_or_not_at_all(thesis: Case) -> None:
    first = thesis.campbell.critical[0]
    crowd = [dataclasses.replace(first, speed=first.speed * (1.0 + 0.01 * k), whirl="forward") for k in range(12)]
    ax = plots.campbell(dataclasses.replace(thesis.campbell, critical=tuple(crowd)))
    labels = [
        a for a in ax.texts if isinstance(a, Annotation) and a.get_text() in {f"{c.speed_rpm:.0f}" for c in crowd}
    ]
    assert 3 <= len(labels) < len(crowd)
    assert max(abs(a.xyann[1]) for a in labels) <= 25.0
    assert min(a.xyann[0] for a in labels) >= 6.0
    assert len(found(ax, "critical forward")) == len(crowd)


def test_campbell_marks_the_stability_limit(thesis: Case) -> None:
    ax = plots.campbell(thesis.campbell, limit=thesis.limit)
    assert "SLS 9382 rpm" in texts(ax)
    assert any(np.allclose(line.get_xdata(), thesis.limit.speed_rpm) for line in ax.lines)
    assert_apart(ax)


def test_campbell_turns_red_at_the_limit(thesis: Case) -> None:
    """The grid is coarse: the change of colour is interpolated."""
    ax = plots.campbell(thesis.campbell)
    red = [
        path
        for j in range(len(thesis.campbell.whirl))
        for line in found(ax, f"mode {j}")
        for path, colour in zip(line.get_segments(), line.get_colors(), strict=True)
        if to_hex(colour) == RED
    ]
    assert thesis.limit.onsets[0].speed == thesis.limit.speed
    assert sorted(path[0, 0] for path in red) == pytest.approx([o.speed / RPM for o in thesis.limit.onsets], rel=0.003)
    assert all(path[-1, 0] == pytest.approx(thesis.campbell.speeds[-1] / RPM) for path in red)


def test_campbell_names_unstable_modes_above_the_range(thesis: Case) -> None:
    high = np.full((len(thesis.campbell.speeds), 2), 10.0 + 2j * np.pi * 3005.0)
    changed = dataclasses.replace(
        thesis.campbell,
        eigenvalues=np.hstack([thesis.campbell.eigenvalues, high]),
        whirl=(*thesis.campbell.whirl, "forward", "backward"),
        kind=(*thesis.campbell.kind, "rotor", "rotor"),
    )
    ax = plots.campbell(changed)
    assert "2 unstable modes above the range: 3005 Hz" in texts(ax)
    assert ax.get_ylim()[1] < 400.0
    assert not any("above" in t for t in texts(plots.campbell(changed, highest=2.0 * np.pi * 4000.0)))
    assert not any("above" in t for t in texts(plots.campbell(thesis.campbell)))


def test_undamped_machine_has_no_colours(cases: dict[str, Case]) -> None:
    ax = plots.campbell(cases["friswell-5-9-1"].campbell)
    assert len(ax.figure.axes) == 1  # no colour bar
    colours = {to_hex(c) for line in ax.collections for c in line.get_colors()}
    assert len(colours) == 1
    assert RED not in colours


def test_colour_changes_between_grid_points() -> None:
    x, y = np.array([0.0, 10.0]), np.array([100.0, 120.0])
    paths, classes = pieces(x, y, np.array([0.002, -0.002]))
    assert classes == [2, 1, 0]
    assert paths[0][0].tolist() == [0.0, 100.0]
    assert paths[-1].tolist() == [[5.0, 110.0], [10.0, 120.0]]
    assert pieces(x, np.array([0.0, 120.0]), np.array([1.0, 0.5])) == ([], [])  # a real pole whirls nowhere


# -------------------------------------------------------------------------------------------------------------- damping


def test_damping_ratios_of_chosen_modes(thesis: Case) -> None:
    ax = plots.damping_ratios(thesis.campbell, [1, 3])
    curves = found(ax, "curve")
    assert len(curves) == 2
    for line, j in zip(curves, [1, 3], strict=True):
        np.testing.assert_allclose(line.get_ydata(), 100.0 * thesis.campbell.damping_ratios[:, j])
    assert len(found(ax, "unstable side")) == 1
    assert ax.get_ylim()[0] < 0.0 < ax.get_ylim()[1]


def test_damping_ratios_show_every_unstable_mode(thesis: Case) -> None:
    zeta = 100.0 * thesis.campbell.damping_ratios.min()
    assert zeta < -0.1
    curves = found(plots.damping_ratios(thesis.campbell), "curve")
    assert min(np.nanmin(line.get_ydata()) for line in curves) == pytest.approx(zeta)


def test_real_part_and_its_onsets(thesis: Case) -> None:
    ax = plots.real_part(thesis.campbell, limit=thesis.limit)
    (curve,) = found(ax, "curve")
    np.testing.assert_allclose(curve.get_ydata(), thesis.campbell.largest_real_part)
    np.testing.assert_allclose(curve.get_xdata(), thesis.campbell.speeds / RPM)
    assert [m.get_xdata()[0] for m in found(ax, "onset")] == pytest.approx([o.speed / RPM for o in thesis.limit.onsets])
    assert "SLS 9382 rpm" in texts(ax)


def test_restabilisation_is_marked_hollow(thesis: Case) -> None:
    first = thesis.limit.onsets[0]
    back = dataclasses.replace(first, speed=1200.0, unstable=False, count=0)
    limit = dataclasses.replace(thesis.limit, onsets=(first, back))
    (mark,) = found(plots.real_part(thesis.campbell, limit=limit), "restabilisation")
    assert mark.get_markerfacecolor() == "white"
    assert mark.get_xdata()[0] == pytest.approx(1200.0 / RPM)
    assert unstable_windows(limit) == [(first.speed, 1200.0)]
    again = dataclasses.replace(limit, onsets=(first, back, dataclasses.replace(first, speed=1500.0)))
    assert unstable_windows(again) == [(first.speed, 1200.0), (1500.0, limit.top_speed)]
    at_rest = dataclasses.replace(limit, status="unstable at rest", speed=0.0, onsets=(back,))
    assert unstable_windows(at_rest) == [(0.0, 1200.0)]


def test_machines_are_compared_in_one_drawing(thesis: Case, cases: dict[str, Case]) -> None:
    ax = plots.real_part(thesis.campbell, limit=thesis.limit, label="thesis")
    worse = dataclasses.replace(thesis.campbell, largest_real_part=thesis.campbell.largest_real_part + 5000.0)
    assert plots.real_part(worse, label="worse", ax=ax) is ax
    assert legend(ax) == ["thesis", "becomes unstable", "worse"]
    colours = {line.get_color() for line in found(ax, "curve")}
    assert len(colours) == 2
    assert ax.get_yscale() == "symlog"
    assert ax.get_ylim()[1] > 5000.0
    assert len(found(ax, "unstable side")) == 1  # once, not twice
    assert plt.get_fignums() == [ax.figure.number]


# ----------------------------------------------------------------------------------------------------------------- modes


def test_mode_shapes(thesis: Case) -> None:
    modes = [m for m in ad.spectrum(thesis.loop, 300.0) if m.kind == "rotor" and 0.0 < m.damping_ratio < 0.5][:3]
    figure = plots.mode_shapes(modes, thesis.loop)
    assert isinstance(figure, Figure)
    assert len(figure.axes) == 3
    for ax, mode in zip(figure.axes, modes, strict=True):
        x, z, y = (np.asarray(d) for d in found(ax, "shaft")[0].get_data_3d())
        np.testing.assert_allclose(x, thesis.loop.node_positions)
        np.testing.assert_allclose(y, mode.shape[:, 0].real)
        np.testing.assert_allclose(z, -mode.shape[:, 1].real)
        assert ax.get_title().startswith(f"{mode.whirl}, {mode.frequency_hz:.4g} Hz")
        assert len(found(ax, "orbit")) == 11
    figure.canvas.draw()


def test_orbit_turns_as_the_mode_does(thesis: Case) -> None:
    """Seen from the positive x axis, forward whirl turns from y to z."""
    for whirl, sense in (("forward", 1.0), ("backward", -1.0)):
        mode = next(m for m in ad.spectrum(thesis.loop, 300.0) if m.whirl == whirl and m.kind == "rotor")
        orbit = found(plots.mode_shape(mode, thesis.machine), "orbit")[5]
        _, z, y = (np.asarray(d) for d in orbit.get_data_3d())
        z = -z
        assert np.sign(y[0] * z[3] - z[0] * y[3]) == sense


def test_mode_of_another_mesh_is_refused(thesis: Case, cases: dict[str, Case]) -> None:
    mode = ad.spectrum(thesis.loop, 0.0)[-1]
    with pytest.raises(ad.ModelError, match="nodes"):
        plots.mode_shape(mode, cases["friswell-5-9-1"].machine)
    assert plt.get_fignums() == []  # a failed drawing leaves no figure


# --------------------------------------------------------------------------------------------------------------- machine


def test_machine_is_to_scale(thesis: Case) -> None:
    ax = plots.machine(thesis.machine)
    assert ax.get_aspect() == 1.0
    assert "enlarged" not in ax.get_xlabel()
    spans = sorted((p.get_x(), p.get_x() + p.get_width(), p.get_y()) for p in found(ax, "disk"))
    assert len(spans) == 6  # three rings, above and below
    assert spans[1] == pytest.approx((0.175, 0.225, 0.05))  # 400 x 100 x 50 mm at 0.2 m
    assert len(found(ax, "magnet")) == 4
    assert len(found(ax, "spring")) == 2
    assert len(found(ax, "ply")) == 20
    assert len(found(ax.child_axes[0], "layer")) == 10
    first = found(ax.child_axes[0], "layer")[0]
    assert to_hex(first.get_facecolor()) == to_hex(angle_colour(np.pi / 2.0))
    assert {"90°", "+45°", "\N{MINUS SIGN}45°", "0°  (6)"} <= set(texts(ax.child_axes[0]))


def test_slender_machine_is_enlarged_and_says_so(cases: dict[str, Case]) -> None:
    ax = plots.machine(cases["zinberg-symonds"].machine)
    assert ax.get_aspect() == 3.0
    assert "radii enlarged 3 : 1" in ax.get_xlabel()
    assert "enlarged" not in plots.machine(cases["zinberg-symonds"].machine, radial_scale=1.0).get_xlabel()


def test_disk_known_by_inertia_is_a_hatched_steel_ring(cases: dict[str, Case]) -> None:
    machine = cases["nelson-mcvaugh"].machine
    (disk,) = machine.rotor.disks
    ring = found(plots.machine(machine), "disk")[0]
    assert ring.get_hatch()
    inner, outer = ring.get_y(), ring.get_y() + ring.get_height()
    mass = 7850.0 * np.pi * (outer**2 - inner**2) * ring.get_width()
    assert mass == pytest.approx(disk.mass)
    assert mass / 2.0 * (outer**2 + inner**2) == pytest.approx(disk.polar_inertia)


def test_sensors_and_pins_are_drawn(cases: dict[str, Case]) -> None:
    rig = cases["tum-rig"].machine
    ax = plots.machine(rig)
    assert sorted(s.get_xdata()[0] for s in found(ax, "sensor")) == pytest.approx([s.position for s in rig.sensors])
    pinned = dataclasses.replace(cases["friswell-5-9-1"].machine, pins=(ad.Pin(position=1.2),))
    (pin,) = found(plots.machine(pinned), "pin")
    assert pin.get_xy()[0].tolist() == pytest.approx([1.2, -0.025])


# -------------------------------------------------------------------------------------------------------------- response


def test_unbalance_at_stations(thesis: Case, response: ad.UnbalanceResponse) -> None:
    ax = plots.unbalance(response, critical=thesis.campbell.critical, limit=thesis.limit)
    assert set(legend(ax)) == {
        "left bearing, left magnet",
        "disk 1",
        "disk 2",
        "disk 3",
        "right bearing, right magnet",
    }
    node = int(np.argmin(np.abs(response.positions - 0.5)))
    (line,) = [c for c in found(ax, "curve") if c.get_label() == "disk 2"]
    np.testing.assert_allclose(line.get_ydata(), 1e6 * response.amplitudes[:, node], rtol=1e-9)
    assert ax.get_yscale() == "log"
    forward = [c for c in thesis.campbell.critical if c.whirl == "forward" and c.damping_ratio < 0.3]
    assert {f"{c.speed_rpm:.0f} rpm" for c in forward} <= set(texts(ax))
    assert "SLS 9382 rpm" in texts(ax)
    assert_apart(ax)


def test_unbalance_at_places_of_choice(response: ad.UnbalanceResponse) -> None:
    ax = plots.unbalance(response, ["disk 3", "left", 0.3])
    assert legend(ax) == ["disk 3", "left", "x = 0.3 m"]
    with pytest.raises(ad.ModelError, match=r"nothing called 'turbine'; known are disk 1"):
        plots.unbalance(response, ["turbine"])


def test_currents_against_the_bias(thesis: Case, response: ad.UnbalanceResponse) -> None:
    ax = plots.currents(response)
    assert legend(ax) == ["left magnet", "right magnet"]
    for k, line in enumerate(found(ax, "curve")):
        np.testing.assert_allclose(line.get_ydata(), response.peak_currents[:, k])
    (level,) = found(ax, "level")
    assert level.get_ydata()[0] == 0.75
    assert "bias current 0.75 A" in texts(ax)


# ----------------------------------------------------------------------------------------------------------------- loops


def test_sensitivity_zones_and_peaks(loops: ad.Sensitivity) -> None:
    ax = plots.sensitivity(loops)
    bands = {z: next(a for a in found(ax, f"zone {z}") if isinstance(a, Rectangle)) for z in "ABCD"}
    assert bands["B"].get_y() == pytest.approx(20.0 * np.log10(3.0))
    assert bands["D"].get_y() == pytest.approx(20.0 * np.log10(5.0))
    assert set("ABCD") <= set(texts(ax))
    assert sorted(m.get_ydata()[0] for m in found(ax, "peak")) == pytest.approx(
        sorted(20.0 * np.log10(p.value) for p in loops.peaks)
    )
    (first, _) = found(ax, "curve")
    np.testing.assert_allclose(first.get_ydata(), 20.0 * np.log10(np.abs(loops.sensitivity[:, 0])))
    np.testing.assert_allclose(first.get_xdata(), loops.frequencies / (2.0 * np.pi))
    assert legend(ax)[0].startswith("left magnet")
    linear = plots.sensitivity(loops, decibels=False)
    assert next(a for a in found(linear, "zone B") if isinstance(a, Rectangle)).get_y() == 3.0
    assert_apart(ax)


def test_loops_that_are_alike_share_a_curve(loops: ad.Sensitivity) -> None:
    twice = dataclasses.replace(
        loops,
        loops=("magnets[0] y", "magnets[0] z"),
        sensitivity=np.repeat(loops.sensitivity[:, :1], 2, axis=1),
        peaks=(loops.peaks[0], loops.peaks[0]),
    )
    ax = plots.sensitivity(twice)
    assert len(found(ax, "curve")) == 1
    assert legend(ax)[0].startswith("left magnet y, z: ")


def test_sensitivity_of_an_unstable_machine_says_so(thesis: Case, loops: ad.Sensitivity) -> None:
    assert not any("unstable" in t for t in texts(plots.sensitivity(loops)))
    fast = dataclasses.replace(loops, speed=1.01 * thesis.limit.speed, stable=False)
    assert any("unstable at 9476 rpm" in t for t in texts(plots.sensitivity(fast)))


def test_open_loop(loops: ad.Sensitivity) -> None:
    magnitude, phase = plots.open_loop(loops)
    np.testing.assert_allclose(
        found(magnitude, "curve")[0].get_ydata(), 20.0 * np.log10(np.abs(loops.open_loop[:, 0])), atol=1e-9
    )
    drawn_phase = found(phase, "curve")[0].get_ydata()
    drawn_phase = drawn_phase[np.isfinite(drawn_phase)]
    np.testing.assert_allclose(drawn_phase, np.degrees(np.angle(loops.open_loop[:, 0])))
    figure = Figure()
    axes = figure.subplots(2)
    assert plots.open_loop(loops, axes=axes) == tuple(axes)


def test_sensitivity_over_speed(thesis: Case) -> None:
    result = ad.SensitivityOverSpeed(
        speeds=np.array([0.0, 500.0, 1200.0]),
        loops=("magnets[0]", "magnets[1]"),
        peaks=np.array([[1.2, 1.3], [2.0, 3.5], [6.0, 2.0]]),
        frequencies=np.full((3, 2), 300.0),
        stable=False,
        machine=thesis.machine,
    )
    ax = plots.sensitivity_over_speed(result, limit=thesis.limit)
    np.testing.assert_allclose(found(ax, "curve")[1].get_ydata(), [1.3, 3.5, 2.0])
    assert legend(ax) == ["left magnet: up to 6.00, zone D", "right magnet: up to 3.50, zone B"]
    (veil,) = found(ax, "veil")
    assert veil.get_x() == pytest.approx(thesis.limit.speed_rpm)
    steep = dataclasses.replace(result, peaks=10.0 * result.peaks)
    assert plots.sensitivity_over_speed(steep).get_yscale() == "log"


# ----------------------------------------------------------------------------------------------------------- housekeeping


def test_given_axes_are_used_and_no_figure_is_opened(
    thesis: Case, response: ad.UnbalanceResponse, loops: ad.Sensitivity
) -> None:
    figure = Figure()
    axes = figure.subplots(2, 3).ravel()
    assert plots.campbell(thesis.campbell, ax=axes[0]) is axes[0]
    assert plots.damping_ratios(thesis.campbell, ax=axes[1]) is axes[1]
    assert plots.machine(thesis.machine, ax=axes[2]) is axes[2]
    assert plots.unbalance(response, ax=axes[3]) is axes[3]
    assert plots.currents(response, ax=axes[4]) is axes[4]
    assert plots.sensitivity(loops, ax=axes[5]) is axes[5]
    assert plt.get_fignums() == []


def test_settings_are_not_touched(thesis: Case) -> None:
    before = dict(mpl.rcParams)
    plots.campbell(thesis.campbell)
    with plots.style():
        assert mpl.rcParams["axes.grid"]
    assert dict(mpl.rcParams) == before


def test_import_opens_no_window_system() -> None:
    code = "import sys, amb_design.plots; assert 'matplotlib.pyplot' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_saved_drawings_are_reproducible(thesis: Case, tmp_path: Any) -> None:
    for name in ("a.svg", "b.svg"):
        plots.save(plots.machine(thesis.machine), tmp_path / name, close=True)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    figure = plots.machine(thesis.machine).figure
    plots.save(figure, tmp_path / "c.png")
    assert plt.get_fignums() == [figure.number]  # left open unless asked to close
    assert (tmp_path / "c.png").read_bytes()[:4] == b"\x89PNG"


def test_spread_keeps_places_apart() -> None:
    assert spread([1.0, 1.5, 9.0], 2.0, 0.0, 10.0) == [1.0, 3.0, 9.0]
    assert spread([9.0, 9.5], 2.0, 0.0, 10.0) == [8.0, 10.0]
    assert spread([-3.0], 2.0, 0.0, 10.0) == [0.0]


def test_a_drawing_leaves_the_window_system_as_it_finds_it(tmp_path) -> None:
    """One that makes pyplot interactive when it loads, as notebooks do, would otherwise show the first drawing only."""
    (tmp_path / "window.py").write_text(
        "import matplotlib\nfrom matplotlib.backends.backend_agg import *\nmatplotlib.interactive(True)\n"
    )
    program = (
        "import amb_design as ad, matplotlib as mpl; ad.plots.machine(ad.load('jeffcott')); print(mpl.is_interactive())"
    )
    environment = {
        **os.environ,
        "MPLBACKEND": "module://window",
        "PYTHONPATH": f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
    }
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout == "True\n"
