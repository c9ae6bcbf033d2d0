"""A design problem at one design: every limited quantity with its derivatives, as rows of an optimisation problem."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.modes import WHIRL_FREQUENCY
from ..analysis.system import Array
from ..spec.problem import DesignProblem
from ..spec.problem_parts import Limit, Measure, Scenario
from .coordinates import Coordinates, modal
from .loop_family import LoopFamily, loop_family
from .measures import critical, loops, modes, noise, statics, whirl
from .measures.modes import instability
from .measures.samples import Samples, peaks
from .meshes import Layout, own
from .state import State
from .variables import Scaling

FRACTIONS = np.array([0.0, 0.03125, *np.linspace(0.125, 1.0, 8)])
"""Speeds, as fractions of the range, at which eigenvalues are held down; one more near rest, where planar modes turn into whirls. Others
are added where a check finds violations."""

CHECKED = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
"""Fractions of the range at which sensitivities and noise currents are held down."""

GUARDED = np.array([1.0])
"""Fractions of the range at which stability of the complete model is watched while the search works on a reduced one."""

LOWEST = 0.02
"""Level at which the search for the stability limit begins."""

LOW = 0.25
"""Fraction of a limit below which a value is taken as it is."""


CLOSER = 4
"""Parts into which the halves of the steps between the fractions are divided where the excess over a limit has a peak between them."""

NEAR = -1.0
"""Excess from which such a peak is looked at."""

ADDED = 3
"""Fractions that are added at once, for each scenario and quantity."""

SLIGHT = (1e-3, 1e-4)
"""Excess over a limit between the fractions that verification may mend: of eigenvalues, and of sensitivities and noise currents, for
which it takes long to look again."""

BESIDE = 0.01
"""Part of a frequency by which a mode beside a window counts as inside: a search that moves it just out would leave it inside on
the next mesh."""

LIGHT = 0.01
"""Damping ratio in which stability is measured, so that its conditions weigh as much as those of limits."""


@dataclass(frozen=True)
class Rows:
    """Conditions g(z) <= 0 with z = (x, level), near one point.

    Attributes
    ----------
    values : ndarray, shape (k,)
        Relative to the limit.
    slopes : ndarray, shape (k, variables + 1)
    quantities : tuple of str
    scenarios : tuple of str
    places : tuple of str
    speeds : ndarray, shape (k,)
    keys : tuple
        Rows with equal keys at two points may be the same mode or peak...
    marks : ndarray of complex, shape (k,)
        ... and are where these agree best.
    """

    values: Array
    slopes: Array
    quantities: tuple[str, ...]
    scenarios: tuple[str, ...]
    places: tuple[str, ...]
    speeds: Array
    keys: tuple[Any, ...]
    marks: Array

    @property
    def worst(self) -> float:
        """Largest value: positive if a condition is violated."""
        return float(self.values.max(initial=-np.inf))


def _condition(limit: Limit, bound: float, values: Array, slopes: Array) -> tuple[Array, Array, Array]:
    """Values, slopes and scale of a limit, in a form that is close to linear.

    Resonance peaks grow like one over the damping: 1 - bound/value is then nearly linear in the variables, where value -
    bound is not.
    """
    if not limit.kind.upper:
        return bound - values, -slopes, np.full(len(values), bound)
    ratio = values / bound
    low = ratio < LOW
    safe = np.where(low, LOW, ratio)
    bent = np.where(low, 1.0 - 1.0 / LOW + (ratio - LOW) / LOW**2, 1.0 - 1.0 / safe)
    return bent, slopes / (bound * safe**2)[:, None], np.ones(len(values))


def _highest(excess: Array, least: float) -> Array:
    """Rows with the highest peaks of a table's columns, `ADDED` at most, as far as they are higher than the least."""
    tops = [(-curve[k], k) for curve in excess.T for k in peaks(curve) if curve[k] > least]
    return np.array([k for _, k in sorted(tops)[:ADDED]], int)


def _corner(at: Array, curve: Array, k: int) -> tuple[float, float]:
    """Height and place of a peak: as it is, for the least damped of several modes may change there."""
    return float(curve[k]), float(at[k])


def _vertex(at: Array, curve: Array, k: int) -> tuple[float, float]:
    """Height and place of a smooth peak, from the parabola through its neighbours."""
    if not 0 < k < len(at) - 1:
        return _corner(at, curve, k)
    (a, b, c), (below, top, beyond) = at[k - 1 : k + 2], curve[k - 1 : k + 2]
    slope = (top - below) / (b - a)
    bend = ((beyond - top) / (c - b) - slope) / (c - a)
    place = (a + b) / 2.0 - slope / (2.0 * min(bend, -1e-300))
    return float(below + (slope + bend * (place - b)) * (place - a)), float(place)


class Case:
    """One scenario of a problem, ready to be evaluated.

    Parameters
    ----------
    problem : DesignProblem
    scenario : Scenario or None
    values : dict of str to float, optional
        Variables for which the mesh is planned.
    layout : callable
        Lays out the mesh of a machine; the machine's own if left out.
    """

    def __init__(
        self,
        problem: DesignProblem,
        scenario: Scenario | None,
        values: dict[str, float] | None = None,
        layout: Layout = own,
    ):
        self.problem, self.name = problem, "" if scenario is None else scenario.name
        self.loops: LoopFamily = loop_family(problem, scenario, values, layout)
        self.measures: dict[str, Measure] = {c.quantity: c for c in problem.constraints}
        if not problem.seeks_speed:
            self.measures[problem.objective.quantity] = problem.objective
        bounds = {c.quantity: 0.2 * c.bound for c in problem.constraints if c.quantity in whirl.QUANTITIES}
        self.unbalance = whirl.UnbalanceMeasures(self.loops, bounds) if bounds else None
        noisy = [m for q, m in self.measures.items() if q in noise.QUANTITIES]
        above = {m.quantity: 0.2 * m.bound for m in noisy if isinstance(m, Limit)}
        self.noise = noise.NoiseMeasures(self.loops, noisy, above) if noisy else None
        self._complete: Coordinates | None = None
        self.statics = statics.Statics(self.loops, [m for q, m in self.measures.items() if q in statics.QUANTITIES])

    def state(self, p: Array, modes: int | None = None) -> State:
        """The design in coordinates of its lowest modes at rest, or in complete ones.

        Parameters
        ----------
        p : ndarray
            SI values of the variables.
        modes : int, optional
            Number of modes; complete if left out.
        """
        member, n = self.loops.family.at(p), self.loops.displacements
        speed = 0.5 * self.problem.top_speed
        if modes is not None and modes < n:
            return State(member, modal(member, n, speed, modes))
        if self._complete is None:  # exact whatever the design: made once
            self._complete = modal(member, n, speed)
        return State(member, self._complete)

    def afresh(self) -> None:
        """Make the complete coordinates anew, from the next design."""
        self._complete = None

    def samples(
        self, state: State, end: float, fractions: Array = FRACTIONS, checked: Array = CHECKED
    ) -> dict[str, Samples]:
        """All quantities of the problem, and stability.

        Parameters
        ----------
        state : State
        end : float
            End of the range of speeds [rad/s].
        fractions, checked : ndarray
            Fractions of the range for eigenvalues, and for sensitivities and noise currents.

        Returns
        -------
        dict of str to Samples
            By quantity, in SI units and derivatives with respect to the SI values of the variables.
        """
        out = self._modes(state, fractions, end)
        if "sensitivity_peak" in self.measures:
            out["sensitivity_peak"] = self._sensitivity(state, checked, end)
        if self.unbalance is not None:
            out |= self.unbalance.samples(state, end)
        if self.noise is not None:
            out |= self.noise.samples(state, checked, end)
        if "separation_margin" in self.measures:
            service = float(self.problem.machine.operation.service_speed)
            out["separation_margin"] = critical.separation(state, service, self.loops.complex_form)
        return out | self.statics.samples(state.member.p, end)

    def _modes(self, state: State, fractions: Array, end: float) -> dict[str, Samples]:
        """What eigenvalues are limited by: stability, decay, damping."""
        real_form = not self.loops.complex_form
        out = {"stability": modes.stability(modes.modes(state, fractions, end, real_form=real_form))}
        if "decay_rate" in self.measures:
            whirling = np.abs(state.spectra(fractions * end).values.imag) > WHIRL_FREQUENCY
            out["decay_rate"] = modes.decay(modes.modes(state, fractions, end, whirling, real_form, slowest=True))
        if "damping_ratio" in self.measures:
            window = self.measures["damping_ratio"].option("window")
            chosen = modes.in_window(state.spectra(fractions * end).values, window, BESIDE)
            out["damping_ratio"] = modes.damping(modes.modes(state, fractions, end, chosen, real_form))
        return out

    def shortfalls(self, values: Array, bounds: Mapping[str, float]) -> dict[str, Array]:
        """How far eigenvalues are beyond their limits at each speed, relative to these: stability, damping, decay.

        Parameters
        ----------
        values : ndarray of complex, shape (speeds, modes)
        bounds : mapping of str to float

        Returns
        -------
        dict of str to ndarray, shape (speeds, 1)
        """
        out = {"stability": instability(values)}
        if "decay_rate" in bounds:
            whirling = np.abs(values.imag) > WHIRL_FREQUENCY
            out["decay_rate"] = np.where(whirling, values.real, -np.inf)
        if "damping_ratio" in bounds:
            seen = modes.in_window(values, self.measures["damping_ratio"].option("window"), BESIDE)
            out["damping_ratio"] = np.where(seen, values.real / np.maximum(np.abs(values), 1e-300), -np.inf)
        worst = {q: table.max(axis=1, keepdims=True) for q, table in out.items()}
        return {q: worst[q] / LIGHT if q == "stability" else 1.0 + worst[q] / bounds[q] for q in worst}

    @property
    def looped(self) -> bool:
        """True if sensitivities or noise currents count."""
        return self.noise is not None or "sensitivity_peak" in self.measures

    def overshoots(self, state: State, fractions: Array, end: float, bounds: Mapping[str, float]) -> dict[str, Array]:
        """How far sensitivities and noise currents are beyond their limits, in the measure in which they are held down.

        Parameters
        ----------
        state : State
        fractions : ndarray, shape (speeds,)
        end : float
            End of the range of speeds [rad/s].
        bounds : mapping of str to float

        Returns
        -------
        dict of str to ndarray, shape (speeds, loops)
        """
        found = self.noise.heights(state, fractions, end) if self.noise is not None else {}
        if "sensitivity_peak" in self.measures:
            up_to, count = self.measures["sensitivity_peak"].option("up_to"), len(self.loops.plant.loops)
            found["sensitivity_peak"] = loops.heights(state, fractions, end, count, self.loops.complex_form, up_to)
        return {q: 1.0 - bounds[q] / np.maximum(table, 1e-300) for q, table in found.items() if q in bounds}

    def guard(self, state: State, end: float) -> dict[str, Samples]:
        """Stability and sensitivity of the complete model at few speeds, for modes that the searched one does not have.

        What the controller does to modes of high frequency hardly depends on the speed.
        """
        found = modes.modes(state, GUARDED, end, real_form=not self.loops.complex_form)
        out = {"stability": modes.stability(found)}
        if "sensitivity_peak" in self.measures:
            out["sensitivity_peak"] = self._sensitivity(state, GUARDED, end)
        return _labelled(out, "complete")

    def on_mesh(self, label: str, state: State, end: float, fractions: Array) -> dict[str, Samples]:
        """What modes that only a finer mesh has may break: all that eigenvalues are limited by, and sensitivities."""
        out = self._modes(state, fractions, end)
        if "sensitivity_peak" in self.measures:
            out["sensitivity_peak"] = self._sensitivity(state, fractions, end)
        return _labelled(out, label)

    def _sensitivity(self, state: State, fractions: Array, end: float) -> Samples:
        above, up_to = 0.2 * self._bound("sensitivity_peak"), self.measures["sensitivity_peak"].option("up_to")
        return loops.sensitivity(
            state, fractions, end, len(self.loops.plant.loops), self.loops.complex_form, above, up_to
        )

    def _bound(self, quantity: str) -> float:
        measure = self.measures[quantity]
        return measure.bound if isinstance(measure, Limit) else 1.0


def _labelled(found: Mapping[str, Samples], label: str) -> dict[str, Samples]:
    """Under other names, as several models have the same modes."""
    return {q: dataclasses.replace(s, groups=tuple(f"{label} {g}" for g in s.groups)) for q, s in found.items()}


class Evaluator:
    """Rows of a design problem over all its scenarios.

    The unknowns are z = (x, level): the variables in the unit cube, and the level of the objective, always to be
    maximised. For the stability limit the level is the end of the range of speeds over the top speed; for other
    objectives it is the quantity over its scale, with the sign of what is good.

    Parameters
    ----------
    problem : DesignProblem
    values : dict of str to float, optional
        Variables for which the mesh is planned.

    Attributes
    ----------
    fractions, checked : ndarray
        Fractions of the range of speeds at which eigenvalues, and at which sensitivities and noise currents are held down.
    margins : dict of str to float
        By how much limits are tightened, relative to the bound; "stability" in damping ratio over `LIGHT`.
    watched : dict of (str, str) to (Case, ndarray)
        By scenario and layout: a model on a finer mesh, and fractions of the range at which its eigenvalues and sensitivities
        are held too.
    eigensolves : dict of int to int
        Eigendecompositions so far, by size.
    """

    def __init__(self, problem: DesignProblem, values: dict[str, float] | None = None):
        self.problem, self.scaling = problem, Scaling(problem.variables)
        self.cases = [Case(problem, s, values) for s in (None, *problem.cases)]
        self.limits = {c.quantity: c for c in problem.constraints}
        self.fractions, self.checked = FRACTIONS, CHECKED
        self.margins: dict[str, float] = {}
        self.watched: dict[tuple[str, str], tuple[Case, Array]] = {}
        self.scale = 1.0
        self.eigensolves: dict[int, int] = {}

    @property
    def variables(self) -> int:
        """Number of design variables."""
        return len(self.problem.variables)

    def end(self, level: float) -> float:
        """End of the range of speeds [rad/s]."""
        return level * self.problem.top_speed if self.problem.seeks_speed else self.problem.top_speed

    def objective(self, level: float) -> float:
        """The objective in SI units."""
        if self.problem.seeks_speed:
            return self.end(level)
        return -level * self.scale if self.problem.objective.kind.upper else level * self.scale

    def level(self, objective: float) -> float:
        """The level of an objective in SI units."""
        if self.problem.seeks_speed:
            return objective / self.problem.top_speed
        return -objective / self.scale if self.problem.objective.kind.upper else objective / self.scale

    def begin_at(self, objective: float) -> float:
        """The level of an objective in SI units, which becomes the scale of levels where it is no speed."""
        if not self.problem.seeks_speed:
            self.scale = abs(objective) or 1.0
        return self.level(objective)

    def overlooked(self, x: Array, level: float, modes: int | None = None) -> tuple[Array, Array]:
        """Fractions of the range, between those that are looked at, where something is worst beyond its limit.

        Parameters
        ----------
        x : ndarray, shape (variables,)
            In the unit cube.
        level : float
        modes : int, optional
            Of the rotor at rest that represent it; the full model if left out.

        Returns
        -------
        fractions, checked : ndarray
            For eigenvalues, and for sensitivities and noise currents: at most `ADDED` for each scenario and quantity; empty if
            nothing is beyond.
        """
        p, end, bounds = self.scaling.values(x), self.end(level), self.bounds(level)
        found: tuple[set[float], set[float]] = set(), set()
        net = np.union1d(self.fractions, self.checked)
        wide = np.sort(np.append(net, (net[:-1] + net[1:]) / 2.0))
        for case in self.cases:
            state = case.state(p, modes)

            def look(at: Array, case: Case = case, state: State = state) -> tuple[dict[str, Array], dict[str, Array]]:
                values = state.spectra(at * end).values if case.looped else state.eigenvalues(at * end)
                return case.shortfalls(values, bounds), case.overshoots(state, at, end, bounds)

            first = look(wide)
            tops = [_highest(excess, NEAR) for tables in first for excess in tables.values()]
            gaps = np.intersect1d(np.arange(len(wide) - 1), np.concatenate([np.append(t - 1, t) for t in tops]))
            close = (wide[gaps] + np.arange(1, CLOSER)[:, None] / CLOSER * np.diff(wide)[gaps]).ravel()
            at, order = np.unique(np.append(wide, close), return_index=True)
            looks = [first, look(close)] if len(close) else [first]
            for places, slight, top, *tables in zip(found, SLIGHT, (_corner, _vertex), *looks, strict=True):
                for quantity in tables[0]:
                    excess = np.vstack([t[quantity] for t in tables])[order] + self.margins.get(quantity, 0.0)
                    highest = sorted((top(at, curve, k) for curve in excess.T for k in peaks(curve)), reverse=True)
                    places.update(place for height, place in highest[:ADDED] if height > slight)
            self._count(state)
        return np.setdiff1d(sorted(found[0]), self.fractions), np.setdiff1d(sorted(found[1]), self.checked)

    def bounds(self, level: float) -> dict[str, float]:
        """Of all limits and, where it is no speed, of the objective at a level, as far as relative to them means something."""
        bounds = {q: c.bound for q, c in self.limits.items()}
        if not self.problem.seeks_speed:
            bounds[self.problem.objective.quantity] = self.objective(level)
        return {q: bound for q, bound in bounds.items() if bound > 0.0}

    def worst(self, x: Array, level: float, modes: int, fractions: Array) -> float:
        """Largest violation of stability alone: a quick look at a point."""
        p, end = self.scaling.values(x), self.end(level)
        out = -np.inf
        for case in self.cases:
            state = case.state(p, modes)
            out = max(out, float(case.shortfalls(state.eigenvalues(fractions * end), {})["stability"].max()))
            self._count(state)
        return out

    def start_level(self, x: Array, modes: int | None) -> float:
        """Level that the objective has at a point; sets the scale of the objective where it is no speed."""
        if self.problem.seeks_speed:
            return LOWEST
        name, upper = self.problem.objective.quantity, self.problem.objective.kind.upper
        p, end = self.scaling.values(x), self.problem.top_speed
        found = [case.samples(case.state(p, modes), end)[name].values for case in self.cases]
        return self.begin_at(float(np.concatenate(found).max() if upper else np.concatenate(found).min()))

    def rows(self, x: Array, level: float, modes: int | None = None) -> Rows:
        """All conditions at a design.

        Parameters
        ----------
        x : ndarray, shape (variables,)
            In the unit cube.
        level : float
        modes : int, optional
            Of the rotor at rest that represent it; the full model if left out.
        """
        p, rates, end = self.scaling.values(x), self.scaling.rates(x), self.end(level)
        parts = []
        for case in self.cases:
            state = case.state(p, modes)
            for quantity, samples in case.samples(state, end, self.fractions, self.checked).items():
                if len(samples):
                    parts.append(self._rows(case.name, quantity, samples, rates, level))
            self._count(state)
            if modes is not None and modes < case.loops.displacements:
                complete = case.state(p)
                for quantity, samples in case.guard(complete, end).items():
                    parts.append(self._rows(case.name, quantity, samples, rates, level))
                self._count(complete)
        for (name, mesh), (case, at) in self.watched.items() if modes is None else ():
            finer = case.state(p)
            for quantity, samples in case.on_mesh(mesh, finer, end, at).items():
                parts.append(self._rows(name, quantity, samples, rates, level))
            self._count(finer)
        return Rows(
            np.concatenate([r.values for r in parts]),
            np.concatenate([r.slopes for r in parts]),
            tuple(q for r in parts for q in r.quantities),
            tuple(s for r in parts for s in r.scenarios),
            tuple(place for r in parts for place in r.places),
            np.concatenate([r.speeds for r in parts]),
            tuple(key for r in parts for key in r.keys),
            np.concatenate([r.marks for r in parts]),
        )

    def excesses(self, rows: Rows) -> Array:
        """How far each row is beyond its limit, relative to that: for stability in damping ratio over `LIGHT`.

        Parameters
        ----------
        rows : Rows
            Whose own values bend upper limits.
        """
        upper = np.array([q in self.limits and self.limits[q].kind.upper for q in rows.quantities])
        bent = np.where(upper, rows.values, 0.0)
        return np.where(upper, bent / (1.0 - bent), rows.values)

    def watch(self, scenario: str, layout: Layout, fraction: float) -> None:
        """Hold the eigenvalues and sensitivities of a model on a finer mesh too, from now on.

        Parameters
        ----------
        scenario : str
        layout : callable
            Of the mesh.
        fraction : float
            Of the range of speeds.
        """
        key = scenario, layout.__name__
        if key not in self.watched:
            drawn = next((c for c in self.problem.cases if c.name == scenario), None)
            self.watched[key] = Case(self.problem, drawn, layout=layout), GUARDED
        case, fractions = self.watched[key]
        self.watched[key] = case, np.unique(np.append(fractions, fraction))

    def afresh(self) -> None:
        """Forget what earlier starts left behind, so that a start does not depend on them to the last bit."""
        self.eigensolves, self.fractions, self.checked = {}, FRACTIONS, CHECKED
        for case in self.cases:
            case.afresh()

    def _count(self, state: State) -> None:
        self.eigensolves[state.size] = self.eigensolves.get(state.size, 0) + state.decompositions

    def _rows(self, scenario: str, quantity: str, samples: Samples, rates: Array, level: float) -> Rows:
        slopes = np.hstack([samples.slopes * rates, np.zeros((len(samples), 1))])
        margin = self.margins.get(quantity, 0.0)
        if self.problem.seeks_speed:
            slopes[:, -1] = samples.rates * self.problem.top_speed
        if quantity == "stability":
            values, slopes, scale = LIGHT * margin - samples.values, -slopes, np.full(len(samples), LIGHT)
        elif quantity == self.problem.objective.quantity and not self.problem.seeks_speed:
            # level = -sign quantity/scale, hence sign quantity/scale + level <= 0
            sign = 1.0 if self.problem.objective.kind.upper else -1.0
            values, slopes = sign * samples.values + level * self.scale, sign * slopes
            slopes[:, -1] = self.scale
            scale = np.full(len(samples), self.scale)
        else:
            limit = self.limits[quantity]
            bound = limit.bound * (1.0 - margin if limit.kind.upper else 1.0 + margin)
            values, slopes, scale = _condition(limit, bound, samples.values, slopes)
        count = len(samples)
        return Rows(
            values / scale,
            slopes / scale[:, None],
            (quantity,) * count,
            (scenario,) * count,
            samples.places,
            samples.speeds,
            tuple((quantity, scenario, group) for group in samples.groups),
            samples.marks,
        )
