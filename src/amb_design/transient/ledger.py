"""Works and limits of a run by collocation, added up afterwards for many steps at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.system import Array
from .compiled import many
from .equations import FLAGS, WORKS
from .split import Split
from .step import Step

MANY = 2000
"""Steps that are kept before they are added up."""


@dataclass(frozen=True)
class Entry:
    """A step that was taken.

    Attributes
    ----------
    step : Step
    state, inputs : ndarray
        Scaled state at the start, and inputs at 0, h/2 and h one after the other.
    defect : ndarray
        By which the inputs differ from their parabolas at h/4.
    leaning : ndarray, shape (3, n)
        Gyroscopic forces of an accelerated spin at 0, h/2 and h; nothing at constant speed.
    quantities, speeds, held : ndarray
        What flags depend on, the first two at h/2 and h.
    """

    step: Step
    state: Array
    inputs: Array
    defect: Array
    leaning: Array
    quantities: Array
    speeds: Array
    held: Array


class Ledger:
    """Account of a run."""

    def __init__(self, split: Split):
        self.split = split
        self.entries: list[tuple[int, float, Entry]] = []
        self._clear()

    def _clear(self) -> None:
        self.works = np.zeros((0, len(WORKS)))
        self.shares = np.zeros((0, len(self.split.equations.machine.magnets) * len(FLAGS)))

    def add(self, row: int, share: float, entry: Entry) -> None:
        """Book a step of an output step, and its share of the latter's length."""
        self.entries.append((row, share, entry))
        if len(self.entries) >= MANY:
            self._settle()

    def drain(self) -> tuple[Array, Array]:
        """See `Stepper`."""
        self._settle()
        found = self.works, self.shares
        self._clear()
        return found

    def _settle(self) -> None:
        if not self.entries:
            return
        rows, parts, entries = (list(column) for column in zip(*self.entries, strict=True))
        self.entries = []
        missing = rows[-1] + 1 - len(self.works)
        self.works, self.shares = (np.vstack([a, np.zeros((missing, a.shape[1]))]) for a in (self.works, self.shares))
        for step in {id(e.step): e.step for e in entries}.values():
            mine = [k for k, e in enumerate(entries) if e.step is step]
            np.add.at(self.works, [rows[k] for k in mine], self._works(step, [entries[k] for k in mine]))
        held = np.array([e.held for e in entries])
        for node in (0, 1):
            quantities, speeds = (
                np.array([getattr(e, name)[node] for e in entries]) for name in ("quantities", "speeds")
            )
            (flags,) = many(self.split.flags, quantities, held, speeds[:, None])
            np.add.at(self.shares, rows, np.array(parts)[:, None] / 2.0 * flags)

    def _works(self, step: Step, entries: list[Entry]) -> Array:
        inputs, defects = np.array([e.inputs for e in entries]), np.array([e.defect for e in entries])
        states, b = np.hstack([np.array([e.state for e in entries]), inputs]), defects.shape[1]
        found = np.zeros((len(entries), len(WORKS)))
        for owner, form in zip(step.owners, step.works, strict=True):
            found[:, owner] = np.einsum("ki,ki->k", states @ form, states)
        velocities = (states @ step.velocities.reshape(4 * b, -1).T).reshape(-1, 4, b)
        nodes = np.concatenate([inputs.reshape(-1, 3, b), defects[:, None]], axis=1)
        each = np.einsum("ksi,ksi->ki", nodes, velocities)
        for i, owner in enumerate(self.split.owners):
            if owner >= 0:
                found[:, owner] += each[:, i]
        turning = b - len(self.split.owners)
        if turning:
            leaning = np.einsum("ksi,ksi->k", np.array([e.leaning for e in entries]), velocities[:, :3, -turning:])
            found[:, WORKS.index("damping")] += leaning
            found[:, WORKS.index("circulation")] += each[:, -turning:].sum(axis=1) - leaning
        return found
