"""Newton's method on the manifold where groups of eigenvalues coincide.

Minimisers of the spectral abscissa tend to have multiple eigenvalues, near which the abscissa grows like a root of the
distance and no gradient is of use. But the block T = W A V of a group is smooth, and so are its mean mu and the traces of
(T - mu)^k, which all vanish where the group is one multiple eigenvalue. Newton steps make them vanish, make the
means of all groups equal, and descend with what freedom is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from ..analysis.system import Array
from .dense import DenseFamily, Point

STEPS = 20
"""Newton steps for one guess of the groups."""

NEIGHBOURS = 7
"""Guesses of how near eigenvalues of one group are: as near as the rightmost one's neighbours, up to so many of them."""


@dataclass(frozen=True)
class Group:
    """Eigenvalues that are near one another.

    Attributes
    ----------
    speed : float
    values : ndarray of complex
    """

    speed: float
    values: Array

    @property
    def mean(self) -> complex:
        """The mean of the eigenvalues, which rounding affects much less than each of them."""
        return complex(self.values.mean())


def groups(dense: DenseFamily, p: Array, speeds: tuple[float, ...], size: float) -> tuple[Group, ...]:
    """Groups of eigenvalues at the spectral abscissa; of conjugate ones, that with positive imaginary part.

    Parameters
    ----------
    dense : DenseFamily
    p : ndarray, shape (parameters,)
    speeds : tuple of float
    size : float
        Eigenvalues nearer to one another than this times the modulus of the rightmost one belong together.
    """
    spectra = _spectra(dense, p, speeds)
    distance = size * abs(_rightmost(spectra))
    return _grouped(spectra, distance, 0.01 * distance)


Spectra = list[tuple[float, Array, bool]]
"""Speed, eigenvalues, and whether the matrix is real."""


def _spectra(dense: DenseFamily, p: Array, speeds: tuple[float, ...]) -> Spectra:
    point = dense.at(p)
    dense.evaluations += len(speeds)
    matrices = [point.matrix(s) for s in speeds]
    return [(s, np.linalg.eigvals(a), np.isrealobj(a)) for s, a in zip(speeds, matrices, strict=True)]


def _rightmost(spectra: Spectra) -> complex:
    return complex(max((v[np.argmax(v.real)] for _, v, _ in spectra), key=lambda v: v.real))


def _grouped(spectra: Spectra, distance: float, window: float) -> tuple[Group, ...]:
    """Groups of eigenvalues linked by steps no longer than a distance, if they reach into a window at the abscissa."""
    abscissa = _rightmost(spectra).real
    out = []
    for speed, values, real in spectra:
        for members in _linked(values, distance):
            group = Group(speed, values[members])
            conjugate = real and group.mean.imag < -1e-9 * abs(group.mean)
            if group.values.real.max() >= abscissa - window and not conjugate:
                out.append(group)
    return tuple(out)


def _linked(values: Array, distance: float) -> list[Array]:
    """Indices of values that are linked by steps no longer than the distance."""
    label = np.arange(len(values))
    for i, j in zip(*np.nonzero(np.abs(values[:, None] - values) <= distance), strict=True):
        if label[i] != label[j]:
            label[label == label[j]] = label[i]
    return [np.flatnonzero(label == k) for k in np.unique(label)]


def coalesced(
    dense: DenseFamily, p: Array, lower: Array, upper: Array, speeds: tuple[float, ...], unit: Array
) -> Iterator[Array]:
    """Points where groups of eigenvalues near p coincide, for several guesses of the groups.

    Parameters
    ----------
    dense : DenseFamily
    p : ndarray, shape (parameters,)
    lower, upper : ndarray
    speeds : tuple of float
    unit : ndarray
        Typical change of each parameter.

    Yields
    ------
    ndarray
        Every iterate: the best of them need not be the last.
    """
    tried: set[tuple[int, ...]] = set()
    spectra = _spectra(dense, p, speeds)
    nearby = np.sort(np.abs(np.concatenate([v for _, v, _ in spectra]) - _rightmost(spectra)))
    for distance in np.unique(nearby[1 : NEIGHBOURS + 1]):
        found = _grouped(spectra, 1.001 * float(distance), float(distance))
        shape = tuple(len(g.values) for g in found)
        if shape not in tried and max(shape) > 1:
            tried.add(shape)
            yield from _newton(dense, p, found, lower, upper, unit)


def _newton(
    dense: DenseFamily, p: Array, found: tuple[Group, ...], lower: Array, upper: Array, unit: Array
) -> Iterator[Array]:
    radius = 0.5 * float(np.linalg.norm(p / unit)) + 0.1
    shortest, stuck = np.inf, 0
    for _ in range(STEPS):
        point = dense.at(p)
        conditions = []
        for g in found:
            dense.evaluations += 1
            conditions.append(_conditions(point, g))
        if any(c is None for c in conditions):
            return
        known = [c for c in conditions if c is not None]
        found = tuple(c[0] for c in known)
        means, slopes = np.array([c[1] for c in known]), np.array([c[2] for c in known]) * unit
        residuals = np.concatenate([*(c[3] for c in known), means[1:] - means[0]])
        jacobian = np.vstack([*(c[4] * unit for c in known), slopes[1:] - slopes[0]])
        step, along = _step(residuals, jacobian, slopes[0])
        length = float(np.linalg.norm(step))
        stuck = stuck + 1 if length > max(0.7 * shortest, 1e-3 * radius) else 0
        shortest = min(shortest, length)
        if stuck > 4:  # these eigenvalues do not coalesce nearby
            return
        descent = along * min(1.0, 0.1 * radius / max(float(np.linalg.norm(along)), 1e-300))
        step = step * min(1.0, radius / max(length, 1e-300)) - descent
        p = np.clip(p + unit * step, lower, upper)
        yield p
        if float(np.linalg.norm(step)) <= 1e-12 * radius:
            return


def _step(residuals: Array, jacobian: Array, slope: Array) -> tuple[Array, Array]:
    """Shortest step that removes the residuals, and the slope of the mean along the manifold."""
    size = np.linalg.norm(jacobian, axis=1)
    size[size == 0.0] = 1.0
    u, s, v = np.linalg.svd(jacobian / size[:, None], full_matrices=False)
    kept = s > 1e-8 * s[0]
    u, s, v = u[:, kept], s[kept], v[kept]
    along = slope - v.T @ (v @ slope)
    if np.linalg.norm(along) <= 1e-8 * np.linalg.norm(slope):
        along = np.zeros_like(slope)
    return -v.T @ ((u.T @ (residuals / size)) / s), along


def _conditions(point: Point, group: Group) -> tuple[Group, float, Array, Array, Array] | None:
    """The group at a new point, its mean with slope, and what vanishes where it is one eigenvalue, with slopes."""
    a = point.matrix(group.speed)
    split = _block(a, group.values)
    if split is None:
        return None
    t, v, w = split
    m = len(t)
    values = t.diagonal().copy()
    mean = complex(values.mean())

    def slope(weights: Array) -> Array:
        return point.slope(v @ weights @ w, group.speed)

    of_mean = slope(np.eye(m) / m)
    deviation = t - mean * np.eye(m)
    power: Array = np.eye(m, dtype=complex)
    residuals, slopes = [], []
    for k in range(2, m + 1):
        power = power @ deviation
        residuals.append(np.sum(power.T * deviation))
        slopes.append(k * (slope(power) - power.trace() * of_mean))
    r, j = np.array(residuals, complex), np.array(slopes, complex).reshape(m - 1, len(of_mean))
    if np.isrealobj(a) and abs(mean.imag) <= 1e-9 * abs(mean):
        return Group(group.speed, values), mean.real, of_mean.real, r.real, j.real
    return (
        Group(group.speed, values),
        mean.real,
        of_mean.real,
        np.concatenate([r.real, r.imag]),
        np.vstack([j.real, j.imag]),
    )


def _block(a: Array, wanted: Array) -> tuple[Array, Array, Array] | None:
    """T, V and W with A V = V T and W V = 1, for the eigenvalues that are nearest to the wanted ones."""
    values = np.linalg.eigvals(a)
    rest = list(range(len(values)))
    chosen = []
    for value in wanted:
        chosen.append(min(rest, key=lambda i: abs(values[i] - value)))
        rest.remove(chosen[-1])
    inside, outside = values[chosen], values[rest]

    def belongs(value: complex) -> bool:
        return bool(np.abs(inside - value).min() < np.abs(outside - value).min(initial=np.inf))

    t, z, count = sla.schur(a.astype(complex), output="complex", sort=belongs, check_finite=False)
    m = len(wanted)
    if count != m:
        return None
    if m == len(a):
        return t, z, z.conj().T
    if np.abs(inside[:, None] - outside).min() <= 1e-12 * np.abs(values).max():
        return None
    x = sla.solve_sylvester(t[:m, :m], -t[m:, m:], t[:m, m:])
    return t[:m, :m], z[:, :m], np.hstack([np.eye(m), x]) @ z.conj().T
