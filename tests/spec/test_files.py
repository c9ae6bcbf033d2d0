"""Reading and writing machine files: units, names, variants, round trips; and paths into what was read."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
import subprocess
import sys
from pathlib import Path

import casadi as ca
import pytest
from bad_files import GOOD

from amb_design.errors import SpecError
from amb_design.spec import files, paths
from amb_design.spec.bearing import Bearing
from amb_design.spec.fields import Spec, is_symbolic
from amb_design.spec.machine import Machine, Operation, Rotor
from amb_design.spec.material import Isotropic
from amb_design.spec.shaft import Segment, Shaft
from amb_design.units import parse_quantity, rpm

PROBLEMS = (
    "friswell-5-9-1",
    "jeffcott",
    "nelson-mcvaugh",
    "thesis",
    "thesis-tuned",
    "tum-rig",
    "zinberg-symonds",
)
MACHINES = [(name, None) for name in PROBLEMS] + [
    ("thesis", f"row{row}-{kind}") for row in (1, 2, 3, 4) for kind in ("passive", "controlled", "tuned")
]


@pytest.fixture
def thesis() -> Machine:
    return files.load("thesis")


def small_machine(**changes: object) -> Machine:
    """A machine made in Python."""
    steel = Isotropic(E=210e9, nu=0.3, density=7850)
    shaft = Shaft(segments=(Segment(length=1, outer_diameter=0.05, material=steel),))
    values = {
        "name": "small",
        "rotor": Rotor(shaft=shaft),
        "bearings": (Bearing(position=0, stiffness=1e6), Bearing(position=1, stiffness=1e6)),
        "operation": Operation(top_speed=1000),
        "source": {"title": "tests"},
    }
    return Machine(**{**values, **changes})


# --- round trips ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "variant"), MACHINES)
def test_round_trip(name, variant):
    machine = files.load(name, variant)
    again = files.loads(files.dumps(machine))
    assert again == machine
    assert again.source == machine.source  # equality leaves it out
    assert files.dumps(again) == files.dumps(machine)


def test_round_trip_through_a_file(tmp_path, thesis):
    files.save(thesis, tmp_path / "machine.toml")
    assert files.load(tmp_path) == files.load(tmp_path / "machine.toml") == files.load(str(tmp_path)) == thesis


def test_round_trip_of_a_machine_made_in_python():
    machine = small_machine()
    text = files.dumps(machine)
    assert files.loads(text) == machine
    assert text.count("7850") == 1


def test_equal_materials_and_layups_are_written_once():
    machine = files.load("nelson-mcvaugh")
    assert len(machine.rotor.shaft.segments) == 18
    assert files.dumps(machine).count("[materials.") == 1
    mixed = files.loads(GOOD.replace('material = "ply"', 'material = ["ply", "steel", "steel", "ply"]'))
    kinds = [type(ply.material).__name__ for ply in mixed.rotor.shaft.segments[0].plies]
    assert kinds == ["Orthotropic", "Isotropic", "Isotropic", "Orthotropic"]
    assert files.loads(files.dumps(mixed)) == mixed


def test_symbols_are_not_written(thesis):
    for path in ("controller.kd", "plies[3].angle", "rotor.shaft.segments[0].plies[0].material.E1"):
        with pytest.raises(SpecError, match="CasADi expression") as caught:
            files.dumps(paths.replace(thesis, {path: ca.SX.sym("x")}))
        assert caught.value.field.endswith(path.rsplit(".", 1)[1])
    with pytest.raises(SpecError, match="CasADi expression"):
        files.dumps(paths.replace(thesis, {"controller.kd": ca.MX.sym("x")}))


def test_a_machine_without_source_is_not_written(tmp_path):
    with pytest.raises(SpecError, match=r"source is missing.*machine\.source"):
        files.save(small_machine(source={}), tmp_path / "machine.toml")
    assert not list(tmp_path.iterdir())


def test_machines_can_be_copied_and_sent_to_other_processes(thesis):
    assert pickle.loads(pickle.dumps(thesis)) == copy.deepcopy(thesis) == thesis
    assert hash(thesis) == hash(files.load("thesis"))


# --- names, variants, folders --------------------------------------------------------------------------------------


def test_packaged_problems():
    assert set(PROBLEMS) <= set(files.packaged())
    for name, folder in files.packaged().items():
        assert files.resolve(name) in (folder / files.FILE_NAME, folder / files.PROBLEM_FILE)
        assert files.load(name).name == name
        assert set(files.load(name).source) >= {"title", "author", "year"}


def test_an_existing_file_or_folder_comes_before_a_packaged_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert files.load("thesis").name == "thesis"
    Path("thesis").mkdir()
    assert files.load("thesis").name == "thesis"  # a folder without machine.toml does not hide it
    Path("thesis/machine.toml").write_text(GOOD)
    assert files.load("thesis").name == "good"
    Path("jeffcott").write_text(GOOD)
    assert files.load("jeffcott").name == "good"


def test_a_byte_order_mark_and_windows_line_ends_do_no_harm(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert files.load(path) == files.loads(GOOD)


def test_variants_of_the_thesis(thesis):
    variants = files.load_variants("thesis")
    assert list(variants) == [variant for name, variant in MACHINES if variant]
    for name, machine in variants.items():
        row, kind = name.split("-")
        assert machine.name == f"thesis: {name}"
        assert machine == files.load("thesis", name)
        assert len(machine.rotor.shaft.segments[0].plies) == 10
        assert (machine.controller is None) == (not machine.magnets) == (kind == "passive")
        assert len(machine.bearings) == 2
        if kind != "passive":
            assert machine.controller.kd == {"controlled": 0.99, "tuned": 0.03}[kind]
            assert machine.controller.amplifier == thesis.controller.amplifier
        same_layup = machine.rotor.shaft == thesis.rotor.shaft
        assert same_layup == (row == "row4")
    assert paths.replace(variants["row4-controlled"], {"name": "thesis"}) == thesis


def test_a_file_without_variants_is_its_own_variant():
    assert files.load_variants("jeffcott") == {"jeffcott": files.load("jeffcott")}


def test_a_variant_merges_tables_replaces_values_and_removes():
    changes = """
[variants.other]
rotor.shaft.elements = 20
layups.tube.angles = [0, 0]
bearings = [{ position = 0, stiffness = 3 }]
controller.low_pass = false
controller.notches = false
source.note = "changed"
"""
    base, other = files.loads(GOOD), files.loads(GOOD + changes, "other")
    assert other.rotor.shaft.elements == 20
    assert other.rotor.shaft.shear_correction == base.rotor.shaft.shear_correction == 0.5
    assert [ply.thickness for ply in other.rotor.shaft.segments[0].plies] == [0.002, 0.002]
    assert [b.stiffness for b in other.bearings] == [3]
    assert (other.controller.kp, other.controller.low_pass, other.controller.notches) == (10000, None, ())
    assert other.source == {**base.source, "note": "changed"}


# --- units ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.381 mm", "m", 0.381e-3),
        ("15000 rpm", "rad/s", 500 * math.pi),
        ("200 Hz", "rad/s", 400 * math.pi),
        ("40 kHz", "rad/s", 8e4 * math.pi),
        ("5 rad/s", "rad/s", 5),
        ("45 deg", "rad", math.pi / 4),
        ("-90 °", "rad", -math.pi / 2),
        ("0.1572 V/mil", "V/m", 0.1572 / 25.4e-6),
        ("1 mil", "m", 25.4e-6),
        ("2 mils", "m", 50.8e-6),
        ("1 1/s", "1/s", 1),
        ("139 GPa", "Pa", 139e9),
        ("1 lbf/in", "N/m", 4.4482216152605 / 0.0254),
        ("9 g mm", "kg m", 9e-6),
        ("3 kg m^2", "kg m^2", 3),
        ("3 kg*m**2", "kg m^2", 3),
        ("2 g cm²", "kg m^2", 2e-7),
        ("500 N s/m", "N s/m", 500),
        ("2 N/(mm/s)", "N s/m", 2000),
        ("1.578 g/cm^3", "kg/m^3", 1578),
        ("75 µs", "s", 75e-6),
        ("0.6 T", "T", 0.6),
        ("5 mH", "H", 5e-3),
        ("300 mohm", "ohm", 0.3),
        ("2 nm/sqrt(Hz)", "m/sqrt(Hz)", 2e-9),
        ("2 nm/√Hz", "m/sqrt(Hz)", 2e-9),
        ("2e-9 m / sqrt(kHz)", "m/sqrt(Hz)", 2e-9 / math.sqrt(1000)),
        ("1 mil/(sqrt(Hz))", "m/sqrt(Hz)", 25.4e-6),
        ("30 %", "", 0.3),
        ("  1e-3  ", "m", 1e-3),
        ("7", "", 7),
    ],
)
def test_quantities(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-12)


def test_units_in_a_file(thesis):
    assert thesis.operation.top_speed == pytest.approx(rpm(15000))
    assert thesis.controller.sensor_gain == pytest.approx(6189, rel=1e-4)
    assert thesis.controller.notches[0].frequency == pytest.approx(200 * 2 * math.pi)
    assert thesis.controller.amplifier.bandwidth == pytest.approx(40e3 * 2 * math.pi)
    assert thesis.magnets[0].gap == pytest.approx(0.381e-3)
    assert thesis.magnets[0].half_angle == pytest.approx(math.radians(22.5))
    assert [ply.angle for ply in thesis.rotor.shaft.segments[0].plies[:3]] == pytest.approx(
        [math.pi / 2, math.pi / 4, -math.pi / 4]
    )


def test_every_unit_of_the_specification_is_understood():
    """The remedy of each error is "a string such as '1 <unit>'": that has to work for every field."""
    modules = [m for name, m in sys.modules.items() if name.startswith("amb_design.spec.")]
    classes = [c for m in modules for c in vars(m).values() if isinstance(c, type) and issubclass(c, Spec)]
    units = {f.metadata.get("unit") for c in classes for f in dataclasses.fields(c)}
    units -= {None, ""}
    assert {"m", "rad/s", "kg m^2", "V/m", "N s/m^2"} <= units
    for unit in units:
        assert parse_quantity(f"1 {unit}", unit) == 1.0


def test_plain_numbers_need_no_unit_library():
    code = (
        "import sys; from amb_design.spec import files; m = files.loads(sys.stdin.read());"
        "assert 'pint' not in sys.modules and 'tomli_w' not in sys.modules;"
        "files.loads(files.dumps(m)); assert 'pint' not in sys.modules"
    )
    text = files.dumps(files.load("thesis"))
    subprocess.run([sys.executable, "-c", code], input=text, text=True, check=True, timeout=60)


# --- numbers of the problems ---------------------------------------------------------------------------------------


def test_thesis_numbers(thesis):
    assert thesis.rotor.shaft.segments[0].outer == pytest.approx(0.1)
    assert thesis.rotor.disks[0].inertias == pytest.approx((0.498, 0.976), rel=1e-3)
    assert [d.unbalance for d in thesis.rotor.disks] == pytest.approx([45.947 * 0.2e-3] * 3)
    magnet = thesis.magnets[0]
    ki = 4e-7 * math.pi * magnet.turns**2 * magnet.pole_area * magnet.bias_current / magnet.gap**2
    ki *= math.cos(magnet.half_angle)
    assert ki == pytest.approx(62.4, rel=1e-3)
    assert ki * magnet.bias_current / magnet.gap == pytest.approx(1.23e5, rel=2e-3)


def test_jeffcott_numbers():
    machine = files.load("jeffcott")
    shaft = machine.rotor.shaft
    segment = shaft.segments[0]
    stiffness = 48 * segment.material.E * math.pi / 64 * segment.outer_diameter**4 / segment.length**3
    assert stiffness == pytest.approx(4e6, rel=1e-12)
    assert shaft.viscous_damping * stiffness == pytest.approx(20)
    assert machine.bearings[0].damping == 30
    shaft_mass = segment.material.density * math.pi / 4 * segment.outer_diameter**2 * segment.length
    assert machine.rotor.disks[0].mass + 17 / 35 * shaft_mass == pytest.approx(10, rel=1e-6)


def test_zinberg_symonds_numbers():
    segment = files.load("zinberg-symonds").rotor.shaft.segments[0]
    assert (segment.inner_diameter + segment.outer) / 2 == pytest.approx(0.1269)
    assert (segment.outer - segment.inner_diameter) / 2 == pytest.approx(1.321e-3)


def test_nelson_mcvaugh_and_tum_stations():
    assert files.load("nelson-mcvaugh").rotor.shaft.length == pytest.approx(0.3556)
    rig = files.load("tum-rig")
    assert rig.rotor.shaft.length == pytest.approx(0.702)
    assert [rig.sensor_position(m) for m in rig.magnets] == [m.position for m in rig.magnets] == [0.113, 0.623]
    shaft_mass = sum(
        s.material.density * math.pi / 4 * s.outer_diameter**2 * s.length for s in rig.rotor.shaft.segments
    )
    assert shaft_mass + sum(d.mass for d in rig.rotor.disks) == pytest.approx(3.274, abs=2e-3)


# --- symbols and paths ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["thesis", "tum-rig", "friswell-5-9-1"])
@pytest.mark.parametrize("symbol", [ca.SX.sym, ca.MX.sym], ids=["SX", "MX"])
def test_every_number_may_be_a_symbol(name, symbol):
    machine = files.load(name)
    for path, _ in paths.numbers(machine):
        x = symbol("x")
        (found,) = (value for p, value in paths.numbers(paths.replace(machine, {path: x})) if p == path)
        assert found is x
        assert is_symbolic(found)
    everything = paths.replace(machine, {path: symbol("x") for path, _ in paths.numbers(machine)})
    assert all(is_symbolic(value) for _, value in paths.numbers(everything))


def test_symbols_must_be_scalars(thesis):
    with pytest.raises(SpecError, match=r"controller\.kd .*must be a scalar"):
        paths.replace(thesis, {"controller.kd": ca.SX.sym("x", 2)})


def test_short_paths(thesis):
    assert paths.find(thesis, "controller.kd") == ("controller.kd",)
    assert paths.find(thesis, "kd") == ("controller.kd",)
    assert paths.find(thesis, "magnets.bias_current") == ("magnets[0].bias_current", "magnets[1].bias_current")
    assert paths.find(thesis, "magnets[1].bias_current") == ("magnets[1].bias_current",)
    assert paths.find(thesis, "plies[3].angle") == ("rotor.shaft.segments[0].plies[3].angle",)
    assert len(paths.find(thesis, "plies.angle")) == 10
    assert paths.find(thesis, "rotor.disks[2].position") == ("rotor.disks[2].position",)


@pytest.mark.parametrize(
    ("path", "fragments"),
    [
        ("controller.kq", ("controller.kq", "names no number", "controller.k")),
        ("position", ("position", "different numbers", "bearings.position", "rotor.disks.position")),
        ("magnets[7].gap", ("magnets[7].gap", "names no number")),
        ("rotor.disks[two].mass", ("rotor.disks[two].mass", "is no path")),
        ("", ("is no path",)),
    ],
)
def test_wrong_paths(thesis, path, fragments):
    with pytest.raises(SpecError) as caught:
        paths.find(thesis, path)
    for fragment in fragments:
        assert fragment in str(caught.value)


def test_replace(thesis):
    changed = paths.replace(
        thesis, {"kd": 0.03, "bearings.damping": 100.0, "rotor.disks[1].position": 0.6, "plies[9].angle": 0.0}
    )
    assert changed.controller.kd == 0.03
    assert [b.damping for b in changed.bearings] == [100.0, 100.0]
    assert [d.position for d in changed.rotor.disks] == [0.2, 0.6, 1.0]
    assert changed.rotor.shaft.segments[0].plies[9].angle == 0.0
    assert thesis.controller.kd == 0.99  # the original is untouched
    passive = paths.replace(thesis, {"controller": None, "magnets": (), "name": "thesis: row4-passive"})
    assert passive == files.load("thesis", "row4-passive")


def test_replace_checks_the_new_machine(thesis):
    with pytest.raises(SpecError, match=r"rotor\.disks\[2\]\.position = 1\.31 m lies beyond the shaft \(1\.2 m\)"):
        paths.replace(thesis, {"rotor.disks[2].position": 1.31})
    with pytest.raises(SpecError, match=r"^magnets.*gap = 0 m must be positive"):
        paths.replace(thesis, {"magnets.gap": 0.0})
