"""Random design problems: does every design that is called verified keep its promises?

Each seed makes a machine (steel or laminated shaft, perhaps stepped, with disks, on magnets or bearings or both), frees two to
eight of its numbers, and limits some quantities, now and then impossibly. `solve` gets little effort, for its answer need not
be good here, only true. A design that comes back verified is checked by code that is written here, from the public analyses
alone: on two meshes which verification does not look at, one of five times as many elements and one whose elements are cut in
three, at speeds of its own, with 0.2 % for the difference between the meshes. What is broken there is looked at again with
every element cut in six: if it holds, it was broken by a mesh that has not converged or by modes of a few elements to the
wavelength, which are the mesh's and not the rotor's, and is counted by itself. Run::

    python benchmarks/random_problems.py 200

Finished problems are kept in results/random_problems.json as they arrive, and not run again; ``--anew`` forgets them.
"""

import argparse
import json
import math
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import amb_design as ad
from amb_design.model.mesh import plan
from amb_design.optimise.solve import solve
from amb_design.optimise.start import Effort

EFFORT, STARTS = Effort(30, 25, 12), 2
SPEEDS = 25
"""Speeds at random, at which promises are looked at."""

MESHES, CONVERGED = ((5, 1), (1, 3)), (1, 6)
"""Times as many elements as the machine asks for, and the parts in which each is cut."""

ALLOWED = 2e-3
"""For the difference between the meshes, relative to the limit."""

CARBON = ad.Orthotropic(E1=139e9, E2=11e9, G12=6.05e9, G13=6.05e9, G23=3.78e9, nu12=0.313, density=1578.0)
GLASS = ad.Orthotropic(E1=45e9, E2=14e9, G12=5.5e9, G13=5.5e9, G23=5.1e9, nu12=0.28, density=2000.0)
STEEL = ad.Isotropic(E=205e9, nu=0.29, density=7850.0)
ALUMINIUM = ad.Isotropic(E=71e9, nu=0.33, density=2800.0)


# --- problems --------------------------------------------------------------------------------------------------------


def shaft_of(rng):
    """One to three segments, all of metal or all laminated, in a length of 0.5 to 1.2 m."""
    length, laminated = rng.uniform(0.5, 1.2), rng.random() < 0.5
    parts = rng.dirichlet(np.full(rng.integers(1, 4), 6.0)) * length
    segments = []
    for part in parts:
        inner = float(rng.choice([0.0, 0.02, 0.05])) if not laminated else float(rng.choice([0.03, 0.05, 0.07]))
        if laminated:
            ply = CARBON if rng.random() < 0.7 else GLASS
            angles = rng.choice([0.0, 0.3, 0.8, -0.8, math.pi / 2.0], rng.integers(2, 5))
            plies = ad.layup(ply, [float(a) for a in angles], [float(rng.uniform(1.5e-3, 4e-3)) for _ in angles])
            segments.append(ad.Segment(length=float(part), inner_diameter=inner, plies=plies))
        else:
            metal = STEEL if rng.random() < 0.7 else ALUMINIUM
            outer = inner + float(rng.uniform(0.02, 0.04))
            segments.append(ad.Segment(length=float(part), inner_diameter=inner, outer_diameter=outer, material=metal))
    return ad.Shaft(
        segments=tuple(segments),
        shear_correction=0.55,
        viscous_damping=float(10.0 ** rng.uniform(-5.5, -3.7)),
        hysteretic_damping=float(rng.choice([0.0, 1e-3])),
        elements=int(rng.integers(4, 8)),
    )


def disks_of(rng, length):
    """One to four rings, some with their mass given, with residual unbalance."""
    places = np.sort(rng.choice(np.linspace(0.08, 0.92, 8), rng.integers(1, 5), replace=False)) * length
    disks = []
    for i, x in enumerate(places):
        common = {"name": f"disk {i}", "position": float(x), "unbalance": float(rng.uniform(1e-6, 2e-5))}
        if rng.random() < 0.3:
            mass, radius = rng.uniform(0.5, 8.0), rng.uniform(0.04, 0.12)
            inertia = float(mass * radius**2 / 4.0)
            disks.append(ad.Disk(mass=float(mass), diametral_inertia=inertia, polar_inertia=2.0 * inertia, **common))
        else:
            size = float(rng.uniform(0.1, 0.25))
            disks.append(ad.Disk(inner_diameter=0.06, outer_diameter=size, width=0.025, density=7800.0, **common))
    return tuple(disks)


def machine_of(rng):
    """A rotor on two magnets, on two bearings, or on both."""
    shaft = shaft_of(rng)
    length = float(shaft.length)
    disks = disks_of(rng, length)
    kind = rng.choice(["levitated", "both", "passive"], p=[0.45, 0.4, 0.15])
    mass = sum(float(d.total_mass) for d in disks) + 3.0
    bearings, magnets, sensors, controllers = (), (), (), {}
    if kind != "levitated":
        k, c = 10.0 ** rng.uniform(6.0, 7.3), 10.0 ** rng.uniform(1.7, 2.8)
        uneven = {} if rng.random() < 0.6 else {"kzz": float(k * rng.uniform(0.6, 0.9))}
        bearings = tuple(ad.Bearing(position=x, stiffness=float(k), damping=float(c), **uneven) for x in (0.0, length))
    if kind != "passive":
        gap, bias = float(rng.uniform(4e-4, 8e-4)), float(rng.uniform(1.0, 4.0))
        ends = [float(rng.uniform(0.02, 0.06)) * length, float(rng.uniform(0.94, 0.98)) * length]
        apart = rng.random() < 0.4
        sensors = (
            tuple(ad.Sensor(name=n, position=x * 0.95 + 0.01) for n, x in zip("ab", ends, strict=True)) if apart else ()
        )
        magnets = tuple(
            ad.Magnet(
                position=x,
                turns=float(rng.uniform(80, 160)),
                pole_area=float(rng.uniform(3e-4, 8e-4)),
                half_angle=0.39,
                gap=gap,
                bias_current=bias,
                resistance=0.4,
                axes_angle=math.pi / 4.0,
                **({"sensor": n} if apart else {}),
            )
            for n, x in zip("ab", ends, strict=True)
        )
        mu0 = 4e-7 * math.pi
        stiffness = [mu0 * m.turns**2 * m.pole_area * bias * math.cos(0.39) / gap**2 for m in magnets]
        ki = float(np.mean(stiffness))
        ks = ki * bias / gap
        net = ks * rng.uniform(0.5, 2.0)
        kp, damping = (ks + net) / ki, 2.0 * rng.uniform(0.2, 0.8) * math.sqrt(net * mass / 2.0) / ki
        chain = {
            "kp": float(kp),
            "kd": float(damping),
            "low_pass": ad.LowPass(frequency=float(10.0 ** rng.uniform(4.0, 4.8)), damping=0.7),
            "ki": float(kp * rng.uniform(0.5, 3.0)),
            "delay": float(rng.choice([0.0, 3e-5])),
        }
        if rng.random() < 0.5:
            chain["amplifier"] = ad.Amplifier(bandwidth=float(10.0 ** rng.uniform(4.0, 4.7)))
        if rng.random() < 0.3:
            chain["notches"] = (ad.Notch(frequency=float(rng.uniform(1e3, 6e3)), damping=0.2, width=0.7),)
        controllers = {"controller": ad.PID(**chain)}
        if rng.random() < 0.15:
            controllers["controller_z"] = ad.PID(**{**chain, "kp": float(kp * 1.1)})
    top = float(rng.uniform(600.0, 4000.0))
    return ad.Machine(
        name="random",
        rotor=ad.Rotor(shaft=shaft, disks=disks),
        bearings=bearings,
        magnets=magnets,
        sensors=sensors,
        operation=ad.Operation(top_speed=top, service_speed=0.5 * top),
        **controllers,
    )


def free_of(rng, machine):
    """Two to eight numbers with bounds."""
    options = {}
    for path, value in ad.numbers(machine):
        field = path.rpartition(".")[2]
        if path.startswith(("controller", "controller_z")):
            if field in ("kp", "ki", "kd") or path.endswith(
                ("low_pass.frequency", "amplifier.bandwidth", "notches[0].frequency")
            ):
                options[path] = (value / rng.uniform(1.5, 6.0), value * rng.uniform(1.5, 6.0), "log")
        elif field == "angle":
            options[path] = (-math.pi / 2.0, math.pi / 2.0)
        elif field == "thickness":
            options[path] = (0.6 * value, 1.5 * value)
        elif path.startswith("bearings") and field in ("stiffness", "damping", "kzz"):
            options[path] = (value / 3.0, value * 3.0, "log")
        elif path.startswith("rotor.disks") and field in ("position", "outer_diameter", "mass"):
            by = 0.01 if field == "position" else 0.1 * value
            options[path] = (value - by, value + by)
        elif path.startswith("rotor.shaft.segments") and field in ("inner_diameter", "outer_diameter") and value > 0.0:
            options[path] = (0.97 * value, 1.06 * value)
    if machine.magnets:
        bias = machine.magnets[0].bias_current
        options["magnets.bias_current"] = (0.6 * bias, 1.6 * bias)
        options["magnets.gap"] = (0.8 * machine.magnets[0].gap, 1.2 * machine.magnets[0].gap)
    names = list(options)
    chosen = rng.choice(names, min(len(names), int(rng.integers(2, 9))), replace=False)
    return {str(n): options[n] for n in chosen}


def limits_of(rng, machine):
    """One to four limits, one in ten of them hard to meet or impossible."""
    hard = rng.random() < 0.1
    top = machine.operation.top_speed
    limits = {
        "mass": rng.uniform(0.85, 1.3) * weight(machine),
        "damping_ratio": {"limit": 0.3 if hard else rng.uniform(1e-4, 5e-3), "window": (1.0, 2.0 * top)},
        "decay_rate": rng.uniform(0.1, 3.0),
        "hoop_strain": rng.uniform(2e-4, 4e-3),
        "separation_margin": rng.uniform(0.03, 0.2),
        "surface_speed": rng.uniform(100.0, 400.0),
    }
    if all(d.outer_diameter is None for d in machine.rotor.disks):
        del limits["surface_speed"]
    if machine.magnets:
        limits |= {
            "sensitivity_peak": 1.1 if hard else rng.uniform(2.0, 5.0),
            "bias_current": rng.uniform(0.9, 1.4) * machine.magnets[0].bias_current,
            "copper_loss": rng.uniform(0.8, 2.0) * loss(machine),
            "control_current": 10.0 ** rng.uniform(-1.5, 0.5),
            "total_current": machine.magnets[0].bias_current + 10.0 ** rng.uniform(-1.5, 0.5),
            "flux_density": rng.uniform(0.4, 1.3),
            "displacement_ratio": 10.0 ** rng.uniform(-2.0, -0.3),
            "voltage": 10.0 ** rng.uniform(0.7, 2.0),
        }
    chosen = rng.choice(list(limits), min(len(limits), int(rng.integers(1, 5))), replace=False)
    return {str(n): limits[n] for n in chosen}


def problem_of(seed):
    """The problem of a seed; a machine that no problem can be made of gives way to another one."""
    rng = np.random.default_rng(seed)
    refused = []
    for _ in range(60):
        try:
            machine = machine_of(rng)
            return _problem(rng, machine), refused
        except ad.SpecError as error:
            refused.append(str(error))
    raise RuntimeError("no problem in 60 trials")


def _problem(rng, machine):
    limits = limits_of(rng, machine)
    objective = {"maximise": "stability_limit"}
    if rng.random() < 0.3:
        sought = rng.choice(
            ["damping_ratio", "mass", "sensitivity_peak", "bias_current"][: 4 if machine.magnets else 2]
        )
        word = "maximise" if sought == "damping_ratio" else "minimise"
        objective = {word: str(sought), "speed": float(rng.uniform(0.2, 0.7) * machine.operation.top_speed)}
        if sought == "damping_ratio":
            objective[word] = {"quantity": "damping_ratio", "window": (1.0, 2.0 * machine.operation.top_speed)}
        limits.pop(str(sought), None)
    more = {}
    if rng.random() < 0.25:
        more["scenarios"] = {"other": {"rotor.shaft.viscous_damping": 1.2, "unbalance": 1.5}}
    if rng.random() < 0.5:
        count = len(machine.rotor.disks)
        more["unbalance"] = {"in phase": [5e-6] * count}
        if count > 1:
            more["unbalance"]["couple"] = [5e-6, *[0.0] * (count - 2), -5e-6]
    return ad.DesignProblem(machine, free=free_of(rng, machine), limits=limits, **objective, **more)


# --- the check, from the public analyses alone -----------------------------------------------------------------------


def radii(segment):
    """Inner and outer radius of each ply, or of the metal, with its density."""
    if segment.material is not None:
        return [(segment.inner_diameter / 2.0, segment.outer_diameter / 2.0, segment.material.density)]
    out, r = [], segment.inner_diameter / 2.0
    for ply in segment.plies:
        out.append((r, r + ply.thickness, ply.material.density))
        r += ply.thickness
    return out


def weight(machine):
    """Mass of the rotor [kg]."""
    shaft = sum(
        math.pi * (b**2 - a**2) * density * s.length for s in machine.rotor.shaft.segments for a, b, density in radii(s)
    )
    return float(shaft + sum(float(d.total_mass) for d in machine.rotor.disks))


def loss(machine):
    """Copper loss at bias [W]: four coils a magnet."""
    return sum(4.0 * m.resistance * m.bias_current**2 for m in machine.magnets)


def ring_strain(segment, speed):
    """Hoop strain of a thin ring at the outer radius, with the moduli of classical lamination theory."""
    outer = radii(segment)[-1][1]
    if segment.material is not None:
        return segment.material.density * (outer * speed) ** 2 / segment.material.E
    stiffness, total, mass = np.zeros((3, 3)), 0.0, 0.0
    for ply in segment.plies:
        m, c, s = ply.material, math.cos(ply.angle), math.sin(ply.angle)
        d = 1.0 - m.nu12**2 * m.E2 / m.E1
        own = np.array([[m.E1 / d, m.nu12 * m.E2 / d, 0.0], [m.nu12 * m.E2 / d, m.E2 / d, 0.0], [0.0, 0.0, m.G12]])
        turn = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
        stiffness += ply.thickness * turn.T @ own @ turn
        total, mass = total + ply.thickness, mass + ply.thickness * m.density
    modulus = 1.0 / (np.linalg.inv(stiffness / total)[1, 1])
    return mass / total * (outer * speed) ** 2 / modulus


def on_mesh(machine, mesh):
    """A machine on one of the meshes."""
    times, parts = mesh
    many = ad.replace(machine, {"rotor.shaft.elements": times * machine.rotor.shaft.elements})
    return ad.system(machine, plan(many).finer(parts))


def whirling(eigenvalues, window=(1.0, math.inf)):
    """Those within a window of frequencies."""
    frequency = np.abs(eigenvalues.imag)
    return eigenvalues[(frequency > max(window[0], 1.0)) & (frequency < window[1])]


def driven(loop, quantity, speeds):
    """Largest value over magnets and speeds under the unbalance of the disks."""
    found, response, mu0 = 0.0, ad.unbalance_response(loop, speeds), 4e-7 * math.pi
    for i, m in enumerate(loop.machine.magnets):
        current = np.abs(response.currents[:, i]).max(axis=1)
        v, w = response.at(m.position).T
        motion = np.abs(v + 1j * w) / 2.0 + np.abs(v - 1j * w) / 2.0
        total = m.bias_current + current
        inductance = mu0 * m.turns**2 * m.pole_area / (2.0 * m.gap)
        induced = mu0 * m.turns**2 * m.pole_area * m.bias_current / (2.0 * m.gap**2)
        table = {
            "control_current": current,
            "total_current": total,
            "flux_density": mu0 * m.turns * total / (2.0 * (m.gap - motion)),
            "displacement_ratio": motion / m.gap,
            "voltage": response.speeds * (inductance * current + induced * motion) + m.resistance * total,
        }
        found = max(found, float(table[quantity].max()))
    return found


def value_of(problem, loop, mesh, scenario, quantity, options, spectra, end):
    """A quantity over the range of speeds, seen at speeds of one's own, whose eigenvalues are known."""
    machine = loop.machine
    if quantity == "damping_ratio":
        inside = np.concatenate([whirling(e, options.get("window", (1.0, math.inf))) for e in spectra.values()])
        return float(np.min(-inside.real / np.abs(inside), initial=math.inf))
    if quantity == "decay_rate":
        return min(float(np.min(-whirling(e).real, initial=math.inf)) for e in spectra.values())
    if quantity == "sensitivity_peak":
        return max(ad.sensitivity(loop, s).worst.value for s in spectra)
    if quantity == "separation_margin":
        service = machine.operation.service_speed
        near = [c for c in ad.critical_speeds(loop, 3.0 * service) if c.whirl == "forward" and c.damping_ratio < 0.2]
        return min((abs(c.speed / service - 1.0) for c in near), default=math.inf)
    if quantity in ("mass", "copper_loss", "bias_current", "surface_speed", "hoop_strain"):
        return {
            "mass": lambda: weight(machine),
            "copper_loss": lambda: loss(machine),
            "bias_current": lambda: max(m.bias_current for m in machine.magnets),
            "surface_speed": lambda: max(d.outer_diameter for d in machine.rotor.disks if d.outer_diameter) / 2.0 * end,
            "hoop_strain": lambda: max(ring_strain(s, end) for s in machine.rotor.shaft.segments),
        }[quantity]()
    factor = 1.0 if scenario is None else scenario.unbalance
    own = [d.unbalance for d in machine.rotor.disks]
    critical = [
        c.speed * (1.0 + k * c.damping_ratio) for c in ad.critical_speeds(loop, end) for k in (-1, -0.5, 0, 0.5, 1, 2)
    ]
    grid = np.concatenate([list(spectra), np.linspace(end / 40.0, end, 40), critical])
    grid = np.unique(grid[(grid > 0.0) & (grid <= end)])
    worst = 0.0
    for amounts in [p.amounts for p in problem.patterns] or [own]:
        changes = {f"rotor.disks[{i}].unbalance": abs(a) * factor for i, a in enumerate(amounts)}
        changes |= {f"rotor.disks[{i}].unbalance_phase": 0.0 if a >= 0.0 else math.pi for i, a in enumerate(amounts)}
        worst = max(worst, driven(on_mesh(ad.replace(machine, changes), mesh), quantity, grid))
    return worst


def broken_promises(design, seed):
    """What a verified design claims and does not keep, with the excess relative to the limit."""
    return [b for mesh in MESHES for b in broken_on(mesh, design, seed)]


def broken_on(mesh, design, seed):
    """What a design does not keep on one of the meshes."""
    problem, rng = design.problem, np.random.default_rng([seed, 1])
    end, base = design.end, design.machine
    speeds = np.concatenate([[0.0], (np.arange(SPEEDS) + rng.random(SPEEDS)) / SPEEDS * end, [end]])  # one in each part
    out = []

    def found(quantity, scenario, excess):
        out.append({"quantity": quantity, "scenario": scenario, "excess": float(excess), "mesh": mesh})

    for scenario in (None, *problem.cases):
        machine, name = base, "" if scenario is None else scenario.name
        if scenario is not None:
            paths = {path: f for short, f in scenario.factors for path in ad.find(base, short)}
            values = dict(ad.numbers(base))
            machine = ad.replace(base, {path: f * values[path] for path, f in paths.items()})
        loop = on_mesh(machine, mesh)
        spectra = {float(s): np.linalg.eigvals(loop.matrix(float(s))) for s in speeds}
        reach = ad.stability_limit(loop, 1.02 * end, first_only=True)
        stable = 0.0 if reach.status in ("unstable at rest", "marginal") else reach.speed
        if stable < end * (1.0 - ALLOWED):
            found("stability", name, 1.0 - stable / end)
        growth = max(float(e.real.max()) for s, e in spectra.items() if s < end * (1.0 - ALLOWED))
        if growth > 1e-6 * end:
            found("spectrum", name, growth)
        for limit in problem.constraints:
            value = value_of(problem, loop, mesh, scenario, limit.quantity, dict(limit.options), spectra, end)
            excess = value / limit.bound - 1.0 if limit.kind.upper else 1.0 - value / limit.bound
            if not excess <= ALLOWED:
                found(limit.quantity, name, excess)
        if not problem.seeks_speed:  # what is claimed of the objective
            o = problem.objective
            value = value_of(problem, loop, mesh, scenario, o.quantity, dict(o.options), spectra, end)
            excess = value / design.objective - 1.0 if o.kind.upper else 1.0 - value / design.objective
            if not excess <= ALLOWED:
                found(f"objective {o.quantity}", name, excess)
    return out


# --- the benchmark ---------------------------------------------------------------------------------------------------


def run(seed):
    """What became of the problem of a seed; a warning counts as a crash."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return _run(seed)


def _run(seed):
    clock, record = time.process_time(), {"seed": seed}
    try:
        problem, refused = problem_of(seed)
        record |= {
            "refused": len(refused),
            "free": len(problem.variables),
            "limits": [c.quantity for c in problem.constraints],
        }
        record["objective"] = problem.objective.quantity
        design = solve(problem, STARTS, seed, effort=EFFORT)
        record["status"] = design.status
        record["value"] = design.objective if design.verified else None
        if design.verified:
            record["broken"] = broken_promises(design, seed)
            if record["broken"]:
                record["broken on a yet finer mesh"] = broken_on(CONVERGED, design, seed)
    except (ad.SpecError, ad.SolveError) as error:
        record |= {"status": "refused", "error": f"{type(error).__name__}: {error}"}
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{Path(where.filename).name}:{where.lineno}"
        record |= {
            "status": "crashed",
            "error": f"{type(error).__name__}: {error} ({place})",
            "trace": traceback.format_exc(),
        }
    return record | {"seconds": round(time.process_time() - clock, 1)}


def counts(records):
    """How many problems ended how."""
    out = Counter(r["status"] for r in records)
    broken = [r["broken on a yet finer mesh"] for r in records if r.get("broken")]
    return dict(out) | {"broken on one mesh only": broken.count([]), "false claims": sum(map(bool, broken))}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("number", type=int, nargs="?", default=200, help="how many problems")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--anew", action="store_true", help="forget what was finished before")
    args = parser.parse_args()
    from common import RESULTS, write

    kept = RESULTS / "random_problems.json"
    old = json.loads(kept.read_text())["problems"] if kept.exists() and not args.anew else []
    records = {r["seed"]: r for r in old if r["seed"] < args.number}
    missing = [seed for seed in range(args.number) if seed not in records]
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(run, seed) for seed in missing]):
            r = done.result()
            records[r["seed"]] = r
            problems = [records[s] for s in sorted(records)]
            print(
                f"{r['seed']:4d} {r['seconds']:6.1f} s  {r['status']} {r.get('error', '')} {r.get('broken') or ''}",
                flush=True,
            )
            write("random_problems", {"counts": counts(problems), "problems": problems})
    print("\n| outcome | problems |\n|---|---:|")
    for name, count in counts(records.values()).items():
        print(f"| {name} | {count} |")


if __name__ == "__main__":
    main()
