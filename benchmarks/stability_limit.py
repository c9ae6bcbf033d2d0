"""What the certified stability limit and its gradient cost, on the rotor of Ahmad's thesis with its controllers.

The full model of the packaged problem ``thesis`` is taken, in the variants row1 to row4, tuned and controlled; nothing is
reduced. Counted are the full-size eigendecompositions up to the first onset (goal: at most 12). Timed are the limit
and its gradient with respect to every number of the machine (goal: at most 5 % of the limit's time) for a machine whose numbers
are new but whose structure has been seen, as in any study that varies numbers; and, apart from it, the differentiation of the
model, which is done once for a structure and then kept.

The controlled variants are unstable at rest. They have no limit to differentiate, so the gradient timed for them is that
of the eigenvalue that is unstable at rest, which is the same work. Run::

    python benchmarks/stability_limit.py
"""

import argparse

from common import cpu_seconds, write

import amb_design as ad
from amb_design.analysis.gradient import Differentiated, _sweep_of

VARIANTS = [f"row{row}-{kind}" for kind in ("tuned", "controlled") for row in (1, 2, 3, 4)]


def differentiate(machine):
    _sweep_of.cache_clear()
    return Differentiated(machine)


def renumbered(machine, count):
    """Machines of the same structure with other numbers."""
    stiffness = machine.bearings[0].stiffness
    return [ad.replace(machine, {"bearings.stiffness": stiffness * (1.0 + 1e-6 * k)}) for k in range(1, count + 1)]


def measure(variant, repeat):
    machine = ad.load("thesis", variant)
    limit = ad.stability_limit(machine, first_only=True)
    gradient = ad.stability_gradient if limit.status == "limit found" else ad.eigenvalue_gradient
    limit_seconds = cpu_seconds(lambda: ad.stability_limit(machine, first_only=True), repeat=repeat)
    build_seconds = cpu_seconds(lambda: differentiate(machine), repeat=repeat)
    others = iter(renumbered(machine, 10 * repeat + 20))
    gradient_seconds = (
        cpu_seconds(lambda: [gradient(next(others), limit.mode) for _ in range(10)], repeat=repeat) / 10.0
    )
    return {
        "status": limit.status,
        "certified": limit.certified,
        "speed_rpm": limit.speed_rpm,
        "states": ad.system(machine).size,
        "eigendecompositions": limit.eigendecompositions,
        "parameters": len(gradient(machine, limit.mode)),
        "limit_seconds": limit_seconds,
        "gradient_seconds": gradient_seconds,
        "gradient_over_limit": gradient_seconds / limit_seconds,
        "differentiation_seconds": build_seconds,
        "differentiation_over_limit": build_seconds / limit_seconds,
    }


def main():
    parser = argparse.ArgumentParser(description="Time the certified stability limit and its gradient.")
    parser.add_argument("--repeat", type=int, default=9)
    repeat = parser.parse_args().repeat
    rows = {variant: measure(variant, repeat) for variant in VARIANTS}
    print("variant          status              rpm  eig   limit  gradient           differentiation")
    for name, r in rows.items():
        print(
            f"{name:16s} {r['status']:16s} {r['speed_rpm']:6.0f}  {r['eigendecompositions']:3d}  {r['limit_seconds'] * 1e3:5.0f} ms"
            f"  {r['gradient_seconds'] * 1e3:5.2f} ms {r['gradient_over_limit']:6.2%}"
            f"  {r['differentiation_seconds'] * 1e3:5.0f} ms {r['differentiation_over_limit']:6.0%}"
        )
    write("stability_limit", {"repeat": repeat, "variants": rows})


if __name__ == "__main__":
    main()
