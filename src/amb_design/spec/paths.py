"""Names for the numbers inside a machine: ``controller.kp``, ``rotor.disks[2].position``.

A full path leads from the machine to one number. A short path may leave out intermediate names and
indices; it then stands for all numbers that it fits, tied together: ``magnets.bias_current`` is the bias of
every magnet, ``plies[3].angle`` that of the fourth ply of each laminated segment.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, TypeVar

from ..errors import SpecError
from .fields import Number, Spec

S = TypeVar("S", bound=Spec)

_STEP = re.compile(r"([A-Za-z_]\w*)((?:\[\d+\])*)$")


def numbers(spec: Spec, prefix: str = "", unset: bool = False) -> Iterator[tuple[str, Number]]:
    """Every number of a specification that is set, with its full path.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.
    prefix : str, optional
        Path of `spec` itself.
    unset : bool
        Then also the number fields that are left out or hold a word.

    Yields
    ------
    path : str
    value : float or CasADi scalar
    """
    for f in dataclasses.fields(spec):
        value = getattr(spec, f.name)
        path = f"{prefix}.{f.name}" if prefix else f.name
        if "unit" in f.metadata:
            if unset or (value is not None and not isinstance(value, str)):
                yield path, value
        elif isinstance(value, Spec):
            yield from numbers(value, path, unset)
        elif isinstance(value, tuple):
            for i, item in enumerate(value):
                if isinstance(item, Spec):
                    yield from numbers(item, f"{path}[{i}]", unset)


def find(spec: Spec, path: str, unset: bool = False) -> tuple[str, ...]:
    """Full paths of the numbers that a path stands for.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.
    path : str
        Full or short path.
    unset : bool
        Then a path that fits no number may stand for fields that are left out.

    Returns
    -------
    tuple of str
        At least one full path.

    Raises
    ------
    SpecError
        If the path fits no number, or numbers of different kinds.
    """
    known = [p for p, _ in numbers(spec)]
    steps = _steps(path)
    hits = [p for p in known if _fits(steps, _steps(p))]
    if unset and not hits:
        known = [p for p, _ in numbers(spec, unset=True)]
        hits = [p for p in known if _fits(steps, _steps(p))]
    kinds = {re.sub(r"\[\d+\]", "", p) for p in hits}
    if path in kinds:  # an exact path is never ambiguous
        hits, kinds = [p for p in hits if re.sub(r"\[\d+\]", "", p) == path], {path}
    if not hits:
        candidates = sorted({re.sub(r"\[\d+\]", "", p) for p in known})
        near = difflib.get_close_matches(path, candidates, n=1, cutoff=0.4)
        raise SpecError(
            "names no number of this machine",
            field=path,
            remedy=f"did you mean {near[0]}?" if near else "see `amb-design check`",
        )
    if len(kinds) > 1:
        raise SpecError("stands for different numbers", field=path, remedy="write one of " + ", ".join(sorted(kinds)))
    return tuple(hits)


def value(spec: Spec, path: str) -> Any:
    """The field at a full path.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.
    path : str
        Full path, such as ``magnets[0].position``.

    Raises
    ------
    SpecError
        If the path leads nowhere.
    """
    node: Any = spec
    for key in _keys(path):
        try:
            node = node[key] if isinstance(key, int) else getattr(node, key)
        except (AttributeError, IndexError, TypeError):
            raise SpecError("names nothing of this machine", field=path, remedy="see `amb-design check`") from None
    return node


def metadata(spec: Spec, path: str) -> Mapping[str, Any]:
    """What is known of the field at a full path: its unit, domain and meaning.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.
    path : str
        Full path.
    """
    owner, _, name = path.rpartition(".")
    holder = value(spec, owner) if owner else spec
    return next(f.metadata for f in dataclasses.fields(holder) if f.name == name)


def is_switched_off(spec: Spec, path: str) -> bool:
    """True if the number at a full path is zero and thereby leaves its block out of the model.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.
    path : str
        Full path.
    """
    found = value(spec, path)
    return bool(metadata(spec, path).get("switch")) and isinstance(found, int | float) and found == 0


def skeleton(spec: Any) -> Any:
    """What a specification is apart from its numbers: two machines with equal skeletons differ in numbers only.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.

    Returns
    -------
    hashable
    """
    if isinstance(spec, tuple):
        return tuple(skeleton(item) for item in spec)
    if not isinstance(spec, Spec):
        return spec
    parts: list[Any] = [type(spec)]
    for f in dataclasses.fields(spec):
        found = getattr(spec, f.name)
        if "unit" not in f.metadata or found is None or isinstance(found, str):
            parts.append(skeleton(found) if f.compare else None)
        else:
            parts.append((bool(f.metadata["switch"]) and found == 0,))
    return tuple(parts)


def replace(spec: S, values: Mapping[str, Any]) -> S:
    """A copy with other values in some fields.

    Parameters
    ----------
    spec : Spec
        A machine or any part of one.
    values : mapping of str to object
        New values by path. A path to a number may be short; any other field (``"controller"``,
        ``"magnets"``) is named in full.

    Returns
    -------
    Spec
        The same kind of object.

    Raises
    ------
    SpecError
        If a path names nothing, or the new object is inconsistent.

    Examples
    --------
    ``replace(machine, {"controller.kd": 0.03, "bearings.damping": 100.0})``
    """
    tree: dict[Any, Any] = {}
    for path, value in values.items():
        for target in _targets(spec, path):
            node = tree
            keys = _keys(target)
            for key in keys[:-1]:
                node = node.setdefault(key, {})
                if isinstance(node, _Leaf):
                    raise SpecError(
                        "lies in something that is replaced as a whole", field=target, remedy="set it there"
                    )
            node[keys[-1]] = _Leaf(value)
    rebuilt: S = _rebuild(spec, tree)
    return rebuilt


@dataclasses.dataclass(frozen=True)
class _Leaf:
    value: Any


def _targets(spec: Spec, path: str) -> tuple[str, ...]:
    try:
        value(spec, path)
    except SpecError:  # not a full path: then it may be a short one for numbers
        return find(spec, path)
    return (path,)


def _rebuild(node: Any, tree: Any) -> Any:
    if isinstance(tree, _Leaf):
        return tree.value
    if isinstance(node, tuple):
        return tuple(_rebuild(item, tree[i]) if i in tree else item for i, item in enumerate(node))
    changes = {}
    for key, sub in tree.items():
        try:
            changes[key] = _rebuild(getattr(node, key), sub)
        except SpecError as error:
            raise error.inside(key) from None
    return dataclasses.replace(node, **changes)


@lru_cache(maxsize=4096)
def _steps(path: str) -> tuple[tuple[str, str], ...]:
    steps = []
    for step in path.split("."):
        match = _STEP.match(step)
        if match is None:
            raise SpecError(
                "is no path", field=path, remedy="write names joined by dots, such as rotor.disks[2].position"
            )
        steps.append((match[1], match[2]))
    return tuple(steps)


@lru_cache(maxsize=4096)
def _keys(path: str) -> tuple[Any, ...]:
    keys: list[Any] = []
    for name, indices in _steps(path):
        keys.append(name)
        keys.extend(int(i) for i in re.findall(r"\d+", indices))
    return tuple(keys)


def _fits(short: tuple[tuple[str, str], ...], full: tuple[tuple[str, str], ...]) -> bool:
    """True if `short` is `full` with some steps and indices left out; the last step must stay."""
    if short[-1][0] != full[-1][0]:
        return False
    rest = iter(full)
    return all(any(name == n and index in ("", i) for n, i in rest) for name, index in short)
