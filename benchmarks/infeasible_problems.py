"""Random design problems that are called infeasible: are they?

Each of them (see `random_problems.py`) is solved again with the usual effort, from up to six starts. Beside this, CMA-ES minimises the
largest violation of any limit: on the same conditions, where the search begins, from the best of 40 random points and the
machine as it is, with 450 evaluations. Both look for one point within the limits, and tell how close they came::

    pip install cma==4.5.0
    python benchmarks/infeasible_problems.py

Finished problems are kept in results/infeasible_problems.json as they arrive, and not run again; ``--anew`` forgets them.
"""

import argparse
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context

import cma
import numpy as np
from common import RESULTS, write
from random_problems import problem_of
from threadpoolctl import threadpool_limits

from amb_design.errors import SolveError
from amb_design.optimise.evaluation import LOWEST
from amb_design.optimise.solve import starter
from amb_design.optimise.start import ALMOST, INFEASIBLE, Effort

STARTS, POINTS, EVALUATIONS = 6, 40, 450


def run(seed):
    """A problem as an entry of the results: the least violation that each of the two found."""
    with warnings.catch_warnings(), threadpool_limits(1, user_api="blas"):
        warnings.simplefilter("ignore")
        problem, clock = problem_of(seed)[0], time.process_time()
        entry = {"seed": seed, "objective": problem.objective.quantity, "variables": len(problem.variables)}
        outcomes = []
        for index in range(STARTS):
            outcomes.append(starter(problem, Effort()).run(seed, index))
            if outcomes[-1].status != INFEASIBLE:
                break
        best = min(outcomes, key=lambda o: o.violation)
        entry |= {"starts": len(outcomes), "ours": best.violation}
        entry |= {"conflicts": [c["quantity"] for c in best.conflicts], "cma": least_violation(problem, seed)}
        return entry | {"seconds": round(time.process_time() - clock, 1)}


def least_violation(problem, seed):
    """What CMA-ES arrives at."""
    made = starter(problem, Effort())
    ev, modes, rng = made.evaluator, made.modes, np.random.default_rng(seed)
    machine = ev.scaling.point(np.array(list(problem.start().values())))
    ev.start_level(machine, modes)  # which sets the scale of the objective
    level = LOWEST if problem.seeks_speed else -1e3

    def violation(x):
        try:
            return max(ev.excesses(ev.rows(np.clip(x, 0.0, 1.0), level, modes)).max(), 0.0)
        except SolveError:  # no law can be designed there
            return 1e6

    points = [machine, *rng.random((POINTS, ev.variables))]
    values = [violation(x) for x in points]
    first = points[int(np.argmin(values))]
    if min(values) <= ALMOST:
        return min(values)
    if ev.variables == 1:  # CMA-ES wants two
        return min(violation(np.array([u])) for u in np.linspace(0.0, 1.0, EVALUATIONS))
    options = {"bounds": [0, 1], "verbose": -9, "seed": seed + 1, "maxfevals": EVALUATIONS, "ftarget": ALMOST}
    return min(min(values), float(cma.fmin(violation, first, 0.25, options)[1]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--anew", action="store_true", help="forget what was finished before")
    args = parser.parse_args()
    kept = RESULTS / "infeasible_problems.json"
    old = json.loads(kept.read_text())["problems"] if kept.exists() and not args.anew else []
    random = json.loads((RESULTS / "random_problems.json").read_text())["problems"]
    seeds = [r["seed"] for r in random if r["status"] == "infeasible"]
    records = {r["seed"]: r for r in old if r["seed"] in seeds}
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(run, seed) for seed in seeds if seed not in records]):
            r = done.result()
            records[r["seed"]] = r
            print(f"{r['seed']:4d} {r['seconds']:6.1f} s  ours {r['ours']:.4g}  CMA-ES {r['cma']:.4g}", flush=True)
            write("infeasible_problems", {"problems": [records[s] for s in sorted(records)]})
    found = records.values()
    print("\n| | problems |\n|---|---:|")
    print(f"| called infeasible | {len(found)} |")
    print(f"| feasible, by our search with the usual effort | {sum(r['ours'] <= ALMOST for r in found)} |")
    print(f"| feasible, by CMA-ES | {sum(r['cma'] <= ALMOST for r in found)} |")
    print(
        f"| infeasible, and ours closest or within 1 % of the other | {sum(r['ours'] > ALMOST and r['ours'] <= 1.01 * r['cma'] for r in found)} |"
    )


if __name__ == "__main__":
    main()
