"""Every analysis works for every type of controller, and says why where it has no meaning."""

from __future__ import annotations

import json

import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.outline import outline
from amb_design.analysis.summary import analyse
from refine import Pencil, Root
from synthesis.levitated import laws, lqg, rotor, small

LAWS = laws()
every_law = pytest.mark.parametrize("name", LAWS)


@every_law
def test_summary(name: str) -> None:
    """The summary of a machine that is stable throughout holds what there is, and can be written as JSON."""
    machine = small(LAWS[name])
    analysis = analyse(machine)
    limit, loop = analysis.limit, ad.system(machine)
    stable = limit.status == "none below the top speed"
    assert stable or limit.status == "limit found"
    assert limit.certified
    worst = [np.linalg.eigvals(loop.matrix(s)).real.max() for s in np.linspace(0.0, 0.999 * limit.speed, 20)]
    assert max(worst) <= 1e-6  # integrators lie at zero
    document = json.loads(json.dumps(analysis.document(), allow_nan=False))
    loops = [] if "LQR" in name else [a.name for a in loop.plant.loops]
    speeds = [s.speed for s in analysis.sensitivities]
    assert not loops or (
        len(speeds) in (2, 3) and speeds == sorted(speeds)
    )  # the worst between the ends, if it is worse
    assert [s["loop"] for s in document["sensitivity"]] == len(speeds) * loops
    assert bool(document["limit_sensitivities"]) is not stable
    verdicts = {c["standard"]: c["where"] for c in document["criteria"]}
    assert ("ideal state feedback" in verdicts["ISO 14839-3"]) is ("LQR" in name)
    assert set(document["warning_topics"]) <= {"mesh"}
    assert json.dumps(outline(machine), allow_nan=False)


@every_law
def test_other_analyses(name: str) -> None:
    machine = small(LAWS[name])
    diagram = ad.campbell(machine, [0.0, 200.0, 400.0])
    assert (diagram.largest_real_part < 0.0).all()
    response = ad.unbalance_response(machine, [200.0, 700.0])
    assert np.isfinite(response.displacements).all()
    assert (response.peak_currents > 0.0).all()
    collocated = ad.replace(machine, {"magnets[0].sensor": ""})
    if "LQR" in name:
        with pytest.raises(ad.ModelError, match="no sensor at which its ideal state feedback could be opened"):
            ad.sensitivity(machine)
    else:
        assert ad.sensitivity(machine, 200.0).stable
    assert ad.sampled_stability(machine, ad.Sampling(period=2e-5), [100.0]).growth.max() < 0.0
    if name in ("PID", "state space, one input", "one input, rates"):
        assert ad.equivalent_coefficients(collocated, 400.0, points=5).stiffness.shape == (5, 2)
    else:
        with pytest.raises(ad.ModelError, match=r"couples axes|anisotropic"):
            ad.equivalent_coefficients(collocated)


@every_law
def test_proof(name: str) -> None:
    machine = small(LAWS[name])
    proof = ad.prove_stability_limit(machine, 200.0)
    assert proof.statements == ("stable from 0 to 200 rad/s",)
    assert proof.check() == list(proof.statements)


MOVED = ("rotor.shaft.segments[1].outer_diameter", "magnets[0].bias_current", "rotor.disks[0].mass")


@every_law
def test_gradient_of_the_limit(name: str) -> None:
    """With the law held fixed, against fourth-order differences; 1e-6."""
    designed = ad.replace(rotor(LAWS[name]), {"rotor.shaft.viscous_damping": 1.5e-4, "operation.top_speed": 5000.0})
    machine = ad.synthesise(designed)
    limit = ad.stability_limit(machine, first_only=True)
    mode = limit.mode
    assert mode is not None
    free = MOVED if "LQR" in name else (*MOVED, "controller.amplifier.bandwidth", "sensors[0].position")
    exact = ad.stability_gradient(designed, mode, free)
    loop = ad.system(machine)
    form = loop.complex_form
    start = Pencil(machine, None, form).onset(Root(mode.speed, mode.signed, 0.0, mode.right, mode.left))
    assert start.speed == pytest.approx(limit.speed, rel=1e-7)
    values = dict(ad.numbers(machine))
    worst = 0.0
    for path in free:
        h = 5e-4 * float(values[path])

        def onset(k: int, path: str = path, h: float = h) -> float:
            return Pencil(ad.replace(machine, {path: float(values[path]) + k * h}), None, form).onset(start).speed

        expected = (8.0 * (onset(1) - onset(-1)) - (onset(2) - onset(-2))) / (12.0 * h)
        worst = max(worst, abs(exact[path] - expected) * float(values[path]) / limit.speed)
    print(f"{name}: gradient of the limit {worst:.1e} of the limit")
    assert worst <= 1e-6


@pytest.mark.parametrize("name", [n for n in LAWS if "LQR" not in n])
def test_audit(name: str) -> None:
    """A design problem around each law is audited, and its rows are those of the analyses."""
    machine = small(LAWS[name])
    problem = ad.DesignProblem(
        machine,
        maximise="stability_limit",
        free={"controller.amplifier.bandwidth": (12000.0, 14000.0)},
        limits={"sensitivity_peak": 3.0, "control_current": 0.5, "damping_ratio": 1e-3},
    )
    found = ad.audit(problem, problem.start(), 400.0)
    rows = {f.quantity: f for f in found.findings}
    assert set(rows) == {"sensitivity_peak", "control_current", "damping_ratio"}
    speed = rows["sensitivity_peak"].speed
    assert rows["sensitivity_peak"].value == pytest.approx(ad.sensitivity(machine, speed).worst.value, rel=1e-6)
    row = rows["control_current"]
    assert row.value == pytest.approx(ad.unbalance_response(machine, [row.speed]).peak_currents.max(), rel=1e-9)


def test_hysteretic_damping_is_judged_under_one_law() -> None:
    """The warning compares two rotors; a law designed anew for the second would make it another comparison."""
    machine = ad.replace(rotor(lqg()), {"rotor.shaft.hysteretic_damping": 0.05})
    designed, weighed = (
        [f.text for f in ad.findings(m) if f.topic == "hysteretic"] for m in (ad.synthesise(machine), machine)
    )
    assert designed
    assert weighed == designed
