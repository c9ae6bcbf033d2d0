"""Wrong problem files: what is in them, and what the one sentence of refusal has to say.

Most are a valid problem, or its machine, with one edit. `write(case, folder)` puts a case on disk and returns what a user
would type.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

MACHINE = """\
format = "amb_design/1"
name = "rig"

[source]
title = "a machine for tests"

[operation]
top_speed = "20000 rpm"
service_speed = "10000 rpm"

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
elements = 4
viscous_damping = 1e-5

[[rotor.shaft.segments]]
length = 1.0
inner_diameter = "60 mm"
layup = "tube"

[[rotor.shaft.segments]]
length = 0.2
material = "steel"
outer_diameter = "70 mm"

[[rotor.disks]]
name = "left"
position = 0.3
density = 7850
outer_diameter = "200 mm"
inner_diameter = "76 mm"
width = "100 mm"
unbalance = "5 g mm"

[[rotor.disks]]
name = "right"
position = 0.6
density = 7850
outer_diameter = "200 mm"
inner_diameter = "76 mm"
width = "100 mm"

[[rotor.disks]]
name = "weight"
position = 1.1
mass = 2
diametral_inertia = 0.01
polar_inertia = 0.01

[[bearings]]
position = 0
kyy = 1e5
kzz = 2e5
damping = 20

[[magnets]]
name = "left"
position = 0.1
sensor = "left"
turns = 200
pole_area = 2.6e-4
gap = "0.4 mm"
bias_current = 2
max_current = 5
clearance = "0.2 mm"
resistance = 0.3

[[magnets]]
name = "right"
position = 0.9
sensor = "right"
turns = 200
pole_area = 2.6e-4
gap = "0.4 mm"
bias_current = 2
max_current = 5
clearance = "0.2 mm"
resistance = 0.3

[[sensors]]
name = "left"
position = 0.13

[[sensors]]
name = "right"
position = 0.87

[[sensors]]
name = "spare"
position = 0.45

[controller]
kp = 10000
kd = 10
ki = 100

[controller.low_pass]
frequency = "2 kHz"

[variants.own]
magnets = [
    { position = 0.1, turns = 200, pole_area = 2.6e-4, gap = "0.4 mm", bias_current = 2, controller = { kp = 1e4, kd = 10 } },
    { position = 0.9, turns = 200, pole_area = 2.6e-4, gap = "0.4 mm", bias_current = 2, controller = { kp = 1e4, kd = 10 } },
]

[variants.passive]
magnets = []
controller = false
"""

GOOD = """\
format = "amb_design/1"
name = "good"
question = "How fast may it spin?"
maximise = "stability_limit"

[source]
title = "a problem for tests"

[changes]
"operation.top_speed" = "30000 rpm"

[free]
"controller.kp" = [5e3, 5e4, "log"]
"low_pass.frequency" = ["1 kHz", "4 kHz"]
"magnets.bias_current" = [1, "3000 mA"]
"plies[1].angle" = ["0 deg", "90 deg"]
"magnets[0].position" = [0.08, "0.2 m"]

[ties]
"plies[2].angle" = { "plies[1].angle" = -1 }
"sensors[0].position" = { "magnets[0].position" = 1, constant = "30 mm" }

[limits]
sensitivity_peak = 3.0
total_current = "4 A"
damping_ratio = { limit = 0.002, window = ["1 Hz", "300 Hz"] }
surface_speed = { limit = "400 m/s", disks = ["left"] }

[unbalance]
static = ["3 g mm", 0, "3 g mm"]
couple = ["3 g mm", 0, "-3 g mm"]

[scenarios.soft-magnets]
"magnets.gap" = 1.05
unbalance = 1.5

[variants.bias-only]
limits = false

[variants.lighter]
maximise = false
minimise = "mass"
speed = "9000 rpm"
free."plies.thickness" = ["1 mm", "3 mm"]

[variants.shorter]
changes."operation.top_speed" = "25000 rpm"
"""


@dataclass(frozen=True)
class BadProblem:
    """One wrong problem.

    Attributes
    ----------
    id : short name of the case
    content : what the problem file holds, or a function that puts anything else into the folder and returns its path
    fragments : what the message must contain
    machine : what the machine file beside it holds
    """

    id: str
    content: str | Callable[[Path], Path | str]
    fragments: tuple[str, ...]
    machine: str = MACHINE


def write(case: BadProblem, folder: Path) -> str:
    """Put a case into a folder; returns the path (or name) to load."""
    (folder / "machine.toml").write_text(case.machine)
    if callable(case.content):
        return str(case.content(folder))
    path = folder / "problem.toml"
    path.write_text(case.content)
    return str(path)


def edited(text: str, *changes: tuple[str, str]) -> str:
    """A text with some pieces exchanged."""
    for old, new in changes:
        assert text.count(old) >= 1, f"the text does not contain {old!r}"
        text = text.replace(old, new, 1)
    return text


def edit(name: str, old: str, new: str, *fragments: str) -> BadProblem:
    """A case with one exchange; the message has to name the file too."""
    return BadProblem(name, edited(GOOD, (old, new)), ("problem.toml", *fragments))


def free(name: str, bounds: str, *fragments: str) -> BadProblem:
    """A case with one more variable."""
    return edit(name, "[free]\n", f"[free]\n{bounds}\n", *fragments)


def limit(name: str, line: str, *fragments: str) -> BadProblem:
    """A case with one more limit."""
    return edit(name, "[limits]\n", f"[limits]\n{line}\n", *fragments)


def with_machine(name: str, old: str, new: str, line: str, *fragments: str) -> BadProblem:
    """A case with an exchange in the machine and one line more in front of the good problem's tables."""
    text = edited(GOOD, ("[source]", f"{line}\n[source]"))
    return BadProblem(name, text, fragments, edited(MACHINE, (old, new)))


def small(name: str, body: str, *fragments: str, machine: str = MACHINE) -> BadProblem:
    """A case with a problem of its own."""
    head = 'format = "amb_design/1"\nname = "small"\nsource.title = "tests"\n'
    return BadProblem(name, head + body, ("problem.toml", *fragments), machine)


def _machine_as_problem(folder: Path) -> Path:
    return folder / "machine.toml"


def _folder_without(folder: Path) -> Path:
    return folder


def _without_machine(folder: Path) -> Path:
    (folder / "machine.toml").unlink()
    (folder / "problem.toml").write_text(GOOD)
    return folder


SEEK = 'maximise = "stability_limit"\n'
KP = '[free]\n"controller.kp" = [5e3, 5e4]\n'

BAD_PROBLEMS: tuple[BadProblem, ...] = (
    # the file
    BadProblem("empty", "", ("problem.toml", "is empty")),
    edit("no-toml", "sensitivity_peak = 3.0", "sensitivity_peak = 3 %", "is no TOML", "line 24"),
    edit("format", "amb_design/1", "amb_design/2", "format = 'amb_design/2'", 'write format = "amb_design/1"'),
    edit("name-missing", 'name = "good"\n', "", "name is missing"),
    edit("name-number", 'name = "good"', "name = 3", "name = 3", "must be text"),
    edit("question", '"How fast may it spin?"', "3", "question = 3", "must be text"),
    edit("source-missing", '[source]\ntitle = "a problem for tests"\n', "", "source is missing", "[source]"),
    edit("source-number", '"a problem for tests"', "1", "source.title = 1", "in quotes"),
    edit("unknown-key", "[limits]", "[limit]", "limit", "unknown key", "did you mean `limits`?"),
    edit("code", 'name = "good"', 'name = "good"\npython = "exit()"', "python = 'exit()'", "unknown key"),
    BadProblem("machine-file", _machine_as_problem, ("machine.toml", "describes a machine, not a design problem")),
    BadProblem("folder", _folder_without, ("is a folder without problem.toml",)),
    BadProblem("packaged-machine", lambda folder: "jeffcott", ("jeffcott has no problem.toml",)),
    BadProblem("unknown-name", lambda folder: "jefcot", ("jefcot is neither a file, a folder nor a packaged problem",)),
    # the machine
    BadProblem("no-machine", _without_machine, ("problem.toml", "machine is missing", "machine.toml beside")),
    edit(
        "machine-unknown",
        "[source]",
        'machine = "jefcott"\n[source]',
        "machine = 'jefcott'",
        "did you mean `jeffcott`?",
    ),
    edit("machine-number", "[source]", "machine = 3\n[source]", "machine = 3", "must be text"),
    edit(
        "machine-itself", "[source]", 'machine = "problem.toml"\n[source]', "describes a design problem", "machine file"
    ),
    with_machine(
        "machine-wrong", "length = 0.2", "length = -0.2", "", "machine.toml: rotor.shaft.segments[1].length = -0.2 m"
    ),
    BadProblem(
        "variant-unknown",
        edited(GOOD, ("[source]", 'machine_variant = "pasive"\n[source]')),
        ("machine.toml: the file has no variant pasive", "`passive`"),
    ),
    edit("variant-number", "[source]", "machine_variant = 1\n[source]", "machine_variant = 1", "must be text"),
    edit(
        "change-unknown",
        "operation.top_speed",
        "operation.top_sped",
        "changes.operation.top_sped",
        "operation.top_speed?",
    ),
    edit("change-unit", '"30000 rpm"', '"30000 m"', "changes.operation.top_speed = '30000 m'", "wrong unit"),
    edit("change-domain", '"30000 rpm"', "-1", "changes.operation.top_speed = -1 rad/s", "positive"),
    edit("change-list", '"30000 rpm"', "[1]", "changes.operation.top_speed = [1]", "must be a number"),
    edit("change-part", '"operation.top_speed" = "30000 rpm"', "controller = 3", "changes.controller", "no number"),
    edit(
        "change-unquoted",
        '"operation.top_speed"',
        "operation.top_speed",
        "changes.operation",
        '"operation.top_speed" =',
    ),
    edit(
        "change-twice",
        '"30000 rpm"',
        '1\n"magnets.gap" = 1e-3\n"magnets[1].gap" = 1e-3',
        "changes.magnets[1].gap",
        "changed twice",
    ),
    # what is sought
    edit("nothing-sought", SEEK, "", "maximise is missing", "say what is sought"),
    edit("both-sought", SEEK, SEEK + 'minimise = "mass"\n', "minimise is given beside `maximise`"),
    edit("sought-unknown", "stability_limit", "stabilty_limit", "maximise = 'stabilty_limit'", "`stability_limit`"),
    edit("sought-number", '"stability_limit"', "3", "maximise = 3", "is no known quantity"),
    edit(
        "wrong-way",
        "stability_limit",
        "mass",
        "maximise = 'mass' cannot be maximised",
        "stability_limit, damping_ratio",
    ),
    edit("no-objective", "stability_limit", "decay_rate", "maximise = 'decay_rate' cannot be maximised"),
    edit("no-speed", "stability_limit", "damping_ratio", "speed is missing", "must be stable"),
    edit("speed-given", SEEK, SEEK + 'speed = "9000 rpm"\n', "speed = 942.478 is not fixed", "remove it"),
    edit("speed-unit", SEEK, 'minimise = "mass"\nspeed = "9000 m"\n', "speed = '9000 m'", "wrong unit"),
    edit("speed-negative", SEEK, 'minimise = "mass"\nspeed = -1\n', "speed = -1 must be a positive speed"),
    edit(
        "objective-option",
        '"stability_limit"',
        '{ quantity = "damping_ratio", widow = 1 }',
        "maximise.widow",
        "`window`",
    ),
    small(
        "idle-objective", f'minimise = "mass"\nspeed = 900\n{KP}', "minimise = 'mass' cannot change", "free a number"
    ),
    small("bias-unmoved", f'minimise = "bias_current"\nspeed = 900\n{KP}', "minimise = 'bias_current' cannot change"),
    # what is free
    edit(
        "nothing-free",
        GOOD[GOOD.index("[free]") : GOOD.index("[limits]")],
        "[free]\n",
        "free is empty",
        "what may change",
    ),
    free("unknown-path", '"controler.kd" = [1, 2]', "free.controler.kd names no number", "did you mean controller.kd?"),
    free("no-path", '"controller kd" = [1, 2]', "free.controller kd is no path"),
    free("unquoted", "controller.kd = [1, 2]", "free.controller is no path", '"controller.kd" ='),
    free("ambiguous", '"stiffness" = [1, 2]', "free.stiffness"),
    free(
        "crossed", '"controller.kd" = [20, 5]', "free.controller.kd = [20, 5] has crossed bounds", "smaller one first"
    ),
    free("equal", '"controller.kd" = [5, 5]', "free.controller.kd = [5, 5] has equal bounds"),
    free("one-bound", '"controller.kd" = [5]', "free.controller.kd = [5.0] must be a pair"),
    free("number", '"controller.kd" = 5', "free.controller.kd = 5 must be a pair of bounds"),
    free("nan", '"controller.kd" = [nan, 5]', "free.controller.kd = nan must be a finite number"),
    free("infinite", '"controller.kd" = [1, inf]', "free.controller.kd = inf must be a finite number"),
    free("text", '"controller.kd" = [1, "five"]', "free.controller.kd[1] = 'five' is not a number"),
    free("unit", '"magnets.gap" = ["0.3 mm", "0.5 kg"]', "free.magnets.gap[1] = '0.5 kg'", "wrong unit"),
    free("scale", '"controller.kd" = [1, 5, "lin"]', "free.controller.kd = 'lin' has an unknown scale", "linear, log"),
    free("log-zero", '"controller.kd" = [0, 5, "log"]', "free.controller.kd = 0 has a logarithmic scale"),
    free("twice", '"kp" = [1, 2]', "sets controller.kp, which free.kp sets too", "once"),
    free("unbalance", '"disks[0].unbalance" = [1e-6, 1e-5]', "is no design number", "[unbalance]"),
    free("operation", '"operation.gravity" = [1, 2]', "free.operation.gravity is no part of the design"),
    free("switch", '"controller.delay" = [1e-5, 1e-4]', "controller.delay is zero in the machine", "above zero"),
    free(
        "through-switch", '"controller.ki" = [-1, 200]', "free.controller.ki = [-1, 200]", "lets controller.ki be zero"
    ),
    free(
        "domain", '"magnets.gap" = [0, 1e-3]', "free.magnets.gap = [0, 0.001]", "magnets[0].gap = 0 m must be positive"
    ),
    free(
        "wall",
        '"segments[1].inner_diameter" = [0, 0.08]',
        "free.segments[1].inner",
        "not below the outer diameter (0.07 m)",
    ),
    free(
        "two-bounds-meet",
        '"disks[0].inner_diameter" = [0.05, 0.15]\n"disks[0].outer_diameter" = [0.12, 0.25]',
        "free.disks[0].inner_diameter = [0.05, 0.15]",
        "rotor.disks[0].inner_diameter = 0.15 m is not below the outer diameter (0.12 m)",
        "narrow the bounds",
    ),
    free("bias-too-large", '"magnets[0].gap" = [1e-4, 5e-4]', "clearance = 0.0002 m exceeds the air gap (0.0001 m)"),
    free("poisson", '"material.nu" = [0.2, 0.6]', "free.material.nu = [0.2, 0.6]", "nu = 0.6 is no admissible"),
    # order of places
    free(
        "pass",
        '"magnets[1].position" = [0.5, 0.95]',
        "free.magnets[1].position = [0.5, 0.95]",
        "lets sensors[1].position and magnets[1].position meet or pass",
    ),
    free("off-the-end", '"disks[2].position" = [1.05, 1.3]', "disks[2].position and the right shaft end meet or pass"),
    free("off-the-start", '"disks[0].position" = [-0.1, 0.4]', "rotor.disks[0].position = -0.1 m must not be negative"),
    free("pass-a-step", '"disks[2].position" = [0.95, 1.15]', "the step after rotor.shaft.segments[0]", "meet or pass"),
    free(
        "shorter-shaft",
        '"segments[1].length" = [0.05, 0.3]',
        "free.segments[1].length = [0.05, 0.3]",
        "right shaft end",
    ),
    free(
        "both-move",
        '"disks[1].position" = [0.5, 0.8]\n"sensors[1].position" = [0.75, 0.89]',
        "lets rotor.disks[1].position and sensors[1].position meet or pass",
    ),
    free(
        "disks-overlap", '"disks[0].width" = [0.1, 0.6]', "free.disks[0].width = [0.1, 0.6]", "rotor.disks[1] overlap"
    ),
    free(
        "shared-place",
        '"bearings[0].position" = [0, 0.05]',
        "bearings[0].position away from the left shaft end",
        "node",
    ),
    edit(
        "tie-too-loose",
        'constant = "30 mm"',
        'constant = "110 mm"',
        "free.magnets[0].position = [0.08, 0.2]",
        "lets sensors[0].position and rotor.disks[0].position meet or pass",
    ),
    # numbers that nothing reads
    edit(
        "own-controllers",
        "[source]",
        'machine_variant = "own"\n[source]',
        "free.controller.kp influences nothing: no magnet uses this controller",
    ),
    free(
        "idle-sensor",
        '"sensors[2].position" = [0.41, 0.49]',
        "free.sensors[2].position influences nothing",
        "no magnet",
    ),
    free("idle-stiffness", '"bearings.stiffness" = [1e3, 1e5]', "bearings.stiffness influences nothing: kyy and kzz"),
    free("idle-clearance", '"magnets.clearance" = [1e-4, 3e-4]', "influences nothing: only displacement_ratio"),
    free("idle-rating", '"magnets.max_current" = [4, 6]', "influences nothing: no quantity reads it"),
    # ties
    edit("tie-unknown", '"plies[2].angle" =', '"plies[9].angle" =', "ties.plies[9].angle names no number"),
    edit(
        "tie-no-variable",
        '{ "plies[1].angle" = -1 }',
        '{ "plies[0].angle" = -1 }',
        "names no variable",
        "`plies[1].angle`",
    ),
    edit("tie-empty", '{ "plies[1].angle" = -1 }', "{ constant = 1 }", "ties.plies[2].angle follows no variable"),
    edit("tie-number", '{ "plies[1].angle" = -1 }', "3", "ties.plies[2].angle = 3 must be a table"),
    edit("tie-zero", '{ "plies[1].angle" = -1 }', '{ "plies[1].angle" = 0 }', "has the factor zero", "remove it"),
    edit("tie-factor", '{ "plies[1].angle" = -1 }', '{ "plies[1].angle" = "1 m" }', "= '1 m'", "plain number"),
    edit("tie-constant", '"30 mm"', '"30 kg"', "ties.sensors[0].position.constant = '30 kg'", "wrong unit"),
    edit("tie-infinite", '"30 mm"', "inf", "ties.sensors[0].position.constant = inf must be a finite number"),
    edit("tie-and-variable", '"plies[2].angle" =', '"plies[1].angle" =', "which free.plies[1].angle sets too"),
    edit(
        "tie-to-itself",
        '{ "plies[1].angle" = -1 }',
        '{ "plies[2].angle" = -1 }',
        "ties.plies[2].angle.plies[2].angle is tied",
    ),
    edit(
        "tie-cycle",
        '{ "plies[1].angle" = -1 }',
        '{ "plies[3].angle" = 1 }\n"plies[3].angle" = { "plies[2].angle" = 1 }',
        "ties.plies[2].angle.plies[3].angle is tied itself",
        "follow its variables",
    ),
    edit(
        "tie-domain",
        '{ "plies[1].angle" = -1 }',
        '{ "plies[1].angle" = -1 }\n"magnets.gap" = { "kp" = 1 }',
        "no variable",
    ),
    edit(
        "tie-leaves-domain",
        "[ties]\n",
        '[ties]\n"controller.kd" = { "controller.kp" = 1e-3 }\n"magnets.gap" = { "magnets.bias_current" = -2e-4, constant = 8e-4 }\n',
        "free.magnets.bias_current = [1, 3]",
        "allows a machine that is none: magnets[0].clearance = 0.0002 m exceeds the air gap",
    ),
    # limits
    limit("limit-unknown", "sensitivity = 3", "limits.sensitivity = 'sensitivity' is no known", "`sensitivity_peak`"),
    limit("limit-unit", 'control_current = "1 V"', "limits.control_current = '1 V'", "wrong unit"),
    limit("limit-text", 'control_current = "low"', "limits.control_current = 'low'", "write a number in A"),
    limit("limit-bool", "control_current = true", "limits.control_current = True must be a finite number", "in A"),
    limit("limit-zero", "control_current = 0", "limits.control_current = 0 must be positive", "above zero"),
    limit("limit-nan", "control_current = nan", "limits.control_current = nan must be a finite number"),
    limit("limit-missing", "control_current = {}", "limits.control_current must be a finite number"),
    edit("damping-one", "limit = 0.002", "limit = 1", "limits.damping_ratio = 1 cannot be met", "above 0 and below 1"),
    edit("peak-one", "sensitivity_peak = 3.0", "sensitivity_peak = 0.9", "limits.sensitivity_peak = 0.9 cannot be met"),
    limit("limit-speed", 'stability_limit = "9000 rpm"', "limits.stability_limit is limited and sought at once"),
    small(
        "limit-speed-too",
        'minimise = "bias_current"\nspeed = 900\n[limits]\nstability_limit = 800\n[free]\n"magnets.bias_current" = [1, 3]\n',
        "limits.stability_limit is what `speed` asks for",
    ),
    limit("option-unknown", "mass = { limit = 30, window = [1, 2] }", "limits.mass.window", "mass has no options"),
    limit("noise-missing", 'noise_current = "20 mA"', "limits.noise_current.noise is missing", "in m/sqrt(Hz)"),
    limit(
        "noise-unit",
        'noise_current = { limit = "20 mA", noise = "2 nm/Hz" }',
        "limits.noise_current.noise = '2 nm/Hz' has the wrong unit",
    ),
    limit("noise-zero", "noise_current = { limit = 0.02, noise = 0 }", "noise_current.noise = 0 must be positive"),
    edit("window-unit", '"300 Hz"', '"300 m"', "limits.damping_ratio.window[1] = '300 m'", "wrong unit"),
    edit("window-order", '["1 Hz", "300 Hz"]', '["300 Hz", "1 Hz"]', "limits.damping_ratio.window", "is no range"),
    edit("window-one", '["1 Hz", "300 Hz"]', '["300 Hz"]', "limits.damping_ratio.window", "must hold 2 numbers"),
    limit(
        "overspeed", "hoop_strain = { limit = 4e-3, overspeed = -1 }", "hoop_strain.overspeed = -1", "must be positive"
    ),
    edit(
        "disk-unknown", 'disks = ["left"]', 'disks = ["lift"]', "surface_speed.disks = 'lift' names no disk", "`left`"
    ),
    edit("disk-no-ring", 'disks = ["left"]', 'disks = ["weight"]', "disks = 'weight' has no outer diameter"),
    edit("disk-none", 'disks = ["left"]', "disks = []", "limits.surface_speed.disks = [] must be a list of names"),
    edit("disk-text", 'disks = ["left"]', 'disks = "left"', "limits.surface_speed.disks = 'left' must be a list"),
    small(
        "no-loop",
        f'machine_variant = "passive"\n{SEEK}limits.sensitivity_peak = 3\n[free]\n"damping" = [1, 30]\n',
        "limits.sensitivity_peak needs a control loop",
    ),
    small(
        "no-resistance",
        f'machine_variant = "own"\n{SEEK}limits.copper_loss = 300\n[free]\n"magnets.controller.kp" = [1e3, 1e5]\n',
        "limits.copper_loss needs the resistance of the coils",
    ),
    small(
        "no-unbalance",
        f"{SEEK}limits.control_current = 3\n{KP}",
        "limits.control_current needs a residual unbalance",
        "[unbalance]",
        machine=edited(MACHINE, ('unbalance = "5 g mm"\n', "")),
    ),
    small(
        "no-service-speed",
        f"{SEEK}limits.separation_margin = 0.2\n{KP}",
        "limits.separation_margin needs a service speed",
        machine=edited(MACHINE, ('service_speed = "10000 rpm"\n', "")),
    ),
    # unbalance
    edit("unbalance-count", '["3 g mm", 0, "3 g mm"]', "[1e-6]", "unbalance.static", "each of the 3 disks"),
    edit("unbalance-number", '["3 g mm", 0, "3 g mm"]', "1e-6", "unbalance.static = 1e-06 must give one amount"),
    edit("unbalance-unit", '["3 g mm", 0', '["3 mm", 0', "unbalance.static[0] = '3 mm'", "wrong unit"),
    edit("unbalance-nan", '["3 g mm", 0', "[nan, 0", "unbalance.static[0] = nan must be a finite number"),
    edit("unbalance-zero", '["3 g mm", 0, "3 g mm"]', "[0, 0, 0]", "unbalance.static is zero at every disk"),
    # scenarios
    edit(
        "scenario-path",
        '"magnets.gap" = 1.05',
        '"magnets.gab" = 1.05',
        "scenarios.soft-magnets.magnets.gab",
        "magnets.gap?",
    ),
    edit("scenario-zero", "= 1.05", "= 0", "scenarios.soft-magnets.magnets.gap = 0 must be positive"),
    edit("scenario-text", "= 1.05", '= "1 mm"', "scenarios.soft-magnets.magnets.gap = '1 mm'", "plain number"),
    edit(
        "scenario-table", '"magnets.gap"', "magnets.gap", "scenarios.soft-magnets.magnets is no path", '"magnets.gap" ='
    ),
    edit(
        "scenario-number", "[scenarios.soft-magnets]", "[scenarios]\nx = 3\n[scenarios.y]", "scenarios.x = 3", "a table"
    ),
    edit("scenario-empty", '"magnets.gap" = 1.05\nunbalance = 1.5\n', "", "scenarios.soft-magnets changes nothing"),
    edit("scenario-twice", "= 1.05", '= 1.05\n"magnets[0].gap" = 1.1', "scales magnets[0].gap", "once"),
    edit(
        "scenario-operation",
        '"magnets.gap"',
        '"operation.gravity"',
        "scenarios.soft-magnets.operation.gravity is no part",
    ),
    edit("scenario-idle", '"magnets.gap"', '"magnets.max_current"', "magnets.max_current influences nothing"),
    edit("scenario-nought", '"magnets.gap"', '"leakage_inductance"', "influences nothing: the number is zero"),
    edit(
        "scenario-refused", "1.05", "0.4", "scenarios.soft-magnets allows a machine that is none", "exceeds the air gap"
    ),
    edit("scenario-moves", '"magnets.gap"', '"bearings.position"', "influences nothing: the number is zero"),
    edit(
        "scenario-order",
        '"magnets.gap" = 1.05',
        '"sensors[0].position" = 0.8',
        "scenarios.soft-magnets lets",
        "meet or pass",
    ),
    # variants
    edit("variant-renames", "[variants.bias-only]", "[variants.bias-only]\nname = 'x'", "name = 'x' cannot be changed"),
    edit("variant-removes", "limits = false", "limit = false", "limit = false removes", "`limits`"),
)
"""All cases; those of variants are met when all variants are read."""
