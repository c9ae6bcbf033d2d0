"""What the controllers do to the rotor at rest, before any eigenvalue problem of the closed loop is solved.

A loop pushes with -k_i G(i w) y against a displacement y at its sensor. The real part of k_i G is a stiffness, of which the magnet's
negative stiffness takes its share; the imaginary part over w is a damping. To first order the loops give a mode of the free rotor
with the mass-normalised shape phi the damping ratio

    zeta = Im(phi^T B k_i G(i w) C phi)/(2 w^2)

which is negative where they drive it: because of the phase that filters, delay and amplifier cost, or because the shape has opposite
signs at sensor and magnet.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import scipy.linalg as sla

from ..model import magnet as magnetics
from ..spec.controller import PID, Chain
from ..units import in_words
from .frequency import Loops
from .system import Array, System, dense

SLOW = 2.0 * math.pi
"""Frequency [rad/s] at which the stiffness of a loop is told: below its filters, and the real part knows no integral action."""

RIGID = 1.0
"""Modes of the rotor by itself below this frequency [rad/s] are rigid motions of a rotor without passive bearings."""

HZ = 2.0 * math.pi


@dataclass(frozen=True)
class Bare:
    """Modes at rest of the rotor on its passive supports, without magnets.

    Attributes
    ----------
    frequencies : ndarray, shape (k,)
        Of the flexible modes [rad/s], ascending; of modes alike in y and z one.
    shapes : list of ndarray, shape (n, 1 or 2)
        Mass-normalised; two columns where y and z have a mode of the same frequency each.
    """

    frequencies: Array
    shapes: list[Array]


def bare_modes(loop: System, count: int = 3) -> Bare:
    """Flexible modes of the rotor by itself.

    Parameters
    ----------
    loop : System
    count : int
        Number of frequencies.

    Returns
    -------
    Bare
    """
    plant = loop.plant
    stiffness = dense(plant.K0).astype(complex)
    for axis in plant.axes:
        pull = np.asarray(ca.DM(axis.actuator).full())
        magnet = loop.machine.magnets[axis.magnet]
        stiffness += float(ca.DM(magnetics.negative_stiffness(magnet))) * (pull @ pull.T)
    last = min(4 * count + 6, plant.size) - 1
    squares, modes = sla.eigh((stiffness + stiffness.conj().T) / 2.0, loop.mass, subset_by_index=(0, last))
    frequencies: list[float] = []
    shapes: list[Array] = []
    for square, shape in zip(squares, modes.T, strict=True):
        w = math.sqrt(max(float(square), 0.0))
        if w < RIGID:
            continue
        if frequencies and w < frequencies[-1] * (1.0 + 1e-6):
            shapes[-1] = np.column_stack([shapes[-1], shape])
        else:
            frequencies.append(w)
            shapes.append(shape[:, None])
    return Bare(np.array(frequencies[:count]), shapes[:count])


def added_damping(loops: Loops, frequency: float, shapes: Array) -> float:
    """Damping ratio that all loops give a mode of the rotor, to first order; the least where several share a frequency.

    Parameters
    ----------
    loops : Loops
    frequency : float
        Of the mode [rad/s].
    shapes : ndarray, shape (n, k)
        Mass-normalised.
    """
    gain = shapes.conj().T @ loops.push @ loops.controller(frequency, 0.0) @ loops.sense.T @ shapes
    return float(np.linalg.eigvalsh((gain - gain.conj().T) / 2j)[0]) / (2.0 * frequency**2)


def own_damping(loop: System, frequency: float, shapes: Array) -> float:
    """Damping ratio that a mode of the rotor has without its loops, from the material and the passive bearings, to first order.

    Parameters
    ----------
    loop : System
    frequency : float
        Of the mode [rad/s].
    shapes : ndarray, shape (n, k)
        Mass-normalised.
    """
    c, k = (shapes.conj().T @ dense(m) @ shapes for m in (loop.plant.C0, loop.plant.K0))
    rate = (c + c.conj().T) / 2.0 + (k - k.conj().T) / (2j * frequency)
    return float(np.linalg.eigvalsh(rate)[0]) / (2.0 * frequency)


def loop_outlines(loop: System, loops: Loops, bare: Bare) -> list[dict[str, Any]]:
    """Every control loop at rest as data.

    Parameters
    ----------
    loop : System
    loops : Loops
        Of the same plant.
    bare : Bare

    Returns
    -------
    list of dict
        Stiffness and net stiffness [N/m], states, gain and phase at the modes of the rotor, and what the blocks of the chain cost
        in phase at the first of them. Empty where the whole state is fed back.
    """
    out = []
    states = {
        k: len(block.law.states) for block in loop.plant.blocks if not block.ideal for k in block.axes
    }  # of a law that serves several axes: all of them
    names = {a.name: k for k, a in enumerate(loop.plant.axes)}
    slow = loops.controller(SLOW, 0.0)
    at_modes = [loops.controller(float(w), 0.0) for w in bare.frequencies]
    for row, column in zip(_rows(loops), loops.loops, strict=True):
        axis = loops.axes[row]
        force, pull = float(axis.current_stiffness), _negative_stiffness(loop, axis.magnet)
        stiffness = force * float(slow[row, column].real)
        gains = [complex(g[row, column]) for g in at_modes]
        out.append(
            {
                "loop": axis.name,
                "magnet": axis.magnet,
                "states": states[names[axis.name]],
                "stiffness_n_per_m": stiffness,
                "negative_stiffness_n_per_m": pull,
                "net_stiffness_n_per_m": stiffness - pull,
                "integral_action": _integrates(loops, row, column),
                "at_modes": [
                    {
                        "frequency_hz": float(w) / HZ,
                        "gain_a_per_m": abs(g),
                        "phase_deg": math.degrees(cmath.phase(g)),
                        "damping_ns_per_m": force * g.imag / float(w),
                    }
                    for w, g in zip(bare.frequencies, gains, strict=True)
                ],
                "chain": _chain(loop, axis.magnet, axis.name, float(bare.frequencies[0]), gains[0]) if gains else [],
            }
        )
    return out


def _rows(loops: Loops) -> list[int]:
    """Row of the controller's matrix of each loop that can be opened."""
    return [k for k, axis in enumerate(loops.axes) if axis.name in {a.name for a in loops.plant.loops}]


def _negative_stiffness(loop: System, magnet: int) -> float:
    return float(ca.DM(magnetics.negative_stiffness(loop.machine.magnets[magnet])))


def _integrates(loops: Loops, row: int, column: int) -> bool:
    """True if the gain grows without bound towards zero frequency."""
    low, lower = (abs(complex(loops.controller(SLOW * part, 0.0)[row, column])) for part in (1e-5, 1e-6))
    return lower > 3.0 * low


def _chain(loop: System, magnet: int, name: str, w: float, total: complex) -> list[dict[str, Any]]:
    """Gain and phase of the blocks of an axis; the law is what the others leave of the total."""
    first, second = loop.machine.controllers_of(loop.machine.magnets[magnet])
    chain = second if name.endswith(" z") else first
    if not isinstance(chain, Chain):
        return []
    blocks = list(_blocks(chain, 1j * w))
    around = math.prod((value for _, _, value in blocks), start=1.0 + 0.0j)
    if around == 0.0:  # a notch without damping, exactly there
        return []
    place = sum(name in ("sensor", "low-pass") for name, _, _ in blocks)
    blocks.insert(place, ("PID" if isinstance(chain, PID) else "law", "", total / around))
    return [{"block": b, "value": v, "gain": abs(x), "phase_deg": math.degrees(cmath.phase(x))} for b, v, x in blocks]


def _blocks(chain: Chain, s: complex) -> Iterator[tuple[str, str, complex]]:
    """Transfer functions of what stands around the law."""
    if chain.sensor_gain != 1.0:
        yield "sensor", in_words(chain.sensor_gain, "V/m"), complex(chain.sensor_gain)
    if chain.low_pass is not None:
        f = chain.low_pass
        value = f.frequency**2 / (s**2 + 2.0 * f.damping * f.frequency * s + f.frequency**2)
        yield "low-pass", in_words(f.frequency, "rad/s"), value
    for n in chain.notches:
        value = (s**2 + 2.0 * n.damping * n.frequency * s + n.frequency**2) / (
            s**2 + 2.0 * n.width * n.frequency * s + n.frequency**2
        )
        yield "notch", in_words(n.frequency, "rad/s"), value
    if chain.delay:
        x = s * chain.delay
        yield "delay", f"{1e6 * chain.delay:.4g} us", (1.0 - x / 2.0 + x**2 / 12.0) / (1.0 + x / 2.0 + x**2 / 12.0)
    if chain.amplifier is not None:
        a = chain.amplifier
        value = a.gain * a.bandwidth**2 / (s**2 + 2.0 * a.damping * a.bandwidth * s + a.bandwidth**2)
        yield "amplifier", in_words(a.bandwidth, "rad/s"), value
