"""Where over a range of speeds a quantity is worst: a net of speeds first, then closer around its highest points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from ..errors import ModelError
from .modal import LoopView, ModalLoop, Signals
from .scan import maximum
from .sensitivity import CHECKED_TO, Sensitivity, sensitivity
from .system import Array, System

NET = 33
"""Speeds of the net. A resonance that passes a narrow notch shows at one of them at least, unless it is narrower than about a
thirtieth of the range."""

PLACES = 3
"""Highest points that are looked into."""

CLOSER = 12
"""Evaluations for each of them."""

WORSE = 1e-4
"""What is not worse by more than this is not told."""

PEAKS = 4
"""Resonances of a loop at a speed that are followed to their tops."""


def worst_speeds(function: Callable[[float], Array], end: float) -> Array:
    """Speeds of the highest local maxima of several curves.

    Parameters
    ----------
    function : callable
        Values of all curves at a speed, the higher the worse.
    end : float
        The range begins at rest [rad/s].

    Returns
    -------
    ndarray
        `PLACES` at most [rad/s], ends of the range among them; the worst first.
    """
    from scipy.optimize import minimize_scalar  # imported late: slow to load

    speeds = np.linspace(0.0, end, NET)
    table = np.array([function(float(s)) for s in speeds])
    padded = np.pad(table, ((1, 1), (0, 0)), constant_values=-np.inf)
    tops = np.argwhere((table >= padded[:-2]) & (table > padded[2:]))
    tops = tops[np.argsort(-table[tops[:, 0], tops[:, 1]], kind="stable")]
    found: list[tuple[float, float, Array]] = []  # height, speed, all curves there
    for k, curve in tops:
        best, bounds = float(table[k, curve]), (float(speeds[max(k - 1, 0)]), float(speeds[min(k + 1, NET - 1)]))
        if len(found) == PLACES or not np.isfinite(best):
            break
        if any(bounds[0] <= s <= bounds[1] and values[curve] >= best for _, s, values in found):
            continue  # it shares the place of another curve's top

        def height(speed: float, curve: int = curve) -> float:
            return float(function(float(speed))[curve])

        place = float(speeds[k])
        if 0 < k < NET - 1 or height(place + 0.1 * (sum(bounds) - 2.0 * place)) > best:  # no mere end of the range
            options = {"maxiter": CLOSER, "xatol": 1e-5 * end}
            closer = minimize_scalar(lambda s: -height(s), bounds=bounds, method="bounded", options=options)
            best, place = max((best, place), (-float(closer.fun), float(closer.x)))
        found.append((best, place, function(place)))
    found.sort(key=lambda top: -top[0])
    return np.array([s for _, s, _ in found] or [speeds[int(table.max(axis=1, initial=-np.inf).argmax())]])


def most_sensitive_speeds(loop: System, end: float, highest: Callable[[float], float]) -> Array:
    """Speeds at which the sensitivity of some loop peaks, from sums over modes.

    Parameters
    ----------
    loop : System
        With loops, and stable over the range.
    end : float
        The range begins at rest [rad/s].
    highest : callable
        Highest frequency [rad/s] that counts at a speed.

    Returns
    -------
    ndarray
        As from `worst_speeds`.
    """
    signals = Signals.of(loop)

    def peaks(speed: float) -> Array:
        view, top = LoopView(ModalLoop(loop, speed), signals), highest(speed)
        grid = view.grid()
        grid = np.append(grid[grid < top], top)
        count = len(view.names)
        return np.array([maximum(lambda w, j=j: np.abs(view.sensitivity(w, j)), grid, PEAKS)[0] for j in range(count)])  # type: ignore[misc]

    return worst_speeds(peaks, end)


def telling_sensitivities(
    loop: System, end: float, at: Sequence[float] = (0.0, 1.0), up_to: float = 0.0
) -> tuple[Sensitivity, ...]:
    """Sensitivities at given speeds, and where over the range they are worst, if that is worse.

    Parameters
    ----------
    loop : System
        Stable over the range.
    end : float
        The range begins at rest [rad/s].
    at : sequence of float
        Parts of the range.
    up_to : float
        Highest frequency [rad/s], where that is above the standard's.

    Returns
    -------
    tuple of Sensitivity
        By rising speed.
    """

    def highest(speed: float) -> float:
        return max(CHECKED_TO, 3.0 * speed, up_to)

    given = [sensitivity(loop, part * end, highest=highest(part * end)) for part in at]
    with suppress(ModelError):  # sums over modes know no law that changes with the speed and passes rates straight on
        speed = float(most_sensitive_speeds(loop, end, highest)[0])
        found = sensitivity(loop, speed, highest=highest(speed))
        if found.worst.value > (1.0 + WORSE) * max(s.worst.value for s in given):
            given.append(found)
    return tuple(sorted(given, key=lambda s: s.speed))
