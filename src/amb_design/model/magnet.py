"""The magnet: force law, its linearisation, and what current, flux and voltage it asks for.

One axis is a pair of horseshoes with half angle alpha between pole and axis, bias i0, control current i, gap g0 and
displacement y. Source: Schweitzer & Maslen, Magnetic Bearings (2009); Ahmad 2014, chapter 4.
"""

from __future__ import annotations

import math

import casadi as ca

from ..errors import ModelError
from ..spec.fields import Number
from ..spec.magnet import Magnet

MU0 = 4.0e-7 * math.pi
"""Permeability of vacuum [H/m]."""


def current_stiffness(magnet: Magnet) -> Number:
    """k_i [N/A] of a pair: mu0 N^2 Ag i0 cos(alpha)/g0^2, or as given.

    Parameters
    ----------
    magnet : Magnet
    """
    if not magnet.has_geometry:
        return magnet.current_stiffness
    return _strength(magnet) * magnet.bias_current / magnet.gap**2


def negative_stiffness(magnet: Magnet) -> Number:
    """k_s [N/m] of a pair, positive: a displacement y is pushed outward by + k_s y.

    Parameters
    ----------
    magnet : Magnet
    """
    if not magnet.has_geometry:
        return magnet.negative_stiffness
    return current_stiffness(magnet) * magnet.bias_current / magnet.gap


def force(magnet: Magnet, current: Number, displacement: Number) -> Number:
    """Nonlinear force of an axis [N].

    Parameters
    ----------
    magnet : Magnet
        With geometry.
    current : float or CasADi scalar
        Control current [A]; the law holds for ``abs(current) <= bias_current``.
    displacement : float or CasADi scalar
        Displacement towards the first magnet [m].

    Raises
    ------
    ModelError
        If the magnet is known by k_i and k_s alone.
    """
    _require_geometry(magnet, "the nonlinear force law")
    i0, g0 = magnet.bias_current, magnet.gap
    pull = ((i0 + current) / (g0 - displacement)) ** 2 - ((i0 - current) / (g0 + displacement)) ** 2
    return _strength(magnet) / 4.0 * pull


def capacity(magnet: Magnet) -> Number:
    """Force of an axis at the centre when the control current equals the bias [N].

    Parameters
    ----------
    magnet : Magnet
        With geometry.
    """
    _require_geometry(magnet, "the load capacity")
    return _strength(magnet) * (magnet.bias_current / magnet.gap) ** 2


def flux_density(magnet: Magnet, current: Number, displacement: Number = 0.0) -> Number:
    """Largest flux density of an axis [T], at total current i0 + abs(i) and gap g0 - abs(y).

    Parameters
    ----------
    magnet : Magnet
        With geometry.
    current, displacement : float or CasADi scalar
        Amplitudes of control current [A] and displacement [m].
    """
    _require_geometry(magnet, "the flux density")
    total = magnet.bias_current + ca.fabs(current)
    return MU0 * magnet.turns * total / (2.0 * (magnet.gap - ca.fabs(displacement)))


def inductance(magnet: Magnet) -> Number:
    """Inductance of a coil [H]: mu0 N^2 Ag/(2 g0) plus leakage.

    Parameters
    ----------
    magnet : Magnet
        With geometry.
    """
    _require_geometry(magnet, "the inductance")
    return MU0 * magnet.turns**2 * magnet.pole_area / (2.0 * magnet.gap) + magnet.leakage_inductance


def back_emf_constant(magnet: Magnet) -> Number:
    """k_u = k_i/(2 cos(alpha)) [V s/m]: voltage that a coil induces for each m/s of the rotor, at the bias.

    Parameters
    ----------
    magnet : Magnet
        With geometry. Half of k_i belongs to each horseshoe of the pair. As in the force law, a displacement along the axis
        counts in full for the gap; cos(alpha) of it would take the factor 1/cos(alpha) away, so that k_u is on the safe side.
    """
    _require_geometry(magnet, "the voltage that motion induces")
    return current_stiffness(magnet) / (2.0 * ca.cos(magnet.half_angle))


def voltage(magnet: Magnet, frequency: Number, current: Number, displacement: Number = 0.0) -> Number:
    """Largest voltage of a coil [V]: inductive, resistive and motion-induced, as if their peaks coincided.

    Parameters
    ----------
    magnet : Magnet
        With geometry; without a resistance that part is left out.
    frequency : float or CasADi scalar
        Of current and displacement [rad/s].
    current, displacement : float or CasADi scalar
        Amplitudes of control current [A] and displacement [m]; not negative.
    """
    changing = inductance(magnet) * current + back_emf_constant(magnet) * displacement
    total = frequency * changing
    if magnet.resistance is not None:
        total = total + magnet.resistance * (magnet.bias_current + current)
    return total


def copper_loss(magnet: Magnet) -> Number:
    """Loss of a magnet's coils at bias [W]: 4 R i0^2, for two horseshoes on each of two axes.

    Parameters
    ----------
    magnet : Magnet
        With resistance and bias current.
    """
    if magnet.resistance is None or magnet.bias_current is None:
        raise ModelError("the copper loss needs the resistance and the bias current of every magnet")
    return 4.0 * magnet.resistance * magnet.bias_current**2


def _strength(magnet: Magnet) -> Number:
    return MU0 * magnet.turns**2 * magnet.pole_area * ca.cos(magnet.half_angle)


def _require_geometry(magnet: Magnet, what: str) -> None:
    if not magnet.has_geometry:
        raise ModelError(f"{what} needs turns, pole area, gap and bias current, but the magnet is given by k_i and k_s")
