"""The closed loop: E dx/dt = (A0 + Omega A1) x, with the controllers' states in x.

State order: displacements q of the free degrees of freedom, their velocities, then the states of each controller
axis. Isotropic machines use complex coordinates, q = (r, phi) a node, one complex axis a magnet; others use real
ones, q = (v, w, beta_x, beta_y) a node and two axes a magnet.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import casadi as ca

from ..errors import ModelError
from ..spec.controller import PID, Chain, StateFeedback, StateSpace, serves_all
from ..spec.fields import Number
from ..spec.machine import Machine
from ..spec.magnet import Magnet
from .controller import Realisation, realise
from .feedback import along_axes, whole_state
from .magnet import current_stiffness, negative_stiffness
from .mesh import Mesh, plan
from .pair import Affine, Map, Matrix, Pair, blocks, real, zero
from .rotor import diagonal, rotor


@dataclass(frozen=True)
class Axis:
    """A magnet axis with its sensor.

    Attributes
    ----------
    name : for tables, ``"magnets[0] y"``; the complex axis of an isotropic machine is called ``"magnets[0]"``
    magnet : index of the magnet
    actuator, sensor : CasADi columns over the free degrees of freedom; force and displacement of the axis
    current_stiffness : k_i [N/A]
    """

    name: str
    magnet: int
    actuator: Matrix
    sensor: Matrix
    current_stiffness: Number


@dataclass(frozen=True)
class Block:
    """A controller with the axes that it drives.

    Attributes
    ----------
    axes : indices of the axes
    sensors : CasADi matrix, free degrees of freedom by inputs; of ideal state feedback all coordinates of interest
    law : state space from the displacements and velocities at its inputs to the currents of its axes
    ideal : True if it feeds back the whole state, so that there is no sensor at which a loop can be opened
    """

    axes: tuple[int, ...]
    sensors: Matrix
    law: Realisation
    ideal: bool = False


@dataclass(frozen=True)
class Structure:
    """The rotor on all its linear supports, the magnets' negative stiffness included, with open loops.

    Attributes
    ----------
    complex_form : True if q holds complex coordinates
    M, C0, C1, K0, K1 : matrices of M q'' + (C0 + Omega C1) q' + (K0 + Omega K1) q = F
    free : degrees of freedom that no pin holds, as indices into the unpinned order
    axes : of all magnets
    blocks : their controllers
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
    blocks: tuple[Block, ...]
    mesh: Mesh

    @property
    def size(self) -> int:
        """Number of free degrees of freedom."""
        return len(self.free)

    @property
    def loops(self) -> tuple[Axis, ...]:
        """Control loops: the axes that have a controller and a sensor of their own, in the order of the controllers."""
        return tuple(self.axes[k] for block in self.blocks if not block.ideal for k in block.axes)

    @property
    def driven(self) -> tuple[Axis, ...]:
        """The axes that have a controller of any kind, in the order of the controllers."""
        return tuple(self.axes[k] for block in self.blocks for k in block.axes)


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
    law = machine.controller
    if isinstance(law, StateSpace) and law.law.ports not in (1, len(machine.magnets)):
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
        complex_form,
        form(parts.M),
        form(parts.C0),
        form(parts.C1),
        stiffness,
        form(parts.K1),
        tuple(free),
        axes,
        tuple(_blocks(machine, axes, mesh, complex_form, free)),
        mesh,
    )


def _axes(machine: Machine, index: int, magnet: Magnet, mesh: Mesh, complex_form: bool, free: list[int]) -> list[Axis]:
    sensor_path = next(
        (f"sensors[{k}].position" for k, s in enumerate(machine.sensors) if magnet.sensor and s.name == magnet.sensor),
        f"magnets[{index}].position",
    )
    nodes = (mesh.node_of(f"magnets[{index}].position"), mesh.node_of(sensor_path))
    gain = current_stiffness(magnet)
    name = f"magnets[{index}]"
    if complex_form:
        at, seen = (_unit(free, [2 * n], [1.0]) for n in nodes)
        return [Axis(name, index, at, seen, gain)]
    c, s = ca.cos(magnet.axes_angle), ca.sin(magnet.axes_angle)
    axes = []
    for label, (y, z) in (("y", (c, s)), ("z", (-s, c))):
        at, seen = (_unit(free, [4 * n, 4 * n + 1], [y, z]) for n in nodes)
        axes.append(Axis(f"{name} {label}", index, at, seen, gain))
    return axes


def _blocks(
    machine: Machine, axes: tuple[Axis, ...], mesh: Mesh, complex_form: bool, free: list[int]
) -> Iterator[Block]:
    """Controllers, magnet by magnet, or the one that serves all magnets."""
    law, planes = machine.controller, 1 if complex_form else 2

    def block(chains: Sequence[Chain], *indices: int) -> Block:
        return Block(indices, ca.horzcat(*[axes[k].sensor for k in indices]), realise(chains, complex_form))

    if law is not None and axes and serves_all(law):
        by_plane = tuple(planes * i + k for k in range(planes) for i in range(len(machine.magnets)))
        if isinstance(law, StateFeedback):
            sensors, feedback = whole_state(law, mesh, complex_form, free)
            if planes == 2:
                feedback = along_axes(feedback, machine.magnets, sees_axes=False)
            yield Block(by_plane, sensors, feedback, ideal=True)
        elif isinstance(law, StateSpace):
            free_axes = law.law.ports == len(axes) and not complex_form
            chains: list[Chain] = [law] * len(axes)
            whole = block(chains, *(range(len(axes)) if free_axes else by_plane))
            yield whole if free_axes or planes == 1 else replace(whole, law=along_axes(whole.law, machine.magnets))
        else:
            raise ModelError(
                f"controller of type {law.type} has no gains yet; design it first with ad.synthesise(machine)"
            )
        return
    for i, magnet in enumerate(machine.magnets):
        chains = [c for c in machine.controllers_of(magnet)[:planes] if isinstance(c, Chain)]
        if len(chains) == 2 and any(isinstance(c, PID) and c.crosses for c in chains):
            if not all(isinstance(c, PID) for c in chains):
                raise ModelError(
                    f"the two axes of magnets[{i}] have controllers of different types, one of which crosses"
                )
            yield block(chains, 2 * i, 2 * i + 1)
        else:
            for k, chain in enumerate(chains):
                yield block([chain], planes * i + k)


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
    """Connect the controllers: i = -law(y), force k_i i.

    Parameters
    ----------
    plant : Structure

    Returns
    -------
    Pencil
        State order q, dq/dt, controller states block by block; sparse CasADi matrices.
    """
    n, axes = plant.size, len(plant.axes)
    m = sum(len(block.law.states) for block in plant.blocks)
    stiffness, damping = Affine(plant.K0, plant.K1), Affine(plant.C0, plant.C1)
    pushes, from_q, from_rate, inner = (
        [Affine(zero(*shape), zero(*shape))] for shape in ((n, 0), (0, n), (0, n), (0, 0))
    )
    for block in plant.blocks:
        law, push, sense = block.law, _push(plant, block), block.sensors.T
        inputs, eye = block.sensors.shape[1], ca.DM.eye(len(law.states))
        stiffness = stiffness + law.d.columns(0, inputs).between(push, sense)
        damping = damping + law.d.columns(inputs, 2 * inputs).between(push, sense)
        pushes.append(-law.c.between(push, eye))
        from_q.append(law.b.columns(0, inputs).between(eye, sense))
        from_rate.append(law.b.columns(inputs, 2 * inputs).between(eye, sense))
        inner.append(law.a)

    def matrix(part: str, unit: Pair) -> Pair:
        column, row_q, row_rate, own = (
            Pair(join(*[getattr(x, part).re for x in group]), join(*[getattr(x, part).im for x in group]))
            for join, group in (
                (ca.horzcat, pushes),
                (ca.vertcat, from_q),
                (ca.vertcat, from_rate),
                (ca.diagcat, inner),
            )
        )
        k, c = getattr(stiffness, part), getattr(damping, part)
        return blocks([[zero(n, n), unit, zero(n, m)], [-k, -c, column], [row_q, row_rate, own]])

    a0, a1 = matrix("constant", real(ca.DM.eye(n))), matrix("rate", zero(n, n))
    e = blocks(
        [
            [real(ca.DM.eye(n)), zero(n, n), zero(n, m)],
            [zero(n, n), plant.M, zero(n, m)],
            [zero(m, n), zero(m, n), real(ca.DM.eye(m))],
        ]
    )
    push = ca.horzcat(ca.DM(n, 0), *[a.current_stiffness * a.actuator for a in plant.axes])
    sense = ca.horzcat(ca.DM(n, 0), *[a.sensor for a in plant.axes]).T
    inputs = ca.vertcat(ca.DM(n, axes), push, ca.DM(m, axes))
    outputs = ca.horzcat(sense, ca.DM(axes, n + m))
    return Pencil(e, a0, a1, real(inputs), real(outputs))


def _push(plant: Structure, block: Block) -> Matrix:
    """Force of the currents of a block, free degrees of freedom by axes."""
    return ca.horzcat(*[plant.axes[k].current_stiffness * plant.axes[k].actuator for k in block.axes])


@dataclass(frozen=True)
class Ports:
    """Where disturbances enter the closed loop, and what is looked at.

    Attributes
    ----------
    F, G : states by control loops
        Of disturbances [m] added to the displacements at the sensors, and of their rates.
    C : outputs by states
        Displacements at the sensors of all control loops [m] (`Structure.loops`), then control currents [A] of all driven axes
        (`Structure.driven`), then displacements at the axes of all magnets [m].
    """

    F: Pair
    G: Pair
    C: Pair


def ports(plant: Structure, pencil: Pencil) -> Ports:
    """Inputs and outputs of the closed loop.

    Parameters
    ----------
    plant : Structure
    pencil : Pencil
        Its closed loop.

    Returns
    -------
    Ports

    Raises
    ------
    ModelError
        If a law that changes with the speed has no filter before or behind it.
    """
    n, total = plant.size, pencil.A0.shape[0]
    enter: tuple[list[Pair], list[Pair]] = ([zero(total, 0)], [zero(total, 0)])
    currents, start = [zero(0, total)], 2 * n
    for block in plant.blocks:
        law = block.law
        if not (law.b.fixed and law.c.fixed and law.d.fixed):
            raise ModelError(
                "a controller that changes with the speed needs a low-pass before it and an amplifier behind it"
            )
        k, inputs, outputs = len(law.states), block.sensors.shape[1], len(block.axes)
        b, c, d = law.b.constant, law.c.constant, law.d.constant
        push, sense, eye = _push(plant, block), block.sensors.T, ca.DM.eye(outputs)
        rest = total - start - k
        for j, columns in enumerate(((0, inputs), (inputs, 2 * inputs))):
            if not block.ideal:
                direct = -d.columns(*columns).between(push, ca.DM.eye(inputs))
                parts = [zero(n, inputs), direct, zero(start - 2 * n, inputs), b.columns(*columns), zero(rest, inputs)]
                enter[j].append(blocks([[part] for part in parts]))
        currents.append(
            blocks(
                [
                    [
                        -d.columns(0, inputs).between(eye, sense),
                        -d.columns(inputs, 2 * inputs).between(eye, sense),
                        zero(outputs, start - 2 * n),
                        -c,
                        zero(outputs, rest),
                    ]
                ]
            )
        )
        start += k
    sensed = [real(ca.horzcat(a.sensor.T, ca.DM(1, total - n))) for a in plant.loops]
    moved = [real(ca.horzcat(a.actuator.T, ca.DM(1, total - n))) for a in plant.axes]
    return Ports(blocks([enter[0]]), blocks([enter[1]]), blocks([[x] for x in (*sensed, *currents, *moved)]))


def _vanishes(difference: Number) -> bool:
    if isinstance(difference, ca.SX | ca.MX):
        return bool(difference.is_zero())
    return bool(difference == 0)
