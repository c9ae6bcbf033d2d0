"""Simulations as text and tables on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from .terminal import terminal

MET = {
    "current": "current limit",
    "voltage": "voltage limit",
    "flux": "flux saturation",
    "contact": "contact with the backup bearing",
    "clearance": "beyond the clearance",
}


@contextmanager
def progress() -> Iterator[Callable[[float], None]]:
    """Progress bar on standard error, where that is a terminal.

    Yields
    ------
    callable
        To be called with the fraction of the run that is done.
    """
    console = Console(stderr=True)
    columns = (BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    bar = Progress(
        TextColumn("{task.description}"), *columns, console=console, transient=True, disable=not console.is_terminal
    )
    with bar:
        task = bar.add_task("simulating", total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


def simulation(d: Mapping[str, Any], out: Path | None) -> None:
    """Print where a run went and what it met.

    Parameters
    ----------
    d : mapping
        From `amb_design.transient.report.document`.
    out : Path or None
        Where results were written.
    """
    console = terminal()
    first, last = d["speed_rpm"]
    speed = f"at {first:.0f} rpm" if first == last else f"from {first:.0f} to {last:.0f} rpm"
    console.print(
        f"[bold]{escape(d['name'])}[/]: {d['start_s']:.6g} to {d['end_s']:.6g} s {speed}, {d['turns']:.4g} turns, "
        f"{d['coordinates']} coordinates"
    )
    if d["stopped"]:
        console.print(f"[bold]{escape(d['stopped'])}[/]", soft_wrap=True)
    if d["magnets"]:
        console.print(_magnets(d))
    if d["disks"]:
        table = Table("disk", title="Largest radius of the orbit", title_justify="left")
        table.add_column("at [m]", justify="right")
        table.add_column("[µm]", justify="right")
        for row in d["disks"]:
            table.add_row(
                escape(row["name"] or row["part"]), f"{row['position_m']:.4g}", f"{1e6 * row['radius_m']:.3g}"
            )
        console.print(table)
    for met in d["limits_met"]:
        console.print(
            f"- magnets[{met['magnet']}]: {MET[met['kind']]} first at {met['first_s']:.6g} s, {100.0 * met['share']:.3g} % "
            "of the time"
        )
    if d["magnets"] and not d["limits_met"]:
        console.print("No limit of the magnets was met, no clearance used up.")
    console.print(f"Energy: the works account for all but {d['energy_error']:.1g} of the gross work.")
    if out is not None:
        console.print(f"The run is in {out}/simulation.npz, this summary in simulation.json, figures beside them.")


def _magnets(d: Mapping[str, Any]) -> Table:
    table = Table("magnet", title="Largest values at the magnets", title_justify="left")
    for heading in (
        "at [m]",
        "radius [µm]",
        "of clearance",
        "current [A]",
        "of bias",
        "coil voltage [V]",
        "force [N]",
        "contact force [N]",
    ):
        table.add_column(heading, justify="right")
    for row in d["magnets"]:
        table.add_row(
            escape(row["name"] or row["part"]),
            f"{row['position_m']:.4g}",
            f"{1e6 * row['radius_m']:.3g}",
            _share(row["radius_m"], row["clearance_m"]),
            f"{row['current_a']:.3g}",
            _share(row["current_a"], row["bias_current_a"]),
            "" if row["voltage_v"] is None else f"{row['voltage_v']:.3g}",
            f"{row['force_n']:.3g}",
            f"{row['contact_force_n']:.3g}" if row["contact_force_n"] else "",
        )
    return table


def _share(value: float, whole: float | None) -> str:
    return "" if whole is None else f"{100.0 * value / whole:.3g} %"
