"""Stability and damping: eigenvalues over the range of speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...analysis.modes import WHIRL_FREQUENCY
from ...analysis.system import Array
from ..state import State
from .samples import Samples, rpm_text

SLOW = 100.0
"""Frequency [rad/s] by which the decay of slower modes and real poles is measured. Of a real pole Re/abs is 1 however unstable
it is, which would leave a search without direction."""

KEPT = 12
"""Modes nearest to the limit that are followed at each speed."""


@dataclass(frozen=True)
class Modes:
    """The least damped modes at several speeds, with derivatives.

    Attributes
    ----------
    values : ndarray of complex, shape (k,)
    slopes : ndarray of complex, shape (k, variables)
    rates : ndarray of complex, shape (k,)
        With respect to the end of the range.
    speeds : ndarray, shape (k,)
    fractions : ndarray, shape (k,)
        Of the end of the range.
    """

    values: Array
    slopes: Array
    rates: Array
    speeds: Array
    fractions: Array

    def samples(self, values: Array, slopes: Array, rates: Array) -> Samples:
        """Samples of a function of these modes."""
        places = tuple(mode_text(v, s) for v, s in zip(self.values, self.speeds, strict=True))
        return Samples(values, slopes, rates, places, self.speeds, tuple(map(str, self.fractions)), self.values)


def modes(
    state: State,
    fractions: Array,
    end: float,
    chosen: Array | None = None,
    real_form: bool = False,
    slowest: bool = False,
) -> Modes:
    """The modes nearest to instability, relative to their frequency.

    Parameters
    ----------
    state : State
    fractions : ndarray, shape (s,)
        Speeds as fractions of the end of the range.
    end : float
        End of the range [rad/s].
    chosen : ndarray of bool, shape (s, m), optional
        Which eigenvalues may be kept; all if left out.
    real_form : bool
        Of conjugate pairs only one is kept.
    slowest : bool
        Those with the least decay rate instead.
    """
    spectra = state.spectra(fractions * end)
    order = spectra.values.real if slowest else instability(spectra.values)
    if real_form:
        order = np.where(spectra.values.imag < 0.0, -np.inf, order)
    if chosen is not None:
        order = np.where(chosen, order, -np.inf)
    kept = np.argsort(-order, axis=1)[:, :KEPT]
    at = np.repeat(np.arange(len(fractions)), kept.shape[1])
    index = kept.ravel()
    real = np.isfinite(order[at, index])
    at, index = at[real], index[real]
    values, speeds = spectra.values[at, index], spectra.speeds[at]
    slopes, rates = state.eigenvalue_slopes(values, speeds, spectra.right[at, :, index], spectra.left[at, index, :])
    return Modes(values, slopes, rates * fractions[at], speeds, fractions[at])


def instability(values: Array) -> Array:
    """Growth rates over frequencies: positive for unstable modes, and with a direction for real poles too."""
    return np.asarray(values.real / np.maximum(np.abs(values.imag), SLOW))


def mode_text(value: complex, speed: float) -> str:
    """A mode in words."""
    if abs(value.imag) <= WHIRL_FREQUENCY:
        return f"real pole {value.real:.3g} 1/s at {rpm_text(speed)}"
    return f"mode at {abs(value.imag) / (2.0 * np.pi):.4g} Hz, {rpm_text(speed)}"


def stability(found: Modes) -> Samples:
    """Decay rates over the modes' frequencies; while a mode is stable, the derivatives of its frequency are left out.

    What counts then is the sign, and a growth rate is closer to linear than its ratio to a frequency. For unstable modes the
    derivatives are exact, for a search that cannot make them stable looks for the least instability.

    Parameters
    ----------
    found : Modes
    """
    v = found.values
    size = np.maximum(np.abs(v.imag), SLOW)
    exact = np.where((np.abs(v.imag) > SLOW) & (v.real > 0.0), np.sign(v.imag), 0.0)
    weight = (1.0 + 1j * exact * v.real / size) / size  # d(-Re v/size) = -Re(weight dv)
    return found.samples(-v.real / size, -(weight[:, None] * found.slopes).real, -(weight * found.rates).real)


def decay(found: Modes) -> Samples:
    """Decay rates -Re lambda [1/s].

    Parameters
    ----------
    found : Modes
    """
    return found.samples(-found.values.real, -found.slopes.real, -found.rates.real)


def damping(found: Modes) -> Samples:
    """Damping ratios -Re lambda/abs(lambda).

    Parameters
    ----------
    found : Modes
    """
    v = found.values
    size = np.maximum(np.abs(v), 1e-300)
    weight = 1.0 / size - v.real * v.conj() / size**3  # d(-Re v/abs(v)) = -Re(weight dv)
    return found.samples(-v.real / size, -(weight[:, None] * found.slopes).real, -(weight * found.rates).real)


def in_window(values: Array, window: tuple[float, float], beside: float = 0.0) -> Array:
    """Which eigenvalues whirl within a window of frequencies, or beside it by less than a part of its ends."""
    frequency = np.abs(values.imag)
    lower, upper = max(window[0] * (1.0 - beside), WHIRL_FREQUENCY), window[1] * (1.0 + beside)
    return np.asarray((frequency >= lower) & (frequency <= upper))
