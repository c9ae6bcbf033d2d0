"""Time response of a magnetically levitated rotor in ROSS: Newmark's method, and the modal one that leaves out gyroscopic moments.

A steel shaft of 0.6 m and 30 mm with two disks of 4 kg, sleeves of 1.5 kg at both magnets and light dashpots; at rest in the centre
at first, then 3000 rpm with unbalance and weight at once. The controllers, with filters and amplifiers, are rational transfer
functions, which Newmark's method discretises with its own step (Tustin) and applies one step late.

ROSS 3.1.0 gives the magnets' stiffness k_s the sign of a spring in its time responses (``compute_amb_controller`` adds ks x with
ks < 0 to the force; the equivalent coefficients have it right). Springs of 2 ks beside the magnets make it negative, as it is.

How to run, with an interpreter that has ROSS (``pip install ross-rotordynamics==3.1.0``)::

    python benchmarks/ross_time_response.py --runs newmark:1e-4 modal:1e-4 modal-24:1e-4

One JSON document on standard output: for each run the CPU seconds, and orbits of the two disks at every millisecond.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"
os.environ["MKL_NUM_THREADS"] = "1"

import argparse
import contextlib
import gc
import json
import platform
import sys
import time
import warnings
from importlib.metadata import version

import numpy as np

SPEED = 100.0 * np.pi  # 3000 rpm
DURATION = 1.0
ELEMENTS = 12
DISKS = {4: (2e-5, 0.0), 9: (1e-5, 1.0)}  # node: unbalance [kg m] and its angle
MAGNETS = (1, 11)
DASHPOTS = (0, 4, 9, 12)
GRAVITY = 9.80665


def controller(ct):
    """Control current for a displacement [A/m]: low-pass, PID, amplifier."""
    s = ct.TransferFunction.s
    low_pass = 3e4**2 / (s**2 + 1.4 * 3e4 * s + 3e4**2)
    amplifier = 3e4**2 / (s**2 + np.sqrt(2.0) * 3e4 * s + 3e4**2)
    whole = low_pass * (12000.0 + 60000.0 / s + 15.0 * s) * amplifier
    return ct.TransferFunction(np.squeeze(whole.num), np.squeeze(whole.den))


def build_rotor(rs, ct):
    steel = rs.Material(name="steel", rho=7860, E=211e9, Poisson=0.3)
    shaft = [rs.ShaftElement(0.6 / ELEMENTS, 0.0, 0.03, material=steel) for _ in range(ELEMENTS)]
    disks = [rs.DiskElement(n, m=4.0, Id=0.01, Ip=0.018) for n in DISKS]
    disks += [rs.DiskElement(n, m=1.5, Id=0.001, Ip=0.0015) for n in MAGNETS]
    pair = {"g0": 5e-4, "i0": 3.0, "ag": 5e-4, "nw": 120, "alpha": np.deg2rad(22.5)}
    law = controller(ct)
    bearings = [rs.MagneticBearingElement(n, controller_transfer_function=law, tag=f"at {n}", **pair) for n in MAGNETS]
    bearings += [rs.BearingElement(n, kxx=0.0, cxx=100.0) for n in DASHPOTS]
    bearings += [rs.BearingElement(n, kxx=2.0 * float(bearings[0].ks), cxx=0.0) for n in MAGNETS]
    return rs.Rotor(shaft, disks, bearings)


def loads(rotor, t):
    """Weight along -x, and unbalance that turns from x to y."""
    force = np.zeros((len(t), rotor.ndof))
    along_x = np.zeros(rotor.ndof)
    along_x[0::6] = GRAVITY
    force -= rotor.M() @ along_x
    for node, (unbalance, angle) in DISKS.items():
        force[:, 6 * node] += unbalance * SPEED**2 * np.cos(SPEED * t + angle)
        force[:, 6 * node + 1] += unbalance * SPEED**2 * np.sin(SPEED * t + angle)
    return force


def options(method):
    """Arguments for one of newmark, newmark-N, modal, modal-N; N modes."""
    name, _, modes = method.partition("-")
    if name == "newmark":
        reduced = {"model_reduction": {"num_modes": int(modes)}} if modes else {}
        return {"method": "newmark", **reduced}
    return {"num_modes": int(modes)} if modes else {}


def run(rs, ct, method, step, repeat):
    seconds, report = [], {"method": method, "step": step, "failed": None}
    t = np.arange(round(DURATION / step) + 1) * step
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            for _ in range(repeat):
                rotor = build_rotor(rs, ct)
                force = loads(rotor, t)
                gc.collect()
                start = time.process_time()
                result = rotor.run_time_response(SPEED, force, t, **options(method))
                seconds.append(time.process_time() - start)
        except (ArithmeticError, RuntimeError, ValueError) as e:
            report["failed"] = f"{type(e).__name__}: {e}".splitlines()[0]
            return report
    every = round(1e-3 / step)
    report["seconds"], report["seconds_all"] = float(np.median(seconds)), seconds
    report["orbits"] = {str(n): [result.yout[::every, 6 * n + k].tolist() for k in (0, 1)] for n in DISKS}
    return report


def main():
    parser = argparse.ArgumentParser(description="Time the time response of ROSS on a levitated rotor.")
    parser.add_argument("--runs", nargs="+", default=["newmark:1e-4", "modal:1e-4"], metavar="METHOD:STEP")
    parser.add_argument("--repeat", type=int, default=3)
    args = parser.parse_args()

    # A dependency of ROSS writes to file descriptor 1 on import: keep the real standard output for the JSON document.
    output = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    import control as ct
    import ross as rs

    with contextlib.suppress(ImportError):
        from threadpoolctl import threadpool_limits

        threadpool_limits(limits=1)
    warm = build_rotor(rs, ct)
    short = np.arange(11) * 1e-5
    for method in ("newmark", "modal"):  # ROSS compiles for several seconds in each process
        warm.run_time_response(SPEED, loads(warm, short), short, **options(method))
    report = {
        "versions": {"python": platform.python_version()}
        | {name: version(name) for name in ("ross-rotordynamics", "numpy", "scipy")},
        "repeat": args.repeat,
        "degrees_of_freedom": warm.ndof,
        "runs": [],
    }
    for text in args.runs:
        method, _, step = text.partition(":")
        print(text, file=sys.stderr)
        report["runs"].append(run(rs, ct, method, float(step), args.repeat))
    with output:
        json.dump(report, output)
        output.write("\n")


if __name__ == "__main__":
    main()
