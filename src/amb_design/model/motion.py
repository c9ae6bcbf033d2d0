"""The nonlinear machine as CasADi Functions of its parameters: force of the magnets, controllers, equations of motion.

All in real coordinates, whatever the form of the linear model: q = (v, w, beta_x, beta_y) a node, two axes a magnet. State
x = (q, dq/dt, controllers), or (z, dz/dt, controllers) with q = basis z. The magnets pull by their force law at the nominal pole
area, without limits of current, voltage and flux: everything is smooth, and an optimal-control problem states
the limits as its own constraints.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from ..errors import ModelError
from ..spec.machine import Machine
from . import magnet as magnetics
from .loop import Structure
from .mesh import Mesh
from .pair import Affine, Matrix
from .parametric import Parametric, parametric
from .rotor import rotor


def real_form(loop: Parametric) -> Parametric:
    """The same machine and parameters in real coordinates."""
    if not loop.complex_form:
        return loop
    return parametric(
        loop.machine, dict(zip(loop.names, loop.members, strict=True)), loop.plant.mesh, complex_form=False
    )


def magnet_force(loop: Parametric) -> ca.Function:
    """Force of every magnet along its axes.

    Parameters
    ----------
    loop : Parametric

    Returns
    -------
    casadi.Function
        ``p``, ``current`` [A] and ``displacement`` [m] of shape (magnets, 2), one column an axis, to ``force`` [N].
        Magnets that are known by k_i and k_s alone pull with k_i i + k_s y.
    """
    magnets = loop.symbolic.magnets
    i, y = (ca.SX.sym(name, len(magnets), 2) for name in ("i", "y"))
    forces = [[_pull(m, i[k, j], y[k, j]) for j in range(2)] for k, m in enumerate(magnets)]
    out = ca.SX(ca.blockcat(forces)) if magnets else ca.SX(0, 2)
    return ca.Function("magnet_force", [loop.p, i, y], [out], ["p", "current", "displacement"], ["force"])


def _pull(magnet: Any, current: Any, displacement: Any) -> Any:
    if magnet.has_geometry:
        return magnetics.force(magnet, current, displacement)
    return magnet.current_stiffness * current + magnet.negative_stiffness * displacement


def controller(loop: Parametric) -> ca.Function:
    """All controllers, from what the sensors see to control currents.

    Parameters
    ----------
    loop : Parametric
        In real form.

    Returns
    -------
    casadi.Function
        ``p``, ``speed`` [rad/s], ``state``, ``displacement`` [m] and ``velocity`` [m/s] at the sensors to ``rate`` (of the state)
        and ``current`` [A], the sign of the feedback included. Sensors and currents are ordered by axis
        (magnets[0] y, magnets[0] z, ...); an axis without a controller gets none.

    Raises
    ------
    ModelError
        If the controller is ideal feedback of the whole state.
    """
    plant = loop.plant
    if any(block.ideal for block in plant.blocks):
        raise ModelError(f"{loop.machine.name} feeds back its whole state, which passes no sensor")
    axes = len(plant.axes)
    speed, state = ca.SX.sym("speed"), ca.SX.sym("state", sum(len(b.law.states) for b in plant.blocks))
    y, v = ca.SX.sym("displacement", axes), ca.SX.sym("velocity", axes)
    current, rates, start = ca.SX(axes, 1), [ca.SX(0, 1)], 0
    for block in plant.blocks:
        law, at = block.law, list(block.axes)
        own, seen = state[start : start + len(law.states)], ca.vertcat(y[at], v[at])
        a, b, c, d = (_at(part, speed) for part in (law.a, law.b, law.c, law.d))
        rates.append(ca.mtimes(a, own) + ca.mtimes(b, seen))
        current[at] = -(ca.mtimes(c, own) + ca.mtimes(d, seen))
        start += len(law.states)
    return ca.Function(
        "controller",
        [loop.p, speed, state, y, v],
        [ca.vertcat(*rates), current],
        ["p", "speed", "state", "displacement", "velocity"],
        ["rate", "current"],
        # Derivatives in many directions through one Jacobian: an observer has thousands of terms in each.
        {"jac_penalty": 0.0},
    )


def _at(part: Affine, speed: Any) -> Any:
    return part.constant.re + speed * part.rate.re


def state_names(plant: Structure) -> tuple[str, ...]:
    """Names of the controllers' states: ``"magnets[0] y: low_pass.output"``.

    Parameters
    ----------
    plant : Structure
        In real form.
    """
    names = []
    for block in plant.blocks:
        label = plant.axes[block.axes[0]].name if len(block.axes) == 1 else "magnets"
        names += [f"{label}: {state}" for state in block.law.states]
    return tuple(names)


def motion(loop: Parametric, basis: ca.DM | None = None) -> ca.Function:
    """Right-hand side of the nonlinear equations of motion.

    Parameters
    ----------
    loop : Parametric
        In real form.
    basis : casadi.DM, shape (n, m), optional
        Columns that span the motions that are kept; all degrees of freedom if left out.

    Returns
    -------
    casadi.Function
        ``p``, ``x``, ``speed`` [rad/s], ``acceleration`` (of the spin) [rad/s^2], ``force`` (generalised, over z) to ``rate`` (of x),
        and of the axes ``current`` [A], ``displacement`` at the magnets [m] and ``magnet_force`` [N].

    Notes
    -----
    M q'' + (C0 + Omega C1) q' + (K0 + Omega K1 + Omega' C1) q = force + magnets. The last term on the left is the moment that a
    spinning disk needs to keep up with an accelerated spin while it is tilted.
    """
    plant = loop.plant
    span = ca.DM.eye(plant.size) if basis is None else basis
    push = ca.horzcat(ca.DM(plant.size, 0), *[a.actuator for a in plant.axes])
    sense = ca.horzcat(ca.DM(plant.size, 0), *[a.sensor for a in plant.axes])
    parts = [plant.M.re, plant.C0.re, plant.C1.re, _passive(loop).re, plant.K1.re]
    matrices = [ca.mtimes([span.T, ca.SX(m), span]) for m in parts]
    ports = [ca.mtimes(ca.SX(m).T, span) for m in (push, sense)]
    law, force_law = controller(loop), magnet_force(loop)

    p, n = ca.MX.sym("p", loop.np), span.shape[1]
    x = ca.MX.sym("x", 2 * n + law.size1_in("state"))
    speed, acceleration, load = ca.MX.sym("speed"), ca.MX.sym("acceleration"), ca.MX.sym("force", n)
    M, C0, C1, K0, K1, at, seen = _evaluated(loop.p, [*matrices, *ports], p)
    z, rate, state = x[:n], x[n : 2 * n], x[2 * n :]
    y, axes, magnets = ca.mtimes(at, z), len(plant.axes), len(loop.machine.magnets)
    state_rate, current = law(p, speed, state, ca.mtimes(seen, z), ca.mtimes(seen, rate))
    pull = ca.vec(
        force_law(p, ca.reshape(current, 2, magnets).T, ca.reshape(y, 2, magnets).T).T if axes else ca.MX(0, 1)
    )
    total = load + ca.mtimes(at.T, pull) - ca.mtimes(C0, rate) - ca.mtimes(K0, z)
    total -= speed * (ca.mtimes(C1, rate) + ca.mtimes(K1, z)) + acceleration * ca.mtimes(C1, z)
    inputs = ["p", "x", "speed", "acceleration", "force"]
    outputs = ["rate", "current", "displacement", "magnet_force"]
    rates = ca.vertcat(rate, _solved(M, total), state_rate)
    return ca.Function("rhs", [p, x, speed, acceleration, load], [rates, current, y, pull], inputs, outputs)


def _passive(loop: Parametric) -> Any:
    """Stiffness at rest without the magnets' negative stiffness, which their force law holds."""
    plant, stiffness = loop.plant, loop.plant.K0
    for axis in plant.axes:
        own = magnetics.negative_stiffness(loop.symbolic.magnets[axis.magnet])
        stiffness = type(stiffness)(stiffness.re + own * ca.mtimes(axis.actuator, axis.actuator.T), stiffness.im)
    return stiffness


def _evaluated(symbols: ca.SX, matrices: Sequence[ca.SX], p: ca.MX) -> list[Any]:
    """Matrices at p; those that do not depend on it as numbers."""
    varying = [m for m in matrices if ca.depends_on(m, symbols)]
    found = iter(ca.Function("matrices", [symbols], varying).call([p]) if varying else [])
    return [
        next(found) if ca.depends_on(m, symbols) else ca.sparsify(ca.evalf(m), 1e-14 * float(ca.norm_inf(ca.evalf(m))))
        for m in matrices
    ]


def _solved(mass: Any, right: Any) -> Any:
    if isinstance(mass, ca.DM):
        return ca.mtimes(ca.inv(mass), right)
    return ca.solve(mass, right, "qr")


def loads(loop: Parametric, basis: ca.DM | None = None) -> ca.Function:
    """Generalised forces of the disks' unbalances and of gravity.

    Parameters
    ----------
    loop : Parametric
        In real form.
    basis : casadi.DM, optional
        As in `motion`.

    Returns
    -------
    casadi.Function
        ``p``, ``angle`` [rad], ``speed`` [rad/s], ``acceleration`` [rad/s^2] of the spin to ``unbalance`` and ``gravity``, generalised
        forces over z.
    """
    plant, machine = loop.plant, loop.symbolic
    angle, speed, acceleration = (ca.SX.sym(name) for name in ("angle", "speed", "acceleration"))
    full = ca.SX(4 * plant.mesh.nodes, 1)
    for i, disk in enumerate(machine.rotor.disks):
        node, turned = 4 * plant.mesh.node_of(f"rotor.disks[{i}].position"), angle + disk.unbalance_phase
        c, s = ca.cos(turned), ca.sin(turned)
        full[node] += disk.unbalance * (speed**2 * c + acceleration * s)
        full[node + 1] += disk.unbalance * (speed**2 * s - acceleration * c)
    span = ca.DM.eye(plant.size) if basis is None else basis
    weight = -machine.operation.gravity * _translated(machine, plant.mesh)
    out = [ca.mtimes(span.T, ca.SX(force)[list(plant.free)]) for force in (full, weight)]
    inputs = ["p", "angle", "speed", "acceleration"]
    return ca.Function("loads", [loop.p, angle, speed, acceleration], out, inputs, ["unbalance", "gravity"])


def _translated(machine: Machine, mesh: Mesh) -> Matrix:
    """Mass times a unit translation along y, over all degrees of freedom; what pins hold counts too."""
    mass = rotor(machine, mesh).M.to_real().re
    unit = ca.DM(4 * mesh.nodes, 1)
    unit[0::4] = 1.0
    return ca.mtimes(mass, unit)
