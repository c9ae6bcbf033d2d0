"""Matrices that depend on parameters, as numbers with exact derivatives.

    E(p) dx/dt = (A0(p) + Omega A1(p)) x + (F(p) + G(p) d/dt) u,        y = C(p) x

A family is made once from CasADi expressions; at each p it gives the nonzeros of all matrices and their Jacobian. Every
derivative that a design needs, of an eigenvalue or of a frequency response, is a bilinear form of these matrices: left^H dX
right. So there is one place where derivatives are taken, and it works on nonzeros.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import casadi as ca
import numpy as np
import scipy.sparse as sp

from ..analysis.system import Array
from ..errors import ModelError
from ..model.pair import Pair, real

PARTS = ("E", "A0", "A1", "F", "G", "C")


class Inner(Protocol):
    """Numbers that a computation, not an expression, finds from the parameters: the gains of a law from its weights."""

    numbers: ca.SX

    def at(self, p: Array) -> tuple[Array, Array]:
        """Values, and their derivatives with one row a number."""


class Family:
    """Matrices as functions of a parameter vector.

    Parameters
    ----------
    p : casadi.SX
        Column of the parameters.
    parts : mapping of str to Pair or casadi.SX
        ``A0`` and any of ``E``, ``A1`` (square), ``F``, ``G`` (inputs and their rates), ``C`` (outputs) in terms of p.
    inner : Inner, optional
        Further symbols in the parts, whose values follow from p by a computation.

    Attributes
    ----------
    nonzeros : casadi.Function
        Nonzeros of all parts, and their Jacobian, as functions of p.
    slots : dict
        By part and 0 or 1 (real or imaginary part): which of the nonzeros are its, their rows and columns.

    Raises
    ------
    ModelError
        If shapes do not fit.

    Examples
    --------
    A matrix of one's own: ``Family(p, {"A0": A})`` for CasADi expressions, `Family.from_function` for a Function.
    """

    def __init__(self, p: ca.SX, parts: Mapping[str, Any], inner: Inner | None = None):
        pairs = {name: part if isinstance(part, Pair) else real(ca.SX(part)) for name, part in parts.items()}
        unknown = set(pairs) - set(PARTS)
        if unknown or "A0" not in pairs:
            raise ModelError(
                f"a family needs A0 and takes {', '.join(PARTS)}, but got {', '.join(sorted(pairs)) or 'nothing'}"
            )
        self.size = pairs["A0"].shape[0]
        for name in ("E", "A0", "A1"):
            if name in pairs and pairs[name].shape != (self.size, self.size):
                raise ModelError(f"{name} has the shape {pairs[name].shape}; {self.size} x {self.size} is expected")
        self.parameters = int(p.shape[0])
        columns: list[ca.SX] = []
        self.slots: dict[tuple[str, int], tuple[slice, Array, Array]] = {}
        start = 0
        for name, pair in pairs.items():
            for k, matrix in enumerate((pair.re, pair.im)):
                matrix = ca.SX(matrix)
                rows, cols = (np.array(t, int) for t in matrix.sparsity().get_triplet())
                self.slots[name, k] = (slice(start, start + len(rows)), rows, cols)
                columns.append(matrix.nz[:])
                start += len(rows)
        self.shapes = {name: pair.shape for name, pair in pairs.items()}
        values = ca.vertcat(*columns)
        self.inner = inner
        if inner is None:
            self.nonzeros = ca.Function("family", [p], [values, ca.jacobian(values, p)])
        else:
            slopes = [ca.jacobian(values, p), ca.jacobian(values, inner.numbers)]
            self.nonzeros = ca.Function("family", [p, inner.numbers], [values, *slopes])

    @classmethod
    def from_function(cls, A0: ca.Function, A1: ca.Function | None = None) -> Family:
        """A family from CasADi Functions A0(p) and A1(p).

        Parameters
        ----------
        A0, A1 : casadi.Function
            One column in, one square matrix out.

        Raises
        ------
        ModelError
            If a Function has other inputs or outputs.
        """
        for f in (A0, A1):
            if f is not None and (f.n_in() != 1 or f.n_out() != 1 or f.size1_out(0) != f.size2_out(0)):
                raise ModelError(f"{f.name()} must take one column of parameters and return one square matrix")
        p = ca.SX.sym("p", A0.size1_in(0))
        return cls(p, {"A0": A0(p)} | ({"A1": A1(p)} if A1 is not None else {}))

    def at(self, p: Array) -> Member:
        """The matrices at given parameters.

        Parameters
        ----------
        p : ndarray, shape (parameters,)
        """
        if self.inner is None:
            values, jacobian = self.nonzeros(p)
            return Member(self, np.array(p, float), values.full()[:, 0], jacobian.sparse().tocsr())
        found, slopes = self.inner.at(p)
        values, direct, through = self.nonzeros(p, found)
        jacobian = direct.sparse().tocsr() + through.sparse().tocsr() @ sp.csr_array(slopes)
        return Member(self, np.array(p, float), values.full()[:, 0], jacobian.tocsr())


@dataclass(frozen=True)
class Member:
    """A family at one value of its parameters.

    Attributes
    ----------
    family : Family
    p : ndarray, shape (parameters,)
    values : ndarray
        Nonzeros of all parts.
    jacobian : sparse array
        Their derivatives.
    """

    family: Family
    p: Array
    values: Array
    jacobian: Any

    def part(self, name: str) -> Array:
        """A part as a dense array; a missing E is the unit matrix, any other missing part is zero."""
        f = self.family
        if name not in f.shapes:
            return np.eye(f.size) if name == "E" else np.zeros((f.size, f.size))
        out = np.zeros(f.shapes[name], complex)
        for k, unit in enumerate((1.0, 1j)):
            where, rows, cols = f.slots[name, k]
            out[rows, cols] += unit * self.values[where]
        return out if out.imag.any() else out.real

    @cached_property
    def _changes(self) -> dict[str, tuple[Array, Array, Array]]:
        """Of each part: rows and columns of the nonzeros that depend on p, and their derivatives."""
        out, depends, changes = {}, np.diff(self.jacobian.indptr) > 0, self.jacobian.toarray()
        for name in self.family.shapes:
            pieces = []
            for k, unit in enumerate((1.0, 1j)):
                where, rows, cols = self.family.slots[name, k]
                block, moves = changes[where], np.flatnonzero(depends[where])
                if len(moves):
                    pieces.append((rows[moves], cols[moves], unit * block[moves]))
            if pieces:
                rows, cols = (np.concatenate([piece[i] for piece in pieces]) for i in (0, 1))
                out[name] = (rows, cols, np.concatenate([piece[2] for piece in pieces]))
        return out

    def form(self, name: str, left: Array, right: Array) -> Array:
        """Derivatives of left . X right with respect to the parameters.

        Parameters
        ----------
        name : str
            Part X.
        left, right : ndarray, shape (m, rows), (m, columns)
            One pair of vectors a row; `left` is not conjugated.

        Returns
        -------
        ndarray of complex, shape (m, parameters)
        """
        if name not in self._changes:
            return np.zeros((len(left), self.family.parameters), complex)
        rows, cols, changes = self._changes[name]
        return np.asarray((left[:, rows] * right[:, cols]) @ changes, complex)
