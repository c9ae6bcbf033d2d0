"""The reference of the public names: each page lists those of some modules, and none may be missing."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

import amb_design
from amb_design.spec.fields import Spec
from amb_design.spec.reference import field_rows

LOGGER = logging.getLogger(__name__)


def public_names() -> list[str]:
    """All names of the package itself, those that load late included."""
    return sorted({*amb_design.__all__, *amb_design._LATE} - {"__version__"}, key=str.lower)


class Stage(SphinxDirective):
    """The public names that are defined in the given modules: ``spec.shaft spec.disk analysis``."""

    required_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        prefixes = tuple(f"amb_design.{module}." for module in self.arguments[0].split())
        names = [n for n in public_names() if f"{getattr(amb_design, n).__module__}.".startswith(prefixes)]
        if not names:
            raise self.error(f"no public name is defined in {self.arguments[0]}")
        written = self.env.metadata.setdefault(self.env.docname, {})
        written["names"] = " ".join([*written.get("names", "").split(), *names])
        return self.parse_text_to_nodes(_directives("amb_design", names))


class Module(SphinxDirective):
    """The public functions and classes of one module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        name = self.arguments[0]
        module = importlib.import_module(name)
        names = getattr(module, "__all__", None) or [
            n for n, made in vars(module).items() if not n.startswith("_") and _is_own(made, name)
        ]
        return self.parse_text_to_nodes(_directives(name, names))


def _is_own(made: Any, module: str) -> bool:
    return (inspect.isfunction(made) or inspect.isclass(made)) and made.__module__ == module


def _directives(module: str, names: list[str]) -> str:
    found = {name: getattr(importlib.import_module(module), name) for name in names}
    blocks = [f".. currentmodule:: {module}"]
    for name, made in found.items():
        if inspect.isclass(made) and issubclass(made, Exception):
            blocks.append(f".. autoexception:: {name}")
        elif inspect.isclass(made):
            fields = dataclasses.fields(made) if dataclasses.is_dataclass(made) else ()
            hidden = ", ".join(["check", *(f.name for f in fields)])  # told in the description already
            told = [f"   :exclude-members: {hidden}"] if fields else []
            blocks.append("\n".join([f".. autoclass:: {name}", "   :members:", *told]))
        else:
            blocks.append(f".. autofunction:: {name}")
    return "\n\n".join(["```{eval-rst}", *blocks, "```", ""])


def fields_of_spec(app: Sphinx, what: str, name: str, made: Any, options: Any, lines: list[str]) -> None:
    """Add a table of the fields to the description of a specification class."""
    if what == "class" and issubclass(made, Spec):
        lines += ["", ".. list-table::", "   :header-rows: 1", "   :widths: auto", ""]
        rows = [(f"``{field}``", *rest) for field, *rest in field_rows(made)]
        for first, *rest in [("field", "unit", "range", "default", "meaning"), *rows]:
            lines += [f"   * - {first}", *(f"     - {cell.replace('`', '``')}" for cell in rest)]
        lines.append("")


def without_fields(app: Sphinx, what: str, name: str, made: Any, options: Any, arguments: Any, returns: Any) -> Any:
    """Classes whose fields are tabulated, or that nobody makes by hand, are shown without a signature."""
    if what == "class" and dataclasses.is_dataclass(made) and "Parameters\n" not in (made.__doc__ or ""):
        return "", None
    return None


def complete(app: Sphinx, env: Any) -> None:
    """Warn of public names that no page describes."""
    told = {name for page in env.metadata.values() for name in page.get("names", "").split()}
    for name in set(public_names()) - told:
        LOGGER.warning("amb_design.%s is on no page of the reference", name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect with Sphinx."""
    app.add_directive("stage", Stage)
    app.add_directive("public-module", Module)
    app.connect("autodoc-process-docstring", fields_of_spec)
    app.connect("autodoc-process-signature", without_fields)
    app.connect("env-check-consistency", complete)
    return {"parallel_read_safe": True}
