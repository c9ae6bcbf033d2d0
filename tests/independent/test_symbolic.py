"""The model in symbols equals the model in numbers: one code path, whatever kind of number it is given."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.gradient import movable
from amb_design.analysis.system import dense
from amb_design.model.loop import close, structure
from amb_design.model.mesh import plan
from amb_design.model.pair import Pair
from amb_design.spec.paths import value
from amb_design.spec.shaft import PLY_LAWS, THEORIES
from independent.everything import anisotropic_machine, isotropic_machine

MATRICES = ("E", "A0", "A1", "M", "C0", "C1", "K0", "K1")
MACHINES = {"isotropic": isotropic_machine, "anisotropic": anisotropic_machine}


def assert_equal(symbolic: np.ndarray, numeric: np.ndarray, what: str) -> float:
    """To 1e-12 of each entry; entries that are nothing but rounding of larger ones may differ by that rounding."""
    assert symbolic.shape == numeric.shape
    difference = np.abs(symbolic - numeric)
    assert np.all(difference <= 1e-12 * np.abs(numeric) + 4e-16 * np.abs(numeric).max()), what
    return float((difference / np.maximum(np.abs(numeric), 1e-12 * np.abs(numeric).max() + 1e-300)).max())


def numeric_matrices(machine: ad.Machine) -> dict[str, np.ndarray]:
    loop = ad.system(machine)
    pencil, plant = loop.pencil, loop.plant
    return {n: dense(getattr(pencil if n in ("E", "A0", "A1") else plant, n)) for n in MATRICES}


@pytest.mark.parametrize("law", PLY_LAWS)
@pytest.mark.parametrize("kind", MACHINES)
def test_closed_loop_functions(kind: str, law: str) -> None:
    """All numbers of the machine free at once."""
    machine = ad.replace(MACHINES[kind](), {"rotor.shaft.ply_law": law})
    free = movable(machine, plan(machine))
    assert len(free) > 100
    loop = ad.closed_loop(machine, free, complex_form=kind == "isotropic")
    assert loop.np == len(free)
    expected = numeric_matrices(machine)
    worst = 0.0
    for name in MATRICES:
        function = loop.function(name)
        assert function.name_in() == ["p"]
        re, im = function(loop.nominal)
        worst = max(worst, assert_equal(re.full() + 1j * im.full(), expected[name], f"{kind}, {law}, {name}"))
    print(f"{kind}, {law}: symbolic and numeric entries agree to {worst:.1e}")


@pytest.mark.parametrize("theory", THEORIES)
def test_theories(theory: str) -> None:
    machine = ad.replace(isotropic_machine(), {"rotor.shaft.theory": theory})
    loop = ad.closed_loop(machine, ["plies[1].angle", "rotor.shaft.viscous_damping", "rotor.disks[0].position"])
    for name, expected in numeric_matrices(machine).items():
        re, im = loop.function(name)(loop.nominal)
        assert_equal(re.full() + 1j * im.full(), expected, f"{theory}, {name}")


def test_functions_follow_their_parameters() -> None:
    """Evaluated elsewhere than at the nominal values they are the model of the changed machine."""
    tied = {"plies.angle": 0.4, "bearings.damping": 300.0, "magnets.gap": 5e-4}
    machine = ad.replace(isotropic_machine(), tied)
    free = ("controller.kd", "plies.angle", "magnets[0].position", "bearings.damping", "magnets.gap")
    loop = ad.closed_loop(machine, free)
    values = (2e-3, 0.5, 0.11, 333.0, 6e-4)
    assert len(loop.nominal) == len(values)
    changed = ad.replace(machine, dict(zip(free, values, strict=True)))
    for name, expected in numeric_matrices(changed).items():
        re, im = loop.function(name)(values)
        assert_equal(re.full() + 1j * im.full(), expected, name)


def test_numbers_of_different_values_are_not_tied_silently() -> None:
    machine = ad.replace(isotropic_machine(), {"plies[0].angle": 0.1, "plies[1].angle": 0.2})
    with pytest.raises(ad.ModelError, match=r"plies.angle stands for numbers of different values"):
        ad.closed_loop(machine, ["plies.angle"])


SYMBOLS = [
    "rotor.shaft.segments[0].plies[1].angle",
    "rotor.shaft.segments[0].plies[0].thickness",
    "rotor.shaft.segments[0].plies[2].material.E1",
    "rotor.shaft.segments[1].outer_diameter",
    "rotor.shaft.segments[2].length",
    "rotor.shaft.shear_correction",
    "rotor.shaft.viscous_damping",
    "rotor.disks[1].width",
    "rotor.disks[0].position",
    "bearings[1].stiffness",
    "magnets[0].bias_current",
    "magnets[0].axes_angle",
    "sensors[0].position",
    "controller.low_pass.frequency",
    "controller.notches[0].width",
    "controller.delay",
    "controller.kd",
]


@pytest.mark.parametrize("kind", MACHINES)
@pytest.mark.parametrize("symbol", [ca.SX, ca.MX], ids=["SX", "MX"])
def test_symbols_in_the_specification(symbol: Any, kind: str) -> None:
    """Any number field of a specification object may hold a CasADi symbol."""
    machine = MACHINES[kind]()
    names = [n for n in SYMBOLS if kind == "isotropic" or n != "magnets[0].axes_angle"]
    symbols = [symbol.sym(n.replace(".", "_").replace("[", "").replace("]", "")) for n in names]
    nominal = [float(value(machine, n)) for n in names]
    holder = ad.replace(machine, dict(zip(names, symbols, strict=True)))
    plant = structure(holder, plan(machine), complex_form=kind == "isotropic")
    pencil = close(plant)
    for name, expected in numeric_matrices(machine).items():
        pair: Pair = getattr(pencil if name in ("E", "A0", "A1") else plant, name)
        function = ca.Function(name, symbols, [symbol(pair.re), symbol(pair.im)])
        re, im = function(*nominal)
        assert_equal(re.full() + 1j * im.full(), expected, f"{symbol.__name__}, {name}")


def test_section_of_a_symbolic_laminate() -> None:
    """Laminate algebra by itself: all laws, SX against numbers at random angles."""
    from amb_design.model.laminate import section_constants

    segment = isotropic_machine().rotor.shaft.segments[0]
    angles = [ca.SX.sym(f"angle{k}") for k in range(len(segment.plies))]
    symbolic = ad.replace(segment, {f"plies[{k}].angle": a for k, a in enumerate(angles)})
    rng = np.random.default_rng(1)
    for law in PLY_LAWS:
        fields = ("shear", "coupling", "bending", "mass", "inertia")
        section = section_constants(symbolic, law)
        function = ca.Function("section", angles, [ca.SX(getattr(section, f)) for f in fields])
        for _ in range(5):
            values = rng.uniform(-np.pi / 2, np.pi / 2, len(angles))
            numbers = ad.replace(segment, {f"plies[{k}].angle": float(v) for k, v in enumerate(values)})
            expected = section_constants(numbers, law)
            for got, f in zip(function(*values), fields, strict=True):
                number = float(getattr(expected, f))
                assert float(got) == pytest.approx(number, rel=1e-12, abs=1e-12 * float(expected.shear) * 0.1)
