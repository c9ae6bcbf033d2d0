"""Warnings that an experienced engineer would give at the sight of a machine."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import SolveError
from ..model import magnet as magnetics
from ..model.rotor import rotor as rotor_matrices
from ..spec.machine import Machine
from ..spec.magnet import Magnet
from ..spec.paths import replace
from .critical import CriticalSpeed, critical_speeds
from .frequency import Chain
from .modes import OVERDAMPED, Mode
from .polish import sparse
from .spectrum import spectrum
from .stability import FOUND, MARGINAL, UNSTABLE, StabilityLimit, stability_limit
from .system import System, system
from .unbalance import UnbalanceResponse, major_axis, unbalance_response

COARSE = 1e-3
"""Frequencies that move by more than this fraction on a twice finer mesh are not converged."""

MISLEADING = 0.01
"""A stability limit that hysteretic damping moves by more than this fraction deserves a warning."""


@dataclass(frozen=True)
class Finding:
    """One warning.

    Attributes
    ----------
    topic : str
        ``"stability"``, ``"marginal"``, ``"weight"``, ``"current"``, ``"force"``, ``"flux"``, ``"voltage"``, ``"clearance"``,
        ``"hysteretic"``, ``"mesh"`` or ``"certificate"``.
    text : str
        One or two sentences with the numbers.
    """

    topic: str
    text: str


def findings(
    machine: Machine | System,
    limit: StabilityLimit | None = None,
    critical: tuple[CriticalSpeed, ...] | None = None,
    modes: int = 8,
) -> tuple[Finding, ...]:
    """Check a machine for what its figures alone do not say.

    Parameters
    ----------
    machine : Machine or System
    limit : StabilityLimit, optional
        If already known.
    critical : tuple of CriticalSpeed, optional
        If already known.
    modes : int
        Number of whirling modes whose mesh convergence is checked.

    Returns
    -------
    tuple of Finding
        The gravest first.
    """
    loop = machine if isinstance(machine, System) else system(machine)
    limit = limit or stability_limit(loop)
    critical = critical_speeds(loop) if critical is None else critical
    found = [*_stability(loop, limit), *_weight(loop), *_stroke(loop, critical)]
    response = _stable_response(loop, limit)
    if response is not None:
        found += [*_currents(response), *_flux(response), *_voltage(response), *_clearance(response)]
    return tuple([*found, *_hysteretic(loop, limit), *_mesh(loop, modes)])


def _stability(loop: System, limit: StabilityLimit) -> Iterator[Finding]:
    name = loop.machine.name
    if limit.status == UNSTABLE:
        worst = limit.unstable_at_rest[0]
        more = len(limit.unstable_at_rest) - 1
        others = f", and {more} more mode{'s are' if more > 1 else ' is'} unstable" if more else ""
        yield Finding(
            "stability",
            f"{name} is unstable at rest: the {worst.describe()} grows at {worst.eigenvalue.real:+.4g} 1/s{others}. "
            "No response, sensitivity or critical speed of this machine can be observed.",
        )
    elif limit.status == MARGINAL:
        assert limit.mode is not None
        yield Finding(
            "marginal",
            f"{name} has modes without any damping (the {limit.mode.describe()} for one): their real parts are zero to "
            "rounding, so that it is neither stable nor unstable and has no stability limit.",
        )
    if not limit.certified:
        yield Finding(
            "certificate",
            "The stability limit comes from a sweep with bisection: some mode has so little damping that the certificate "
            "ran out of its budget. A narrow unstable window could have been missed.",
        )


def _capacity(magnet: Magnet) -> float | None:
    """Force of an axis at i = i0 [N], as far as the magnet is known."""
    if magnet.has_geometry:
        return float(magnetics.capacity(magnet))
    return float(magnet.current_stiffness * magnet.bias_current) if magnet.bias_current is not None else None


def _weight(loop: System) -> Iterator[Finding]:
    machine = loop.machine
    capacities = [_capacity(m) for m in machine.magnets]
    gravity = machine.operation.gravity
    if not machine.magnets or any(c is None for c in capacities) or gravity == 0.0:
        return
    loads = gravity * np.array(static_shares(loop))
    helped = bool(machine.bearings or machine.pins)
    for i, (magnet, capacity, load) in enumerate(zip(machine.magnets, capacities, loads, strict=True)):
        assert capacity is not None
        along = max(abs(math.cos(magnet.axes_angle)), abs(math.sin(magnet.axes_angle))) * load
        if along > capacity:
            rest = (
                " The passive bearings have to stay, and integral action would drive the magnet into saturation."
                if helped
                else " It cannot lift the rotor."
            )
            yield Finding(
                "weight",
                f"magnets[{i}] can pull {capacity:.4g} N along an axis at full modulation of its bias, but its share of the "
                f"rotor's weight is {along:.4g} N ({along / capacity:.3g} times as much)." + rest,
            )


def static_shares(loop: System) -> list[float]:
    """Mass that each magnet would carry if the magnets alone bore the rotor [kg].

    Parameters
    ----------
    loop : System
    """
    machine, mesh = loop.machine, loop.plant.mesh
    nodes = [mesh.node_of(f"magnets[{i}].position") for i in range(len(machine.magnets))]
    bare = rotor_matrices(replace(machine, {"bearings": ()}), mesh)
    mass, stiffness = sparse(bare.M.H), sparse(bare.K0.H)
    rigid = np.zeros(mass.shape[0])
    rigid[0::2] = 1.0
    if len(nodes) < 2:
        return [float((mass @ rigid)[0::2].sum().real)] * len(nodes)
    import scipy.sparse as sp
    import scipy.sparse.linalg as spla

    support = sp.csc_matrix((np.ones(len(nodes)), ([2 * k for k in nodes], range(len(nodes)))), (len(rigid), len(nodes)))
    system_matrix = sp.bmat([[stiffness, support], [support.T, None]]).tocsc()
    solution = spla.spsolve(system_matrix, np.concatenate([mass @ rigid, np.zeros(len(nodes))]))
    return [float(x.real) for x in solution[len(rigid) :]]


def _stroke(loop: System, critical: tuple[CriticalSpeed, ...]) -> Iterator[Finding]:
    """How little motion near the first critical speed uses up the bias."""
    first = next((c for c in critical if c.whirl != "backward" and c.kind == "rotor"), None)
    if first is None:
        return
    for axis in loop.plant.axes:
        magnet = loop.machine.magnets[axis.magnet]
        if axis.chain is None or magnet.bias_current is None:
            continue
        gain = abs(Chain(axis.chain).at(first.speed))
        stroke = magnet.bias_current / gain if gain else math.inf
        reference = magnet.clearance or magnet.gap
        if reference is not None and stroke < 0.02 * reference:
            yield Finding(
                "current",
                f"{axis.name}: at the first critical speed ({first.speed_rpm:.4g} rpm) the chain asks for {gain * 1e-6:.3g} A per "
                f"micrometre, so that {stroke * 1e6:.2g} um of motion use up the {magnet.bias_current:.3g} A of bias. "
                "All linear results hold for smaller motions only.",
            )


def _stable_response(loop: System, limit: StabilityLimit) -> UnbalanceResponse | None:
    """Unbalance response over the speeds at which the machine is stable."""
    if not loop.machine.magnets or not any(d.unbalance for d in loop.machine.rotor.disks):
        return None
    if limit.status in (UNSTABLE, MARGINAL):
        return None
    top = limit.speed * (0.98 if limit.status == FOUND else 1.0)
    try:
        return unbalance_response(loop, np.linspace(top / 600.0, top, 600))
    except SolveError:
        return None


def _first(response: UnbalanceResponse, exceeds: np.ndarray) -> str:
    """First speed at which something is exceeded, in rpm."""
    return f"{float(response.speeds[int(np.argmax(exceeds))]) * 30.0 / math.pi:.4g} rpm"


def _currents(response: UnbalanceResponse) -> Iterator[Finding]:
    for i, magnet in enumerate(response.machine.magnets):
        current = response.peak_currents[:, i]
        if magnet.bias_current is not None and current.max() > magnet.bias_current:
            where = response.speeds[int(np.argmax(current))] * 30.0 / math.pi
            yield Finding(
                "current",
                f"magnets[{i}]: the unbalance asks for more control current than the bias of {magnet.bias_current:.3g} A from "
                f"{_first(response, current > magnet.bias_current)} on (linear peak {current.max():.3g} A at {where:.4g} rpm); "
                "the linear loop ends there.",
            )
        if magnet.max_current is not None and magnet.bias_current is not None:
            total = current + magnet.bias_current
            if total.max() > magnet.max_current:
                yield Finding(
                    "current",
                    f"magnets[{i}]: bias plus control current reach {total.max():.3g} A under the unbalance, above the limit of "
                    f"{magnet.max_current:.3g} A, from {_first(response, total > magnet.max_current)} on.",
                )


def _at_magnet(response: UnbalanceResponse, index: int) -> np.ndarray:
    return major_axis(response.at(float(response.machine.magnets[index].position)))


def _flux(response: UnbalanceResponse) -> Iterator[Finding]:
    for i, magnet in enumerate(response.machine.magnets):
        if magnet.max_flux_density is None or not magnet.has_geometry:
            continue
        motion = np.minimum(_at_magnet(response, i), 0.9 * magnet.gap)
        current = np.minimum(response.peak_currents[:, i], magnet.bias_current)
        flux = np.array([float(magnetics.flux_density(magnet, c, y)) for c, y in zip(current, motion, strict=True)])
        if flux.max() > magnet.max_flux_density:
            yield Finding(
                "flux",
                f"magnets[{i}]: the flux density reaches {flux.max():.3g} T, above the {magnet.max_flux_density:.3g} T given as its "
                f"limit, from {_first(response, flux > magnet.max_flux_density)} on; the force law no longer holds.",
            )


def _voltage(response: UnbalanceResponse) -> Iterator[Finding]:
    for i, magnet in enumerate(response.machine.magnets):
        if magnet.link_voltage is None or not magnet.has_geometry:
            continue
        speed = response.speeds
        current, motion = response.currents[:, i], np.abs(_at_magnet(response, i))
        inductance = float(magnetics.inductance(magnet))
        back = float(magnetics.current_stiffness(magnet)) / (2.0 * math.cos(magnet.half_angle))
        amplitude = np.abs(current).max(axis=1)
        resistance = magnet.resistance or 0.0
        voltage = speed * inductance * amplitude + resistance * (magnet.bias_current + amplitude) + back * speed * motion
        if voltage.max() > magnet.link_voltage:
            yield Finding(
                "voltage",
                f"magnets[{i}]: the coils need up to {voltage.max():.3g} V under the unbalance, more than the link's "
                f"{magnet.link_voltage:.3g} V, from {_first(response, voltage > magnet.link_voltage)} on.",
            )


def _clearance(response: UnbalanceResponse) -> Iterator[Finding]:
    for i, magnet in enumerate(response.machine.magnets):
        free, what = (magnet.clearance, "backup clearance") if magnet.clearance is not None else (magnet.gap, "air gap")
        if free is None:
            continue
        motion = _at_magnet(response, i)
        if motion.max() > free:
            yield Finding(
                "clearance",
                f"magnets[{i}]: the unbalance response of {motion.max() * 1e6:.3g} um exceeds the {what} of {free * 1e6:.3g} um from "
                f"{_first(response, motion > free)} on.",
            )


def _hysteretic(loop: System, limit: StabilityLimit) -> Iterator[Finding]:
    shaft = loop.machine.rotor.shaft
    if not any(shaft.hysteretic_damping_of(s) for s in shaft.segments):
        return
    segments = {f"rotor.shaft.segments[{i}].hysteretic_damping": 0.0 for i in range(len(shaft.segments))}
    without = stability_limit(
        replace(loop.machine, {"rotor.shaft.hysteretic_damping": 0.0, **segments}), limit.top_speed, first_only=True
    )
    if without.status == limit.status and not abs(without.speed - limit.speed) > MISLEADING * without.speed:
        return
    then = f"{without.speed_rpm:.5g} rpm" if without.status == FOUND else without.status
    now = f"{limit.speed_rpm:.5g} rpm" if limit.status == FOUND else limit.status
    yield Finding(
        "hysteretic",
        f"Hysteretic damping moves the stability limit from '{then}' to '{now}'. The model keeps its circulatory force at a "
        "constant sign, which is wrong below the speed that equals the whirl frequency; there the real machine is more stable.",
    )


def _mesh(loop: System, modes: int) -> Iterator[Finding]:
    worst, mode = mesh_error(loop, modes)
    if worst > COARSE and mode is not None:
        yield Finding(
            "mesh",
            f"The mesh of {loop.plant.mesh.elements} elements is too coarse for the {modes} modes shown: on a twice finer one the "
            f"{mode.describe()} moves by {100.0 * worst:.2g} %. Raise rotor.shaft.elements.",
        )


def mesh_error(loop: System, modes: int = 8) -> tuple[float, Mode | None]:
    """Largest relative change of the lowest eigenvalues at the top speed on a twice finer mesh.

    Both meshes are represented by the same number of their modes at rest.

    Parameters
    ----------
    loop : System
    modes : int
        Number of whirling modes with the lowest frequencies.

    Returns
    -------
    error : float
    mode : Mode or None
        The one that moves most.
    """
    top = loop.machine.operation.top_speed
    kept = min(loop.displacements, modes + 12)
    coarse, fine = (s.truncated(kept) for s in (loop, system(loop.machine, loop.plant.mesh.finer(2), loop.complex_form)))
    reference = np.linalg.eigvals(fine.matrix(top))
    worst: tuple[float, Mode | None] = (0.0, None)
    shown = [m for m in spectrum(coarse, top) if m.whirl != "none" and m.damping_ratio < OVERDAMPED]
    for mode in shown[:modes]:
        change = float(np.abs(reference - mode.signed).min()) / abs(mode.signed)
        if change > worst[0]:
            worst = (change, mode)
    return worst
