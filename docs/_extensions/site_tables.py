"""Directives for tables that the program makes of itself: fields of files, quantities, commands."""

from __future__ import annotations

from typing import Any

import typer.main
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from amb_design.cli import app as commands
from amb_design.spec.reference import REFERENCES


class Reference(SphinxDirective):
    """Tables of `amb_design.spec.reference` by name."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        return self.parse_text_to_nodes(REFERENCES[self.arguments[0]](), allow_section_headings=True)


class Commands(SphinxDirective):
    """Every command with its arguments and options, from the command line itself."""

    def run(self) -> list[nodes.Node]:
        group: Any = typer.main.get_command(commands)
        text = "\n".join(_command(name, command) for name, command in group.commands.items())
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def _command(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option"]
    usage = " ".join(["amb-design", name, *(_shown(p) for p in arguments)])
    lines = [f"## {name}", "", f"`{usage}`", "", command.help or ""]
    rows = [(_shown(p), p) for p in arguments] + [(", ".join(p.opts), p) for p in options]
    if rows:
        lines += ["", "| argument | default | meaning |", "|---|---|---|"]
        lines += [f"| `{shown}` | {_default(p)} | {p.help} |" for shown, p in rows]
    return "\n".join([*lines, ""])


def _shown(argument: Any) -> str:
    return str(argument.metavar or argument.name.upper()) + ("..." if argument.nargs == -1 else "")


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    default = parameter.default
    return "" if default in (None, False, (), []) or callable(default) else str(default)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect with Sphinx."""
    app.add_directive("reference", Reference)
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
