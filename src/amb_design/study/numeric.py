"""Computations that no expression can state, as CasADi Functions with exact derivatives.

CasADi calls back into Python for the values and for the Jacobian; forward and reverse derivatives are products with it.
Second derivatives are central differences of the exact first ones, with steps that know how large each input is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..errors import ModelError
from ..threads import one_thread

Compute = Callable[..., tuple[Array, Sequence[Array]]]
"""From input columns to an output column and its Jacobian with respect to each input."""

_ALIVE: list[ca.Callback] = []
"""CasADi does not keep a callback alive that its expressions call, and an expression may outlive whoever made it."""


STEP = 3e-4
"""Of second derivatives, relative to the input."""


def numeric(
    name: str,
    inputs: Sequence[tuple[str, int]],
    output: tuple[str, int],
    compute: Compute,
    typical: Sequence[Array],
) -> ca.Function:
    """A Function that is evaluated by Python.

    Parameters
    ----------
    name : str
    inputs : sequence of (str, int)
        Name and length of each input column.
    output : (str, int)
        Name and length of the output column.
    compute : callable
        Called with one array for each input.
    typical : sequence of ndarray
        Size of each entry of each input.

    Returns
    -------
    casadi.Function
        It can be differentiated, mapped and put into any problem, but neither saved nor pickled.
    """
    made = _Numeric(name, tuple(inputs), output, _Memory(compute), typical)
    _ALIVE.append(made)
    return made


class _Memory:
    """The last few results, which value and Jacobian share."""

    def __init__(self, compute: Compute, size: int = 4):
        self.compute, self.size = compute, size
        self.found: dict[bytes, tuple[Array, list[Array]]] = {}

    @one_thread
    def at(self, columns: Sequence[Any]) -> tuple[Array, list[Array]]:
        arrays = [np.asarray(c.full(), float)[:, 0] for c in columns]
        key = b"".join(a.tobytes() for a in arrays)
        if key not in self.found:
            value, slopes = self.compute(*arrays)
            while len(self.found) >= self.size:
                self.found.pop(next(iter(self.found)))
            self.found[key] = np.asarray(value, float), [np.asarray(s, float) for s in slopes]
        return self.found[key]


class _Numeric(ca.Callback):
    """Values."""

    def __init__(
        self,
        name: str,
        inputs: tuple[tuple[str, int], ...],
        output: tuple[str, int],
        memory: _Memory,
        typical: Sequence[Array],
    ):
        ca.Callback.__init__(self)
        self.inputs, self.output, self.memory, self.typical = inputs, output, memory, typical
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self.inputs)

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return self.inputs[i][0]

    def get_name_out(self, i: int) -> str:
        return self.output[0]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.inputs[i][1], 1)

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.output[1], 1)

    def eval(self, arg: Sequence[Any]) -> list[Any]:
        return [self.memory.at(arg)[0]]

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inames: Sequence[str], onames: Sequence[str], opts: Any) -> ca.Function:
        made = _Jacobian(name, self, inames, onames, opts)
        _ALIVE.append(made)
        return made

    def save(self, *_: Any) -> None:
        """Refuse: CasADi would write a file that nobody can read."""
        self.serialize()

    def serialize(self, *_: Any) -> Any:
        """Refuse, too."""
        raise ModelError(
            f"{self.name()} is computed by Python and cannot be saved; pickle its ClosedLoop, which builds it again"
        )


class _Jacobian(ca.Callback):
    """Jacobians with respect to each input."""

    def __init__(self, name: str, of: _Numeric, inames: Sequence[str], onames: Sequence[str], opts: Any):
        ca.Callback.__init__(self)
        self.of, self.inames, self.onames = of, inames, onames
        self.construct(name, opts)

    def get_n_in(self) -> int:
        return len(self.inames)

    def get_n_out(self) -> int:
        return len(self.onames)

    def get_name_in(self, i: int) -> str:
        return self.inames[i]

    def get_name_out(self, i: int) -> str:
        return self.onames[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        if i < len(self.of.inputs):
            return ca.Sparsity.dense(self.of.inputs[i][1], 1)
        return ca.Sparsity(self.of.output[1], 1)  # the value is not needed

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.of.output[1], self.of.inputs[i][1])

    def eval(self, arg: Sequence[Any]) -> list[Any]:
        return list(self.of.memory.at(arg[: len(self.of.inputs)])[1])

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inames: Sequence[str], onames: Sequence[str], opts: Any) -> ca.Function:
        made = _Curvature(name, self, inames, onames, opts)
        _ALIVE.append(made)
        return made


class _Curvature(ca.Callback):
    """Derivatives of the Jacobians, by differences."""

    def __init__(self, name: str, of: _Jacobian, inames: Sequence[str], onames: Sequence[str], opts: Any):
        ca.Callback.__init__(self)
        self.of, self.inames, self.onames = of, inames, onames
        self.construct(name, opts)

    def get_n_in(self) -> int:
        return len(self.inames)

    def get_n_out(self) -> int:
        return len(self.onames)

    def get_name_in(self, i: int) -> str:
        return self.inames[i]

    def get_name_out(self, i: int) -> str:
        return self.onames[i]

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        first = self.of.get_n_in()
        if i < first:
            return self.of.get_sparsity_in(i)
        out = self.of.get_sparsity_out(i - first)
        return ca.Sparsity(out.size1(), out.size2())

    def get_sparsity_out(self, i: int) -> ca.Sparsity:
        out, by = divmod(i, self.of.get_n_in())
        rows, columns = self.of.get_sparsity_out(out).numel(), self.of.get_sparsity_in(by).numel()
        dense = by < len(self.of.of.inputs)
        return ca.Sparsity.dense(rows, columns) if dense else ca.Sparsity(rows, columns)

    def eval(self, arg: Sequence[Any]) -> list[Any]:
        source = self.of.of
        point = [a.full() for a in arg[: len(source.inputs)]]
        columns: list[list[list[Array]]] = []  # by input, entry, Jacobian
        for k, x in enumerate(point):
            columns.append([])
            for j in range(len(x)):
                step = STEP * max(abs(float(x[j, 0])), float(source.typical[k][j]) or 1.0)
                ends = []
                for sign in (1.0, -1.0):
                    moved = [y.copy() for y in point]
                    moved[k][j, 0] += sign * step
                    ends.append(source.memory.at([ca.DM(y) for y in moved])[1])
                columns[k].append([(a - b).ravel(order="F") / (2.0 * step) for a, b in zip(*ends, strict=True)])
        out = []
        for i in range(len(source.inputs)):
            for k in range(self.of.get_n_in()):
                rows, width = self.get_sparsity_out(i * self.of.get_n_in() + k).shape
                found = [column[i] for column in columns[k]] if k < len(point) else []
                out.append(ca.DM(np.stack(found, axis=1)) if found else ca.DM(rows, width))
        return out
