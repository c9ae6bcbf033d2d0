"""The run through time: piece by piece, chunk by chunk."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..analysis.system import Array
from ..errors import SolveError
from .equations import FLAGS, WORKS, Equations
from .history import Chunks, History, whole
from .sampled import Sampler
from .schedule import Piece, Schedule
from .state import State
from .stepper import Stepper

Progress = Callable[[float], None]
"""Called with the fraction of the run that is done."""


class Run:
    """A run in progress.

    Parameters
    ----------
    equations, schedule, stepper
    start : State
    sampler : Sampler or None
    """

    def __init__(
        self, equations: Equations, schedule: Schedule, stepper: Stepper, start: State, sampler: Sampler | None
    ):
        self.equations, self.schedule, self.stepper, self.sampler = equations, schedule, stepper, sampler
        self.time, self.x = start.time, start.coordinates(equations.plant)
        self.works = np.zeros(len(WORKS))

    @property
    def held(self) -> Array:
        """Commands of sampled controllers that act now."""
        return np.zeros(len(self.equations.actuators)) if self.sampler is None else self.sampler.held

    def here(self) -> History:
        """The present as a history of one instant."""
        flags = np.zeros((1, len(FLAGS) * len(self.equations.machine.magnets)))
        return History(np.array([self.time]), self.x[None], self.held[None], self.works[None], flags)

    def state(self) -> State:
        """The present as a state to restart from."""
        e, p, s = self.equations, self.equations.plant, self.sampler
        n = p.size
        turned, _, _ = self.schedule.spin.at(self.time)
        none = np.zeros(0)
        return State(
            time=self.time,
            angle=turned + self.schedule.angle,
            displacements=p.basis @ self.x[:n],
            velocities=p.basis @ self.x[n : 2 * n],
            law=self.x[2 * n : 2 * n + e.law] if s is None else s.memory,
            amplifiers=self.x[2 * n + e.law :],
            held=none if s is None else s.held,
            pending=np.zeros((0, 1 + len(self.equations.actuators))) if s is None else _rows(s),
        )

    def resume(self, state: State, works: Array) -> None:
        """Go on from a state of the same run."""
        self.time, self.works = state.time, works
        self.x = state.coordinates(self.equations.plant)
        if self.sampler is not None:
            self.sampler.restart(state.law, state.held, state.pending)

    def advance(self, times: Array) -> History:
        """Go on to the last of some times and report at each.

        Raises
        ------
        RuntimeError
            If the integrator gives up.
        """
        taken: list[tuple[Array, Array, float, bool]] = []  # states, commands, step, whether they are outputs
        kicks: dict[int, float] = {}
        for piece in self.schedule.pieces(self.time, float(times[-1]), self.equations.plant):
            done = sum(len(t[0]) for t in taken)
            kicks[done] = kicks.get(done, 0.0) + self._kick(piece)
            inside = times[(times > piece.start) & (times <= piece.stop)]
            for start, step, count, output in self._strides(piece, inside):
                states = self.stepper.run(self.x, self.held, piece, start, step, count)
                self.x, self.time = states[-1], start + count * step
                taken.append((states, np.tile(self.held, (count, 1)), step, output))
            self.time = piece.stop
        works, shares = self.stepper.drain()
        for row, work in kicks.items():
            works[row, WORKS.index("forces")] += work
        steps = np.concatenate([np.full(len(t[0]), t[2]) for t in taken])
        ends = np.flatnonzero(np.concatenate([np.full(len(t[0]), t[3]) for t in taken]))
        begins = np.concatenate([[0], ends[:-1] + 1])
        self.works, before = self.works + works.sum(axis=0), self.works
        lengths = np.add.reduceat(steps, begins)
        return History(
            times,
            whole([t[0] for t in taken if t[3]]),
            whole([t[1] for t in taken if t[3]]),
            before + np.cumsum(works, axis=0)[ends],
            np.add.reduceat(shares * steps[:, None], begins, axis=0) / lengths[:, None],
        )

    def _kick(self, piece: Piece) -> float:
        """An impulse changes the kinetic energy at once; its work."""
        n = self.equations.plant.size
        before = self.x[n : 2 * n]
        if piece.kick.any():
            self.x = np.concatenate([self.x[:n], before + piece.kick, self.x[2 * n :]])
        return float(piece.kick @ (before + 0.5 * piece.kick))

    def _strides(self, piece: Piece, outputs: Array) -> Iterator[tuple[float, float, int, bool]]:
        """Start, step and number of equal steps, and whether their ends are outputs."""
        if self.sampler is not None:
            yield from self._events(self.sampler, piece, outputs)
            return
        edges, k = np.concatenate([[piece.start], outputs]), 0
        while k < len(outputs):
            step = float(edges[k + 1] - edges[k])
            even = edges[k] + step * np.arange(1, len(edges) - k)
            uneven = np.abs(edges[k + 1 :] - even) > 1e-9 * (abs(edges[k]) + step)
            count = int(np.argmax(uneven)) if uneven.any() else len(uneven)
            yield float(edges[k]), step, count, True
            k += count
        if edges[-1] < piece.stop:
            yield float(edges[-1]), float(piece.stop - edges[-1]), 1, False

    def _events(self, sampler: Sampler, piece: Piece, outputs: Array) -> Iterator[tuple[float, float, int, bool]]:
        """The same with sampled controllers, from one event to the next."""
        stops = [(float(t), True) for t in outputs]
        if not stops or stops[-1][0] < piece.stop:
            stops.append((piece.stop, False))
        at, k = piece.start, 0
        while k < len(stops):
            stop, output = stops[k]
            sampler.act(at, self.x)  # first, for its commands may bring new events
            event = sampler.next_event(at)
            if event < stop - 1e-9 * sampler.sampling.period:
                yield at, event - at, 1, False
                at = event
            else:
                yield at, stop - at, 1, output
                at, k = stop, k + 1


def _rows(sampler: Sampler) -> Array:
    return np.array(sampler.pending).reshape(-1, 1 + len(sampler.equations.actuators))


def travel(
    run: Run, times: Array, chunk: int, chunks: Chunks, resume: bool, progress: Progress | None
) -> tuple[History, State, str]:
    """Run to the last time.

    Returns
    -------
    History, State
    str
        Why it stopped early; empty if it did not.

    Raises
    ------
    SolveError
        If the integrator gives up; its `history` is that of the finished chunks.
    """
    parts, state, stopped = [run.here()], run.state(), ""
    for kept, state in chunks.begin(resume):
        parts.append(kept)
        run.resume(state, kept.works[-1])
    done = sum(len(part.times) for part in parts)
    while done < len(times) and not stopped:
        try:
            found = run.advance(times[done : done + chunk])
        except RuntimeError as error:
            failure = SolveError(
                f"the integrator gave up after {times[done - 1]:.6g} s; try a larger tolerance or fewer modes"
            )
            failure.history, failure.state = History.joined(parts), state  # type: ignore[attr-defined]
            raise failure from error
        left, stopped = departed(run.equations, found)
        parts.append(found.head(left))
        done += left
        if not stopped:
            state = run.state()
            chunks.keep(len(parts) - 2, found, state)
        if progress is not None:
            progress(done / len(times))
    return History.joined(parts), state, stopped


def departed(e: Equations, history: History) -> tuple[int, str]:
    """How many instants are good, and in words why no more: the rotor has met a pole, or is not finite."""
    places = (history.states[:, : e.plant.size] @ e.contact_places.T).reshape(len(history.times), -1, 2)
    for i, magnet in enumerate(e.machine.magnets):
        limit, what = (magnet.gap, "air gap") if magnet.gap is not None else (magnet.clearance, "clearance")
        linear = e.actuators[2 * i].linear
        if limit is None or linear or (e.contact is not None and what == "clearance"):
            continue
        outside = np.flatnonzero(~(np.hypot(*places[:, i].T) < limit))
        if len(outside):
            t = history.times[outside[0]]
            return int(outside[0]) + 1, (
                f"stopped at {t:.6g} s: the rotor left the {what} of magnets[{i}] ({limit:g} m)"
            )
    finite = np.isfinite(history.states).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        return first, f"stopped at {history.times[first]:.6g} s: the motion grew beyond all bounds"
    return len(history.times), ""
