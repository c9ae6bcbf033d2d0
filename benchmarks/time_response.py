"""One second of a magnetically levitated rotor at 3000 rpm, beside ROSS; and what nonlinear runs cost.

The rotor is that of `ross_time_response.py`: two disks, two magnets, unbalance and weight at once. ROSS knows linear magnets
only, so the comparison is one of linear motion: orbits of both disks, against amb_design on a mesh four times as fine. The errors
are the largest deviation at any millisecond over the largest displacement.

Beside it, without ROSS: the same second with the force law and limits of the magnets; the composite spindle, full and reduced,
with a continuous and with a sampled controller; its run-up of 10 s with so much unbalance that the currents saturate; and run-ups of the
thesis rotor through its first critical speed, saturated too, with PID, LQG and an LQG that follows the speed. Run::

    python benchmarks/time_response.py --ross-python PATH

where PATH is an interpreter with ROSS (``pip install ross-rotordynamics==3.1.0``, Python 3.13).
"""

import argparse
import json
import math
import subprocess
import time
from functools import partial
from pathlib import Path

import numpy as np
from common import RESULTS, cpu_seconds, write

import amb_design as ad

SPEED = ad.rpm(3000.0)
OUTPUT = 1e-4
DISKS = ((0.2, 2e-5, 0.0), (0.45, 1e-5, 1.0))
MAGNETS = (0.05, 0.55)
RUNS = ("newmark:1e-4", "newmark:2.5e-5", "newmark:1e-5", "modal:1e-4", "modal-24:1e-4")
HANGING = {"start": "centred", "gravity": False}
GOALS = {"newmark": 100.0, "modal": 5.0}


def rotor(elements=12):
    """The rotor of `ross_time_response.py`."""
    steel = ad.Isotropic(E=211e9, nu=0.3, density=7860)
    disks = [
        ad.Disk(position=x, mass=4.0, diametral_inertia=0.01, polar_inertia=0.018, unbalance=u, unbalance_phase=phase)
        for x, u, phase in DISKS
    ]
    sleeves = [ad.Disk(position=x, mass=1.5, diametral_inertia=0.001, polar_inertia=0.0015) for x in MAGNETS]
    pair = {"turns": 120, "pole_area": 5e-4, "half_angle": math.radians(22.5), "gap": 5e-4, "bias_current": 3.0}
    shaft = ad.Shaft(segments=(ad.Segment(length=0.6, outer_diameter=0.03, material=steel),), elements=elements)
    return ad.Machine(
        name="levitated rotor",
        rotor=ad.Rotor(shaft=shaft, disks=(*disks, *sleeves)),
        bearings=tuple(ad.Bearing(position=x, stiffness=0.0, damping=100.0) for x in (0.0, 0.2, 0.45, 0.6)),
        magnets=tuple(ad.Magnet(position=x, **pair) for x in MAGNETS),
        controller=ad.PID(
            kp=12000.0,
            ki=60000.0,
            kd=15.0,
            low_pass=ad.LowPass(frequency=3e4, damping=0.7),
            amplifier=ad.Amplifier(bandwidth=3e4),
        ),
        operation=ad.Operation(top_speed=1000.0),
    )


def second(machine, **options):
    return ad.simulate(machine, 1.0, speed=SPEED, **options)


def orbits(result):
    """Displacements of both disks at every millisecond, shape (1001, 4)."""
    every = round(1e-3 / (result.times[1] - result.times[0]))
    return np.hstack([result.at(x)[::every] for x, _, _ in DISKS])


def error(found, reference):
    return float(np.abs(found - reference).max() / np.abs(reference).max())


def ours(repeat, reference):
    """Seconds and errors of the closed form: full, with as many elements as there are stations, and with 12 modes."""
    found = {}
    cases = {"full": (12, {}), "full, coarsest mesh": (1, {}), "12 modes": (12, {"modes": 12})}
    for name, (elements, options) in cases.items():
        options = {"linear": True, "step": OUTPUT, **options}
        result = second(rotor(elements), **options)
        found[name] = {
            "seconds": cpu_seconds(
                lambda m, o=options: second(m, **o), prepare=lambda n=elements: (rotor(n),), repeat=repeat
            ),
            "elements": len(result.positions) // 2,
            "coordinates": result.coordinates.shape[1],
            "outputs": len(result.times),
            "error": error(orbits(result), reference),
            "energy_error": float(np.abs(result.energy_error).max()),
        }
    return found


def ross(python, repeat, reference):
    """Seconds and errors of ROSS."""
    script = Path(__file__).with_name("ross_time_response.py")
    command = [python, str(script), "--repeat", str(repeat), "--runs", *RUNS]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    report = json.loads(done.stdout)
    for run in report["runs"]:
        if run["failed"] is None:
            found = np.array([axis for node in run.pop("orbits").values() for axis in node]).T
            run["error"] = error(found, reference)
    return report


def nonlinear(repeat):
    """Seconds of simulated machines with the force law, and their energy balances."""
    spindle = ad.load("composite-spindle")
    disks = enumerate(spindle.rotor.disks)
    rough = ad.replace(spindle, {f"rotor.disks[{k}].unbalance": 160.0 * d.unbalance for k, d in disks})
    sampled = {"sampling": ad.Sampling(period=5e-5, delay=5e-5)}
    jobs = {
        "levitated rotor, 1 s, full": (rotor(), 1.0, SPEED, {}),
        "levitated rotor, 1 s, 12 modes": (rotor(), 1.0, SPEED, {"modes": 12}),
        "composite spindle, 1 s, full": (spindle, 1.0, SPEED, {}),
        "composite spindle, 1 s, 12 modes": (spindle, 1.0, SPEED, {"modes": 12}),
        "composite spindle, 1 s, 12 modes, IDAS": (spindle, 1.0, SPEED, {"modes": 12, "integrator": "idas"}),
        "composite spindle, 1 s, 12 modes, sampled": (spindle, 1.0, SPEED, {"modes": 12, **sampled}),
        "composite spindle, run-up of 10 s to 6000 rpm, 12 modes": (
            rough,
            10.0,
            ([0.0, 10.0], [0.0, ad.rpm(6000.0)]),
            {"modes": 12},
        ),
    }
    up = ([0.0, 1.0], [ad.rpm(2000.0), ad.rpm(4500.0)])
    for law, variant in (("PID", None), ("LQG", "lqg"), ("LQG, scheduled", "scheduled")):
        design = ad.replace(ad.load_optimum("thesis-pid-vs-lqg", variant), {"rotor.disks.unbalance": 3e-4})
        for modes in (12, None):
            size = "full" if modes is None else f"{modes} modes"
            jobs[f"thesis rotor, {law}, run-up of 1 s, {size}"] = (design, 1.0, up, {"modes": modes, **HANGING})
        jobs[f"thesis rotor, {law}, run-up of 1 s, 12 modes, sampled"] = (
            design,
            1.0,
            up,
            {"modes": 12, **sampled, **HANGING},
        )
    found = {}
    for name, (machine, duration, speed, options) in jobs.items():
        run = partial(ad.simulate, machine, duration, speed=speed, **{"start": "levitated", **options})
        if duration > 1.0 or "run-up" in name:  # too long to be repeated
            start = time.process_time()
            result = run()
            seconds = time.process_time() - start
        else:
            result, seconds = run(), cpu_seconds(run, repeat=repeat)
        found[name] = {
            "seconds": seconds,
            "coordinates": result.coordinates.shape[1],
            "outputs": len(result.times),
            "energy_error": float(np.abs(result.energy_error).max()),
            "met": sorted({s.kind for s in result.saturations}),
        }
        print(
            f"{name:58s} {seconds:8.2f} s   energy {found[name]['energy_error']:.1e}   {', '.join(found[name]['met'])}"
        )
    return found


def main():
    parser = argparse.ArgumentParser(description="Time responses, beside those of ROSS.")
    parser.add_argument("--ross-python", metavar="PATH", help="interpreter that has ROSS 3.1.0")
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--ross-repeat", type=int, default=3)
    parser.add_argument("--nonlinear", action="store_true", help="these runs alone; other stored results stay")
    args = parser.parse_args()
    if args.nonlinear:
        stored = json.loads((RESULTS / "time_response.json").read_text())
        write("time_response", {**stored, "nonlinear": nonlinear(max(1, args.repeat // 3))})
        return
    reference = orbits(second(rotor(48), linear=True, step=1e-3))
    report = {"goals": GOALS, "linear": ours(args.repeat, reference)}
    for name, run in report["linear"].items():
        print(f"amb_design, {name:12s} {run['seconds'] * 1e3:8.1f} ms   error {run['error']:.1e}")
    if args.ross_python:
        report["ross"] = ross(args.ross_python, args.ross_repeat, reference)
        for run in report["ross"]["runs"]:
            name = f"ROSS, {run['method']}, step {run['step']:g} s"
            if run["failed"] is not None:
                print(f"{name:34s} {run['failed']}")
                continue
            run["ratios"] = {k: run["seconds"] / o["seconds"] for k, o in report["linear"].items()}
            ratios = "   ".join(f"{v:.0f} times {k}" for k, v in run["ratios"].items())
            print(f"{name:34s} {run['seconds']:8.2f} s   error {run['error']:.1e}   {ratios}")
    report["nonlinear"] = nonlinear(max(1, args.repeat // 3))
    if args.ross_python:
        write("time_response", report)
    else:
        print("ROSS was not run: give --ross-python PATH, an interpreter with ross-rotordynamics 3.1.0")


if __name__ == "__main__":
    main()
