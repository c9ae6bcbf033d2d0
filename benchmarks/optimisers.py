"""Our search beside general-purpose optimisers, on the controllers of three packaged design problems.

All solve the same problem: z = (x, level), with the design x in the unit cube and the level the end of the range of speeds over
the top speed, from 0.02 to 1; the level is maximised while every limit holds, with the margins of our own search. The rotor is
represented by its 16 lowest modes, beside a look at the complete model, as in the first stage of our search. The others hold
stability and damping at 13 speeds; ours at ten, and it looks between them before it ends. 1e-4 of a limit, which is one of those
margins, counts as nothing. The best design of each run, and of each of our starts, is then judged on the full model at the same 13
speeds: the range of speeds in which it violates no limit by more than 1 %, for a search that never saw the full model cannot hold
its limits more closely. (Ours does see it in the end, and holds them to 1e-4 at the speeds that it claims.) How far it is beyond
its limits at any of 97 speeds of the range that it claims is told beside it.

Methods without gradients see `Values`, the same conditions made as cheap as can be where only values are asked. BFGS and IPOPT see
the rows of our `Evaluator` with their slopes: a dearer evaluation, but value and gradient are one. A random point that is looked at for a start is one evaluation, too. Every method begins at the machine as it is, and goes on
from random points drawn as ours are. It ends after its budget of evaluations, or when 3000 in a row, over all restarts, have
not improved its best feasible level by more than 0.1 % (those 3000 are reported as spent; before there is a feasible point
only the budget counts). Our search takes no budget: a run is the starts 0 to 7 of the seed, each to its own end. Costs in the
table are those up to the first point within the limits that is within 0.1 % of the search's own end, on whatever model it looks
at; the whole of ours is kept, too. Run::

    pip install cma==4.5.0
    python benchmarks/optimisers.py --workers 1

Finished runs are kept in results/optimisers.json as they arrive, and not run again; ``--table`` prints what is there.
"""

import argparse
import contextlib
import itertools
import json
import math
import os
import statistics
import time
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib.metadata import version
from multiprocessing import get_context

import casadi as ca
import cma
import numpy as np
from common import RESULTS, write
from scipy.optimize import OptimizeResult, differential_evolution, minimize
from threadpoolctl import threadpool_limits

import amb_design as ad
from amb_design.analysis.sensitivity import CHECKED_TO
from amb_design.optimise import nonsmooth
from amb_design.optimise.evaluation import GUARDED, LOWEST, _condition
from amb_design.optimise.measures.whirl import _Outputs as Outputs
from amb_design.optimise.solve import starter
from amb_design.optimise.start import ALMOST, INFEASIBLE, LOOKED_AT, Effort

PROBLEMS = ("thesis-pid", "tum-rig-pid", "composite-spindle")
STARTS = 8
PATIENCE, LEAST = 3000, 1e-3
CLOSE = 1e-3
"""Of its own end, where a search counts as having arrived."""

SPEEDS, CLOSELY = np.linspace(0.0, 1.0, 13), np.linspace(0.0, 1.0, 97)
"""Where the others hold stability and damping, and where the designs are looked at in the end, as fractions of the range."""

TOLERATED = 0.01
"""Violation, on the full model, of designs that were found on the reduced one."""
FAR, NEAR = 0.3, 0.1
"""Violations at which the rest, or the complete model, is no longer asked: it could only make the point worse."""

WORTH = 1.0
"""Of a violation of one, in levels: the exact penalty of the methods that take no constraints."""


# --- values alone ----------------------------------------------------------------------------------------------------


class Values:
    """Largest relative violation of each quantity: the conditions of the evaluator, without derivatives.

    Eigenvectors are asked only where sensitivities and responses are sums over modes, peaks are taken from a table that has points
    around every mode, and what could only make a hopeless point worse is left out.

    Parameters
    ----------
    evaluator : Evaluator
    modes : int
    """

    def __init__(self, evaluator, modes):
        self.ev, self.modes = evaluator, modes

    def __call__(self, x, level, far=FAR, near=NEAR):
        """By quantity.

        Parameters
        ----------
        x : ndarray
        level : float
        far, near : float
            Where stability is violated by more than the one, only eigenvalues are asked; where anything is by more than the
            other, all but the complete model.
        """
        ev, found = self.ev, {}
        p, end, checked = ev.scaling.values(x), ev.end(level), ev.checked * ev.end(level)
        between = np.setdiff1d(ev.fractions, ev.checked) * end

        def add(quantity, value):
            found[quantity] = max(found.get(quantity, -math.inf), value)

        def add_values(quantity, values):  # bounded from above, as the evaluator has them
            bound = ev.limits[quantity].bound * (1.0 - ev.margins.get(quantity, 0.0))
            add(quantity, float(_condition(ev.limits[quantity], bound, values, np.zeros((len(values), 0)))[0].max()))

        for case in ev.cases:
            state = case.state(p, self.modes)
            spectra = state.spectra(checked)
            values = np.vstack([spectra.values, state.eigenvalues(between)])
            for quantity, excess in case.shortfalls(values, ev.bounds(level)).items():
                add(quantity, float(excess.max()) + ev.margins.get(quantity, 0.0))
            for quantity, samples in case.statics.samples(p, end).items():
                add(quantity, float(ev._rows("", quantity, samples, 1.0, level).values.max()))
            if found["stability"] <= far:
                if "sensitivity_peak" in case.measures:
                    add_values("sensitivity_peak", sensitivities(case, state, checked))
                for quantity, values in driven(case, state, end).items() if case.unbalance else ():
                    add_values(quantity, values)
            if max(found.values()) <= near:
                complete = case.state(p)
                excess = case.shortfalls(complete.spectra(GUARDED * end).values, {})["stability"]
                add("stability", float(excess.max()) + ev.margins.get("stability", 0.0))
                if "sensitivity_peak" in case.measures:
                    add_values("sensitivity_peak", sensitivities(case, complete, GUARDED * end))
                ev._count(complete)
            ev._count(state)
        return found

    def check(self, x, seed):
        """Make sure that near a design, and where it matters, these are the evaluator's own rows."""
        rng, compared = np.random.default_rng(seed), 0
        for _ in range(50):
            near, level = np.clip(x + 0.1 * rng.uniform(-1.0, 1.0, len(x)), 0.0, 1.0), rng.uniform(LOWEST, 0.3)
            found = self(near, level, math.inf, math.inf)
            if found["stability"] > FAR:
                continue
            for quantity, (row, _) in largest(self.ev.rows(near, level, self.modes)).items():
                if abs(max(row, -1.0) - max(found[quantity], -1.0)) > 0.02:  # half of a limit is low enough
                    raise RuntimeError(f"{quantity} at {near.tolist()}, {level}: row {row}, value {found[quantity]}")
            compared += 1
            if compared == 5:
                return
        raise RuntimeError("hardly a point near the machine is stable enough for a comparison")


def sensitivities(case, state, speeds):
    """Peaks of the sensitivity of each loop at some speeds, at most up to a tenth of a percent below the true ones."""
    count, (f, g, c), spectra = len(case.loops.plant.loops), state.ports, state.spectra(speeds)
    least, out = max(CHECKED_TO, case.measures["sensitivity_peak"].option("up_to")), []
    for speed, values, right, left in zip(speeds, spectra.values, spectra.right, spectra.left, strict=True):
        leave = (c[:count] @ right).T
        force, rate = leave * (left @ f)[:, :count], leave * (left @ g)[:, :count]

        def one_sided(w, values=values, force=force, rate=rate):
            modes = 1.0 / (1j * w[:, None] - values)
            return 1.0 + modes @ force + 1j * w[:, None] * (modes @ rate)

        def size(w, one_sided=one_sided):
            ahead = one_sided(w)
            return np.abs((ahead + one_sided(-w).conj()) / 2.0 if case.loops.complex_form else ahead)

        top = max(least, 3.0 * speed)
        around = np.abs(values.imag)[:, None] + np.abs(values.real)[:, None] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
        w = np.sort(np.concatenate([np.geomspace(1e-4 * top, top, 200), np.clip(around.ravel(), 1e-4 * top, top)]))
        out.append(crest(w, size(w), size))
    return np.array(out)


def driven(case, state, end):
    """Largest value of each quantity that the unbalance drives, for each magnet and pattern."""
    whirl = case.unbalance
    critical = state.critical[0]
    around = critical.real[:, None] + np.abs(critical.imag)[:, None] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    speeds = np.sort(np.concatenate([np.linspace(0.0, end, 73)[1:], np.clip(around.ravel(), end / 72, end)]))
    found = []
    for force in (state.lower @ case.loops.unbalance).T:
        outputs = Outputs(state, force)
        magnets = range(len(case.loops.machine.magnets))
        found += [whirl._quantities(state, m, speeds, outputs.at(speeds))[0].max(axis=1) for m in magnets]
    return dict(zip(whirl.bounds, np.array(found).T, strict=True))


def crest(places, values, function):
    """Largest value of a table, looked at more closely."""
    k = int(np.argmax(values.max(axis=1)))
    close = np.linspace(places[max(k - 1, 0)], places[min(k + 1, len(places) - 1)], 17)
    return max(float(values[k].max()), float(function(close).max()))


def largest(rows):
    """Largest row of each quantity, with its slope."""
    return {rows.quantities[i]: (rows.values[i], rows.slopes[i]) for i in np.argsort(rows.values)}


# --- runs ------------------------------------------------------------------------------------------------------------


class Spent(Exception):  # noqa: N818  an end, no error
    """The budget or the patience is used up."""


class Run:
    """What a method may ask, and what it cost.

    Parameters
    ----------
    problem : DesignProblem
    seed : int
    budget : int
        Evaluations.
    """

    def __init__(self, problem, seed, budget):
        self.starter, self.seed, self.budget = starter(problem, Effort()), seed, budget
        self.ev, self.modes = self.starter.evaluator, self.starter.modes
        self.quantities = ("stability", *self.ev.limits)
        self.lower, self.upper = np.append(np.zeros(self.ev.variables), LOWEST), np.ones(self.ev.variables + 1)
        self.bounds = list(zip(self.lower, self.upper, strict=True))
        self.values = Values(self.ev, self.modes)
        self.values.check(self.starter._first(seed, 0), seed)
        self.ev.afresh()
        self.ev.fractions = SPEEDS
        self.known, self.best, self.line = {}, (0.0, None), []
        self.evaluations, self.mark, self.since, self.over = 0, 0.0, 0, False
        self.clock = time.process_time()

    def starts(self):
        """Where our search begins, too: the machine, then the best of some random points."""
        for i in itertools.count():
            self.spend(LOOKED_AT if i else 0)
            yield np.append(self.starter._first(self.seed, i), LOWEST)

    def cost(self, z):
        """The exact penalty function."""
        z = np.clip(z, self.lower, self.upper)
        worst = max(self.values(z[:-1], z[-1]).values())
        self._seen(z, worst)
        return -z[-1] + WORTH * max(worst, 0.0)

    def sloped_cost(self, z):
        """The exact penalty function and its gradient."""
        rows = self._rows(z)
        k = int(np.argmax(rows.values))
        slope = WORTH * rows.slopes[k] * (rows.values[k] > 0.0)
        slope[-1] -= 1.0
        return -z[-1] + WORTH * max(rows.worst, 0.0), slope

    def plain(self, z):
        """Values of all quantities, with slopes of zero."""
        found = self.values(z[:-1], z[-1], math.inf, math.inf)
        self._seen(z, max(found.values()))
        return {q: (value, np.zeros(len(z))) for q, value in found.items()}

    def sloped(self, z):
        """Values and slopes of all quantities."""
        return largest(self._rows(z))

    def conditions(self, z, ask):
        """One value a quantity, positive if violated, and their slopes; asked again for the same point they cost nothing."""
        z = np.clip(z, self.lower, self.upper)
        if z.tobytes() not in self.known:
            self.spend(0)
            found, none = ask(z), (-1.0, np.zeros(len(z)))
            every = [found.get(q, none) for q in self.quantities]
            self.known[z.tobytes()] = [np.array(part) for part in zip(*every, strict=True)]
        return self.known[z.tobytes()]

    def _rows(self, z):
        rows = self.ev.rows(z[:-1], float(z[-1]), self.modes)
        self._seen(z, rows.worst)
        return rows

    def _seen(self, z, worst):
        level = float(z[-1])
        if worst <= ALMOST and level > self.best[0]:
            self.best = level, z[:-1].copy()
            if not self.line or level > 1.0001 * self.line[-1][2]:
                self.line.append((self.evaluations + 1, self.seconds(), level, self.eigensolves()))
            if level > (1.0 + LEAST) * self.mark:
                self.mark, self.since = level, self.evaluations
        self.spend(1)

    def spend(self, evaluations):
        self.evaluations += 0 if self.over else evaluations
        idle = self.mark > 0.0 and self.evaluations - self.since > PATIENCE
        self.over = self.over or idle or self.evaluations >= self.budget
        if self.over:
            raise Spent

    def final(self):
        """The best design, on the full model."""
        level, x = self.best
        if x is None:
            return {"claimed": 0.0, "rpm": 0.0}
        names, claimed = [v.name for v in self.ev.problem.variables], rpm(self.ev.end(level))
        values = dict(zip(names, self.ev.scaling.values(x).tolist(), strict=True))
        return {"claimed": claimed, **judged(self.ev, values, claimed), "values": values}

    def seconds(self):
        return round(time.process_time() - self.clock, 2)

    def eigensolves(self):
        return by_size(self.ev)


def judged(ev, values, claimed):
    """How good a design is on the full model, which ended at a claimed speed [rpm].

    The speed up to which it is good with a violation of 1 % forgiven, wherever its own search ended [rpm]; limits are taken to hold
    below a speed at which they hold. And the largest violation at any of many speeds up to the claimed one, relative to the limit.
    """
    x, top = ev.scaling.point(np.array(list(values.values()))), rpm(ev.end(1.0))
    ev.fractions = CLOSELY
    violation = max(ev.rows(x, claimed / top).worst, 0.0)
    ev.fractions = SPEEDS
    return {
        "rpm": good_up_to(lambda speed: ev.rows(x, speed / top).worst <= TOLERATED, claimed, top),
        "violation": violation,
    }


def by_size(ev):
    """Eigendecompositions so far."""
    return {str(size): count for size, count in sorted(ev.eigensolves.items())}


def good_up_to(holds, claimed, top):
    """The highest speed that holds, near a claimed one; zero if there is none."""
    good, lower, upper = holds(claimed), claimed, claimed
    for gap in 1e-4 * 4.0 ** np.arange(8):
        if good:
            lower, upper = upper, min(claimed * (1.0 + gap), top)
        else:
            lower, upper = claimed * (1.0 - gap), lower
        if lower < LOWEST * top:
            return 0.0
        if lower == top or holds(upper if good else lower) != good:
            break
    while upper - lower > 1e-4 * lower:
        middle = 0.5 * (lower + upper)
        lower, upper = (middle, upper) if holds(middle) else (lower, middle)
    return lower


def rpm(speed):
    return float(speed) * 30.0 / math.pi


# --- methods ---------------------------------------------------------------------------------------------------------


def repeated(search, z):
    """Begin anew at the end as long as that helps."""
    value, better = math.inf, True
    while better:
        found = search(z)
        better = found.fun < value - LEAST * abs(found.fun)
        z, value = found.x, found.fun


def slsqp(run):
    """With one constraint a quantity, and differences over 1e-4: smaller ones do worse. It ends where a step gains nothing."""
    up, options = -np.eye(len(run.lower))[-1], {"maxiter": 200, "ftol": 1e-6, "eps": 1e-4}
    held = {"type": "ineq", "fun": lambda z: -run.conditions(z, run.plain)[0]}

    def search(z):
        return minimize(
            lambda z: -z[-1], z, (), "SLSQP", lambda z: up, bounds=run.bounds, constraints=held, options=options
        )

    for start in run.starts():
        repeated(search, start)


def nelder_mead(run):
    """Adaptive, with edges of a fifth of the cube."""
    rng, options = np.random.default_rng(run.seed), {"adaptive": True, "xatol": 1e-5, "fatol": 1e-6}
    options |= {"maxiter": run.budget, "maxfev": run.budget}

    def search(z):
        edges = 0.2 * np.where(z > 0.8, -1.0, np.where(z < 0.2, 1.0, rng.choice([-1.0, 1.0], len(z))))
        simplex = {"initial_simplex": np.vstack([z, z + np.diag(edges)])}
        return minimize(run.cost, z, method="Nelder-Mead", bounds=run.bounds, options=options | simplex)

    for start in run.starts():
        repeated(search, start)


def evolution(run):
    """Differential evolution as SciPy has it, with six designs a variable; the machine is among the first of them."""
    options = {"popsize": 6, "tol": 1e-4, "polish": False, "maxiter": run.budget, "x0": next(run.starts())}
    for k in itertools.count():
        differential_evolution(run.cost, run.bounds, rng=np.random.default_rng([run.seed, k]), **options)
        options["x0"] = None


def cma_es(run):
    """BIPOP: restarts with large and with small populations."""
    starts = run.starts()
    for k in itertools.count(1):
        options = {"bounds": [run.lower, run.upper], "seed": 1000 * (run.seed + 1) + k, "verbose": -9}
        cma.fmin2(run.cost, lambda: next(starts), 0.2, options, restarts=9, bipop=True)


def bfgs(run):
    """For functions with kinks, after Lewis and Overton; ended where it creeps, for new starts bring more."""
    options = {"unit": np.ones(len(run.lower)), "evaluations": run.budget, "tolerance": 1e-3}

    def search(z):
        found = nonsmooth.minimise(run.sloped_cost, z, run.lower, run.upper, **options)
        return OptimizeResult(x=found.x, fun=found.value)

    for start in run.starts():
        repeated(search, start)


class Conditions(ca.Callback):
    """The largest row of each quantity, or its slope, for CasADi."""

    def __init__(self, run, slopes=False, name="conditions", options=None):
        super().__init__()
        self.run, self.slopes, self.jacobian = run, slopes, None
        self.construct(name, options or {})

    def get_n_in(self):
        return 1 + self.slopes

    def get_sparsity_in(self, i):
        return ca.Sparsity.dense(len(self.run.quantities if i else self.run.lower), 1)

    def get_sparsity_out(self, i):
        return ca.Sparsity.dense(len(self.run.quantities), len(self.run.lower) if self.slopes else 1)

    def eval(self, arguments):
        try:
            return [self.run.conditions(np.array(arguments[0]).ravel(), self.run.sloped)[self.slopes]]
        except Spent:  # IPOPT takes no exceptions, but ends at such numbers
            return [np.full(self.size_out(0), np.nan)]

    def has_jacobian(self):
        return not self.slopes

    def get_jacobian(self, name, inputs, outputs, options):
        self.jacobian = Conditions(self.run, True, name, options)  # to be kept alive here
        return self.jacobian


def ipopt(run):
    """With one constraint a quantity, its exact gradient, and a curvature that it learns."""
    z, conditions = ca.MX.sym("z", len(run.lower)), Conditions(run)
    own = {"hessian_approximation": "limited-memory", "max_iter": 300, "tol": 1e-6, "print_level": 0, "sb": "yes"}
    options = {"print_time": False, "show_eval_warnings": False, "error_on_fail": False}
    options |= {f"ipopt.{name}": value for name, value in own.items()}
    solver = ca.nlpsol("ipopt", "ipopt", {"x": z, "f": -z[-1], "g": conditions(z)}, options)
    for start in run.starts():
        solver(x0=start, lbx=run.lower, ubx=run.upper, ubg=0.0)


METHODS = {
    "ours": None,
    "SLSQP, differences": slsqp,
    "Nelder-Mead": nelder_mead,
    "differential evolution": evolution,
    "CMA-ES": cma_es,
    "BFGS, exact gradients": bfgs,
    "IPOPT": ipopt,
}


# --- the benchmark ---------------------------------------------------------------------------------------------------


def one(problem, method, seed, budget):
    """One run of a method on a problem, as an entry of the results."""
    entry = {"problem": problem, "method": method, "seed": seed}
    with warnings.catch_warnings(), threadpool_limits(1, user_api="blas"):
        warnings.simplefilter("ignore")  # of optimisers that end without success
        if method == "ours":
            return entry | {"budget": None} | ours(ad.load_problem(problem), seed)
        run = Run(ad.load_problem(problem), seed, budget)
        with contextlib.suppress(Spent):
            METHODS[method](run)
        entry |= {"budget": budget, "evaluations": run.evaluations, "cpu_seconds": run.seconds()}
        entry |= {"eigensolves": run.eigensolves(), "level": run.best[0]}
        # evaluations, CPU seconds, level and eigensolves by size at each improvement of more than 0.01 %, in one line
        return entry | {"line": [json.dumps(point) for point in run.line], "final": run.final()}


def ours(problem, seed):
    """Our search, start by start."""
    made, asked, starts = starter(problem, Effort()), Counter(), []
    rows = made.evaluator.rows

    def counted(x, level, modes=None):
        asked["full" if modes is None else "reduced"] += 1
        found = rows(x, level, modes)
        if found.worst <= ALMOST:
            seconds = round(time.process_time() - clock, 2)
            line.append((made.evaluator.objective(level), seconds, by_size(made.evaluator)))
        return found

    made.evaluator.rows = counted
    for i in range(STARTS):
        asked.clear()
        line, clock = [], time.process_time()
        found = made.run(seed, i)
        evaluations = dict(asked) | {"looked at": LOOKED_AT if i else 0}
        start = {"status": found.status, "cpu_seconds": round(found.cpu_seconds, 2), "eigensolves": found.eigensolves}
        start |= {"evaluations": evaluations, "claimed": 0.0, "rpm": 0.0, "values": found.values}
        start["near"] = [start["cpu_seconds"], start["eigensolves"]]
        if found.status != INFEASIBLE:
            claimed = rpm(found.objective)
            near = (cost for end, *cost in line if abs(end - found.objective) <= CLOSE * found.objective)
            start |= {"near": next(near, start["near"]), "claimed": claimed}
            start |= judged(made.evaluator, found.values, claimed)
        starts.append(start)
    return {"final": {"rpm": max(s["rpm"] for s in starts)}, "starts": starts}


def key(r):
    return r["problem"], r["method"], r["seed"]


def finished(budget=None):
    """Runs of a budget, and ours, or all."""
    kept = RESULTS / "optimisers.json"
    runs = json.loads(kept.read_text())["runs"] if kept.exists() else []
    return [r for r in runs if budget is None or r["budget"] in (None, budget)]


def keep(entry):
    """Add a run so that an interruption leaves either all of it or nothing."""
    runs = [r for r in finished() if (key(r), r["budget"]) != (key(entry), entry["budget"])]
    with contextlib.redirect_stdout(None):
        write("optimisers.new", {"cma": version("cma"), "runs": sorted([*runs, entry], key=key)})
    os.replace(RESULTS / "optimisers.new.json", RESULTS / "optimisers.json")


def spent(r):
    """CPU seconds and eigensolves until a run, or each of our starts, was within 0.1 % of its own end."""
    if "starts" in r:
        seconds, solved = zip(*(s["near"] for s in r["starts"]), strict=True)
        return sum(seconds), sum(map(Counter, solved), Counter())
    return next((p[1], p[3]) for p in map(json.loads, r["line"]) if p[2] >= (1.0 - CLOSE) * r["level"])


def grouped(number):
    return f"{number:,.0f}".replace(",", " ")


def print_line(name, found, costs):
    median, sizes = statistics.median, sorted({int(n) for _, counts in costs for n in counts})
    speeds, beyond = [f["rpm"] for f in found], [f["violation"] for f in found if f["claimed"]]
    if not beyond:
        print(f"| {name} | {len(found)} | no point within the limits | | | | | |")
        return
    reached = (max(speeds), median(speeds), median(f["claimed"] for f in found))
    solved = ", ".join(grouped(median(counts.get(str(n), 0) for _, counts in costs)) + f" of {n}" for n in sizes)
    cells = [name, str(len(found)), *map(grouped, reached), f"{100.0 * median(beyond):.2f} %"]
    print(f"| {' | '.join(cells)} | {median(s for s, _ in costs):.0f} s | {solved} |")


def print_table(problem, runs):
    """What is there of a problem: speeds [rpm] on the full model, and the median of those that the searches claimed."""
    print(f"\n| {problem} | runs | best | median | as claimed | beyond limits | CPU | eigensolves |")
    print("|---|---:|---:|---:|---:|---:|---:|---|")
    for method in METHODS:
        of = [r for r in runs if r["problem"] == problem and r["method"] == method]
        if of and method == "ours":
            starts = [s for r in of for s in r["starts"]]
            print_line("ours, one start", starts, [s["near"] for s in starts])
            found = [max(r["starts"], key=lambda s: s["rpm"]) for r in of]
        elif of:
            found = [r["final"] for r in of]
        if of:
            costs = [spent(r) for r in of if "starts" in r or r["line"]]
            print_line("ours, 8 starts" if method == "ours" else method, found, costs)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--problems", nargs="+", choices=PROBLEMS, default=PROBLEMS)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--evaluations", type=int, default=20000, help="budget of a run")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="only print what is there")
    args = parser.parse_args()
    done = {key(r) for r in finished(args.evaluations)}
    wanted = [k for seed in range(args.seeds) for k in itertools.product(args.problems, args.methods, [seed])]
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        jobs = [pool.submit(one, *k, args.evaluations) for k in wanted if k not in done and not args.table]
        for job in as_completed(jobs):
            if job.exception():
                print(f"failed: {job.exception()}", flush=True)
                continue
            keep(job.result())
            print(*key(job.result()), f"{job.result()['final']['rpm']:.0f} rpm", sep=", ", flush=True)
    for problem in args.problems:
        print_table(problem, finished(args.evaluations))


if __name__ == "__main__":
    main()
