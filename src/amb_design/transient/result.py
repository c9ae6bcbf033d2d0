"""What a simulation found."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any
from zipfile import BadZipFile

import numpy as np

from ..analysis.places import interpolated
from ..analysis.system import Array
from ..errors import ModelError, SpecError
from ..spec.files import dumps, loads
from ..spec.machine import Machine
from .equations import FLAGS, WORKS
from .state import State

NO_SOURCE = {"where": "not stated"}
"""Files of machines have to cite one."""


@dataclass(frozen=True)
class Saturation:
    """A limit that was met.

    Attributes
    ----------
    kind : {"current", "voltage", "flux", "contact", "clearance"}
        "contact": the backup bearing carried force; "clearance": the shaft was beyond it, with or without contact.
    magnet : int
        Index of the magnet.
    first : float
        The output time after which it was met first [s].
    share : float
        Of the time during which it was met, between 0 and 1; for linear motion, of the output times.
    """

    kind: str
    magnet: int
    first: float
    share: float


@dataclass(frozen=True)
class Envelope:
    """Largest radius of each turn of the shaft.

    Attributes
    ----------
    speeds : ndarray
        Mean speed of each turn [rad/s].
    radii : ndarray
        [m]
    times : ndarray
        When the largest radius occurred [s].
    """

    speeds: Array
    radii: Array
    times: Array


@dataclass(frozen=True)
class Transient:
    """Result of `simulate`; m output times, n modal coordinates.

    Attributes
    ----------
    times : ndarray, shape (m,) [s]
    speeds, angles : ndarray, shape (m,)
        Spin speed [rad/s] and angle turned [rad].
    positions : ndarray, shape (nodes,)
        Nodes along the shaft [m].
    currents : ndarray, shape (m, magnets, 2)
        Control currents of the axes [A].
    voltages : ndarray, shape (m, magnets, 2, 2)
        Of the two coils of each axis [V]; zeros for magnets without geometry.
    magnet_forces : ndarray, shape (m, magnets, 2)
        On the shaft along the magnets' axes [N].
    contact_forces : ndarray, shape (m, magnets, 2)
        Of the backup bearings on the shaft in y and z [N].
    kinetic, potential : ndarray, shape (m,)
        Energies of motion across the shaft and of the elastic shaft with its passive bearings [J].
    works : dict of ndarray, shape (m,)
        Work of each force on the rotor since the start [J].
    saturations : tuple of Saturation
        What was met, also between the output times, in the order of time.
    final : State
        Where another run may start; that of the last finished chunk if the run stopped early.
    stopped : str
        Why and when the run stopped early; empty if it did not.
    machine : Machine
    coordinates, rates : ndarray, shape (m, n)
        Modal coordinates and their rates.
    shapes : ndarray, shape (nodes, 2, n)
        Displacements of the nodes for unit coordinates.
    """

    times: Array
    speeds: Array
    angles: Array
    positions: Array
    currents: Array
    voltages: Array
    magnet_forces: Array
    contact_forces: Array
    kinetic: Array
    potential: Array
    works: dict[str, Array]
    saturations: tuple[Saturation, ...]
    final: State
    stopped: str
    machine: Machine = field(repr=False)
    coordinates: Array = field(repr=False)
    rates: Array = field(repr=False)
    shapes: Array = field(repr=False)

    def at(self, position: float) -> Array:
        """Displacements v and w at any place of the shaft [m], shape (m, 2).

        Parameters
        ----------
        position : float
            Distance from the left shaft end [m].

        Raises
        ------
        ModelError
            If the place is not on the shaft.
        """
        return np.asarray(self.coordinates @ interpolated(self.positions, self.shapes, position).T)

    def velocity(self, position: float) -> Array:
        """Velocities at any place of the shaft [m/s], shape (m, 2).

        Parameters
        ----------
        position : float
            As in `at`.
        """
        return np.asarray(self.rates @ interpolated(self.positions, self.shapes, position).T)

    def radius(self, position: float) -> Array:
        """Distance of the shaft from the centre at any place [m], shape (m,).

        Parameters
        ----------
        position : float
            As in `at`.
        """
        return np.asarray(np.hypot(*self.at(position).T))

    @property
    def peaks(self) -> dict[str, Array]:
        """Largest radius at each magnet and disk [m], control current [A], coil voltage [V], forces [N] of each magnet."""
        radii: Callable[[Any], Array] = lambda parts: np.array([self.radius(float(p.position)).max() for p in parts])  # noqa: E731
        return {
            "magnet radius": radii(self.machine.magnets),
            "disk radius": radii(self.machine.rotor.disks),
            "current": np.abs(self.currents).max(axis=(0, 2)),
            "voltage": np.abs(self.voltages).max(axis=(0, 2, 3)),
            "magnet force": np.abs(self.magnet_forces).max(axis=(0, 2)),
            "contact force": np.hypot(*np.moveaxis(self.contact_forces, 2, 0)).max(axis=0),
        }

    @property
    def energy_error(self) -> Array:
        """Energy that the works do not account for, over the gross work (at least a millionth of the energy), shape (m,)."""
        energy = self.kinetic + self.potential
        work = sum(self.works.values(), np.zeros(len(self.times)))
        gross = sum(float(np.ptp(w)) for w in [*self.works.values(), self.kinetic, self.potential])
        return np.asarray((energy - energy[0] - work) / (max(gross, 1e-6 * float(energy.max())) or 1.0))

    def envelope(self, position: float) -> Envelope:
        """Largest radius turn by turn, to be drawn over the speed of run-ups and run-downs.

        Parameters
        ----------
        position : float
            Place on the shaft [m].

        Raises
        ------
        ModelError
            If the shaft turned less than twice.
        """
        turn = np.floor(np.abs(self.angles - self.angles[0]) / (2.0 * math.pi)).astype(int)
        if turn.max(initial=0) < 2:
            raise ModelError("an envelope needs a shaft that turns at least twice")
        radius = self.radius(position)
        groups = [np.flatnonzero(turn == k) for k in range(turn.max()) if (turn == k).any()]
        highest = [g[np.argmax(radius[g])] for g in groups]
        return Envelope(np.array([self.speeds[g].mean() for g in groups]), radius[highest], self.times[highest])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write to a file that `load_transient` reads.

        Parameters
        ----------
        path : str or path
            File to write, ``.npz``; an existing one is replaced.
        """
        arrays: dict[str, Any] = {k: v for k, v in vars(self).items() if isinstance(v, np.ndarray)}
        arrays |= {f"work_{k}": v for k, v in self.works.items()} | self.final.arrays()
        arrays["saturations"] = np.array(
            [(FLAGS.index(s.kind), s.magnet, s.first, s.share) for s in self.saturations]
        ).reshape(-1, 4)
        arrays["stopped"] = np.array(self.stopped)
        arrays["machine"] = np.array(dumps(dataclasses.replace(self.machine, source=self.machine.source or NO_SOURCE)))
        with open(path, "wb") as file:
            np.savez_compressed(file, **arrays)


def load_transient(path: str | os.PathLike[str]) -> Transient:
    """Read what `Transient.save` wrote.

    Parameters
    ----------
    path : str or path

    Raises
    ------
    SpecError
        If there is no such file, or another kind of it.
    """
    try:
        with np.load(path) as found:
            arrays = dict(found)
        works = {name: arrays.pop(f"work_{name}") for name in WORKS}
        final = State.of(arrays)
        met = tuple(Saturation(FLAGS[int(k)], int(m), float(t), float(s)) for k, m, t, s in arrays.pop("saturations"))
        machine, stopped = loads(str(arrays.pop("machine"))), str(arrays.pop("stopped"))
        rest = {k: v for k, v in arrays.items() if not k.startswith("final_")}
        return Transient(works=works, final=final, saturations=met, machine=machine, stopped=stopped, **rest)
    except FileNotFoundError:
        raise SpecError(
            "does not exist", file=os.fspath(path), remedy="name the file that a simulation wrote"
        ) from None
    except (OSError, ValueError, KeyError, TypeError, BadZipFile):
        raise SpecError(
            "is no saved simulation of this version", file=os.fspath(path), remedy="simulate again"
        ) from None
