"""Results as tables of other packages: xarray, pandas, and MATLAB .mat files.

Any result of an analysis, a simulation or a design is a frozen object of arrays. Arrays that share the length of a named axis (speeds,
times, frequencies, positions) get it as their dimension.
"""

from __future__ import annotations

import dataclasses
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.system import Array
from ..errors import ModelError, SpecError
from ..spec.fields import Spec
from .late import package

AXES = ("speeds", "times", "frequencies", "positions")
"""Fields that are axes, with those of their own length behind them."""


def to_xarray(result: Any) -> Any:
    """A result as an xarray Dataset.

    Parameters
    ----------
    result : object
        Of an analysis or a simulation: `Campbell`, `UnbalanceResponse`, `Sensitivity`, `Transient`, ...

    Returns
    -------
    xarray.Dataset
        Scalars and texts are attributes.

    Raises
    ------
    ModelError
        If it holds no arrays.
    SolveError
        If xarray is not installed.
    """
    xarray = package("xarray", "xarray")
    arrays, rest = _parts(result)
    axes = {n: a for n, a in arrays.items() if n in AXES and a.ndim == 1}
    found = {n: (_dimensions(n, a, axes), a) for n, a in arrays.items() if n not in axes}
    coords = {n: ((n,), a) for n, a in axes.items()}
    return xarray.Dataset(found, coords=coords, attrs=rest)


def to_pandas(result: Any) -> Any:
    """A result as a pandas DataFrame: one row a speed, time or frequency, one column an entry of its arrays.

    Parameters
    ----------
    result : object
        As in `to_xarray`.

    Returns
    -------
    pandas.DataFrame
        Columns such as ``currents[0,1]``; complex numbers stay complex. Arrays that do not run along the first axis are left out.

    Raises
    ------
    ModelError
        If it has no such axis.
    SolveError
        If pandas is not installed.
    """
    pandas = package("pandas", "pandas")
    arrays, rest = _parts(result)
    along = next((n for n in AXES[:3] if n in arrays and arrays[n].ndim == 1), None)
    if "times" in arrays:
        along = "times"
    if along is None:
        raise ModelError(f"{type(result).__name__} has no speeds, times or frequencies to make rows of")
    rows, columns = len(arrays[along]), {}
    for name, array in arrays.items():
        if name != along and array.ndim and len(array) == rows:
            for index in np.ndindex(array.shape[1:]):
                label = f"{name}[{','.join(map(str, index))}]" if index else name
                columns[label] = array[(slice(None), *index)]
    table = pandas.DataFrame(columns, index=pandas.Index(arrays[along], name=along))
    table.attrs.update(rest)
    return table


def save_mat(result: Any, file: str | os.PathLike[str]) -> None:
    """Write a result, or a mapping of arrays, as a MATLAB file (version 5).

    Parameters
    ----------
    result : object or mapping of str to array_like
    file : path
        Its name ends in ``.mat``.

    Raises
    ------
    SpecError
        If the file is called otherwise.
    ModelError
        If there is nothing to write.
    """
    from scipy.io import savemat  # imported late: slow to load

    if Path(file).suffix != ".mat":
        raise SpecError("is no .mat file", field=str(file), remedy="name it so")
    arrays, rest = _parts(result)
    savemat(file, {_matlab(n): v for n, v in {**arrays, **rest}.items()}, oned_as="column")


def _parts(result: Any) -> tuple[dict[str, Array], dict[str, Any]]:
    """Arrays, and scalars and texts, by name."""
    arrays: dict[str, Array] = {}
    rest: dict[str, Any] = {}
    for name, value in _fields(result):
        if isinstance(value, str | bool | int | float | complex | np.number):
            rest[name] = int(value) if isinstance(value, bool) else value
        elif isinstance(value, Spec):
            rest[name] = str(getattr(value, "name", name))
        elif isinstance(value, np.ndarray) and value.dtype.kind in "biufcU":
            arrays[name] = value
        elif isinstance(value, Mapping) and all(isinstance(v, np.ndarray) for v in value.values()):
            arrays |= {f"{name}_{key}".replace(" ", "_"): v for key, v in value.items()}
    if not arrays:
        raise ModelError(f"{type(result).__name__} holds no arrays")
    return arrays, rest


def _fields(result: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(result, Mapping):
        yield from ((n, np.asarray(v) if isinstance(v, list | tuple) else v) for n, v in result.items())
    elif dataclasses.is_dataclass(result):
        yield from ((f.name, getattr(result, f.name)) for f in dataclasses.fields(result))
    else:
        raise ModelError(f"{type(result).__name__} is no result of this package")


def _dimensions(name: str, array: Array, axes: Mapping[str, Array]) -> tuple[str, ...]:
    """The first free axis of each length; the others are named after the array."""
    free = dict(axes)
    out = []
    for k, length in enumerate(array.shape):
        fits = next((n for n, a in free.items() if len(a) == length), None)
        if fits is not None:
            free.pop(fits)
        out.append(fits or f"{name}_{k}")
    return tuple(out)


def _matlab(name: str) -> str:
    return re.sub(r"\W", "_", name)[:31]
