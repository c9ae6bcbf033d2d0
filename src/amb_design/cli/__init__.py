"""Command line: thin commands, each one API call, in one module each.

Results go to standard output, progress and errors to standard error. Exit status 0 is success, 2 bad input, 3 a
solution that did not arrive.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated, NoReturn

import numpy as np
import typer

from .. import __version__
from ..errors import AmbDesignError, SolveError
from ..threads import one_thread
from . import analyse, check, compare, export, init, optimise, problems, prove, simulate

app = typer.Typer(
    name="amb-design",
    help="Flexible composite rotors on active magnetic bearings: analysis and design.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _version(show: bool) -> None:
    if show:
        typer.echo(f"amb-design {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and stop")
    ] = False,
) -> None:
    """Flexible composite rotors on active magnetic bearings: analysis and design."""


app.command("list")(problems.list_problems)
app.command("init")(init.init)
app.command("check")(check.check)
app.command("analyse")(analyse.analyse)
app.command("optimise")(optimise.optimise)
app.command("simulate")(simulate.simulate)
app.command("compare")(compare.compare)
app.command("prove")(prove.prove)
app.command("check-proof")(prove.check_saved_proof)
app.command("export")(export.export)


def main() -> NoReturn:
    """Entry point: run a command and turn errors into one sentence and an exit status."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # for worker processes, which have yet to load these libraries
    try:
        one_thread(app)()
    except AmbDesignError as error:
        typer.echo(f"amb-design: {error}", err=True)
        sys.exit(3 if isinstance(error, SolveError) else 2)
    except (ArithmeticError, RuntimeError, np.linalg.LinAlgError) as error:  # a solver met numbers it cannot bear
        typer.echo(f"amb-design: the solution failed: {error}; check the machine for extreme numbers", err=True)
        sys.exit(3)
    except BrokenPipeError:  # the reader of our output has gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    sys.exit(0)
