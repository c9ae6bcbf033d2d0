"""Design variables as a search sees them: numbers from 0 to 1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.system import Array
from ..spec.problem_parts import Variable


@dataclass(frozen=True)
class Scaling:
    """Map between variables and the unit cube.

    Attributes
    ----------
    variables : tuple of Variable
    """

    variables: tuple[Variable, ...]

    @property
    def _bounds(self) -> tuple[Array, Array, Array]:
        log = np.array([v.scale == "log" for v in self.variables], bool)
        lower, upper = (np.array([getattr(v, n) for v in self.variables], float) for n in ("lower", "upper"))
        lower[log], upper[log] = np.log(lower[log]), np.log(upper[log])
        return log, lower, upper

    def values(self, x: Array) -> Array:
        """SI values of points of the unit cube."""
        log, lower, upper = self._bounds
        p = lower + np.clip(x, 0.0, 1.0) * (upper - lower)
        given = [(v.lower, v.upper) for v in self.variables]
        bounds = np.array(given, float).reshape(-1, 2)
        return np.asarray(np.clip(np.where(log, np.exp(np.where(log, p, 0.0)), p), bounds[:, 0], bounds[:, 1]))

    def point(self, p: Array) -> Array:
        """Point of the unit cube from SI values."""
        log, lower, upper = self._bounds
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.where(log, np.log(np.where(log, p, 1.0)), p)
        return np.asarray(np.clip((u - lower) / (upper - lower), 0.0, 1.0))

    def rates(self, x: Array) -> Array:
        """Derivatives of the SI values with respect to x."""
        log, lower, upper = self._bounds
        return np.asarray(np.where(log, self.values(x), 1.0) * (upper - lower))
