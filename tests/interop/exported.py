"""Machines whose controllers are exported."""

from __future__ import annotations

import amb_design as ad
from synthesis.levitated import lqg, small

LAWS = ("PID", "LQG")
SPEED = 250.0
"""Spin speed [rad/s] that gains are taken at."""


def machine_with(law: str) -> ad.Machine:
    """A PID for each axis, or one regulator with observer that couples all axes and follows the speed; shaken by unbalance and weight."""
    if law == "PID":
        changes = {"rotor.shaft.elements": 4, "rotor.disks.unbalance": 2e-5, "operation.gravity": 0.5}
        return ad.replace(ad.load("thesis-tuned"), changes)
    machine = small(lqg(scheduled=True, modes=3))
    return ad.replace(machine, {"rotor.disks.unbalance": 5e-5, "operation.gravity": 0.5})
