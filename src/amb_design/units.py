"""Units at the border: quantities in files become SI numbers here, and nowhere else.

Inside the package every number is in SI; angles are in radians, speeds and frequencies in rad/s.
"""

from __future__ import annotations

import math
import re
from functools import cache
from typing import Any

from .errors import SpecError

RPM = 2.0 * math.pi / 60.0
"""One revolution per minute in rad/s."""

# What may stand behind the number: unit names with small powers, joined by blanks, dots, "*" and "/". Anything more
# would let a file ask for arithmetic such as 9**9**9.
_NAME = r"\(*(?:[^\W\d]|[°%])\w*\)*(?:(?:\^|\*\*)-?\d\)*)?"
_UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/·\s]\s*{_NAME})*")

_MIL = re.compile(r"\bmils?\b")  # a thousandth of an inch here, but an angle to pint


def rpm(value: Any) -> Any:
    """Convert revolutions per minute to rad/s.

    Parameters
    ----------
    value : float or array_like
        Speed [rpm].

    Returns
    -------
    float or array_like
        Speed [rad/s].

    Examples
    --------
    >>> round(rpm(3000.0), 3)
    314.159
    """
    return value * RPM


@cache
def _registry() -> Any:
    import logging

    import pint  # imported late: only files with units in strings need it

    logging.getLogger("pint.util").setLevel(logging.ERROR)  # it reports the redefinition below
    registry: Any = pint.UnitRegistry(cache_folder=None)
    # Our frequencies are angular: "200 Hz" has to become 1256.6 rad/s, which pint alone would read as 200.
    registry.define("hertz = 2 * pi * radian / second = Hz")
    return registry


def parse_quantity(text: str, unit: str) -> float:
    """Read a number with a unit, such as ``"0.381 mm"``, into SI.

    Parameters
    ----------
    text : str
        Number, blank, unit.
    unit : str
        The SI unit of the field; ``""`` for a pure number.

    Returns
    -------
    float
        The value in `unit`.

    Raises
    ------
    SpecError
        If the text is no quantity or its unit measures something else.
    """
    wanted = f"write a number in {unit} or a string such as '1 {unit}'" if unit else "write a plain number"
    number, _, suffix = text.strip().partition(" ")
    try:
        value = float(number)
    except ValueError:
        raise SpecError("is not a number with a unit", got=text, remedy=wanted) from None
    suffix = suffix.strip()
    if not suffix:
        return value
    registry = _registry()
    target = registry.Unit(unit or "dimensionless")
    try:
        if len(suffix) > 40 or not _UNIT.fullmatch(suffix):
            raise ValueError(suffix)
        source = registry.Unit(_MIL.sub("thou", suffix))
        compatible = source.is_compatible_with(target)
        result = float(registry.Quantity(value, source).to(target).magnitude) if compatible else 0.0
    except Exception:  # pint raises many kinds for nonsense
        raise SpecError(f"has the unknown unit '{suffix[:40]}'", got=text, remedy=wanted) from None
    if not compatible:
        raise SpecError(f"has the wrong unit: {unit or 'a pure number'} is expected", got=text, remedy=wanted)
    if unit == "rad/s" and all(registry.Unit(name).dimensionality == {"[time]": 1} for name in source._units):
        # "3000 1/min" means revolutions to some and radians to pint
        raise SpecError("does not say whether revolutions or radians", got=text, remedy="write rpm, Hz or rad/s")
    return result
