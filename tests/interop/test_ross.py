"""Rotors of ROSS here and ours there: equal lateral frequencies.

The first test needs no ROSS: tests/interop/friswell.toml was saved by ROSS 3.1.0.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import amb_design as ad
from amb_design.errors import SpecError
from amb_design.interop.ross import from_ross, save_ross, to_ross
from checks import within

FILE = Path(__file__).parent / "friswell.toml"
ABSENT = (
    "ROSS is not installed: 3.1.0, the first whose files these are, requires Python 3.13, with which the extra `test` brings it; "
    f"this is {sys.version_info[0]}.{sys.version_info[1]}"
)
SPEED = 4000.0 * math.pi / 30.0


def frequencies(machine: ad.Machine, count: int = 8) -> np.ndarray:
    """Lowest damped lateral frequencies [rad/s], both directions."""
    values = np.linalg.eigvals(ad.system(machine, complex_form=False).matrix(SPEED)).imag
    return np.sort(values[values > 1.0])[:count]


def lalanne() -> ad.Machine:
    """Rotor of Lalanne & Ferraris, Rotordynamics Prediction in Engineering, chapter 4: three disks, anisotropic bearings."""
    steel = ad.Isotropic(E=2e11, nu=0.3, density=7800.0)
    disks = [(0.2, 0.05, 0.12), (0.5, 0.05, 0.20), (1.0, 0.06, 0.20)]
    ring = {"inner_diameter": 0.1, "density": 7800.0}
    bearing = {"kyy": 5e7, "kzz": 7e7, "cyy": 500.0, "czz": 700.0}
    return ad.Machine(
        name="lalanne",
        operation=ad.Operation(top_speed=3000.0),
        rotor=ad.Rotor(
            shaft=ad.Shaft(segments=(ad.Segment(length=1.3, outer_diameter=0.1, material=steel),), elements=13),
            disks=tuple(ad.Disk(position=x, width=w, outer_diameter=2.0 * r, **ring) for x, w, r in disks),
        ),
        bearings=tuple(ad.Bearing(position=x, **bearing) for x in (0.0, 1.3)),
    )


def test_file_of_ross_without_ross() -> None:
    machine = from_ross(FILE)
    assert len(machine.rotor.shaft.segments) == 1
    ours = ad.load("friswell-5-9-1")
    within(frequencies(machine), frequencies(ours), 1e-3, "Friswell 5.9.1")


def test_written_file_comes_back(tmp_path: Path) -> None:
    save_ross(lalanne(), tmp_path / "rotor.toml", elements=2)
    back = from_ross(tmp_path / "rotor.toml")
    within(frequencies(back), frequencies(lalanne()), 1e-4, "Lalanne")
    assert back.bearings[0].stiffness_matrix == ((5e7, 0.0), (0.0, 7e7))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace("odr = 0.05", "odr = 0.06", 1), "tapered elements"),
        (lambda t: t.replace("kxx = [ 1000000.0,]", "kxx = [ 1e6, 2e6,]", 1), "change with the speed"),
        (lambda t: t.replace("alpha = 0.0", "alpha = 0.1", 1), "damping"),
        (lambda t: t.replace("BearingElement_", "SealElement_", 1), "the entry 'SealElement_"),
        (lambda t: t + "\n[", "is no TOML file"),
    ],
)
def test_what_has_no_counterpart_is_named(tmp_path: Path, change, message: str) -> None:
    file = tmp_path / "rotor.toml"
    file.write_text(change(FILE.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(SpecError) as caught:
        from_ross(file)
    assert message in str(caught.value)


def test_machines_that_ross_cannot_hold(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="holds magnets, which ROSS does not have"):
        save_ross(ad.load("thesis-tuned"), tmp_path / "rotor.toml")
    with pytest.raises(SpecError, match="is no ROSS rotor"):
        from_ross(3)


@pytest.fixture(scope="module")
def ross() -> Any:
    return pytest.importorskip("ross", reason=ABSENT, exc_type=ImportError)


def theirs(rotor: Any, wanted: np.ndarray) -> np.ndarray:
    """Of all their frequencies the nearest to each lateral one of ours."""
    found = rotor.run_modal(SPEED, num_modes=32, sparse=False).wd
    return np.array([found[np.argmin(np.abs(found - w))] for w in wanted])


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("machine", [ad.load("friswell-5-9-1"), lalanne()], ids=["friswell", "lalanne"])
def test_round_trip_through_ross(ross: Any, machine: ad.Machine, tmp_path: Path) -> None:
    ours = frequencies(machine)
    rotor = to_ross(machine, elements=3)
    within(theirs(rotor, ours), ours, 1e-3, "to_ross")
    within(frequencies(from_ross(rotor)), ours, 1e-3, "from_ross")
    rotor.save(tmp_path / "theirs.toml")
    within(frequencies(from_ross(tmp_path / "theirs.toml")), ours, 1e-3, "their file")
    save_ross(machine, tmp_path / "ours.toml", elements=3)
    within(theirs(ross.Rotor.load(tmp_path / "ours.toml"), ours), ours, 1e-3, "our file")
