"""FMI 3.0: the machine as a model-exchange unit, its sampled controllers as a co-simulation unit, with sources.

The units are compiled with the C compiler ``cc`` and the headers that FMPy ships, for the platform at hand.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import casadi as ca

from .. import __version__
from ..errors import SolveError, SpecError
from ..spec.machine import Machine
from ..spec.sampling import Sampling
from ..study.loop import closed_loop
from .ccode import controller_code
from .discrete import discrete
from .late import package

SOURCES = tuple(Path(__file__).with_name(name) for name in ("fmu.c", "fmu_absent.c"))


@dataclass(frozen=True)
class _Variable:
    name: str
    unit: str
    causality: str
    meaning: str
    start: float | None = None


def model_fmu(machine: Machine, file: str | os.PathLike[str], speed: float = 0.0, modes: int = 8) -> None:
    """The nonlinear machine with its controllers as a unit for model exchange.

    Parameters
    ----------
    machine : Machine
    file : path
        Its name ends in ``.fmu``.
    speed : float
        First value of the input ``speed`` [rad/s]; the spin angle is a state that follows it.
    modes : int
        Lowest modes that are kept, with static correction.

    Raises
    ------
    SpecError
        If the file is called otherwise.
    SolveError
        If FMPy or a C compiler is missing.

    Notes
    -----
    Loads are the disks' unbalances and gravity. The magnets obey their force law without limits of current, voltage and flux. The moment of
    an accelerated spin is left out, so that the speed should change slowly.
    """
    tools = _tools(file)
    loop = closed_loop(machine)
    rhs, loads = loop.function("rhs", modes=modes), loop.function("loads", modes=modes)
    n = rhs.size1_in("x")
    x, u, none = ca.MX.sym("x", n + 1), ca.MX.sym("u"), ca.DM(0, 1)
    pull = loads(none, x[n], u, 0.0)
    rate, *seen = rhs(none, x[:n], u, 0.0, pull[0] + pull[1])
    ode = ca.Function("ode", [x, u], [ca.vertcat(rate, u), ca.vertcat(*seen)])
    axes = [a.name for a in loop.plant.axes] if not loop.complex_form else None
    names = axes or [f"{a.name} {d}" for a in loop.plant.axes for d in "yz"]
    outputs = [
        _Variable(f"{what} {name}", unit, "output", f"{meaning}, {name}")
        for what, unit, meaning in (
            ("current", "A", "control current"),
            ("displacement", "m", "of the shaft at the magnet"),
            ("force", "N", "of the magnet on the shaft"),
        )
        for name in names
    ]
    states = [_Variable(f"x[{k}]", "", "local", "state", 0.0) for k in range(n)]
    states.append(_Variable("angle", "rad", "local", "spin angle", 0.0))
    inputs = [_Variable("speed", "rad/s", "input", "spin speed", speed)]
    with tempfile.TemporaryDirectory() as folder:
        generator = ca.CodeGenerator("ode.c")
        generator.add(ode)
        generator.generate(f"{folder}{os.sep}")
        defines = {"ME": 1, "NX": n + 1, "NU": 1, "NY": len(outputs)}
        _pack(machine, Path(file), Path(folder), "model", defines, (inputs, outputs, states), None, tools)


def controller_fmu(machine: Machine, file: str | os.PathLike[str], sampling: Sampling, speed: float = 0.0) -> None:
    """The sampled controllers as a unit for co-simulation.

    Parameters
    ----------
    machine : Machine
    file : path
        Its name ends in ``.fmu``.
    sampling : Sampling
        As in `amb_design.interop.discrete.discrete`; communication steps must be multiples of its period.
    speed : float
        Spin speed [rad/s], for gains that follow it.

    Raises
    ------
    SpecError, SolveError
        As in `model_fmu`.
    ModelError
        As in `amb_design.interop.discrete.discrete`.
    """
    tools = _tools(file)
    law = discrete(machine, sampling, speed)
    inputs = [_Variable(n, "m", "input", "of the shaft at the sensor", 0.0) for n in law.inputs]
    outputs = [_Variable(n, "A", "output", "command to the amplifier") for n in law.outputs]
    with tempfile.TemporaryDirectory() as folder:
        controller_code(machine, folder, sampling, speed)
        period = float(sampling.period)
        defines = {"NX": len(law.a), "NU": len(inputs), "NY": len(outputs), "PERIOD": repr(period)}
        _pack(machine, Path(file), Path(folder), "controller", defines, (inputs, outputs, []), period, tools)


def _tools(file: str | os.PathLike[str]) -> tuple[str, Path]:
    """Compiler and folder of headers; whatever is missing is said before anything is computed."""
    if Path(file).suffix != ".fmu":
        raise SpecError("is no .fmu file", field=str(file), remedy="name it so")
    fmpy = package("fmpy", "fmpy")
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        raise SolveError("no C compiler (cc or gcc) was found, which units need")
    return compiler, Path(fmpy.__file__).parent / "c-code"


def _pack(
    machine: Machine,
    file: Path,
    folder: Path,
    kind: str,
    defines: Mapping[str, object],
    variables: tuple[Sequence[_Variable], Sequence[_Variable], Sequence[_Variable]],
    period: float | None,
    tools: tuple[str, Path],
) -> None:
    compiler, headers = tools
    law = "".join(path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.[ch]")))
    token = f"{{{uuid.uuid5(uuid.NAMESPACE_OID, f'{kind} {__version__} {machine!r} {defines} {law}')}}}"
    starts = ", ".join(repr(float(v.start or 0.0)) for v in variables[0])
    defines = {**defines, "STARTS": f"{{ {starts} }}"}
    head = "".join(f"#define {k} {v}\n" for k, v in defines.items()) + f'#define TOKEN "{token}"\n'
    for source in SOURCES:
        (folder / source.name).write_text(head + source.read_text(encoding="utf-8"), encoding="utf-8")
    library = folder / f"{kind}.so"
    command = [compiler, "-O2", "-shared", "-fPIC", f"-I{headers}", "-o", str(library)]
    command += [*(str(folder / source.name) for source in SOURCES), "-lm"]
    made = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    if made.returncode:
        raise SolveError(f"the C compiler failed: {made.stderr.strip().splitlines()[0]}")
    packed = folder / "unit.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as unit:
        unit.writestr("modelDescription.xml", _description(machine, kind, token, variables, period))
        unit.write(library, f"binaries/{_platform()}/{kind}{'.dylib' if sys.platform == 'darwin' else '.so'}")
        for path in sorted(folder.glob("*.[ch]")):
            unit.write(path, f"sources/{path.name}")
        unit.writestr("sources/buildDescription.xml", _build(kind))
    shutil.copyfile(packed, file)


def _platform() -> str:
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    return f"{machine}-{'darwin' if sys.platform == 'darwin' else 'linux'}"


def _description(
    machine: Machine,
    kind: str,
    token: str,
    variables: tuple[Sequence[_Variable], Sequence[_Variable], Sequence[_Variable]],
    period: float | None,
) -> str:
    inputs, outputs, states = variables
    first = 1 + len(inputs) + len(outputs)
    rows = ['<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>']
    rows += [_row(v, k + 1) for k, v in enumerate([*inputs, *outputs])]
    rows += [_row(v, first + k) for k, v in enumerate(states)]
    ders = range(first + len(states), first + 2 * len(states))
    rows += [
        f'<Float64 name={quoteattr(f"der({v.name})")} valueReference="{d}" causality="local" derivative="{first + k}"/>'
        for k, (v, d) in enumerate(zip(states, ders, strict=True))
    ]
    seen = range(1 + len(inputs), first)
    unknown = [*seen, *ders]
    structure = [f'<Output valueReference="{k}"/>' for k in seen]
    structure += [f'<ContinuousStateDerivative valueReference="{k}"/>' for k in ders]
    structure += [f'<InitialUnknown valueReference="{k}"/>' for k in unknown]
    what = (
        f'<ModelExchange modelIdentifier="{kind}"/>'
        if period is None
        else f'<CoSimulation modelIdentifier="{kind}" canHandleVariableCommunicationStepSize="true" fixedInternalStepSize="{period!r}"/>'
    )
    units = sorted({v.unit for v in (*inputs, *outputs, *states) if v.unit})
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<fmiModelDescription fmiVersion="3.0" modelName={quoteattr(f"{machine.name} {kind}")} '
            f'instantiationToken="{token}" generationTool="amb_design {__version__}">',
            what,
            "<UnitDefinitions>",
            *[f'<Unit name="{u}"/>' for u in units],
            "</UnitDefinitions>",
            "<ModelVariables>",
            *rows,
            "</ModelVariables>",
            "<ModelStructure>",
            *structure,
            "</ModelStructure>",
            "</fmiModelDescription>",
            "",
        ]
    )


def _row(v: _Variable, reference: int) -> str:
    start = "" if v.start is None else f' start="{float(v.start)!r}"'
    unit = f' unit="{v.unit}"' if v.unit else ""
    exact = ' initial="exact"' if v.causality == "local" else ""
    return (
        f'<Float64 name={quoteattr(v.name)} valueReference="{reference}" causality="{v.causality}"'
        f"{exact}{start}{unit} description={quoteattr(v.meaning)}/>"
    )


def _build(kind: str) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'<BuildConfiguration modelIdentifier="{kind}"><SourceFileSet language="C99"><SourceFile name="fmu.c"/><SourceFile name="fmu_absent.c"/></SourceFileSet>'
        "</BuildConfiguration>\n</fmiBuildDescription>\n"
    )
