"""A machine for other people's studies: CasADi Functions of some of its numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError
from ..model import motion
from ..model.mesh import Mesh
from ..model.parametric import PENCIL, STRUCTURE, Parametric, parametric
from ..spec.machine import Machine
from ..synthesis.design import synthesise
from . import catalogue, quantities
from .numbers import Numbers, machine_at
from .parameters import Parameter, parameters, split_free, vector


@dataclass(frozen=True)
class ClosedLoop(Parametric):
    """A machine as CasADi Functions of some of its numbers.

    Made by `closed_loop` and `open_loop`. It pickles: what cannot travel is built again on arrival.

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
        Matrices of rotor and controllers, in terms of p.
    bounds : dict of str to (float, float)
        As they were given, by parameter.
    modes : int or None
        Lowest modes of the rotor that its computed quantities know; all if None.
    """

    bounds: Mapping[str, tuple[float, float]] = dataclasses.field(default_factory=dict)
    modes: int | None = None

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Names, units, nominal values and bounds of the entries of p."""
        return parameters(self, self.bounds)

    @property
    def lower(self) -> list[float]:
        """Lower bounds of p."""
        return [q.lower for q in self.parameters]

    @property
    def upper(self) -> list[float]:
        """Upper bounds of p."""
        return [q.upper for q in self.parameters]

    def vector(self, values: Mapping[str, Any] | None = None) -> Any:
        """The vector p from values by name; nominal ones where a name is left out.

        Parameters
        ----------
        values : mapping of str to float or CasADi scalar, optional

        Returns
        -------
        ndarray of shape (np,), or a CasADi column where a value is an expression

        Raises
        ------
        ModelError
            If a name is none of the parameters.
        """
        entries = vector(self.parameters, values or {})
        if any(isinstance(x, ca.SX | ca.MX) for x in entries):
            return ca.vertcat(*entries)
        return np.array(entries, float)

    def values(self, p: Any) -> dict[str, float]:
        """Values by name from a vector p of numbers.

        Parameters
        ----------
        p : array_like, shape (np,)
        """
        return dict(zip(self.names, self._numbers_in(p).tolist(), strict=True))

    def machine_at(self, p: Any) -> Machine:
        """The machine with the numbers of p in place.

        Parameters
        ----------
        p : array_like, shape (np,)
        """
        return machine_at(self, self._numbers_in(p))

    def reduced(self, modes: int) -> ClosedLoop:
        """The same with fewer modes in its computed quantities: quick, for the long way of a search, and not exact.

        Parameters
        ----------
        modes : int
            Lowest modes at rest that are kept in each plane. Derivatives leave out how the modes themselves change. The stability
            limit stays that of the full model.
        """
        return dataclasses.replace(self, modes=modes)

    @property
    def controller_states(self) -> tuple[str, ...]:
        """Names of the controllers' states in the Functions ``controller`` and ``rhs``."""
        return motion.state_names(self._real.plant)

    def function(self, name: str, **options: Any) -> ca.Function:
        """A Function of p.

        Parameters
        ----------
        name : str
            A matrix (E, A0, A1, B, C of the pencil E dx/dt = (A0 + speed A1) x + B i, y = C x; M, C0, C1, K0, K1 of the structure
            M q'' + (C0 + speed C1) q' + (K0 + speed K1) q = F) with outputs ``re`` and ``im``; ``magnet_force``, ``controller``,
            ``rhs``, ``loads``; or a computed quantity: ``growth_rates``, ``damping_ratios``, ``sensitivity_peaks``,
            ``unbalance``, ``stability_limit``.
        **options
            Of ``rhs`` and ``loads``: ``modes`` to keep (all degrees of freedom if left out). Of quantities: as in
            `amb_design.study.quantities`, and ``speeds``, the number of speeds (1).

        Returns
        -------
        casadi.Function
            With named inputs and outputs, which `describe` explains. Expressions can be saved; computed quantities cannot, but
            can be differentiated like them.

        Raises
        ------
        ModelError
            If there is no such Function, or its options do not fit.
        """
        if name not in catalogue.FUNCTIONS:
            raise ModelError(f"there is no Function {name!r}; choose one of {catalogue.names()}")
        key = name, repr(sorted(options.items()))
        if key not in self._made:
            try:
                self._made[key] = self._build(name, options)
            except TypeError as error:
                raise ModelError(f"the Function {name!r} has no such option: {error}") from None
        return self._made[key]

    def describe(self, name: str, **options: Any) -> catalogue.Described:
        """Inputs and outputs of a Function: names, shapes, units and meaning.

        Parameters
        ----------
        name, options
            As in `function`.
        """
        return catalogue.described(name, self.function(name, **options))

    def damping_function(self, p: Any, speed: Any, smooth: float | None = None) -> Any:
        """Largest real part of the eigenvalues [1/s] at a speed; negative where stable.

        Parameters
        ----------
        p : column of parameters, expression or numbers
        speed : float or expression, or several in a column
            [rad/s]
        smooth : float, optional
            [1/s] Of the smoothed abscissa instead: by how much it lies above at least. It has a derivative everywhere.

        Returns
        -------
        casadi MX or DM
            One number a speed. Its derivative is that of the mode that holds the place.
        """
        return self._evaluated("growth_rates", p, speed, modes=1, smooth=smooth)

    def growth_rates(self, p: Any, speed: Any, modes: int = 4) -> Any:
        """Largest few real parts of the eigenvalues [1/s] at each speed, descending.

        Parameters
        ----------
        p, speed
            As in `damping_function`.
        modes : int
            How many.
        """
        return self._evaluated("growth_rates", p, speed, modes=modes)

    def damping_ratios(
        self, p: Any, speed: Any, modes: int = 4, window: tuple[float, float] = (0.0, float("inf"))
    ) -> Any:
        """Least few damping ratios at each speed, ascending.

        Parameters
        ----------
        p, speed
            As in `damping_function`.
        modes : int
            How many.
        window : (float, float)
            Whirl frequencies that count [rad/s].
        """
        return self._evaluated("damping_ratios", p, speed, modes=modes, window=tuple(window))

    def sensitivity_peaks(self, p: Any, speed: Any, peaks: int = 4, up_to: float = 0.0) -> Any:
        """Highest few peaks of the sensitivity of each control loop at each speed, descending.

        Parameters
        ----------
        p, speed
            As in `damping_function`.
        peaks : int
            How many.
        up_to : float
            Highest frequency [rad/s] where that is above 2 kHz and three times the speed.
        """
        return self._evaluated("sensitivity_peaks", p, speed, peaks=peaks, up_to=up_to)

    def unbalance(
        self,
        p: Any,
        speed: Any,
        unbalance: Sequence[Sequence[complex]] | None = None,
        quantity: str = "control_current",
        peaks: int = 0,
    ) -> Any:
        """What unbalances ask of each magnet at each speed, and the highest few peaks below it.

        Parameters
        ----------
        p, speed
            As in `damping_function`.
        unbalance : sequence of sequence of complex, optional
            Patterns, each with one unbalance a disk [kg m]; the machine's own if left out.
        quantity : str
            ``control_current`` [A], ``control_current_ratio``, ``total_current`` [A], ``flux_density`` [T], ``voltage`` [V] or
            ``displacement_ratio``.
        peaks : int
            How many.

        Raises
        ------
        ModelError
            If there is no unbalance.
        """
        disks = self.machine.rotor.disks
        own = [[d.unbalance * np.exp(1j * d.unbalance_phase) for d in disks]]
        patterns = tuple(tuple(complex(u) for u in row) for row in (own if unbalance is None else unbalance))
        if not any(u for row in patterns for u in row) or {len(row) for row in patterns} != {len(disks)}:
            raise ModelError(
                f"{self.machine.name}: give unbalance patterns with one value [kg m] for each of {len(disks)} disks"
            )
        return self._evaluated("unbalance", p, speed, unbalance=patterns, quantity=quantity, peaks=peaks)

    def stability_limit(self, p: Any, top_speed: float | None = None) -> Any:
        """Stability limit speed [rad/s].

        Parameters
        ----------
        p : column of parameters, expression or numbers
        top_speed : float, optional
            Where the search ends [rad/s]; the machine's top speed if left out.

        Returns
        -------
        casadi MX or DM
            Zero if unstable at rest, the top speed if stable up to there, both with zero derivatives; elsewhere the derivative is
            that of the mode that becomes unstable.
        """
        return self.function("stability_limit", top_speed=top_speed)(self._column(p))

    @cached_property
    def _made(self) -> dict[Any, ca.Function]:
        return {}

    @cached_property
    def _real(self) -> Parametric:
        return motion.real_form(self)

    @cached_property
    def _numeric(self) -> Numbers:
        return Numbers(self, self.modes)

    def _build(self, name: str, options: dict[str, Any]) -> ca.Function:
        if name in PENCIL + STRUCTURE and not options:
            return self.matrix(name)
        if name in ("magnet_force", "controller") and not options:
            return (motion.magnet_force if name == "magnet_force" else motion.controller)(self._real)
        if name in ("rhs", "loads") and set(options) <= {"modes"}:
            return (motion.motion if name == "rhs" else motion.loads)(self._real, self._basis(options.get("modes")))
        if name == "stability_limit":
            top = options.pop("top_speed", None)
            top = float(self.machine.operation.top_speed if top is None else top)
            return quantities.limit_speed(self._numeric, top, **options)
        if name in quantities.OVER_SPEEDS:
            return quantities.OVER_SPEEDS[name](self._numeric, **{"speeds": 1, **options})
        raise TypeError(", ".join(options))

    def _basis(self, modes: int | None) -> ca.DM | None:
        if modes is None:
            return None
        from ..transient.plant import plant_of

        basis = plant_of(self.machine, modes, ()).basis
        if len(basis) != self._real.plant.size:
            raise ModelError(f"{self.machine.name} has a mesh of its own here; leave `modes` out or the mesh")
        return ca.DM(basis)

    def _evaluated(self, name: str, p: Any, speed: Any, **options: Any) -> Any:
        at = speed if isinstance(speed, ca.MX) else ca.DM(np.atleast_1d(np.asarray(speed, float)))
        at = ca.vec(at)
        return self.function(name, speeds=at.shape[0], **options)(self._column(p), at)

    def _column(self, p: Any) -> Any:
        """The parameters as a column: a row or a scalar would be taken for something else without a word."""
        if isinstance(p, ca.SX):
            raise ModelError("the computed quantities take MX expressions or numbers, not SX; use ca.MX.sym or ca.Opti")
        column = p if isinstance(p, ca.MX) else ca.DM(self._numbers_in(p))
        if column.shape != (self.np, 1):
            raise ModelError(
                f"p has the shape {column.shape}; a column of {self.np} parameters is expected: {self._listed}"
            )
        return column

    def _numbers_in(self, p: Any) -> np.ndarray[Any, Any]:
        array = np.asarray(p.full() if isinstance(p, ca.DM) else p, float)
        if array.size != self.np:
            raise ModelError(f"p has {array.size} entries; {self.np} parameters are expected: {self._listed}")
        return array.reshape(self.np)

    @property
    def _listed(self) -> str:
        return ", ".join(self.names) or "none"

    def __reduce__(self) -> Any:
        members = dict(zip(self.names, self.members, strict=True))
        form = self.plant.mesh, self.complex_form
        return _rebuilt, (self.machine, members, dict(self.bounds), self.modes, *form)


def closed_loop(
    machine: Machine,
    free: Sequence[str] | Mapping[str, Sequence[Any]] = (),
    mesh: Mesh | None = None,
    complex_form: bool | None = None,
) -> ClosedLoop:
    """The machine as a CasADi model with some of its numbers as variables.

    Parameters
    ----------
    machine : Machine
        Numbers only. A controller that is given by its weights is designed first and then stays.
    free : sequence of str, or mapping
        Paths of the numbers that become variables, full or short; a short path ties all numbers that it fits. A mapping gives
        each path its bounds (lower, upper), as the `free` of a design problem does, or each name the full paths that it sets.
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
        If the complex form is asked of an anisotropic machine, or a variable has no effect of its own: because it is zero and thereby
        leaves its block out, or because it is a position that shares its node with another one that leads it.
    """
    names, bounds = split_free(free)
    return _made(parametric(synthesise(machine), names, mesh, complex_form), bounds)


def open_loop(
    machine: Machine,
    free: Sequence[str] | Mapping[str, Sequence[Any]] = (),
    mesh: Mesh | None = None,
    complex_form: bool | None = None,
) -> ClosedLoop:
    """The machine as a CasADi model with its control loops cut: magnets with bias, but without controllers.

    Parameters
    ----------
    machine, free, mesh, complex_form
        As in `closed_loop`; numbers of controllers are not there to be freed.

    Returns
    -------
    ClosedLoop
        Without controller states; its functions ``B`` and ``C`` connect a controller of your own.

    Raises
    ------
    SpecError, ModelError
        As in `closed_loop`.
    """
    names, bounds = split_free(free)
    return _made(parametric(machine.without_controllers(), names, mesh, complex_form), bounds)


def _made(whole: Parametric, bounds: Mapping[str, tuple[float, float]]) -> ClosedLoop:
    freed = {path for paths in whole.members for path in paths}
    for station in whole.plant.mesh.stations:
        for path in sorted(freed.intersection(station.members)):
            if station.leader != path and station.leader not in freed:
                leader = station.leader if isinstance(station.leader, str) else "a shaft end or step"
                raise ModelError(f"{path} shares its node with {leader}, which leads it; free that instead")
    fields = {f.name: getattr(whole, f.name) for f in dataclasses.fields(whole)}
    return ClosedLoop(**fields, bounds=bounds)


def _rebuilt(
    machine: Machine,
    members: dict[str, tuple[str, ...]],
    bounds: dict[str, tuple[float, float]],
    modes: int | None,
    mesh: Mesh,
    complex_form: bool,
) -> ClosedLoop:
    made = _made(parametric(machine, members, mesh, complex_form), bounds)
    return made if modes is None else made.reduced(modes)
