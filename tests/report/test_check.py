"""What `amb-design check` says of a machine holds by other means."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.outline import outline
from amb_design.words import machine as words
from checks import within


@pytest.fixture(scope="module")
def spindle():
    return ad.load("composite-spindle", "levitated")


@pytest.fixture(scope="module")
def told(spindle):
    return outline(spindle)


def test_chain_of_a_pid_by_hand(spindle, told):
    """Gain and phase of each block from its own formula."""
    c = spindle.controller
    s = 2j * math.pi * told["rotor_modes"][0]["frequency_hz"]
    f, n, a = c.low_pass, c.notches[0], c.amplifier
    by_hand = {
        "low-pass": f.frequency**2 / (s**2 + 2 * f.damping * f.frequency * s + f.frequency**2),
        "PID": c.kp + c.ki / s + c.kd * s,
        "notch": (s**2 + 2 * n.damping * n.frequency * s + n.frequency**2)
        / (s**2 + 2 * n.width * n.frequency * s + n.frequency**2),
        "delay": cmath.exp(-s * c.delay),
        "amplifier": a.gain * a.bandwidth**2 / (s**2 + 2 * a.damping * a.bandwidth * s + a.bandwidth**2),
    }
    chain = told["loops"][0]["chain"]
    assert [b["block"] for b in chain] == list(by_hand)
    within([b["gain"] for b in chain], np.abs(list(by_hand.values())), 1e-9, "gains")
    within([b["phase_deg"] for b in chain], np.degrees(np.angle(list(by_hand.values()))), 1e-4, "phases")
    assert sum(b["phase_deg"] for b in chain) == pytest.approx(told["loops"][0]["at_modes"][0]["phase_deg"])


def test_stiffness_of_a_loop_is_that_of_its_proportional_gain(spindle, told):
    loop = told["loops"][0]
    magnet = told["magnets"][0]
    within(loop["stiffness_n_per_m"], magnet["current_stiffness_n_per_a"] * spindle.controller.kp, 1e-3, "k_i kp")
    assert loop["net_stiffness_n_per_m"] == pytest.approx(
        loop["stiffness_n_per_m"] - magnet["negative_stiffness_n_per_m"]
    )
    assert loop["integral_action"]
    without = outline(ad.replace(spindle, {"controller.ki": 0.0}))
    assert not without["loops"][0]["integral_action"]
    assert any("No loop has integral action" in text for text in without["unusual"])


def test_modes_of_the_free_rotor_are_those_of_its_variant(told):
    free = [m for m in ad.spectrum(ad.load("composite-spindle", "free-free")) if m.frequency > 1.0]
    hz = [m.frequency_hz for m in free if m.whirl == "forward"][:3]
    within([m["frequency_hz"] for m in told["rotor_modes"]], hz, 1e-3, "bending frequencies")


@pytest.mark.parametrize("sideways", [2e7, 1.5e7], ids=["isotropic", "anisotropic"])
def test_damping_of_weak_loops_is_that_of_the_closed_loop(spindle, sideways):
    """Gains and bias so small that the first order is all there is: the eigenvalues move by what was told."""
    bearings = tuple(ad.Bearing(position=x, kyy=2e7, kzz=sideways, damping=100.0) for x in (0.1, 0.8))
    weak = ad.replace(
        spindle,
        {
            "bearings": bearings,
            "controller.total_gain": 1e-3,
            "controller.ki": 0.0,
            "magnets.bias_current": 0.1 * spindle.magnets[0].bias_current,
        },
    )
    silent = ad.replace(weak, {"controller.total_gain": 0.0})
    told = outline(weak)
    assert told["form"] == ("complex" if sideways == 2e7 else "real")
    for mode in told["rotor_modes"]:
        w = 2.0 * math.pi * mode["frequency_hz"]
        ours, bare = (
            min((m for m in ad.spectrum(x) if m.kind == "rotor"), key=lambda m: abs(m.frequency - w))
            for x in (weak, silent)
        )
        within(mode["own_damping_ratio"], bare.damping_ratio, 0.01, f"own damping of {mode['frequency_hz']:.4g} Hz")
        gained = -(ours.eigenvalue.real - bare.eigenvalue.real) / w
        within(mode["damping_ratio_from_loops"], gained, 0.02, f"damping of {mode['frequency_hz']:.4g} Hz by loops")


def test_shares_of_the_weight_balance_the_rotor(spindle, told):
    loads = [m["load_n"] for m in told["magnets"]]
    within(sum(loads), told["mass_kg"] * spindle.operation.gravity, 1e-9, "weight")
    masses = [(d["mass_kg"], d["position_m"]) for d in told["disks"]] + [(told["shaft_mass_kg"], 0.45)]
    left, right = (m["position_m"] for m in told["magnets"])
    moment = sum(m * (x - left) for m, x in masses) * spindle.operation.gravity
    within(loads[1], moment / (right - left), 1e-6, "lever arm")


@pytest.mark.parametrize(
    ("changes", "words_found"),
    [
        ({"rotor.shaft.segments[0].material.E": 211.0}, "is the unit right? Steel has 2.1e11 Pa"),
        ({"rotor.shaft.segments[0].material.density": 7.81}, "is the unit right? Steel has 7850 kg/m^3"),
        ({"rotor.disks.unbalance": 0.03}, "balancing grade G"),
        ({"rotor.shaft.viscous_damping": 0.0}, "no internal damping"),
        ({"controller.kp": 100.0}, "softer than the magnet's negative stiffness. The rotor will not levitate"),
        ({"controller": None}, "no controller: they only push outward"),
        ({"controller.kd": -50.0}, "take damping from the mode"),
        ({"magnets.bias_current": 0.3}, "they cannot lift the rotor"),
        ({"magnets.max_flux_density": 0.5}, "of its limit"),
        ({"magnets.clearance": 4.5e-4}, "of air gap"),
    ],
)
def test_what_is_unusual_is_said(changes, words_found):
    machine = ad.loads(STEEL)
    assert outline(machine)["unusual"] == []
    found = outline(ad.replace(machine, changes))["unusual"]
    assert any(words_found in text for text in found), found


STEEL = """
format = "amb_design/1"
name = "levitated steel rotor"
source = { title = "a test" }
operation = { top_speed = "12000 rpm" }
materials.steel = { E = "211 GPa", nu = 0.3, density = 7810 }
rotor.shaft = { viscous_damping = 2e-5, elements = 6, segments = [{ length = 0.6, outer_diameter = "40 mm", material = "steel" }] }
rotor.disks = [{ position = 0.3, mass = 5, diametral_inertia = 0.02, polar_inertia = 0.03, unbalance = "5 g mm" }]
magnets = [
    { position = 0.05, turns = 150, pole_area = "4 cm^2", gap = "0.5 mm", bias_current = 3, clearance = "0.25 mm", max_flux_density = 1.5 },
    { position = 0.55, turns = 150, pole_area = "4 cm^2", gap = "0.5 mm", bias_current = 3, clearance = "0.25 mm", max_flux_density = 1.5 },
]
controller = { kp = 12000, ki = 10000, kd = 15, amplifier = { bandwidth = "2 kHz" }, low_pass = { frequency = "5 kHz" } }
"""


def test_ideal_feedback_and_regulators_are_told_too():
    regulator = outline(ad.load("composite-spindle-pid-vs-lqg", "lqg"))
    assert regulator["controller"] == "lqg"
    assert {b["block"] for b in regulator["loops"][0]["chain"]} >= {"law", "amplifier"}
    ideal = ad.replace(ad.loads(STEEL), {"controller": ad.LQR(current=1.0)})
    told = outline(ideal)
    assert told["loops"] == []
    assert any("reference that nobody can build" in text for text in told["unusual"])


def test_tables_and_sentences_hold_the_figures(told):
    text = " ".join(words.sentences(told))
    for part in ("20.03 kg", "six disks 17.1 kg", "Free, it bends at 275.7, 706.7 and 1025 Hz", "1.89 times as stiff"):
        assert part in text
    titles = [t.title for t in words.tables(told)]
    assert titles[0] == "Shaft"
    assert "Passive bearings" not in titles
    modes = next(t for t in words.tables(told) if "First modes" in t.title)
    assert modes.rows[0][:4] == ("275.7", "0.46 %", "+7.1 %", "magnets[0], magnets[1]")
