"""C code: the sampled controllers for a processor, and the Functions of a machine with their derivatives."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import casadi as ca

from .. import __version__
from ..analysis.system import Array
from ..errors import SpecError
from ..spec.machine import Machine
from ..spec.sampling import Sampling
from .discrete import Discrete, discrete

TEMPLATE = """/* {title}
 *
 * Sampled every {period} s:  i = c x + d y,  then  x = a x + b y.
 * Made discrete {method}.
 * y: {inputs} [m]
 * i: {outputs} [A]
 * Made by amb_design {version}.
 */
#include "{name}.h"

{matrices}
void {name}_reset({name}_state *self)
{{
    int i;
    for (i = 0; i < {upper}_STATES; ++i) self->x[i] = 0;
}}

void {name}_step({name}_state *self, const {name}_real *y, {name}_real *current)
{{
    {name}_real next[{upper}_STATES + 1];
    int i, j;
    for (i = 0; i < {upper}_OUTPUTS; ++i) {{
        {name}_real sum = 0;
        for (j = 0; j < {upper}_STATES; ++j) sum += c[i * {upper}_STATES + j] * self->x[j];
        for (j = 0; j < {upper}_INPUTS; ++j) sum += d[i * {upper}_INPUTS + j] * y[j];
        current[i] = sum;
    }}
    for (i = 0; i < {upper}_STATES; ++i) {{
        {name}_real sum = 0;
        for (j = 0; j < {upper}_STATES; ++j) sum += a[i * {upper}_STATES + j] * self->x[j];
        for (j = 0; j < {upper}_INPUTS; ++j) sum += b[i * {upper}_INPUTS + j] * y[j];
        next[i] = sum;
    }}
    for (i = 0; i < {upper}_STATES; ++i) self->x[i] = next[i];
}}
"""

HEADER = """/* {title}
 * Call {name}_reset once, then {name}_step every {period} s. No memory is allocated; states belong to the caller.
 */
#ifndef {upper}_H
#define {upper}_H

#ifndef {upper}_REAL
#define {upper}_REAL double
#endif
typedef {upper}_REAL {name}_real;

#define {upper}_STATES {states}
#define {upper}_INPUTS {n_in}
#define {upper}_OUTPUTS {n_out}
#define {upper}_PERIOD {period}

typedef struct {{ {name}_real x[{upper}_STATES + 1]; }} {name}_state;

void {name}_reset({name}_state *self);
void {name}_step({name}_state *self, const {name}_real *y, {name}_real *current);

#endif
"""

METHODS = {"tustin": "by the trapezoidal rule (Tustin)", "hold": "exactly for inputs that are held between samples"}


def controller_code(
    machine: Machine,
    folder: str | os.PathLike[str],
    sampling: Sampling,
    speed: float = 0.0,
    name: str = "controller",
) -> tuple[Path, Path]:
    """Write the sampled controllers of a machine as ANSI C.

    Parameters
    ----------
    machine : Machine
    folder : path
        Where ``name.c`` and ``name.h`` go; it must exist.
    sampling : Sampling
        As in `discrete`: period and method.
    speed : float
        Spin speed [rad/s], for gains that follow it.
    name : str
        Of files and functions.

    Returns
    -------
    source, header : Path

    Raises
    ------
    ModelError
        As in `discrete`.
    SpecError
        If the name is none for a C function.
    """
    if not re.fullmatch(r"[A-Za-z]\w*", name):
        raise SpecError("is no name for a C function", field="name", got=name, remedy="use letters and digits")
    law = discrete(machine, sampling, speed)
    known = {
        "title": f"Controllers of {machine.name} at {speed:g} rad/s".replace("*/", ""),
        "name": name,
        "upper": name.upper(),
        "period": f"{float(sampling.period):.15g}",
        "method": METHODS[sampling.method],
        "states": len(law.a),
        "n_in": len(law.inputs),
        "n_out": len(law.outputs),
        "inputs": ", ".join(law.inputs),
        "outputs": ", ".join(law.outputs),
        "version": __version__,
        "matrices": _matrices(law, name),
    }
    out = []
    for suffix, template in (("c", TEMPLATE), ("h", HEADER)):
        out.append(Path(folder) / f"{name}.{suffix}")
        out[-1].write_text(template.format(**known), encoding="utf-8")
    return out[0], out[1]


def _matrices(law: Discrete, name: str) -> str:
    return "\n".join(_array(f"static const {name}_real {k}", getattr(law, k)) for k in "abcd")


def _array(declared: str, matrix: Array) -> str:
    rows = [", ".join(repr(float(x)) for x in row) for row in matrix] if matrix.size else ["0"]
    return f"{declared}[{max(matrix.size, 1)}] = {{\n    " + ",\n    ".join(rows) + "\n};\n"


def function_code(functions: Sequence[Any], folder: str | os.PathLike[str], name: str = "model") -> Path:
    """Write CasADi Functions and their Jacobians as C.

    Parameters
    ----------
    functions : sequence of casadi.Function
        Expressions, such as ``loop.function("rhs", modes=8)``; of each, the Jacobians of all outputs with respect to all inputs are
        written too, as ``jac_`` followed by its name.
    folder : path
        Where ``name.c`` and ``name.h`` go; it must exist.
    name : str

    Returns
    -------
    Path
        The source. It compiles by itself (``cc -O2 -shared -fPIC``), and `casadi.external` loads it.
    """
    generator = ca.CodeGenerator(f"{name}.c", {"with_header": True})
    for f in functions:
        generator.add(f)
        generator.add(f.jacobian())
    generator.generate(f"{Path(folder).resolve()}{os.sep}")
    return Path(folder) / f"{name}.c"
