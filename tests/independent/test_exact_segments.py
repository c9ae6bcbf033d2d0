"""Two packaged machines against exact solutions of the beam equations between stations: no finite elements, no state space.

The shaft between two stations is a matrix exponential of (r, phi, shear force, moment) at a complex frequency s; the loops are
transfer functions of s. Roots in s, or in whirl frequency and spin speed, come from Newton's method on a bordered dynamic stiffness.
Machines that differ in y and z have v + i w and v - i w as two fields, coupled at the bearings.
"""

from __future__ import annotations

import math
import tomllib
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg as sla

import amb_design as ad
from amb_design.model.rotor import SHEAR_LOSS
from independent.test_laminate import turned

Array = np.ndarray
PROBLEMS = ad.packaged()


def chain(c: ad.PID, s: complex) -> complex:
    """Current per displacement, with the sign changed."""
    g = c.sensor_gain * c.total_gain * (c.kp + c.ki / s + c.kd * s)
    if c.low_pass:
        w, z = c.low_pass.frequency, c.low_pass.damping
        g *= w**2 / (s**2 + 2 * z * w * s + w**2)
    for n in c.notches:
        w = n.frequency
        g *= (s**2 + 2 * n.damping * w * s + w**2) / (s**2 + 2 * n.width * w * s + w**2)
    if c.delay:
        x = s * c.delay
        g *= (1 - x / 2 + x**2 / 12) / (1 + x / 2 + x**2 / 12)
    w, z = c.amplifier.bandwidth, c.amplifier.damping
    return complex(g * c.amplifier.gain * w**2 / (s**2 + 2 * z * w * s + w**2))


class Exact:
    """A machine with one laminated segment, its bearings without cross coupling and alike but for kyy and kzz."""

    def __init__(self, machine: ad.Machine):
        self.machine, shaft = machine, machine.rotor.shaft
        (segment,) = shaft.segments
        places = {0.0, segment.length, *(x for _, x in machine.stations())}
        self.x = sorted(places)
        r = segment.inner_diameter / 2
        s = b = a16 = mass = inertia = 0.0
        for ply in segment.plies:
            c, q = turned(ply, True), r + ply.thickness
            s += math.pi / 2 * (c[4, 4] + c[5, 5]) * (q**2 - r**2)
            a16 += 2 * math.pi / 3 * c[0, 5] * (q**3 - r**3)
            b += math.pi / 4 * c[0, 0] * (q**4 - r**4)
            mass += math.pi * ply.material.density * (q**2 - r**2)
            inertia += math.pi / 4 * ply.material.density * (q**4 - r**4)
            r = q
        ks = shaft.shear_correction
        self.s, self.a, self.b, self.mass, self.inertia = ks * s, ks * a16 / 2, b, mass, inertia
        self.coupled = any(m.kyy is not None for m in machine.bearings)

    def field(self, s: complex, speed: float, i: complex) -> Array:
        """Dynamic stiffness of one field over (r, phi) of the stations; i is the unit of its rotation."""
        shaft, x = self.machine.rotor.shaft, self.x
        eta, h = shaft.hysteretic_damping, math.sqrt(1 + shaft.hysteretic_damping**2)
        elastic, rate = (1 + eta) / h, shaft.viscous_damping * (s - i * speed)
        law = np.array(
            [
                [self.s * (elastic + SHEAR_LOSS * rate), -i * self.a * elastic],
                [i * self.a * elastic, self.b * (elastic - i * eta / h + rate)],
            ]
        )
        flow = np.zeros((4, 4), complex)
        flow[0, 1] = 1.0
        flow[:2, 2:] = np.linalg.inv(law)
        flow[2, 0] = self.mass * s**2
        flow[3, 1] = self.inertia * (s**2 - 2j * i.imag * speed * s)
        flow[3, 2] = -1.0
        d = np.zeros((2 * len(x), 2 * len(x)), complex)
        for k, (left, right) in enumerate(pairwise(x)):
            t = sla.expm(flow * (right - left))
            back = np.linalg.inv(t[:2, 2:])
            at, to = slice(2 * k, 2 * k + 2), slice(2 * k + 2, 2 * k + 4)
            d[at, at] += back @ t[:2, :2]
            d[at, to] -= back
            d[to, at] += t[2:, :2] - t[2:, 2:] @ back @ t[:2, :2]
            d[to, to] += t[2:, 2:] @ back
        for disk in self.machine.rotor.disks:
            k = 2 * x.index(disk.position)
            radii = (disk.outer_diameter**2 + disk.inner_diameter**2) / 4
            diametral, polar = disk.mass / 12 * (3 * radii + disk.width**2), disk.mass / 2 * radii
            d[k, k] += disk.mass * s**2
            d[k + 1, k + 1] += diametral * s**2 - i * polar * speed * s
        for bearing in self.machine.bearings:
            k = 2 * x.index(bearing.position)
            d[k, k] += sum(self.planes(bearing)) / 2 + bearing.damping * s
        sensors = {p.name: p.position for p in self.machine.sensors}
        for m in self.machine.magnets:
            k, sensor = 2 * x.index(m.position), 2 * x.index(sensors.get(m.sensor, m.position))
            ki = 4e-7 * math.pi * m.turns**2 * m.pole_area * m.bias_current * math.cos(m.half_angle) / m.gap**2
            d[k, k] -= ki * m.bias_current / m.gap
            d[k, sensor] += ki * chain(self.machine.controller, s)
        return d

    @staticmethod
    def planes(bearing: ad.Bearing) -> tuple[float, float]:
        return tuple(bearing.stiffness if k is None else k for k in (bearing.kyy, bearing.kzz))

    def stiffness(self, s: complex, speed: float) -> Array:
        forward = self.field(s, speed, 1j)
        if not self.coupled:
            return forward
        backward, coupling = self.field(s, speed, -1j), np.zeros_like(forward)
        for bearing in self.machine.bearings:
            k, (y, z) = 2 * self.x.index(bearing.position), self.planes(bearing)
            coupling[k, k] += (y - z) / 2
        return np.block([[forward, coupling], [coupling, backward]])

    def residual(self, s: complex, speed: float) -> complex:
        """Analytic in s and speed; zero where the dynamic stiffness is singular."""
        d = self.stiffness(s, speed)
        n = len(d)
        scale = np.tile([1.0, 10.0], n // 2)
        b, c = (np.random.default_rng(k).standard_normal(n) for k in (1, 2))
        whole = np.block([[d * np.outer(scale, scale) / 1e7, b[:, None]], [c[None, :], np.zeros((1, 1))]])
        return complex(np.linalg.solve(whole, np.eye(n + 1)[n])[n])

    def root(self, s: complex, speed: float = 0.0) -> complex:
        """Eigenvalue near s at a speed."""
        for _ in range(30):
            h = 1e-5 * abs(s)
            slope = (self.residual(s + h, speed) - self.residual(s - h, speed)) / (2 * h)
            step = self.residual(s, speed) / slope
            s -= step
            if abs(step) < 1e-9 * abs(s):
                return s
        raise AssertionError("no convergence")

    def onset(self, frequency: float, speed: float) -> tuple[float, float]:
        """Whirl frequency and spin speed where an eigenvalue lies on the axis [rad/s]."""
        u = np.array([frequency, speed])
        for _ in range(30):
            g = self.residual(1j * u[0], u[1])
            columns = []
            for k in (0, 1):
                h = np.zeros(2)
                h[k] = 1e-5 * u[k]
                difference = self.residual(1j * (u + h)[0], (u + h)[1]) - self.residual(1j * (u - h)[0], (u - h)[1])
                columns.append(difference / (2 * h[k]))
            step = np.linalg.solve(np.array([[c.real for c in columns], [c.imag for c in columns]]), [g.real, g.imag])
            u = u - step
            if np.abs(step / u).max() < 1e-9:
                return float(u[0]), float(u[1])
        raise AssertionError("no convergence")


def figures(name: str) -> dict[str, float]:
    """Published figures by variant and label."""
    document = tomllib.loads((PROBLEMS[name] / "expected.toml").read_text(encoding="utf-8"))
    return {f"{f.get('variant', '')} {f['label']}".strip(): f["published"] for f in document["figures"]}


def near(found: float, expected: float, what: str, tolerance: float) -> None:
    print(f"{what}: {found:.7g}, exact {expected:.7g} ({found / expected - 1:+.1e})")
    assert found == pytest.approx(expected, rel=tolerance), what


@pytest.mark.parametrize(("name", "onsets"), [("composite-spindle", 3), ("thesis-anisotropic", 2)])
def test_onsets(name: str, onsets: int) -> None:
    """All onsets of instability below the top speed; and the figures of expected.toml."""
    machine = ad.load(name)
    exact, limit = Exact(machine), ad.stability_limit(machine)
    known = figures(name)
    unstable = [o for o in limit.onsets if o.unstable]
    assert len(unstable) == onsets
    for k, onset in enumerate(unstable):
        start = abs(onset.mode.eigenvalue.imag) * (1.002 if k % 2 else 0.998), onset.speed * 1.01
        frequency, speed = exact.onset(*start)
        near(onset.speed, speed, f"{name}, onset {k + 1} [rad/s]", 5e-4)
        near(abs(onset.mode.eigenvalue.imag), frequency, "    its whirl [rad/s]", 2e-4)
        (figure,) = [
            v for what, v in known.items() if what.endswith(("stability limit", "second onset", "third onset")[k])
        ]
        near(figure, speed * 30 / math.pi, "    figure of expected.toml [rpm]", 1e-6)


@pytest.mark.parametrize(
    ("name", "variant"),
    [("composite-spindle", "free-free"), ("composite-spindle", "levitated"), ("thesis-anisotropic", "")],
)
def test_modes_at_rest(name: str, variant: str) -> None:
    machine = ad.load(name, variant or None)
    exact, known = Exact(machine), figures(name)
    modes = [m for m in ad.spectrum(machine) if m.whirl != "none" and m.kind == "rotor" and m.damping_ratio < 0.3]
    compared = 0
    for mode in modes[:6]:
        root = exact.root(mode.signed * 1.003)
        print(f"{name} {variant}: {mode.signed:.6g}, exact {root:.6g}")
        assert abs(mode.signed - root) < 1e-3 * abs(root)
        hertz = abs(root.imag) / (2 * math.pi)
        for what, v in known.items():
            if what.startswith(f"{variant} bending".strip()) and abs(v / hertz - 1) < 1e-5:
                near(v, hertz, f"    {what}, expected.toml", 1e-6)
                compared += 1
    assert compared >= {"free-free": 6, "levitated": 1, "": 3}[variant]
