"""Random machines: composite and steel shafts, isotropic and anisotropic bearings, with and without controlled magnets.

Everything sits at a few common stations, so that the meshes stay small. The ranges are wide enough for machines that
are unstable at rest, unstable above some speed, and stable throughout.
"""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

import amb_design as ad
from amb_design.spec.shaft import PLY_LAWS, THEORIES

STATIONS = (0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0)


def uniform(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers between two bounds."""
    return st.floats(low, high, allow_subnormal=False)


def spread(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers between two positive bounds, equally likely in each decade."""
    return uniform(math.log10(low), math.log10(high)).map(lambda x: float(10.0**x))


@st.composite
def orthotropic(draw: st.DrawFn) -> ad.Orthotropic:
    """Carbon, glass or boron plies."""
    e1, e2 = draw(uniform(4e10, 2.2e11)), draw(uniform(7e9, 2.4e10))
    g = e2 * draw(uniform(0.3, 0.6))
    return ad.Orthotropic(
        E1=e1,
        E2=e2,
        nu12=draw(uniform(0.2, 0.36)),
        G12=g,
        G13=g,
        G23=e2 * draw(uniform(0.32, 0.45)),  # keeps nu23 admissible
        density=draw(uniform(1400.0, 2100.0)),
    )


@st.composite
def isotropic(draw: st.DrawFn) -> ad.Isotropic:
    """Steel or a light metal."""
    return ad.Isotropic(E=draw(uniform(7e10, 2.1e11)), nu=draw(uniform(0.2, 0.35)), density=draw(uniform(2700, 7900)))


@st.composite
def plies(draw: st.DrawFn) -> tuple[ad.Ply, ...]:
    """One to four plies at any angle."""
    material = draw(orthotropic())
    count = draw(st.integers(1, 4))
    angle, thickness = uniform(-math.pi / 2.0, math.pi / 2.0), uniform(1e-3, 6e-3)
    return ad.layup(material, [draw(angle) for _ in range(count)], [draw(thickness) for _ in range(count)])


@st.composite
def segments(draw: st.DrawFn, length: float, composite: bool) -> ad.Segment:
    """A piece of shaft, no thinner than a hundredth of the longest: below that, rounding alone moves onsets by 1e-5."""
    if composite:
        return ad.Segment(length=length, inner_diameter=draw(st.sampled_from([0.02, 0.04, 0.06])), plies=draw(plies()))
    inner = draw(st.sampled_from([0.0, 0.02, 0.04]))
    return ad.Segment(
        length=length,
        inner_diameter=inner,
        outer_diameter=inner + draw(uniform(0.015, 0.05)),
        material=draw(isotropic()),
    )


@st.composite
def shafts(draw: st.DrawFn, elements: int = 3, **fields: Any) -> ad.Shaft:
    """One or two segments; two of them meet at a station."""
    length = draw(uniform(0.4, 1.5))
    composite = draw(st.booleans())
    parts = draw(st.sampled_from([(1.0,), (1.0 / 3.0, 2.0 / 3.0)]))
    chosen = {
        "segments": tuple(draw(segments(length * part, composite)) for part in parts),
        "shear_correction": draw(uniform(0.45, 0.9)) if composite else "cowper",
        "viscous_damping": draw(spread(1e-5, 3e-4)),
        "hysteretic_damping": draw(st.one_of(st.just(0.0), spread(1e-6, 1e-3))),
        "external_damping": draw(st.one_of(st.just(0.0), uniform(0.0, 20.0))),
        "theory": draw(st.sampled_from(THEORIES)),
        "ply_law": draw(st.sampled_from(PLY_LAWS)),
        "elements": elements,
    }
    return ad.Shaft(**(chosen | fields))


@st.composite
def disks(draw: st.DrawFn, position: float) -> ad.Disk:
    """A disk anywhere between a flat plate and a long cylinder."""
    mass, radius = draw(uniform(0.5, 20.0)), draw(uniform(0.05, 0.2))
    diametral = mass * radius**2 / 4.0 * draw(uniform(1.0, 2.0))
    return ad.Disk(
        position=position, mass=mass, diametral_inertia=diametral, polar_inertia=2.0 * diametral * draw(uniform(0.2, 1))
    )


@st.composite
def bearings(draw: st.DrawFn, position: float, anisotropic: bool) -> ad.Bearing:
    """Springs and dampers, with skew cross-coupling; in the anisotropic case with eight coefficients."""
    k, c = draw(spread(1e6, 1e8)), draw(spread(10.0, 1e3))
    cross = k * draw(st.one_of(st.just(0.0), uniform(-0.002, 0.002)))
    if not anisotropic:
        return ad.Bearing(position=position, stiffness=k, damping=c, kyz=cross, kzy=-cross)
    return ad.Bearing(
        position=position,
        stiffness=k,
        kzz=k * draw(uniform(0.5, 2.0)),
        kyz=cross,
        kzy=-cross * draw(uniform(0.0, 1.0)),
        damping=c,
        czz=c * draw(uniform(0.5, 2.0)),
        cyz=0.05 * c,
    )


@st.composite
def magnets(draw: st.DrawFn, position: float) -> ad.Magnet:
    """By coefficients or by geometry."""
    angle = draw(st.sampled_from([0.0, math.pi / 4.0]))
    if draw(st.booleans()):
        return ad.Magnet(
            position=position,
            current_stiffness=draw(uniform(30.0, 300.0)),
            negative_stiffness=draw(spread(3e4, 3e6)),
            axes_angle=angle,
        )
    return ad.Magnet(
        position=position,
        turns=draw(uniform(80.0, 300.0)),
        pole_area=draw(uniform(1e-4, 1e-3)),
        gap=draw(uniform(3e-4, 8e-4)),
        bias_current=draw(uniform(0.5, 4.0)),
        half_angle=draw(uniform(0.0, 0.5)),
        axes_angle=angle,
    )


@st.composite
def controllers(draw: st.DrawFn) -> ad.PID:
    """PID in A/m with any of the filters; some of these make a machine unstable."""
    kp = draw(spread(3e3, 6e4))
    return ad.PID(
        kp=kp,
        ki=draw(st.one_of(st.just(0.0), uniform(0.1, 5.0).map(lambda r: r * kp))),
        kd=kp * draw(spread(1e-4, 1e-2)),
        derivative_time=draw(st.sampled_from([0.0, 5e-5])),
        low_pass=draw(st.one_of(st.none(), spread(3e3, 3e4).map(lambda w: ad.LowPass(frequency=w)))),
        notches=draw(st.sampled_from([(), (ad.Notch(frequency=1500.0, damping=0.2, width=0.7),)])),
        delay=draw(st.sampled_from([0.0, 5e-5])),
        amplifier=draw(st.one_of(st.none(), spread(5e3, 5e4).map(lambda w: ad.Amplifier(bandwidth=w)))),
    )


@st.composite
def machines(draw: st.DrawFn, anisotropic: bool | None = None, controlled: bool | None = None) -> ad.Machine:
    """A whole machine on bearings, perhaps with one or two controlled magnets."""
    uneven = draw(st.booleans()) if anisotropic is None else anisotropic
    magnetic = draw(st.booleans()) if controlled is None else controlled
    shaft = draw(shafts())
    length = float(shaft.length)
    places = [x * length for x in STATIONS]
    heavy = draw(st.lists(st.sampled_from(places), min_size=0, max_size=2, unique=True))
    pulled = draw(st.lists(st.sampled_from(places), min_size=1, max_size=2, unique=True)) if magnetic else []
    return ad.Machine(
        name="random",
        rotor=ad.Rotor(shaft=shaft, disks=tuple(draw(disks(x)) for x in sorted(heavy))),
        bearings=tuple(draw(bearings(x, uneven)) for x in (places[0], places[-1])),
        magnets=tuple(draw(magnets(x)) for x in sorted(pulled)),
        controller=draw(controllers()) if magnetic else None,
        operation=ad.Operation(top_speed=draw(spread(1500.0, 6000.0))),
    )
