"""What is proven of a machine: its stability limit, damping, sensitivities, and what tolerances leave of the limit."""

from __future__ import annotations

import itertools
import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analysis.certificate import Crossing, Walk
from ..analysis.scan import maximum
from ..analysis.sensitivity import no_loop, telling_frequencies
from ..analysis.stability import FOUND, NONE, stability_limit
from ..analysis.system import Array, System, dense, system
from ..errors import ModelError, SolveError, SpecError
from ..model.loop import ports
from ..spec.machine import Machine
from ..threads import one_thread
from .checker import FORMAT, LARGEST, Ball, Family, ProofError, check, fingerprint, hamiltonian, read, sector
from .cover import CELLS, Cover, box_cover, count, cover
from .tolerances import directions

CORNERS = 6
"""Tolerances whose corners are all looked at before a proof is tried."""

SHORTER = (2e-3, 1e-2, 5e-2, 0.2)
"""How far below the limit of the worst corner stability within tolerances is tried to be proven."""

WIDTHS = (1e-6, 1e-5, 1e-4, 1e-3)
"""Relative widths of the bracket that are tried one after the other."""

DIGITS = 9
"""Of the speeds that are claimed: more than the narrowest bracket needs, and fewer than differ by the processor."""


@dataclass(frozen=True)
class Proof:
    """What is proven of a machine, with its certificate.

    Attributes
    ----------
    statements : tuple of str
        What is proven, a sentence each.
    lower, upper : float or None
        Proven stable at every speed up to the first, unstable at the second [rad/s]; None where nothing was found.
    robust : float or None
        Proven stable up to this speed with the tolerances that were asked for [rad/s].
    damped, sensitive : float or None
        Speeds up to which the damping ratio and the sensitivities that were asked for are proven [rad/s].
    certificate : dict
    matrices : dict of str to ndarray
        To which it belongs.
    seconds : float
        That it took.
    """

    statements: tuple[str, ...]
    lower: float
    upper: float | None
    robust: float | None
    damped: float | None
    sensitive: float | None
    certificate: dict[str, Any] = field(repr=False)
    matrices: dict[str, Array] = field(repr=False)
    seconds: float = 0.0

    def check(self) -> list[str]:
        """Check all claims, as a reviewer would.

        Raises
        ------
        amb_design.proof.checker.ProofError
            If one does not hold.
        """
        return check(read(json.dumps(self.certificate)), self.matrices)

    def document(self) -> dict[str, Any]:
        """The proof as data, without its certificate."""
        rpm = 30.0 / np.pi
        speeds = {"stable_up_to": self.lower, "unstable_at": self.upper, "stable_within_tolerances_up_to": self.robust}
        speeds |= {"damped_up_to": self.damped, "sensitivity_held_up_to": self.sensitive}
        return {
            "proven": list(self.statements),
            **{f"{name}_rpm": None if speed is None else speed * rpm for name, speed in speeds.items()},
            "cells": sum(count(tree) for c in self.certificate["claims"] for tree in _trees(c)),
            "bytes": len(compact(self.certificate)),
            "states": len(self.matrices["A0"]),
            "sha256": self.certificate["sha256"],
            "seconds": round(self.seconds, 2),
        }

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the certificate, and the matrices beside it.

        Parameters
        ----------
        path : str or path
            Of the certificate, a JSON file; the matrices go to a file of the same name that ends in ``.npz``.

        Raises
        ------
        SpecError
            If it cannot be written.
        """
        file = Path(path)
        if file.suffix == ".npz":
            raise SpecError("is where the matrices go", file=str(file), remedy="name the certificate .json")
        try:
            np.savez_compressed(file.with_suffix(".npz"), allow_pickle=False, **self.matrices)
            file.write_text(compact(self.certificate) + "\n", encoding="utf-8")
        except OSError as error:
            raise SpecError(
                f"cannot be written ({error.strerror or error})", file=str(file), remedy="name another place"
            ) from None
        return file


def compact(certificate: Mapping[str, Any]) -> str:
    """A certificate as text."""
    return json.dumps(certificate, separators=(",", ":"))


def _trees(claim: Mapping[str, Any]) -> list[Any]:
    """The covers of a claim."""
    return list(claim["cover"]) if claim["kind"] in ("damping", "sensitivity") else [claim["cover"]]


@one_thread
def prove_stability_limit(
    machine: Machine | System,
    top_speed: float | None = None,
    *,
    damping_ratio: float | None = None,
    sensitivity_peak: float | None = None,
    up_to: float | None = None,
    within: Mapping[str, float] | None = None,
) -> Proof:
    """Prove between which two speeds a machine becomes unstable, and what else is asked for.

    Parameters
    ----------
    machine : Machine or System
    top_speed : float, optional
        Look up to this speed [rad/s]; the machine's own top speed if left out.
    damping_ratio : float, optional
        Prove that all eigenvalues have a larger damping ratio.
    sensitivity_peak : float, optional
        Prove that the sensitivity of every loop stays below, at every frequency; in the complex form for forward and backward whirl
        each, of which a physical axis sees the mean.
    up_to : float, optional
        Speed [rad/s] up to which damping, sensitivity and tolerances must hold; as far as they can be proven below the
        stability limit if left out.
    within : mapping of str to float, optional
        Relative tolerances of numbers of the machine by path, each of them anywhere within +- that part of its value:
        ``{"magnets.current_stiffness": 0.05, "bearings.stiffness": 0.05}``. All numbers that a short path fits vary together.

    Returns
    -------
    Proof

    Raises
    ------
    SolveError
        If something cannot be proven; the message says how far it was.
    SpecError
        If a tolerance names nothing, or numbers that do not enter the matrices linearly.
    ModelError
        If a range of speeds or a bound makes no sense.

    Notes
    -----
    What is proven holds for the matrices of the model as they are stored, at any constant speed. That the mesh is fine
    enough, the model is right and the speed changes slowly is not proven.
    """
    clock = time.perf_counter()
    loop = machine if isinstance(machine, System) else system(machine)
    if damping_ratio is not None and not 0.0 < damping_ratio < 1.0:
        raise ModelError(f"damping_ratio = {damping_ratio:g} must lie between 0 and 1")
    if sensitivity_peak is not None and not 1.0 < sensitivity_peak < 1e6:
        raise ModelError(f"sensitivity_peak = {sensitivity_peak:g} must be above 1")
    if up_to is not None and not 0.0 < up_to < np.inf:
        raise ModelError(f"up_to = {up_to:g} rad/s must be positive and finite")
    found = stability_limit(loop, top_speed, first_only=True)
    if found.status not in (FOUND, NONE):
        raise SolveError(f"{loop.machine.name} is {found.status}: there is no stability limit to prove")
    matrices = {"A0": loop.A0, "A1": loop.A1}
    parts = [Ball(m) for m in matrices.values()]
    claims: list[dict[str, Any]] = []
    lower, upper = _bracket(Family(parts), found.speed, found.status == FOUND, claims)
    goal = min(up_to or lower, lower)
    if up_to is not None and up_to > lower * (1.0 + 1e-9):
        raise SolveError(f"stability is proven up to {lower:.10g} rad/s only, not up to {up_to:.10g}")
    damped = sensitive = robust = None
    if damping_ratio is not None:
        damped = _damped(loop, parts, damping_ratio, goal, up_to, claims)
    if sensitivity_peak is not None:
        enter, leave = sensitivity_ports(loop)
        matrices |= {"B": enter, "C": leave}
        sensitive = _sensitive(loop, parts, enter, leave, sensitivity_peak, goal, up_to, claims)
    if within:
        moves = directions(loop, within)
        matrices |= {f"D_{name}": move for name, move in moves.items()}
        robust = _robust(loop, parts, moves, within, goal, up_to, claims)
    certificate = {
        "format": FORMAT,
        "machine": loop.machine.name,
        "version": __version__,
        "sha256": fingerprint(matrices),
        "claims": claims,
    }
    proof = Proof((), lower, upper, robust, damped, sensitive, certificate, matrices)
    try:
        statements = tuple(proof.check())
    except ProofError as error:  # pragma: no cover - covers are made with the checker's own arithmetic
        raise SolveError(f"the certificate does not stand its own check: {error}") from None
    seconds = time.perf_counter() - clock
    return Proof(statements, lower, upper, robust, damped, sensitive, certificate, matrices, seconds)


def _bracket(family: Family, speed: float, crosses: bool, claims: list[dict[str, Any]]) -> tuple[float, float | None]:
    """Claims that the family is stable below a speed, and unstable just above it."""
    for width in WIDTHS:
        lower, upper = (speed * (1.0 - width), speed * (1.0 + width)) if crosses else (speed, None)
        lower = _round(lower) if crosses else lower
        done = cover(family, 0.0, lower, limit=speed if crosses else None, resolution=0.02 * width)
        if done.reached < lower:
            continue
        beyond = None
        if upper is not None:
            beyond = _first_unstable(family, speed, width)
            if beyond is None:
                continue
        claims.append({"kind": "stable", "speeds": [0.0, lower], "cover": done.tree})
        if beyond is not None:
            claims.append({"kind": "unstable", "speeds": [beyond, beyond], "cover": beyond})
        return lower, beyond
    raise _short_of("stability", done, lower)


def _first_unstable(family: Family, speed: float, width: float) -> float | None:
    """A speed just above the limit at which instability can be proven."""
    for part in (0.1, 0.3, 1.0):
        upper = _round(speed * (1.0 + part * width))
        if family.holds([(upper,)], (upper,), lambda count: count > 0):
            return upper
    return None


def _round(speed: float) -> float:
    return float(f"{speed:.{DIGITS}g}")


def _damped(
    loop: System, parts: list[Ball], ratio: float, goal: float, up_to: float | None, claims: list[dict[str, Any]]
) -> float:
    """Claims a damping ratio, and says up to which speed."""
    rotated = [Family(sector(parts, sign * ratio)) for sign in (1.0, -1.0)]
    what, truth = f"a damping ratio of {ratio:g}", partial(_least_damped, loop)
    return _together(rotated, goal, up_to, what, truth, claims, kind="damping", ratio=ratio)


def _sensitive(
    loop: System,
    parts: list[Ball],
    enter: Array,
    leave: Array,
    peak: float,
    goal: float,
    up_to: float | None,
    claims: list[dict[str, Any]],
) -> float:
    """Claims a bound on the sensitivity of each loop, and says up to which speed."""
    reached = []
    for k in range(enter.shape[1]):
        b, c = enter[:, k : k + 1], leave[k : k + 1]
        h = Family(hamiltonian(parts, Ball(b), Ball(c), peak))
        truth = partial(_most_sensitive, loop, b[:, 0], c[0])
        what = f"a sensitivity of loop {k} below {peak:g}"
        more = {"kind": "sensitivity", "below": peak, "loop": k}
        reached.append(_together([Family(parts), h], goal, up_to, what, truth, claims, half=loop.size, **more))
    return min(reached)


def _robust(
    loop: System,
    parts: list[Ball],
    moves: Mapping[str, Array],
    within: Mapping[str, float],
    goal: float,
    up_to: float | None,
    claims: list[dict[str, Any]],
) -> float:
    """Claims stability within tolerances, and says up to which speed."""
    box = {name: float(within[name]) for name in moves}
    family = Family([*parts, *[Ball(m) for m in moves.values()]])
    corner = _first_corner(loop, moves, box, goal)
    if corner == 0.0:
        raise SolveError("stability within the tolerances is not so: a corner of theirs is unstable at rest")
    for short in SHORTER if up_to is None else (0.0,):
        goal = min(goal, _round(corner * (1.0 - short)))
        done = box_cover(family, goal, tuple(box.values()))
        if done.tree is not None:
            claims.append({"kind": "stable", "speeds": [0.0, done.reached], "box": box, "cover": done.tree})
            return done.reached
    raise SolveError(
        f"stability within the tolerances cannot be proven up to {goal:.6g} rad/s in {CELLS} cells; at the corners of the "
        f"tolerances it holds up to {corner:.6g} rad/s"
    )


def _together(
    families: list[Family],
    goal: float,
    up_to: float | None,
    what: str,
    truth: Callable[[float], str],
    claims: list[dict[str, Any]],
    half: int = 0,
    **claim: Any,
) -> float:
    """A claim that needs two covers of the same range, the second with `half` unstable eigenvalues."""
    covers: list[Cover] = [Cover(None, goal, 0)] * 2
    for k in (1, 0, 1):  # the harder one first; once more if the other one does not go as far
        if covers[k].tree is None or covers[k].reached > goal:
            covers[k] = cover(families[k], 0.0, goal, unstable=lambda count: count == (half if k else 0))  # noqa: B023
        if covers[k].tree is None or (up_to is not None and covers[k].reached < goal):
            raise _short_of(what, covers[k], goal, truth)
        goal = min(goal, covers[k].reached)
    claims.append({**claim, "speeds": [0.0, goal], "cover": [done.tree for done in covers]})
    return goal


def _short_of(what: str, done: Cover, goal: float, truth: Callable[[float], str] | None = None) -> SolveError:
    """How far a proof came, and what the eigenvalues say there."""
    there = f"; {truth(done.reached)}" if truth is not None else ""
    if done.tree is None:
        return SolveError(f"{what} cannot be proven even at rest{there}")
    return SolveError(
        f"{what} is proven up to {done.reached:.10g} rad/s in {done.cells} cells, not up to {goal:.10g} rad/s: beyond, "
        f"no cell however short can be shown to hold{there}"
    )


def _first_corner(loop: System, moves: Mapping[str, Array], box: Mapping[str, float], top: float) -> float:
    """Least stability limit at the corners of a box, not proven; a little above the top if all are stable up to there."""
    if len(box) > CORNERS:
        return 1.1 * top
    least = 1.1 * top
    for signs in itertools.product((-1.0, 1.0), repeat=len(box)):
        shift = sum((sign * box[name] * moves[name] for sign, name in zip(signs, box, strict=True)), loop.A0)
        walk = Walk(shift, loop.A1)
        rest = walk.at(0.0)
        if rest.unstable:
            return 0.0
        least = next((e.lower for e in walk.events(least, rest) if isinstance(e, Crossing)), least)
    return least


def _least_damped(loop: System, speed: float) -> str:
    values = np.linalg.eigvals(loop.matrix(speed))
    ratios = -values.real / np.abs(values)
    k = int(np.argmin(ratios))
    return f"the least is {ratios[k]:.3g} there, of the mode at {abs(values[k].imag) / (2.0 * np.pi):.5g} Hz"


def _most_sensitive(loop: System, enter: Array, leave: Array, speed: float) -> str:
    values, right = np.linalg.eig(loop.matrix(speed))
    weights = (leave @ right) * np.linalg.solve(right, enter)
    grid = telling_frequencies(values, 3.0 * float(np.abs(values).max()))

    def size(w: Array) -> Array:
        return np.asarray(np.abs(1.0 + (weights / (1j * w[..., None] - values)).sum(axis=-1)))

    peak, at = max(maximum(size, grid), maximum(lambda w: size(-w), grid))
    return f"it is {peak:.4g} there, at {at / (2.0 * np.pi):.5g} Hz"


def sensitivity_ports(loop: System) -> tuple[Array, Array]:
    """B and C of the sensitivities 1 + C_k (s - A)^-1 B_k of all loops.

    Parameters
    ----------
    loop : System

    Returns
    -------
    B : ndarray, shape (n, loops)
    C : ndarray, shape (loops, n)

    Raises
    ------
    ModelError
        If there is no loop, or a controller passes the rate of its sensor straight on, which leaves B dependent on the speed.
    """
    seen = ports(loop.plant, loop.pencil)
    f, g, c = (dense(m) for m in (seen.F, seen.G, seen.C))
    if not f.shape[1]:
        raise ModelError(f"{loop.machine.name} has no {no_loop(loop.plant)}, and so no sensitivity")
    enter, rate = loop.from_rate @ f, loop.from_rate @ g
    leave = c[: f.shape[1]] @ loop.to_state
    if (np.abs(loop.A1) @ np.abs(rate)).any() or not np.allclose(leave @ rate, 0.0):
        raise ModelError(
            "a controller without low-pass or amplifier has no sensitivity that can be proven; add one of them"
        )
    enter = enter + loop.A0 @ rate
    ratio = np.abs(leave).max(axis=1) / np.abs(enter).max(axis=0)
    scale = 2.0 ** np.round(
        np.log2(ratio) / 2.0
    )  # inputs and outputs of one size keep the Hamiltonian matrix well-conditioned
    return np.asarray(enter * scale), np.asarray(leave / scale[:, None])


def check_proof(path: str | os.PathLike[str], machine: Machine | None = None) -> list[str]:
    """Check a saved proof.

    Parameters
    ----------
    path : str or path
        Of the certificate.
    machine : Machine, optional
        Then its matrices, computed anew, must be those of the certificate too.

    Returns
    -------
    list of str
        What is proven.

    Raises
    ------
    SpecError
        If the certificate or its matrices cannot be read, or do not prove what they claim.
    """
    file = Path(path)
    try:
        if file.stat().st_size > LARGEST:
            raise ProofError(f"is longer than {LARGEST} bytes")
        certificate = read(file.read_text(encoding="utf-8"))
        matrices = _stored_matrices(file.with_suffix(".npz"))
        if machine is not None:
            loop = system(machine)
            for name, matrix in (("A0", loop.A0), ("A1", loop.A1)):
                if name not in matrices or not np.array_equal(matrices[name], matrix):
                    raise ProofError(f"belongs to another machine than {machine.name}: {name} differs")
        return check(certificate, matrices)
    except ProofError as error:
        raise SpecError(str(error), file=str(file), remedy="make the proof anew with `amb-design prove`") from None
    except FileNotFoundError as error:
        raise SpecError(
            "does not exist", file=str(error.filename), remedy="name the certificate; its .npz lies beside it"
        ) from None
    except (OSError, ValueError):
        raise SpecError(
            "is no text that can be read", file=str(file), remedy="name a certificate that `prove` wrote"
        ) from None


def _stored_matrices(file: Path) -> dict[str, Array]:
    try:
        with file.open("rb") as opened, np.load(opened, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except FileNotFoundError:
        raise
    except Exception:  # damaged archives raise whatever the reader stumbles over
        raise ProofError(f"has damaged matrices beside it, in {file.name}") from None
