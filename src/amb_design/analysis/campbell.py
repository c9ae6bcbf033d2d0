"""Campbell diagram: eigenvalues over the spin speed, followed through crossings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ..errors import SolveError
from ..spec.machine import Machine
from ..threads import one_thread
from .certificate import Eigensystem, Walk
from .critical import CriticalSpeed, critical_speeds
from .modes import OVERDAMPED, mode, whirls
from .polish import Polisher
from .system import Array, System, ascending, system

TRUNCATION = 1e-6
"""A truncated basis is accepted if it moves no eigenvalue shown by more than this fraction."""


@dataclass(frozen=True)
class Campbell:
    """Result of `campbell`.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        Spin speeds [rad/s].
    eigenvalues : ndarray, shape (m, k)
        One column a mode, followed over the speed [1/s]; the imaginary part is the whirl frequency, positive.
    whirl : tuple of str
        Direction of each mode at the highest speed.
    kind : tuple of str
        ``"rotor"`` or ``"controller"`` for each mode.
    largest_real_part : ndarray, shape (m,)
        Over all whirling modes of the model [1/s], also those that are not shown.
    largest_real_pole : ndarray, shape (m,)
        Over the poles that do not whirl, such as integrators [1/s]; -inf where there is none.
    critical : tuple of CriticalSpeed
    complete : bool
        True if `largest_real_part` covers the full model and not a verified truncation.
    machine : Machine
    """

    speeds: Array
    eigenvalues: Array
    whirl: tuple[str, ...]
    kind: tuple[str, ...]
    largest_real_part: Array
    largest_real_pole: Array
    critical: tuple[CriticalSpeed, ...]
    complete: bool
    machine: Machine = field(repr=False)

    @property
    def frequencies(self) -> Array:
        """Whirl frequencies [rad/s], shape (m, k)."""
        return np.asarray(self.eigenvalues.imag)

    @property
    def damping_ratios(self) -> Array:
        """-Re/abs of the eigenvalues, shape (m, k)."""
        return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues))

    @property
    def logarithmic_decrements(self) -> Array:
        """-2 pi Re/Im of the eigenvalues, shape (m, k)."""
        return np.asarray(-2.0 * np.pi * self.eigenvalues.real / self.eigenvalues.imag)


@one_thread
def campbell(
    machine: Machine | System,
    speeds: Sequence[float] | Array | None = None,
    modes: int = 12,
    *,
    fast: bool = False,
    critical: bool = True,
) -> Campbell:
    """Compute the Campbell diagram.

    Parameters
    ----------
    machine : Machine or System
    speeds : array_like, optional
        Ascending spin speeds [rad/s]; 121 up to the top speed if left out.
    modes : int
        Number of modes with the lowest whirl frequencies to follow; modes that become unstable are always added.
    fast : bool
        Truncate the model to as many modes of the rotor at rest as keep the modes shown within 1e-6, checked on the
        full model at the highest speed. Then `largest_real_part` covers the truncated model only.
    critical : bool
        Find the critical speeds too.

    Returns
    -------
    Campbell
    """
    loop = machine if isinstance(machine, System) else system(machine)
    top = loop.machine.operation.top_speed
    grid = np.linspace(0.0, top, 121) if speeds is None else ascending(speeds)
    reduced = _truncated(loop, float(grid[-1]), modes) if fast else loop
    decompositions = _decomposed(reduced, grid)
    whirling, still = _largest(decompositions)
    branches = _follow(decompositions, reduced.complex_form)
    values = np.stack([e.values[b] for e, b in zip(decompositions, branches, strict=True)])
    noise = np.stack([e.uncertainty[b] for e, b in zip(decompositions, branches, strict=True)])
    shown = _shown(values, noise, modes)
    last = [mode(reduced, decompositions[-1], int(branches[-1][j])) for j in shown]
    chosen = values[:, shown]
    return Campbell(
        speeds=grid,
        eigenvalues=chosen.real + 1j * np.abs(chosen.imag),
        whirl=tuple(m.whirl for m in last),
        kind=tuple(m.kind for m in last),
        largest_real_part=whirling,
        largest_real_pole=still,
        critical=critical_speeds(loop, float(grid[-1])) if critical else (),
        complete=reduced is loop,
        machine=loop.machine,
    )


def _decomposed(loop: System, speeds: Array) -> list[Eigensystem]:
    """Eigendecompositions at all speeds, in one call each to the batched routines."""
    matrices = loop.A0 + speeds[:, None, None] * loop.A1
    values, right = np.linalg.eig(matrices)
    left = np.linalg.inv(right)
    return list(map(Eigensystem, speeds.tolist(), values, right, left, left @ loop.A1 @ right, matrices))


def _largest(decompositions: list[Eigensystem]) -> tuple[Array, Array]:
    whirling, still = [], []
    for e in decompositions:
        moves = whirls(e.values)
        whirling.append(e.values.real[moves].max(initial=-np.inf))
        still.append(e.values.real[~moves].max(initial=-np.inf))
    return np.array(whirling), np.array(still)


def _follow(decompositions: list[Eigensystem], complex_form: bool) -> list[Array]:
    """Index of each branch in each decomposition, matched by tangent and by overlap of left and right vectors."""
    from scipy.optimize import linear_sum_assignment  # imported late: slow to load

    first = decompositions[0]
    branch = np.arange(len(first.values)) if complex_form else np.flatnonzero(first.values.imag >= 0.0)
    out = [branch]
    for e, f in pairwise(decompositions):
        expected = e.values + (f.speed - e.speed) * e.rates
        distance = np.abs(expected[:, None] - f.values) / (np.abs(expected)[:, None] + np.abs(f.values) + 1e-300)
        overlap = np.abs(e.left @ f.right) * np.abs(f.left @ e.right).T
        cost = distance + 1.0 - np.minimum(overlap, 1.0)
        branch = linear_sum_assignment(cost[branch])[1]
        out.append(branch)
    return out


def _shown(values: Array, noise: Array, modes: int) -> Array:
    """Columns to show: the lowest modes that are not overdamped throughout, and any that is unstable somewhere."""
    frequency = np.abs(values.imag)
    moves = whirls(values).any(axis=0)
    seen = moves & (-values.real < OVERDAMPED * np.abs(values)).any(axis=0)
    order = np.argsort(np.where(seen, frequency.mean(axis=0), np.inf))
    lowest = order[: min(modes, int(seen.sum()))]
    unstable = np.flatnonzero(moves & (values.real > noise).any(axis=0))
    chosen = np.union1d(lowest, unstable)
    return np.asarray(chosen[np.argsort(frequency[:, chosen].mean(axis=0))])


def _truncated(loop: System, top: float, modes: int) -> System:
    """The smallest verified truncation, or the full loop if none holds."""
    n = loop.displacements
    polisher = Polisher(loop.pencil)
    size = modes // (2 if loop.complex_form else 1) + 8
    while size < 0.6 * n:
        reduced = loop.truncated(size)
        e = Walk(reduced.A0, reduced.A1).at(top)
        whirling = np.flatnonzero(whirls(e.values) & (-e.values.real < OVERDAMPED * np.abs(e.values)))
        lowest = whirling[np.argsort(np.abs(e.values.imag[whirling]))][:modes]
        try:
            if all(_moved(polisher, reduced, e, int(i)) <= TRUNCATION for i in reversed(lowest)):
                return reduced
        except SolveError:
            pass
        size += size // 2
    return loop


def _moved(polisher: Polisher, reduced: System, e: Eigensystem, index: int) -> float:
    """Relative change of an eigenvalue from the truncated to the full model."""
    value = complex(e.values[index])
    exact, _, _ = polisher.eigenpair(
        e.speed, value, reduced.to_state @ e.right[:, index], (e.left[index] @ reduced.from_rate).conj()
    )
    return abs(exact - value) / abs(exact)
