"""Small machines that the tests of the simulation share."""

from __future__ import annotations

import math
from typing import Any

import amb_design as ad

GRAVITY = 9.80665


def shaft(elements: int = 2, **fields: Any) -> ad.Shaft:
    """Steel, 0.6 m long and 30 mm thick."""
    steel = ad.Isotropic(E=211e9, nu=0.3, density=7860)
    segments = (ad.Segment(length=0.6, outer_diameter=0.03, material=steel),)
    return ad.Shaft(segments=segments, elements=elements, **({"viscous_damping": 1e-5} | fields))


def disks(unbalance: float = 2e-5) -> tuple[ad.Disk, ...]:
    """Off the middle, so that the gyroscopic moments count; unbalances at different angles."""
    common = {"mass": 4.0, "diametral_inertia": 0.01, "polar_inertia": 0.018}
    return (
        ad.Disk(position=0.2, unbalance=unbalance, **common),
        ad.Disk(position=0.45, unbalance=unbalance / 2.0, unbalance_phase=1.0, **common),
    )


def passive(anisotropic: bool = False, **fields: Any) -> ad.Machine:
    """On two spring-damper bearings; first critical speeds near 300 rad/s."""
    more: dict[str, Any] = {"kzz": 1.6e6, "kyz": 1e5, "kzy": 8e4, "czz": 1800.0} if anisotropic else {}
    bearings = tuple(ad.Bearing(position=x, stiffness=1e6, damping=1500.0, **more) for x in (0.0, 0.6))
    return ad.Machine(
        name="passive",
        rotor=ad.Rotor(shaft=shaft(), disks=disks()),
        bearings=fields.pop("bearings", bearings),
        operation=ad.Operation(top_speed=1000.0),
        **fields,
    )


def magnet(position: float, **fields: Any) -> ad.Magnet:
    """k_i about 111 N/A, k_s about 6.7e5 N/m; 250 N an axis at the bias of 3 A."""
    geometry = {"turns": 120.0, "pole_area": 5e-4, "half_angle": math.radians(22.5), "gap": 5e-4, "bias_current": 3.0}
    rest = {"clearance": 2.5e-4, "axes_angle": math.radians(45), "resistance": 0.3}
    return ad.Magnet(position=position, **(geometry | rest | fields))


def pid(**fields: Any) -> ad.PID:
    """Twice the negative stiffness, well damped."""
    chain = {"kp": 14000.0, "ki": 60000.0, "kd": 25.0, "low_pass": ad.LowPass(frequency=2e4)}
    return ad.PID(**(chain | {"amplifier": ad.Amplifier(bandwidth=1.5e4)} | fields))


def levitated(*, unbalance: float = 2e-5, controller: Any = None, sensors: bool = True, **fields: Any) -> ad.Machine:
    """On two magnets with integrating controllers, sensors beside one of them."""
    sensor = {"sensor": "right"} if sensors else {}
    return ad.Machine(
        name="levitated",
        rotor=ad.Rotor(shaft=shaft(), disks=disks(unbalance)),
        magnets=(magnet(0.05, **fields), magnet(0.55, **sensor, **fields)),
        sensors=(ad.Sensor(name="right", position=0.52),) if sensors else (),
        controller=controller or pid(),
        operation=ad.Operation(top_speed=1000.0),
    )


def amplitude(result: Any, position: float, turns: int = 4) -> Any:
    """Complex amplitudes (v, w) at the spin speed over the last turns, by projection on whole turns."""
    import numpy as np

    speed = result.speeds[-1]
    step = result.times[1] - result.times[0]
    count = round(turns * 2.0 * math.pi / speed / step)
    assert abs(count * step * speed / (2.0 * math.pi) - turns) < 1e-9, "outputs must divide the turn"
    wave = np.exp(-1j * result.angles[-count:])
    return 2.0 / count * wave @ result.at(position)[-count:]
