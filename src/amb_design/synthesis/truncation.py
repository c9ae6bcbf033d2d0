"""Balanced truncation of the synthesis plant: a law of few states for a rotor of many modes.

States that do not stand without control are kept. Of the others, what the law's outputs hardly excite or what hardly shows in its
inputs is left out: states of small Hankel singular values (B. C. Moore, IEEE Trans. Automatic Control 26, 1981), at the speed of the
design. It is a projection, A -> left A right, so that the plant stays linear in the speed, and weights and noises stay what they are.

Only the subspaces matter, not the coordinates in them. Derivatives are those of subspaces that turn without a change of coordinates
inside; what is built on them (responses, eigenvalues of the closed loop) has the right derivatives, its matrices have not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from ..errors import SolveError
from .plant import PACE, Plant
from .reduction import Array
from .riccati import adjoint, lyapunov

STANDS = 1e-6
"""Decay, over `PACE`, from which a state counts as standing without control."""


@dataclass(frozen=True)
class Truncation:
    """x = right z, and left A right is the matrix in z.

    Attributes
    ----------
    right : ndarray, shape (n, r)
    left : ndarray, shape (r, n)
        left right = 1.
    d_right, d_left : ndarray
        Derivatives along a first axis.
    hankel : ndarray
        Hankel singular values of the states that stand without control, the largest first.
    """

    right: Array
    left: Array
    d_right: Array
    d_left: Array
    hankel: Array


def truncated(plant: Plant, speed: float, moves: Array, order: int) -> Plant:
    """The plant on few states.

    Parameters
    ----------
    plant : Plant
    speed, moves
        As in `Plant.at`.
    order : int
        States that are kept, in each plane.

    Raises
    ------
    SolveError
        If there are not more states than that, or more of them do not stand without control.
    """
    t = truncation(plant, speed, moves, order)
    v, d = plant.values, plant.changes
    values, changes = dict(v), dict(d)
    for name in ("A0", "A1"):
        values[name] = t.left @ v[name] @ t.right
        changes[name] = t.d_left @ v[name] @ t.right + t.left @ (d[name] @ t.right + v[name] @ t.d_right)
    values["B"], changes["B"] = t.left @ v["B"], t.d_left @ v["B"] + t.left @ d["B"]
    values["C"], changes["C"] = v["C"] @ t.right, d["C"] @ t.right + v["C"] @ t.d_right
    integrals = plant.sizes[2]
    right = sla.block_diag(t.right, np.eye(integrals))
    d_right = np.pad(t.d_right, ((0, 0), (0, integrals), (0, integrals)))
    for name, x, dx in (("Q", right, d_right), ("W", adjoint(t.left), adjoint(t.d_left))):
        half = adjoint(dx) @ v[name] @ x
        values[name], changes[name] = adjoint(x) @ v[name] @ x, half + adjoint(half) + adjoint(x) @ d[name] @ x
    return Plant(values, changes)


def truncation(plant: Plant, speed: float, moves: Array, order: int) -> Truncation:
    """Subspaces of the states that are kept.

    Parameters
    ----------
    plant, speed, moves, order
        As in `truncated`.
    """
    there = plant.at(speed, moves)
    v, d = there.values, there.changes
    A, dA = v["A0"] / PACE, d["A0"] / PACE
    n, complex_form = len(A), np.iscomplexobj(A)
    eye = np.eye(n)
    T, Z, kept = sla.schur(A + STANDS * eye, output="complex" if complex_form else "real", sort="rhp")
    _check(order, kept, n, plant.planes)
    # coordinates in which what does not stand and what does go their own ways: x = S (x1, x2)
    T = T - STANDS * eye
    unstable, stable = T[:kept, :kept], T[kept:, kept:]
    S, back = Z.copy(), adjoint(Z)
    across = sla.solve_sylvester(unstable, -stable, -T[:kept, kept:])
    S[:, kept:] += Z[:, :kept] @ across
    back[:kept] -= across @ back[kept:]
    b, c = back @ v["B"] / PACE, v["C"] @ S
    N, db, dc = back @ dA @ S, back @ d["B"] / PACE, d["C"] @ S
    # and how these two subspaces turn
    Y12, Y21 = np.zeros_like(N[:, :kept, kept:]), np.zeros_like(N[:, kept:, :kept])
    for k, x in enumerate(N):
        Y12[k] = sla.solve_sylvester(unstable, -stable, -x[:kept, kept:])
        Y21[k] = sla.solve_sylvester(stable, -unstable, -x[kept:, :kept])
    dB, dC = db[:, kept:] - Y21 @ b[:kept], dc[:, :, kept:] + c[:, :kept] @ Y12
    count = plant.planes * order - kept
    right, left, d_right, d_left, hankel = _balanced(stable, b[kept:], c[:, kept:], N[:, kept:, kept:], dB, dC, count)
    s1, s2, l1, l2 = S[:, :kept], S[:, kept:], back[:kept], back[kept:]
    return Truncation(
        np.hstack([s1, s2 @ right]),
        np.vstack([l1, left @ l2]),
        np.concatenate([s2 @ Y21, s1 @ Y12 @ right + s2 @ d_right], axis=2),
        np.concatenate([-Y12 @ l2, d_left @ l2 - left @ Y21 @ l1], axis=1),
        hankel,
    )


def _balanced(
    A: Array, B: Array, C: Array, dA: Array, dB: Array, dC: Array, count: int
) -> tuple[Array, Array, Array, Array, Array]:
    """Subspaces of a stable system, their derivatives, and all Hankel singular values."""
    reached, seen = B @ adjoint(B), adjoint(C) @ C
    forward, backward = (sla.schur(x, output="complex") for x in (adjoint(A), A))
    P, Q = lyapunov(forward, reached[None])[0], lyapunov(backward, seen[None])[0]
    half_P, half_Q = dA @ P + dB @ adjoint(B), adjoint(dA) @ Q + adjoint(dC) @ C
    dP = lyapunov(forward, half_P + adjoint(half_P))
    dQ = lyapunov(backward, half_Q + adjoint(half_Q))
    if not np.iscomplexobj(A):
        P, Q, dP, dQ = P.real, Q.real, dP.real, dQ.real
    p, q = _root(P), _root(Q)
    u, hankel, vh = np.linalg.svd(adjoint(q) @ p)
    size = np.sqrt(hankel[:count])
    right, left = p @ adjoint(vh)[:, :count] / size, adjoint(q @ u[:, :count] / size)
    # P Q right = right sigma^2: the subspaces turn into the rest, where the equations of the columns are regular
    rest = np.eye(len(A)) - right @ left
    turned = dP @ Q + P @ dQ
    sources, targets = -rest @ turned @ right, -left @ turned @ rest
    d_right, d_left = np.zeros_like(sources), np.zeros_like(targets)
    for j, value in enumerate(hankel[:count]):
        equation = P @ Q @ rest - value**2 * np.eye(len(A))
        d_right[:, :, j] = np.linalg.solve(equation, sources[:, :, j].T).T
        equation = rest @ P @ Q - value**2 * np.eye(len(A))
        d_left[:, j, :] = np.linalg.solve(equation.T, targets[:, j, :].T).T
    return right, left, d_right, d_left, hankel


def _root(X: Array) -> Array:
    """A factor of a positive semidefinite matrix: X = root root^H."""
    values, vectors = np.linalg.eigh((X + adjoint(X)) / 2.0)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def _check(order: int, kept: int, n: int, planes: int) -> None:
    least, there = -(-kept // planes), n // planes
    if order < max(least, 1):
        raise SolveError(
            f"controller.order = {order} keeps fewer than the {least} states that do not stand without control; raise it to {least} or more"
        )
    if order >= there:
        raise SolveError(
            f"controller.order = {order} is not below the {there} states of rotor and hardware in each plane; leave it out to keep them all"
        )
