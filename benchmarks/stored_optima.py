"""The stored optima of the packaged problems: does the search find better ones?

Each problem, and each variant that stores an optimum, is solved as `amb-design optimise` does it. A verified design that is better by more
than half a percent takes the place of the stored one in problems/NAME/optimum.toml; the README beside it then wants new figures::

    python benchmarks/stored_optima.py                    # all: hours
    python benchmarks/stored_optima.py tum-rig-pid thesis-codesign
    python benchmarks/stored_optima.py thesis-codesign --variant balanced

Finished starts are kept in benchmarks/starts as they arrive, and not run again; ``--anew`` forgets them.
"""

import argparse
import tomllib
from pathlib import Path

import tomli_w

import amb_design as ad
from amb_design.optimise.start import INFEASIBLE

STARTS = Path(__file__).parent / "starts"

BETTER = 1.005
"""Below that the figures of the README stay as they are."""

ABOUT = """\
# Verified optima: eight starts, fewer where a start takes a minute, checked on the full model and on a twice finer mesh; SI units.
# The tests check them again.
"""


def best(name, variant, args):
    problem = ad.load_problem(name, None if variant == "base" else variant)
    folder = STARTS / f"{name}-{variant}-{args.seed}"
    return ad.solve(problem, args.starts, args.seed, workers=args.workers, folder=folder, resume=not args.anew)


def store(file, variant, design):
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    document["optima"][variant] = {"objective": design.end, "values": dict(design.values)}
    file.write_text(ABOUT + tomli_w.dumps(document), encoding="utf-8")


def main():
    folders = {name: folder for name, folder in ad.packaged().items() if (folder / "optimum.toml").is_file()}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("problems", nargs="*", choices=[[], *folders], metavar="PROBLEM", help=", ".join(folders))
    parser.add_argument("--variant", help="that one alone")
    parser.add_argument("--starts", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--anew", action="store_true", help="forget what was finished before")
    args = parser.parse_args()
    print("| problem | variant | stored | found | of its starts within 0.1 % | |\n|---|---|---:|---:|---:|---|")
    for name in args.problems or folders:
        file = folders[name] / "optimum.toml"
        for variant, optimum in tomllib.loads(file.read_text(encoding="utf-8"))["optima"].items():
            if args.variant not in (None, variant):
                continue
            design, stored = best(name, variant, args), optimum["objective"]
            ends = [o.objective for o in design.outcomes if o.status != INFEASIBLE]
            near = sum(end >= 0.999 * max(ends) for end in ends)
            better = design.verified and design.end > BETTER * stored
            if better:
                store(file, variant, design)
            found = f"{design.end / ad.rpm(1.0):.0f}" if design.verified else ""
            speeds = f"{stored / ad.rpm(1.0):.0f} | {found} | {near} of {args.starts}"
            print(f"| {name} | {variant} | {speeds} | {design.status}{', stored' if better else ''} |", flush=True)


if __name__ == "__main__":
    main()
