"""OpenMDAO: a CasADi Function as an explicit component with analytic partials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from ..errors import ModelError
from .late import package


def component(function: Any, initial: Mapping[str, Any] | None = None) -> Any:
    """A Function as an ExplicitComponent.

    Parameters
    ----------
    function : casadi.Function
        Its inputs and outputs become those of the component, columns as arrays of shape (n,), matrices as (rows, columns).
    initial : mapping of str to array_like, optional
        First values of inputs; zeros where left out.

    Returns
    -------
    openmdao.api.ExplicitComponent
        All partials are exact.

    Raises
    ------
    ModelError
        If an initial value is for an input that does not exist.
    SolveError
        If OpenMDAO is not installed.
    """
    om = package("openmdao.api", "openmdao")
    names, outputs, given = function.name_in(), function.name_out(), dict(initial or {})
    for name in given:
        if name not in names:
            raise ModelError(f"{function.name()} has no input {name!r}; it takes {', '.join(names)}")
    symbols = [ca.MX.sym(n, *function.size_in(n)) for n in names]
    values = function.call(symbols)
    slopes = [ca.densify(ca.jacobian(ca.vec(v.T), ca.vec(s.T))) for v in values for s in symbols]
    pairs = [(o, n) for o in outputs for n in names]
    partials = ca.Function("partials", symbols, slopes)

    class Component(om.ExplicitComponent):  # type: ignore[misc, name-defined]
        """Evaluates a CasADi Function."""

        def setup(self) -> None:
            for n in names:
                self.add_input(
                    n,
                    np.reshape(
                        np.asarray(given.get(n, np.zeros(_shape(function.size_in(n)))), float),
                        _shape(function.size_in(n)),
                    ),
                )
            for n in outputs:
                self.add_output(n, np.zeros(_shape(function.size_out(n))))
            self.declare_partials("*", "*")

        def compute(self, inputs: Any, outputs: Any, *_: Any) -> None:
            found = function.call([_matrix(inputs[n], function.size_in(n)) for n in names])
            for n, value in zip(function.name_out(), found, strict=True):
                outputs[n] = np.reshape(value.full(), _shape(function.size_out(n)))

        def compute_partials(self, inputs: Any, partials_: Any, *_: Any) -> None:
            found = partials.call([_matrix(inputs[n], function.size_in(n)) for n in names])
            for (o, n), value in zip(pairs, found, strict=True):
                partials_[o, n] = value.full()

    return Component()


def _shape(size: tuple[int, int]) -> tuple[int, ...]:
    return (size[0],) if size[1] == 1 else tuple(size)


def _matrix(value: Any, size: tuple[int, int]) -> ca.DM:
    return ca.DM(np.reshape(np.asarray(value, float), size))
