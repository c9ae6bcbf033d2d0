"""Results as pictures: each function takes a result and returns the axes it drew on; nothing is computed here."""

from .base import save, style
from .campbell_diagram import campbell
from .damping import damping_ratios, real_part
from .loops import open_loop, sensitivity, sensitivity_over_speed
from .machine_drawing import machine
from .shapes import mode_shape, mode_shapes
from .unbalance_response import currents, unbalance

__all__ = [
    "campbell",
    "currents",
    "damping_ratios",
    "machine",
    "mode_shape",
    "mode_shapes",
    "open_loop",
    "real_part",
    "save",
    "sensitivity",
    "sensitivity_over_speed",
    "style",
    "unbalance",
]
