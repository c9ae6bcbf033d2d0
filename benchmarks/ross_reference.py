"""Reference timings and results of ROSS on a two-disk rotor.

The rotor is the one of Friswell et al., "Dynamics of Rotating Machines",
example 5.9.1, with isotropic bearings. Three jobs are run with one BLAS thread:

* campbell: natural frequencies at 100 speeds from 0 to 4000 rpm,
* critical_speeds: ``run_critical_speed()`` with its default arguments,
* unbalance: synchronous response at 200 speeds from 0 to 4000 rpm.

Each measurement uses a new rotor object, because ROSS caches its results, and
counts CPU seconds of the job only; building the rotor is timed apart. The median
over the repeats is reported. The compilation that ROSS triggers at the first modal
analysis of a process (several seconds) is done before and reported as warm-up.

How to run, with an interpreter that has ROSS installed
(``pip install ross-rotordynamics==3.1.0``)::

    python benchmarks/ross_reference.py --elements 13 --repeat 3

One JSON document is printed on standard output; everything else that ROSS or its
dependencies print goes to standard error.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import gc
import json
import platform
import time
import warnings
from importlib.metadata import version

import numpy as np

RPM = np.pi / 30.0  # rad/s in one rpm
LATERAL_MODES = 8
CAMPBELL_FREQUENCIES = 10  # 8 lateral + 1 torsional mode, and one to spare
REPORTED_SPEEDS = [25, 41, 50, 100, 124, 150, 199]  # indices in the unbalance speeds


def mesh_thirds(elements):
    """Split the elements over the three 0.5 m thirds, so that disks get a node."""
    outer = round(elements / 3)
    return outer, elements - 2 * outer, outer


def build_rotor(rs, elements, damping):
    """Build the rotor; the damping of the bearings is in N s/m."""
    steel = rs.materials.steel  # E = 211 GPa, G = 81.2 GPa, rho = 7810 kg/m3
    left, middle, right = mesh_thirds(elements)
    lengths = [0.5 / n for n in (left, middle, right) for _ in range(n)]
    shaft = [rs.ShaftElement(length, 0.0, 0.05, material=steel) for length in lengths]
    disks = [
        rs.DiskElement.from_geometry(left, steel, 0.07, 0.05, 0.28),
        rs.DiskElement.from_geometry(left + middle, steel, 0.07, 0.05, 0.35),
    ]
    bearings = [rs.BearingElement(node, kxx=1e6, kyy=1e6, cxx=damping, cyy=damping) for node in (0, elements)]
    return rs.Rotor(shaft, disks, bearings)


def run_campbell(rotor, node):
    speeds = np.linspace(0.0, 4000.0, 100) * RPM
    return rotor.run_campbell(speeds, frequencies=CAMPBELL_FREQUENCIES)


def run_critical_speeds(rotor, node):
    return rotor.run_critical_speed()


def run_unbalance(rotor, node):
    speeds = np.linspace(0.0, 4000.0, 200) * RPM
    return rotor.run_unbalance_response(node, 1e-3, 0.0, speeds)


def lateral_hz(modal):
    """First lateral damped frequencies of a modal result, in rising order.

    A node has the freedoms x, y, z, alpha, beta, theta. Lateral, axial (z) and
    torsional (theta) motions are uncoupled in this rotor, so a mode is lateral
    when x, y, alpha and beta hold most of the squared norm of its shape.
    """
    shapes = np.abs(modal.evectors[: modal.ndof, : len(modal.wd)]) ** 2
    by_freedom = shapes.reshape(-1, 6, len(modal.wd)).sum(axis=0)
    lateral = by_freedom[[0, 1, 3, 4]].sum(axis=0) > 0.5 * by_freedom.sum(axis=0)
    return np.sort(modal.wd[lateral] / (2.0 * np.pi))[:LATERAL_MODES].tolist()


def describe_campbell(result, node):
    modal = [result.modal_results[result.speed_range[i]] for i in (0, -1)]
    return {
        "lateral_hz_at_0_rpm": lateral_hz(modal[0]),
        "lateral_hz_at_4000_rpm": lateral_hz(modal[1]),
        "lateral_modes_identified_by": "share of x, y, alpha, beta in the mode shape",
    }


def describe_critical_speeds(result, node):
    """Separate the modes: ROSS gives a torsional one no whirl direction."""
    pairs = list(zip(result.wd("rpm").tolist(), map(str, result.whirl_direction), strict=True))
    return {
        "lateral": [{"rpm": s, "whirl": name} for s, name in pairs if name != "None"],
        "not_lateral_rpm": [s for s, name in pairs if name == "None"],
    }


def describe_unbalance(result, node):
    amplitude = np.abs(result.forced_resp[6 * node + 1])  # y at the first disk
    rpm = result.speed_range / RPM
    return {
        "all_finite": bool(np.isfinite(result.forced_resp).all()),
        "y_amplitude_at_disk_1": [{"rpm": float(rpm[i]), "m": float(amplitude[i])} for i in REPORTED_SPEEDS],
    }


JOBS = {  # name: (bearing damping, job, description of its result)
    "campbell": (0.0, run_campbell, describe_campbell),
    "critical_speeds": (0.0, run_critical_speeds, describe_critical_speeds),
    "unbalance": (100.0, run_unbalance, describe_unbalance),
}


def run_job(rs, name, elements, repeat):
    """Measure one job on new rotors and describe its result, or its failure."""
    damping, job, describe = JOBS[name]
    node = mesh_thirds(elements)[0]
    build, seconds, report = [], [], {"failed": None}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            for _ in range(repeat):
                rotor = result = None  # the results of ROSS are large: free the last
                gc.collect()
                start = time.process_time()
                rotor = build_rotor(rs, elements, damping)
                built = time.process_time()
                result = job(rotor, node)
                seconds.append(time.process_time() - built)
                build.append(built - start)
            report["seconds"] = float(np.median(seconds))
            report["seconds_all"] = seconds
            report["build_seconds"] = float(np.median(build))
            report["result"] = describe(result, node)
        except (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError) as e:
            report["failed"] = f"{type(e).__name__}: {e}"
    report["warnings"] = sorted({str(item.message) for item in caught})
    return report


def main():
    parser = argparse.ArgumentParser(description="Time ROSS on a two-disk rotor.")
    parser.add_argument("--elements", type=int, default=13)
    parser.add_argument("--repeat", type=int, default=3)
    args = parser.parse_args()
    if args.elements < 3 or args.repeat < 1:
        parser.error("--elements must be at least 3 and --repeat at least 1")

    # A dependency of ROSS writes to file descriptor 1 on import: keep the real
    # standard output for the JSON document and send the rest to standard error.
    output = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    import ross as rs

    try:
        from threadpoolctl import threadpool_limits
    except ImportError:
        pass  # the environment variables above already ask for one thread
    else:
        threadpool_limits(limits=1)

    start = time.process_time()
    build_rotor(rs, args.elements, 0.0).run_modal(0.0)
    warm_up = time.process_time() - start

    packages = ("ross-rotordynamics", "numpy", "scipy", "plotly")
    report = {
        "versions": {"python": platform.python_version()} | {name: version(name) for name in packages},
        "elements": args.elements,
        "elements_per_third": mesh_thirds(args.elements),
        "repeat": args.repeat,
        "time_unit": "CPU seconds, one BLAS thread, median over repeats",
        "warm_up_seconds": warm_up,
        "jobs": {name: run_job(rs, name, args.elements, args.repeat) for name in JOBS},
    }
    with output:
        json.dump(report, output, indent=2)
        output.write("\n")


if __name__ == "__main__":
    main()
