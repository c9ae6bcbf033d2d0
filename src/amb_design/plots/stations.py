"""Names of what sits on the shaft, as drawings show them."""

from ..spec.parts import KINDS, stations

__all__ = ["KINDS", "stations"]
