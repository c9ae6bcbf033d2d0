"""The closed loop: E dx/dt = (A0 + Omega A1) x, with the controllers' states in x.

State order: displacements q of the free degrees of freedom, their velocities, then the states of each controller
axis. Isotropic machines use complex coordinates, q = (r, phi) a node, one complex axis a magnet; others use real
ones, q = (v, w, beta_x, beta_y) a node and two axes a magnet.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from ..errors import ModelError
from ..spec.controller import PID
from ..spec.fields import Number
from ..spec.machine import Machine
from ..spec.magnet import Magnet
from ..spec.paths import find, is_switched_off, replace, value
from .controller import Realisation, realise
from .magnet import current_stiffness, negative_stiffness
from .mesh import Mesh, plan
from .pair import Map, Matrix, Pair, real
from .rotor import diagonal, rotor


@dataclass(frozen=True)
class Axis:
    """One control loop: a magnet axis with its sensor and chain.

    Attributes
    ----------
    name : for tables, ``"magnets[0] y"``; the complex axis of an isotropic machine is called ``"magnets[0]"``
    magnet : index of the magnet
    actuator, sensor : CasADi columns over the free degrees of freedom; force and displacement of the axis
    current_stiffness : k_i [N/A]
    chain : state space from shaft displacement and velocity to current, or None without a controller
    """

    name: str
    magnet: int
    actuator: Matrix
    sensor: Matrix
    current_stiffness: Number
    chain: Realisation | None


@dataclass(frozen=True)
class Structure:
    """The rotor on all its linear supports, the magnets' negative stiffness included, with open loops.

    Attributes
    ----------
    complex_form : True if q holds complex coordinates
    M, C0, C1, K0, K1 : matrices of M q'' + (C0 + Omega C1) q' + (K0 + Omega K1) q = F
    free : degrees of freedom that no pin holds, as indices into the unpinned order
    axes : control loops
    mesh : where the nodes are
    """

    complex_form: bool
    M: Pair
    C0: Pair
    C1: Pair
    K0: Pair
    K1: Pair
    free: tuple[int, ...]
    axes: tuple[Axis, ...]
    mesh: Mesh

    @property
    def size(self) -> int:
        """Number of free degrees of freedom."""
        return len(self.free)


def is_isotropic(machine: Machine) -> bool:
    """True if the machine behaves alike in y and z, so that the complex form of half the size holds.

    Parameters
    ----------
    machine : Machine
        With symbols, the structure decides: equal expressions count as equal. A second axis with a controller of its
        own makes the machine anisotropic, whatever its numbers.
    """
    for bearing in machine.bearings:
        for (yy, yz), (zy, zz) in (bearing.stiffness_matrix, bearing.damping_matrix):
            if not (_vanishes(yy - zz) and _vanishes(yz + zy)):
                return False
    return all(first is second for first, second in map(machine.controllers_of, machine.magnets))


def structure(machine: Machine, mesh: Mesh | None = None, complex_form: bool | None = None) -> Structure:
    """Matrices of the machine with its loops open.

    Parameters
    ----------
    machine : Machine
        Numbers or CasADi scalars of one kind.
    mesh : Mesh, optional
        Planned from the machine if left out, which then must hold numbers for lengths and positions.
    complex_form : bool, optional
        Chosen by `is_isotropic` if left out. The complex form of an anisotropic machine holds its isotropic part.

    Returns
    -------
    Structure
    """
    mesh = mesh or plan(machine)
    complex_form = is_isotropic(machine) if complex_form is None else complex_form
    parts = rotor(machine, mesh)
    width = 2 if complex_form else 4  # degrees of freedom a node
    total = width * mesh.nodes
    held = {
        width * mesh.node_of(f"pins[{i}].position") + k
        for i in range(len(machine.pins))
        for k in range(width // 2)  # r, or v and w
    }
    free = [k for k in range(total) if k not in held]

    def form(matrix: Map) -> Pair:
        whole = matrix.H if complex_form else matrix.to_real()
        return whole.select(free) if held else whole

    places: list[int] = []
    outward: list[Number] = []
    for i, magnet in enumerate(machine.magnets):
        node = width * mesh.node_of(f"magnets[{i}].position")
        for k in range(width // 2):
            places.append(node + k)
            outward.append(-negative_stiffness(magnet))
    pull = real(diagonal(total, places, outward))
    stiffness = form(parts.K0) + (pull.select(free) if held else pull)
    axes = tuple(a for i, m in enumerate(machine.magnets) for a in _axes(machine, i, m, mesh, complex_form, free))
    return Structure(
        complex_form, form(parts.M), form(parts.C0), form(parts.C1), stiffness, form(parts.K1), tuple(free), axes, mesh
    )


def _axes(machine: Machine, index: int, magnet: Magnet, mesh: Mesh, complex_form: bool, free: list[int]) -> list[Axis]:
    first, second = machine.controllers_of(magnet)
    sensor_path = next(
        (f"sensors[{k}].position" for k, s in enumerate(machine.sensors) if magnet.sensor and s.name == magnet.sensor),
        f"magnets[{index}].position",
    )
    nodes = (mesh.node_of(f"magnets[{index}].position"), mesh.node_of(sensor_path))
    gain = current_stiffness(magnet)
    name = f"magnets[{index}]"
    if complex_form:
        at, seen = (_unit(free, [2 * n], [1.0]) for n in nodes)
        return [Axis(name, index, at, seen, gain, _chain(first))]
    c, s = ca.cos(magnet.axes_angle), ca.sin(magnet.axes_angle)
    axes = []
    for label, controller, (y, z) in (("y", first, (c, s)), ("z", second, (-s, c))):
        at, seen = (_unit(free, [4 * n, 4 * n + 1], [y, z]) for n in nodes)
        axes.append(Axis(f"{name} {label}", index, at, seen, gain, _chain(controller)))
    return axes


def _chain(controller: PID | None) -> Realisation | None:
    return None if controller is None else realise(controller)


def _unit(free: Sequence[int], places: list[int], values: list[Number]) -> Matrix:
    """Column over the free degrees of freedom with values at some places of the unpinned order."""
    column = ca.vertcat(*values)
    rows = [free.index(k) for k in places if k in free]
    keep = [i for i, k in enumerate(places) if k in free]
    select = ca.DM.triplet(rows, keep, ca.DM.ones(len(rows)), len(free), len(values))
    return ca.mtimes(select, column)


@dataclass(frozen=True)
class Pencil:
    """E dx/dt = (A0 + Omega A1) x + B i, y = C x.

    Attributes
    ----------
    E, A0, A1 : square
    B : states by axes; currents added to those of the controllers [A]
    C : axes by states; displacements of the shaft at the sensors [m]
    """

    E: Pair
    A0: Pair
    A1: Pair
    B: Pair
    C: Pair


def close(plant: Structure) -> Pencil:
    """Connect the controllers: i = -chain(y), force k_i i.

    Parameters
    ----------
    plant : Structure

    Returns
    -------
    Pencil
        State order q, dq/dt, controller states axis by axis; sparse CasADi matrices.
    """
    n = plant.size
    controlled = [a for a in plant.axes if a.chain is not None]
    states = [a.chain.a.shape[0] for a in controlled if a.chain is not None]
    m = sum(states)
    zero = ca.DM(n, n)
    k0, c0 = plant.K0, plant.C0
    from_states: list[Matrix] = []
    from_q: list[Matrix] = []
    from_rate: list[Matrix] = []
    for axis in controlled:
        assert axis.chain is not None
        push = axis.current_stiffness * axis.actuator
        k0 = k0 + real(ca.mtimes([push, axis.chain.d[:, 0], axis.sensor.T]))
        c0 = c0 + real(ca.mtimes([push, axis.chain.d[:, 1], axis.sensor.T]))
        from_states.append(-ca.mtimes(push, axis.chain.c))
        from_q.append(ca.mtimes(axis.chain.b[:, 0], axis.sensor.T))
        from_rate.append(ca.mtimes(axis.chain.b[:, 1], axis.sensor.T))
    column = ca.horzcat(*from_states) if m else ca.DM(n, 0)
    row_q = ca.vertcat(*from_q) if m else ca.DM(0, n)
    row_rate = ca.vertcat(*from_rate) if m else ca.DM(0, n)
    inner = ca.diagcat(*[a.chain.a for a in controlled if a.chain is not None]) if m else ca.DM(0, 0)
    eye = ca.DM.eye(n)
    a0 = Pair(
        ca.blockcat([[zero, eye, ca.DM(n, m)], [-k0.re, -c0.re, column], [row_q, row_rate, inner]]),
        _lower(-k0.im, -c0.im, m),
    )
    a1 = Pair(_lower(-plant.K1.re, -plant.C1.re, m), _lower(-plant.K1.im, -plant.C1.im, m))
    e = Pair(ca.diagcat(eye, plant.M.re, ca.DM.eye(m)), _lower(ca.DM(n, n), plant.M.im, m))
    axes = len(plant.axes)
    push = ca.horzcat(ca.DM(n, 0), *[a.current_stiffness * a.actuator for a in plant.axes])
    sense = ca.horzcat(ca.DM(n, 0), *[a.sensor for a in plant.axes]).T
    inputs = ca.vertcat(ca.DM(n, axes), push, ca.DM(m, axes))
    outputs = ca.horzcat(sense, ca.DM(axes, n + m))
    return Pencil(e, a0, a1, real(inputs), real(outputs))


def ports(plant: Structure, pencil: Pencil) -> tuple[Matrix, Matrix, Matrix]:
    """Where disturbances of the sensors enter, and what is looked at.

    Parameters
    ----------
    plant : Structure
    pencil : Pencil
        Its closed loop.

    Returns
    -------
    F, G : states by control loops
        Of disturbances [m] added to the displacements at the sensors, and of their rates.
    C : outputs by states
        Displacements at the sensors [m] and control currents [A] of all loops, then displacements at the axes of all
        magnets [m].
    """
    n, total = plant.size, pencil.A0.shape[0]
    controlled = [(a, a.chain) for a in plant.axes if a.chain is not None]
    enter: list[list[Matrix]] = [[], []]
    currents, start = [], 2 * n
    for axis, chain in controlled:
        k = chain.a.shape[0]
        push = axis.current_stiffness * axis.actuator
        below, above = ca.DM(start - 2 * n, 1), ca.DM(total - start - k, 1)
        for j in (0, 1):
            enter[j].append(ca.vertcat(ca.DM(n, 1), -push * chain.d[0, j], below, chain.b[:, j], above))
        row = [-chain.d[0, 0] * axis.sensor.T, -chain.d[0, 1] * axis.sensor.T, below.T, -chain.c, above.T]
        currents.append(ca.horzcat(*row))
        start += k
    sensed = [ca.horzcat(a.sensor.T, ca.DM(1, total - n)) for a, _ in controlled]
    moved = [ca.horzcat(a.actuator.T, ca.DM(1, total - n)) for a in plant.axes]
    columns = [ca.horzcat(ca.DM(total, 0), *group) for group in enter]
    return columns[0], columns[1], ca.vertcat(ca.DM(0, total), *sensed, *currents, *moved)


def _lower(k: Matrix, c: Matrix, m: int) -> Matrix:
    """Blocks of the second row of the pencil alone."""
    n = k.shape[0]
    return ca.blockcat(
        [
            [ca.DM(n, n), ca.DM(n, n), ca.DM(n, m)],
            [k, c, ca.DM(n, m)],
            [ca.DM(m, n), ca.DM(m, n), ca.DM(m, m)],
        ]
    )


@dataclass(frozen=True)
class ClosedLoop:
    """A machine as CasADi expressions in some of its numbers.

    Made by `closed_loop`.

    Attributes
    ----------
    machine : the numeric machine
    names : tuple of str
        Names of the parameters, in the order of the vector p.
    members : for each parameter, the full paths of the numbers that it sets
    p : CasADi SX column of the parameters
    nominal : tuple of float
        The parameters' values in `machine`.
    plant : Structure
        In terms of p; so is `pencil`.
    """

    machine: Machine
    names: tuple[str, ...]
    members: tuple[tuple[str, ...], ...]
    p: Any
    nominal: tuple[float, ...]
    plant: Structure

    @cached_property
    def pencil(self) -> Pencil:
        """E, A0, A1 in terms of p."""
        return close(self.plant)

    @property
    def np(self) -> int:
        """Number of parameters."""
        return len(self.names)

    def function(self, name: str) -> ca.Function:
        """A matrix as a CasADi Function of p.

        Parameters
        ----------
        name : {"E", "A0", "A1", "B", "C", "M", "C0", "C1", "K0", "K1"}
            Pencil E dx/dt = (A0 + Omega A1) x + B i with y = C x, for control currents i [A] and shaft displacements y [m]
            of the axes; structure M q'' + (C0 + Omega C1) q' + (K0 + Omega K1) q = F.

        Returns
        -------
        casadi.Function
            Input ``p`` of shape (np, 1); outputs ``re`` and ``im``, the real and imaginary part.

        Raises
        ------
        ModelError
            If there is no such matrix.
        """
        if name in ("E", "A0", "A1", "B", "C"):
            matrix = getattr(self.pencil, name)
        elif name in ("M", "C0", "C1", "K0", "K1"):
            matrix = getattr(self.plant, name)
        else:
            raise ModelError(f"there is no matrix {name!r}; choose one of E, A0, A1, B, C, M, C0, C1, K0, K1")
        return ca.Function(name, [self.p], [ca.SX(matrix.re), ca.SX(matrix.im)], ["p"], ["re", "im"])


def closed_loop(
    machine: Machine,
    free: Sequence[str] | Mapping[str, Sequence[str]] = (),
    mesh: Mesh | None = None,
    complex_form: bool | None = None,
) -> ClosedLoop:
    """The machine as a CasADi model with some of its numbers as variables.

    Parameters
    ----------
    machine : Machine
        Numbers only.
    free : sequence of str, or mapping of str to sequence of str
        Paths of the numbers that become variables, full or short; a short path ties all numbers that it fits. A mapping
        gives each variable a name and the full paths that it sets.
    mesh : Mesh, optional
        Another mesh than the machine's own.
    complex_form : bool, optional
        Force the complex or the real form. If left out, the complex form is taken when the machine is isotropic whatever
        the variables do. Where they can break its symmetry, a forced complex form sees their isotropic part, which is
        exact to first order in them for simple eigenvalues.

    Returns
    -------
    ClosedLoop

    Raises
    ------
    SpecError
        If a path names no number of the machine.
    ModelError
        If the complex form is asked of an anisotropic machine, or a variable is zero and thereby leaves its block out.
    """
    if complex_form and not is_isotropic(machine):
        raise ModelError(f"{machine.name} is anisotropic: its y and z directions do not form one complex coordinate")
    mesh = mesh or plan(machine)
    if isinstance(free, Mapping):
        members = tuple(tuple(paths) for paths in free.values())
    else:
        members = tuple(find(machine, path) for path in free)
    for path in (path for paths in members for path in paths):
        if is_switched_off(machine, path):
            raise ModelError(
                f"{path} is zero, which leaves its block out of the model; free it from a value above zero"
            )
    for path, paths in zip(free, members, strict=True):
        if isinstance(free, Mapping):  # whoever gives the members knows what they tie
            break
        if len({value(machine, member) for member in paths if isinstance(value(machine, member), int | float)}) > 1:
            raise ModelError(
                f"{path} stands for numbers of different values; free them one by one ({paths[0]}, ...) or make them equal"
            )
    p = ca.SX.sym("p", len(free))
    nominal = tuple(float(value(machine, m[0])) for m in members)
    symbols = {path: p[k] for k, paths in enumerate(members) for path in paths}
    symbolic = replace(machine, symbols) if symbols else machine
    return ClosedLoop(machine, tuple(free), members, p, nominal, structure(symbolic, mesh, complex_form))


def open_loop(
    machine: Machine,
    free: Sequence[str] | Mapping[str, Sequence[str]] = (),
    mesh: Mesh | None = None,
    complex_form: bool | None = None,
) -> ClosedLoop:
    """The machine as a CasADi model with its control loops cut: magnets with bias, but without controllers.

    Parameters
    ----------
    machine, free, mesh, complex_form
        As in `closed_loop`.

    Returns
    -------
    ClosedLoop
        Without controller states; its functions ``B`` and ``C`` connect a controller of your own.

    Raises
    ------
    SpecError, ModelError
        As in `closed_loop`.
    """
    loop = closed_loop(machine, free, mesh, complex_form)
    cut = tuple(dataclasses.replace(axis, chain=None) for axis in loop.plant.axes)
    return dataclasses.replace(loop, plant=dataclasses.replace(loop.plant, axes=cut))


def _vanishes(difference: Number) -> bool:
    if isinstance(difference, ca.SX | ca.MX):
        return bool(difference.is_zero())
    return bool(difference == 0)
