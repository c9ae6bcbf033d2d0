"""Mass, losses, hoop strain, surface speed, torsion and coil voltage against closed forms, with exact derivatives."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.linalg as sla
import scipy.optimize

import amb_design as ad
from amb_design.analysis.findings import findings
from amb_design.analysis.gradient import movable
from amb_design.analysis.system import dense
from amb_design.model import magnet as magnetics
from amb_design.model.laminate import hoop_modulus, torsional_stiffness
from amb_design.model.mesh import plan
from amb_design.model.strength import copper_loss, hoop_strain, rotor_mass, surface_speed, torsion
from amb_design.spec.paths import value
from independent.everything import isotropic_machine
from independent.test_laminate import turned

CARBON = ad.Orthotropic(E1=139e9, E2=11e9, G12=6.05e9, G13=6.05e9, G23=3.78e9, nu12=0.313, density=1578)
STEEL = ad.Isotropic(E=205e9, nu=0.29, density=7850)
SPEED = 1500.0


def rod(*disks: ad.Disk, elements: int = 8, length: float = 1.3) -> ad.Machine:
    """A solid steel rod, free at both ends."""
    segment = ad.Segment(length=length, outer_diameter=0.04, material=STEEL)
    shaft = ad.Shaft(segments=(segment,), elements=elements)
    return ad.Machine(name="rod", rotor=ad.Rotor(shaft=shaft, disks=disks), operation=ad.Operation(top_speed=100.0))


def wall(*degrees: float, thickness: float = 1e-3) -> tuple[ad.Ply, ...]:
    return ad.layup(CARBON, [math.radians(a) for a in degrees], thickness)


def dense_real(matrix: Any) -> np.ndarray:
    return np.array(ca.DM(matrix))


def torsional_frequencies(machine: ad.Machine) -> np.ndarray:
    """Free torsional frequencies [rad/s]; the first belongs to the spin."""
    K, J = (dense_real(m) for m in torsion(machine, plan(machine)))
    return np.sqrt(np.abs(sla.eigh(K, J, eigvals_only=True)))


# --- torsion --------------------------------------------------------------------------------------------------------


def test_uniform_rod() -> None:
    """Free at both ends: n pi/L sqrt(G/rho), fourth order in the element length."""
    length, g = 1.3, STEEL.E / (2 * (1 + STEEL.nu))
    exact = math.pi / length * math.sqrt(g / STEEL.density) * np.arange(1, 4)
    errors = [torsional_frequencies(rod(elements=n))[1:4] / exact - 1.0 for n in (8, 16)]
    assert np.all(errors[0] > 0.0)  # from above
    assert errors[1][0] < 2e-6
    assert np.all(np.abs(np.log2(errors[0] / errors[1]) - 4.0) < 0.1)
    assert torsional_frequencies(rod())[0] < 1e-3 * exact[0]


def test_rod_with_two_end_disks() -> None:
    """tan(k L) = (m1 + m2) k/(m1 m2 k^2 - 1) with m = Ip/(rho J); and the spring between two flywheels for a light rod."""
    length, radius, polar = 1.3, 0.02, (0.06, 0.11)
    second, g = math.pi / 2 * radius**4, STEEL.E / (2 * (1 + STEEL.nu))
    ends = [
        ad.Disk(position=x, mass=5.0, diametral_inertia=i, polar_inertia=i)
        for x, i in zip((0.0, length), polar, strict=True)
    ]
    found = torsional_frequencies(rod(*ends, elements=12))[1]
    m1, m2 = (i / (STEEL.density * second) for i in polar)
    k = scipy.optimize.brentq(
        lambda k: (m1 * m2 * k**2 - 1.0) * math.sin(k * length) - (m1 + m2) * k * math.cos(k * length), 1e-4, 1.0
    )
    assert found == pytest.approx(k * math.sqrt(g / STEEL.density), rel=1e-8)
    light = math.sqrt(g * second / length * (1 / polar[0] + 1 / polar[1]))
    assert found == pytest.approx(light, rel=5e-3)


def test_stepped_rod_in_static_twist() -> None:
    """Compliances of the segments add up."""
    segments = (
        ad.Segment(length=0.3, outer_diameter=0.03, material=STEEL),
        ad.Segment(length=0.2, inner_diameter=0.02, plies=wall(45, -45, 30)),
    )
    machine = ad.replace(rod(), {"rotor.shaft": ad.Shaft(segments=segments, shear_correction=0.5, elements=5)})
    K = dense_real(torsion(machine, plan(machine))[0])
    load = np.zeros(len(K))
    load[-1] = 7.0
    twist = np.linalg.solve(K[1:, 1:], load[1:])[-1]  # clamped at the left end
    assert twist == pytest.approx(7.0 * sum(s.length / float(torsional_stiffness(s)) for s in segments), rel=1e-10)


def test_isotropic_plies_are_the_homogeneous_tube() -> None:
    plies = ad.layup(STEEL, [0.3, -1.0, 0.7], [2e-3, 1e-3, 3e-3])
    g, ri, ro = STEEL.E / (2 * (1 + STEEL.nu)), 0.02, 0.026
    exact = g * math.pi / 2 * (ro**4 - ri**4)
    homogeneous = ad.Segment(length=1.0, inner_diameter=2 * ri, outer_diameter=2 * ro, material=STEEL)
    for segment in (ad.Segment(length=1.0, inner_diameter=2 * ri, plies=plies), homogeneous):
        assert float(torsional_stiffness(segment)) == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("layup", [(30,), (20, 70), (45, -45), (90, 45, -45, 0, 0, 45, -45, 90)])
def test_thin_walls_have_the_laminate_shear_modulus(layup: tuple[float, ...]) -> None:
    """GJ = Gxy 2 pi R^3 t as t/R goes to zero, balanced or not."""
    plies = wall(*layup, thickness=1e-6)
    t = 1e-6 * len(plies)
    a = sum(turned(p, True)[np.ix_([0, 1, 5], [0, 1, 5])] * p.thickness for p in plies)
    gxy = 1 / (np.linalg.inv(a)[2, 2] * t)
    found = float(torsional_stiffness(ad.Segment(length=1.0, inner_diameter=0.1, plies=plies)))
    assert found == pytest.approx(gxy * 2 * math.pi * (0.05 + t / 2) ** 3 * t, rel=5e-4)


def exact_torsional_stiffness(inner: float, plies: tuple[ad.Ply, ...], elements: int = 40) -> float:
    """GJ of a laminated tube with all stresses: radial displacement u(r), axial strain e and twist per length in finite elements."""
    points, weights = np.polynomial.legendre.leggauss(4)
    n = 2 * elements * len(plies) + 1
    stiffness = np.zeros((n + 2, n + 2))
    edge, node = inner / 2, 0
    for ply in plies:
        c = turned(ply, False)[np.ix_([0, 1, 2, 5], [0, 1, 2, 5])]  # axial, hoop, radial, shear in the wall
        h = ply.thickness / elements
        for _ in range(elements):
            for x, w in zip((1 + points) / 2, weights / 2, strict=True):
                r = edge + h * x
                b = np.zeros((4, 5))  # strains of u at three nodes, axial strain, twist
                b[0, 3], b[3, 4] = 1.0, r
                b[1, :3] = np.array([(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)]) / r
                b[2, :3] = np.array([4 * x - 3, 4 - 8 * x, 4 * x - 1]) / h
                where = [node, node + 1, node + 2, n, n + 1]
                stiffness[np.ix_(where, where)] += 2 * math.pi * r * w * h * b.T @ c @ b
            edge, node = edge + h, node + 2
    free = stiffness[:-1, :-1]
    return float(stiffness[-1, -1] - stiffness[-1, :-1] @ np.linalg.solve(free, stiffness[:-1, -1]))


@pytest.mark.parametrize(
    ("inner", "layup", "tolerance"),
    [
        (0.074, (90, 45, -45, 0, 0, 45, -45, 90), 1e-3),
        (0.074, (45, -45, 45, -45), 1e-3),
        (0.074, (30, 30, 30, 30), 1e-2),
        (0.02, (20, 70, -30, 0, 50, 90), 3e-2),
    ],
)
def test_torsional_stiffness_against_elasticity(inner: float, layup: tuple[float, ...], tolerance: float) -> None:
    """Against the solution that gives every radius its own radial and hoop strain."""
    plies = wall(*layup)
    exact = exact_torsional_stiffness(inner, plies)
    found = float(torsional_stiffness(ad.Segment(length=1.0, inner_diameter=inner, plies=plies)))
    print(f"{layup}, inner diameter {inner}: {found / exact - 1:+.2e} of {exact:.5g} N m^2")
    assert found == pytest.approx(exact, rel=tolerance)


# --- mass, strain, speed, losses -------------------------------------------------------------------------------------


def test_mass_of_the_thesis_rotor() -> None:
    """pi/4 0.1^2 m^2 of 1578 kg/m^3 over 1.2 m, and three disks of 45.947 kg."""
    shaft = 1578 * math.pi / 4 * 0.1**2 * 1.2
    assert float(rotor_mass(ad.load("thesis-tuned"))) == pytest.approx(shaft + 3 * 45.947, rel=1e-12)


def test_mass_is_that_of_the_mass_matrix() -> None:
    """The rigid translation of the model."""
    machine = isotropic_machine()
    mass = dense(ad.system(machine).plant.M)
    rigid = np.zeros(len(mass))
    rigid[0::2] = 1.0
    assert float(rotor_mass(machine)) == pytest.approx(float((rigid @ mass @ rigid).real), rel=1e-12)


def test_thin_steel_ring() -> None:
    """rho R^2 w^2/E, whether the wall is given by diameters or by plies."""
    expected = STEEL.density * 0.1**2 * SPEED**2 / STEEL.E
    tubes = (
        ad.Segment(length=0.5, inner_diameter=0.199, outer_diameter=0.2, material=STEEL),
        ad.Segment(length=0.5, inner_diameter=0.199, plies=ad.layup(STEEL, [0.4, 1.2], [2e-4, 3e-4])),
    )
    machine = ad.replace(rod(), {"rotor.shaft": ad.Shaft(segments=tubes, shear_correction=0.5)})
    assert [float(e) for e in hoop_strain(machine, SPEED)] == pytest.approx([expected] * 2, rel=1e-12)


def test_hoop_strain_of_a_laminate() -> None:
    """Hoop modulus from numpy's inverse of the membrane stiffness; density weighted with the thickness."""
    glass = ad.Orthotropic(E1=45e9, E2=14e9, G12=5.5e9, G13=5.2e9, G23=5.1e9, nu12=0.28, density=2000)
    plies = (*wall(90, 20, thickness=2e-3), *ad.layup(glass, [math.radians(65)], 1e-3))
    a = sum(turned(p, True)[np.ix_([0, 1, 5], [0, 1, 5])] * p.thickness for p in plies)
    modulus = 1 / (np.linalg.inv(a)[1, 1] * 5e-3)
    assert float(hoop_modulus(plies)) == pytest.approx(modulus, rel=1e-12)
    assert float(hoop_modulus(wall(90))) == pytest.approx(CARBON.E1, rel=1e-12)
    tube = ad.Segment(length=0.5, inner_diameter=0.08, plies=plies)
    machine = ad.replace(rod(), {"rotor.shaft": ad.Shaft(segments=(tube,), shear_correction=0.5)})
    density = (4 * 1578 + 1 * 2000) / 5
    (strain,) = hoop_strain(machine, SPEED)
    assert float(strain) == pytest.approx(density * 0.045**2 * SPEED**2 / modulus, rel=1e-12)


def test_surface_speed() -> None:
    machine = isotropic_machine()
    disks = machine.rotor.disks
    named = ad.replace(machine, {f"rotor.disks[{i}].name": n for i, n in enumerate(("hub", "wheel", "sleeve"))})
    assert [float(v) for v in surface_speed(named, SPEED)] == pytest.approx([0.13 * SPEED, 0.1 * SPEED])
    assert surface_speed(named, SPEED, ["sleeve"]) == [disks[2].outer_diameter / 2 * SPEED]
    with pytest.raises(ad.ModelError, match="no disk of this machine is called 'wheels'"):
        surface_speed(named, SPEED, ["wheels"])
    with pytest.raises(ad.ModelError, match="'hub' needs its outer_diameter"):
        surface_speed(named, SPEED, ["hub"])


def with_coils() -> ad.Machine:
    """Both magnets by their geometry, with resistances and link voltages; unbalance on the disks."""
    machine = isotropic_machine()
    first = machine.magnets[0]
    second = ad.replace(first, {"position": 0.68, "sensor": "right", "bias_current": 3.0, "resistance": 0.4})
    second = ad.replace(second, {"controller": machine.magnets[1].controller, "leakage_inductance": 1e-3})
    return ad.replace(machine, {"magnets": (ad.replace(first, {"resistance": 0.25}), second)})


def test_copper_loss() -> None:
    assert float(copper_loss(with_coils())) == pytest.approx(4 * (0.25 * 2.5**2 + 0.4 * 3.0**2), rel=1e-12)
    for missing in ("resistance", "bias_current"):
        magnet = ad.Magnet(
            position=0.1, current_stiffness=50.0, negative_stiffness=1e5, resistance=0.3, bias_current=2.0
        )
        machine = ad.replace(rod(), {"magnets": (ad.replace(magnet, {missing: None}),)})
        with pytest.raises(ad.ModelError, match="needs the resistance and the bias current"):
            copper_loss(machine)
    assert copper_loss(rod()) == 0.0


def test_voltage_is_the_rate_of_the_flux_linkage() -> None:
    """L di/dt + k_u dy/dt from differences of N phi = mu0 N^2 Ag i/(2 (g0 - y)), and the ohmic drop."""
    magnet = ad.replace(with_coils().magnets[1], {"leakage_inductance": 0.0})
    n, area, gap, bias = magnet.turns, magnet.pole_area, magnet.gap, magnet.bias_current

    def linkage(current: float, y: float) -> float:
        return magnetics.MU0 * n**2 * area * current / (2.0 * (gap - y))

    di, dy = 1e-4 * bias, 1e-4 * gap
    coil = (linkage(bias + di, 0) - linkage(bias - di, 0)) / (2 * di)
    motion = (linkage(bias, dy) - linkage(bias, -dy)) / (2 * dy)
    assert float(magnetics.inductance(magnet)) == pytest.approx(coil, rel=1e-7)
    assert float(magnetics.back_emf_constant(magnet)) == pytest.approx(motion, rel=1e-7)
    w, i, y = 1200.0, 0.7, 2e-5
    expected = w * (coil * i + motion * y) + 0.4 * (bias + i)
    assert float(magnetics.voltage(magnet, w, i, y)) == pytest.approx(expected, rel=1e-7)
    bare = ad.replace(magnet, {"resistance": None})
    assert float(magnetics.voltage(bare, w, i)) == pytest.approx(w * coil * i, rel=1e-7)
    with pytest.raises(ad.ModelError, match="voltage that motion induces needs turns"):
        magnetics.back_emf_constant(isotropic_machine().magnets[1])


def test_findings_compare_the_voltage_with_the_link() -> None:
    """The finding's peak is that of the formula, evaluated from the response by hand."""
    machine = ad.replace(with_coils(), {"magnets[1].link_voltage": 1e-3})
    (found,) = [f.text for f in findings(machine) if f.topic == "voltage"]
    said = float(found.split("need up to ")[1].split(" V")[0])
    where = float(found.split("unbalance at ")[1].split(" rpm")[0]) * math.pi / 30
    response = ad.unbalance_response(machine, [where])
    magnet = machine.magnets[1]
    current = float(response.peak_currents[0, 1])
    motion = float(np.abs(response.at(0.68)[0]).max())  # circular orbits
    back = magnetics.current_stiffness(magnet) / (2 * math.cos(magnet.half_angle))
    inductance = magnetics.MU0 * 160**2 * 5e-4 / (2 * 5e-4) + 1e-3
    expected = where * (inductance * current + back * motion) + 0.4 * (3.0 + current)
    assert said == pytest.approx(float(expected), rel=0.02)  # said in three digits


# --- derivatives ------------------------------------------------------------------------------------------------------


def results(machine: ad.Machine, mesh: Any) -> Any:
    """Everything at once, as a CasADi column; torsion as strain and kinetic energy of an arbitrary twist."""
    K, J = torsion(machine, mesh)
    x = ca.DM([math.sin(1.0 + 0.7 * k) for k in range(mesh.nodes)])
    coils = [magnetics.voltage(m, SPEED, 0.3, 2e-5) for m in machine.magnets]
    return ca.vertcat(
        rotor_mass(machine),
        copper_loss(machine),
        *hoop_strain(machine, SPEED),
        *surface_speed(machine, SPEED),
        *coils,
        ca.bilin(K, x, x),
        ca.bilin(J, x, x),
    )


def fourth_order(f: Callable[[float], np.ndarray], x: float, h: float) -> np.ndarray:
    return np.asarray((8.0 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12.0 * h))


def test_symbols_numbers_and_derivatives() -> None:
    """All numbers free at once: the same values, and exact gradients against differences of fourth order."""
    machine = with_coils()
    mesh = plan(machine)
    free = list(movable(machine, mesh))
    free += [f"magnets[{i}].{n}" for i in (0, 1) for n in ("resistance", "leakage_inductance")]
    free = [n for n in dict.fromkeys(free) if isinstance(value(machine, n), float | int)]
    p = ca.SX.sym("p", len(free))
    nominal = np.array([float(value(machine, n)) for n in free])
    symbols = ad.replace(machine, {n: p[k] for k, n in enumerate(free)})
    expression = results(symbols, mesh)
    function = ca.Function("f", [p], [expression])
    values, jacobian = function(nominal).full().ravel(), ca.Function("j", [p], [ca.jacobian(expression, p)])
    expected = dense_real(results(machine, mesh)).ravel()
    assert values == pytest.approx(expected, rel=1e-12)

    exact = jacobian(nominal).full()
    gap = min(b.position - a.position for a, b in itertools.pairwise(mesh.stations))
    worst, where = 0.0, ""
    for k, path in enumerate(free):
        unit = np.eye(len(free))[k]
        h = 2e-3 * abs(nominal[k]) or 1e-6
        if path.endswith(
            (".position", ".length")
        ):  # the model changes on the scale of the distance to the next station
            h = 5e-3 * gap
        difference = fourth_order(lambda t, e=unit: function(nominal + t * e).full().ravel(), 0.0, h)
        # of results that hardly depend on a number the differences hold nothing but rounding
        scale = np.maximum(np.abs(exact[:, k]), 1e-5 * np.abs(expected) / (abs(nominal[k]) or 1e-3))
        error = np.abs(difference - exact[:, k]) / scale
        assert (error <= 1e-6).all(), f"{path}: {error}"
        if error.max() > worst:
            worst, where = float(error.max()), path
    moved = int(exact.any(axis=0).sum())
    print(f"{len(free)} numbers, {moved} with effect: worst relative error {worst:.1e} ({where})")
    assert moved > 45


def test_derivative_of_the_torsional_frequency() -> None:
    """d omega^2 = x^T (dK - omega^2 dJ) x with x^T J x = 1, from the sparse CasADi matrices."""
    machine = with_coils()
    mesh = plan(machine)
    names = ("plies[0].angle", "plies[2].thickness", "rotor.disks[1].width", "rotor.shaft.segments[1].outer_diameter")
    p = ca.SX.sym("p", len(names))
    K, J = torsion(ad.replace(machine, {n: p[k] for k, n in enumerate(names)}), mesh)
    assert K.nnz() < 6 * mesh.nodes

    def first(m: ad.Machine) -> tuple[float, np.ndarray]:
        squares, vectors = sla.eigh(*(dense_real(a) for a in torsion(m, mesh)))
        return math.sqrt(squares[1]), vectors[:, 1]

    omega, x = first(machine)
    paths = [ad.find(machine, n)[0] for n in names]
    nominal = [value(machine, n) for n in paths]
    energy = ca.bilin(K, x, x) - omega**2 * ca.bilin(J, x, x)
    gradient = ca.Function("g", [p], [ca.gradient(energy, p)])(nominal).full().ravel() / (2 * omega)
    for path, v, exact in zip(paths, nominal, gradient, strict=True):
        difference = fourth_order(lambda v, path=path: np.array(first(ad.replace(machine, {path: v}))[0]), v, 0.005 * v)
        assert float(difference) == pytest.approx(exact, rel=1e-6)
