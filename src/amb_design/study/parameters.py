"""Parameter vectors that know their names, units and bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import ModelError, SpecError
from ..model.parametric import Parametric
from ..spec.paths import metadata
from ..spec.tables import closest


@dataclass(frozen=True)
class Parameter:
    """One entry of a parameter vector.

    Attributes
    ----------
    name : str
        As it was freed.
    unit : str
        SI; empty for pure numbers.
    meaning : str
    nominal, lower, upper : float
        Value in the machine and bounds; infinite where none were given and the field admits any number.
    paths : tuple of str
        Full paths of the numbers that it sets.
    """

    name: str
    unit: str
    meaning: str
    nominal: float
    lower: float
    upper: float
    paths: tuple[str, ...]


def parameters(loop: Parametric, bounds: Mapping[str, tuple[float, float]]) -> tuple[Parameter, ...]:
    """The parameters of a machine.

    Parameters
    ----------
    loop : Parametric
    bounds : mapping of str to (float, float)
        By name; of the others the domain of the field counts.
    """
    out = []
    for name, nominal, paths in zip(loop.names, loop.nominal, loop.members, strict=True):
        known = metadata(loop.machine, paths[0])
        least = -math.inf if known["domain"] == "any" else 0.0
        lower, upper = bounds.get(name, (least, math.inf))
        out.append(Parameter(name, known["unit"], known["doc"], nominal, lower, upper, paths))
    return tuple(out)


def split_free(free: Any) -> tuple[Any, dict[str, tuple[float, float]]]:
    """What `free` names, and the bounds that it states.

    Parameters
    ----------
    free : sequence of str, or mapping of str to bounds (lower, upper) or to full paths

    Returns
    -------
    names : sequence of str, or mapping of str to sequence of str
    bounds : dict of str to (float, float)
    """
    if isinstance(free, str):
        raise SpecError("must be a list of paths", field="free", got=free, remedy=f'write free=["{free}"]')
    if not isinstance(free, Mapping):
        return tuple(free), {}
    stated = {n: b for n, b in free.items() if len(b) and not any(isinstance(x, str) for x in b[:2])}
    if not stated:
        return free, {}
    if len(stated) < len(free):
        raise SpecError(
            "mixes bounds and paths", field="free", remedy="give bounds for all names, or full paths for all names"
        )
    bounds = {}
    for name, given in stated.items():
        lower, upper = (float(x) for x in given[:2])
        if not lower <= upper:
            raise SpecError("has its bounds the wrong way round", field=f"free.{name}", got=given, remedy="swap them")
        bounds[name] = lower, upper
    return tuple(free), bounds


def vector(known: Sequence[Parameter], values: Mapping[str, Any]) -> list[Any]:
    """Values in the order of a parameter vector; nominal ones where a name is left out.

    Parameters
    ----------
    known : sequence of Parameter
    values : mapping of str to float or CasADi scalar

    Raises
    ------
    ModelError
        If a name is none of the parameters.
    """
    names = [q.name for q in known]
    for name in values:
        if name not in names:
            raise ModelError(f"{name} is no parameter here; {closest(name, names)}")
    return [values.get(q.name, q.nominal) for q in known]
