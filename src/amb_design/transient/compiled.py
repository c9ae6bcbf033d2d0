"""CasADi functions on numpy arrays, without the cost of conversions."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..analysis.system import Array

BLOCK = 500
"""Instants that are evaluated at once: larger maps take longer to set up than they save."""


class Compiled:
    """A function that reads and writes arrays of its own.

    Parameters
    ----------
    function : casadi.Function
        With dense inputs and outputs.

    Attributes
    ----------
    inputs, outputs : list of ndarray
        In the shapes of the function, columns without their second dimension. Fill the first, call, read the second.
    """

    def __init__(self, function: Any):
        self._buffer, self._call = function.buffer()
        self.inputs, self._given = self._arrays([function.size_in(i) for i in range(function.n_in())])
        self.outputs, self._found = self._arrays([function.size_out(i) for i in range(function.n_out())])
        for i, array in enumerate(self._given):
            self._buffer.set_arg(i, memoryview(array))
        for i, array in enumerate(self._found):
            self._buffer.set_res(i, memoryview(array))

    @staticmethod
    def _arrays(shapes: list[tuple[int, int]]) -> tuple[list[Array], list[Any]]:
        flat: list[Any] = [np.zeros(rows * columns) for rows, columns in shapes]
        shaped = [a if s[1] == 1 else a.reshape(s, order="F") for a, s in zip(flat, shapes, strict=True)]
        return shaped, flat

    def __call__(self) -> None:
        self._call()


def many(function: Any, *columns: Array) -> list[Array]:
    """Evaluate for many instants at once.

    Parameters
    ----------
    function : casadi.Function
        Of column vectors, dense.
    columns : ndarray, shape (m, size of the input)
        One row for each instant.

    Returns
    -------
    list of ndarray, shape (m, size of the output)
    """
    count = len(columns[0])
    found = [np.empty((count, function.size1_out(i))) for i in range(function.n_out())]
    sizes = [BLOCK] * (count // BLOCK) + [count % BLOCK] * (count % BLOCK > 0)
    mapped = {size: Compiled(function.map(size)) for size in set(sizes)}
    for k, size in enumerate(sizes):
        here, block = mapped[size], slice(k * BLOCK, k * BLOCK + size)
        for place, values in zip(here.inputs, columns, strict=True):
            place.reshape(-1, size)[:] = values[block].reshape(size, -1).T
        here()
        for target, values in zip(found, here.outputs, strict=True):
            target[block] = values.reshape(-1, size).T
    return found
