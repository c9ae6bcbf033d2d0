"""Proofs of the stability limit: how many machines can be proven, how narrow the bracket is, and what it costs.

(a) Random machines (those of random_problems.py, with a random machine of their own for each seed): of those that are stable at
rest, how many are proven, and with which relative width of the bracket between proven stable and proven unstable. (b) Packaged
machines: size, cells, bytes of the certificate, seconds to make and to check it. Run::

    python benchmarks/proofs.py 200

Finished seeds are kept in results/proofs.json as they arrive, and not run again; ``--anew`` forgets them.
"""

import argparse
import json
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import count
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

import amb_design as ad
from amb_design.proof.claims import WIDTHS, compact

PACKAGED = {
    "thesis row4-tuned": ("thesis", "row4-tuned", {}),
    "thesis-anisotropic": ("thesis-anisotropic", None, {}),
    "composite-spindle": ("composite-spindle", "levitated", {}),
    "tum-rig": ("tum-rig", "levitated", {}),
    "tum-rig, 48 elements": ("tum-rig", "levitated", {"rotor.shaft.elements": 48}),
}

FAR = 5.0
"""Random machines are followed to this many times their top speed, so that most have a limit to be bracketed."""

TO_TOP = "to the end"
"""Instead of a width, of machines that are stable as far as they are followed."""


# --- random machines -------------------------------------------------------------------------------------------------


def machine_of_seed(seed):
    """The random machine of a seed; one that cannot be made gives way to another one."""
    from random_problems import machine_of

    rng = np.random.default_rng(seed)
    for _ in range(60):
        try:
            return machine_of(rng)
        except ad.SpecError:
            continue
    raise RuntimeError("no machine in 60 trials")


def width_of(proof):
    """The width that was asked for and reached, from the bracket."""
    if proof.upper is None:
        return TO_TOP
    half = 0.5 * (proof.upper / proof.lower - 1.0)
    return f"{min((w for w in WIDTHS if half <= 1.01 * w), default=half):g}"


def run(seed):
    """What became of the machine of a seed; a warning counts as a crash."""
    with warnings.catch_warnings(), threadpool_limits(1, user_api="blas"):
        warnings.simplefilter("error")
        return _run(seed)


def _run(seed):
    clock, record = time.process_time(), {"seed": seed}
    try:
        loop = ad.system(machine_of_seed(seed))
        top = FAR * loop.machine.operation.top_speed
        limit = ad.stability_limit(loop, top, first_only=True)
        record |= {"states": loop.size, "form": "complex" if loop.complex_form else "real", "limit": limit.status}
        if limit.status in ("unstable at rest", "marginal"):
            return record | {"status": limit.status, "seconds": round(time.process_time() - clock, 2)}
        record |= {"certified": limit.certified, "limit_rpm": limit.speed_rpm}
        clock = time.process_time()
        proof = ad.prove_stability_limit(loop, top)
        record |= measures(proof) | {"status": "proven", "width": width_of(proof)}
        record["seconds"] = round(time.process_time() - clock, 2)
        clock = time.process_time()
        proof.check()
        record["check_seconds"] = round(time.process_time() - clock, 2)
        if not consistent(proof, limit):
            record |= {"status": "contradiction", "error": f"{proof.lower!r} {proof.upper!r} {limit.bracket}"}
    except ad.SolveError as error:
        record |= {"status": "not proven", "error": str(error), "seconds": round(time.process_time() - clock, 2)}
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(where.filename).name}:{where.lineno}"
        record |= {
            "status": "crashed",
            "error": f"{type(error).__name__}: {error} ({place})",
            "trace": traceback.format_exc(),
            "seconds": round(time.process_time() - clock, 2),
        }
    return record


def consistent(proof, limit):
    """The proof agrees with the computed limit, which came from eigenvalues."""
    below = proof.lower <= limit.bracket[1]
    return below and (proof.upper is None or proof.upper >= limit.bracket[0])


def measures(proof):
    """Size of a certificate."""
    return {"cells": proof.document()["cells"], "bytes": len(compact(proof.certificate))}


def stable(record):
    """True if there was something to prove."""
    return record["status"] not in ("unstable at rest", "marginal")


def summary(records):
    """Shares of the machines that are stable at rest."""
    tried = [r for r in records if stable(r)]
    proven = [r for r in tried if r["status"] == "proven"]
    seconds = [r["seconds"] for r in proven]
    return {
        "machines": len(records),
        "stable at rest": len(tried),
        "outcomes": dict(Counter(r["status"] for r in tried)),
        "widths": dict(sorted(Counter(r["width"] for r in proven).items())),
        "median_cells": float(np.median([r["cells"] for r in proven])) if proven else None,
        "most_cells": max((r["cells"] for r in proven), default=None),
        "most_bytes": max((r["bytes"] for r in proven), default=None),
        "median_seconds": float(np.median(seconds)) if proven else None,
        "most_seconds": max(seconds, default=None),
        "failures": [
            {"seed": r["seed"], "status": r["status"], "error": r["error"]} for r in tried if r["status"] != "proven"
        ],
    }


# --- packaged machines -----------------------------------------------------------------------------------------------


def packaged(name, repeat):
    """Size and cost of the proof of a packaged machine."""
    from common import cpu_seconds

    source, variant, changes = PACKAGED[name]
    machine = ad.replace(ad.load(source, variant), changes)
    proof = ad.prove_stability_limit(machine)
    return {
        "states": len(proof.matrices["A0"]),
        "form": "complex" if ad.system(machine).complex_form else "real",
        "width": width_of(proof),
        "stable_up_to_rpm": proof.lower / ad.rpm(1.0),
        **measures(proof),
        "seconds": cpu_seconds(lambda: ad.prove_stability_limit(machine), repeat=repeat),
        "check_seconds": cpu_seconds(proof.check, repeat=repeat),
    }


# --- the benchmark ---------------------------------------------------------------------------------------------------


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("number", type=int, nargs="?", default=200, help="how many machines that are stable at rest")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--repeat", type=int, default=3, help="timings of each packaged machine; 0 leaves them out")
    parser.add_argument("--anew", action="store_true", help="forget what was finished before")
    args = parser.parse_args()
    from common import RESULTS, write

    kept = RESULTS / "proofs.json"
    old = json.loads(kept.read_text()) if kept.exists() and not args.anew else {}
    records = {r["seed"]: r for r in old.get("random", [])}
    table = {name: row for name, row in old.get("packaged", {}).items() if name in PACKAGED}

    def report():
        inside = [records[s] for s in sorted(records)]
        write("proofs", {"summary": summary(inside), "packaged": table, "random": inside})

    def missing():
        """The next seeds, in order, until enough machines are stable at rest."""
        found = 0
        for seed in count():
            if found >= args.number:
                return
            if seed not in records:
                yield seed
            found += seed not in records or stable(records[seed])

    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        while todo := list(missing()):  # those that turn out to be unstable at rest are made up for by later seeds
            for done in as_completed([pool.submit(run, seed) for seed in todo]):
                r = done.result()
                records[r["seed"]] = r
                words = (r["status"], r.get("width", ""), r.get("cells", ""), r.get("error", ""))
                print(f"{r['seed']:4d} {r['seconds']:6.1f} s  {' '.join(map(str, words))}", flush=True)
                report()
    for name in PACKAGED if args.repeat else ():
        if name not in table:
            table[name] = packaged(name, args.repeat)
            report()
    total = summary(records.values())
    print(
        f"\n{total['stable at rest']} machines that are stable at rest: {total['outcomes']}, widths {total['widths']}"
    )
    for failure in total["failures"]:
        print(f"{failure['seed']:4d} {failure['status']}: {failure['error']}")
    print(
        "\n| machine | states | form | width | cells | bytes | proof | check |\n|---|---:|---|---|---:|---:|---:|---:|"
    )
    for name, r in table.items():
        print(
            f"| {name} | {r['states']} | {r['form']} | {r['width']} | {r['cells']} | {r['bytes']} "
            f"| {r['seconds']:.2f} s | {r['check_seconds']:.2f} s |"
        )


if __name__ == "__main__":
    main()
