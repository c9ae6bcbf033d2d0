"""Side by side with ROSS on the two-disk rotor of Friswell et al., example 5.9.1, with isotropic bearings.

Three jobs, with objects made afresh for each repeat:

* campbell: 8 lateral modes at 100 speeds from 0 to 4000 rpm;
* critical_speeds: all up to 4000 rpm;
* unbalance: response to 1e-3 kg m on the first disk at 200 speeds from 0 to 4000 rpm, with 100 N s/m in the bearings.

ROSS runs with 13 and 50 elements; amb_design with as many or slightly more, and with the coarsest mesh whose first 8
lateral modes are within 1e-3 of a converged one, at rest and at 4000 rpm. The results are compared too. Run::

    python benchmarks/ross_comparison.py --ross-python PATH

where PATH is an interpreter with ROSS (``pip install ross-rotordynamics==3.1.0``, Python 3.13). Without it only the half
of amb_design is measured.
"""

import argparse
import json
import subprocess
from pathlib import Path

import numpy as np
from common import cpu_seconds, write

import amb_design as ad

TOP = ad.rpm(4000.0)
MODES = 8
ACCURACY = 1e-3
CONVERGED = 96
GOALS = {13: 20.0, 50: 100.0}


def machine(elements, job):
    """The rotor with at least so many elements, made from the packaged problem."""
    changes = {"rotor.shaft.elements": elements}
    if job == "unbalance":
        changes |= {"bearings.damping": 100.0, "rotor.disks[0].unbalance": 1e-3}
    return ad.replace(ad.load("friswell-5-9-1"), changes)


def elements_of(elements):
    """The number of elements that the mesh really has: each third of the shaft has a whole number."""
    return ad.system(machine(elements, "campbell")).plant.mesh.elements


def run_campbell(rotor):
    return ad.campbell(rotor, np.linspace(0.0, TOP, 100), modes=MODES, fast=True, critical=False)


def run_critical_speeds(rotor):
    return ad.critical_speeds(rotor, TOP)


def run_unbalance(rotor):
    return ad.unbalance_response(rotor, np.linspace(0.0, TOP, 200))


JOBS = {"campbell": run_campbell, "critical_speeds": run_critical_speeds, "unbalance": run_unbalance}


def lateral_hz(elements):
    """First 8 lateral frequencies at rest and at 4000 rpm, from the full model."""
    rotor = machine(elements, "campbell")
    return np.array([sorted(m.frequency_hz for m in ad.spectrum(rotor, speed, MODES)) for speed in (0.0, TOP)])


def deviation(values, reference):
    """Largest relative difference."""
    return float(np.max(np.abs(np.asarray(values) / np.asarray(reference) - 1.0)))


def coarsest():
    """Smallest mesh with the wanted accuracy."""
    converged = lateral_hz(CONVERGED)
    return next(n for n in range(3, CONVERGED, 3) if deviation(lateral_hz(n), converged) <= ACCURACY)


def ours(elements, repeat):
    """Seconds of the three jobs, and the error of the mesh."""
    seconds = {
        name: cpu_seconds(job, prepare=lambda name=name: (machine(elements, name),), repeat=repeat)
        for name, job in JOBS.items()
    }
    return {
        "elements": elements_of(elements),
        "mesh_error": deviation(lateral_hz(elements), lateral_hz(CONVERGED)),
        "seconds": seconds,
    }


def ross(python, elements, repeat):
    """The report of ross_reference.py."""
    script = Path(__file__).with_name("ross_reference.py")
    command = [python, str(script), "--elements", str(elements), "--repeat", str(repeat)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    return json.loads(done.stdout)


def agreement(report):
    """Largest relative differences between ROSS and amb_design on a converged mesh."""
    jobs = {name: job["result"] for name, job in report["jobs"].items()}
    frequencies = [jobs["campbell"][f"lateral_hz_at_{speed}_rpm"] for speed in (0, 4000)]
    critical = [c.speed_rpm for c in run_critical_speeds(machine(CONVERGED, "critical_speeds"))]
    theirs = sorted(c["rpm"] for c in jobs["critical_speeds"]["lateral"])[: len(critical)]
    rows = jobs["unbalance"]["y_amplitude_at_disk_1"]
    response = ad.unbalance_response(machine(CONVERGED, "unbalance"), ad.rpm(np.array([r["rpm"] for r in rows])))
    return {
        "lateral_modes": deviation(frequencies, lateral_hz(CONVERGED)),
        "critical_speeds": deviation(theirs, critical),
        "unbalance": deviation([r["m"] for r in rows], np.abs(response.at(0.5)[:, 0])),
    }


def main():
    parser = argparse.ArgumentParser(description="Compare amb_design with ROSS in time and results.")
    parser.add_argument("--ross-python", metavar="PATH", help="interpreter that has ROSS 3.1.0")
    parser.add_argument("--ross-repeat", type=int, default=3)
    parser.add_argument("--repeat", type=int, default=15)
    args = parser.parse_args()
    report = {"goals": GOALS, "coarsest": coarsest(), "sizes": {}}
    print("elements        job               ROSS   amb_design   ratio   coarsest   ratio   goal")
    for elements, goal in GOALS.items():
        size = report["sizes"][elements] = {
            "amb_design": ours(elements, args.repeat),
            "amb_design_coarsest": ours(report["coarsest"], args.repeat),
        }
        if args.ross_python:
            reference = ross(args.ross_python, elements, args.ross_repeat)
            size |= {"ross": reference, "agreement": agreement(reference)}
        for job in JOBS:
            same, coarse = (size[k]["seconds"][job] for k in ("amb_design", "amb_design_coarsest"))
            theirs = size["ross"]["jobs"][job]["seconds"] if args.ross_python else float("nan")
            print(
                f"{elements:2d} / {size['amb_design']['elements']:2d} / {report['coarsest']:2d}    {job:15s} {theirs:7.2f} s"
                f"  {same * 1e3:8.1f} ms {theirs / same:6.0f} {coarse * 1e3:8.1f} ms {theirs / coarse:6.0f} {goal:6.0f}"
            )
        if args.ross_python:
            print("             differences:", ", ".join(f"{k} {v:.1e}" for k, v in size["agreement"].items()))
    if not args.ross_python:
        print("ROSS was not run: give --ross-python PATH, an interpreter with ross-rotordynamics 3.1.0")
    else:
        write("ross_comparison", report)


if __name__ == "__main__":
    main()
