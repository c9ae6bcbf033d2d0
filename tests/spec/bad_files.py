"""Wrong machine files: what is in them, and what the one sentence of refusal has to say.

Most are a valid machine with one edit. `write(case, folder)` puts a case on disk and returns what a user would type.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

GOOD = """\
format = "amb_design/1"
name = "good"

[source]
title = "a machine for tests"

[operation]
top_speed = "12000 rpm"

[materials.steel]
E = "210 GPa"
nu = 0.3
density = 7850

[materials.ply]
E1 = "139 GPa"
E2 = "11 GPa"
G12 = "6.05 GPa"
G13 = "6.05 GPa"
G23 = "3.78 GPa"
nu12 = 0.313
density = 1578

[layups.tube]
material = "ply"
angles = [0, "45 deg", "-45 deg", "90 deg"]
thickness = "2 mm"

[rotor.shaft]
shear_correction = 0.5
elements = 10

[[rotor.shaft.segments]]
length = 1.0
inner_diameter = "60 mm"
layup = "tube"

[[rotor.shaft.segments]]
length = 0.2
material = "steel"
outer_diameter = "70 mm"

[[rotor.disks]]
position = 0.3
mass = 20
diametral_inertia = 0.2
polar_inertia = 0.38

[[rotor.disks]]
position = 0.6
density = 7850
outer_diameter = "300 mm"
inner_diameter = "76 mm"
width = "60 mm"

[[bearings]]
position = 0.1
stiffness = 1e7

[[bearings]]
position = 1.1
stiffness = 1e7
damping = 200

[[magnets]]
position = 0.15
turns = 200
pole_area = 2.6e-4
half_angle = "22.5 deg"
gap = "0.4 mm"
bias_current = 2
max_current = 5
clearance = "0.2 mm"
sensor = "left"

[[magnets]]
position = 1.0
current_stiffness = 60
negative_stiffness = 1e5

[[sensors]]
name = "left"
position = 0.18

[controller]
kp = 10000
kd = 10

[controller.low_pass]
frequency = "2 kHz"

[[controller.notches]]
frequency = "200 Hz"

[variants.passive]
magnets = []
controller = false
"""


@dataclass(frozen=True)
class BadFile:
    """One wrong file.

    Attributes
    ----------
    id : short name of the case
    content : what the file holds, or a function that puts anything else into the folder and returns its path
    fragments : what the message must contain
    """

    id: str
    content: bytes | Callable[[Path], Path | str]
    fragments: tuple[str, ...]


def write(case: BadFile, folder: Path) -> str:
    """Put a case into a folder; returns the path (or name) to load."""
    if callable(case.content):
        return str(case.content(folder))
    path = folder / "machine.toml"
    path.write_bytes(case.content)
    return str(path)


def edited(*changes: tuple[str, str]) -> bytes:
    """The good file with some pieces of text exchanged."""
    text = GOOD
    for old, new in changes:
        assert text.count(old) >= 1, f"the good file does not contain {old!r}"
        text = text.replace(old, new, 1)
    return text.encode()


def edit(name: str, old: str, new: str, *fragments: str) -> BadFile:
    """A case with one exchange; the message has to name the file too."""
    return BadFile(name, edited((old, new)), ("machine.toml", *fragments))


def raw(name: str, content: bytes | str, *fragments: str) -> BadFile:
    """A case with a content of its own."""
    return BadFile(name, content.encode() if isinstance(content, str) else content, ("machine.toml", *fragments))


def _huge(folder: Path) -> Path:
    path = folder / "machine.toml"
    with path.open("wb") as file:
        file.truncate(50_000_000)  # sparse: takes no room
    return path


def _folder_only(folder: Path) -> Path:
    (folder / "other.toml").write_text(GOOD)
    return folder


def _folder_named_as_file(folder: Path) -> Path:
    (folder / "machine.toml").mkdir()
    return folder / "machine.toml"


def line(text: str) -> str:
    """Where a piece of the good file stands."""
    return f"line {GOOD[: GOOD.index(text)].count(chr(10)) + 1} "


HEAD = GOOD[: GOOD.index("[materials.steel]")]
DISK_2 = 'position = 0.6\ndensity = 7850\nouter_diameter = "300 mm"'

BAD_FILES: tuple[BadFile, ...] = (
    # no text at all, or not TOML
    raw("empty", "", "is empty", 'format = "amb_design/1"'),
    raw("blank", " \n\n\t\n", "is empty"),
    raw("only-comments", "# nothing\n", "format is missing", 'format = "amb_design/1"'),
    raw("binary", b"\x7fELF\x02\x01\x01\x00\x00\x00", "binary", "TOML text"),
    raw("utf-16", GOOD.encode("utf-16"), "binary", "UTF-8"),
    raw("latin-1", GOOD.replace("for tests", "für Tests").encode("latin-1"), "line 5", "UTF-8"),
    BadFile("huge", _huge, ("machine.toml", "50 MB", "a few kB")),
    raw("truncated", GOOD[: GOOD.index("12000") + 5], line("top_speed"), "is no TOML", "correct the line"),
    raw("truncated-header", GOOD + "[controller.amp", "is no TOML", f"line {GOOD.count(chr(10)) + 1}"),
    edit("duplicate-key", "mass = 20", "mass = 20\nmass = 21", line("diametral"), "is no TOML", "each key once"),
    edit("duplicate-table", "[materials.ply]", "[materials.steel]", line("[materials.ply]"), "is no TOML", "twice"),
    edit("bare-word", 'layup = "tube"', "layup = tube", line('layup = "tube"'), "is no TOML", "strings in quotes"),
    edit(
        "unit-without-quotes",
        'inner_diameter = "60 mm"',
        "inner_diameter = 60 mm",
        line('inner_diameter = "60'),
        "is no TOML",
    ),
    edit("thousands-of-digits", "mass = 20", f"mass = {'9' * 5000}", "is no TOML", "digits"),
    raw("deep-lists", HEAD + "x = " + "[" * 5000 + "]" * 5000, "nested too deeply"),
    raw("deep-tables", HEAD + f"[{'x.' * 900}x]\n{'y.' * 900}y = 1", ": "),  # one sentence or another
    raw("deeper-tables", HEAD + "x." * 400_000 + "y = 1", "nested too deeply"),
    raw("json", '{"format": "amb_design/1"}', "line 1", "is no TOML"),
    # the head
    edit("format-missing", 'format = "amb_design/1"\n', "", "format is missing", 'write format = "amb_design/1"'),
    edit("format-wrong", "amb_design/1", "amb_design/9", "format = 'amb_design/9'", 'write format = "amb_design/1"'),
    edit("format-number", '"amb_design/1"', "1", "format = 1", 'write format = "amb_design/1"'),
    edit("name-missing", 'name = "good"\n', "", "name is missing"),
    edit("name-empty", 'name = "good"', 'name = ""', "name = ''", "in quotes"),
    edit("source-missing", '[source]\ntitle = "a machine for tests"\n', "", "source is missing", "[source]"),
    edit("source-empty", 'title = "a machine for tests"\n', "", "source is missing", "[source]"),
    edit("source-number", '"a machine for tests"', "2014", "source.title = 2014", "quotes"),
    raw("source-no-table", 'format = "amb_design/1"\nsource = "me"', "source = 'me'", "must be a table"),
    edit("operation-missing", '[operation]\ntop_speed = "12000 rpm"\n', "", "operation is missing"),
    # keys
    edit("misspelt-key", "length = 0.2", "lenght = 0.2", "rotor.shaft.segments[1].lenght = 0.2", "`length`"),
    edit("misspelt-table", "[[bearings]]", "[[bearing]]", "bearing", "unknown key", "`bearings`"),
    edit("unknown-key", "kp = 10000", "kp = 10000\nzzz = 1", "controller.zzz = 1", "unknown key", "total_gain"),
    edit("misspelt-in-layup", "angles =", "angels =", "layups.tube.angels", "`angles`"),
    edit("misspelt-in-material", "nu12 =", "nu_12 =", "materials.ply.nu_12 = 0.313", "`nu12`"),
    edit("key-with-newline", "kp = 10000", 'kp = 10000\n"a\\nb" = 1', "controller.", "unknown key"),
    edit("missing-length", "length = 0.2\n", "", "rotor.shaft.segments[1].length is missing", "add it", "[m]"),
    edit("missing-in-list", 'name = "left"\n', "", "sensors[0].name is missing"),
    edit("missing-shaft", "[rotor.shaft]", "[shaft]", "shaft", "unknown key"),
    # kinds of values
    edit("text-for-number", "length = 0.2", 'length = "long"', "segments[1].length = 'long'", "'1 m'"),
    edit("unit-unknown", '"2 mm"', '"2 mmm"', "layups.tube.thickness = '2 mmm'", "unknown unit", "'1 m'"),
    edit("unit-wrong", '"2 mm"', '"2 kg"', "layups.tube.thickness = '2 kg'", "wrong unit", "'1 m'"),
    edit("unit-wrong-frequency", '"200 Hz"', '"200 m"', "controller.notches[0].frequency = '200 m'", "rad/s"),
    edit("unit-ambiguous", "12000 rpm", "12000 1/min", "operation.top_speed = '12000 1/min'", "rpm"),
    edit("unit-only", '"2 mm"', '"mm"', "layups.tube.thickness = 'mm'", "'1 m'"),
    edit("unit-bomb", '"2 mm"', '"2 9**9**9**9"', "layups.tube.thickness", "unknown unit"),
    edit("unit-nonsense", '"2 mm"', '"2 __import__(1)"', "layups.tube.thickness", "unknown unit"),
    edit("unit-for-pure-number", "nu = 0.3", 'nu = "0.3 m"', "materials.steel.nu = '0.3 m'", "plain number"),
    edit("bool-for-number", "mass = 20", "mass = true", "rotor.disks[0].mass = True", "number in kg"),
    edit("list-for-number", "mass = 20", "mass = [20]", "rotor.disks[0].mass = [20]", "number in kg"),
    edit("table-for-number", "mass = 20", "mass = {a = 1}", "rotor.disks[0].mass", "number in kg"),
    edit("date-for-number", "mass = 20", "mass = 2014-06-01", "rotor.disks[0].mass = 2014-06-01", "number in kg"),
    edit("nan", "mass = 20", "mass = nan", "rotor.disks[0].mass = nan", "finite"),
    edit("nan-with-unit", '"2 mm"', '"nan mm"', "layups.tube.thickness = nan", "finite"),
    edit("infinite", "stiffness = 1e7", "stiffness = inf", "bearings[0].stiffness = inf", "finite", "N/m"),
    edit("overflow", "stiffness = 1e7", "stiffness = 1e999", "bearings[0].stiffness = inf", "finite"),
    edit("huge-integer", "mass = 20", f"mass = 0x{'f' * 5000}", "rotor.disks[0].mass = inf", "finite"),
    edit("huge-elements", "elements = 10", f"elements = 0x{'f' * 5000}", "rotor.shaft.elements", "1 to 2000"),
    edit("number-for-name-of-layup", 'layup = "tube"', "layup = 4", "segments[0].layup = 4", "known are tube"),
    edit("number-for-name", 'name = "left"', "name = 1", "sensors[0].name = 1", "text"),
    edit("number-for-choice", "elements = 10", "theory = 3", "rotor.shaft.theory = 3", "timoshenko"),
    edit("table-for-list", "[[sensors]]", "[sensors]", "sensors", "list of tables", "[[sensors]]"),
    edit("list-for-table", "[rotor.shaft]", "[[rotor.shaft]]", "rotor.shaft", "must be a table"),
    raw("number-for-rotor", HEAD.replace("[source]", "rotor = 3\n[source]"), "rotor = 3", "must be a table"),
    raw("list-of-numbers", HEAD.replace("[source]", "bearings = [3]\n[source]"), "bearings[0] = 3", "must be a table"),
    raw("materials-list", HEAD.replace("[source]", "materials = [3]\n[source]"), "materials = [3]", "must be a table"),
    raw("material-number", HEAD + "[materials]\nsteel = 210e9\n", "materials.steel = 2.1e+11", "must be a table"),
    raw(
        "variant-number",
        HEAD.replace("[source]", "variants = { a = 3 }\n[source]"),
        "variants.a = 3",
        "must be a table",
    ),
    raw("variants-list", HEAD.replace("[source]", "variants = [3]\n[source]"), "variants = [3]", "must be a table"),
    # materials and layups
    edit("nu12", "nu12 = 0.313", "nu12 = 4", "materials.ply.nu12 = 4", "E1/E2", "check E1 and E2"),
    edit("nu", "nu = 0.3", "nu = 0.7", "materials.steel.nu = 0.7", "(-1, 0.5)"),
    edit("G-and-nu", "nu = 0.3", 'nu = 0.3\nG = "80 GPa"', "materials.steel.G", "exactly one of G and nu"),
    edit("neither-G-nor-nu", "nu = 0.3\n", "", "materials.steel.G", "exactly one of G and nu"),
    edit("negative-modulus", '"139 GPa"', '"-139 GPa"', "materials.ply.E1 = -1.39e+11 Pa", "above zero"),
    edit("material-unknown", 'material = "steel"', 'material = "steal"', "material = 'steal'", "`steel`"),
    edit("material-inline", 'material = "steel"', "material = {E = 1}", "segments[1].material", "known are steel, ply"),
    edit("material-of-layup", 'material = "ply"', 'material = "plie"', "layups.tube.material = 'plie'", "steel, ply"),
    edit("layup-unknown", 'layup = "tube"', 'layup = "tub"', "segments[0].layup = 'tub'", "`tube`"),
    edit("orthotropic-segment", 'material = "steel"', 'material = "ply"', "segments[1].material", "use a layup"),
    edit(
        "thickness-mismatch", '"2 mm"', "[1e-3, 2e-3]", "layups.tube.thickness has 2 entries for 4 angles", "give one"
    ),
    edit("angles-number", '[0, "45 deg", "-45 deg", "90 deg"]', "45", "layups.tube.angles = 45", "list"),
    edit("angles-empty", '[0, "45 deg", "-45 deg", "90 deg"]', "[]", "layups.tube.angles = []", "list"),
    edit("angle-unit", '"-45 deg"', '"-45 mm"', "layups.tube.angles[2] = '-45 mm'", "rad"),
    edit("layup-without-thickness", 'thickness = "2 mm"\n', "", "layups.tube.thickness is missing"),
    edit("ply-thickness", '"2 mm"', '["1 mm", "1 mm", 0, "1 mm"]', "layups.tube.thickness[2] = 0 m", "above zero"),
    # shaft
    edit("negative-length", "length = 0.2", "length = -0.2", "segments[1].length = -0.2 m", "above zero"),
    edit("no-wall", '"70 mm"', '"70 mm"\ninner_diameter = 0.07', "segments[1].inner_diameter = 0.07 m", "leave a wall"),
    edit("material-and-layup", 'layup = "tube"', 'layup = "tube"\nmaterial = "steel"', "segments[0].material", "layup"),
    edit("plies-and-layup", 'layup = "tube"', 'layup = "tube"\nplies = "tube"', "segments[0].plies", "twice"),
    edit(
        "diameter-of-layup", 'layup = "tube"', 'layup = "tube"\nouter_diameter = 1', "outer_diameter = 1 m", "remove it"
    ),
    edit("no-section", 'layup = "tube"\n', "", "rotor.shaft.segments[0].material", "layup"),
    edit("elements-zero", "elements = 10", "elements = 0", "rotor.shaft.elements = 0", "1 to 2000"),
    edit("elements-fraction", "elements = 10", "elements = 10.5", "rotor.shaft.elements = 10.5", "whole number"),
    edit("theory-unknown", "elements = 10", 'theory = "timoshenk"', "shaft.theory = 'timoshenk'", "timoshenko"),
    edit("ply-law-unknown", "elements = 10", 'ply_law = "3d"', "shaft.ply_law = '3d'", "plane-stress"),
    edit(
        "shear-word", "shear_correction = 0.5", 'shear_correction = "cooper"', "shear_correction = 'cooper'", "'cowper'"
    ),
    edit("cowper-laminate", "shear_correction = 0.5", 'shear_correction = "cowper"', "segments[0]", "give a number"),
    # what sits on the shaft
    edit("disk-off", "position = 0.3", "position = 1.31", "rotor.disks[0].position = 1.31 m", "1.2 m", "move the disk"),
    edit("disk-before", "position = 0.3", "position = -0.3", "rotor.disks[0].position = -0.3 m", "negative"),
    BadFile(
        "disks-overlap",
        edited(
            ("mass = 20\n", "mass = 20\nwidth = 0.1\nouter_diameter = 0.3\ninner_diameter = 0.1\n"),
            ("position = 0.3", "position = 0.55"),
        ),
        ("machine.toml", "rotor.disks[1].position = 0.6 m", "overlap with rotor.disks[0]", "move the disks apart"),
    ),
    edit("polar-inertia", "polar_inertia = 0.38", "polar_inertia = 0.41", "disks[0].polar_inertia", "exchanged"),
    edit("no-mass", "mass = 20\n", "", "rotor.disks[0].mass is missing", "give the mass"),
    edit("mass-and-density", DISK_2, f"mass = 3\n{DISK_2}", "rotor.disks[1].density", "one of them"),
    edit("ring-incomplete", 'width = "60 mm"\n', "", "rotor.disks[1].width is missing"),
    edit(
        "bearings-together", "position = 1.1", "position = 0.1", "bearings[1].position = 0.1 m", "bearings[0]", "merge"
    ),
    edit("bearing-empty", "position = 0.1\nstiffness = 1e7", "position = 0.1", "bearings[0].stiffness", "missing"),
    edit("sensor-off", "position = 0.18", "position = 1.3", "sensors[0].position = 1.3 m", "move the sensor"),
    edit("sensor-unknown", 'sensor = "left"', 'sensor = "lift"', "magnets[0].sensor = 'lift'", "left"),
    edit(
        "sensor-twice", "[[sensors]]", '[[sensors]]\nname = "left"\nposition = 1\n[[sensors]]', "sensors[1].name", "own"
    ),
    # magnets and controller
    edit("gap-zero", 'gap = "0.4 mm"', "gap = 0", "magnets[0].gap = 0 m", "above zero"),
    edit("clearance", 'clearance = "0.2 mm"', 'clearance = "0.5 mm"', "magnets[0].clearance = 0.0005 m", "gap"),
    edit(
        "bias", "bias_current = 2", "bias_current = 6", "magnets[0].bias_current = 6 A", "max_current", "lower the bias"
    ),
    edit("half-angle", '"22.5 deg"', "22.5", "magnets[0].half_angle = 22.5 rad", "'22.5 deg'"),
    edit("ki-without-ks", "negative_stiffness = 1e5\n", "", "magnets[1].negative_stiffness is missing", "both"),
    edit("ks-negative", "= 1e5", "= -1e5", "magnets[1].negative_stiffness = -100000 N/m", "negative"),
    edit("geometry-incomplete", "turns = 200\n", "", "magnets[0].turns is missing", "turns, pole_area"),
    edit("geometry-and-ki", "= 1e5", "= 1e5\nturns = 100", "magnets[1].turns = 100", "not by both"),
    edit("no-magnet", GOOD[GOOD.index("[[magnets]]") : GOOD.index("[[sensors]]")], "", "controller", "[[magnets]]"),
    edit("corner-zero", '"2 kHz"', "0", "controller.low_pass.frequency = 0 rad/s", "above zero"),
    edit("controller-type", "kp = 10000", 'type = "pdi"\nkp = 1', "controller.type = 'pdi'", "pid"),
    raw("controller-false", HEAD.replace("[source]", "controller = false\n[source]"), "controller = False", "a table"),
    # files and names
    BadFile("folder-without-machine", _folder_only, ("folder", "machine.toml")),
    BadFile("folder-for-file", _folder_named_as_file, ("machine.toml", "folder")),
    BadFile("packaged-misspelt", lambda folder: "thesys", ("thesys", "did you mean `thesis`?")),
    BadFile("no-such-file", lambda folder: folder / "thesi" / "machine.toml", ("thesi", "did you mean `thesis`?")),
    BadFile("null-in-path", lambda folder: "the\0sis", ("neither a file",)),
    BadFile("path-too-long", lambda folder: "x" * 5000, ("xxx", "neither a file")),
    BadFile("device", lambda folder: "/dev/null", ("/dev/null", "no regular file")),
)
"""All cases."""
