"""What a machine file describes, in short sentences and tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ..units import plain
from .parts import Table, table

Outline = Mapping[str, Any]

STRONG = 0.2
"""Damping ratios from loops above this one are beyond what a first-order estimate can say."""


def sentences(d: Outline) -> list[str]:
    """The machine in a paragraph.

    Parameters
    ----------
    d : mapping
        From `amb_design.analysis.outline.outline`.
    """
    return [*_rotor(d), *_supports(d), *_loops(d), _model(d)]


def source(d: Outline) -> str:
    """Where the numbers come from, in one line.

    Parameters
    ----------
    d : mapping
        Outline, or any mapping with a ``source``.
    """
    s = d["source"]
    return ", ".join(str(s[k]) for k in ("author", "title", "year", "where") if s.get(k))


def tables(d: Outline) -> list[Table]:
    """The machine in tables, empty ones left out.

    Parameters
    ----------
    d : mapping
        From `amb_design.analysis.outline.outline`.
    """
    all_of = (_segments(d), _disks(d), _bearings(d), _magnets(d), _stiffness(d), _modes(d), _chain(d))
    return [t for t in all_of if t.rows]


def _rotor(d: Outline) -> Iterator[str]:
    text = (
        f"The rotor is {d['length_m']:.4g} m long and has {d['mass_kg']:.4g} kg: the shaft {d['shaft_mass_kg']:.4g} kg"
    )
    if count := len(d["disk_masses_kg"]):
        text += f", {_number(count, 'disk')} {sum(d['disk_masses_kg']):.4g} kg"
    yield text + "."
    modes = d["rotor_modes"]
    if modes:
        on = "On its passive supports alone it has its first modes" if d["supported"] else "Free, it bends"
        frequencies = [f"{m['frequency_hz']:.4g}" for m in modes]
        yield f"{on} at {_and(frequencies)} Hz."


def _supports(d: Outline) -> Iterator[str]:
    bearings, pins, magnets = (len(d[k]) for k in ("bearings", "pins_m", "magnets"))
    passive = [_number(n, what) for n, what in ((bearings, "passive bearing"), (pins, "pin")) if n]
    if passive:
        yield f"It rests on {_and(passive)}."
    if not magnets:
        return
    known = [m for m in d["magnets"] if "capacity_n" in m]
    words = "It has" if passive else "It is carried by"
    yield f"{words} {_number(magnets, 'magnetic bearing')}."
    if known:
        pulls, loads = (_quantities([m[k] for m in known], "N") for k in ("capacity_n", "load_of_an_axis_n"))
        verb = "would be" if passive else "is"
        yield f"An axis can pull {pulls} at full modulation of its bias; its share of the weight {verb} {loads}."


def _quantities(values: Sequence[float], unit: str) -> str:
    """Equal values once, others in a row."""
    texts = list(dict.fromkeys(plain(v) for v in values))
    return f"{_and(texts)} {unit}"


def _loops(d: Outline) -> Iterator[str]:
    loops = d["loops"]
    if not loops:
        return
    ratios = [
        x["stiffness_n_per_m"] / x["negative_stiffness_n_per_m"] for x in loops if x["negative_stiffness_n_per_m"]
    ]
    if ratios:
        low, high = min(ratios), max(ratios)
        size = f"{low:.3g}" if high < low * 1.005 else f"{low:.3g} to {high:.3g}"
        yield f"Its loops are {size} times as stiff as the magnets' negative stiffness; above 1 they levitate the rotor."
    lowest = loops[0]["at_modes"][0] if loops[0]["at_modes"] else None
    if lowest:
        phases = [x["at_modes"][0]["phase_deg"] for x in loops]
        size = f"{phases[0]:+.3g}" if max(phases) - min(phases) < 0.05 else f"{min(phases):+.3g} to {max(phases):+.3g}"
        yield f"At {lowest['frequency_hz']:.4g} Hz, the first of these modes, the controller's phase is {size} degrees; positive is damping."


def _model(d: Outline) -> str:
    form = "complex, since y and z are alike" if d["form"] == "complex" else "real, since y and z differ"
    service = f" The service speed is {d['service_speed_rpm']:.6g} rpm." if d["service_speed_rpm"] else ""
    return (
        f"The model has {d['elements']} elements and {d['states']} states ({form}); analyses look up to {d['top_speed_rpm']:.6g} "
        f"rpm.{service}"
    )


def _segments(d: Outline) -> Table:
    coupled = any(s["bend_twist_coupling_nm"] for s in d["segments"])
    rows = []
    for i, s in enumerate(d["segments"]):
        inner = f" / {_mm(s['inner_diameter_m'])}" if s["inner_diameter_m"] else ""
        rows.append(
            [
                str(i),
                f"{s['start_m']:.4g} to {s['start_m'] + s['length_m']:.4g}",
                _mm(s["outer_diameter_m"]) + inner,
                f"{s['mass_kg']:.4g}",
                f"{s['bending_stiffness_nm2']:.4g}",
                f"{s['shear_stiffness_n']:.4g}",
                *([f"{s['bend_twist_coupling_nm']:.3g}"] if coupled else []),
                _plies(s["plies_deg"]),
            ]
        )
    columns = ["", "from, to [m]", "diameter [mm]", "mass [kg]", "bending [N m²]", "shear [N]"]
    return (
        table(
            "Shaft",
            "lrrrrr" + "r" * coupled + "l",
            [*columns, *(["coupling [N m]"] if coupled else []), "plies, inside out [deg]"],
            rows,
        )
        if any(s["plies_deg"] for s in d["segments"])
        else table("Shaft", "lrrrrr", columns, [r[:6] for r in rows])
    )


def _disks(d: Outline) -> Table:
    return table(
        "Disks",
        "llrrrrr",
        ("", "name", "at [m]", "mass [kg]", "diametral [kg m²]", "polar [kg m²]", "unbalance [g mm]"),
        [
            [
                str(i),
                x["name"],
                f"{x['position_m']:.4g}",
                f"{x['mass_kg']:.4g}",
                f"{x['diametral_inertia_kgm2']:.4g}",
                f"{x['polar_inertia_kgm2']:.4g}",
                plain(1e6 * x["unbalance_kgm"]),
            ]
            for i, x in enumerate(d["disks"])
        ],
    )


def _bearings(d: Outline) -> Table:
    rows = []
    for i, b in enumerate(d["bearings"]):
        (kyy, kyz), (kzy, kzz) = b["stiffness_n_per_m"]
        (cyy, cyz), (czy, czz) = b["damping_ns_per_m"]
        rows.append(
            [str(i), b["name"], f"{b['position_m']:.4g}", _matrix(kyy, kzz, kyz, kzy), _matrix(cyy, czz, cyz, czy)]
        )
    rows += [["", "pin", f"{x:.4g}", "rigid", ""] for x in d["pins_m"]]
    return table("Passive bearings", "llrll", ("", "name", "at [m]", "stiffness [N/m]", "damping [N s/m]"), rows)


def _matrix(yy: float, zz: float, yz: float, zy: float) -> str:
    text = f"{yy:.4g}" if yy == zz else f"{yy:.4g} in y, {zz:.4g} in z"
    return text + (f", cross {yz:.4g} and {zy:.4g}" if yz or zy else "")


def _magnets(d: Outline) -> Table:
    rows = []
    for i, m in enumerate(d["magnets"]):
        sensor = m["sensor_position_m"]
        capacity = m.get("capacity_n")
        share = "" if capacity is None else plain(100.0 * m["load_of_an_axis_n"] / capacity, 3)
        flux = m.get("bias_flux_density_t")
        rows.append(
            [
                str(i),
                m["name"],
                f"{m['position_m']:.4g}",
                "at the magnet" if sensor == m["position_m"] else f"{sensor:.4g}",
                f"{m['current_stiffness_n_per_a']:.4g}",
                f"{m['negative_stiffness_n_per_m']:.4g}",
                "unknown" if capacity is None else f"{capacity:.4g}",
                f"{m['load_of_an_axis_n']:.4g}",
                share,
                "" if flux is None else f"{flux:.3g}",
            ]
        )
    columns = (
        "",
        "name",
        "at [m]",
        "sensor [m]",
        "k_i [N/A]",
        "k_s [N/m]",
        "can pull [N]",
        "weight [N]",
        "used [%]",
        "bias [T]",
    )
    note = "Forces are those of an axis; the weight is what it would carry if the magnets alone bore the rotor."
    return table("Magnetic bearings", "llrrrrrrrr", columns, rows, note)


def _stiffness(d: Outline) -> Table:
    rows = _grouped(
        [
            (
                x["loop"],
                [
                    str(x["states"]),
                    f"{x['stiffness_n_per_m']:.4g}",
                    f"{x['negative_stiffness_n_per_m']:.4g}",
                    f"{x['net_stiffness_n_per_m']:.4g}",
                    "yes" if x["integral_action"] else "no",
                ],
            )
            for x in d["loops"]
        ]
    )
    columns = ("loop", "states", "loop [N/m]", "magnet [N/m]", "net [N/m]", "integral action")
    note = "Stiffness at 1 Hz, where filters do not matter yet; integral action stiffens the loop below that."
    return table("Loops at rest: stiffness", "lrrrrl", columns, rows, note)


def _modes(d: Outline) -> Table:
    rows = []
    for k, mode in enumerate(d["rotor_modes"]):
        zeta = mode.get("damping_ratio_from_loops")
        told = "" if zeta is None else "strong" if abs(zeta) > STRONG else f"{100.0 * zeta:+.2g} %"
        first = [f"{mode['frequency_hz']:.4g}", f"{100.0 * mode['own_damping_ratio']:.2g} %", told]
        loops = _groups(
            [
                (x["loop"], [plain(m["gain_a_per_m"]), f"{m['phase_deg']:+.1f}", plain(m["damping_ns_per_m"])])
                for x in d["loops"]
                for m in x["at_modes"][k : k + 1]
            ]
        )
        for names, texts in loops or [("", ["", "", ""])]:
            rows.append([*first, names, *texts])
            first = ["", "", ""]
    columns = ("mode [Hz]", "own damping", "from loops", "loop", "gain [A/m]", "phase [deg]", "damping [N s/m]")
    note = (
        "Modes of the rotor without its magnets; damping ratios in per cent of critical and to first order: from material and passive "
        "bearings, and from all loops, which depends on the mode's shape at magnets and sensors. A positive phase damps at the magnet."
    )
    if d["loops"]:
        return table("First modes at rest, and what the loops do to them", "rrrlrrr", columns, rows, note)
    return table("First modes at rest", "rr", columns[:2], [r[:2] for r in rows])


def _chain(d: Outline) -> Table:
    rows = []
    for names, blocks in _groups_of_chains(d["loops"]):
        for b in blocks:
            rows.append([names, b["block"], b["value"], plain(b["gain"]), f"{b['phase_deg']:+.1f}"])
            names = ""
    hz = d["rotor_modes"][0]["frequency_hz"] if d["rotor_modes"] else 0.0
    return table(f"Chain at {hz:.4g} Hz, the first mode", "lllrr", ("loop", "block", "at", "gain", "phase [deg]"), rows)


def _groups_of_chains(loops: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    seen: list[tuple[list[str], Any]] = []
    for x in loops:
        if not x["chain"]:
            continue
        same = next((names for names, chain in seen if chain == x["chain"]), None)
        if same is None:
            seen.append(([x["loop"]], x["chain"]))
        else:
            same.append(x["loop"])
    for names, chain in seen:
        yield _names(names), chain


def _grouped(rows: list[tuple[str, list[str]]]) -> list[list[str]]:
    """Rows of loops that are alike, under their common names."""
    return [[names, *texts] for names, texts in _groups(rows)]


def _groups(rows: list[tuple[str, list[str]]]) -> list[tuple[str, list[str]]]:
    groups: dict[tuple[str, ...], list[str]] = {}
    for name, texts in rows:
        groups.setdefault(tuple(texts), []).append(name)
    return [(_names(names), list(alike)) for alike, names in groups.items()]


def _names(names: list[str]) -> str:
    return ", ".join(names)


def _plies(angles: Sequence[float]) -> str:
    return ", ".join(f"{a:g}" for a in angles)


def _mm(length: float) -> str:
    return f"{1e3 * length:.4g}"


def _number(count: int, what: str) -> str:
    words = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
    return f"{words[count] if count < len(words) else count} {what}{'' if count == 1 else 's'}"


def _and(texts: Sequence[str]) -> str:
    return texts[0] if len(texts) == 1 else f"{', '.join(texts[:-1])} and {texts[-1]}"
