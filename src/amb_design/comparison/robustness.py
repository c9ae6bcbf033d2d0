"""How far a design bears a machine that is not quite the one it was made for. The controllers stay as they are."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..analysis.stability import FOUND, NONE, StabilityLimit, stability_limit
from ..analysis.system import system
from ..errors import SpecError
from ..proof.tolerances import linear
from ..spec.machine import Machine
from ..spec.paths import find, replace, value
from ..synthesis.design import synthesise

USUAL = {
    "magnets.current_stiffness": 0.05,
    "magnets.negative_stiffness": 0.10,
    "bearings.stiffness": 0.10,
    "segments.material.E": 0.03,
    "plies.material.E1": 0.05,
}
"""Tolerances where none are given, of those numbers that a machine has: the practice of magnets and laminates, as assumed here."""


@dataclass(frozen=True)
class Corner:
    """A machine with every tolerance used up to one side.

    Attributes
    ----------
    signs : mapping of str to int
        +1 or -1 by path.
    limit : StabilityLimit
    """

    signs: Mapping[str, int]
    limit: StabilityLimit

    @property
    def stable_up_to(self) -> float:
        """Stability limit speed [rad/s]; zero if unstable at rest or undecided."""
        return self.limit.speed if self.limit.status in (FOUND, NONE) else 0.0

    def describe(self) -> str:
        """The signs in words: ``current_stiffness -, negative_stiffness +``."""
        return ", ".join(f"{path.rpartition('.')[2]} {'+' if sign > 0 else '-'}" for path, sign in self.signs.items())


def usual_tolerances(machine: Machine) -> dict[str, float]:
    """Tolerances for a machine for which none are given.

    Parameters
    ----------
    machine : Machine
    """
    return {path: tolerance for path, tolerance in USUAL.items() if _members(varied_machine(machine), path)}


def varied_machine(machine: Machine) -> Machine:
    """The machine whose numbers vary: magnets by k_i and k_s, and controllers by their gains, so that these stay.

    Parameters
    ----------
    machine : Machine
    """
    return linear(synthesise(machine))


def corners(machine: Machine, tolerances: Mapping[str, float], top_speed: float) -> Iterator[Corner]:
    """Certified stability limits at all corners of the tolerances.

    Parameters
    ----------
    machine : Machine
    tolerances : mapping of str to float
        Relative, by path; all numbers that a path fits vary together.
    top_speed : float
        They are looked for up to this speed [rad/s].

    Yields
    ------
    Corner

    Raises
    ------
    SpecError
        If a path names nothing, or nothing that can vary.
    """
    base, groups = varied_machine(machine), _groups(machine, tolerances)
    for signs in itertools.product((-1, 1), repeat=len(groups)):
        factors = {path: 1.0 + sign * tolerances[path] for path, sign in zip(groups, signs, strict=True)}
        limit = stability_limit(system(_scaled(base, groups, factors)), top_speed, first_only=True)
        yield Corner(dict(zip(groups, signs, strict=True)), limit)


def stable_share(machine: Machine, tolerances: Mapping[str, float], samples: int, seed: int, speed: float) -> float:
    """Part of random machines that are stable at every speed up to one.

    Parameters
    ----------
    machine : Machine
    tolerances : mapping of str to float
        Each number varies evenly within its own.
    samples, seed : int
        Designs that share tolerances, number and seed meet the same variations.
    speed : float [rad/s]

    Returns
    -------
    float
        Between 0 and 1; each machine counts as stable only with a certificate up to the speed.
    """
    base, groups = varied_machine(machine), _groups(machine, tolerances)
    draws = np.random.default_rng(seed).uniform(-1.0, 1.0, (samples, len(groups)))
    stable = 0
    for draw in draws:
        factors = {path: 1.0 + tolerances[path] * float(x) for path, x in zip(groups, draw, strict=True)}
        limit = stability_limit(system(_scaled(base, groups, factors)), speed, first_only=True)
        stable += limit.status == NONE and limit.certified
    return stable / samples


def check_tolerances(machine: Machine, tolerances: Mapping[str, float]) -> None:
    """Raise a SpecError if a tolerance names nothing of a machine, or nothing that can vary.

    Parameters
    ----------
    machine : Machine
    tolerances : mapping of str to float
    """
    if tolerances:
        _groups(machine, tolerances)


def _groups(machine: Machine, tolerances: Mapping[str, float]) -> dict[str, tuple[str, ...]]:
    base = varied_machine(machine)
    groups: dict[str, tuple[str, ...]] = {}
    taken: dict[str, str] = {}
    for path in tolerances:
        try:
            members = find(base, path)
        except SpecError as error:
            raise error.inside("tolerances") from None
        for member in members:
            if member in taken:
                raise SpecError(
                    f"has a tolerance in {taken[member]} too", field=f"tolerances.{path}", got=member, remedy="keep one"
                )
            taken[member] = path
        if not any(value(base, member) for member in members):
            raise SpecError("is zero, of which no part can vary", field=f"tolerances.{path}", remedy="leave it out")
        groups[path] = members
    return groups


def _scaled(machine: Machine, groups: Mapping[str, tuple[str, ...]], factors: Mapping[str, float]) -> Machine:
    values = {m: value(machine, m) * factors[path] for path, members in groups.items() for m in members}
    return replace(machine, values)


def _members(machine: Machine, path: str) -> bool:
    """True if a path fits numbers of a machine that are not all zero."""
    try:
        return any(value(machine, member) for member in find(machine, path))
    except SpecError:
        return False
