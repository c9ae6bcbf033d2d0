"""A machine that has every kind of number: nothing in it is symmetric along the shaft, every derivative is sizeable."""

from __future__ import annotations

import math

import amb_design as ad


def isotropic_machine() -> ad.Machine:
    """Alike in y and z, so that the complex form holds; stable at rest, unstable above some speed."""
    carbon = ad.Orthotropic(E1=139e9, E2=11e9, G12=6.05e9, G13=5.5e9, G23=3.78e9, nu12=0.313, density=1578)
    glass = ad.Orthotropic(E1=45e9, E2=14e9, G12=5.5e9, G13=5.2e9, G23=5.1e9, nu12=0.28, density=2000)
    steel = ad.Isotropic(E=205e9, nu=0.29, density=7850)
    titanium = ad.Isotropic(E=114e9, G=43e9, density=4430)
    wall = (
        ad.Ply(material=carbon, angle=math.radians(35), thickness=6e-3),
        ad.Ply(material=glass, angle=math.radians(-65), thickness=5e-3),
        ad.Ply(material=carbon, angle=math.radians(12), thickness=7e-3),
    )
    chain = ad.PID(
        sensor_gain=8000.0,
        low_pass=ad.LowPass(frequency=9000.0, damping=0.75),
        total_gain=1.1,
        kp=2.6,
        ki=60.0,
        kd=1.2e-3,
        derivative_time=8e-5,
        notches=(ad.Notch(frequency=5200.0, damping=0.35, width=0.8),),
        delay=4e-5,
        amplifier=ad.Amplifier(gain=0.9, bandwidth=14000.0, damping=0.65),
    )
    return ad.Machine(
        name="everything",
        rotor=ad.Rotor(
            shaft=ad.Shaft(
                segments=(
                    ad.Segment(length=0.35, inner_diameter=0.025, plies=wall),
                    ad.Segment(length=0.25, inner_diameter=0.02, outer_diameter=0.058, material=steel),
                    ad.Segment(
                        length=0.3,
                        outer_diameter=0.052,
                        material=titanium,
                        viscous_damping=9e-5,
                        hysteretic_damping=8e-4,
                    ),
                ),
                shear_correction=0.6,
                viscous_damping=7e-5,
                hysteretic_damping=5e-4,
                external_damping=40.0,
                elements=6,
            ),
            disks=(
                ad.Disk(position=0.22, mass=6.0, diametral_inertia=0.03, polar_inertia=0.045),
                ad.Disk(position=0.52, inner_diameter=0.058, outer_diameter=0.26, width=0.035, density=7800.0),
                ad.Disk(position=0.9, inner_diameter=0.052, outer_diameter=0.2, width=0.03, mass=5.0, unbalance=1e-4),
            ),
        ),
        bearings=(
            ad.Bearing(position=0.0, stiffness=9e6, damping=250.0, kyz=2e5, kzy=-2e5, cyz=60.0, czy=-60.0),
            ad.Bearing(position=0.78, stiffness=1.2e7, damping=200.0),
        ),
        magnets=(
            ad.Magnet(
                position=0.12,
                turns=160.0,
                pole_area=5e-4,
                half_angle=math.radians(22.5),
                gap=5e-4,
                bias_current=2.5,
                axes_angle=math.radians(45),
                sensor="left",
            ),
            ad.Magnet(
                position=0.68,
                current_stiffness=110.0,
                negative_stiffness=6e5,
                sensor="right",
                controller=ad.PID(
                    kp=2.0e4,
                    ki=3e5,
                    kd=12.0,
                    low_pass=ad.LowPass(frequency=8000.0),
                    amplifier=ad.Amplifier(bandwidth=12000.0),
                ),
            ),
        ),
        sensors=(ad.Sensor(name="left", position=0.15), ad.Sensor(name="right", position=0.65)),
        controller=chain,
        operation=ad.Operation(top_speed=3000.0),
    )


def anisotropic_machine() -> ad.Machine:
    """The same with supports that differ in y and z, another controller in z and turned magnets: real form only."""
    machine = isotropic_machine()
    assert machine.controller is not None
    return ad.replace(
        machine,
        {
            "name": "everything, anisotropic",
            "controller_z": ad.replace(machine.controller, {"kp": 2.2, "kd": 1.0e-3, "low_pass.frequency": 8000.0}),
            "magnets[1].axes_angle": math.radians(25),
            "bearings": (
                ad.Bearing(
                    position=0.0,
                    stiffness=8e6,
                    damping=250.0,
                    kyy=9e6,
                    kyz=3e5,
                    kzy=-1e5,
                    kzz=1.2e7,
                    cyy=200.0,
                    cyz=40.0,
                    czy=-70.0,
                    czz=300.0,
                ),
                ad.Bearing(position=0.78, stiffness=1.2e7, kzz=1.0e7, damping=200.0, czz=170.0),
            ),
        },
    )
