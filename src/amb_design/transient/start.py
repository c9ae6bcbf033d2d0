"""Initial states: at rest in the centre, lying on the backup bearings, or levitated in static equilibrium."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..errors import ModelError, SolveError
from .equations import Equations

STARTS = ("centred", "resting", "levitated")


def initial(e: Equations, name: str, speed: float) -> tuple[Array, Array]:
    """Modal coordinates of a named start, and states of controllers and amplifiers.

    Parameters
    ----------
    e : Equations
        Of continuous controllers.
    name : {"centred", "resting", "levitated"}
    speed : float
        Spin speed at the start [rad/s].

    Raises
    ------
    ModelError
        If there is no such start, or nothing to rest on.
    SolveError
        If no equilibrium is found.
    """
    n = e.plant.size
    if name == "centred":
        return np.zeros(n), np.zeros(e.law + e.amplifiers)
    if name == "resting":
        if e.contact is None or not e.gravity:
            raise ModelError("a rotor rests on its backup bearings only with contact and gravity; pass contact=True")
        return _resting(e), np.zeros(e.law + e.amplifiers)
    if name == "levitated":
        return _levitated(e, speed)
    raise ModelError(f"there is no start {name!r}; choose one of {', '.join(STARTS)}, or give the final state of a run")


def _resting(e: Equations) -> Array:
    """Magnets off: weight against backup and passive bearings."""
    p = e.plant
    xi = ca.MX.sym("xi", p.size)
    none = np.zeros(len(e.actuators))
    place = ca.mtimes(ca.DM(p.actuators), xi)
    touch = e.magnets(place, none, none, none, np.zeros(e.amplifiers), none, 0.0)[1]
    force = ca.DM(e.load[:, 2]) - ca.mtimes(ca.DM(p.K0), xi) + ca.mtimes(ca.DM(e.contact_places.T), touch)
    clearances = [float(m.clearance) for m in e.machine.magnets]
    stiff = 1.0 if e.contact is None else e.contact.stiffness
    depth = max(clearances) + e.gravity * float(p.inertia[:, 0] @ p.inertia[:, 0]) / stiff
    return _root(force, xi, -depth * p.inertia[:, 0], "no place to rest on the backup bearings was found")


def _levitated(e: Equations, speed: float) -> tuple[Array, Array]:
    n = e.plant.size
    *_, held = symbols = e.symbols()
    z = ca.MX.sym("z", n + e.law + e.amplifiers)
    signals = np.eye(1, e.load.shape[1], 2).ravel()
    full = ca.vertcat(z[:n], np.zeros(n), z[n:])
    change = ca.Function("change", list(symbols), [e.rhs(*symbols)[0]])(
        full, signals, speed, 0.0, np.zeros(held.shape[0])
    )
    text = f"{e.machine.name} has no static equilibrium near the centre: its magnets do not carry the weight; start it centred or without gravity"
    found = _root(change[n:], z, np.zeros(z.shape[0]), text)
    clearest = [m.gap or m.clearance for m in e.machine.magnets]
    places = (e.contact_places @ found[:n]).reshape(-1, 2)
    if any(g is not None and np.hypot(*r) >= g for g, r in zip(clearest, places, strict=True)):
        raise SolveError(text)
    return found[:n], found[n:]


def _root(residual: Any, unknown: Any, guess: Array, failure: str) -> Array:
    """Newton's method with halved steps; directions that nothing restrains stay where they are."""
    function = ca.Function("residual", [unknown], [residual, ca.jacobian(residual, unknown)])
    evaluate: Callable[[Array], list[Array]] = lambda at: [np.array(v.full()) for v in function(at)]  # noqa: E731
    at, (value, slope) = guess, evaluate(guess)
    rows = 1.0 / np.maximum(np.abs(slope).max(axis=1), 1e-12)
    columns = 1.0 / np.maximum(np.abs(slope * rows[:, None]).max(axis=0), 1e-12)
    start = float(np.linalg.norm(rows * function(0.0 * guess)[0].full().ravel())) + 1e-12
    for _ in range(60):
        size = float(np.linalg.norm(rows * value.ravel()))
        if size <= 1e-11 * start:
            break
        move = columns * np.linalg.lstsq(rows[:, None] * slope * columns, -rows * value.ravel(), rcond=1e-14)[0]
        for part in 0.5 ** np.arange(12):
            value, slope = evaluate(at + part * move)
            if np.linalg.norm(rows * value.ravel()) < size:
                at = at + part * move
                break
        else:
            break
    if not float(np.linalg.norm(rows * evaluate(at)[0].ravel())) <= 1e-7 * start:
        raise SolveError(failure)
    return np.asarray(at)


def continuous(e: Equations) -> Equations:
    """The same machine with its controllers in the equations."""
    return dataclasses.replace(e, sampled=False)
