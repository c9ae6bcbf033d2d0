"""scipy.optimize: CasADi Functions as callables on arrays, with gradients."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from ..analysis.system import Array
from ..errors import ModelError

Callables = tuple[Callable[[Array], Any], Callable[[Array], Array]]


def callables(function: Any, by: str = "p", output: str | None = None, **fixed: Any) -> Callables:
    """Values and Jacobian of a Function, for ``fun`` and ``jac``.

    Parameters
    ----------
    function : casadi.Function
    by : str
        Input that varies: a column.
    output : str, optional
        Which output; the first if left out.
    **fixed : float or array_like
        Values of the other inputs; every one must be given.

    Returns
    -------
    fun : callable
        From an array of shape (n,) to a float, or to an array of shape (m,).
    jac : callable
        From the same to the gradient of shape (n,), or to the Jacobian of shape (m, n).

    Raises
    ------
    ModelError
        If an input is missing or does not exist: CasADi would take zero for it.

    Examples
    --------
    >>> from scipy.optimize import minimize
    >>> import amb_design as ad
    >>> from amb_design.interop.scipy import callables
    >>> loop = ad.closed_loop(ad.load("thesis-tuned"), {"controller.kd": (1e-3, 0.06)})
    >>> fun, jac = callables(loop.function("stability_limit"))
    >>> best = minimize(lambda p: -fun(p), loop.vector(), jac=lambda p: -jac(p), bounds=[(0.01, 0.06)])
    """
    names = function.name_in()
    wrong = [n for n in (by, *fixed) if n not in names]
    missing = [n for n in names if n != by and n not in fixed]
    if wrong or missing:
        raise ModelError(
            f"{function.name()} takes {', '.join(names)}; "
            + (f"there is no {wrong[0]}" if wrong else f"give a value for {', '.join(missing)}")
        )
    x = ca.MX.sym(by, *function.size_in(by))
    called = function(**{by: x}, **{n: ca.DM(v) for n, v in fixed.items()})
    value = ca.vec(called[output or function.name_out()[0]])
    both = ca.Function("both", [x], [value, ca.jacobian(value, x)])
    scalar = value.shape[0] == 1

    def fun(point: Array) -> Any:
        found = both(point)[0].full()[:, 0]
        return float(found[0]) if scalar else found

    def jac(point: Array) -> Array:
        found = both(point)[1].full()
        return np.asarray(found[0] if scalar else found)

    return fun, jac
