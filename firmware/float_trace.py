"""Scalars that record what is computed with them, for the float form of an estimator.

`model.ops` computes on numpy arrays with numpy's own functions. A `Value` answers numpy's protocols
(``__array_ufunc__``, ``__array_function__``) with a new `Value`, so what is recorded are the float
semantics themselves: square roots, arc tangents and divisions, no trace of the fixed point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

__all__ = ["CONDITIONS", "Tape", "Value"]

#: Kinds whose value is a truth value.
CONDITIONS = frozenset({"less", "greater", "not", "and", "or"})


class Value:
    """One expression of the float program.

    Attributes
    ----------
    kind : str
        "const" (with ``number``), "input", "param", "state" (with ``name``), an operation ("add",
        "sub", "mul", "div", "neg", "abs", "sqrt", "sin", "cos", "asin", "atan2", "clip", "max",
        "wrap_ht", "mod", "select"), or one of `CONDITIONS`.
    args : tuple of Value
        Operands; of "select": condition, yes, no; of "clip": value, low, high.
    index : int
        Position in the order of computation.
    """

    def __init__(
        self,
        tape: Tape,
        kind: str,
        args: tuple[Value, ...] = (),
        *,
        number: float = 0.0,
        name: str = "",
    ) -> None:
        self.tape, self.kind, self.args = tape, kind, args
        self.number, self.name = number, name
        self.index = len(tape.values)

    def __add__(self, other: Any) -> Value:
        return self.tape.add(self, self.tape.lift(other))

    def __radd__(self, other: Any) -> Value:
        return self.tape.add(self.tape.lift(other), self)

    def __sub__(self, other: Any) -> Value:
        return self.tape.sub(self, self.tape.lift(other))

    def __rsub__(self, other: Any) -> Value:
        return self.tape.sub(self.tape.lift(other), self)

    def __mul__(self, other: Any) -> Value:
        return self.tape.mul(self, self.tape.lift(other))

    def __rmul__(self, other: Any) -> Value:
        return self.tape.mul(self.tape.lift(other), self)

    def __truediv__(self, other: Any) -> Value:
        return self.tape.div(self, self.tape.lift(other))

    def __rtruediv__(self, other: Any) -> Value:
        return self.tape.div(self.tape.lift(other), self)

    def __mod__(self, other: Any) -> Value:
        return self.tape.new("mod", self, self.tape.lift(other))

    def __neg__(self) -> Value:
        return self.tape.neg(self)

    def __lt__(self, other: Any) -> Value:
        return self.tape.new("less", self, self.tape.lift(other))

    def __gt__(self, other: Any) -> Value:
        return self.tape.new("less", self.tape.lift(other), self)

    def __ge__(self, other: Any) -> Value:
        return self.tape.inverse(self < other)

    def __le__(self, other: Any) -> Value:
        return self.tape.inverse(self > other)

    def __and__(self, other: Any) -> Value:
        return self.tape.new("and", self, self._condition(other))

    def __or__(self, other: Any) -> Value:
        return self.tape.new("or", self, self._condition(other))

    def __invert__(self) -> Value:
        return self.tape.inverse(self)

    def __bool__(self) -> bool:
        raise TypeError("a traced value has no truth value: use model.ops.where instead of if")

    @staticmethod
    def _condition(other: Any) -> Value:
        if isinstance(other, Value) and other.kind in CONDITIONS:
            return other
        raise TypeError(f"conditions combine with conditions, not with {other!r}")

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *args: Any, **options: Any) -> Value:
        if method != "__call__" or options:
            raise TypeError(f"{ufunc.__name__}: only plain calls can be traced")
        return self.tape.function(ufunc.__name__, *args)

    def __array_function__(
        self, function: Callable[..., Any], types: Any, args: Sequence[Any], options: dict[str, Any]
    ) -> Value:
        if options:
            raise TypeError(f"{function.__name__}: keyword arguments cannot be traced")
        return self.tape.function(function.__name__, *args)


#: numpy's name of a function, and that of the operator that does the same.
_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "remainder": lambda a, b: a % b,
    "less": lambda a, b: a < b,
    "greater": lambda a, b: a > b,
    "less_equal": lambda a, b: a <= b,
    "greater_equal": lambda a, b: a >= b,
    "bitwise_and": lambda a, b: a & b,
    "bitwise_or": lambda a, b: a | b,
}

_FUNCTIONS = {
    "sin": "sin",
    "cos": "cos",
    "arcsin": "asin",
    "arctan2": "atan2",
    "sqrt": "sqrt",
    "absolute": "abs",
    "abs": "abs",
    "maximum": "max",
    "clip": "clip",
    "where": "select",
}


class Tape:
    """Values in the order in which they are computed; each expression once."""

    def __init__(self) -> None:
        self.values: list[Value] = []
        self._known: dict[Any, Value] = {}

    def _unique(self, key: Any, kind: str, args: tuple[Value, ...] = (), **more: Any) -> Value:
        if key not in self._known:
            value = Value(self, kind, args, **more)
            self.values.append(value)
            self._known[key] = value
        return self._known[key]

    def new(self, kind: str, *args: Value) -> Value:
        """An operation on values, as it is."""
        return self._unique((kind, *(a.index for a in args)), kind, args)

    def leaf(self, kind: str, name: str) -> Value:
        """An input, parameter or state."""
        return self._unique((kind, name), kind, name=name)

    def const(self, number: float) -> Value:
        """A constant; 0 and -0 are one."""
        number = float(number) + 0.0
        return self._unique(("const", number), "const", number=number)

    def lift(self, x: Any) -> Value:
        """A value as it is, a number as a constant."""
        if isinstance(x, Value):
            return x
        if isinstance(x, (int, float, np.integer, np.floating)):
            return self.const(float(x))
        raise TypeError(f"only numbers and traced values can be computed with, not {x!r}")

    def function(self, name: str, *args: Any) -> Value:
        """numpy's function of this name."""
        if name in _OPERATORS:
            first, second = args
            return self.lift(_OPERATORS[name](self.lift(first), second))
        if name == "negative":
            return self.neg(self.lift(args[0]))
        if name in ("invert", "logical_not"):
            return self.inverse(args[0])
        if name == "arctan2":
            return self.new("atan2", *(self.lift(a) for a in args))
        if name not in _FUNCTIONS:
            raise TypeError(f"numpy's {name} cannot be traced")
        return self.new(_FUNCTIONS[name], *(self.lift(a) for a in args))

    def add(self, a: Value, b: Value) -> Value:
        """a + b; zeros disappear."""
        if a.kind == b.kind == "const":
            return self.const(a.number + b.number)
        if b.kind == "const" and b.number == 0.0:
            return a
        if a.kind == "const" and a.number == 0.0:
            return b
        if b.kind == "neg":
            return self.sub(a, b.args[0])
        if a.kind == "neg":
            return self.sub(b, a.args[0])
        return self.new("add", a, b)

    def sub(self, a: Value, b: Value) -> Value:
        """a - b; ``(x + 1) % 2 - 1`` is wrapping to half a turn."""
        if a.kind == b.kind == "const":
            return self.const(a.number - b.number)
        if b.kind == "const" and b.number == 0.0:
            return a
        if a.kind == "const" and a.number == 0.0:
            return self.neg(b)
        if b.kind == "neg":
            return self.add(a, b.args[0])
        if a.kind == "mod" and self._is(a.args[1], 2.0) and self._is(b, 1.0):
            return self.new("wrap_ht", self.sub(a.args[0], b))
        if b.kind == "const" and a.kind == "add" and a.args[1] is b:
            return a.args[0]
        return self.new("sub", a, b)

    def mul(self, a: Value, b: Value) -> Value:
        """a * b; constants come first, ones disappear."""
        if b.kind == "const":
            a, b = b, a
        if a.kind == b.kind == "const":
            return self.const(a.number * b.number)
        if self._is(a, 1.0):
            return b
        if self._is(a, -1.0):
            return self.neg(b)
        if b.kind == "neg":
            return self.neg(self.mul(a, b.args[0]))
        if a.kind == "neg":
            return self.neg(self.mul(a.args[0], b))
        if a.kind == "const" and b.kind == "mul" and b.args[0].kind == "const":
            return self.mul(self.const(a.number * b.args[0].number), b.args[1])
        return self.new("mul", a, b)

    def div(self, a: Value, b: Value) -> Value:
        """a / b; by a constant: times its reciprocal."""
        if b.kind == "const":
            return self.mul(self.const(1.0 / b.number), a)
        return self.new("div", a, b)

    def neg(self, a: Value) -> Value:
        """-a."""
        if a.kind == "const":
            return self.const(-a.number)
        if a.kind == "neg":
            return a.args[0]
        if a.kind == "sub":
            return self.sub(a.args[1], a.args[0])
        return self.new("neg", a)

    def inverse(self, a: Value) -> Value:
        """not a."""
        return a.args[0] if a.kind == "not" else self.new("not", a)

    @staticmethod
    def _is(a: Value, number: float) -> bool:
        return a.kind == "const" and a.number == number
