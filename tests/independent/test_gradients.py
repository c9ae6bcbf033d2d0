"""Exact derivatives against differences of fourth order, for every number of a machine that has every kind of number.

Stability limit, critical speed and an eigenvalue are computed again for each changed machine, by inverse iteration and
Newton's method on the full model (see refine.py), not with the analyses of the package. The step is 0.5 % of the number, so
that the differences reach to 1 % on either side. Two kinds of numbers need less, for there the differences themselves are
not accurate to 1e-6: places along the shaft, where the model changes on the scale of the distance to the next station (0.5 %
of it), and cross coefficients that are zero (0.2 % of the direct coefficient: the quadratic effect is large beside the
linear one).
"""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
import pytest

import amb_design as ad
from amb_design.analysis.critical import critical_mode
from amb_design.analysis.gradient import movable
from amb_design.analysis.modes import Mode
from amb_design.analysis.polish import sparse
from amb_design.model.mesh import Mesh, plan
from amb_design.model.pair import Pair
from amb_design.spec.paths import find, value
from independent.everything import anisotropic_machine, isotropic_machine
from refine import Pencil, Root

TOLERANCE = 1e-6
STEP = 0.005
SPEED = 700.0  # for the eigenvalue
CROSS = ("kyz", "kzy", "cyz", "czy")  # alone these break the symmetry of y and z
INDIFFERENT = ("unbalance", "unbalance_phase", "leakage_inductance")  # no eigenvalue depends on these


def start(mode: Mode) -> Root:
    return Root(mode.speed, mode.signed, 0.0, mode.right, mode.left)


def upper(eigenvalue: complex) -> complex:
    return eigenvalue if eigenvalue.imag >= 0.0 else eigenvalue.conjugate()


class Case:
    """A machine with the three results that are differentiated."""

    def __init__(self, machine: ad.Machine, complex_form: bool):
        self.machine, self.complex_form = machine, complex_form
        self.mesh: Mesh = plan(machine)
        self.members = movable(machine, self.mesh)
        loop = ad.system(machine, self.mesh, complex_form)
        limit = ad.stability_limit(loop, first_only=True)
        assert limit.mode is not None
        critical = [c for c in ad.critical_speeds(loop) if c.whirl == "forward"][1]
        whirling = [m for m in ad.spectrum(loop, SPEED) if m.whirl == "forward" and m.damping_ratio < 0.2]
        modes = (limit.mode, critical_mode(loop, critical), whirling[1])
        own = ad.system(machine)  # the gradients are taken in the machine's own form
        if own.complex_form != complex_form:
            limit = ad.stability_limit(own, first_only=True)
            whirling = [m for m in ad.spectrum(own, SPEED) if m.whirl == "forward" and m.damping_ratio < 0.2]
        self.gradients = (
            ad.stability_gradient(machine, limit.mode),
            ad.critical_speed_gradient(machine, critical),
            ad.eigenvalue_gradient(machine, whirling[1]),
        )
        pencil = Pencil(machine, self.mesh, complex_form)
        self.roots = (
            pencil.onset(start(modes[0])),
            pencil.critical(start(modes[1])),
            pencil.root(SPEED, modes[2].signed, modes[2].right, modes[2].left),
        )

    def exact(self, name: str) -> np.ndarray:
        return np.array([g[name] for g in self.gradients], complex)

    def differences(self, name: str) -> np.ndarray:
        """Fourth-order central differences of limit, critical speed and eigenvalue."""
        h = self.step(name)
        f = {k: self.results(self.moved(name, k * h)) for k in (-2, -1, 1, 2)}
        return np.asarray((8.0 * (f[1] - f[-1]) - (f[2] - f[-2])) / (12.0 * h))

    def results(self, machine: ad.Machine) -> np.ndarray:
        pencil = Pencil(machine, self.mesh, self.complex_form)
        limit, critical, eigenvalue = self.roots
        moved = pencil.root(SPEED, eigenvalue.value, eigenvalue.right, eigenvalue.left)
        return np.array([pencil.onset(limit).speed, pencil.critical(critical).speed, upper(moved.value)], complex)

    def step(self, name: str) -> float:
        nominal = abs(value(self.machine, name))
        if name.endswith((".position", ".length")):
            x = sorted(s.position for s in self.mesh.stations)
            return STEP * min(abs(b - a) for a, b in itertools.pairwise(x))
        if name.endswith(CROSS) and not nominal:
            other = name.rpartition(".")[0] + (".stiffness" if "k" in name.rpartition(".")[2] else ".damping")
            return 0.4 * STEP * float(value(self.machine, other))
        if name.endswith((".kc", ".kc_rate")):  # cross gains are zero here; the proportional gain is their measure
            scale = 2e-4 if name.endswith("rate") else 1.0
            return scale * STEP * float(value(self.machine, name.rpartition(".")[0] + ".kp"))
        return STEP * nominal if nominal else STEP

    def moved(self, name: str, change: float) -> ad.Machine:
        """The machine with a number changed, and with it all that moves along."""
        paths = list(self.members[name])
        if name.endswith(".length"):  # what sits at a shaft end or step further right goes with it
            last = int(name.split("segments[")[1].split("]")[0])
            for station in self.mesh.stations:
                if isinstance(station.leader, int) and station.leader > last:
                    paths += station.members
        return ad.replace(self.machine, {p: value(self.machine, p) + change for p in paths})


@pytest.fixture(scope="module")
def isotropic() -> Case:
    return Case(isotropic_machine(), complex_form=True)


@pytest.fixture(scope="module")
def in_real_form() -> Case:
    return Case(isotropic_machine(), complex_form=False)


@pytest.fixture(scope="module")
def anisotropic() -> Case:
    return Case(anisotropic_machine(), complex_form=False)


def compare(case: Case, names: list[str], what: str) -> None:
    worst = np.zeros(3)
    where = ["", "", ""]
    for name in names:
        exact, differences = case.exact(name), case.differences(name)
        assert exact.all(), f"{name} is without effect"
        errors = np.abs(differences - exact) / np.abs(exact)
        for k in np.flatnonzero(errors > worst):
            worst[k], where[k] = errors[k], name
        assert errors.max() <= TOLERANCE, f"{name}: off by {errors}\n{differences}\n{exact}"
    print(f"{what}, {len(names)} numbers, worst relative errors of the gradients:")
    for result, error, name in zip(("stability limit", "critical speed", "eigenvalue"), worst, where, strict=True):
        print(f"    {result}: {error:.1e} ({name})")


def test_results_agree_with_the_analyses(isotropic: Case, anisotropic: Case) -> None:
    """What the differences are taken of is what the package reports."""
    for case in (isotropic, anisotropic):
        limit = ad.stability_limit(case.machine, first_only=True)
        assert case.roots[0].speed == pytest.approx(limit.speed, rel=3e-8)
        found = [c.speed for c in ad.critical_speeds(case.machine) if c.whirl == "forward"]
        assert case.roots[1].speed == pytest.approx(found[1], rel=1e-9)


def test_every_kind_of_number_is_there(isotropic: Case, anisotropic: Case) -> None:
    """The machine has all fields that any machine can have, but for those that only limit or document."""
    kinds = {p.rpartition(".")[2] for case in (isotropic, anisotropic) for p in case.members}
    expected = {
        *("length", "inner_diameter", "outer_diameter", "E", "G", "nu", "density", "E1", "E2", "G12", "G13", "G23"),
        *("nu12", "angle", "thickness", "shear_correction", "viscous_damping", "hysteretic_damping"),
        *(
            "external_damping",
            "position",
            "mass",
            "diametral_inertia",
            "polar_inertia",
            "width",
            "stiffness",
            "damping",
        ),
        *("kyy", "kyz", "kzy", "kzz", "cyy", "cyz", "czy", "czz", "turns", "pole_area", "half_angle", "gap"),
        *("bias_current", "current_stiffness", "negative_stiffness", "axes_angle", "sensor_gain", "frequency"),
        *("total_gain", "kp", "ki", "kd", "derivative_time", "delay", "gain", "bandwidth"),
    }
    assert expected <= kinds


def without_effect(name: str) -> bool:
    """Numbers on which the eigenvalues of the isotropic machine do not depend."""
    return name.endswith((*INDIFFERENT, "axes_angle")) or name in {
        "magnets[1].half_angle",  # this magnet is given by its coefficients
        "rotor.shaft.segments[2].inner_diameter",  # of a solid shaft: the second moment starts with its fourth power
    }


def test_isotropic(isotropic: Case) -> None:
    names = [n for n in isotropic.members if not n.endswith(CROSS) and not without_effect(n)]
    assert len(names) > 90
    compare(isotropic, names, "complex form")


def test_numbers_without_effect(isotropic: Case, anisotropic: Case) -> None:
    for name in isotropic.members:
        if without_effect(name):
            assert not isotropic.exact(name).any(), name
    for name in anisotropic.members:
        if name.endswith(INDIFFERENT):
            assert not anisotropic.exact(name).any(), name


def test_numbers_that_break_the_symmetry(in_real_form: Case) -> None:
    """A single cross coefficient makes the machine anisotropic; the complex form still has its derivative."""
    names = [n for n in in_real_form.members if n.endswith(CROSS)]
    assert len(names) == 8
    compare(in_real_form, names, "isotropic machine, single cross coefficients")


def test_anisotropic(anisotropic: Case) -> None:
    names = [
        n
        for n in anisotropic.members
        if n.startswith(("bearings[0].k", "bearings[0].c", "bearings[1].", "controller_z."))
        or n in {"magnets[0].axes_angle", "rotor.shaft.segments[0].plies[0].angle", "rotor.disks[0].position"}
    ]
    indifferent = {"bearings[1].kyz", "bearings[1].kzy", "bearings[1].cyz", "bearings[1].czy"}
    compare(anisotropic, [n for n in names if n not in indifferent], "real form")


@pytest.mark.parametrize("law", ["three-dimensional", "hoop-free-ply", "hoop-free-laminate"])
def test_ply_laws(law: str) -> None:
    case = Case(ad.replace(isotropic_machine(), {"rotor.shaft.ply_law": law}), complex_form=True)
    names = [n for n in case.members if ".plies[1]." in n or ".plies[0].angle" in n]
    if law == "hoop-free-laminate":
        free = [n for n in names if n.endswith((".G13", ".G23"))]  # lamination theory knows no transverse shear
        assert not any(case.exact(n).any() for n in free)
        names = [n for n in names if n not in free]
    compare(case, names, law)


def test_short_paths_tie_numbers(isotropic: Case) -> None:
    """A short path stands for the sum over all numbers that it fits."""
    machine, every = isotropic.machine, isotropic.gradients[0]
    limit = ad.stability_limit(machine, first_only=True)
    free = ("plies.angle", "controller.kd", "bearings.stiffness", "plies.material.E1")
    tied = ad.stability_gradient(machine, limit.mode, free)
    for path in free:
        assert len(find(machine, path)) >= 1
        assert tied[path] == pytest.approx(sum(every[p] for p in find(machine, path)), rel=1e-12)


def test_complex_and_real_form_have_the_same_gradient() -> None:
    """Without differences: y^H (dA0 + Omega dA1 - lam dE) x with the vectors of the real form, forward mode."""
    machine = isotropic_machine()
    mesh = plan(machine)
    members = movable(machine, mesh)
    real = ad.system(machine, mesh, complex_form=False)
    ours, theirs = (
        [m for m in ad.spectrum(s, SPEED) if m.whirl == "forward" and m.damping_ratio < 0.2][1]
        for s in (ad.system(machine, mesh), real)
    )
    assert abs(ours.eigenvalue - theirs.eigenvalue) < 1e-9 * abs(ours.eigenvalue)
    expected = ad.eigenvalue_gradient(machine, ours)
    loop = ad.closed_loop(machine, members, mesh, complex_form=False)
    norm = theirs.left.conj() @ (sparse(real.pencil.E) @ theirs.right)
    worst = 0.0
    derivative = np.zeros(len(members), complex)
    for factor, name in ((1.0, "A0"), (SPEED, "A1"), (-theirs.signed, "E")):
        matrix: Pair = getattr(loop.pencil, name)
        assert not matrix.im.nnz()
        jacobian = ca.Function("j", [loop.p], [ca.jacobian(ca.SX(matrix.re).nz[:], loop.p)])(loop.nominal).sparse()
        rows, columns = (np.array(i, int) for i in ca.SX(matrix.re).sparsity().get_triplet())
        derivative += factor * (jacobian.T @ (theirs.left.conj()[rows] * theirs.right[columns])) / norm
    largest = max(abs(v) * max(abs(value(machine, n)), 1e-6) for n, v in expected.items())
    for k, name in enumerate(members):
        got = derivative[k] if theirs.signed.imag >= 0 else derivative[k].conjugate()
        error = abs(got - expected[name])
        scale = max(abs(value(machine, name)), 1e-6)
        # rounding of the large entries that cancel is measured by the largest of all logarithmic derivatives
        assert error <= 1e-8 * abs(expected[name]) + 1e-11 * largest / scale, name
        if abs(expected[name]) * scale > 1e-4 * largest:
            worst = max(worst, error / abs(expected[name]))
    print(f"complex and real form, {len(members)} numbers, worst relative difference {worst:.1e}")
