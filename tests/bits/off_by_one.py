"""Another machine's libraries: functions of math and numpy whose results are off in the last bit.

IEEE 754 leaves the last bits of these open; C libraries, numpy's vector code and BLAS kernels
differ in them. `disturb` moves every result of theirs by one unit in the last place, up or down, so
that whatever rests on such bits shows. `sum` of floats, plain up to Python 3.11 and compensated
from 3.12 on, is exact here.
"""

from __future__ import annotations

import builtins
import functools
import itertools
import math
import random
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

SCALAR = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh"),
    *("acosh", "atanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "pow", "cbrt"),
    *("hypot", "dist", "gamma", "lgamma", "erf", "erfc"),
)
ARRAY = (
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "tanh"),
    *("arcsinh", "arccosh", "arctanh", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p"),
    *("power", "float_power", "cbrt", "hypot", "logaddexp", "sum", "mean", "prod", "cumsum"),
    *("var", "std", "average", "dot", "vdot", "inner", "outer", "matmul", "einsum", "tensordot"),
    *("trapezoid", "interp", "polyfit", "polyval", "convolve", "cross", "sinc"),
)
LINALG = ("solve", "inv", "pinv", "lstsq", "norm", "det", "qr", "svd", "eigh", "eigvalsh", "eig")


def _moved(x: Any, up: bool) -> Any:
    """Floats, alone or in arrays and tuples, one unit in the last place away."""
    if type(x) is float:
        return math.nextafter(x, math.inf if up else -math.inf)
    if isinstance(x, (np.ndarray, np.floating)) and np.asarray(x).dtype.kind == "f":
        return np.nextafter(x, np.inf if up else -np.inf)
    return type(x)(_moved(y, up) for y in x) if type(x) is tuple else x


def _wrapped(function: Callable[..., Any], directions: Iterator[bool]) -> Callable[..., Any]:
    @functools.wraps(function)
    def off(*args: Any, **options: Any) -> Any:
        return _moved(function(*args, **options), next(directions))

    return off


def _exact_sum(terms: Iterable[Any], /, start: Any = 0) -> Any:
    terms = list(terms)
    if terms and all(type(x) is float and math.isfinite(x) for x in terms):
        return start + math.fsum(terms)
    return _SUM(terms, start)


_SUM = sum


def disturb() -> None:
    """Replace the functions, for all that is imported from now on."""
    directions = itertools.cycle((True, False, False, True, True, True, False))
    for module, names in ((math, SCALAR), (np, ARRAY), (np.linalg, LINALG)):
        for name in names:
            if hasattr(module, name):
                setattr(module, name, _wrapped(getattr(module, name), directions))
    for name in ("sin", "cos", "log", "exp", "acos"):  # imported long ago, by names of its own
        setattr(random, f"_{name}", getattr(math, name))
    builtins.sum = _exact_sum
    assert sum([0.1] * 10) == 1.0
    assert math.sin(1.0) != 0.8414709848078965 and np.linalg.norm([3.0, 4.0]) != 5.0
