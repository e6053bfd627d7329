"""Operations for estimators: the same code runs on float64 arrays and on the tracer.

On numpy arrays each function computes in float64, element by element; on traced values
(`model.lowering.trace.Scalar`) it is recorded. On plain numbers its result is correctly rounded
(`model.words.rounded`): such constants become part of a program, and must be the same on every
machine; those of ``math`` and numpy are not. Besides these functions use ``+ - * /``, unary minus
and the comparisons ``< > <= >=`` whose results combine with ``& | ^ ~ == !=``.

`OPERATIONS` has a record for each kind of expression. To add a function, write it here with its
record, and its expansion for words as a method of `model.lowering.graph.Graph`.

The range of a divisor must not contain zero nor span more than 2^22. A word that cannot normalise
so much (W < 32) counts a divisor below 2^-(W - 1 - guard) of its full scale as that.

Angles in half turns (suffix ``_ht``): 1 = pi rad, wrapped to [-1, 1).
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from typing import Any

import numpy as np

from boresight.model.errors import author_line, require
from boresight.model.lowering.trace import Condition, Scalar, refusing
from boresight.model.units import same_unit
from boresight.model.words.rounded import PRECISE

__all__ = [
    "absolute",
    "asin_ht",
    "atan2_ht",
    "bounded",
    "clip",
    "exp",
    "flip",
    "inverse",
    "log",
    "maximum",
    "minimum",
    "named",
    "rsqrt",
    "saturated",
    "sincos_ht",
    "solve",
    "sqrt",
    "tanh",
    "where",
    "wrap_ht",
    "wrap_turns",
]


def __getattr__(name: str) -> Any:
    """Refuse an unknown operation, and name those that are spelt like it."""
    near = " or ".join(get_close_matches(name, __all__, cutoff=0.4)) or "docs/operations.md"
    raise AttributeError(f"ops has no {name}: try {near}; np.sin and np.cos take rad")


def _plain(*numbers: Any) -> bool:
    return all(type(x) in (int, float) for x in numbers)


def _each(function: Callable[..., Any], *args: Any) -> Any:
    """A function of the elements of arrays, which may be traced; None: all are numbers."""
    if any(type(x) is np.ndarray and x.dtype.hasobject for x in args):
        objects = [np.asarray(arg, dtype=object) for arg in args]
        return np.frompyfunc(function, len(args), 1)(*objects)
    return None


def _call(kind: str, *numbers: Any, data: tuple[Any, ...] = ()) -> Any:
    """Record a function if one of its arguments is traced, else compute it."""
    if (each := _each(partial(_call, kind, data=data), *numbers)) is not None:
        return each
    tracer = next((x.tracer for x in numbers if isinstance(x, Scalar)), None)
    if tracer is not None:
        return tracer.new(kind, *map(tracer.lift, numbers), data=data)
    operation = OPERATIONS[kind]
    if operation.precise is not None and _plain(*numbers):
        return float(operation.precise(*numbers, *data))
    return operation.numpy(*numbers, *data)


#: A bound that is reached exactly, with room for rounding.
_ABOVE = 1.0 + 2.0**-10
#: Units of angles other than half turns: what makes half turns of them, and a full turn.
ANGLES = {
    **dict.fromkeys(("rad", "radian", "radians"), ("x / math.pi", 2.0 * math.pi)),
    **dict.fromkeys(("deg", "degree", "degrees"), ("x / 180.0", 360.0)),
    **dict.fromkeys(("turn", "turns"), ("2.0 * x", 1.0)),
}
#: Half a turn, in units that half turns are multiplied by.
_HALVES = (("rad", math.pi), ("deg", 180.0))
#: Kinds of expressions whose unit is that of their arguments.
_SAME_UNIT = ("named", "same", "bounded", "neg", "absolute", "clip", "saturated", "flip", "select")


def unit_of(x: Any) -> tuple[str, float]:
    """Unit of a recorded value, and the width of the range that was declared with it.

    A sum has the unit of its first term with one. Empty and 0 if the unit is unknown.
    """
    return next(iter(units_of(x)), ("", 0.0))


def units_of(x: Any, depth: int = 6) -> list[tuple[str, float]]:
    """Known units of the terms of a recorded value, to some depth; with widths of their ranges."""
    if not isinstance(x, Scalar) or not depth:
        return []
    if x.number in x.tracer.units:
        return [x.tracer.units[x.number]]
    if x.kind in ("wrap", "atan2"):
        return [("ht", 2.0)]
    if x.kind == "leaf":
        return [(str(x.data[4]), x.data[3] - x.data[2])] if x.data[4] else []
    if x.kind == "mul" and x.args[0].kind in ("wrap", "atan2") and x.args[1].kind == "const":
        factor = x.args[1].data[0]
        unit = next((u for u, half in _HALVES if math.isclose(factor, half, rel_tol=1e-6)), "")
        return [(unit, 0.0)] if unit else []
    terms = x.args if x.kind in ("add", "sub", *_SAME_UNIT) else ()
    return [pair for arg in terms for pair in units_of(arg, depth - 1)]


def _check_half_turns(x: Any) -> None:
    unit, _ = unit_of(x)
    made, _ = ANGLES.get(unit, ("", 0.0))
    fix = f"write {made}, or declare the angle in ht" if made else "give it an angle"
    angle = not unit or same_unit(unit, "ht")
    require(angle, author_line, "an angle in half turns", unit, fix)


def _is_traced(condition: Any) -> bool:
    """Whether a condition is recorded; raises for a number, such as ~ of a Python bool."""
    if isinstance(condition, Scalar) or (type(condition) is int and condition not in (0, 1)):
        fix = "compare it with something; ~ of a Python bool is a number: write not for it"
        require(False, author_line, "a condition such as x > 0.5", condition, fix)
    return isinstance(condition, Condition)


def named(name: str, x: Any) -> Any:
    """Return ``x`` under a name, which reports and messages show."""
    return x.tracer.new("named", x, data=(name,)) if isinstance(x, Scalar) else x


def bounded(x: Any, low: float, high: float, reason: str, *, unless: str = "") -> Any:
    """Return ``x``, declared to lie in [low, high] for ``reason``.

    The fixed-point value takes its format from this range, and saturates (with the sticky flag)
    outside it. Floats are returned unchanged.

    InputError: the range is not finite, or not ordered.

    Parameters
    ----------
    unless : str
        Situation in which the value may leave the range; its word then saturates and raises the
        flag. It changes no bit of the program.
    """
    finite = -math.inf < low <= high < math.inf
    require(finite, author_line, "a range that is finite and ordered", (low, high))
    return _call("bounded", x, data=(low, high, reason, *([unless] if unless else [])))


def where(condition: Any, yes: Any, no: Any) -> Any:
    """``yes`` if the condition holds, else ``no``."""
    if (each := _each(where, condition, yes, no)) is not None:
        return each
    if _is_traced(condition):
        lift = condition.tracer.lift
        return condition.tracer.new("select", condition, lift(yes), lift(no))
    if type(condition) is bool and _plain(yes, no):
        return yes if condition else no
    return np.where(condition, yes, no)


def saturated(x: Any, limit: float) -> Any:
    """``x`` clamped to [-limit, limit], a power of two: costs nothing in fixed point.

    InputError: the limit is not a power of two.
    """
    power = math.frexp(limit)[0] == 0.5
    require(power, author_line, "a power of two as limit", limit, "use ops.clip for any other")
    return _call("saturated", x, data=(limit,))


def flip(condition: Any, x: Any) -> Any:
    """-x if the condition holds, else ``x``."""
    if _is_traced(condition):
        return condition.tracer.new("flip", condition, condition.tracer.lift(x))
    if type(condition) is bool and _plain(x):
        return -x if condition else x
    return np.where(condition, -x, x)


def absolute(x: Any) -> Any:
    """|x|."""
    return _call("absolute", x)


def minimum(a: Any, b: Any) -> Any:
    """The smaller of two."""
    return _call("smaller", a, b)


def maximum(a: Any, b: Any) -> Any:
    """The larger of two. With a constant c > 0, ``maximum(x, c)`` is a valid divisor."""
    return _call("larger", a, b)


def clip(x: Any, low: Any, high: Any) -> Any:
    """``x`` limited to [low, high] (exactly, by comparison).

    Limits are numbers, or values that vary: then ``maximum(minimum(x, high), low)``.
    InputError: the limits are numbers in the wrong order, or not finite.
    """
    varies = any(isinstance(limit, Scalar) for limit in (low, high))
    if varies or not (isinstance(x, Scalar) or _plain(low, high)):
        return maximum(minimum(x, high), low)
    require(low <= high, author_line, "limits of ops.clip in order", (low, high))
    fix = "write ops.maximum or ops.minimum for one limit"
    finite = -math.inf < low and high < math.inf
    require(finite, author_line, "finite limits of ops.clip", (low, high), fix)
    return _call("clip", x, data=(low, high))


def wrap_ht(x: Any) -> Any:
    """``x`` half turns wrapped to [-1, 1). Exact in fixed point; InputError of another unit."""
    _check_half_turns(x)
    return _call("wrap", x)


def wrap_turns(x: Any) -> Any:
    """``x`` turns wrapped to [-1/2, 1/2), exact in fixed point.

    An output of unit ``turn`` is shown in [0, 1): the same word, read as an unsigned number.
    """
    return _call("wrap_turns", x)


def sincos_ht(x: Any) -> tuple[Any, Any]:
    """sin(pi x), cos(pi x) of ``x`` half turns; InputError of another known unit."""
    _check_half_turns(x)
    return _call("sin", x), _call("cos", x)


def rsqrt(x: Any) -> Any:
    """1 / sqrt(x) of x >= 0.

    In fixed point, arguments below 2^-22 of the full scale (W = 32) are replaced by that value.
    Multiply the result before you store it, so that its exponent stays free.
    """
    return _call("rsqrt", x)


def sqrt(x: Any) -> Any:
    """Square root of x >= 0.

    In fixed point x * rsqrt(x), which is too small below the smallest argument of `rsqrt`.
    """
    return _call("sqrt", x)


def exp(x: Any) -> Any:
    """e^x of x up to 44.

    In fixed point, results below the range's largest value times 2^-31 are computed as that limit.
    """
    return _call("exp", x)


def log(x: Any) -> Any:
    """Natural logarithm of x > 0, whose range spans at most 2^31."""
    return _call("log", x)


def tanh(x: Any) -> Any:
    """Hyperbolic tangent; (1 + tanh(x / 2)) / 2 is the logistic function."""
    return _call("tanh", x)


def asin_ht(x: Any) -> Any:
    """Angle in half turns whose sine is ``x`` in [0, 0.7188)."""
    return _call("asin", x)


def atan2_ht(y: Any, x: Any) -> Any:
    """Angle of the vector (x, y) in half turns, [-1, 1); 0 for the zero vector.

    InputError when compiled if the ranges of x and y differ by more than 2^22 in words of 32 bits,
    2^12 in words of 18.
    """
    return _call("atan2", y, x)


def inverse(matrix: Any, least: float | None = None) -> Any:
    """Inverse (n, n) of a symmetric positive definite matrix; see `solve`.

    If S >= diag(r), an element is at most 1 / sqrt(r_i r_j).
    """
    s = np.asarray(matrix, dtype=object)
    result = solve(s, np.eye(len(s)), least)
    r = [_interval(s[i, i])[0] if least is None else least for i in range(len(s))]
    for i, j in np.ndindex(s.shape):
        if isinstance(result[i, j], Scalar):
            edge = _ABOVE / math.sqrt(r[i] * r[j])
            low = 0.0 if i == j else -edge
            result[i, j] = bounded(result[i, j], low, edge, "inverse of a covariance")
    return result


def solve(matrix: Any, right: Any, least: float | None = None) -> Any:
    """X of ``matrix`` X = ``right``, of a symmetric positive definite matrix.

    By Cholesky's factor, S = L L^T, L U = B, L^T X = U, with inverse roots as factors, whose
    exponents stay free. For S = H P H^T + R, as in K^T = S^-1 H P, no pivot is below the variance
    in R.

    InputError: the matrix is not square, the sizes differ, or no least pivot above 0 is known.

    Parameters
    ----------
    matrix : (n, n)
        Only the lower triangle is read.
    right : (n,) or (n, m)
    least : float, optional
        Smallest eigenvalue, which `check` tests. By default the smallest value of each element of
        the diagonal, as for the sum of a covariance and a diagonal matrix.

    Returns
    -------
    (n,) or (n, m)
        The LSB of a result follows from its largest value, right / least: bound it closer.
    """
    s, b = np.asarray(matrix, dtype=object), np.asarray(right, dtype=object)
    square = s.ndim == 2 and s.shape[0] == s.shape[1] == len(b)
    require(square, author_line, "a square matrix and as many rows at its right", s.shape)
    n, lower = len(s), np.zeros(s.shape, dtype=object)

    def claimed(x: Any, low: float, high: float, reason: str) -> Any:
        return bounded(x, low, high, reason) if isinstance(x, Scalar) else x

    u, weights = b.copy(), list[Any]()
    for i in range(n):
        low, high = _interval(s[i, i])
        pivot = low if least is None else least
        fix = "give least=, such as the smallest variance in R"
        positive = pivot > 0.0 or not isinstance(s[i, i], Scalar)
        require(positive, author_line, "a matrix whose diagonal is above 0", (low, high), fix)
        edge = math.sqrt(abs(high))
        for k in range(i):
            value = (s[i, k] - lower[i, :k] @ lower[k, :k]) * weights[k]
            lower[i, k] = claimed(value, -edge, edge, "Cholesky's factor")
        value = s[i, i] - lower[i, :i] @ lower[i, :i]
        weights.append(rsqrt(claimed(value, pivot, high, "a pivot") if i or low < pivot else value))
        u[i] = (b[i] - lower[i, :i] @ u[:i]) * weights[i]
    for i in reversed(range(n)):
        u[i] = (u[i] - lower[i + 1 :, i] @ u[i + 1 :]) * weights[i]
    return u


def _interval(x: Any) -> tuple[float, float]:
    if isinstance(x, Scalar):
        from boresight.model.lowering.graph import Intervals  # which imports this

        return Intervals(x.tracer)(x)
    return float(np.min(x)), float(np.max(x))


def _wrapped(x: Any) -> Any:
    return (x + 1.0) % 2.0 - 1.0


def _precise_angle(y: float, x: float) -> Any:
    angle = PRECISE.atan2(y, x) / PRECISE.pi if x or y else 0.0
    return angle if float(angle) < 1.0 else -1.0


def _unit_vector(y: Any, x: Any) -> tuple[Any, Any, Any]:
    """(sine, cosine) of the vector's angle, and its inverse length in half turns."""
    square = y * y + x * x
    weight, far = rsqrt(square), _interval(square)[0] > 0.0
    near = "the vector is a few LSB long, or its square has few bits"
    sine, cosine = (bounded(c * weight, -1.0, 1.0, "unit vector", unless=near) for c in (y, x))
    if far:
        return sine, cosine, weight * (1.0 / math.pi)
    # A scale without an end is no value of its own, but a factor of what limits the derivative.
    return sine * (1.0 / math.pi), cosine * (1.0 / math.pi), weight


def _angle_by_y(e: Any, y: Any, x: Any) -> Any:
    _, cosine, scale = _unit_vector(y, x)
    return cosine * scale


def _angle_by_x(e: Any, y: Any, x: Any) -> Any:
    sine, _, scale = _unit_vector(y, x)
    return -(sine * scale)


@dataclass(frozen=True)
class Operation:
    """A kind of expression, in all forms but fixed point."""

    #: Computes it from its arguments, then its data, in float64.
    numpy: Callable[..., Any]
    #: The same of plain numbers, so exact that the result, converted to a float, is correctly
    #: rounded; without it ``numpy`` is exact.
    precise: Callable[..., Any] | None = None
    #: Its text in C, with its arguments, then its data (`firmware.floating`).
    c: str = ""
    #: Derivatives by each argument: 1.0, -1.0, or computed from the expression and its arguments.
    #: Kinds without have methods of `model.kalman.slopes.Slopes`.
    slopes: tuple[Callable[..., Scalar] | float, ...] = ()


#: Kinds of expressions by name; all but leaves.
OPERATIONS = {
    "const": Operation(lambda number: number),
    "named": Operation(lambda x, name: x, slopes=(1.0,)),
    "same": Operation(lambda x, tag: x, slopes=(1.0,)),
    "bounded": Operation(lambda x, *claim: x, slopes=(1.0,)),
    "add": Operation(operator.add, c="({} + {})", slopes=(1.0, 1.0)),
    "sub": Operation(operator.sub, c="({} - {})", slopes=(1.0, -1.0)),
    "neg": Operation(operator.neg, c="(- {})", slopes=(-1.0,)),
    "mul": Operation(operator.mul, c="({} * {})", slopes=(lambda e, a, b: b, lambda e, a, b: a)),
    "div": Operation(
        operator.truediv,
        c="({} / {})",
        slopes=(lambda e, a, b: 1.0 / b, lambda e, a, b: -(e * (1.0 / b))),
    ),
    "less": Operation(operator.lt, c="({} < {})"),
    "invert": Operation(np.logical_not, c="(!{})"),
    "both": Operation(np.logical_and, c="({} && {})"),
    "either": Operation(np.logical_or, c="({} || {})"),
    "differs": Operation(np.logical_xor, c="({} != {})"),
    "select": Operation(where, c="({} ? {} : {})"),
    "flip": Operation(flip, c="flipped({}, {})"),
    "absolute": Operation(abs, c="fabsf({})"),
    "larger": Operation(lambda a, b: where(a < b, b, a), c="larger({}, {})"),
    "smaller": Operation(lambda a, b: where(a < b, a, b), c="smaller({}, {})"),
    "clip": Operation(np.clip, lambda x, *ends: min(max(x, ends[0]), ends[1]), "clamp({}, {}, {})"),
    "saturated": Operation(
        lambda x, limit: np.minimum(np.maximum(x, -limit), limit),  # np.clip takes twice its time
        lambda x, limit: min(max(x, -limit), limit),
        "clamp({0}, -{1}, {1})",
        (1.0,),
    ),
    "wrap": Operation(_wrapped, c="wrap_half_turns({})", slopes=(1.0,)),
    "wrap_turns": Operation(lambda x: (x + 0.5) % 1.0 - 0.5, c="wrap_turns({})", slopes=(1.0,)),
    "sin": Operation(
        lambda x: np.sin(np.pi * x),
        PRECISE.sinpi,
        "sinf({pi} * {})",
        (lambda e, x: math.pi * sincos_ht(x)[1],),
    ),
    "cos": Operation(
        lambda x: np.cos(np.pi * x),
        PRECISE.cospi,
        "cosf({pi} * {})",
        (lambda e, x: -math.pi * sincos_ht(x)[0],),
    ),
    "asin": Operation(
        lambda x: np.arcsin(np.clip(x, 0.0, 1.0)) / np.pi,
        lambda x: PRECISE.asin(min(max(x, 0.0), 1.0)) / PRECISE.pi,
        "({turns} * asinf(clamp({}, 0.0f, 1.0f)))",
        (lambda e, x: rsqrt(1.0 - x * x) * (1.0 / math.pi),),
    ),
    "atan2": Operation(
        lambda y, x: _wrapped(np.arctan2(y + 0.0, x + 0.0) / np.pi),  # + 0.0: no negative zeros
        _precise_angle,
        "wrap_half_turns({turns} * arc_tangent({}, {}))",
        (_angle_by_y, _angle_by_x),
    ),
    "rsqrt": Operation(
        lambda x: 1.0 / np.sqrt(np.maximum(x, 1e-300)),
        lambda x: 1 / PRECISE.sqrt(max(x, 1e-300)),
        "(1.0f / sqrtf(larger({}, {least})))",
        (lambda e, x: -0.5 * (e * (e * e)),),
    ),
    "sqrt": Operation(np.sqrt, math.sqrt, "sqrtf({})", (lambda e, x: 0.5 * rsqrt(x),)),
    "exp": Operation(np.exp, PRECISE.exp, "expf({})", (lambda e, x: e,)),
    "log": Operation(np.log, PRECISE.log, "logf({})", (lambda e, x: 1.0 / x,)),
    "tanh": Operation(np.tanh, PRECISE.tanh, "tanhf({})", (lambda e, x: 1.0 - e * e,)),
}


def _sincos(x: Any) -> tuple[Any, Any]:
    """Sine and cosine of ``x`` rad; InputError where it is known to be another unit."""
    unit, _ = unit_of(x)
    turns, _ = ANGLES.get(unit, ("x", 0.0))
    fix = f"write ops.sincos_ht({turns}), or declare the angle in rad"
    angle = unit not in ("ht", *ANGLES) or same_unit(unit, "rad")
    require(angle, author_line, "an angle in rad", unit, fix)
    return sincos_ht(x * (1.0 / math.pi))


def _remainder(x: Any, period: Any) -> Any:
    """``x`` modulo a number above 0: the fraction of a turn, which ends in the middle."""
    number = isinstance(period, int | float | np.number)
    positive = number and bool(period > 0.0)
    require(positive, author_line, "a number above 0 after %", period, "give a number")
    return period * (wrap_turns(x * (1.0 / period) - 0.5) + 0.5)


#: numpy's functions, which numpy calls for recorded values.
Scalar.functions.update(
    sqrt=sqrt,
    exp=exp,
    log=log,
    tanh=tanh,
    sin=lambda x: _sincos(x)[0],
    cos=lambda x: _sincos(x)[1],
    square=lambda x: x * x,
    arctan=lambda x: math.pi * atan2_ht(x, 1.0),
    arctan2=lambda y, x: math.pi * atan2_ht(y, x),
    hypot=lambda x, y: sqrt(x * x + y * y),
    clip=clip,
    **dict.fromkeys(("maximum", "fmax"), maximum),
    **dict.fromkeys(("minimum", "fmin"), minimum),
    copysign=lambda x, y: flip(y < 0.0, absolute(x)),
    **dict.fromkeys(("remainder", "mod"), _remainder),
    fmod=refusing("numpy's fmod", "write x % c of a number c, whose results are from 0 to c"),
)
