"""Problems at the edges: nothing stable to start from, no limits, other objectives, no solution, no magnets, no limit to find."""

from __future__ import annotations

import math
from typing import Any

import pytest

import amb_design as ad
from amb_design.optimise.design import CONFLICT, SUCCESS, Design
from amb_design.optimise.solve import solve
from amb_design.optimise.start import INFEASIBLE, Effort
from amb_design.optimise.verification import TOLERANCE

QUICK = Effort(30, 20, 15)
STEEL = ad.Isotropic(E=205e9, nu=0.29, density=7850.0)
CARBON = ad.Orthotropic(E1=139e9, E2=11e9, G12=6.05e9, G13=6.05e9, G23=3.78e9, nu12=0.313, density=1578.0)


def levitated(**changes: Any) -> ad.Machine:
    """A steel shaft with a disk on two magnets."""
    machine = ad.Machine(
        name="levitated",
        rotor=ad.Rotor(
            shaft=ad.Shaft(
                segments=(ad.Segment(length=0.6, outer_diameter=0.03, material=STEEL),),
                viscous_damping=1e-3,
                elements=4,
            ),
            disks=(ad.Disk(position=0.3, mass=6.0, diametral_inertia=0.01, polar_inertia=0.02),),
        ),
        magnets=tuple(
            ad.Magnet(position=x, turns=100.0, pole_area=4e-4, gap=5e-4, bias_current=2.0, resistance=0.5)
            for x in (0.0, 0.6)
        ),
        controller=ad.PID(kp=2e4, ki=5e4, kd=30.0, low_pass=ad.LowPass(frequency=15000.0)),
        operation=ad.Operation(top_speed=1500.0),
    )
    return ad.replace(machine, changes)


def tube() -> ad.Machine:
    """A laminated tube with a disk on two damped bearings."""
    plies = ad.layup(CARBON, [0.8, -0.8, 0.3], [3e-3, 3e-3, 3e-3])
    return ad.Machine(
        name="tube",
        rotor=ad.Rotor(
            shaft=ad.Shaft(
                segments=(ad.Segment(length=1.0, inner_diameter=0.04, plies=plies),),
                shear_correction=0.53,
                viscous_damping=1e-4,
                elements=5,
            ),
            disks=(ad.Disk(position=0.5, inner_diameter=0.058, outer_diameter=0.25, width=0.04, density=7850.0),),
        ),
        bearings=tuple(ad.Bearing(position=x, stiffness=5e6, damping=300.0) for x in (0.0, 1.0)),
        operation=ad.Operation(top_speed=4000.0),
    )


GAINS = {"controller.kp": (5e3, 6e4, "log"), "controller.kd": (3.0, 150.0, "log")}


def holds(design: Design) -> None:
    """The design is what it says: verified, within its bounds, and stable on a machine made anew from its numbers."""
    assert design.status == SUCCESS, design.conflicts or [v.excesses for v in design.rejected]
    for v in design.problem.variables:
        assert v.lower * (1.0 - 1e-9) <= design.values[v.name] <= v.upper * (1.0 + 1e-9)
    machine = design.problem.with_values(design.values)
    limit = ad.stability_limit(machine, 1.01 * design.end, first_only=True)
    assert limit.certified
    assert limit.speed >= design.end * (1.0 - TOLERANCE)
    for row in design.limits:
        excess = row.value / row.bound - 1.0
        assert (excess if row.upper else -excess) <= TOLERANCE, row


def test_unstable_start() -> None:
    """The first start begins at the machine as it is, and that is unstable at rest."""
    machine = levitated(**{"controller.kp": 2e3, "controller.kd": 4.0})
    assert ad.stability_limit(machine).status == "unstable at rest"
    free = {"controller.kp": (1.5e3, 6e4, "log"), "controller.kd": (3.0, 150.0, "log")}
    problem = ad.DesignProblem(machine, maximise="stability_limit", free=free, limits={"sensitivity_peak": 4.0})
    design = solve(problem, starts=1, effort=QUICK)
    holds(design)
    assert design.objective > 0.3 * machine.operation.top_speed


def test_no_limits() -> None:
    """Stability alone counts; a limit below the top speed is met by a mode that becomes unstable there."""
    machine = levitated(**{"rotor.shaft.viscous_damping": 3e-3, "operation.top_speed": 4000.0})
    problem = ad.DesignProblem(machine, maximise="stability_limit", free={"controller.kd": (3.0, 60.0, "log")})
    design = solve(problem, starts=2, effort=QUICK)
    holds(design)
    assert design.limits == ()
    before = ad.stability_limit(machine)
    assert design.objective > before.speed
    meshes = (design.machine, ad.replace(design.machine, {"rotor.shaft.elements": 8}))
    beyond = [ad.stability_limit(m, 4000.0).speed for m in meshes]  # it must hold on both
    assert min(beyond) == pytest.approx(design.objective, rel=1e-3)


def test_least_mass() -> None:
    """The thinnest wall that the decay rate allows."""
    machine = tube()
    problem = ad.DesignProblem(
        machine,
        minimise="mass",
        speed=600.0,
        free={"plies.thickness": (1e-3, 6e-3), "plies[0].angle": (0.2, 1.2)},
        ties={"plies[1].angle": {"plies[0].angle": -1.0}},
        limits={"decay_rate": 2.0},
    )
    design = solve(problem, starts=2, effort=QUICK)
    holds(design)
    thickness = design.values["plies.thickness"]
    shaft = math.pi * ((0.02 + 3.0 * thickness) ** 2 - 0.02**2) * 1578.0 * 1.0
    disk = math.pi / 4.0 * (0.25**2 - 0.058**2) * 0.04 * 7850.0
    assert design.objective == pytest.approx(shaft + disk, rel=1e-6)
    row = design.limits[0]
    assert thickness == pytest.approx(1e-3, rel=1e-6) or row.active


def test_most_damping() -> None:
    machine = levitated()
    window = (1.0, 600.0)
    problem = ad.DesignProblem(
        machine, maximise={"quantity": "damping_ratio", "window": window}, speed=500.0, free=GAINS
    )
    design = solve(problem, starts=2, effort=QUICK)
    holds(design)

    def least(machine: ad.Machine) -> float:
        modes = [m for s in (0.0, 250.0, 500.0) for m in ad.spectrum(machine, s) if 1.0 < m.frequency < 600.0]
        return min(m.damping_ratio for m in modes)

    assert design.objective <= least(design.machine) * (1.0 + 1e-6)
    assert design.objective > least(machine)


def test_least_sensitivity() -> None:
    machine = levitated()
    problem = ad.DesignProblem(machine, minimise="sensitivity_peak", speed=300.0, free=GAINS)
    design = solve(problem, starts=2, effort=QUICK)
    holds(design)
    peaks = [ad.sensitivity(design.machine, s).worst.value for s in (0.0, 150.0, 300.0)]
    assert design.objective >= max(peaks) * (1.0 - 1e-3)
    assert design.objective < ad.sensitivity(machine, 0.0).worst.value


@pytest.mark.parametrize(
    ("quantity", "exact"), [("bias_current", lambda i: i), ("copper_loss", lambda i: 8.0 * 0.5 * i**2)]
)
def test_least_bias(quantity: str, exact: Any) -> None:
    """What keeps the bias up is the damping that the magnets have to give."""
    problem = ad.DesignProblem(
        levitated(),
        minimise=quantity,
        speed=300.0,
        free={"magnets.bias_current": (0.5, 4.0), **GAINS},
        limits={"sensitivity_peak": 2.5, "decay_rate": 30.0},
    )
    design = solve(problem, starts=2, effort=QUICK)
    holds(design)
    assert design.objective == pytest.approx(exact(design.values["magnets.bias_current"]), rel=1e-9)
    assert design.objective < exact(2.0)


def test_infeasible() -> None:
    """No controller has a sensitivity of almost one; the conflict says which limits are in each other's way."""
    problem = ad.DesignProblem(
        levitated(), maximise="stability_limit", free=GAINS, limits={"sensitivity_peak": 1.02, "bias_current": 3.0}
    )
    design = solve(problem, starts=2, effort=QUICK)
    assert design.status == CONFLICT
    assert not design.verified
    assert math.isnan(design.objective)
    assert all(o.status == INFEASIBLE for o in design.outcomes)
    named = {c["quantity"] for c in design.conflicts}
    assert "sensitivity_peak" in named
    assert "bias_current" not in named


def test_infeasible_for_want_of_stability() -> None:
    """With a hopeless controller nothing is stable, and that is what is in the way."""
    machine = levitated(**{"controller.kp": 3e3, "controller.kd": 4.0})
    free = {"controller.kp": (2e3, 4e3), "controller.kd": (3.0, 6.0)}
    design = solve(ad.DesignProblem(machine, maximise="stability_limit", free=free), starts=2, effort=QUICK)
    assert design.status == CONFLICT
    assert {c["quantity"] for c in design.conflicts} == {"stability"}


def test_no_magnets() -> None:
    """A passive composite shaft: ply angles and bearing damping against its own rotating damping."""
    machine = tube()
    problem = ad.DesignProblem(
        machine,
        maximise="stability_limit",
        free={"plies[0].angle": (0.0, 1.5), "plies[2].angle": (0.0, 1.5), "bearings.damping": (100.0, 500.0)},
        ties={"plies[1].angle": {"plies[0].angle": -1.0}},
        limits={"hoop_strain": 4e-3},
    )
    before = ad.stability_limit(machine)
    assert before.status == "limit found"
    design = solve(problem, starts=2, effort=QUICK)
    holds(design)
    assert design.objective > 1.05 * before.speed
    assert design.values["bearings.damping"] == pytest.approx(500.0, rel=1e-3)


def test_limit_beyond_the_top_speed() -> None:
    """The search ends at the top speed, which is then the answer."""
    machine = levitated(**{"operation.top_speed": 400.0})
    assert ad.stability_limit(machine).status == "none below the top speed"
    problem = ad.DesignProblem(machine, maximise="stability_limit", free=GAINS, limits={"sensitivity_peak": 4.0})
    design = solve(problem, starts=1, effort=QUICK)
    holds(design)
    assert design.objective == 400.0
