"""Whether every machine that the bounds of a design problem allow is one.

Numbers that change are affine in the variables: constant + sum of factor times variable, kept as a mapping from the name
of the variable to its factor, with the constant under "". Over the box of the bounds such a form has its least value at a
corner. That makes the order of places along the shaft decidable exactly, and with it whether one mesh serves all designs.
Relations within a part of the machine are asked of the part itself, at the corners of its own variables.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from itertools import combinations, pairwise, product
from typing import TYPE_CHECKING

from ..errors import SpecError
from .fields import Number, Shown
from .machine import Machine
from .paths import find, metadata, replace, value
from .stations import COINCIDENT, boundaries, station_groups

if TYPE_CHECKING:
    from .problem import DesignProblem

Form = Mapping[str, float]
Box = Mapping[str, tuple[float, float]]

FULL = 8
"""Of so many variables all corners are tried; of more, those of each two, with the others in the middle."""

TOUCHING = 1e-9
"""Overlap of neighbouring disks, in terms of the shaft's length, that is rounding."""


def check_bounds(problem: DesignProblem) -> None:
    """Refuse bounds that allow what is no machine, or that change the order of places along the shaft.

    The same holds for the factors of scenarios.

    Parameters
    ----------
    problem : DesignProblem

    Raises
    ------
    SpecError
    """
    machine, forms = problem.machine, problem.paths()
    box, start = {v.name: (v.lower, v.upper) for v in problem.variables}, problem.start()
    _check_box(machine, forms, box, start, "")
    for case in problem.cases:
        scaled: dict[str, Form] = dict(forms)
        for name, scale in case.factors:
            for path in find(machine, name):
                own = _form(forms, path, value(machine, path))
                scaled[path] = {key: scale * factor for key, factor in own.items()}
        _check_box(machine, scaled, box, start, f"scenarios.{case.name}")


def _check_box(machine: Machine, forms: Mapping[str, Form], box: Box, start: Mapping[str, float], where: str) -> None:
    refuse = _Refusal(box, where)
    for path, form in forms.items():
        low, high = (_extreme(form, box, sign) for sign in (-1.0, 1.0))
        if _varies(form) and metadata(machine, path)["switch"] and low <= 0.0 <= high:
            raise refuse(form, f"lets {path} be zero, which leaves its block out of the model")
    _check_parts(machine, forms, box, refuse)
    try:
        first = replace(machine, _at(forms, start))
    except SpecError as error:
        raise SpecError(_because(error), field=where or "free", remedy="change the bounds or the ties") from None
    _check_stations(first, forms, box, refuse)
    _check_disks(first, forms, box, refuse)
    for name, ends in box.items():  # relations across parts, such as the ply law's
        for end in ends:
            values = _at(forms, {**start, name: end})
            try:
                replace(machine, values)
            except SpecError as error:
                raise refuse({name: 1.0}, _because(error)) from None


def _at(forms: Mapping[str, Form], point: Mapping[str, float]) -> dict[str, float]:
    """Values of forms at a point."""
    return {
        path: form.get("", 0.0) + sum(factor * point[name] for name, factor in form.items() if name)
        for path, form in forms.items()
    }


def _extreme(form: Form, box: Box, sign: float) -> float:
    """The least (sign -1) or greatest (sign +1) value of a form."""
    ends = {name: box[name][factor * sign > 0.0] for name, factor in form.items() if name}
    return form.get("", 0.0) + sum(factor * ends[name] for name, factor in form.items() if name)


class _Refusal:
    """Makes errors that name the field of a variable with its bounds."""

    def __init__(self, box: Box, where: str):
        self.box, self.where = box, where

    def __call__(self, form: Form, problem: str) -> SpecError:
        name = next((n for n, factor in form.items() if n and factor), "")
        got = None
        if name and not self.where:
            lower, upper = self.box[name]
            got = Shown(f"[{lower:g}, {upper:g}]")
        remedy = "move the factor closer to 1" if self.where else "narrow the bounds"
        return SpecError(problem, field=self.where or f"free.{name}", got=got, remedy=remedy)


def _because(error: SpecError) -> str:
    got = "" if error.got is None else f" = {error.got}"
    return f"allows a machine that is none: {error.field}{got} {error.problem}"


def _check_parts(machine: Machine, forms: Mapping[str, Form], box: Box, refuse: _Refusal) -> None:
    parts: dict[str, dict[str, Form]] = {}
    for path, form in forms.items():
        owner, _, name = path.rpartition(".")
        parts.setdefault(owner, {})[name] = form
    for owner, own in parts.items():
        part = value(machine, owner)
        names = list(dict.fromkeys(name for form in own.values() for name in form if name))
        for corner in _corners(names, box):
            try:
                dataclasses.replace(part, **_at(own, corner))
            except SpecError as error:
                form = own.get(error.field, next(iter(own.values())))
                raise refuse(form, _because(error.inside(owner))) from None


def _corners(names: list[str], box: Box) -> Iterator[dict[str, float]]:
    middle = {name: (box[name][0] + box[name][1]) / 2.0 for name in names}
    groups: Iterable[tuple[str, ...]] = [tuple(names)] if len(names) <= FULL else combinations(names, 2)
    for group in groups:
        for ends in product(*(box[name] for name in group)):
            yield {**middle, **dict(zip(group, ends, strict=True))}


def _check_stations(machine: Machine, forms: Mapping[str, Form], box: Box, refuse: _Refusal) -> None:
    places, length = _places(machine, forms), boundaries(machine)[-1]
    groups = [
        sorted((who for _, who in group), key=lambda who: isinstance(who, str)) for group in station_groups(machine)
    ]
    for leader, *others in groups:
        for who in others:
            apart = _difference(places[who], places[leader])
            furthest = max(_extreme(apart, box, 1.0), -_extreme(apart, box, -1.0))
            if _varies(apart) and furthest > COINCIDENT * length:
                raise refuse(
                    _by_weight(apart),
                    f"moves {_words(who, machine)} away from {_words(leader, machine)}, which is at the same place at the start "
                    "and shares its node",
                )
    for (left, *_), (right, *_) in pairwise(groups):
        gap = _difference(places[right], places[left])
        if _varies(gap) and _extreme(gap, box, -1.0) <= COINCIDENT * length:
            raise refuse(
                _by_weight(gap),
                f"lets {_words(left, machine)} and {_words(right, machine)} meet or pass, and the mesh needs them apart",
            )


def _check_disks(machine: Machine, forms: Mapping[str, Form], box: Box, refuse: _Refusal) -> None:
    disks = [(f"rotor.disks[{i}]", d) for i, d in enumerate(machine.rotor.disks) if d.width is not None]
    for (left, a), (right, b) in pairwise(sorted(disks, key=lambda item: float(item[1].position))):
        gap = _difference(_form(forms, f"{right}.position", b.position), _form(forms, f"{left}.position", a.position))
        for path, width in ((left, a.width), (right, b.width)):
            half = {n: 0.5 * factor for n, factor in _form(forms, f"{path}.width", width).items()}
            gap = _difference(gap, half)
        if _varies(gap) and _extreme(gap, box, -1.0) < -TOUCHING * boundaries(machine)[-1]:
            raise refuse(_by_weight(gap), f"lets {left} and {right} overlap")


def _difference(a: Form, b: Form) -> dict[str, float]:
    """a - b; equal parts cancel exactly."""
    return {name: a.get(name, 0.0) - b.get(name, 0.0) for name in {**a, **b}}


def _varies(form: Form) -> bool:
    return any(factor for name, factor in form.items() if name)


def _by_weight(form: Form) -> Form:
    """With the variable of greatest factor first, which is the one to blame."""
    return dict(sorted(form.items(), key=lambda item: -abs(item[1])))


def _places(machine: Machine, forms: Mapping[str, Form]) -> dict[int | str, Form]:
    """Where everything on the shaft is, in terms of the variables."""
    edge: dict[str, float] = {"": 0.0}
    places: dict[int | str, Form] = {0: edge}
    for i, segment in enumerate(machine.rotor.shaft.segments):
        length = _form(forms, f"rotor.shaft.segments[{i}].length", segment.length)
        edge = {name: edge.get(name, 0.0) + length.get(name, 0.0) for name in {**edge, **length}}
        places[i + 1] = edge
    return {**places, **{path: _form(forms, path, position) for path, position in machine.stations()}}


def _form(forms: Mapping[str, Form], path: str, own: Number) -> Form:
    return forms.get(path, {"": float(own)})


def _words(who: int | str, machine: Machine) -> str:
    if isinstance(who, str):
        return who
    ends = {0: "the left shaft end", len(machine.rotor.shaft.segments): "the right shaft end"}
    return ends.get(who, f"the step after rotor.shaft.segments[{who - 1}]")
