"""The state of a machine at an instant: where a run ends and another may start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.system import Array
from ..errors import ModelError
from .plant import Plant


@dataclass(frozen=True)
class State:
    """Everything that a restart needs; independent of the number of modes.

    Attributes
    ----------
    time : float [s]
    angle : float
        That the shaft has turned [rad].
    displacements, velocities : ndarray
        Over the free degrees of freedom of the machine's mesh.
    law : ndarray
        States of the controllers, continuous or sampled, without their amplifiers.
    amplifiers : ndarray
        States of these.
    held : ndarray
        Commands of sampled controllers that act now [A], one for each axis; empty for continuous ones.
    pending : ndarray, shape (k, 1 + axes)
        Times and values of commands still to come.
    """

    time: float
    angle: float
    displacements: Array
    velocities: Array
    law: Array
    amplifiers: Array
    held: Array
    pending: Array

    def coordinates(self, plant: Plant) -> Array:
        """Modal coordinates, their rates and what else moves continuously: controllers unless they are sampled, and amplifiers."""
        if len(self.displacements) != len(plant.basis):
            raise ModelError(
                f"the saved state has {len(self.displacements)} displacements, {plant.machine.name} has "
                f"{len(plant.basis)}; restart the machine, with the mesh, that it was saved from"
            )
        moved = [plant.reduced(v) for v in (self.displacements, self.velocities)]
        law = np.zeros(0) if len(self.held) else self.law
        return np.concatenate([*moved, law, self.amplifiers])

    def arrays(self, prefix: str = "final_") -> dict[str, Array]:
        """For a file."""
        return {prefix + name: np.asarray(value) for name, value in vars(self).items()}

    @classmethod
    def of(cls, arrays: dict[str, Array], prefix: str = "final_") -> State:
        """From a file."""
        found = {k.removeprefix(prefix): v for k, v in arrays.items() if k.startswith(prefix)}
        return cls(float(found.pop("time")), float(found.pop("angle")), **found)
