"""Mode shapes: the orbits of the shaft's points, in perspective."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..analysis.modes import Mode
from ..analysis.system import Array, System, node_positions
from ..errors import ModelError
from ..model.mesh import plan
from ..spec.machine import Machine
from .base import COLOURS, FAINT, INK, RED, minus, page
from .stations import stations

ORBITS = 11
"""About so many orbits along a shaft can be told apart."""

COLOUR_OF = {"forward": COLOURS[0], "backward": COLOURS[1]}


def mode_shapes(modes: Mode | Sequence[Mode], machine: Machine | System, *, columns: int = 2) -> Figure:
    """Draw mode shapes side by side in a new figure.

    Parameters
    ----------
    modes : Mode or sequence of Mode
        From `amb_design.spectrum` or a stability limit.
    machine : Machine or System
        To which the modes belong.
    columns : int
        Number of shapes side by side.

    Returns
    -------
    Figure
    """
    chosen = [modes] if isinstance(modes, Mode) else list(modes)
    if not chosen:
        raise ModelError("there are no modes to draw")
    across = min(columns, len(chosen))
    rows = math.ceil(len(chosen) / across)
    with page(height=rows * (1.75 if across > 1 else 2.6)) as figure:
        for i, mode in enumerate(chosen):
            ax = figure.add_subplot(rows, across, i + 1, projection="3d")
            mode_shape(mode, machine, ax=ax)
    return figure


def mode_shape(mode: Mode, machine: Machine | System, *, ax: Any = None) -> Any:
    """Draw one mode shape.

    Parameters
    ----------
    mode : Mode
        From `amb_design.spectrum` or a stability limit.
    machine : Machine or System
        To which the mode belongs.
    ax : Axes3D, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes3D
        The shaft's axis x in metres, y upward. The heavy line is the shaft at one instant; each point runs along its
        orbit from its dot towards the end of the orbit, which is left open. Triangles are supports.

    Raises
    ------
    ModelError
        If the mode's nodes are not those of the machine.
    """
    if ax is None:
        with page(height=2.8) as figure:
            return mode_shape(mode, machine, ax=figure.add_subplot(projection="3d"))
    owner = machine.machine if isinstance(machine, System) else machine
    x = machine.node_positions if isinstance(machine, System) else node_positions(plan(machine))
    if len(x) != len(mode.shape):
        raise ModelError(
            f"the mode has {len(mode.shape)} nodes, {owner.name} has {len(x)}; give the mode's own machine"
        )
    phase = np.exp(1j * np.linspace(0.0, 0.85 * 2.0 * np.pi, 60))
    path = np.real(mode.shape[:, :, None] * phase)
    across, up = -path[:, 1], path[:, 0]  # z points towards the viewer, y upward
    colour = COLOUR_OF.get(mode.whirl, INK)
    ax.plot(x[[0, -1]], [0.0, 0.0], [0.0, 0.0], color=FAINT, linewidth=0.7, linestyle=(0, (6.0, 3.0)))
    for k in _spaced(x):
        ax.plot(np.full(phase.shape, x[k]), across[k], up[k], color=colour, linewidth=0.9, gid="orbit")
    ax.plot(x, across[:, 0], up[:, 0], color=INK, linewidth=1.6, gid="shaft")
    for k in _spaced(x):
        ax.plot(x[k : k + 1], across[k, :1], up[k, :1], "o", color=colour, markersize=3.5, gid="start")
    supports = sorted({p for _, p in stations(owner, ("bearings", "pins", "magnets"))})
    ax.plot(supports, [0.0] * len(supports), [0.0] * len(supports), "^", color=INK, markersize=4.0, gid="supports")
    for line in ax.lines:
        line.set_clip_on(False)  # the box of the axes is narrower than the perspective
        line.set_in_layout(False)
    _decorate(ax, mode, x)
    return ax


def _spaced(x: Array) -> list[int]:
    """Nodes at about even distances, both ends included."""
    wanted = np.linspace(x[0], x[-1], ORBITS)
    return sorted({int(np.argmin(np.abs(x - w))) for w in wanted})


def _decorate(ax: Any, mode: Mode, x: Array) -> None:
    unstable = mode.eigenvalue.real > 0.0
    zeta = 100.0 * mode.damping_ratio
    damping = "undamped" if abs(zeta) < 1e-5 else minus(f"ζ = {zeta:.2g} %")
    controller = ", controller" if mode.kind == "controller" else ""
    ax.set_title(
        f"{mode.whirl}{controller}, {mode.frequency_hz:.4g} Hz, {damping}",
        color=RED if unstable and damping != "undamped" else INK,
        pad=0.0,
        y=0.98,
    )
    size = 1.05 * float(np.abs(mode.shape).max())
    ax.set(xlim=(x[0], x[-1]), ylim=(-size, size), zlim=(-size, size), yticks=[], zticks=[])
    ax.set_box_aspect((2.6, 1.0, 1.0), zoom=1.4)
    ax.view_init(elev=18.0, azim=-62.0)
    ax.set_xlabel("x [m]", labelpad=-3.0)
    ax.tick_params(axis="x", pad=-3.0)
    ax.grid(False)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    for axis in (ax.yaxis, ax.zaxis):
        axis.line.set_visible(False)
