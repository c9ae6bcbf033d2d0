"""The closed loop of a design problem as a family: eigenvalues, sensitivities and unbalance response from one model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..model.loop import Structure, close, ports, structure
from ..spec.controller import LQG
from ..spec.machine import Machine
from ..spec.paths import find, replace, value
from ..spec.problem import DesignProblem
from ..spec.problem_parts import Scenario
from ..synthesis.tuned import TunedLaw
from .family import Family
from .meshes import Layout, own


@dataclass(frozen=True)
class LoopFamily:
    """A machine in terms of the design variables.

    Attributes
    ----------
    problem : DesignProblem
    scenario : Scenario or None
        The machine as drawn if None.
    family : Family
        Inputs (F, G) and outputs (C) as in `model.loop.Ports`.
    p : casadi.SX
        Values of the variables.
    machine : Machine
        With expressions in p.
    plant : Structure
        In terms of p.
    axes : tuple of int
        Magnet of each axis that has a controller.
    pushed : tuple of int
        Magnet of each axis at which displacements are seen.
    unbalance : ndarray, shape (states, patterns)
        Force per squared speed [kg m].
    """

    problem: DesignProblem
    scenario: Scenario | None
    family: Family
    p: ca.SX
    machine: Machine
    plant: Structure
    axes: tuple[int, ...]
    pushed: tuple[int, ...]
    unbalance: Array

    @property
    def complex_form(self) -> bool:
        """True if one complex coordinate stands for y and z."""
        return self.plant.complex_form

    @property
    def patterns(self) -> tuple[str, ...]:
        """Name of each unbalance pattern."""
        return tuple(q.name for q in self.problem.patterns) or ("own unbalance",)

    @property
    def displacements(self) -> int:
        """Number of displacements at the head of the state."""
        return self.plant.size


def loop_family(
    problem: DesignProblem,
    scenario: Scenario | None = None,
    values: dict[str, float] | None = None,
    layout: Layout = own,
) -> LoopFamily:
    """Build the model of a design problem.

    Parameters
    ----------
    problem : DesignProblem
    scenario : Scenario, optional
    values : dict of str to float, optional
        Values of the variables for which the mesh is planned; those of the start if left out.
    layout : callable
        Lays out the mesh of a machine; the machine's own if left out.
    """
    p = ca.SX.sym("p", len(problem.variables))
    nominal = problem.with_values(values or problem.start())
    symbolic = problem.with_values(dict(zip([v.name for v in problem.variables], p.elements(), strict=True)))
    mesh = layout(_scaled(nominal, scenario))
    tuned = TunedLaw(p, symbolic, nominal) if isinstance(nominal.controller, LQG) else None
    symbolic = _scaled(symbolic if tuned is None else tuned.machine, scenario)  # the law knows the nominal machine
    plant = structure(symbolic, mesh)
    pencil = close(plant)
    seen = ports(plant, pencil)
    looked_at = {"F": seen.F, "G": seen.G, "C": seen.C}
    return LoopFamily(
        problem,
        scenario,
        Family(p, {"E": pencil.E, "A0": pencil.A0, "A1": pencil.A1, **looked_at}, tuned),
        p,
        symbolic,
        plant,
        tuple(a.magnet for a in plant.driven),
        tuple(a.magnet for a in plant.axes),
        _unbalance(problem, scenario, plant),
    )


def _scaled(machine: Machine, scenario: Scenario | None) -> Machine:
    if scenario is None:
        return machine
    paths = {path: factor for name, factor in scenario.factors for path in find(machine, name)}
    return replace(machine, {path: factor * value(machine, path) for path, factor in paths.items()})


def _unbalance(problem: DesignProblem, scenario: Scenario | None, plant: Structure) -> Array:
    """Unbalance forces of all patterns per squared speed."""
    disks = problem.machine.rotor.disks
    patterns: list[list[complex]] = [list(map(complex, q.amounts)) for q in problem.patterns]
    if not patterns and any(d.unbalance for d in disks):
        patterns = [[d.unbalance * np.exp(1j * d.unbalance_phase) for d in disks]]
    return (1.0 if scenario is None else scenario.unbalance) * unbalance_forces(plant, patterns)


def unbalance_forces(plant: Structure, patterns: Sequence[Sequence[complex]]) -> Array:
    """Forces of unbalances per squared speed over the states of the pencil.

    Parameters
    ----------
    plant : Structure
    patterns : sequence of sequence of complex
        One unbalance a disk [kg m].

    Returns
    -------
    ndarray of complex, shape (states, patterns)
    """
    where = {k: i for i, k in enumerate(plant.free)}
    controllers = sum(len(block.law.states) for block in plant.blocks)
    out = np.zeros((2 * plant.size + controllers, len(patterns)), complex)
    for j, amounts in enumerate(patterns):
        for i, u in enumerate(amounts):
            node = plant.mesh.node_of(f"rotor.disks[{i}].position")
            entries = [(2 * node, u)] if plant.complex_form else [(4 * node, u), (4 * node + 1, -1j * u)]
            for place, force in entries:
                if place in where:
                    out[plant.size + where[place], j] += force
    return out
