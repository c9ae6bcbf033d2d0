"""Command line: thin commands, each one API call.

Results go to standard output, progress and errors to standard error. Exit status 0 is success, 2 bad input, 3 a
solution that did not arrive.
"""

from __future__ import annotations

import dataclasses
import datetime
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, NoReturn

import numpy as np
import typer

from . import __version__
from .errors import AmbDesignError, SolveError, SpecError

app = typer.Typer(
    name="amb-design",
    help="Flexible composite rotors on active magnetic bearings: analysis and design.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _names(incomplete: str) -> list[str]:
    """Packaged problems for the shell's completion; where none fits, it completes file names."""
    from .spec.files import packaged

    return [name for name in packaged() if name.startswith(incomplete)]


Target = Annotated[
    str,
    typer.Argument(
        help="machine file, folder with a machine.toml, or name of a packaged problem", autocompletion=_names
    ),
]
Json = Annotated[bool, typer.Option("--json", help="print one JSON document instead of tables")]
Variant = Annotated[str | None, typer.Option(help="one variant of the file instead of all")]


def _version(show: bool) -> None:
    if show:
        typer.echo(f"amb-design {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and stop")
    ] = False,
) -> None:
    """Flexible composite rotors on active magnetic bearings: analysis and design."""


@app.command(name="list")
def list_problems(as_json: Json = False) -> None:
    """List the packaged problems."""
    from .console import problems as console
    from .spec.files import FILE_NAME, PROBLEM_FILE, load, load_variants, packaged
    from .spec.problem_files import load_problem, load_problem_variants

    rows = []
    for name, folder in packaged().items():
        has_machine, has_problem = (folder / FILE_NAME).is_file(), (folder / PROBLEM_FILE).is_file()
        described = load(folder) if has_machine else load_problem(folder)
        machines = load_variants(folder) if has_machine else {}
        designs = load_problem_variants(folder) if has_problem else {}
        problem = "" if not has_problem else load_problem(folder).name if has_machine else described.name
        rows.append(
            {
                "name": name,
                "source": described.source.get("title", ""),
                "variants": [v for v in machines if v != described.name],
                "optimise": has_problem,
                "design_variants": [v for v in designs if v != problem],
            }
        )
    _print(as_json, {"problems": rows}, lambda: console.problems(rows))


@app.command()
def init(
    folder: Annotated[Path, typer.Argument(help="folder for the machine.toml, made if it does not exist")] = Path(),
    kind: Annotated[
        str, typer.Option(help="steel: a steel shaft; composite: a laminated tube; both on magnets")
    ] = "steel",
) -> None:
    """Write a commented machine file to start from. It never replaces one."""
    from .spec.templates import start

    file = start(folder, kind)
    typer.echo(f"{file} is written. Now: amb-design check {folder}")


@app.command()
def check(target: Target, variant: Variant = None, as_json: Json = False) -> None:
    """Read a machine file and say in words what it describes."""
    from .analysis.outline import outline
    from .console import check as console

    documents = {name: outline(machine) for name, machine in _machines(target, variant).items()}
    _print(as_json, _nested(documents), lambda: console.outlines(documents))


@app.command()
def analyse(
    target: Target,
    variant: Variant = None,
    out: Annotated[Path | None, typer.Option(help="folder for report.html, figures and analysis.json")] = None,
    workers: Annotated[int, typer.Option(min=1, help="processes for the variants")] = min(2, os.cpu_count() or 1),
    svg: Annotated[bool, typer.Option("--svg", help="write figures as SVG too")] = False,
    as_json: Json = False,
) -> None:
    """Critical speeds, damping, stability limit and warnings of a machine and its variants.

    Of more than three variants only the main figures are drawn; name one with --variant for all.
    """
    from .analysis.published import compare, published_figures
    from .console import analyse as console
    from .spec.files import resolve

    machines, file = _machines(target, variant), resolve(target)
    figures = published_figures(file.parent)
    _check_folder(out)
    with _staging(out) as folder:
        accounts = _analysed(machines, folder, workers, ("png", "svg") if svg else ("png",))
        documents = {name: a if folder is None else a.document for name, a in accounts.items()}
        comparisons = compare(figures, documents)
        document = _nested(documents)
        document["published"] = [console.comparison_row(c) for c in comparisons]
        if folder is not None:
            text = json.dumps(document, indent=2, allow_nan=False)
            (folder / "analysis.json").write_text(text + "\n", encoding="utf-8")
            from .report.analysis import analysis_page

            _report(folder, analysis_page(accounts, comparisons, date=_today(), inputs=_inputs(file)))
    _print(as_json, document, lambda: console.analyses(documents, comparisons, out))


@app.command()
def optimise(
    target: Annotated[
        str,
        typer.Argument(
            help="problem file, folder with a problem.toml, or name of a packaged problem", autocompletion=_names
        ),
    ],
    variant: Annotated[str | None, typer.Option(help="a variant of the problem")] = None,
    out: Annotated[
        Path | None, typer.Option(help="folder for report.html, the design, figures and finished starts")
    ] = None,
    starts: Annotated[int, typer.Option(min=1, help="number of starts; the first begins at the machine as it is")] = 8,
    seed: Annotated[int, typer.Option(min=0, help="of the random starts")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="processes")] = min(2, os.cpu_count() or 1),
    resume: Annotated[
        bool, typer.Option("--resume", help="take finished starts from the folder given by --out")
    ] = False,
    begin: Annotated[
        str | None,
        typer.Option("--from", help="a machine, such as an earlier design.toml, that the first start begins at"),
    ] = None,
    relax: Annotated[bool, typer.Option("--relax", help="solve again with each active limit eased by 10 %")] = False,
    pareto: Annotated[
        list[str] | None, typer.Option(help="compromises with a quantity: 'bias_current=2:4.8:6', SI units")
    ] = None,
    svg: Annotated[bool, typer.Option("--svg", help="write figures as SVG too")] = False,
    as_json: Json = False,
) -> None:
    """Find the best design of a problem, and verify it on the full model."""
    from .console import optimise as console
    from .console.terminal import working
    from .optimise.answers import pareto as trade
    from .optimise.answers import relaxations
    from .optimise.report import document
    from .optimise.solve import solve
    from .spec.files import PROBLEM_FILE, load, locate, save
    from .spec.problem_files import load_problem

    problem = load_problem(target, variant)
    if begin is not None:
        problem = problem.starting_at(load(begin))
    fronts = dict(_front(text) for text in pareto or ())
    for quantity, bounds in fronts.items():
        problem.with_limit(quantity, bounds[0])  # says at once what is wrong with it
    _check_folder(out)
    if resume and out is None:
        raise SpecError("needs the folder of the starts", field="--resume", remedy="add --out FOLDER")
    with console.progress(starts, problem.objective.kind.unit) as report:
        folder = None if out is None else out / "starts"
        design = solve(problem, starts, seed, workers=workers, folder=folder, resume=resume, report=report)
    with _staging(out) as staged, working("looking around the optimum"):
        relaxed = relaxations(design) if relax and design.verified else ()
        traded = {q: trade(design, q, b) for q, b in fronts.items()} if design.verified else {}
        result = document(design, relaxed, traded)
        if staged is not None:
            (staged / "design.json").write_text(json.dumps(result, indent=2, allow_nan=False) + "\n", encoding="utf-8")
            if design.verified:
                save(design.machine, staged / "design.toml")
                if design.best is not None and design.best.proof is not None:
                    design.best.proof.save(staged / "proof.json")
            from .report.design import design_page

            formats = ("png", "svg") if svg else ("png",)
            inputs = _inputs(locate(target, (PROBLEM_FILE,)))
            page = design_page(design, relaxed, traded, folder=staged, formats=formats, date=_today(), inputs=inputs)
            _report(staged, page)
    _print(as_json, result, lambda: console.design(result, out))
    if not design.verified:
        raise SolveError(f"{problem.name}: {design.status}: {design.explanation()}")


@app.command()
def simulate(
    target: Target,
    variant: Annotated[str | None, typer.Option(help="a variant of the file")] = None,
    optimum: Annotated[bool, typer.Option("--optimum", help="a problem's stored optimum instead of its start")] = False,
    duration: Annotated[str, typer.Option(help="'0.5 s'")] = "1 s",
    speed: Annotated[str | None, typer.Option(help="constant spin speed: '3000 rpm'")] = None,
    run_up: Annotated[
        tuple[str, str] | None, typer.Option(metavar="FROM TO", help="steady rise or fall: '0 rpm' '9000 rpm'")
    ] = None,
    modes: Annotated[int | None, typer.Option(help="keep the lowest modes of the rotor instead of all")] = None,
    step: Annotated[str | None, typer.Option(help="between outputs: '0.1 ms'")] = None,
    start: Annotated[
        str, typer.Option(help="centred, resting, levitated, or the simulation.npz of a run to be continued")
    ] = "levitated",
    contact: Annotated[
        bool, typer.Option("--contact", help="with backup bearings; goes without saying for a start at rest on them")
    ] = False,
    linear: Annotated[bool, typer.Option("--linear", help="linear magnets without limits")] = False,
    gravity: Annotated[bool, typer.Option("--gravity/--no-gravity", help="weight along -y, or none")] = True,
    sampling: Annotated[str | None, typer.Option(help="controllers sample with this period: '50 us'")] = None,
    delay: Annotated[str | None, typer.Option(help="from a sample to its effect: '50 us'; none if left out")] = None,
    method: Annotated[str | None, typer.Option(help="discretisation: tustin (if left out) or hold")] = None,
    out: Annotated[Path | None, typer.Option(help="folder for simulation.npz, simulation.json and figures")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="go on with the interrupted run in --out")] = False,
    svg: Annotated[bool, typer.Option("--svg", help="write figures as SVG too")] = False,
    as_json: Json = False,
) -> None:
    """Simulate a machine in time, with the force law, saturation and clearances of its magnets."""
    from .console import simulate as console
    from .console.terminal import working
    from .spec.files import load
    from .spec.problem_files import load_optimum
    from .spec.sampling import Sampling
    from .transient.report import document
    from .transient.result import load_transient
    from .transient.simulate import simulate as run

    _check_folder(out)
    if resume and out is None:
        raise SpecError("needs the folder of the run", field="--resume", remedy="add --out FOLDER")
    for option, given in (("--delay", delay), ("--method", method)):
        if sampling is None and given is not None:
            raise SpecError("needs a sampling period", field=option, got=given, remedy="add --sampling '50 us'")
    machine = load_optimum(target, variant) if optimum else load(target, variant)
    state = load_transient(start).final if start.endswith(".npz") else start
    seconds = _quantity(duration, "s", "--duration")
    origin = 0.0 if isinstance(state, str) else state.time
    chunks = None if out is None else out / "chunks"
    with console.progress() as report:
        result = run(
            machine,
            seconds,
            speed=_spin(speed, run_up, origin, seconds),
            modes=modes,
            step=None if step is None else _quantity(step, "s", "--step"),
            start=state,
            contact=contact or state == "resting",
            linear=linear,
            gravity=gravity,
            sampling=None
            if sampling is None
            else Sampling(
                period=_quantity(sampling, "s", "--sampling"),
                delay=_quantity(delay or "0", "s", "--delay"),
                method=method or "tustin",
            ),
            path=chunks,
            resume=resume,
            progress=report,
        )
    summary = document(result)
    with _staging(out) as staged, working("drawing"):
        if staged is not None:
            from .report.simulation_figures import save_simulation_figures

            result.save(staged / "simulation.npz")
            text = json.dumps(summary, indent=2, allow_nan=False)
            (staged / "simulation.json").write_text(text + "\n", encoding="utf-8")
            save_simulation_figures(result, staged, ("png", "svg") if svg else ("png",))
    if chunks is not None:
        shutil.rmtree(chunks)  # all of it is in simulation.npz now
    _print(as_json, summary, lambda: console.simulation(summary, out))


@app.command()
def compare(
    targets: Annotated[
        list[str],
        typer.Argument(
            help="comparison file, folder with a comparison.toml, or name of a packaged problem that has one; or two or more "
            "machines, as other commands take them, under conditions chosen from them"
        ),
    ],
    variant: Annotated[str | None, typer.Option(help="a variant of the comparison")] = None,
    optimum: Annotated[
        bool, typer.Option("--optimum", help="of problems among several targets their stored optimum")
    ] = False,
    speed: Annotated[str | None, typer.Option(help="end of the operating range: '9000 rpm'")] = None,
    samples: Annotated[int | None, typer.Option(min=0, help="random machines within the tolerances")] = None,
    out: Annotated[Path | None, typer.Option(help="folder for report.html, figures and comparison.json")] = None,
    svg: Annotated[bool, typer.Option("--svg", help="write figures as SVG too")] = False,
    as_json: Json = False,
) -> None:
    """Set designs side by side under the same conditions, and mark the better entry of each line."""
    from .comparison.compare import compare as run
    from .console import compare as console
    from .spec.comparison_files import COMPARISON_FILE
    from .spec.files import locate
    from .units import parse_quantity

    if out is not None and out.exists() and not out.is_dir():
        raise SpecError("is a file", field="--out", got=str(out), remedy="name a folder")
    try:
        given = {"speed": None if speed is None else parse_quantity(speed, "rad/s"), "samples": samples}
    except SpecError as error:
        raise error.inside("--speed") from None
    asked = _compared(targets, variant, optimum)
    conditions = dataclasses.replace(asked.conditions, **{k: v for k, v in given.items() if v is not None})
    asked = dataclasses.replace(asked, conditions=conditions)
    with console.progress() as tell:
        table = run(asked, progress=tell)
        document = table.document()
        with _staging(out) as folder:
            if folder is not None:
                from .report.comparison import comparison_page

                tell("drawing")
                text = json.dumps(document, indent=2, allow_nan=False)
                (folder / "comparison.json").write_text(text + "\n", encoding="utf-8")
                formats = ("png", "svg") if svg else ("png",)
                inputs = _inputs(locate(targets[0], (COMPARISON_FILE,)) if len(targets) == 1 else None)
                _report(folder, comparison_page(table, folder=folder, formats=formats, date=_today(), inputs=inputs))
    _print(as_json, document, lambda: console.comparison(document, out))


def _compared(targets: list[str], variant: str | None, optimum: bool) -> Any:
    """What the command line asks to compare."""
    from .spec.comparison import Comparison, Conditions
    from .spec.comparison_files import COMPARISON_FILE, design_time, load_comparison
    from .spec.files import load, locate, resolve
    from .spec.problem_files import has_optimum, load_optimum

    if len(targets) == 1:
        if optimum:
            raise SpecError(
                "needs several targets", field="--optimum", remedy="name the optimum in the comparison file"
            )
        try:
            locate(targets[0], (COMPARISON_FILE,))
        except SpecError as error:
            remedy = "write one, or name two or more machines"
            raise SpecError(error.problem, field=error.field, got=error.got, remedy=remedy) from None
        return load_comparison(targets[0], variant)
    if variant is not None:
        raise SpecError(
            "belongs to a comparison file", field="--variant", got=variant, remedy="write one, or name files alone"
        )
    designs, seconds = {}, {}
    for target in targets:
        machine = load_optimum(target) if optimum and has_optimum(target) else load(target)
        name = Path(target).name if machine.name in designs else machine.name
        if name in designs:
            raise SpecError("is named twice", field=target, got=name, remedy="write a comparison file with names")
        designs[name] = machine
        spent = design_time(resolve(target))
        if spent is not None:
            seconds[name] = spent
    return Comparison("comparison", designs, Conditions(), seconds)


@app.command()
def prove(
    target: Target,
    variant: Annotated[str | None, typer.Option(help="a variant of the file")] = None,
    optimum: Annotated[
        bool, typer.Option("--optimum", help="of a problem's stored optimum instead of its start")
    ] = False,
    out: Annotated[Path | None, typer.Option(help="certificate to write, a .json file; matrices go beside it")] = None,
    damping: Annotated[float | None, typer.Option(help="prove damping ratios above this one")] = None,
    sensitivity: Annotated[float | None, typer.Option(help="prove sensitivities below this one")] = None,
    within: Annotated[
        list[str] | None, typer.Option(help="prove it with tolerances: 'magnets.current_stiffness=5 %'")
    ] = None,
    up_to: Annotated[str | None, typer.Option(help="speed up to which all this must hold: '9000 rpm'")] = None,
    as_json: Json = False,
) -> None:
    """Prove the stability limit of a machine, with a certificate that anybody can check."""
    from .console import prove as console
    from .console.terminal import working
    from .proof.claims import prove_stability_limit
    from .spec.files import load
    from .spec.problem_files import load_optimum

    if out is not None and out.suffix != ".json":
        raise SpecError("is no .json file", field="--out", got=str(out), remedy="name the certificate so")
    machine = load_optimum(target, variant) if optimum else load(target, variant)
    speed = None if up_to is None else _quantity(up_to, "rad/s", "--up-to")
    tolerances = dict(_tolerance(text) for text in within or ())
    with working("proving"):
        proof = prove_stability_limit(
            machine, damping_ratio=damping, sensitivity_peak=sensitivity, up_to=speed, within=tolerances
        )
    if out is not None:
        proof.save(out)
    document = {"name": machine.name, **proof.document()}
    _print(as_json, document, lambda: console.proof(document, out))


@app.command(name="check-proof")
def check_saved_proof(
    file: Annotated[Path, typer.Argument(help="certificate; its matrices lie beside it")],
    machine: Annotated[
        str | None, typer.Option(help="machine whose matrices, made anew, must be those of the certificate")
    ] = None,
    variant: Annotated[str | None, typer.Option(help="a variant of that machine")] = None,
    as_json: Json = False,
) -> None:
    """Check a certificate."""
    from .console import prove as console
    from .proof.claims import check_proof
    from .spec.files import load

    statements = check_proof(file, None if machine is None else load(machine, variant))
    _print(as_json, {"proven": statements}, lambda: console.checked(statements))


@app.command()
def export(
    target: Target,
    to: Annotated[str, typer.Option(help="control, c, fmu, mat or ross")],
    out: Annotated[Path, typer.Option(help="folder for the files")],
    variant: Annotated[str | None, typer.Option(help="a variant of the file")] = None,
    optimum: Annotated[
        bool, typer.Option("--optimum", help="of a problem's stored optimum instead of its start")
    ] = False,
    speed: Annotated[str, typer.Option(help="spin speed: '9000 rpm'")] = "0 rpm",
    period: Annotated[str, typer.Option(help="sampling period of controllers: '50 us'")] = "50 us",
    method: Annotated[str, typer.Option(help="discretisation of controllers: tustin or hold")] = "tustin",
    modes: Annotated[int, typer.Option(min=1, help="lowest modes that are kept, in each plane")] = 8,
    as_json: Json = False,
) -> None:
    """Write a machine for another program: state spaces, C code, FMI units, MATLAB files, a rotor of ROSS."""
    from .console.export import export as write
    from .console.terminal import working
    from .spec.files import load
    from .spec.problem_files import load_optimum
    from .spec.sampling import Sampling

    machine = load_optimum(target, variant) if optimum else load(target, variant)
    if out.exists() and not out.is_dir():
        raise SpecError("is a file", field="--out", got=str(out), remedy="name a folder")
    spin, sampling = (
        _quantity(speed, "rad/s", "--speed"),
        Sampling(period=_quantity(period, "s", "--period"), method=method),
    )
    with _staging(out) as folder, working("exporting"):
        assert folder is not None
        files = write(machine, to, folder, spin, sampling, modes)
    document = {"name": machine.name, "to": to, "files": [str(out / f) for f in files]}
    _print(as_json, document, lambda: typer.echo("\n".join(document["files"])))


def _spin(speed: str | None, run_up: tuple[str, str] | None, start: float, duration: float) -> Any:
    """Spin speed as `simulate` wants it."""
    if (speed is None) == (run_up is None):
        raise SpecError(
            "exclude each other, and one of them is needed",
            field="--speed and --run-up",
            remedy="write --speed '3000 rpm', or --run-up '0 rpm' '9000 rpm'",
        )
    if speed is not None:
        return _quantity(speed, "rad/s", "--speed")
    return [start, start + duration], [_quantity(text, "rad/s", "--run-up") for text in run_up or ()]


def _quantity(text: str, unit: str, option: str) -> float:
    """A number with a unit, in SI."""
    from .units import parse_quantity

    try:
        return parse_quantity(text, unit)
    except SpecError as error:
        raise error.inside(option) from None


def _tolerance(text: str) -> tuple[str, float]:
    """A path and its tolerance from ``path=5 %`` or ``path=0.05``."""
    path, _, number = text.partition("=")
    try:
        factor = 0.01 if number.rstrip().endswith("%") else 1.0
        return path.strip(), factor * float(number.rstrip().rstrip("%"))
    except ValueError:
        raise SpecError(
            "is no tolerance", field="--within", got=text, remedy="write 'magnets.current_stiffness=5 %'"
        ) from None


def _front(text: str) -> tuple[str, list[float]]:
    """A quantity and its limits from ``quantity=first:last:count``."""
    quantity, _, numbers = text.partition("=")
    try:
        first, last, count = numbers.split(":")
        return quantity, np.linspace(float(first), float(last), int(count)).tolist()
    except ValueError:
        raise SpecError(
            "is no range of limits", field="--pareto", got=text, remedy="write quantity=first:last:count in SI units"
        ) from None


def _machines(target: str, variant: str | None) -> dict[str, Any]:
    """The variants of a file by name, with the machine itself under the empty name unless it is one of them."""
    from .spec.files import load, load_variants
    from .spec.paths import replace

    if variant is not None:
        return {variant: load(target, variant)}
    base = load(target)
    variants = {n: m for n, m in load_variants(target).items() if n != base.name}
    if any(replace(base, {"name": m.name}) == m for m in variants.values()):
        return variants
    return {"": base, **variants}


def _analysed(machines: dict[str, Any], folder: Path | None, workers: int, formats: tuple[str, ...]) -> dict[str, Any]:
    """Analyses by variant, computed side by side where there are many, with progress on standard error.

    Documents, or with a folder for figures all that a report tells.
    """
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    from .console.analyse import progress

    single, many = len(machines) == 1, len(machines) > 3
    jobs = {
        name: (
            machine,
            folder if folder is None or single else folder / name,
            formats,
            many,
            "" if single else f"v{k}-",
        )
        for k, (name, machine) in enumerate(machines.items())
    }
    done: dict[str, Any] = {}
    with progress(len(jobs)) as advance:
        if min(workers, len(jobs)) == 1 or len(jobs) < 3:
            for name, job in jobs.items():
                done[name] = _analyse_one(*job)
                advance(name)
        else:
            with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
                futures = {pool.submit(_analyse_one, *job): name for name, job in jobs.items()}
                for future in as_completed(futures):
                    done[futures[future]] = future.result()
                    advance(futures[future])
    return {name: done[name] for name in machines}


def _analyse_one(machine: Any, folder: Path | None, formats: tuple[str, ...], main_only: bool, prefix: str) -> Any:
    from .analysis.summary import analyse as run

    analysis = run(machine)
    if folder is None:
        return analysis.document()
    from .report.analysis import account

    return account(analysis, folder, formats, main_only=main_only, prefix=prefix)


def _report(folder: Path, page: Any) -> None:
    from .report.render import html

    (folder / "report.html").write_text(html(page), encoding="utf-8")


def _inputs(file: Path | None = None) -> dict[str, str]:
    """The file that was read, with its fingerprint, and the command line."""
    from .report.provenance import fingerprint

    read = {} if file is None else {"Input": f"{file}, SHA-256 {fingerprint(file.read_bytes())}"}
    return {**read, "Command": " ".join(["amb-design", *sys.argv[1:]])}


def _today() -> str:
    """The day that a report tells; the only place where the clock is read for a result."""
    return datetime.date.today().isoformat()


def _check_folder(out: Path | None) -> None:
    if out is not None and out.exists() and not out.is_dir():
        raise SpecError("is a file", field="--out", got=str(out), remedy="name a folder")
    if out is not None and not out.resolve().parent.is_dir():
        parent = str(out.resolve().parent)
        raise SpecError("does not exist", field="--out", got=parent, remedy="create the parent folder first")


@contextmanager
def _staging(out: Path | None) -> Iterator[Path | None]:
    """A temporary folder whose content moves to `out` only if all went well."""
    if out is None:
        yield None
        return
    try:
        with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.resolve().parent) as temporary:
            folder = Path(temporary)
            yield folder
            for file in sorted(p for p in folder.rglob("*") if p.is_file()):
                target = out / file.relative_to(folder)
                target.parent.mkdir(parents=True, exist_ok=True)
                os.replace(file, target)
    except OSError as error:
        raise SpecError(
            f"cannot be written ({error.strerror or error})", field="--out", got=str(out), remedy="name another folder"
        ) from None


def _nested(documents: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """One document: the machine's own keys, and those of its variants under ``variants``."""
    out = dict(documents.get("", {}))
    variants = {name: d for name, d in documents.items() if name}
    if variants:
        out["variants"] = variants
    return out


def _print(as_json: bool, document: dict[str, Any], table: Callable[[], None]) -> None:
    if as_json:
        typer.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        table()


def main() -> NoReturn:
    """Entry point: run a command and turn errors into one sentence and an exit status."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # one BLAS thread inside, processes outside
    try:
        app()
    except AmbDesignError as error:
        typer.echo(f"amb-design: {error}", err=True)
        sys.exit(3 if isinstance(error, SolveError) else 2)
    except (ArithmeticError, RuntimeError, np.linalg.LinAlgError) as error:  # a solver met numbers it cannot bear
        typer.echo(f"amb-design: the solution failed: {error}; check the machine for extreme numbers", err=True)
        sys.exit(3)
    except BrokenPipeError:  # the reader of our output has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    sys.exit(0)
