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

CUTS, CELLS = 24, 400
"""Depth and number of cells at which a box of parameters is given up."""

LATE = 0.7
"""Where a range of speeds is cut in a box: what is hard is near its end."""


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


def box_cover(family: Family, high: float, sides: tuple[float, ...]) -> Cover:
    """Cells that prove stability from rest to a speed for all parameters in a box.

    A cell that does not hold is cut across that of speed and parameters which moves the matrix most.

    Parameters
    ----------
    family : Family
    high : float
        End of the range of speeds [rad/s].
    sides : tuple of float
        Half widths of the box.

    Returns
    -------
    Cover
        Without a tree if it was given up.
    """
    left = [CELLS]

    def cell(box: list[tuple[float, float]], cuts: int) -> Any:
        left[0] -= 1
        middle = [_short((a + b) / 2.0) if k == 0 else (a + b) / 2.0 for k, (a, b) in enumerate(box)]
        corners = list(itertools.product(*[sorted({a, b}) for a, b in box]))
        if family.holds(corners, tuple(middle), lambda count: count == 0):
            return middle[0]
        if cuts == CUTS or left[0] <= 0:
            return None
        axis = _widest(family, box, middle)
        low, high = box[axis]
        place = (low + high) / 2.0 if axis else _short(low + LATE * (high - low))
        upper = cell([*box[:axis], (place, high), *box[axis + 1 :]], cuts + 1)
        lower = None if upper is None else cell([*box[:axis], (low, place), *box[axis + 1 :]], cuts + 1)
        return None if lower is None else [axis, place, lower, upper]

    tree = cell([(0.0, high), *[(-side, side) for side in sides]], 0)
    return Cover(tree, 0.0 if tree is None else high, 0 if tree is None else count(tree))


def cover(
    family: Family,
    low: float,
    high: float,
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
    edges, cells = [low], list[float]()
    step, share = (high - low) / 4.0, 0.8
    while edges[-1] < high:
        t = edges[-1]
        if limit is not None:
            step = min(step, 2.0 * share / (1.0 + share) * (limit - t))
        end = high if t + 1.1 * step >= high else _short(t + step)
        middle = _short((t + end) / 2.0)
        if family.holds([(t,), (end,)], (middle,), unstable):
            cells.append(middle)
            edges.append(end)
            step, share = 1.7 * step, min(1.1 * share, 0.95)
        else:
            step, share = 0.5 * min(step, end - t), 0.8 * share
            if step < resolution * (high - low):
                break
    if not cells:
        return Cover(None, low, 0)
    return Cover(_balanced(cells, edges[1:-1]), edges[-1], len(cells))


def _balanced(cells: list[float], cuts: list[float]) -> Any:
    """Cells that lie end to end as a tree of little depth."""
    if len(cells) == 1:
        return cells[0]
    k = len(cells) // 2
    return [0, cuts[k - 1], _balanced(cells[:k], cuts[: k - 1]), _balanced(cells[k:], cuts[k:])]


def count(tree: Any) -> int:
    """Number of cells of a cover."""
    return count(tree[2]) + count(tree[3]) if isinstance(tree, list) else 1


def _widest(family: Family, box: list[tuple[float, float]], middle: list[float]) -> int:
    """The axis along which the cell moves the matrix most, in the coordinates of the proof."""
    matrix = sum((t * p.mid for t, p in zip(middle, family.parts[1:], strict=True)), family.parts[0].mid)
    moves = [(b - a) * p.mid for (a, b), p in zip(box, family.parts[1:], strict=True)]
    v, w, signs = guesses(matrix, moves)
    d = signs / (w @ v).diagonal()
    sizes = [float(np.linalg.norm((w @ move @ v) / d, 2)) for move in moves]
    return int(np.argmax(sizes))


def _short(speed: float) -> float:
    """The speed with fewer digits, for short certificates."""
    return float(f"{speed:.12g}")
