"""Where results go: an output folder that is written whole or not at all, and standard output."""

from __future__ import annotations

import datetime
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from ..errors import SpecError


def check_folder(out: Path | None) -> None:
    """Refuse a place where no folder can be, before anything is computed."""
    if out is not None and out.exists() and not out.is_dir():
        raise SpecError("is a file", field="--out", got=str(out), remedy="name a folder")
    if out is not None and not out.resolve().parent.is_dir():
        parent = str(out.resolve().parent)
        raise SpecError("does not exist", field="--out", got=parent, remedy="create the parent folder first")


@contextmanager
def staging(out: Path | None) -> Iterator[Path | None]:
    """A temporary folder whose content moves to `out` only if all went well."""
    if out is None:
        yield None
        return
    try:
        with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.resolve().parent) as temporary:
            folder = Path(temporary)
            yield folder
            for file in sorted(p for p in folder.rglob("*") if p.is_file()):
                target = out / file.relative_to(folder)
                target.parent.mkdir(parents=True, exist_ok=True)
                os.replace(file, target)
    except OSError as error:
        raise SpecError(
            f"cannot be written ({error.strerror or error})", field="--out", got=str(out), remedy="name another folder"
        ) from None


def formats(svg: bool) -> tuple[str, ...]:
    """Formats of figures."""
    return ("png", "svg") if svg else ("png",)


def write_json(file: Path, document: dict[str, Any]) -> None:
    """Write a document as the standard output has it."""
    file.write_text(_json(document) + "\n", encoding="utf-8")


def write_page(folder: Path, page: Any) -> None:
    """Write a report."""
    from ..report.render import html

    (folder / "report.html").write_text(html(page), encoding="utf-8")


def provenance(file: Path | None = None) -> dict[str, str]:
    """The file that was read, with its fingerprint, and the command line."""
    from ..report.provenance import fingerprint

    read = {} if file is None else {"Input": f"{file}, SHA-256 {fingerprint(file.read_bytes())}"}
    return {**read, "Command": " ".join(["amb-design", *sys.argv[1:]])}


def today() -> str:
    """The day that a report tells; the only place where the clock is read for a result."""
    return datetime.date.today().isoformat()


def nested(documents: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """One document: the machine's own keys, and those of its variants under ``variants``."""
    out = dict(documents.get("", {}))
    variants = {name: d for name, d in documents.items() if name}
    if variants:
        out["variants"] = variants
    return out


def print_result(as_json: bool, document: dict[str, Any], table: Callable[[], None]) -> None:
    """Print a document, or tables that say the same."""
    if as_json:
        typer.echo(_json(document))
    else:
        table()


def _json(document: dict[str, Any]) -> str:
    return json.dumps(document, indent=2, allow_nan=False)
