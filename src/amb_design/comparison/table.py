"""The result of a comparison: lines by designs, as objects, as data and as text."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..analysis.stability import MARGINAL
from ..analysis.summary import limit_document
from ..errors import ModelError, SolveError
from ..spec.comparison import Conditions
from ..units import RPM
from .assessment import Assessment, UnknownError, UnstableError
from .quantities import HIGHER, LINES, Line

HZ = 2.0 * math.pi

PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""))

PREFIXED = ("m", "A", "s")

UNKNOWN, NONE_THERE = "not known", "none"
"""In place of a value: nobody has said it; there is no such thing, and a note says why."""

EMPTY = (UNKNOWN, NONE_THERE)


@dataclass(frozen=True)
class Row:
    """One line of a comparison with its values.

    Attributes
    ----------
    line : Line
    values : mapping of str to float or None
        By design, in SI units; None where nothing could be measured, infinite where nothing limits.
    remarks : mapping of str to str
        Behind the values; "unstable", "not known" or "none" in their place.
    best : tuple of str
        Designs with the better entry; empty if there is no better one.
    """

    line: Line
    values: Mapping[str, float | None]
    remarks: Mapping[str, str]
    best: tuple[str, ...]

    def cell(self, name: str) -> str:
        """A value as text, with its remark; without the mark."""
        value = self.values[name]
        if value is None:
            return self.remarks[name]
        return f"{shown(value, self.line.unit)} {self.remarks[name]}".strip()


@dataclass(frozen=True)
class ComparisonTable:
    """Result of `compare`.

    Attributes
    ----------
    name, question : str
    conditions : Conditions
        Complete.
    designs : mapping of str to Assessment
        By name, in the order given, with all responses for drawings.
    rows : tuple of Row
    notes : tuple of str
        What was chosen, what keeps the comparison from being fair, and what could not be measured.
    """

    name: str
    question: str
    conditions: Conditions
    designs: Mapping[str, Assessment] = field(repr=False)
    rows: tuple[Row, ...] = field(repr=False)
    notes: tuple[str, ...]

    @property
    def known(self) -> tuple[Row, ...]:
        """The lines of which something is known."""
        return tuple(row for row in self.rows if any(text not in EMPTY for text in row.remarks.values()))

    def __getitem__(self, key: str) -> dict[str, float | None]:
        """Values of a line by design, in SI units.

        Parameters
        ----------
        key : str
            ``"stability_limit"``.
        """
        for row in self.rows:
            if row.line.key == key:
                return dict(row.values)
        raise ModelError(
            f"the comparison has no line {key!r}; its lines are {', '.join(r.line.key for r in self.rows)}"
        )

    def __str__(self) -> str:
        """The table as text; better entries carry a star."""
        heads = ["", *self.designs]
        body = [(row, [row.line.label, *[_starred(row, name) for name in self.designs]]) for row in self.known]
        widths = [max(len(heads[k]), *(len(cells[k]) for _, cells in body)) for k in range(len(heads))]
        out, group = ["  ".join(h.ljust(w) for h, w in zip(heads, widths, strict=True)).rstrip()], ""
        for row, cells in body:
            if row.line.group != group:
                group = row.line.group
                out.append(f"{group}:")
            out.append("  ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)).rstrip())
        return "\n".join([*out, "", *self.notes])

    def document(self) -> dict[str, Any]:
        """The result as nested dicts, lists, strings and finite numbers; units are in the keys or SI."""
        return {
            "name": self.name,
            "question": self.question,
            "conditions": _conditions(self.conditions),
            "lines": [
                {
                    "measure": row.line.key,
                    "group": row.line.group,
                    "label": row.line.label,
                    "unit": SI.get(row.line.unit, row.line.unit),
                    "better": row.line.better,
                    "best": list(row.best),
                    "text": {name: row.cell(name) for name in self.designs},
                }
                for row in self.rows
            ],
            "designs": {name: self._design(a) for name, a in self.designs.items()},
            "notes": list(self.notes),
        }

    def _design(self, a: Assessment) -> dict[str, Any]:
        out: dict[str, Any] = {"machine": a.machine.name}
        for row in self.rows:
            value = row.values[a.name]
            out[row.line.key] = None if value is None or not math.isfinite(value) else value
        out["stability"] = limit_document(a.limit)
        out["modes"] = [
            {
                "frequency_hz": m["frequency"] / HZ,
                "whirl": m["whirl"],
                "kind": m["kind"],
                "least_damping_ratio": m["damping_ratio"],
                "at_rpm": m["speed"] / RPM,
            }
            for m in a.least_damping
        ]
        out["loops"] = loops_document(a)
        if self["worst_stability_limit"][a.name] is not None:
            out["corners"] = [
                {"signs": dict(c.signs), "stable_up_to_rpm": c.stable_up_to / RPM, "certified": c.limit.certified}
                for c in a.corners
            ]
        return out


SI = {"rpm": "rad/s", "dB": "", "deg": "rad", "%": ""}
"""Units of the values behind the units shown."""


def loops_document(a: Assessment) -> list[dict[str, Any]]:
    """Every loop at every speed: sensitivity and, at both ends of the range, margins.

    Parameters
    ----------
    a : Assessment
    """
    try:
        found, at_ends = a.sensitivities, {m.speed: m for m in a.margins}
    except ModelError:
        return []
    out = []
    for s in found:
        for k, peak in enumerate(s.peaks):
            entry: dict[str, Any] = {
                "loop": peak.loop,
                "speed_rpm": s.speed / RPM,
                "sensitivity_peak": peak.value,
                "peak_hz": peak.frequency / HZ,
                "zone": peak.zone,
            }
            if s.speed in at_ends:
                m = at_ends[s.speed].loops[k]
                entry |= {
                    "gain_margin": _finite(m.gain_up),
                    "gain_margin_hz": _finite(m.gain_up_at / HZ),
                    "gain_reduction_margin": _finite(1.0 / m.gain_down) if m.gain_down else None,
                    "gain_reduction_margin_hz": _finite(m.gain_down_at / HZ),
                    "phase_margin_deg": _finite(math.degrees(m.phase)),
                    "phase_margin_hz": _finite(m.phase_at / HZ),
                    "disk_margin": m.disk,
                    "disk_margin_hz": m.disk_at / HZ,
                }
            out.append(entry)
    return out


def rows_of(
    designs: Mapping[str, Assessment], tell: Callable[[str], None] = lambda text: None
) -> tuple[tuple[Row, ...], list[str]]:
    """All lines, and sentences on what could not be measured.

    Parameters
    ----------
    designs : mapping of str to Assessment
    tell : callable, optional
        Called with the name of each line before it is measured.
    """
    rows: list[Row] = []
    reasons: dict[tuple[str, str], dict[str, None]] = {}  # designs, each once, by what is told and why
    for line in LINES:
        values: dict[str, float | None] = {}
        remarks: dict[str, str] = {}
        for name, a in designs.items():
            tell(f"{line.label} of {name}")
            try:
                values[name], remarks[name] = line.value(a), line.remark(a)
            except UnstableError:
                values[name], remarks[name] = None, "unstable"
            except UnknownError:
                values[name], remarks[name] = None, UNKNOWN
            except (ModelError, SolveError) as error:
                values[name], remarks[name] = None, NONE_THERE
                reason = str(error).removeprefix(f"{a.machine.name} ")
                reasons.setdefault((line.label, reason), {})[name] = None
        buildable = {name: v for name, v in values.items() if not designs[name].is_reference}
        rows.append(Row(line, values, remarks, best(line, buildable)))
    merged: dict[tuple[str, ...], list[str]] = {}
    for (label, reason), names in reasons.items():
        merged.setdefault((reason, *names), []).append(label)
    told = [
        f"{_joined(names) if len(names) < len(designs) else 'All designs'}: no {_joined(labels)} ({reason})."
        for (reason, *names), labels in merged.items()
    ]
    unstable = [
        f"{name} is {_status(a)}: what needs a stable machine over the whole operating range is not measured."
        for name, a in designs.items()
        if not a.runs
    ]
    return tuple(rows), unstable + told


def best(line: Line, values: Mapping[str, float | None]) -> tuple[str, ...]:
    """Designs with the better entry of a line, several where they read alike; none where all do.

    Parameters
    ----------
    line : Line
    values : mapping of str to float or None
    """
    known = {name: v for name, v in values.items() if v is not None}
    if not line.better or len(values) < 2 or not known:
        return ()
    top = (max if line.better == HIGHER else min)(known.values())
    alike = tuple(n for n, v in known.items() if shown(v, line.unit) == shown(top, line.unit))
    return alike if len(alike) < len(values) else ()


def shown(value: float, unit: str) -> str:
    """A value of a line as text, in the unit that tables show.

    Parameters
    ----------
    value : float
        SI.
    unit : str
        Of the line.
    """
    if unit == "rpm":
        return f"{value / RPM:.0f} rpm"
    if not math.isfinite(value):
        return "infinite" if unit in ("A", "m", "s") else "no limit"
    if unit == "%":
        return f"{digits(100.0 * value)} %"
    if unit == "dB":
        return f"{20.0 * math.log10(value):.1f} dB"
    if unit == "deg":
        return f"{math.degrees(value):.1f} deg"
    if not unit:
        return f"{value:.0f}" if value == round(value) else digits(value)
    if unit not in PREFIXED:
        return f"{digits(value)} {unit}"
    size, prefix = next(((s, p) for s, p in reversed(PREFIXES) if abs(value) >= 0.9995 * s), PREFIXES[0])
    return f"{digits(value / size)} {prefix}{unit}"


def digits(value: float) -> str:
    """A number with three significant digits, and as many as it has before its point."""
    if not 1e-4 <= abs(value) < 1e6:  # zero among them
        return f"{value:.3g}"
    whole = math.floor(math.log10(abs(float(f"{value:.2e}"))))
    return f"{value:.{max(2 - whole, 0)}f}"


def _starred(row: Row, name: str) -> str:
    return row.cell(name) + (" *" if name in row.best else "")


def _joined(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _status(a: Assessment) -> str:
    if a.stable_up_to:
        return f"stable only up to {a.stable_up_to / RPM:.0f} rpm"
    return "only marginally stable" if a.limit.status == MARGINAL else str(a.limit.status)


def _conditions(c: Conditions) -> dict[str, Any]:
    """Conditions as data; speeds in rpm, frequencies in Hz."""
    assert c.force_step is not None
    assert c.base_shock is not None
    up_to = c.sensitivity_up_to
    return {
        "speed_rpm": float(c.speed) / RPM,
        "top_speed_rpm": float(c.top_speed) / RPM,
        "modes": c.modes,
        "sensitivity_up_to_hz": None if up_to is None else float(up_to) / HZ,
        "unbalance_kg_m": {name: list(amounts) for name, amounts in (c.unbalance or {}).items()},
        "sensor_noise_m_per_sqrt_hz": float(c.sensor_noise),
        "force_step": dataclasses.asdict(c.force_step),
        "base_shock": dataclasses.asdict(c.base_shock),
        "settled": float(c.settled),
        "tolerances": dict(c.tolerances or {}),
        "samples": c.samples,
        "seed": c.seed,
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
