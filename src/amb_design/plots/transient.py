"""Simulated motion: histories over time, orbits, envelopes over the speed, waterfalls."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from ..analysis.system import Array
from ..analysis.unbalance import UnbalanceResponse, major_axis
from ..errors import ModelError
from ..transient.result import Transient
from ..units import RPM
from .base import COLOURS, GREY, INK, LIGHT, canvas, halo, legend_above, note
from .stations import stations

LABELS = {
    "radius": "orbit radius [µm]",
    "y": "displacement in y [µm]",
    "z": "displacement in z [µm]",
    "current": "control current [A]",
    "voltage": "coil voltage [V]",
    "magnet force": "magnet force [N]",
    "contact force": "contact force [N]",
    "speed": "spin speed [rpm]",
    "energy error": "energy error [-]",
}


DENSE = 100.0 * 2.0 * math.pi
"""Angle turned beyond which oscillations run into bands, which must not hide each other."""


def history(
    result: Transient,
    quantity: str = "radius",
    places: Sequence[float | str] | None = None,
    *,
    ax: Axes | None = None,
) -> Axes:
    """Draw a quantity over time.

    Parameters
    ----------
    result : Transient
        From `amb_design.simulate`.
    quantity : {"radius", "y", "z", "current", "voltage", "magnet force", "contact force", "speed", "energy error"}
        Displacements are drawn at `places`, currents, forces and the voltages of the first
        coils for both axes of each magnet.
    places : sequence of float or str, optional
        Places along the shaft [m], or names of parts; the magnets if left out, else the disks.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Times in seconds, or milliseconds for runs below a second.

    Raises
    ------
    ModelError
        If quantity or place is not known.
    """
    if quantity not in LABELS:
        raise ModelError(f"there is no quantity {quantity!r}; choose one of {', '.join(LABELS)}")
    scale, unit = _clock(result)
    with canvas(ax) as ax:
        ax.set_xlabel(f"time [{unit}]")
        ax.set_ylabel(LABELS[quantity])
        alpha = 1.0 if np.ptp(result.angles) < DENSE else 0.6
        for k, (name, values) in enumerate(_curves(result, quantity, places)):
            ax.plot(
                scale * result.times, values, color=COLOURS[k % len(COLOURS)], label=name, linewidth=1.0, alpha=alpha
            )
        ax.set_xlim(scale * result.times[0], scale * result.times[-1])
        if quantity == "radius":
            _clearances(result, ax)
        if quantity == "current":
            _bias(result, ax)
        if result.stopped:
            note(ax, result.stopped.partition(":")[2].strip())
        legend_above(ax)
    return ax


def orbits(
    result: Transient,
    places: Sequence[float | str] | None = None,
    *,
    turns: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the paths of the shaft's centre, seen along the shaft with y up, and the clearances.

    Parameters
    ----------
    result : Transient
        From `amb_design.simulate`.
    places : sequence of float or str, optional
        As in `history`.
    turns : float, optional
        Only the last turns of the shaft.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Displacements in micrometres; dots mark the ends of the paths.
    """
    shown = slice(None)
    if turns is not None:
        late = np.abs(result.angles[-1] - result.angles) <= 2.0 * math.pi * turns * (1.0 + 1e-9)
        shown = slice(int(np.argmax(late)), None)
    with canvas(ax, height=4.6, width=4.6) as ax:
        ax.set_xlabel("displacement in z [µm]")
        ax.set_ylabel("displacement in y [µm]")
        ax.set_aspect("equal", adjustable="datalim")
        if turns is not None:
            note(ax, f"last {turns:g} turns", GREY)
        for k, (name, x) in enumerate(_places(result, places)):
            v, w = 1e6 * result.at(x)[shown].T
            colour = COLOURS[k % len(COLOURS)]
            ax.plot(w, v, color=colour, label=name, linewidth=0.8)
            ax.plot(w[-1:], v[-1:], "o", color=colour, markersize=4.0)
        reach = max(float(np.abs(line.get_xydata()).max()) for line in ax.lines)
        for clearance in sorted({1e6 * m.clearance for m in result.machine.magnets if m.clearance is not None}):
            if clearance < 4.0 * reach:
                ax.add_patch(Circle((0.0, 0.0), clearance, fill=False, edgecolor=INK, linestyle=(0, (6.0, 2.0))))
                text = ax.annotate(
                    f"clearance {clearance:.0f} µm", (0.0, clearance), (0.0, 3.0), textcoords="offset points"
                )
                halo(text).set(ha="center", fontsize="small", color=INK)
                ax.update_datalim([(-clearance, -clearance), (clearance, 1.1 * clearance)])
        ax.autoscale_view()
        legend_above(ax)
    return ax


def envelope(
    result: Transient,
    places: Sequence[float | str] | None = None,
    *,
    steady: UnbalanceResponse | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the largest orbit radius of each turn over the speed: the picture of a run-up or run-down.

    Parameters
    ----------
    result : Transient
        From `amb_design.simulate`, with a profile of speeds.
    places : sequence of float or str, optional
        As in `history`.
    steady : UnbalanceResponse, optional
        From `amb_design.unbalance_response`: what linear theory says of constant speeds, as dashed lines.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Speeds in rpm, radii in micrometres.
    """
    with canvas(ax) as ax:
        ax.set_xlabel("spin speed [rpm]")
        ax.set_ylabel("largest orbit radius of a turn [µm]")
        for k, (name, x) in enumerate(_places(result, places)):
            found = result.envelope(x)
            colour = COLOURS[k % len(COLOURS)]
            ax.plot(found.speeds / RPM, 1e6 * found.radii, color=colour, label=name)
            if steady is not None:
                radii = 1e6 * major_axis(steady.at(x))
                ax.plot(
                    steady.speeds / RPM, radii, "--", color=colour, linewidth=0.9, label=f"{name}, linear and steady"
                )
        _clearances(result, ax)
        legend_above(ax)
    return ax


def waterfall(
    result: Transient,
    place: float | str,
    *,
    windows: int = 40,
    top_frequency: float | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw spectra of windows of the run, one above the other, the later the higher: whirl frequencies as they come and go.

    Parameters
    ----------
    result : Transient
        From `amb_design.simulate`, with outputs at equal steps.
    place : float or str
        Place along the shaft [m] or name of a part.
    windows : int
        Number of spectra; each is taken over twice its share of the run, with a Hann window.
    top_frequency : float, optional
        [rad/s]; twice the largest speed if left out.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        Whirl frequencies in Hz, backward ones negative, over time; the spin frequency as a dashed line.

    Raises
    ------
    ModelError
        If the run has too few outputs.
    """
    length = 2 * (len(result.times) // (windows + 1))
    if windows < 1 or length < 16:
        raise ModelError(
            f"{len(result.times)} outputs are too few for {windows} windows; ask for fewer or smaller steps"
        )
    ((name, x),) = _places(result, [place])[:1]
    r = 1e6 * (result.at(x) @ np.array([1.0, 1j]))
    starts = np.linspace(0, len(r) - length, windows).astype(int)
    step = float(result.times[1] - result.times[0])
    pieces = np.stack([r[s : s + length] for s in starts])
    hann = np.hanning(length)
    spectra = np.abs(np.fft.fftshift(np.fft.fft((pieces - pieces.mean(axis=1)[:, None]) * hann, 4 * length), axes=1))
    spectra *= 1.0 / hann.sum()
    hertz = np.fft.fftshift(np.fft.fftfreq(4 * length, step))
    top = 2.0 * max(float(np.abs(result.speeds).max()), 1.0) if top_frequency is None else top_frequency
    inside = np.abs(hertz) <= top / (2.0 * math.pi)
    scale, unit = _clock(result)
    middles = scale * result.times[starts + length // 2]
    apart = (middles[-1] - middles[0]) / max(windows - 1, 1) or 1.0
    with canvas(ax, height=4.6) as ax:
        tall = 4.0 * apart / float(spectra[:, inside].max() or 1.0)
        for k in reversed(range(windows)):
            line = middles[k] + tall * spectra[k, inside]
            ax.fill_between(hertz[inside], middles[k], line, color="white", zorder=2.0 - 0.001 * k, linewidth=0.0)
            ax.plot(hertz[inside], line, color=COLOURS[0], linewidth=0.8, zorder=2.0005 - 0.001 * k)
        turning = np.array([result.speeds[s : s + length].mean() for s in starts]) / (2.0 * math.pi)
        ax.plot(turning, middles, color=COLOURS[1], linestyle=(0, (4.0, 2.0)), zorder=3.0, label="spin frequency")
        ax.set_xlim(hertz[inside][0], hertz[inside][-1])
        ax.set_xlabel("whirl frequency [Hz]; backward whirl is negative")
        ax.set_ylabel(f"time [{unit}], spectra of the orbit at {name}")
        ax.grid(visible=False)
        ax.axvline(0.0, color=LIGHT, linewidth=0.8, zorder=0.5)
        note(ax, f"highest line {float(spectra[:, inside].max()):.3g} µm", GREY)
        legend_above(ax)
    return ax


def _clock(result: Transient) -> tuple[float, str]:
    return (1e3, "ms") if result.times[-1] < 1.0 else (1.0, "s")


def _places(result: Transient, wanted: Sequence[float | str] | None) -> list[tuple[str, float]]:
    known = stations(result.machine)
    if wanted is None:
        kind = "magnets" if result.machine.magnets else "disks"
        return stations(result.machine, (kind,)) or [(f"x = {result.positions[0]:.4g} m", float(result.positions[0]))]
    found: list[tuple[str, float]] = []
    for place in wanted:
        if not isinstance(place, str):
            found.append((f"x = {place:.4g} m", float(place)))
            continue
        match = [(name, x) for name, x in known if name == place or name.startswith(place + " ")]
        if not match:
            every = ", ".join(name for name, _ in known)
            raise ModelError(f"{result.machine.name} has nothing called {place!r}; known are {every}")
        found += match
    return found


def _curves(result: Transient, quantity: str, places: Sequence[float | str] | None) -> list[tuple[str, Array]]:
    if quantity == "speed":
        return [("spin speed", result.speeds / RPM)]
    if quantity == "energy error":
        return [("energy that the works do not explain, over gross work", result.energy_error)]
    if quantity in ("radius", "y", "z"):
        axis = {"y": 0, "z": 1}.get(quantity)
        take = [
            (name, result.radius(x) if axis is None else result.at(x)[:, axis]) for name, x in _places(result, places)
        ]
        return [(name, 1e6 * values) for name, values in take]
    magnets = [name for name, _ in stations(result.machine, ("magnets",))]
    if not magnets:
        raise ModelError(f"{result.machine.name} has no magnets, and so no {quantity}")
    if quantity == "contact force":
        return [(name, np.hypot(*result.contact_forces[:, i].T)) for i, name in enumerate(magnets)]
    values = {
        "current": result.currents,
        "magnet force": result.magnet_forces,
        "voltage": result.voltages[..., 0],
    }[quantity]
    return [(f"{name}, axis {k + 1}", values[:, i, k]) for i, name in enumerate(magnets) for k in (0, 1)]


def _clearances(result: Transient, ax: Axes) -> None:
    top = ax.get_ylim()[1]
    for clearance in sorted({1e6 * m.clearance for m in result.machine.magnets if m.clearance is not None}):
        if clearance < 2.0 * top:
            _level(ax, clearance, f"clearance {clearance:.0f} µm")


def _bias(result: Transient, ax: Axes) -> None:
    low, high = ax.get_ylim()
    for bias in sorted({float(m.bias_current) for m in result.machine.magnets if m.bias_current is not None}):
        for sign in (1.0, -1.0):
            if 0.5 * bias < sign * (high if sign > 0 else low):
                _level(ax, sign * bias, f"bias current {bias:g} A" if sign > 0 else "")


def _level(ax: Axes, y: float, text: str) -> None:
    ax.axhline(y, color=INK, linewidth=0.9, linestyle=(0, (6.0, 2.0)), zorder=1.5)
    label = ax.annotate(text, (1.0, y), (-4.0, 2.5), xycoords=ax.get_yaxis_transform(), textcoords="offset points")
    halo(label).set(ha="right", fontsize="small", color=INK)
