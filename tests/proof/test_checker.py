"""The checker of proofs against everything that might make it believe what is not true."""

from __future__ import annotations

import ast
import copy
import io
import itertools
import json
import math
import os
import pickle
import re
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flint import acb, acb_mat, arb, ctx

import amb_design as ad
from amb_design.proof import checker
from amb_design.proof.checker import Ball, ProofError, check, negative_definite, read
from amb_design.proof.claims import Proof, check_proof, prove_stability_limit
from amb_design.proof.cover import Cover, box_cover, cover
from proof.flint_checker import confirms, exact
from proof.planted import Family, boxed, crossing, damped, window

Array = np.ndarray[Any, Any]

WITNESS = 256
"""Bits of what is held against the checker."""


def certificate(matrices: Mapping[str, Array], *claims: dict[str, Any]) -> dict[str, Any]:
    """A certificate of these claims, with the right hash."""
    return {"format": checker.FORMAT, "sha256": checker.fingerprint(matrices), "claims": list(claims)}


def accepted(matrices: Mapping[str, Array], *claims: dict[str, Any]) -> bool:
    """True if the checker believes all claims; only a ProofError says that it does not."""
    try:
        check(certificate(matrices, *claims), matrices)
    except ProofError:
        return False
    return True


# --- balls -----------------------------------------------------------------------------------------------------------


def wild(rng: np.random.Generator, shape: tuple[int, int], kind: str) -> Array:
    """Entries of one size, of widely differing sizes, denormal, or with zeros between."""

    def part() -> Array:
        out = rng.normal(size=shape)
        if kind == "scales":
            out = out * 10.0 ** rng.uniform(-150.0, 150.0, shape)
        if kind == "denormal":
            out = out * 10.0 ** rng.uniform(-323.0, -290.0, shape)
        if kind == "rows":
            out = out * 10.0 ** rng.uniform(-60.0, 60.0, (shape[0], 1)) * 10.0 ** rng.uniform(-60.0, 60.0, shape[1])
        if kind == "sparse":
            out = out * (rng.random(shape) < 0.4) * 2.0 ** rng.integers(-40, 40, shape)
        return out

    return part() + 1j * part() if rng.random() < 0.5 else part()


def inside(rng: np.random.Generator, ball: Ball) -> acb_mat:
    """A matrix of the ball, exactly: on its rim, in its middle, or between."""
    size = rng.choice([0.0, 0.5, 1.0], ball.mid.shape)
    turn = rng.choice([1.0, -1.0, 1j, -1j], ball.mid.shape) if np.iscomplexobj(ball.mid) else rng.choice([1.0, -1.0])
    shift = size * ball.rad * turn  # never more than the radius, even where a denormal one is rounded
    return exact(ball.mid) + exact(np.asarray(shift))


def contains(ball: Ball, truth: acb_mat) -> bool:
    """True if each entry of the truth is surely within the radius."""
    mid = exact(ball.mid)
    return all(
        bool(abs(truth[i, j] - mid[i, j]) <= arb(float(ball.rad[i, j])))
        for i in range(mid.nrows())
        for j in range(mid.ncols())
    )


@pytest.mark.parametrize("kind", ["plain", "scales", "rows", "sparse", "denormal"])
def test_balls_contain_the_truth(kind):
    rng = np.random.default_rng(list(kind.encode()))
    checked = 0
    with ctx.workprec(4096 if kind == "scales" else 2048):  # sums of 1e-300 and 1e300 without rounding
        for _ in range(60):
            n, m, k = rng.integers(1, 9, 3)
            a, c = wild(rng, (n, m), kind), wild(rng, (n, m), kind)
            b = wild(rng, (m, k), kind)
            if kind == "plain" and m > 1 and rng.random() < 0.7:  # cancellation in the product and in the sum
                a = np.hstack([-(a[:, 1:] @ b[1:, :1] / b[0, 0]), a[:, 1:]])
                c = -a * (1.0 + 2.0**-50)
            radii = [2.0 ** rng.integers(-60, 1) * np.abs(x) * (rng.random() < 0.7) for x in (a, b, c)]
            x, y, z = (Ball(mid, rad) for mid, rad in zip((a, b, c), radii, strict=True))
            factor = complex(rng.normal(), rng.normal()) if rng.random() < 0.5 else float(rng.normal())
            factor *= 10.0 ** rng.uniform(-20.0, 20.0)
            product, total, scaled, turned = x @ y, x + z, x.scaled(factor), x.h
            for _ in range(3):
                u, v, w = inside(rng, x), inside(rng, y), inside(rng, z)
                for ball, truth in (
                    (product, u * v),
                    (total, u + w),
                    (scaled, u * acb(complex(factor).real, complex(factor).imag)),
                    (turned, u.transpose().conjugate()),
                ):
                    if np.isfinite(ball.mid).all():
                        assert contains(ball, truth)
                        checked += 1
    assert checked > 600


def test_radii_are_not_absurd():
    """Balls that contain everything would prove nothing."""
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(20, 20)), rng.normal(size=(20, 20))
    assert (Ball(a) @ Ball(b)).rad.max() < 1e-12
    assert (Ball(a) + Ball(b)).rad.max() < 1e-14


# --- definiteness ----------------------------------------------------------------------------------------------------


def hermitian(rng: np.random.Generator, n: int, least: float, real: bool) -> Array:
    """A Hermitian matrix with largest eigenvalue `least` (to rounding), the others from -1 down, some of them tiny too."""
    g = rng.normal(size=(n, n)) + (0.0 if real else 1j) * rng.normal(size=(n, n))
    u = np.linalg.qr(g)[0]
    values = -(10.0 ** rng.uniform(-3.0, 0.0, n))
    values[0], values[-1] = least, -1.0
    grade = 2.0 ** rng.integers(-20, 20, n) if rng.random() < 0.3 else np.ones(n)
    m = (u * values) @ u.conj().T * np.outer(grade, grade)
    return (m + m.conj().T) / 2.0


def not_negative(mid: Array, rad: Array) -> bool:
    """True if a vector is found which shows, in balls of 256 bits, that some Hermitian matrix in the ball is not negative."""
    shifted = mid
    for _ in range(3):
        x = np.linalg.eigh(shifted)[1][:, -1]
        phase = np.where(np.abs(x) > 0.0, x / np.maximum(np.abs(x), 1e-300), 1.0)
        shifted = mid + rad * np.outer(phase, phase.conj())  # the worst of the ball for this vector
        column, size = exact(x[:, None]), exact(np.abs(x)[:, None] * (1.0 - 1e-15))
        form = (column.transpose().conjugate() * exact(mid) * column)[0, 0].real
        if form + (size.transpose() * exact(rad) * size)[0, 0].real >= 0:
            return True
    return False


def test_no_ball_with_an_indefinite_matrix_is_negative_definite():
    rng = np.random.default_rng(20)
    witnesses = believed = 0
    with ctx.workprec(WITNESS):
        for case in range(2400):
            n = int(rng.integers(1, 9))
            sign = rng.choice([-1.0, 1.0])
            mid = hermitian(rng, n, sign * 10.0 ** -rng.uniform(6.0, 18.0), bool(case % 2))
            rad = np.zeros((n, n))
            if rng.random() < 0.6:
                rad = rng.random((n, n)) * 10.0 ** -rng.uniform(6.0, 18.0) * np.abs(mid).max()
                rad = (rad + rad.T) / 2.0
            scale = 2.0 ** rng.integers(-300, 300) if rng.random() < 0.2 else 1.0
            ball = Ball(mid * scale, rad * scale)
            verdict = negative_definite(ball)
            believed += verdict
            if not_negative(ball.mid, ball.rad):
                witnesses += 1
                assert not verdict, (case, n)
    assert witnesses > 1000
    assert believed > 300  # and it is no checker that refuses everything


def test_singular_matrices_are_not_definite():
    """Exactly singular, by construction in integers."""
    rng = np.random.default_rng(21)
    for _ in range(300):
        n = int(rng.integers(2, 9))
        g = rng.integers(-30, 31, (n, n - 1)) + (1j * rng.integers(-30, 31, (n, n - 1)) if rng.random() < 0.5 else 0.0)
        grade = 2.0 ** rng.integers(-30, 31, n)
        m = -(g @ g.conj().T) * np.outer(grade, grade)
        assert not negative_definite(Ball(m))
        assert not negative_definite(Ball(-np.diag(grade[np.arange(n) % (n - 1)] * (np.arange(n) < n - 1))))


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_no_number_is_not_definite(wrong):
    for n in (1, 3):
        for i, j in itertools.product(range(n), repeat=2):
            mid, rad = -np.eye(n), np.zeros((n, n))
            mid[i, j] = wrong
            with np.errstate(all="ignore"):
                assert not negative_definite(Ball(mid))
                rad[i, j] = abs(wrong)
                assert not negative_definite(Ball(-np.eye(n), rad))


# --- families with planted eigenvalues -------------------------------------------------------------------------------


def near(rng: np.random.Generator, family: Family) -> list[float]:
    """Places for cuts and middles: anywhere, at the planted eigenvalue, and close to it."""
    p = family.place
    close = [p, math.nextafter(p, 0.0), math.nextafter(p, math.inf), p * (1.0 - 10.0 ** -rng.uniform(2.0, 15.0))]
    return [*close, p * (1.0 + 10.0 ** -rng.uniform(2.0, 15.0)), *rng.uniform(family.low, family.high, 4)]


def at_random(rng: np.random.Generator, family: Family) -> Any:
    """A tree with random cuts of the speeds and of the box, and random middles."""

    def grow(edges: list[tuple[float, float]], left: int) -> Any:
        middles = [*near(rng, family), 0.5 * sum(edges[0]), 0.0, -1.0, 10.0 * family.high]
        axis = int(rng.integers(len(edges)))
        a, b = edges[axis]
        cuts = [c for c in (near(rng, family) if axis == 0 else rng.uniform(a, b, 3)) if a < c < b]
        if not left or not cuts:
            return float(0.5 * sum(edges[0]) if rng.random() < 0.5 else rng.choice(middles))
        place = float(rng.choice(cuts))
        low, high = list(edges), list(edges)
        low[axis], high[axis] = (a, place), (place, b)
        return [axis, place, grow(low, left - 1), grow(high, left - 1)]

    return grow([(family.low, family.high), *((-s, s) for s in family.sides)], int(rng.integers(0, 5)))


def covered(family: Family, parts: list[Array], high: float, resolution: float) -> Cover:
    """The cover that a prover makes of the parts."""
    balls = checker.Family([Ball(m) for m in parts])
    if family.sides:
        return box_cover(balls, high, family.sides)
    return cover(balls, family.low, high, resolution=resolution)


def covers(rng: np.random.Generator, family: Family) -> Iterator[Any]:
    """Covers that a liar may try on a family."""
    yield 0.5 * (family.low + family.high)
    yield at_random(rng, family)
    yield at_random(rng, family)
    how = rng.integers(3)
    if how == 0:  # the true cover of a family a little more stable
        shift = 10.0 ** -rng.uniform(1.0, 9.0)
        done = covered(family, family.shifted(shift), family.high, 0.05)
        if done.tree is not None and done.reached >= family.high:
            yield done.tree
    elif how == 1 and not family.sides:  # the family's own cover but for one short cell about the place
        parts = checker.Family([Ball(m) for m in family.parts])
        gap = family.place * 10.0 ** -rng.uniform(3.0, 14.0)
        below, above = family.place - gap, family.place + gap
        first = cover(parts, family.low, below, limit=family.place, resolution=0.05)
        if first.tree is not None and first.reached > family.low:
            rest: Any = family.place
            if family.kind == "window":
                beyond = cover(parts, above, family.high, resolution=0.05)
                if beyond.tree is not None and beyond.reached >= family.high:
                    rest = [0, above, rest, beyond.tree]
            yield [0, first.reached, first.tree, rest]


def planted(seed: int) -> Family:
    """A family of the first few hundred kinds."""
    rng = np.random.default_rng([seed, 7])
    real, normal = bool(rng.random() < 0.5), bool(rng.random() < 0.4)
    size = int(rng.integers(2, 5)) if real else int(rng.integers(2, 9))
    which = seed % 4
    if which == 0:
        return crossing(rng, size, real, normal)
    if which == 1:
        return window(rng, size, real, normal, 10.0 ** -rng.uniform(6.0, 10.0))
    if which == 2:
        return window(rng, size, real, normal, 0.0)
    return boxed(rng, size, real, normal, corner=bool(seed // 4 % 2))


@pytest.mark.parametrize("block", range(4))
def test_no_family_is_stable_that_is_not(block):
    """1000 families that are stable in the whole range but at one speed, or in a window of relative width 1e-6 to 1e-10."""
    lies = 0
    for seed in range(250 * block, 250 * block + 250):
        family, rng = planted(seed), np.random.default_rng([seed, 8])
        matrices = family.matrices()
        for tree in covers(rng, family):
            claim = {"kind": "stable", "speeds": [family.low, family.high], "box": family.box(), "cover": tree}
            assert not accepted(matrices, claim), (seed, family.kind)
            lies += 1
        here = {"kind": "stable", "speeds": [family.place] * 2, "box": family.box(), "cover": family.place}
        assert not accepted(matrices, here), (seed, family.kind)
    assert lies > 800


def test_planted_eigenvalues_are_where_they_should_be():
    """The largest real part at the place, with 256 bits."""
    with ctx.workprec(WITNESS):
        for seed in range(0, 120, 3):
            family = planted(seed)
            if family.kind == "corner":
                continue  # the corner is not known here
            m = exact(family.parts[0]) + exact(family.parts[1]) * acb(family.place)
            values = m.eig(algorithm="approx", tol=arb("1e-60"), maxiter=20000)
            worst = max(float(v.real.mid()) for v in values)
            assert abs(worst - family.over) <= 1e-25 + 1e-10 * family.over  # defective eigenvalues lose half the digits


def test_what_is_stable_is_proven():
    """The same families, a little more stable: else the tests above would show nothing."""
    proven = tried = 0
    for seed in range(200):
        family = planted(seed)
        if family.condition > 1e4:
            continue
        high = min(family.high, family.place) if family.kind == "crossing" else family.high
        parts = family.shifted(family.over + 1e-3)
        matrices = {"A0": parts[0], "A1": parts[1]} | {f"D_{k}": m for k, m in enumerate(parts[2:])}
        done = covered(family, parts, high, 1e-5)
        tried += 1
        if done.reached >= high:
            claim = {"kind": "stable", "speeds": [family.low, high], "box": family.box(), "cover": done.tree}
            assert accepted(matrices, claim)
            proven += 1
    print(f"{proven} of {tried} families")
    assert tried > 100
    assert proven > 0.9 * tried


def test_no_family_is_unstable_that_is_not():
    """On the axis at one speed is not unstable, nor is a range of speeds of which a part is stable."""
    for seed in range(200):
        family, rng = planted(seed), np.random.default_rng([seed, 9])
        by = family.over if rng.random() < 0.7 else family.over + 10.0 ** -rng.uniform(2.0, 12.0)
        if np.any(np.diag(family.shifted(by)[0]) + by != np.diag(family.parts[0])):
            by = family.over + 2.0**-10  # else the shift is rounded, and the truth unknown
        parts = family.shifted(by)
        matrices = {"A0": parts[0], "A1": parts[1]}
        speeds = [[family.low, family.place], [family.place, family.place], [0.5 * family.place, family.place]]
        if family.kind in ("corner", "inside"):
            matrices |= {f"D_{k}": m for k, m in enumerate(parts[2:])}
        for k, (low, high) in enumerate([*speeds, [family.low, family.high]]):
            if k == 3 and family.kind == "crossing" and low == high:
                continue
            for tree in (0.5 * (low + high), high, 10.0 * high, at_random(rng, family)):
                claim = {"kind": "unstable", "speeds": [low, high], "box": family.box(), "cover": tree}
                assert not accepted(matrices, claim), (seed, family.kind, low, high, tree)


def test_no_damping_ratio_that_is_not():
    proven = lies = 0
    for seed in range(110):
        rng = np.random.default_rng([seed, 10])
        real, normal = bool(rng.random() < 0.5), bool(rng.random() < 0.5)
        family, ratio = damped(rng, int(rng.integers(1, 5)), real, normal)
        above = float(ratio)
        while Fraction(above) <= ratio:
            above = math.nextafter(above, 1.0)
        for k, more in enumerate((0.0, *(10.0 ** -rng.uniform(1.5, 15.5, 3)))):
            z = max(above, min(above * (1.0 + more), 0.999))
            trees = [[0.5 * family.place] * 2, [family.place] * 2, [at_random(rng, family), at_random(rng, family)]]
            easier = family.shifted(10.0 ** -rng.uniform(0.0, 6.0))
            rotated = [checker.sector([Ball(m) for m in easier], s * z) for s in (1.0, -1.0)]
            found = [cover(checker.Family(r), family.low, family.high, resolution=0.1) for r in rotated if k == 1]
            if found and all(f.tree is not None and f.reached >= family.high for f in found):
                trees.append([f.tree for f in found])
            for tree in trees:
                claim = {"kind": "damping", "ratio": z, "speeds": [family.low, family.high], "cover": tree}
                assert not accepted(family.matrices(), claim), (seed, more)
                lies += 1
            at = {"kind": "damping", "ratio": z, "speeds": [family.place] * 2, "cover": [family.place] * 2}
            assert not accepted(family.matrices(), at), (seed, more)
        if family.condition < 1e3:
            low = {
                "kind": "damping",
                "ratio": float(ratio) * (1.0 - 1e-3),
                "speeds": [family.place] * 2,
                "cover": [family.place] * 2,
            }
            proven += accepted(family.matrices(), low)
    assert lies > 1200
    assert proven > 25


def test_no_sensitivity_that_is_not():
    """Against the value at one frequency near the peak, computed in balls of 256 bits."""
    proven = lies = 0
    for seed in range(100):
        rng = np.random.default_rng([seed, 11])
        n, real = int(rng.integers(2, 9)), seed % 2 == 0
        a = rng.normal(size=(n, n)) + (0.0 if real else 1j) * rng.normal(size=(n, n))
        a = a - (np.linalg.eigvals(a).real.max() + 10.0 ** rng.uniform(-2.0, 0.0)) * np.eye(n)
        a1 = 0.05 * rng.normal(size=(n, n)) if rng.random() < 0.5 else np.zeros((n, n))
        b = rng.normal(size=(n, 2)) * 10.0 ** rng.uniform(-2.0, 2.0)
        c = rng.normal(size=(2, n)) * 10.0 ** rng.uniform(-2.0, 0.0)
        loop, speed = int(rng.integers(2)), float(rng.uniform(0.0, 1.0))
        m = a + speed * a1
        if np.linalg.eigvals(m).real.max() > -1e-3:
            continue
        w = peak_frequency(m, b[:, loop], c[loop])
        with ctx.workprec(WITNESS):
            whole = exact(np.eye(n)) * acb(0, w) - exact(a) - exact(a1) * acb(speed)
            size = abs(1 + (exact(c[loop : loop + 1]) * whole.solve(exact(b[:, loop : loop + 1])))[0, 0])
            matrices = {"A0": a, "A1": a1, "B": b, "C": c}
            for k in (2.0, *rng.uniform(3.0, 13.0, 3)):
                gamma = float(size.mid()) * (1.0 - 10.0**-k)
                if not 1.0 < gamma < 1e6:
                    continue
                assert size > arb(gamma)
                claim = {"kind": "sensitivity", "below": gamma, "loop": loop, "speeds": [speed, speed]}
                for middle in (speed, 0.0, 2.0 * speed + 1.0):
                    assert not accepted(matrices, {**claim, "cover": [speed, middle]}), (seed, k)
                    lies += 1
                assert not accepted(
                    matrices, {**claim, "speeds": [0.5 * speed, 1.5 * speed], "cover": [speed, speed]}
                ), (seed, k)
                true = {**claim, "below": float(size.mid()) * (1.0 + 1e-3), "cover": [speed, speed]}
                proven += accepted(matrices, true)
    assert lies > 500
    assert proven > 120


def peak_frequency(m: Array, b: Array, c: Array, points: int = 161) -> float:
    """Where abs(1 + C (iw - A)^-1 B) is largest: a dense sweep about all eigenvalues, refined."""
    values = np.linalg.eigvals(m)
    width = np.linspace(-8.0, 8.0, points)
    grid = np.concatenate([[0.0], (values.imag[:, None] + width * np.abs(values.real)[:, None]).ravel()])

    def size(w: Array) -> Array:
        return np.abs(1.0 + np.linalg.solve(1j * w[:, None, None] * np.eye(len(m)) - m, b[:, None])[..., 0] @ c)

    step = 0.1 * float(np.abs(values.real).max())
    best = float(grid[np.argmax(size(grid))])
    for _ in range(12):
        grid = best + step * np.linspace(-1.0, 1.0, 21)
        best, step = float(grid[np.argmax(size(grid))]), 0.2 * step
    return best


# --- two checkers ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def machine() -> ad.Machine:
    return ad.load("thesis", "row4-tuned")


@pytest.fixture(scope="module")
def small(machine) -> Proof:
    """All kinds of claims about the thesis rotor on its four lowest modes."""
    loop = ad.system(machine).truncated(4)
    return prove_stability_limit(
        loop, damping_ratio=0.01, sensitivity_peak=4.0, up_to=300.0, within={"magnets.current_stiffness": 0.05}
    )


@pytest.fixture(scope="module")
def whole(machine) -> Proof:
    return prove_stability_limit(machine)


def test_both_checkers_agree_on_all_kinds(small):
    kinds = [c["kind"] for c in small.certificate["claims"]]
    assert kinds == ["stable", "unstable", "damping", "sensitivity", "sensitivity", "stable"]
    assert len(small.check()) == 6
    assert confirms(small.certificate, small.matrices)


def last_leaf(tree: Any) -> list[Any] | None:
    """The node that holds the cell of highest speed."""
    while isinstance(tree, list) and isinstance(tree[3], list):
        tree = tree[3]
    return tree if isinstance(tree, list) else None


def test_what_one_checker_believes_the_other_one_proves(small):
    """Speeds moved up to the crossing and beyond it, on the rotor and on planted families; and ranges of other claims."""
    both = neither = only_other = 0
    cases: list[tuple[Mapping[str, Array], dict[str, Any], bool | None]] = []
    limit = 0.5 * (small.lower + (small.upper or 0.0))
    stable, unstable = small.certificate["claims"][:2]
    for k in range(6, 14):
        for sign in (-1.0, 1.0):
            edge = limit * (1.0 + sign * 10.0**-k)
            claim = copy.deepcopy(stable)
            claim["speeds"][1] = edge
            node = last_leaf(claim["cover"])
            assert node is not None
            if node[1] < edge:
                cases.append((small.matrices, claim, None))
            for gap in (1e-3, 1e-5):
                short = {"kind": "stable", "speeds": [edge * (1.0 - gap * 10.0 ** (6 - k)), edge], "cover": edge}
                cases.append((small.matrices, short, None))
            cases.append((small.matrices, {**unstable, "speeds": [edge, edge], "cover": edge}, None))
    for seed in range(120):
        rng = np.random.default_rng([seed, 12])
        normal = bool(seed % 3)
        family = crossing(rng, int(rng.integers(2, 6)), bool(seed % 2), normal)
        matrices = {"A0": family.parts[0] - family.over * np.eye(len(family.parts[0])), "A1": family.parts[1]}
        k = rng.uniform(6.0, 13.0)
        edge = family.place * (1.0 - 10.0**-k)
        start = edge - (family.place - edge) * 10.0 ** rng.uniform(-1.0, 0.5)
        cases.append((matrices, {"kind": "stable", "speeds": [start, edge], "cover": 0.5 * (start + edge)}, None))
        over = family.place * (1.0 + 10.0**-k)
        cases.append((matrices, {"kind": "unstable", "speeds": [over, over], "cover": over}, None))
        over = family.place * (1.0 + 1e-16)
        cases.append((matrices, {"kind": "stable", "speeds": [start, over], "cover": edge}, False))
    for matrices, claim, truth in cases:
        believed = accepted(matrices, claim)
        confirmed = confirms(certificate(matrices, claim), matrices) if believed or rare(claim) else False
        assert confirmed or not believed, claim
        assert truth is None or not (believed or confirmed), claim
        both += believed
        only_other += confirmed and not believed
        neither += not (believed or confirmed)
    print(f"{both} by both, {only_other} by the second one alone, {neither} by neither of {len(cases)}")
    assert both > 100
    assert neither > 100


def rare(claim: Mapping[str, Any]) -> bool:
    """The second checker is slow; it looks at a part of what the first one refuses too."""
    return int(1e9 * claim["speeds"][1]) % 12 == 0


# --- alterations -----------------------------------------------------------------------------------------------------

LOOSE = [
    0,
    1,
    -1,
    0.0,
    -0.0,
    5e-324,
    1e-9,
    0.5,
    1.5,
    982.5,
    1e4,
    1e299,
    -1e299,
    1e301,
    1e308,
    10**400,
    -(10**400),
    2**63,
]
OTHER = [math.nan, math.inf, -math.inf, "", "0", "stable", "nan", True, False, None, [], [[]], [0], {}, {"a": 0}]


def nodes(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all values inside a certificate."""
    if path:
        yield path
    if isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from nodes(inner, (*path, key))


def mutated(rng: np.random.Generator, original: dict[str, Any]) -> dict[str, Any]:
    """A copy with one to three random alterations."""
    out = copy.deepcopy(original)
    for _ in range(int(rng.choice([1, 1, 2, 3]))):
        paths = list(nodes(out))
        claims = [p for p in paths if p[0] == "claims"]
        path = (claims if claims and rng.random() < 0.85 else paths)[rng.integers(len(claims or paths))]
        if path not in paths:
            continue
        holder = out
        for key in path[:-1]:
            holder = holder[key]
        key, old = path[-1], holder[path[-1]]
        kind = rng.integers(9)
        if kind <= 1 and isinstance(old, int | float):
            holder[key] = float(old * (1.0 + rng.choice([-1.0, 1.0]) * 10.0 ** -rng.uniform(0.0, 16.0)))
        elif kind == 2:
            holder[key] = LOOSE[rng.integers(len(LOOSE))]
        elif kind == 3:
            holder[key] = copy.deepcopy(OTHER[rng.integers(len(OTHER))])
        elif kind == 4:
            del holder[key]
        elif kind == 5 and isinstance(holder, dict):
            holder[f"{key}s"] = holder.pop(key)
        elif kind == 6 and isinstance(old, list) and len(old) == 4:  # a cut
            if rng.random() < 0.5:
                old[2], old[3] = old[3], old[2]
            else:
                old[int(rng.integers(2))] = [1, -1, 5.0, 1e4, 2, 0.01][rng.integers(6)]
        elif kind == 7 and path[0] == "claims":
            claim = out["claims"][path[1]] if isinstance(out["claims"], list) and len(path) > 1 else None
            if isinstance(claim, dict):
                which = rng.integers(4)
                if which == 0:
                    claim["kind"] = ["stable", "unstable", "damping", "sensitivity"][rng.integers(4)]
                elif which == 1 and isinstance(claim.get("speeds"), list) and len(claim["speeds"]) == 2:
                    wide = claim["speeds"][1]
                    if isinstance(wide, int | float) and abs(wide) < 1e290:
                        claim["speeds"][1] = wide * (1.0 + 10.0 ** -rng.uniform(0.0, 7.0))
                elif which == 2:
                    other = original["claims"][rng.integers(len(original["claims"]))]
                    claim["cover"] = copy.deepcopy(other["cover"])
                else:
                    claim["box"] = {"magnets.current_stiffness": float(rng.choice([1e-3, 0.06, 0.5, 0.051]))}
        elif kind == 8 and isinstance(old, str):
            k = int(rng.integers(len(old) + 1))
            holder[key] = old[:k] + rng.choice(["0", "f", " ", "\n", "é", "\U0001d538"]) + old[k + 1 :]
    return out


def is_true(claim: Mapping[str, Any], matrices: Mapping[str, Array], limit: ad.StabilityLimit) -> bool:
    """What the claim states, found by the stability limit, eigenvalues and sweeps."""
    low, high = map(float, claim["speeds"])
    a0, a1 = matrices["A0"], matrices["A1"]
    speeds = np.linspace(low, high, 2 if low == high else 40)
    spectra = [np.linalg.eigvals(a0 + s * a1) for s in speeds]
    if claim["kind"] == "unstable":
        return all(v.real.max() > 0.0 for v in spectra)
    if not high < limit.bracket[1]:
        return False
    if claim["kind"] == "damping":
        return all((-v.real / np.abs(v)).min() > claim["ratio"] for v in spectra)
    if claim["kind"] == "sensitivity":
        k = claim["loop"]
        b, c = matrices["B"][:, k], matrices["C"][k]
        for s in speeds[::8]:
            m = a0 + s * a1
            w = peak_frequency(m, b, c, 33)
            if abs(1.0 + c @ np.linalg.solve(1j * w * np.eye(len(m)) - m, b)) >= claim["below"]:
                return False
        return True
    for corner in itertools.product(*((-s, 0.0, s) for s in claim.get("box", {}).values())):
        shift = sum((d * matrices[f"D_{n}"] for d, n in zip(corner, claim.get("box", {}), strict=True)), a0)
        if max(np.linalg.eigvals(shift + s * a1).real.max() for s in speeds) >= 0.0:
            return False
    return claim["kind"] == "stable"


def alter(proof: Proof, limit: ad.StabilityLimit, seeds: range, count: int) -> tuple[int, int]:
    """How many altered certificates were refused, and how many are true; fails if one is neither."""
    sentences: list[str] = []
    known: dict[str, bool] = {}
    true = 0
    for seed in seeds:
        rng = np.random.default_rng([seed, 13])
        trial = copy.deepcopy(proof.certificate)
        trial["claims"] = [trial["claims"][i] for i in sorted(rng.choice(count, min(2, count), replace=False))]
        altered = mutated(rng, trial)
        try:
            statements = check(read(json.dumps(altered)), proof.matrices)
        except ProofError as error:
            sentences.append(str(error))
            continue
        assert len(statements) == len(altered["claims"])
        for claim in altered["claims"]:
            text = json.dumps({k: v for k, v in claim.items() if k != "cover"}, sort_keys=True)
            if text not in known:
                known[text] = is_true(claim, proof.matrices, limit)
            assert known[text], (seed, claim)
        true += 1
    assert all(len(text.splitlines()) == 1 for text in sentences)
    return len(sentences), true


def test_altered_certificates_are_refused_or_true(machine, small):
    limit = ad.stability_limit(ad.system(machine).truncated(4), first_only=True)
    refused, true = alter(small, limit, range(400), 6)
    print(f"{refused} refused, {true} true")
    assert refused > 220
    assert true > 20


def test_altered_certificates_of_the_whole_machine(machine, whole):
    limit = ad.stability_limit(machine, first_only=True)
    refused, true = alter(whole, limit, range(1000, 1030), 2)
    print(f"{refused} refused, {true} true")
    assert refused > 12


def test_wider_speeds_are_refused(whole):
    """The range of the proof itself, moved up to the limit and beyond."""
    stable = whole.certificate["claims"][0]
    for more in (2e-6, 1e-5, 1e-3, 0.1, 1.0):
        claim = {**stable, "speeds": [0.0, whole.lower * (1.0 + more)]}
        assert not accepted(whole.matrices, claim)
    assert accepted(whole.matrices, stable)


def test_altered_matrices_are_refused(whole):
    rng = np.random.default_rng(14)
    for _ in range(60):
        name = str(rng.choice(["A0", "A1"]))
        altered = {k: v.copy() for k, v in whole.matrices.items()}
        data = altered[name].view(np.uint64).ravel()
        data[rng.integers(len(data))] ^= np.uint64(1) << np.uint64(rng.integers(64))
        with pytest.raises(ProofError, match="other matrices"):
            check(whole.certificate, altered)


def test_other_names_and_shapes_are_other_matrices(small):
    a0, a1 = small.matrices["A0"], small.matrices["A1"]
    for other in (
        {**small.matrices, "A0": a1, "A1": a0},
        {**small.matrices, "E": a0},
        {k: v for k, v in small.matrices.items() if k != "C"},
        {**small.matrices, "A0": a0.reshape(4, -1)},
        {**small.matrices, "A0": a0.T},
        {},
    ):
        with pytest.raises(ProofError, match="other matrices"):
            check(small.certificate, other)


# --- numbers that are not doubles ------------------------------------------------------------------------------------


def test_integers_do_not_overflow_into_a_proof():
    """1 + 512/(s + 300) peaks at 2.7; products of 8-bit integers would wrap around and prove a peak below 1.5."""
    whole = {
        "A0": np.diag([-300, -300]).astype(np.int16),
        "A1": np.zeros((2, 2), np.int16),
        "B": np.array([[16], [16]], np.int8),
        "C": np.array([[16, 16]], np.int8),
    }
    claim = {"kind": "sensitivity", "speeds": [0, 1], "below": 1.5, "loop": 0, "cover": [0.5, 0.5]}
    assert not accepted(whole, claim)
    assert not accepted({k: v.astype(float) for k, v in whole.items()}, claim)


def test_short_floats_are_not_rounded_in_a_proof():
    """Products in 32 bits err by 1e-8, but radii are those of 64 bits."""
    for seed in range(40):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(2, 6))
        a = rng.normal(size=(n, n)).astype(np.float32)
        a -= np.float32(np.linalg.eigvals(a).real.max() + 0.2) * np.eye(n, dtype=np.float32)
        values = np.linalg.eigvals(a.astype(float))
        ratio = float((-values.real / np.abs(values)).min())
        for more in (1e-9, 3e-9, 1e-8):
            claim = {"kind": "damping", "speeds": [0, 0], "ratio": min(ratio * (1.0 + more), 0.999), "cover": [0, 0]}
            if claim["ratio"] > ratio:
                assert not accepted({"A0": a, "A1": 0 * a}, claim), (seed, more)


SENSELESS: dict[str, dict[str, Array | None]] = {
    "no states": {"A0": np.zeros((0, 0)), "A1": np.zeros((0, 0))},
    "numbers": {"A0": np.array(-1.0), "A1": np.array(0.0)},
    "vectors": {"A0": -np.ones(3), "A1": np.zeros(3)},
    "oblong": {"A0": -np.ones((2, 3)), "A1": np.zeros((2, 3))},
    "two sizes": {"A1": np.zeros((3, 3))},
    "nan": {"A0": np.full((2, 2), np.nan)},
    "infinite": {"A0": np.full((2, 2), -np.inf)},
    "long doubles": {"A0": -np.eye(2, dtype=np.longdouble)},
    "words": {"A0": np.array([["-1.0", "0.0"], ["0.0", "-1.0"]])},
    "B and C numbers": {"B": np.array(1.0), "C": np.array(1.0)},
    "B and C deep": {"B": np.ones((2, 1, 3)), "C": np.ones((3, 1, 2))},
    "no loop": {"B": np.ones((2, 0)), "C": np.ones((0, 2))},
    "other B and C": {"B": np.ones((3, 1)), "C": np.ones((1, 3))},
    "nan in B": {"B": np.full((2, 1), np.nan)},
    "no B": {"B": None},
}


@pytest.mark.parametrize("change", SENSELESS.values(), ids=SENSELESS)
def test_matrices_that_make_no_sense_are_refused(change):
    whole = {"A0": -np.eye(2), "A1": np.zeros((2, 2)), "B": np.ones((2, 1)), "C": np.ones((1, 2))} | change
    matrices = {k: v for k, v in whole.items() if v is not None}
    with pytest.raises(ProofError):
        check(
            certificate(
                matrices, {"kind": "sensitivity", "below": 3.0, "loop": 0, "speeds": [0, 1], "cover": [0.5, 0.5]}
            ),
            matrices,
        )


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e-100, 1e100, 1e150, 1e200, 1e300])
def test_tiny_and_huge_matrices_are_not_believed_wrongly(size):
    for a in (np.diag([-1.0, 1.0]), np.diag([-1.0, 0.0]), np.array([[0.0, 1.0], [-1.0, 0.0]]), np.diag([-1.0, 1e-10])):
        matrices = {"A0": a * size, "A1": np.zeros((2, 2))}
        assert not accepted(matrices, {"kind": "stable", "speeds": [0, 1], "cover": 0.5})
    for a in (np.diag([-1.0, -1.0]), np.diag([-1.0, 0.0]), np.array([[0.0, 1.0], [-1.0, 0.0]])):
        matrices = {"A0": a * size, "A1": np.zeros((2, 2))}
        assert not accepted(matrices, {"kind": "unstable", "speeds": [0, 1], "cover": 0.5})


# --- what is stated --------------------------------------------------------------------------------------------------


def test_statements_do_not_say_more_than_was_proven():
    """Printed numbers are rounded to the safe side."""
    rng = np.random.default_rng(15)
    matrices = {
        "A0": -np.eye(2) + 0.5 * np.array([[0.0, 1.0], [-1.0, 0.0]]),
        "A1": np.zeros((2, 2)),
        "B": np.array([[0.3], [0.1]]),
        "C": np.array([[0.2, 0.1]]),
        "D_x": np.zeros((2, 2)),
    }
    for _ in range(40):
        low, high = sorted(rng.uniform(0.0, 1000.0, 2))
        side, ratio, gamma = rng.uniform(0.0, 1.0), rng.uniform(0.1, 0.5), rng.uniform(1.5, 3.0)
        claims = [
            {"kind": "stable", "speeds": [low, high], "box": {"x": side}, "cover": low},
            {"kind": "damping", "speeds": [low, high], "ratio": ratio, "cover": [low, low]},
            {"kind": "sensitivity", "speeds": [low, high], "loop": 0, "below": gamma, "cover": [low, low]},
        ]
        stated = check(certificate(matrices, *claims), matrices)
        for text in stated:
            a, b = map(float, re.search(r"from (\S+) to (\S+) rad/s", text).groups())  # type: ignore[union-attr]
            assert low <= a <= b <= high, text
        assert float(re.search(r"x within (\S+) %", stated[0])[1]) <= 100.0 * side  # type: ignore[index]
        assert float(re.search(r"above (\S+) ", stated[1])[1]) <= ratio, stated[1]  # type: ignore[index]
        assert float(re.search(r"below (\S+) ", stated[2])[1]) >= gamma, stated[2]  # type: ignore[index]


# --- files -----------------------------------------------------------------------------------------------------------


def packed(**members: Any) -> bytes:
    """An .npz file."""
    out = io.BytesIO()
    np.savez_compressed(out, **members)
    return out.getvalue()


def zipped(**members: bytes) -> bytes:
    """A ZIP file with other things inside."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        for name, data in members.items():
            file.writestr(name.replace("_npy", ".npy"), data)
    return out.getvalue()


def array_file(array: Array, **options: Any) -> bytes:
    """An .npy file."""
    out = io.BytesIO()
    np.save(out, array, **options)
    return out.getvalue()


ENDLESS = b"{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000,), }\n"
STRANGE = {
    "empty": b"",
    "one byte": b"P",
    "text": b"matrices",
    "binary": bytes(range(256)),
    "no zip": b"PK\x03\x04" + bytes(100),
    "an array": array_file(np.eye(2)),
    "pickle": pickle.dumps({"A0": np.eye(2)}),
    "pickled array": array_file(np.array([{}], object), allow_pickle=True),
    "pickled member": packed(A0=np.array([{}], object)),
    "other matrices": packed(A0=np.eye(3)),
    "no member": zipped(),
    "text member": zipped(A0=b"hello"),
    "text as a matrix": zipped(A0_npy=b"hello"),
    "endless member": zipped(A0_npy=b"\x93NUMPY\x01\x00" + len(ENDLESS).to_bytes(2, "little") + ENDLESS),
    "records": packed(A0=np.array([(1, 2.0)], "i4,f8")),
    "words": packed(A0=np.array(["x"])),
    "dates": packed(A0=np.array(["2020-01-01"], "M8[D]")),
}


def refusal(file: Path) -> str:
    """The sentence with which a proof is refused."""
    with pytest.raises(ad.SpecError) as caught:
        check_proof(file)
    text = str(caught.value)
    assert text.strip()
    assert len(text.splitlines()) == 1
    assert not re.search(r"[.!?] +[A-Z]", text.replace(str(file), "")), text  # no second sentence
    text.encode()
    return text


@pytest.fixture
def saved(small, tmp_path) -> Path:
    return small.save(tmp_path / "proof.json")


def test_saved_proofs_are_read(saved, small):
    assert check_proof(saved) == list(small.statements)


@pytest.mark.parametrize("name", STRANGE)
def test_strange_matrices_are_one_sentence(saved, name):
    saved.with_suffix(".npz").write_bytes(STRANGE[name])
    refusal(saved)


def test_truncated_and_damaged_files_are_one_sentence(saved):
    rng = np.random.default_rng(16)
    text, data = saved.read_bytes(), saved.with_suffix(".npz").read_bytes()
    for k in rng.integers(0, len(text) - 2, 25):
        saved.write_bytes(text[:k])
        refusal(saved)
    saved.write_bytes(text)
    for k in [1, 4, len(data) - 1, *rng.integers(0, len(data), 25)]:
        saved.with_suffix(".npz").write_bytes(data[:k])
        refusal(saved)
    for _ in range(60):  # some bytes of a ZIP file mean nothing: then the proof still holds
        bad = bytearray(data)
        bad[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
        saved.with_suffix(".npz").write_bytes(bytes(bad))
        try:
            check_proof(saved)
        except ad.SpecError:
            refusal(saved)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "null",
        "[]",
        "3",
        '"amb_design/proof/1"',
        "{}",
        '{"claims": []}',
        '{"name": "something else", "version": 1}',
        '{"format": "amb_design/proof/2", "claims": [{}]}',
        '{"format": "amb_design/proof/1"}',
        '{"format": "amb_design/proof/1", "claims": []}',
        '{"format": "amb_design/proof/1", "claims": [3]}',
        '{"format": "amb_design/proof/1", "claims": [{}]}',
        '{"format": ["amb_design/proof/1"], "claims": [{}]}',
        '{"format": ' + "[" * 900 + "]" * 900 + "}",
        "[" * 100_000,
        '{"format": 1' + "0" * 5000 + "}",
        "\ufeff{}",
    ],
    ids=lambda text: text[:40],
)
def test_strange_certificates_are_one_sentence(saved, text):
    saved.write_text(text, encoding="utf-8")
    refusal(saved)


def test_certificates_with_the_right_hash_and_strange_contents_are_one_sentence(saved, small):
    right = json.dumps(small.certificate)
    claim = '{"kind":"stable","speeds":[0,1],"cover":0.5}'
    head = right[: right.index('"claims"')]
    for strange in (
        claim.replace("0.5", "[" * 900 + "]" * 900),
        claim.replace("0.5", '{"a":' * 900 + "0" + "}" * 900),
        claim.replace('"stable"', "[" * 900 + "]" * 900),
        claim.replace("0.5", "1" + "0" * 4000),
        claim.replace("0.5", "1" + "0" * 5000),
        claim.replace("0.5", "-Infinity"),
        claim.replace("0.5", '"\\ud800"'),
        claim.replace('"stable"', '"\\ud800"'),
        claim.replace('"cover"', '"box":{"\\ud800":0.1},"cover"'),
        claim.replace('"cover"', '"box":{"A0\\n. No":0.1},"cover"'),
        claim.replace('"cover"', '"box":{"' + "x" * 10**5 + '":0.1},"cover"'),
    ):
        saved.write_text(f'{head}"claims":[{strange}]}}', encoding="utf-8")
        refusal(saved)


def test_long_binary_and_missing_files_are_one_sentence(saved, tmp_path):
    text = saved.read_text()
    saved.write_text(" " * 2**20 + text)
    assert "longer" in refusal(saved)
    saved.write_text(text.replace("thesis", "é" * (2**19)), encoding="utf-8")  # characters of two bytes
    assert "longer" in refusal(saved)
    saved.write_bytes(b"\xff\xfe" + text.encode("utf-16-le"))
    refusal(saved)
    saved.write_text(text)
    saved.with_suffix(".npz").unlink()
    assert "does not exist" in refusal(saved)
    refusal(tmp_path / "nothing.json")
    refusal(tmp_path)
    refusal(Path("/"))


# --- covers that are too deep ----------------------------------------------------------------------------------------


def test_deep_and_wide_covers_are_refused(monkeypatch):
    matrices = {"A0": -np.eye(1), "A1": np.zeros((1, 1))}
    tree: Any = 0.5
    for k in range(201):
        tree = [0, 1.0 - 2.0 ** -(k + 1) if k < 50 else 0.5, tree, 0.5]
    assert not accepted(matrices, {"kind": "stable", "speeds": [0, 1], "cover": tree})

    def halves(low: float, high: float, depth: int) -> Any:
        middle = 0.5 * (low + high)
        return [0, middle, halves(low, middle, depth - 1), halves(middle, high, depth - 1)] if depth else middle

    assert accepted(matrices, {"kind": "stable", "speeds": [0, 1], "cover": halves(0.0, 1.0, 8)})
    monkeypatch.setattr(checker, "CELLS", 500)
    with pytest.raises(ProofError, match="too many cells"):
        check(certificate(matrices, {"kind": "stable", "speeds": [0, 1], "cover": halves(0.0, 1.0, 8)}), matrices)


def test_long_covers_are_accepted():
    """Eight narrow dips of the damping, each of which takes some thirty cells: deep trees, but not many cells."""
    rng = np.random.default_rng(17)
    a0, a1 = np.zeros((16, 16), complex), np.zeros((16, 16), complex)
    turn, swap, damping = np.diag([1j, -1j]), np.array([[0.0, 1.0], [1.0, 0.0]]), 1e-6
    for k, place in enumerate(np.linspace(2.0, 18.0, 8)):
        b = slice(2 * k, 2 * k + 2)
        a0[b, b] = (1j * rng.uniform(-50.0, 50.0) - damping) * np.eye(2) + 0.99 * damping * swap - place * turn
        a1[b, b] = turn
    done = cover(checker.Family([Ball(a0), Ball(a1)]), 0.0, 20.0, resolution=1e-9)
    assert done.reached == 20.0
    assert 200 < done.cells < 2000
    matrices = {"A0": a0, "A1": a1}
    written = json.dumps(certificate(matrices, {"kind": "stable", "speeds": [0.0, 20.0], "cover": done.tree}))
    assert check(read(written), matrices) == ["stable from 0 to 20 rad/s"]


def test_no_states_are_refused():
    matrices = {"A0": np.zeros((0, 0)), "A1": np.zeros((0, 0))}
    assert not accepted(matrices, {"kind": "stable", "speeds": [0, 1], "cover": 0.5})


# --- the checker alone -----------------------------------------------------------------------------------------------


def test_checker_imports_nothing_else():
    tree = ast.parse(Path(checker.__file__).read_text(encoding="utf-8"))
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative import"
            names.add(node.module or "")
        if isinstance(node, ast.Name):
            assert node.id not in ("__import__", "eval", "exec", "importlib")
    roots = {name.split(".")[0] for name in names}
    assert roots <= set(sys.stdlib_module_names) | {"numpy", "scipy"}
    assert "importlib" not in roots


def test_checker_runs_alone(whole, tmp_path):
    whole.save(tmp_path / "proof.json")
    (tmp_path / "checker.py").write_text(Path(checker.__file__).read_text(encoding="utf-8"), encoding="utf-8")
    program = """
import sys
import numpy as np
import checker
with np.load("proof.npz") as stored:
    matrices = {name: stored[name] for name in stored.files}
print("\\n".join(checker.check(checker.read(open("proof.json").read()), matrices)))
assert not any(name.split(".")[0] in ("amb_design", "casadi") for name in sys.modules)
"""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == list(whole.statements)


def test_covers_of_hopeless_families_do_not_warn():
    """Overflow, division by zero and failing eigensolvers on the way to no cover at all."""
    zero = np.zeros((2, 2))
    for a0, a1 in (
        (zero, zero),
        (np.eye(2), zero),
        (np.array([[0.0, 1.0], [0.0, 0.0]]), zero),
        (np.array([[-1.0, 1e300], [0.0, -1.0]]), 1e300 * np.eye(2)),
        (-1e-300 * np.eye(2), 1e-300 * np.ones((2, 2))),
        (-1e200 * np.eye(2), 1e200 * np.ones((2, 2))),
        (np.array([[-1.0, 1e16], [0.0, -1.0]]), zero),
        (-np.eye(2), 1e308 * np.ones((2, 2))),
    ):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            done = cover(checker.Family([Ball(a0), Ball(a1)]), 0.0, 1.0)
        assert 0.0 <= done.reached <= 1.0
