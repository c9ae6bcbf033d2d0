"""Laws in y and z: ideal feedback of the whole state, and what magnets with axes of their own make of a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca

from ..errors import ModelError
from ..spec.controller import StateFeedback, rows_of
from ..spec.magnet import Magnet
from .controller import Realisation
from .mesh import Mesh
from .pair import Affine, Matrix, Pair, real, zero


def whole_state(law: StateFeedback, mesh: Mesh, complex_form: bool, free: list[int]) -> tuple[Matrix, Realisation]:
    """What is seen, and the gains on it.

    Parameters
    ----------
    law : StateFeedback
    mesh : Mesh
        The machine's own, or one with a multiple of its elements.
    complex_form : bool
    free : list of int
        Degrees of freedom that no pin holds.

    Returns
    -------
    sensors : CasADi matrix, free degrees of freedom by inputs
        Picks displacements and slopes; of the real form first all in v and beta_y, then all in w and -beta_x.
    law : Realisation
        Without states; rows in the order of its magnets, of the real form first in y, then in z.

    Raises
    ------
    ModelError
        If the gains are for another mesh.
    """
    gains = _gains(law, complex_form)
    seen = gains.shape[1] // (2 if complex_form else 4)
    step, rest = divmod(mesh.nodes - 1, max(seen // 2 - 1, 1))
    if rest or seen % 2 or seen < 4:
        raise ModelError(f"state feedback for {seen // 2} nodes does not fit a mesh of {mesh.nodes} nodes")
    nodes = [step * k for k in range(seen // 2)]
    if complex_form:
        places = [[(2 * n + k, 1.0) for n in nodes for k in range(2)]]
    else:
        places = [
            [(4 * n + k, 1.0) for n in nodes for k in (0, 3)],
            [(4 * n + k, sign) for n in nodes for k, sign in ((1, 1.0), (2, -1.0))],
        ]
    picked = [entry for plane in places for entry in plane]
    sensors = ca.DM(len(free), len(picked))
    where = {place: i for i, place in enumerate(free)}
    for j, (place, value) in enumerate(picked):
        if place in where:
            sensors[where[place], j] = value
    outputs, inputs = gains.shape[0], sensors.shape[1]
    growth = zero(*gains.shape) if law.per_speed is None else _gains(law.per_speed, complex_form)

    def nothing(rows: int, columns: int) -> Affine:
        return Affine(zero(rows, columns), zero(rows, columns))

    return sensors, Realisation(nothing(0, 0), nothing(0, 2 * inputs), nothing(outputs, 0), Affine(gains, growth), ())


def _gains(law: StateFeedback, complex_form: bool) -> Pair:
    """Gains on all coordinates, then on their rates."""
    position, rate = _matrix(law.position, law.position_cross), _matrix(law.rate, law.rate_cross)
    if complex_form:
        return Pair(ca.sparsify(ca.horzcat(position.re, rate.re)), ca.sparsify(ca.horzcat(position.im, rate.im)))
    planes = [ca.blockcat([[x.re, -x.im], [x.im, x.re]]) for x in (position, rate)]
    return real(ca.sparsify(ca.horzcat(*planes)))


def _matrix(re: object, im: object) -> Pair:
    first = ca.DM(list(map(list, rows_of(re))))
    return Pair(first, ca.DM(list(map(list, rows_of(im)))) if im else ca.DM(*first.shape))


def along_axes(law: Realisation, magnets: Sequence[Magnet], sees_axes: bool = True) -> Realisation:
    """A real law that is meant in y and z, for the axes of magnets that point elsewhere.

    Parameters
    ----------
    law : Realisation
        First all in y, then all in z.
    magnets : sequence of Magnet
    sees_axes : bool
        True if it also sees displacements along the axes.
    """
    angles = [m.axes_angle for m in magnets]
    if all(isinstance(a, int | float) and a == (angles[0] if sees_axes else 0) for a in angles):
        return law  # one turn for all of an isotropic law leaves it as it is
    cos, sin = (ca.diag(ca.vertcat(*map(f, angles))) for f in (ca.cos, ca.sin))
    turn = ca.sparsify(ca.blockcat([[cos, -sin], [sin, cos]]))  # from the axes to y and z
    seen = ca.diagcat(turn, turn) if sees_axes else ca.DM.eye(law.d.shape[1])
    own = ca.DM.eye(len(law.states))
    return replace(law, b=law.b.between(own, seen), c=law.c.between(turn.T, own), d=law.d.between(turn.T, seen))
