"""Controllers of the magnet axes: the hardware around them and the laws that they obey.

Every chain runs sensor, low-pass, law, notches, delay, amplifier; blocks that are left out pass the signal on. Laws are in
the units that the chain's ends imply: with a sensor in V/m and an amplifier in A/V a proportional gain is V/V; with both left
out it is A/m.

A law may couple the axes. In the complex coordinate y + i z of an isotropic machine, what leads from y to z and back with opposite
sign is the imaginary part of a gain; it is called cross here. Laws may change in proportion to the spin speed (`..._rate`), and
only so: the closed loop then stays A0 + Omega A1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

from ..errors import SpecError
from .fields import Number, OptionalNumber, Spec, choice, is_number, is_whole, matrix, number, part


@dataclass(frozen=True, kw_only=True)
class LowPass(Spec):
    """Second-order low-pass w^2/(s^2 + 2 z w s + w^2)."""

    frequency: Number = number("rad/s", "corner frequency", domain="positive")
    damping: Number = number("", "damping ratio", domain="positive", default=0.7)


@dataclass(frozen=True, kw_only=True)
class Notch(Spec):
    """Notch (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2)."""

    frequency: Number = number("rad/s", "notch frequency", domain="positive")
    damping: Number = number("", "numerator damping ratio zn: the depth", domain="nonnegative", default=0.1)
    width: Number = number("", "denominator damping ratio zd", domain="positive", default=1.0)


@dataclass(frozen=True, kw_only=True)
class Amplifier(Spec):
    """Current amplifier: gain times a second-order low-pass."""

    gain: Number = number("A/V", "gain at low frequency", default=1.0)
    bandwidth: Number = number("rad/s", "corner frequency", domain="positive")
    damping: Number = number("", "damping ratio; 1/sqrt(2) is Butterworth", domain="positive", default=0.5**0.5)


@dataclass(frozen=True, kw_only=True)
class Chain(Spec):
    """What every controller has around its law."""

    sensor_gain: Number = number("V/m", "sensor gain; 1 if the gains refer to metres", default=1.0)
    low_pass: LowPass | None = part("low-pass before the law", default=None)
    notches: tuple[Notch, ...] = part("notch filters after the law", default=())
    delay: Number = number(
        "s",
        "computation and sampling delay (Pade approximation of order 2)",
        domain="nonnegative",
        default=0.0,
        switch=True,
    )
    amplifier: Amplifier | None = part("current amplifier", default=None)

    @classmethod
    def with_hardware_of(cls, other: Chain, **values: Any) -> Self:
        """A controller of this kind in the place of another one, behind its sensors, low-pass, delay and amplifier.

        Parameters
        ----------
        other : PID, StateSpace or LQG
        **values
            Fields of the new controller; hardware among them takes the place of the other's.

        Raises
        ------
        SpecError
            If the other one has no hardware, or a value is wrong.
        """
        if not isinstance(other, Chain):
            got = getattr(other, "type", type(other).__name__)
            raise SpecError("has no hardware", field="other", got=got, remedy="name a controller that can be built")
        return cls(**{name: getattr(other, name) for name in HARDWARE} | values)


HARDWARE = ("sensor_gain", "low_pass", "delay", "amplifier")
"""Fields of a chain that belong to the machine and not to the law."""


@dataclass(frozen=True, kw_only=True)
class PID(Chain):
    """PID chain of an axis: i = -S LP Kt (Kp + Ki/s + Kd s + i (Kc + Omega Kc')) N D AMP y."""

    type: str = choice("kind of controller", ("pid",), default="pid")
    total_gain: Number = number("", "factor on all gains", default=1.0)
    kp: Number = number("", "proportional gain")
    ki: Number = number("1/s", "integral gain; 0 drops the integrator", default=0.0, switch=True)
    kd: Number = number("s", "derivative gain", default=0.0)
    derivative_time: Number = number(
        "s", "filter kd s/(t s + 1); 0 is the ideal derivative", domain="nonnegative", default=0.0, switch=True
    )
    kc: Number = number("", "cross gain, to the current of z from y and, negative, to that of y from z", default=0.0)
    kc_rate: Number = number("s/rad", "what a rad/s of spin speed adds to the cross gain", default=0.0)

    @property
    def crosses(self) -> bool:
        """True if the two axes of a magnet are coupled."""
        return not (_is_zero(self.kc) and _is_zero(self.kc_rate))


@dataclass(frozen=True, kw_only=True)
class Matrices(Spec):
    """dx/dt = a x + b y, u = c x + d y."""

    a: Any = matrix("states by states", default=())
    b: Any = matrix("states by inputs", default=())
    c: Any = matrix("outputs by states", default=())
    d: Any = matrix("outputs by inputs; zero if left out", default=())

    @property
    def states(self) -> int:
        """Number of states."""
        return int(_shape(self.a)[0])

    @property
    def ports(self) -> int:
        """Number of inputs, which is that of outputs."""
        return max(_shape(self.b)[1], _shape(self.c)[0], _shape(self.d)[0])

    def check(self) -> None:
        n, m = self.states, self.ports
        if n == 0 and _shape(self.d) == (0, 0):
            raise SpecError("are all missing", field="a, b, c, d", remedy="give a, b and c, or a gain d")
        wanted = {"a": (n, n), "b": (n, m), "c": (m, n), "d": (m, m)}
        for name, shape in wanted.items():
            found = _shape(getattr(self, name))
            if found != shape and not (found == (0, 0) and (0 in shape or name == "d")):
                raise SpecError(
                    f"is {found[0]} by {found[1]} where {shape[0]} by {shape[1]} is wanted",
                    field=name,
                    remedy="give as many inputs as outputs, and matrices that fit each other",
                )


@dataclass(frozen=True, kw_only=True)
class StateSpace(Chain):
    """Any linear law, from sensed displacements to what the amplifiers are told: i = -S LP (c (s - a)^-1 b + d) N D AMP y.

    With one input and no cross part it serves each axis by itself. With one for each magnet it connects the magnets and serves y and z alike;
    then `cross` may lead from one to the other. With two for each magnet (first axis, second axis of the first magnet, ...) it is
    free. At the spin speed Omega the matrices are law + Omega law_rate, and so for cross.
    """

    type: str = choice("kind of controller", ("state_space",), default="state_space", written=True)
    law: Matrices = part("its matrices")
    law_rate: Matrices | None = part("what a rad/s of spin speed adds to them", default=None)
    cross: Matrices | None = part("imaginary part for displacements y + i z of all magnets", default=None)
    cross_rate: Matrices | None = part("what a rad/s of spin speed adds to the imaginary part", default=None)

    def check(self) -> None:
        size = self.law.states, self.law.ports
        for name in ("law_rate", "cross", "cross_rate"):
            other = getattr(self, name)
            if other is not None and (other.states, other.ports) != size:
                raise SpecError(
                    f"has {other.states} states and {other.ports} inputs where law has {size[0]} and {size[1]}",
                    field=name,
                    remedy="give matrices of the same sizes, with zeros where nothing is added",
                )

    @property
    def parts(self) -> tuple[Matrices | None, Matrices | None, Matrices | None, Matrices | None]:
        """Real and imaginary part, then what a rad/s adds to each."""
        return self.law, self.cross, self.law_rate, self.cross_rate


@dataclass(frozen=True, kw_only=True)
class StateFeedback(Spec):
    """Ideal feedback of the whole state, without sensors, filters and amplifiers: a reference that nobody can build.

    Gains act on the displacement r = v + i w and the slope phi of every node of the machine's own mesh, in this order, and on their
    rates: u = -(position q + rate q'). One row for each magnet.
    """

    type: str = choice("kind of controller", ("state_feedback",), default="state_feedback", written=True)
    position: Any = matrix("magnets by twice the nodes [A/m], [A/rad]")
    rate: Any = matrix("magnets by twice the nodes [A s/m], [A s/rad]")
    position_cross: Any = matrix("imaginary part of position", default=())
    rate_cross: Any = matrix("imaginary part of rate", default=())
    per_speed: StateFeedback | None = part("what a rad/s of spin speed adds to the gains", default=None)

    def check(self) -> None:
        shape = _shape(self.position)
        for name in ("rate", "position_cross", "rate_cross"):
            found = _shape(getattr(self, name))
            if found != shape and not (found == (0, 0) and name.endswith("cross")):
                raise SpecError(
                    f"is {found[0]} by {found[1]} where position is {shape[0]} by {shape[1]}",
                    field=name,
                    remedy="give gains for the same nodes",
                )
        if self.per_speed is not None and _shape(self.per_speed.position) != shape:
            raise SpecError("has gains for other nodes", field="per_speed", remedy="give gains for the same nodes")


@dataclass(frozen=True, kw_only=True)
class Regulator(Spec):
    """What a quadratic regulator weighs: the integral of sum (y/d)^2 + (y'/v)^2 + (e/s)^2 + (i/c)^2 over the magnets.

    y is the displacement at a magnet, e the integral of what its sensor reports, i its control current.
    """

    modes: int = part("modes of the rotor at rest that the law knows, in each plane", default=8)
    displacement: Number = number("m", "displacement d at a magnet that weighs one", domain="positive", default=1e-5)
    current: Number = number("A", "control current c that weighs one", domain="positive")
    velocity: OptionalNumber = number(
        "m/s", "velocity v at a magnet that weighs one; not weighed if left out", domain="positive", default=None
    )
    modal_velocity: OptionalNumber = number(
        "m/s", "velocity of each mode (largest along the shaft) that weighs one", domain="positive", default=None
    )
    design_speed: Number = number("rad/s", "spin speed of the design", domain="nonnegative", default=0.0)
    scheduled: bool = part("true if gains, and the observer, follow the spin speed", default=False)

    def check(self) -> None:
        if not (is_whole(self.modes) and 1 <= self.modes <= 64):
            raise SpecError(
                "must be a whole number from 1 to 64", field="modes", got=self.modes, remedy="8 serve most rotors"
            )
        if not isinstance(self.scheduled, bool):
            raise SpecError(
                "must be true or false", field="scheduled", got=self.scheduled, remedy="write true or false"
            )
        if self.scheduled and is_number(self.design_speed) and self.design_speed == 0.0:
            raise SpecError(
                "must be above zero where gains follow the speed",
                field="design_speed",
                got=0.0,
                remedy="give the upper end of the schedule, such as the service speed",
            )


@dataclass(frozen=True, kw_only=True)
class LQR(Regulator):
    """Ideal linear quadratic regulator: the whole state is known, amplifiers follow at once. A reference, not a design."""

    type: str = choice("kind of controller", ("lqr",), default="lqr", written=True)


@dataclass(frozen=True, kw_only=True)
class LQG(Chain, Regulator):
    """Linear quadratic regulator with a Kalman observer and integral action, behind the same hardware as any controller.

    It is designed on the rotor's lowest modes with static correction, together with low-pass, delay and amplifier; with `order`, on as
    many states of all that, which are found by balanced truncation. With `scheduled`
    its gains run linearly from those designed at rest to those designed at `design_speed`, and the observer's rotor turns with
    the machine; else all is that of the design speed.
    """

    type: str = choice("kind of controller", ("lqg",), default="lqg", written=True)
    order: int | None = part(
        "states of rotor and hardware that the law keeps, in each plane, by balanced truncation; all if left out",
        default=None,
    )
    integral: OptionalNumber = number(
        "m s",
        "integral s of a sensed displacement that weighs one; no integral action if left out",
        domain="positive",
        default=None,
    )
    current_rate: OptionalNumber = number(
        "A/s", "rate of the current that weighs one; not weighed if left out", domain="positive", default=None
    )
    sensor_noise: Number = number(
        "m/sqrt(Hz)", "noise of a sensor, one-sided amplitude density", domain="positive", default=1e-9
    )
    force_noise: Number = number(
        "N/sqrt(Hz)", "force noise at each magnet, one-sided amplitude density", domain="nonnegative"
    )
    modal_noise: Number = number(
        "N/sqrt(Hz)", "force noise at the antinode of each mode", domain="nonnegative", default=0.0
    )
    current_noise: Number = number(
        "A/sqrt(Hz)",
        "noise at each amplifier's input: more of it recovers the regulator's margins",
        domain="nonnegative",
        default=0.0,
    )

    def check(self) -> None:
        super().check()
        if self.order is not None and not (is_whole(self.order) and 1 <= self.order <= 256):
            raise SpecError(
                "must be a whole number from 1 to 256",
                field="order",
                got=self.order,
                remedy="leave it out to keep all states that the law is designed with",
            )
        for name in ("low_pass", "amplifier"):
            if getattr(self, name) is None:
                raise SpecError(
                    "is missing", field=name, remedy="an observer has to know what stands between it and the rotor"
                )
        assert self.amplifier is not None
        for name, gain in (("sensor_gain", self.sensor_gain), ("amplifier.gain", self.amplifier.gain)):
            if _is_zero(gain):
                raise SpecError("is zero, which cuts the loop", field=name, remedy="give a gain, 1 if it is unknown")
        noises = (self.force_noise, self.modal_noise, self.current_noise)
        if all(_is_zero(noise) for noise in noises):
            raise SpecError(
                "is zero, and so are modal_noise and current_noise",
                field="force_noise",
                remedy="give one of them: an observer of a rotor that nothing shakes has nothing to do",
            )


def ideal_law(law: Any) -> LQR:
    """The regulator of an LQG alone, with the same weights.

    Parameters
    ----------
    law : LQG

    Raises
    ------
    SpecError
        If it is no LQG.
    """
    if not isinstance(law, LQG):
        raise SpecError(
            "is no LQG whose regulator could stand alone", field="controller", remedy="name a machine with one"
        )
    return LQR(**{f.name: getattr(law, f.name) for f in fields(Regulator)})


Controller = PID | StateSpace | StateFeedback | LQR | LQG


def serves_all(controller: Controller) -> bool:
    """True if the law connects all magnets, so that it can be no magnet's own.

    Parameters
    ----------
    controller : Controller
    """
    if isinstance(controller, StateSpace):
        return controller.law.ports > 1 or controller.cross is not None or controller.cross_rate is not None
    return not isinstance(controller, PID)


def needs_design(controller: Controller | None) -> bool:
    """True for laws that are given by what they shall achieve.

    Parameters
    ----------
    controller : Controller or None
    """
    return isinstance(controller, Regulator)


def weights(controller: Controller | None) -> frozenset[str]:
    """Names of the numbers that say what a law shall achieve; none if it has gains.

    Parameters
    ----------
    controller : Controller or None
    """
    if controller is None or not needs_design(controller):
        return frozenset()
    return frozenset(f.name for f in fields(controller) if "unit" in f.metadata) - {f.name for f in fields(Chain)}


def _shape(entries: Any) -> tuple[int, int]:
    if isinstance(entries, tuple | list):
        return (len(entries), len(entries[0]) if len(entries) else 0)
    rows, columns = entries.shape
    return int(rows), int(columns)


def _is_zero(value: Number) -> bool:
    return is_number(value) and value == 0


def rows_of(entries: Any) -> Sequence[Sequence[Number]]:
    """Rows of a matrix field, whether it holds tuples or a CasADi matrix.

    Parameters
    ----------
    entries : tuple of tuple, or casadi SX or MX
    """
    if isinstance(entries, tuple):
        return entries
    return [[entries[i, j] for j in range(entries.shape[1])] for i in range(entries.shape[0])]
