"""Every wrong file is refused with one sentence that says where, what and how to mend it."""

from __future__ import annotations

import string
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from amb_design.errors import SpecError
from amb_design.spec import files
from spec.bad_files import BAD_FILES, GOOD, BadFile, write


def refusal(path: str | Path, variant: str | None = None) -> str:
    """The sentence with which a file is refused."""
    with pytest.raises(SpecError) as caught:
        files.load(path, variant)
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    assert len(message) < 1000
    return message


def test_the_unedited_file_is_good():
    machine = files.loads(GOOD)
    assert len(machine.rotor.disks) == len(machine.bearings) == len(machine.magnets) == 2
    assert files.loads(GOOD, "passive").controller is None


def test_the_table_is_long_and_has_no_doubles():
    names = [case.id for case in BAD_FILES]
    assert len(names) >= 45
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("case", BAD_FILES, ids=lambda case: case.id)
def test_refused_with_one_sentence(case: BadFile, tmp_path: Path):
    message = refusal(write(case, tmp_path))
    for fragment in case.fragments:
        assert fragment in message


def test_the_huge_file_is_not_read(tmp_path, monkeypatch):
    (case,) = (case for case in BAD_FILES if case.id == "huge")
    path = write(case, tmp_path)
    monkeypatch.setattr(Path, "read_bytes", lambda self: pytest.fail("read in spite of its size"))
    assert "50 MB" in refusal(path)


def test_unreadable(tmp_path, monkeypatch):
    def deny(self: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(self))

    path = tmp_path / "machine.toml"
    path.write_text(GOOD)
    monkeypatch.setattr(Path, "read_bytes", deny)
    message = refusal(path)
    assert str(path) in message
    assert "cannot be read (Permission denied)" in message


@pytest.mark.parametrize(
    ("variant", "old", "new", "fragments"),
    [
        ("pasive", "", "", ("no variant pasive", "`passive`")),
        ("x", GOOD[GOOD.index("[variants") :], "", ("no variant x", "none at all")),
        ("passive", "controller = false", "contoller = false", ("contoller = false", "`controller`")),
        ("passive", "controller = false", "contoller = 3", ("contoller = 3", "`controller`")),
        ("passive", "controller = false", "", ("controller has no magnet", "(variant passive)")),
        ("passive", "controller = false", 'name = "other"', ("name = 'other'", "variant", "remove the line")),
        ("passive", "controller = false", "rotor.shaft.elements = -1", ("shaft.elements = -1", "1 to 2000")),
        ("passive", "controller = false", "rotor.shaft.element = false", ("shaft.element = false", "`elements`")),
        ("passive", "[variants.passive]", "[variants]\npassive = 3\n[x]", ("variants.passive = 3", "must be a table")),
    ],
)
def test_wrong_variants(variant, old, new, fragments, tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(GOOD.replace(old, new, 1))
    message = refusal(path, variant)
    for fragment in (str(path), *fragments):
        assert fragment in message


def test_load_variants_reads_every_variant(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(GOOD + "[variants.broken]\nbearings = 3\n")
    assert files.load(path).name == "good"
    with pytest.raises(SpecError, match=r"variant broken.*bearings = 3"):
        files.load_variants(path)


# --- whatever a file holds, nothing but a SpecError comes out ------------------------------------------------------

LINES = GOOD.splitlines()
PIECES = [
    "",
    "{}",
    "[]",
    "-1",
    "0",
    "nan",
    "true",
    '"x"',
    '"1 km"',
    "[[1]]",
    "{a.b = 1}",
    '"\\u0000"',
    "1e400",
    "[",
    '"',
]
SECTIONS = [line for line in LINES if line.startswith("[")]


def _survives(text: str) -> None:
    try:
        machine = files.loads(text, file="fuzz.toml")
    except SpecError as refused:
        sentence = str(refused)
    else:
        assert files.loads(files.dumps(machine)) == machine
        return
    assert len(sentence.splitlines()) == 1


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.sampled_from(range(len(LINES))), st.sampled_from(PIECES)), min_size=1, max_size=3))
def test_values_exchanged(changes):
    lines = list(LINES)
    for i, piece in changes:
        key, equals, _ = lines[i].partition("=")
        lines[i] = key + equals + piece
    _survives("\n".join(lines))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(st.tuples(st.sampled_from(range(len(LINES))), st.sampled_from(["", *LINES])), min_size=1, max_size=4))
def test_lines_exchanged(changes):
    lines = list(LINES)
    for i, line in changes:
        lines[i] = line
    _survives("\n".join(lines))


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, len(GOOD)), st.integers(0, 40), st.text(string.printable + "äµ\0\u2028", max_size=5))
def test_characters_exchanged(start, length, text):
    _survives(GOOD[:start] + text + GOOD[start + length :])


@settings(max_examples=150, deadline=None)
@given(st.text("0123456789 .eE+-*/^()_mNskgradHz%°µ\"'", max_size=25))
@example("1 m^9^9^9^9")
@example("1 (((m)^9)^9)^9")
@example("1 " + "km " * 13)
def test_quantities(text):
    quoted = '"' + text.replace("\\", "").replace('"', "") + '"'
    _survives(GOOD.replace('"60 mm"', quoted))


def test_a_variant_cannot_name_a_folder_elsewhere(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(GOOD + '\n[variants."../esc"]\nmagnets = []\ncontroller = false\n')
    with pytest.raises(SpecError, match="is no name"):
        files.load_variants(path)
