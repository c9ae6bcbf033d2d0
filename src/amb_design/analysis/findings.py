"""Warnings that an experienced engineer would give at the sight of a machine."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import SolveError
from ..model import magnet as magnetics
from ..model.mesh import plan
from ..model.rotor import rotor as rotor_matrices
from ..spec.machine import Machine
from ..spec.magnet import Magnet
from ..spec.paths import replace
from .critical import CriticalSpeed, critical_speeds
from .frequency import Loops
from .modes import Mode
from .polish import sparse
from .sensitivity import CHECKED_TO, ZONES, sensitivity
from .spectrum import spectrum
from .stability import FOUND, MARGINAL, NONE, UNSTABLE, StabilityLimit, stability_limit
from .system import System, system
from .unbalance import UnbalanceResponse, major_axis, unbalance_response

COARSE = 1e-3
"""Frequencies that move by more than this fraction on a twice finer mesh are not converged."""

SHORT_STROKE = 0.02
"""Fraction of the clearance below which the motion that uses up the bias is worth a warning."""

LIGHT = 0.3
"""Modes with a larger damping ratio hardly show in a response; their mesh convergence is of no interest."""

BEYOND = 2.0 * math.pi * 10e3
"""Frequency [rad/s] up to which loops are watched; few finite-element models are right above it."""

MISLEADING = 0.01
"""A stability limit that hysteretic damping moves by more than this fraction deserves a warning."""


@dataclass(frozen=True)
class Finding:
    """One warning.

    Attributes
    ----------
    topic : str
        ``"stability"``, ``"marginal"``, ``"weight"``, ``"stroke"``, ``"current"``, ``"force"``, ``"flux"``, ``"voltage"``, ``"clearance"``,
        ``"spillover"``, ``"hysteretic"``, ``"mesh"`` or ``"certificate"``.
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
    found = [*_stability(limit), *_weight(loop), *_bias_flux(loop), *_stroke(loop, critical)]
    response = _stable_response(loop, limit, critical)
    if response is not None:
        found += [*_currents(response), *_flux(response), *_voltage(response), *_clearance(response)]
    return (*found, *_spillover(loop, limit), *_hysteretic(loop, limit), *_mesh(loop, modes))


def _stability(limit: StabilityLimit) -> Iterator[Finding]:
    if limit.status == UNSTABLE:
        worst = limit.unstable_at_rest[0]
        more = len(limit.unstable_at_rest) - 1
        others = f", and {more} more mode{'s are' if more > 1 else ' is'} unstable" if more else ""
        yield Finding(
            "stability",
            f"The machine is unstable at rest: the {worst.describe()} grows at {worst.eigenvalue.real:+.4g} 1/s{others}. "
            "No response, sensitivity or critical speed of this machine can be observed.",
        )
    elif limit.status == MARGINAL:
        assert limit.mode is not None
        yield Finding(
            "marginal",
            f"The machine has modes without any damping (the {limit.mode.describe()} for one): their real parts are zero to "
            "rounding, so that it is neither stable nor unstable and has no stability limit. If the machine is not meant to be "
            "free of damping, give the shaft a trace of viscous_damping.",
        )
    if not limit.certified:
        yield Finding(
            "certificate",
            "Some mode has so little damping that rounding decides its sign, or that the certificate ran out of its budget and "
            "gave way to a sweep. A narrow unstable window could have been missed.",
        )


def capacity(magnet: Magnet) -> float | None:
    """Force of an axis at i = i0 [N], as far as the magnet is known.

    Parameters
    ----------
    magnet : Magnet
    """
    if magnet.has_geometry:
        return float(magnetics.capacity(magnet))
    return float(magnet.current_stiffness * magnet.bias_current) if magnet.bias_current is not None else None


def _weight(loop: System) -> Iterator[Finding]:
    machine = loop.machine
    capacities = [capacity(m) or np.inf for m in machine.magnets]  # of unknown ones nothing can be said
    gravity = machine.operation.gravity
    if not machine.magnets or gravity == 0.0:
        return
    loads = np.abs(gravity * np.array(static_shares(loop)))
    angles = [max(abs(math.cos(m.axes_angle)), abs(math.sin(m.axes_angle))) for m in machine.magnets]
    ratios = loads * angles / np.array(capacities, float)
    i = int(np.argmax(ratios))
    if ratios[i] > 1.0:
        helped = machine.bearings or machine.pins
        rest = (
            "The passive bearings have to stay, and integral action would drive the magnet into saturation."
            if helped
            else "It cannot lift the rotor."
        )
        yield Finding(
            "weight",
            f"{_which(machine, i)} can pull {capacities[i]:.4g} N along an axis at full modulation of its bias, but carrying "
            f"the rotor with the other magnets alone would take {loads[i] * angles[i]:.4g} N ({ratios[i]:.3g} times as much). "
            + rest,
        )


def _which(machine: Machine, index: int) -> str:
    """The magnet that a finding names, as the worst where there are several."""
    return f"magnets[{index}]" + (f" (the worst of {len(machine.magnets)})" if len(machine.magnets) > 1 else "")


def static_shares(loop: System) -> list[float]:
    """Mass that each magnet would carry if the magnets alone bore the rotor [kg].

    Parameters
    ----------
    loop : System
    """
    machine = replace(loop.machine, {"bearings": ()})
    mesh = plan(machine)  # the loop's own may have stations at the bearings
    nodes = [mesh.node_of(f"magnets[{i}].position") for i in range(len(machine.magnets))]
    bare = rotor_matrices(machine, mesh)
    mass, stiffness = sparse(bare.M.H), sparse(bare.K0.H)
    rigid = np.zeros(mass.shape[0])
    rigid[0::2] = 1.0
    if len(nodes) < 2:
        return [float((mass @ rigid)[0::2].sum().real)] * len(nodes)
    import scipy.sparse as sp
    import scipy.sparse.linalg as spla

    support = sp.csc_matrix(
        (np.ones(len(nodes)), ([2 * k for k in nodes], range(len(nodes)))), (len(rigid), len(nodes))
    )
    system_matrix = sp.bmat([[stiffness, support], [support.T, None]]).tocsc()
    solution = spla.spsolve(system_matrix, np.concatenate([mass @ rigid, np.zeros(len(nodes))]))
    return [float(x.real) for x in solution[len(rigid) :]]


def _bias_flux(loop: System) -> Iterator[Finding]:
    for i, m in enumerate(loop.machine.magnets):
        if m.max_flux_density is None or not m.has_geometry:
            continue
        flux = float(magnetics.flux_density(m, 0.0))
        if flux > m.max_flux_density:
            yield Finding(
                "flux",
                f"magnets[{i}]: the bias alone gives {flux:.3g} T, above the limit of {m.max_flux_density:.3g} T; "
                "the force law does not hold.",
            )
            return


def _stroke(loop: System, critical: tuple[CriticalSpeed, ...]) -> Iterator[Finding]:
    """How little motion near the first critical speed uses up the bias."""
    first = next((c for c in critical if c.whirl != "backward" and c.kind == "rotor"), None)
    if first is None:
        return
    worst: tuple[float, float, int] | None = None
    loops = Loops(loop.plant)
    gains = np.abs(loops.controller(first.speed, first.speed)[:, list(loops.loops)])
    for axis, row in zip(loops.axes, gains, strict=True):
        magnet = loop.machine.magnets[axis.magnet]
        room = magnet.clearance or magnet.gap
        if magnet.bias_current is None or room is None or not len(row):
            continue
        gain = float(row.max())
        if gain and (worst is None or magnet.bias_current / gain / room < worst[0]):
            worst = magnet.bias_current / gain / room, gain, axis.magnet
    if worst is not None and worst[0] < SHORT_STROKE:
        _, gain, i = worst
        bias = loop.machine.magnets[i].bias_current
        yield Finding(
            "stroke",
            f"{_which(loop.machine, i)}: at the first critical speed ({first.speed_rpm:.4g} rpm) the chain asks for "
            f"{gain * 1e-6:.3g} A per micrometre, so that {bias / gain * 1e6:.2g} um of motion use up the {bias:.3g} A of bias. "
            "All linear results hold for smaller motions only.",
        )


def _stable_response(
    loop: System, limit: StabilityLimit, critical: tuple[CriticalSpeed, ...]
) -> UnbalanceResponse | None:
    """Unbalance response over the speeds at which the machine is stable."""
    if not loop.machine.magnets or not any(d.unbalance for d in loop.machine.rotor.disks):
        return None
    if limit.status in (UNSTABLE, MARGINAL):
        return None
    top = limit.speed * (0.98 if limit.status == FOUND else 1.0)
    near = [c.speed * (1.0 + k * c.damping_ratio) for c in critical for k in (-1.0, 0.0, 1.0)]
    peaks = [speed for speed in near if 0.0 < speed < top]
    try:
        return unbalance_response(loop, np.union1d(np.linspace(top / 600.0, top, 600), peaks))
    except SolveError:
        return None


def _exceeding(
    response: UnbalanceResponse, quantity: dict[int, np.ndarray], limits: dict[int, float]
) -> tuple[int, str, float, str] | None:
    """The magnet that exceeds its limit most: index, first speed beyond it, peak, and speed of the peak."""
    ratios = {i: float(quantity[i].max()) / limits[i] for i in limits}
    worst = max(ratios, key=lambda i: ratios[i], default=None)
    if worst is None or ratios[worst] <= 1.0:
        return None
    values, speeds = quantity[worst], response.speeds * 30.0 / math.pi
    first = speeds[int(np.argmax(values > limits[worst]))]
    return worst, f"{first:.4g} rpm", float(values.max()), f"{speeds[int(np.argmax(values))]:.4g} rpm"


def _currents(response: UnbalanceResponse) -> Iterator[Finding]:
    magnets = dict(enumerate(response.machine.magnets))
    control = {i: response.peak_currents[:, i] for i in magnets}
    bias = {i: float(m.bias_current) for i, m in magnets.items() if m.bias_current is not None}
    if found := _exceeding(response, control, bias):
        i, first, peak, where = found
        yield Finding(
            "current",
            f"{_which(response.machine, i)}: the unbalance asks for more control current than the bias of {bias[i]:.3g} A from "
            f"{first} on (linear peak {peak:.3g} A at {where}); the linear results end there.",
        )
    limits = {i: float(m.max_current) for i, m in magnets.items() if m.max_current is not None and i in bias}
    if found := _exceeding(response, {i: control[i] + bias[i] for i in limits}, limits):
        i, first, peak, where = found
        yield Finding(
            "current",
            f"{_which(response.machine, i)}: bias plus control current reach {peak:.3g} A under the unbalance at {where}, above "
            f"the limit of {limits[i]:.3g} A, from {first} on.",
        )


def _motion(response: UnbalanceResponse, index: int) -> np.ndarray:
    return major_axis(response.at(float(response.machine.magnets[index].position)))


def _flux(response: UnbalanceResponse) -> Iterator[Finding]:
    flux, limits = {}, {}
    for i, m in enumerate(response.machine.magnets):
        if m.max_flux_density is None or not m.has_geometry:
            continue
        motion = np.minimum(_motion(response, i), 0.9 * m.gap)
        current = np.minimum(response.peak_currents[:, i], m.bias_current)
        flux[i] = np.array([float(magnetics.flux_density(m, c, y)) for c, y in zip(current, motion, strict=True)])
        limits[i] = float(m.max_flux_density)
    if found := _exceeding(response, flux, limits):
        i, first, peak, where = found
        yield Finding(
            "flux",
            f"{_which(response.machine, i)}: the flux density reaches {peak:.3g} T at {where}, above its limit of {limits[i]:.3g} T, "
            f"from {first} on; the force law no longer holds there.",
        )


def _voltage(response: UnbalanceResponse) -> Iterator[Finding]:
    voltage, limits = {}, {}
    for i, m in enumerate(response.machine.magnets):
        if m.link_voltage is None or not m.has_geometry:
            continue
        points = zip(response.speeds, response.peak_currents[:, i], _motion(response, i), strict=True)
        voltage[i] = np.array([float(magnetics.voltage(m, *point)) for point in points])
        limits[i] = float(m.link_voltage)
    if found := _exceeding(response, voltage, limits):
        i, first, peak, where = found
        yield Finding(
            "voltage",
            f"{_which(response.machine, i)}: the coils need up to {peak:.3g} V under the unbalance at {where}, more than the "
            f"link's {limits[i]:.3g} V, from {first} on.",
        )


def _clearance(response: UnbalanceResponse) -> Iterator[Finding]:
    rooms = {i: float(m.clearance or m.gap) for i, m in enumerate(response.machine.magnets) if m.clearance or m.gap}
    if found := _exceeding(response, {i: _motion(response, i) for i in rooms}, rooms):
        i, first, peak, where = found
        what = "air gap" if response.machine.magnets[i].clearance is None else "backup clearance"
        yield Finding(
            "clearance",
            f"{_which(response.machine, i)}: the unbalance response reaches {peak * 1e6:.4g} um at {where}, beyond the {what} of "
            f"{rooms[i] * 1e6:.4g} um, from {first} on.",
        )


def _spillover(loop: System, limit: StabilityLimit) -> Iterator[Finding]:
    """Modes whose damping a loop nearly undoes at frequencies that ISO 14839-3 does not look at."""
    if limit.status not in (FOUND, NONE) or not loop.plant.blocks:
        return
    worst = sensitivity(loop, 0.0, highest=BEYOND).worst
    if worst.frequency > CHECKED_TO and worst.value > ZONES[-1][1]:
        yield Finding(
            "spillover",
            f"At rest the sensitivity of {worst.loop} rises to {worst.value:.3g} at {worst.frequency / (2.0 * math.pi):.4g} Hz, where "
            f"ISO 14839-3 does not look: a change of the loop's gain or phase by {100.0 / (worst.value + 1.0):.2g} % may make that "
            "mode unstable. The controller should roll off earlier, or leave the mode alone.",
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
    coarse, fine = (
        s.truncated(kept) for s in (loop, system(loop.machine, loop.plant.mesh.finer(2), loop.complex_form))
    )
    reference = np.linalg.eigvals(fine.matrix(top))
    worst: tuple[float, Mode | None] = (0.0, None)
    shown = [m for m in spectrum(coarse, top) if m.whirl != "none" and m.damping_ratio < LIGHT]
    for mode in shown[:modes]:
        change = float(np.abs(reference - mode.signed).min()) / abs(mode.signed)
        if change > worst[0]:
            worst = (change, mode)
    return worst
