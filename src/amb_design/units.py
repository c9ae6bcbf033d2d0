"""Units at the border: quantities in files become SI numbers here, and nowhere else.

Inside the package every number is in SI; angles are in radians, speeds and frequencies in rad/s.
"""

from __future__ import annotations

import math
import re
from functools import cache, lru_cache
from typing import Any

from .errors import SpecError

RPM = 2.0 * math.pi / 60.0
"""One revolution per minute in rad/s."""

# What may stand behind the number: unit names with small powers, joined by blanks, dots, "*" and "/". Anything more
# would let a file ask for arithmetic such as 9**9**9.
_NAME = r"\(*(?:sqrt\(\w+\)|√\w+|(?:[^\W\d]|[°%])\w*)\)*(?:(?:\^|\*\*)-?\d\)*)?"
_UNIT = re.compile(rf"(?:1\s*/\s*)?{_NAME}(?:\s*[*/·\s]\s*{_NAME})*")

_MIL = re.compile(r"\bmils?\b")  # a thousandth of an inch here, but an angle to pint
_ROOT = re.compile(r"sqrt\((\w+)\)|√(\w+)")  # of noise densities


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


@lru_cache(maxsize=4096)  # pint is slow, and variants of a file repeat their numbers
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
    target = registry.Unit(_spelled(unit) or "dimensionless")
    try:
        if len(suffix) > 40 or not _UNIT.fullmatch(suffix):
            raise ValueError(suffix)
        source = registry.Unit(_spelled(suffix))
        compatible = source.is_compatible_with(target)
        result = float(registry.Quantity(value, source).to(target).magnitude) if compatible else 0.0
    except Exception:  # pint raises many kinds for nonsense
        raise SpecError(f"has the unknown unit '{suffix[:40]}'", got=text, remedy=wanted) from None
    if not compatible:
        raise SpecError(f"has the wrong unit: {unit or 'a pure number'} is expected", got=text, remedy=wanted)
    if unit == "rad/s" and all(registry.Unit(name).dimensionality == {"[time]": 1} for name in source._units):
        # "3000 1/min" means revolutions to some and radians to pint
        raise SpecError("does not say whether revolutions or radians", got=text, remedy="write rpm, Hz or rad/s")
    if "Hz" in unit and not any(name.endswith("hertz") for name in source._units):  # s^0.5 is per sqrt(rad/s) to pint
        raise SpecError("does not say in which band", got=text, remedy=f"write it in {unit}")
    return result


def _spelled(unit: str) -> str:
    """A unit in the words of pint."""
    return _ROOT.sub(r"((\1\2)**0.5)", _MIL.sub("thou", unit))


_SHOWN = {
    "rad/s": (2.0 * math.pi, "Hz"),
    "rad": (math.pi / 180.0, "deg"),
    "kg m": (1e-6, "g mm"),
    "m^2": (1e-4, "cm^2"),
}


def unit_shown(unit: str) -> tuple[str, float]:
    """The unit in which an SI quantity is shown, and its size in SI.

    Parameters
    ----------
    unit : str
        SI unit.
    """
    size, name = _SHOWN.get(unit, (1.0, unit))
    return name, size


def in_words(value: float, unit: str, *, speed: bool = False) -> str:
    """An SI number as an engineer reads it.

    Parameters
    ----------
    value : float
    unit : str
        SI unit.
    speed : bool
        True if rad/s measures a spin speed, which is shown in rpm; other frequencies are shown in Hz.

    Examples
    --------
    >>> in_words(rpm(9000.0), "rad/s", speed=True), in_words(0.000381, "m")
    ('9000 rpm', '0.381 mm')
    """
    if unit == "rad/s" and speed:
        return f"{value / RPM:.0f} rpm"
    name, factor = unit_shown(unit)
    if unit == "m" and abs(value) < 0.02:
        factor, name = 1e-3, "mm"
    return f"{plain(value / factor)} {name}".strip()


def plain(value: float, digits: int = 4) -> str:
    """A number with a few significant digits, without an exponent below a million.

    Parameters
    ----------
    value : float
    digits : int
        Significant digits; below a million all digits before the point are written.

    Examples
    --------
    >>> plain(40000.0), plain(1.75e7), plain(0.123456)
    ('40000', '1.75e+07', '0.1235')
    """
    return f"{value:.0f}" if 10.0**digits <= abs(value) < 1e6 else f"{value:.{digits}g}"
