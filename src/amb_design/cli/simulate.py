"""A machine in time."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import SpecError
from .arguments import Json, Optimum, Svg, Target, Variant, machine_of, quantity
from .output import check_folder, formats, print_result, staging, write_json


def simulate(
    target: Target,
    variant: Variant = None,
    optimum: Optimum = False,
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
    svg: Svg = False,
    as_json: Json = False,
) -> None:
    """Simulate a machine in time, with the force law, saturation and clearances of its magnets."""
    from ..console import simulate as console
    from ..console.terminal import working
    from ..transient.report import document
    from ..transient.result import load_transient
    from ..transient.simulate import simulate as run

    check_folder(out)
    if resume and out is None:
        raise SpecError("needs the folder of the run", field="--resume", remedy="add --out FOLDER")
    sampled = _sampled(sampling, delay, method)
    machine = machine_of(target, variant, optimum)
    state = load_transient(start).final if start.endswith(".npz") else start
    seconds = quantity(duration, "s", "--duration")
    origin = 0.0 if isinstance(state, str) else state.time
    chunks = None if out is None else out / "chunks"
    with console.progress() as report:
        result = run(
            machine,
            seconds,
            speed=_spin(speed, run_up, origin, seconds),
            modes=modes,
            step=None if step is None else quantity(step, "s", "--step"),
            start=state,
            contact=contact or state == "resting",
            linear=linear,
            gravity=gravity,
            sampling=sampled,
            path=chunks,
            resume=resume,
            progress=report,
        )
    summary = document(result)
    with staging(out) as staged, working("drawing"):
        if staged is not None:
            from ..report.simulation_figures import save_simulation_figures

            result.save(staged / "simulation.npz")
            write_json(staged / "simulation.json", summary)
            save_simulation_figures(result, staged, formats(svg))
    if chunks is not None:
        shutil.rmtree(chunks)  # all of it is in simulation.npz now
    print_result(as_json, summary, lambda: console.simulation(summary, out))


def _sampled(period: str | None, delay: str | None, method: str | None) -> Any:
    """Sampling as `simulate` wants it."""
    from ..spec.sampling import Sampling

    if period is not None:
        return Sampling(
            period=quantity(period, "s", "--sampling"),
            delay=quantity(delay or "0", "s", "--delay"),
            method=method or "tustin",
        )
    for option, given in (("--delay", delay), ("--method", method)):
        if given is not None:
            raise SpecError("needs a sampling period", field=option, got=given, remedy="add --sampling '50 us'")
    return None


def _spin(speed: str | None, run_up: tuple[str, str] | None, start: float, duration: float) -> Any:
    """Spin speed as `simulate` wants it."""
    if (speed is None) == (run_up is None):
        raise SpecError(
            "exclude each other, and one of them is needed",
            field="--speed and --run-up",
            remedy="write --speed '3000 rpm', or --run-up '0 rpm' '9000 rpm'",
        )
    if speed is not None:
        return quantity(speed, "rad/s", "--speed")
    return [start, start + duration], [quantity(text, "rad/s", "--run-up") for text in run_up or ()]
