"""What is proven of machines, against their stability limits, sweeps of speeds and frequencies, and a second checker."""

from __future__ import annotations

import itertools
import json
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

import amb_design as ad
from amb_design.analysis.frequency import Loops
from amb_design.errors import AmbDesignError
from amb_design.proof.claims import Proof, check_proof, prove_stability_limit
from amb_design.proof.tolerances import directions, linear
from proof.flint_checker import confirms

Array = np.ndarray[Any, Any]

KI, KS = "magnets.current_stiffness", "magnets.negative_stiffness"


def compact(proof: Proof) -> str:
    return json.dumps(proof.certificate, separators=(",", ":"))


def bracketed(proof: Proof, machine: ad.Machine | ad.System) -> None:
    """The bracket is narrow and holds the stability limit."""
    limit = ad.stability_limit(machine, first_only=True)
    assert limit.status == "limit found"
    assert proof.upper is not None
    assert proof.lower < limit.speed < proof.upper
    assert proof.upper - proof.lower <= 2e-6 * limit.speed
    assert [c["kind"] for c in proof.certificate["claims"]] == ["stable", "unstable"]
    assert len(compact(proof)) < 1000


@pytest.fixture(scope="module")
def tuned() -> ad.Machine:
    return ad.load("thesis", "row4-tuned")


@pytest.fixture(scope="module")
def coarse(tuned) -> ad.Machine:
    """The same rotor on the coarsest mesh."""
    return ad.replace(tuned, {"rotor.shaft.elements": 2})


@pytest.fixture(scope="module")
def small(tuned) -> ad.System:
    """The same rotor on its four lowest modes."""
    return ad.system(tuned).truncated(4)


@pytest.fixture(scope="module")
def real() -> ad.Machine:
    """Bearings and controllers that differ in y and z."""
    return ad.replace(ad.load("thesis-anisotropic"), {"rotor.shaft.elements": 2})


# --- stability limits ------------------------------------------------------------------------------------------------


def test_thesis_rotor(tuned, tmp_path):
    proof = prove_stability_limit(tuned)
    bracketed(proof, tuned)
    assert proof.lower * 30.0 / np.pi == pytest.approx(9381.9, abs=0.1)
    assert confirms(proof.certificate, proof.matrices)
    file = proof.save(tmp_path / "proof.json")
    assert file.stat().st_size < 1000
    assert check_proof(file, tuned) == list(proof.statements)
    with pytest.raises(ad.SpecError, match="another machine"):
        check_proof(file, ad.replace(tuned, {"controller.kd": 0.0300001}))


def test_passive_machine():
    machine = ad.load("thesis", "row4-passive")
    proof = prove_stability_limit(machine)
    bracketed(proof, machine)
    assert len(proof.statements) == 2


def test_machine_in_real_form(real):
    loop = ad.system(real)
    assert not loop.complex_form
    proof = prove_stability_limit(real)
    bracketed(proof, real)
    assert not any(np.iscomplexobj(m) for m in proof.matrices.values())


def test_machine_without_limit(small):
    """Stable to the top speed: no claim of instability, and no upper speed."""
    proof = prove_stability_limit(small, 500.0)
    assert (proof.lower, proof.upper) == (500.0, None)
    assert proof.statements == ("stable from 0 to 500 rad/s",)
    assert confirms(proof.certificate, proof.matrices)


# --- tolerances ------------------------------------------------------------------------------------------------------


def at_corner(machine: ad.Machine, signs: dict[str, float]) -> ad.Machine:
    """The machine with numbers changed by parts of their values."""
    base = linear(machine)
    values = dict(ad.numbers(base))
    changes = {p: values[p] * (1.0 + d) for path, d in signs.items() for p in ad.find(base, path)}
    return ad.replace(base, changes)


def test_tolerance_of_the_current_stiffness(tuned):
    proof = prove_stability_limit(tuned, within={KI: 0.05})
    corners = [ad.stability_limit(at_corner(tuned, {KI: d}), first_only=True).speed for d in (-0.05, 0.05)]
    assert proof.robust is not None
    assert 0.99 * min(corners) < proof.robust < min(corners)
    claim = proof.certificate["claims"][-1]
    assert claim["box"] == {KI: 0.05}
    assert claim["speeds"] == [0.0, proof.robust]
    print(f"proven up to {proof.robust / min(corners):.5f} of the worst corner")


def test_two_tolerances(coarse):
    """All four corners, and random machines inside the box."""
    within = {KI: 0.05, KS: 0.1}
    proof = prove_stability_limit(coarse, within=within)
    assert proof.robust is not None
    corners = [{KI: a * 0.05, KS: b * 0.1} for a, b in itertools.product((-1.0, 1.0), repeat=2)]
    limits = [ad.stability_limit(at_corner(coarse, c), first_only=True).speed for c in corners]
    assert 0.98 * min(limits) < proof.robust < min(limits)
    rng = np.random.default_rng(1)
    for _ in range(10):
        inside = {KI: rng.uniform(-0.05, 0.05), KS: rng.uniform(-0.1, 0.1)}
        assert ad.stability_limit(at_corner(coarse, inside), first_only=True).speed > proof.robust


def test_second_checker_confirms_a_box(small):
    proof = prove_stability_limit(small, up_to=900.0, within={KI: 0.05})
    assert proof.robust is not None
    assert proof.robust >= 900.0 * (1.0 - 1e-9)
    assert confirms(proof.certificate, proof.matrices)


def paired(a: Array, b: Array) -> float:
    """Largest distance of two sets of eigenvalues, relative to their size."""
    cost = np.abs(a[:, None] - b) / np.maximum(1.0, np.abs(b))
    return float(cost[linear_sum_assignment(cost)].max())


@pytest.mark.parametrize(
    "path",
    [
        KI,
        KS,
        "magnets[0].current_stiffness",
        "bearings.stiffness",
        "bearings[1].damping",
        "controller.kp",
        "controller.kd",
        "controller.ki",
        "controller.low_pass.frequency",
        "controller.amplifier.bandwidth",
        "controller.notches[0].width",
    ],
)
def test_directions_move_the_eigenvalues_as_the_machine_does(coarse, path):
    loop, speed = ad.system(coarse), 500.0
    move = directions(loop, {path: 0.05})[path]
    base = np.linalg.eigvals(loop.matrix(speed))
    for d in (-0.05, -1e-3, 1e-3, 0.05):
        moved = np.linalg.eigvals(ad.system(at_corner(coarse, {path: d}), complex_form=loop.complex_form).matrix(speed))
        assert paired(np.linalg.eigvals(loop.matrix(speed) + d * move), moved) < 1e-9
        assert paired(base, moved) > 1e-6  # else nothing would have been compared


def test_directions_in_real_form(real):
    loop, speed = ad.system(real), 1000.0
    for path in (KI, "bearings.kzz", "controller_z.kp"):
        move = directions(loop, {path: 0.05})[path]
        assert not np.iscomplexobj(move)
        moved = np.linalg.eigvals(ad.system(at_corner(real, {path: 0.05}), complex_form=False).matrix(speed))
        assert paired(np.linalg.eigvals(loop.matrix(speed) + 0.05 * move), moved) < 1e-9


def test_several_directions_add_up(coarse):
    loop, speed = ad.system(coarse), 500.0
    for within in (
        {KI: 0.05, KS: 0.1, "bearings.stiffness": 0.02},
        {KI: 0.05, "controller.kp": -0.1},  # no product in the matrix: the current in between is a state
    ):
        moves = directions(loop, dict.fromkeys(within, 0.1))
        total = sum((within[path] * move for path, move in moves.items()), loop.matrix(speed))
        moved = ad.system(at_corner(coarse, within), complex_form=True).matrix(speed)
        assert paired(np.linalg.eigvals(total), np.linalg.eigvals(moved)) < 1e-9


@pytest.mark.parametrize(
    "path",
    [
        "magnets.gap",
        "magnets.bias_current",
        "magnets.half_angle",
        "magnets.position",
        "bearings.position",
        "rotor.disks.position",
        "rotor.disks.width",
        "segments.length",
        "material.E1",
        "rotor.shaft.viscous_damping",
    ],
)
def test_no_tolerance_of_what_moves_the_machine_otherwise(coarse, path):
    """These change the eigenvalues of the machine, but not (alone) the matrix of what is given: nothing may be proven of them."""
    try:
        ad.find(coarse, path)
    except ad.SpecError:
        pytest.skip("not a number of this machine")
    one_sentence(ad.SpecError, lambda: directions(ad.system(coarse), {path: 0.05}), path)


# --- damping and sensitivity -----------------------------------------------------------------------------------------


def test_damping_against_a_sweep(coarse):
    loop, end = ad.system(coarse), 600.0

    def least(speed: float) -> float:
        values = np.linalg.eigvals(loop.matrix(speed))
        return float((-values.real / np.abs(values)).min())

    worst = min(least(s) for s in np.linspace(0.0, end, 301))
    proof = prove_stability_limit(loop, damping_ratio=0.98 * worst, up_to=end)
    assert proof.damped is not None
    assert proof.damped >= end * (1.0 - 1e-9)
    assert confirms({**proof.certificate, "claims": proof.certificate["claims"][2:]}, proof.matrices)
    one_sentence(ad.SolveError, lambda: prove_stability_limit(loop, damping_ratio=1.001 * worst, up_to=end), "damping")
    free = prove_stability_limit(loop, damping_ratio=0.7 * worst)  # as far as it goes
    assert free.damped is not None
    assert end < free.damped <= free.lower
    assert min(least(s) for s in np.linspace(0.0, free.damped, 301)) > 0.7 * worst


@pytest.mark.parametrize("form", ["complex", "real"])
def test_sensitivity_against_a_sweep(coarse, real, form):
    """Of each loop, from the frequency response of the full model, which knows nothing of A."""
    loop, end = (ad.system(coarse), 600.0) if form == "complex" else (ad.system(real), 300.0)
    response = Loops(loop.plant)

    def peaks(speed: float) -> Array:
        values = np.linalg.eigvals(loop.matrix(speed))
        near = values[np.abs(values) < 1e5]
        grid = np.concatenate([near.imag + k * near.real for k in (-1.0, -0.5, 0.0, 0.5, 1.0)])
        grid = np.unique(np.concatenate([grid, np.geomspace(1.0, 1e5, 60), -np.geomspace(1.0, 1e5, 60)]))
        grid = grid[np.abs(grid) > 1e-3]
        return np.array([np.abs(np.diagonal(response.at(float(w), speed).sensitivity)) for w in grid]).max(axis=0)

    worst = np.max([peaks(s) for s in np.linspace(0.0, end, 6)], axis=0)
    proof = prove_stability_limit(loop, sensitivity_peak=1.03 * float(worst.max()), up_to=end)
    claims = [c for c in proof.certificate["claims"] if c["kind"] == "sensitivity"]
    assert [c["loop"] for c in claims] == list(range(len(worst)))
    assert proof.sensitive is not None
    assert proof.sensitive >= end * (1.0 - 1e-9)
    one_sentence(
        ad.SolveError,
        lambda: prove_stability_limit(loop, sensitivity_peak=0.999 * float(worst.max()), up_to=end),
        "sensitivity",
    )
    # the matrices of the claim give the same frequency response
    b, c, rng = proof.matrices["B"], proof.matrices["C"], np.random.default_rng(2)
    for w in rng.uniform(-3000.0, 3000.0, 5):
        for speed in (0.0, end):
            inner = np.linalg.solve(1j * w * np.eye(loop.size) - loop.matrix(speed), b)
            mine = 1.0 + np.einsum("ki,ik->k", c, inner)
            theirs = np.diagonal(response.at(float(w), speed).sensitivity)
            assert np.abs(mine - theirs).max() < 1e-8 * np.abs(theirs).max()


def test_second_checker_confirms_damping_and_sensitivity_in_real_form(real):
    loop = ad.system(real).truncated(4)
    proof = prove_stability_limit(loop, damping_ratio=1e-3, sensitivity_peak=10.0, up_to=200.0)
    assert len(proof.statements) == 2 + 1 + proof.matrices["B"].shape[1]
    assert confirms(proof.certificate, proof.matrices)


# --- what cannot be done ---------------------------------------------------------------------------------------------


def one_sentence(kind: type[AmbDesignError], call: Any, *words: str) -> None:
    """It is refused, in one sentence with these words."""
    with pytest.raises(kind) as caught:
        call()
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    assert ". " not in text
    for word in words:
        assert word in text, text


@pytest.mark.parametrize(
    ("kind", "asked", "words"),
    [
        (ad.SpecError, {"within": {"magnets.curent_stiffness": 0.05}}, ("did you mean",)),
        (ad.SpecError, {"within": {"nothing.at.all": 0.05}}, ("names no number",)),
        (ad.SpecError, {"within": {"controller.total_gain": 0.05, "controller.kp": 0.05}}, ("linearly",)),
        (ad.SpecError, {"within": {"controller.delay": 0.05}}, ()),
        (ad.SpecError, {"within": {KI: 0.05, "magnets[0].current_stiffness": 0.05}}, ("two tolerances",)),
        (ad.SpecError, {"within": {KI: 0.0}}, ("between 0 and 1",)),
        (ad.SpecError, {"within": {KI: 1.0}}, ("between 0 and 1",)),
        (ad.SpecError, {"within": {KI: -0.05}}, ("between 0 and 1",)),
        (ad.SpecError, {"within": {KI: float("nan")}}, ("between 0 and 1",)),
        (ad.ModelError, {"damping_ratio": 0.0}, ("between 0 and 1",)),
        (ad.ModelError, {"damping_ratio": 1.0}, ("between 0 and 1",)),
        (ad.ModelError, {"damping_ratio": float("nan")}, ("between 0 and 1",)),
        (ad.ModelError, {"sensitivity_peak": 1.0}, ("above 1",)),
        (ad.ModelError, {"sensitivity_peak": float("nan")}, ("above 1",)),
        (ad.ModelError, {"sensitivity_peak": 1e9}, ("sensitivity_peak = 1e+09",)),
        (ad.ModelError, {"up_to": 0.0}, ("positive",)),
        (ad.ModelError, {"up_to": float("inf")}, ("finite",)),
        (ad.ModelError, {"top_speed": -1.0}, ("positive",)),
        (ad.SolveError, {"up_to": 990.0}, ("proven up to 965.265", "990")),
        (ad.SolveError, {"up_to": 950.0, "within": {KI: 0.05}}, ("tolerances",)),
        (ad.SolveError, {"damping_ratio": 0.9}, ("at rest",)),
        (ad.SolveError, {"sensitivity_peak": 1.001}, ("at rest",)),
    ],
    ids=lambda value: json.dumps(value)[:60] if isinstance(value, dict) else "",
)
def test_refusals(small, kind, asked, words):
    one_sentence(kind, lambda: prove_stability_limit(small, **asked), *words)


def test_unstable_and_marginal_machines():
    one_sentence(ad.SolveError, lambda: prove_stability_limit(ad.load("thesis", "row4-controlled")), "unstable at rest")
    one_sentence(ad.SolveError, lambda: prove_stability_limit(ad.load("friswell-5-9-1")), "marginal")


def test_sensitivity_without_a_loop_is_refused():
    """Nothing would be proven of what was asked for."""
    machine = ad.load("thesis", "row4-passive")
    one_sentence(ad.ModelError, lambda: prove_stability_limit(machine, sensitivity_peak=3.0), "no control loop")


def test_certificate_beside_its_matrices(small, tmp_path):
    """A name for the certificate that would be that of the matrices."""
    proof = prove_stability_limit(small)
    try:
        file = proof.save(tmp_path / "proof.npz")
    except ad.SpecError:
        return
    assert check_proof(file) == list(proof.statements)
