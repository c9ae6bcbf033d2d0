"""Covers: how a range of speeds and a box of parameters are cut into cells that can be proven one by one.

Whether a cell holds is decided by the checker's own arithmetic, so that what is found here passes there. Cells are laid
end to end from low to high speed; their length follows what could be proven last.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .checker import Family, guesses

CUTS = 7
"""How often a cell is cut across its parameters before a shorter range of speeds is tried."""


@dataclass(frozen=True)
class Cover:
    """Cells of a range of speeds.

    Attributes
    ----------
    tree : number or list
        As the checker reads it; None if nothing was proven.
    reached : float
        Speed up to which it goes [rad/s].
    cells : int
    """

    tree: Any
    reached: float
    cells: int


def cover(
    family: Family,
    low: float,
    high: float,
    sides: tuple[float, ...] = (),
    unstable: Callable[[int], bool] = lambda count: count == 0,
    limit: float | None = None,
    resolution: float = 1e-4,
) -> Cover:
    """Cells that prove a claim from one speed to another, or as far as it can be proven.

    Parameters
    ----------
    family : Family
    low, high : float
        Range of speeds [rad/s].
    sides : tuple of float
        Half widths of the box of parameters.
    unstable : callable
        Which numbers of unstable eigenvalues the claim allows.
    limit : float, optional
        Speed at which the claim is known to become false; cells grow shorter towards it.
    resolution : float
        Cells shorter than this part of the range are given up.

    Returns
    -------
    Cover
    """
    box = [(-side, side) for side in sides]
    edges, cells = [low], []
    step, share = (high - low) / 4.0, 0.8
    while edges[-1] < high:
        t = edges[-1]
        if limit is not None:
            step = min(step, 2.0 * share / (1.0 + share) * (limit - t))
        end = high if t + 1.1 * step >= high else _short(t + step)
        found = _cell(family, [(t, end), *box], unstable, 0)
        if found is not None:
            cells.append(found)
            edges.append(end)
            step, share = 1.7 * step, min(1.1 * share, 0.95)
        else:
            step, share = 0.5 * min(step, end - t), 0.8 * share
            if step < resolution * (high - low):
                break
    if not cells:
        return Cover(None, low, 0)
    tree = cells[-1]
    for cell, edge in zip(cells[-2::-1], edges[-2:0:-1], strict=True):
        tree = [0, edge, cell, tree]
    return Cover(tree, edges[-1], sum(map(count, cells)))


def count(tree: Any) -> int:
    """Number of cells of a cover."""
    return count(tree[2]) + count(tree[3]) if isinstance(tree, list) else 1


def _cell(family: Family, box: list[tuple[float, float]], unstable: Callable[[int], bool], cuts: int) -> Any:
    """A cell, cut across its parameters until all parts hold; None if that does not help."""
    middle = [_short((a + b) / 2.0) if k == 0 else (a + b) / 2.0 for k, (a, b) in enumerate(box)]
    corners = list(itertools.product(*[sorted({a, b}) for a, b in box]))
    if family.holds(corners, tuple(middle), unstable):
        return middle[0]
    if len(box) == 1 or cuts == CUTS:
        return None
    axis = _widest(family, box, middle)
    low, high = box[axis]
    place = (low + high) / 2.0
    parts = []
    for edges in ((low, place), (place, high)):
        parts.append(_cell(family, [*box[:axis], edges, *box[axis + 1 :]], unstable, cuts + 1))
        if parts[-1] is None:
            return None
    return [axis, place, *parts]


def _widest(family: Family, box: list[tuple[float, float]], middle: list[float]) -> int:
    """The parameter whose range moves the matrix most, in the coordinates of the proof."""
    matrix = sum((t * p.mid for t, p in zip(middle, family.parts[1:], strict=True)), family.parts[0].mid)
    moves = [(b - a) * p.mid for (a, b), p in zip(box, family.parts[1:], strict=True)]
    v, w, signs = guesses(matrix, moves)
    d = signs / (w @ v).diagonal()
    sizes = [float(np.linalg.norm((w @ move @ v) / d, 2)) for move in moves[1:]]
    return 1 + int(np.argmax(sizes))


def _short(speed: float) -> float:
    """The speed with fewer digits, for short certificates."""
    return float(f"{speed:.12g}")
