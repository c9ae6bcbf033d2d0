"""Every public name says what it does and documents every argument, every field and every option."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from typing import Any

import pytest
import typer.main

import amb_design as ad
from amb_design import interop, plots
from amb_design.cli import app
from amb_design.spec.fields import Spec

UNDERLINE = re.compile(r"^(\w[\w ]*)\n-{3,}$", flags=re.MULTILINE)


def own(module: Any) -> Iterator[str]:
    """Public functions and classes that a module defines."""
    for name, made in vars(module).items():
        callable_ = inspect.isfunction(made) or inspect.isclass(made)
        if callable_ and not name.startswith("_") and made.__module__ == module.__name__:
            yield name


def public() -> dict[str, Any]:
    """Every public function and class by its full name."""
    found = {f"amb_design.{name}": getattr(ad, name) for name in {*ad.__all__, *ad._LATE} - {"__version__"}}
    found |= {f"amb_design.plots.{name}": getattr(plots, name) for name in plots.__all__}
    for info in pkgutil.iter_modules(interop.__path__, "amb_design.interop."):
        module = importlib.import_module(info.name)
        found |= {f"{info.name}.{name}": getattr(module, name) for name in own(module)}
    for name, made in list(found.items()):
        if inspect.isclass(made):
            found |= {
                f"{name}.{m}": f for m, f in vars(made).items() if inspect.isfunction(f) and not m.startswith("_")
            }
    return dict(sorted(found.items()))


def sections(text: str) -> dict[str, set[str]]:
    """Names that each section of a numpydoc docstring documents."""
    parts = UNDERLINE.split(inspect.cleandoc(text))
    out = {}
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        heads = [line.split(":")[0] for line in body.splitlines() if line and not line.startswith(" ")]
        out[title] = {name.strip().lstrip("*") for head in heads for name in head.split(",")}
    return out


def arguments(made: Any) -> set[str]:
    """What a function or class is called with."""
    return {name for name in inspect.signature(made).parameters if name not in ("self", "cls")}


PUBLIC = public()


@pytest.mark.parametrize("name", PUBLIC)
def test_everything_is_documented(name: str) -> None:
    made = PUBLIC[name]
    text = (made.__doc__ if inspect.isclass(made) else inspect.getdoc(made)) or ""
    first = text.strip().split("\n\n")[0]
    assert first.endswith((".", ":")), f"{name}: the summary is a sentence"
    assert not first.startswith(f"{made.__name__}("), f"{name} has no docstring of its own"
    documented = sections(text)
    if inspect.isclass(made) and issubclass(made, Spec):
        missing = {f.name for f in dataclasses.fields(made) if not f.metadata.get("doc")}
    elif inspect.isclass(made) and dataclasses.is_dataclass(made):
        fields = {f.name for f in dataclasses.fields(made) if not f.name.startswith("_")}
        missing = fields - documented.get("Attributes", set()) - documented.get("Parameters", set())
    elif inspect.isclass(made) and issubclass(made, Exception):
        missing = set()
    else:
        missing = arguments(made) - documented.get("Parameters", set())
        unknown = documented.get("Parameters", set()) - arguments(made)
        assert not unknown, f"{name} documents what it does not take: {sorted(unknown)}"
    assert not missing, f"{name} does not document {sorted(missing)}"


@pytest.mark.parametrize("name", [n for n, made in PUBLIC.items() if inspect.isclass(made)])
def test_properties_are_documented(name: str) -> None:
    bare = [
        n for n, p in vars(PUBLIC[name]).items() if isinstance(p, property) and not n.startswith("_") and not p.__doc__
    ]
    assert not bare


def test_every_option_of_every_command_has_its_help() -> None:
    group: Any = typer.main.get_command(app)
    assert len(group.commands) >= 10
    for command in group.commands.values():
        assert command.help, command.name
        for parameter in command.params:
            assert parameter.help, f"amb-design {command.name} {parameter.name}"
