"""A machine as CasADi expressions in some of its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from ..errors import ModelError
from ..spec.machine import Machine
from ..spec.paths import find, is_switched_off, replace, value
from .loop import Pencil, Structure, close, is_isotropic, structure
from .mesh import Mesh, plan

PENCIL = ("E", "A0", "A1", "B", "C")
STRUCTURE = ("M", "C0", "C1", "K0", "K1")


@dataclass(frozen=True)
class Parametric:
    """A machine as CasADi expressions in some of its numbers.

    Made by `parametric`.

    Attributes
    ----------
    machine : Machine
        With numbers.
    names : tuple of str
        Names of the parameters, in the order of the vector p.
    members : tuple of tuple of str
        For each parameter, the full paths of the numbers that it sets.
    p : casadi.SX
        Column of the parameters.
    nominal : tuple of float
        The parameters' values in `machine`.
    symbolic : Machine
        In terms of p.
    plant : Structure
        In terms of p; so is `pencil`.
    """

    machine: Machine
    names: tuple[str, ...]
    members: tuple[tuple[str, ...], ...]
    p: Any
    nominal: tuple[float, ...]
    symbolic: Machine
    plant: Structure

    @cached_property
    def pencil(self) -> Pencil:
        """E, A0, A1 in terms of p."""
        return close(self.plant)

    @property
    def np(self) -> int:
        """Number of parameters."""
        return len(self.names)

    @property
    def complex_form(self) -> bool:
        """True if one complex coordinate stands for y and z."""
        return self.plant.complex_form

    def matrix(self, name: str) -> ca.Function:
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
        if name not in PENCIL + STRUCTURE:
            raise ModelError(f"there is no matrix {name!r}; choose one of {', '.join(PENCIL + STRUCTURE)}")
        matrix = getattr(self.pencil if name in PENCIL else self.plant, name)
        return ca.Function(name, [self.p], [ca.SX(matrix.re), ca.SX(matrix.im)], ["p"], ["re", "im"])


def parametric(
    machine: Machine,
    free: Sequence[str] | Mapping[str, Sequence[str]] = (),
    mesh: Mesh | None = None,
    complex_form: bool | None = None,
) -> Parametric:
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
    Parametric

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
                f"{path} stands for numbers of different values; free them one by one, as find(machine, {path!r}) lists "
                f"them ({paths[0]}, ...), or make them equal"
            )
    p = ca.SX.sym("p", len(free))
    nominal = tuple(float(value(machine, m[0])) for m in members)
    symbols = {path: p[k] for k, paths in enumerate(members) for path in paths}
    symbolic = replace(machine, symbols) if symbols else machine
    return Parametric(machine, tuple(free), members, p, nominal, symbolic, structure(symbolic, mesh, complex_form))
