"""A process that runs a small design problem again and again, and kills it when it is told to.

One line of JSON in: folder, workers, seconds after which the run is killed (null: never). One line out: "killed" or "done". The
package is loaded once, each run is a fork, and with it the worker processes that it starts.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

import amb_design as ad
from amb_design.analysis import worst_speed
from amb_design.optimise import audit, start
from amb_design.optimise.solve import solve
from amb_design.optimise.start import Effort

if __name__ in ("__main__", "__mp_main__"):  # here and in the workers, but not in the tests
    audit.LOOPS, worst_speed.NET = np.array([0.0, 1.0]), 3  # it is the starts that count
    start.LOOKED_AT = 4

EFFORT = Effort(3, 2, 2)
STARTS, SEED = 6, 1


def small_problem(limit: float = 3.0) -> ad.DesignProblem:
    """A steel shaft with a disk on two magnets, and the three gains of their controller."""
    steel = ad.Isotropic(E=205e9, nu=0.29, density=7850)
    machine = ad.Machine(
        name="small",
        rotor=ad.Rotor(
            shaft=ad.Shaft(
                segments=(ad.Segment(length=0.6, outer_diameter=0.03, material=steel),),
                viscous_damping=2e-3,
                elements=3,
            ),
            disks=(ad.Disk(position=0.3, mass=6.0, diametral_inertia=0.01, polar_inertia=0.02),),
        ),
        magnets=tuple(ad.Magnet(position=x, current_stiffness=60.0, negative_stiffness=1e5) for x in (0.0, 0.6)),
        controller=ad.PID(kp=6e3, ki=2e4, kd=10.0, low_pass=ad.LowPass(frequency=12000.0)),
        operation=ad.Operation(top_speed=3000.0),
    )
    free = {
        "controller.kp": (2e3, 3e4, "log"),
        "controller.ki": (1e3, 1e5, "log"),
        "controller.kd": (2.0, 60.0, "log"),
    }
    return ad.DesignProblem(machine, maximise="stability_limit", free=free, limits={"sensitivity_peak": limit})


def run(folder: str, workers: int) -> None:
    """Solve the problem with what the folder has already, and leave the ranking there."""
    design = solve(small_problem(), STARTS, SEED, workers=workers, effort=EFFORT, folder=folder, resume=True)
    ranking = [o.document() for o in design.outcomes]
    for document in ranking:
        del document["cpu_seconds"]
    result = {"status": design.status, "values": dict(design.values), "objective": design.objective, "ranking": ranking}
    (Path(folder) / "result.json").write_text(json.dumps(result))


def fork(folder: str, workers: int, seconds: float | None) -> str:
    """Run in a process group of its own, perhaps not to the end."""
    child = os.fork()
    if child == 0:
        os.setpgid(0, 0)
        try:
            run(folder, workers)
        except BaseException as error:
            print(repr(error), file=sys.stderr)
            os._exit(1)
        os._exit(0)
    until = time.monotonic() + (600.0 if seconds is None else seconds)
    while time.monotonic() < until:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return "done" if status == 0 else "failed"
        time.sleep(0.01)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return "killed"


if __name__ == "__main__":
    for line in sys.stdin:
        print(fork(*json.loads(line)), flush=True)
