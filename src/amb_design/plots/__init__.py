"""Results as pictures: each function takes a result and returns the axes it drew on; nothing is computed here."""

from .base import save, style
from .campbell_diagram import campbell
from .comparison import campbells, corners, responses, sensitivities, whirls_compared
from .damping import damping_ratios, real_part
from .design import convergence, limit_sensitivities, pareto, real_parts
from .loops import open_loop, sensitivity, sensitivity_over_speed
from .machine_drawing import machine
from .shapes import mode_shape, mode_shapes
from .transient import envelope, history, orbits, waterfall
from .unbalance_response import currents, unbalance

__all__ = [
    "campbell",
    "campbells",
    "convergence",
    "corners",
    "currents",
    "damping_ratios",
    "envelope",
    "history",
    "limit_sensitivities",
    "machine",
    "mode_shape",
    "mode_shapes",
    "open_loop",
    "orbits",
    "pareto",
    "real_part",
    "real_parts",
    "responses",
    "save",
    "sensitivities",
    "sensitivity",
    "sensitivity_over_speed",
    "style",
    "unbalance",
    "waterfall",
    "whirls_compared",
]
