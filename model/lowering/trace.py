"""What an estimator's ``step`` becomes when it runs on recording scalars.

Every expression is recorded once, as its author wrote it: ranges, words and fixed point do not
exist here. The floating-point C is written from this record; `model.lowering.graph` makes of it
what becomes the fixed-point program.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

from boresight.model.errors import InputError

__all__ = ["Condition", "Expression", "Scalar", "Trace", "Tracer", "finite"]

#: Files whose lines nobody wrote an estimator in.
_OWN = frozenset(str(Path(__file__).parents[k] / n) for k, n in ((0, "trace.py"), (1, "ops.py")))


@dataclass(eq=False, repr=False)
class Expression:
    """One expression.

    Attributes
    ----------
    kind : str
        "leaf", "const", an operation or a function, named as the method of
        `model.lowering.graph.Graph` that takes ``args`` and then ``data``.
    number : int
        Position in the order in which they were first computed.
    line : str
        Where its author wrote it: "file.py, line 41".
    """

    tracer: Tracer
    number: int
    kind: str
    args: tuple[Any, ...]
    data: tuple[Any, ...]
    line: str

    def __repr__(self) -> str:
        return f"a traced {self.kind}"


_E = TypeVar("_E", bound=Expression)


class Scalar(Expression):
    """A number that records what is computed with it."""

    #: numpy's scalars and arrays leave the operators to this class.
    __array_ufunc__ = None

    def __add__(self, other: Any) -> Scalar:
        return self.tracer.add(self, self.tracer.lift(other))

    def __radd__(self, other: Any) -> Scalar:
        return self.tracer.add(self.tracer.lift(other), self)

    def __sub__(self, other: Any) -> Scalar:
        return self.tracer.sub(self, self.tracer.lift(other))

    def __rsub__(self, other: Any) -> Scalar:
        return self.tracer.sub(self.tracer.lift(other), self)

    def __mul__(self, other: Any) -> Scalar:
        return self.tracer.mul(self, self.tracer.lift(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Scalar:
        return self.tracer.div(self, self.tracer.lift(other))

    def __rtruediv__(self, other: Any) -> Scalar:
        return self.tracer.div(self.tracer.lift(other), self)

    def __neg__(self) -> Scalar:
        return self.tracer.neg(self)

    def __lt__(self, other: Any) -> Condition:
        return self.tracer.less(self, self.tracer.lift(other))

    def __gt__(self, other: Any) -> Condition:
        return self.tracer.less(self.tracer.lift(other), self)

    def __ge__(self, other: Any) -> Condition:
        return ~self.__lt__(other)

    def __le__(self, other: Any) -> Condition:
        return ~self.__gt__(other)

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        raise TypeError("traced values compare with < > <= >= only, not with == or !=")

    __hash__ = object.__hash__

    def __bool__(self) -> bool:
        raise TypeError("a traced value has no truth value: use ops.where instead of if")


class Condition(Expression):
    """A truth value; such combine with & | ~."""

    def __invert__(self) -> Condition:
        double, new = self.kind == "invert", self.tracer.condition
        opposite: Condition = self.args[0] if double else new("invert", self)
        return opposite

    def __and__(self, other: Condition) -> Condition:
        return self.tracer.condition("both", self, other)

    def __or__(self, other: Condition) -> Condition:
        return self.tracer.condition("either", self, other)

    def __bool__(self) -> bool:
        raise TypeError("a traced condition has no truth value: use ops.where")


class Tracer:
    """Expressions in the order in which they are computed, each once.

    Constants are folded where it is exact or where numpy would round a constant too; zeros that are
    added and ones that are multiplied disappear.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.expressions: list[Expression] = []
        self._known: dict[Any, Any] = {}

    def new(self, kind: str, *args: Expression, data: tuple[Any, ...] = ()) -> Scalar:
        """A number as it is, whatever it is computed from."""
        return self._once(Scalar, kind, args, data)

    def condition(self, kind: str, *args: Any) -> Condition:
        """Conditions combined."""
        for arg in args:
            if not isinstance(arg, Condition):
                raise TypeError(f"& and | take conditions, not {arg!r}")
        return self._once(Condition, kind, args)

    def less(self, a: Scalar, b: Scalar) -> Condition:
        """a < b."""
        return self._once(Condition, "less", (a, b))

    def _once(
        self, made: type[_E], kind: str, args: tuple[Expression, ...], data: tuple[Any, ...] = ()
    ) -> _E:
        key = (kind, *(a.number for a in args), *data)
        if key not in self._known:
            line = _author_line() if args else ""
            self._known[key] = made(self, len(self.expressions), kind, args, data, line)
            self.expressions.append(self._known[key])
        expression: _E = self._known[key]
        return expression

    def leaf(self, kind: str, name: str, low: float, high: float, unit: str = "") -> Scalar:
        """An input, parameter or state with its declared range."""
        return self.new("leaf", data=(kind, name, low, high, unit))

    def const(self, number: float) -> Scalar:
        """A constant; 0 and -0 are one."""
        return self.new("const", data=(finite(self.name, number),))

    def lift(self, x: Any) -> Scalar:
        """A scalar as it is, a number as a constant."""
        return x if isinstance(x, Scalar) else self.const(x)

    def add(self, a: Scalar, b: Scalar) -> Scalar:
        """a + b."""
        if a.kind == b.kind == "const":
            return self.const(a.data[0] + b.data[0])
        if _is(b, 0.0):
            return a
        return b if _is(a, 0.0) else self.new("add", a, b)

    def sub(self, a: Scalar, b: Scalar) -> Scalar:
        """a - b."""
        if a.kind == b.kind == "const":
            return self.const(a.data[0] - b.data[0])
        if _is(b, 0.0):
            return a
        return self.neg(b) if _is(a, 0.0) else self.new("sub", a, b)

    def neg(self, a: Scalar) -> Scalar:
        """-a."""
        if a.kind == "const":
            return self.const(-a.data[0])
        opposite: Scalar = a.args[0] if a.kind == "neg" else self.new("neg", a)
        return opposite

    def mul(self, a: Scalar, b: Scalar) -> Scalar:
        """a * b; constants come second."""
        if a.kind == "const":
            a, b = b, a
        if a.kind == b.kind == "const":
            return self.const(a.data[0] * b.data[0])
        if _is(b, 1.0):
            return a
        if _is(b, -1.0):
            return self.neg(a)
        if b.kind == "const" and a.kind == "mul" and a.args[1].kind == "const":
            return self.mul(a.args[0], self.const(a.args[1].data[0] * b.data[0]))
        return self.new("mul", a, b)

    def div(self, a: Scalar, b: Scalar) -> Scalar:
        """a / b; by a constant: times its reciprocal."""
        if b.kind == "const":
            return self.mul(a, self.const(1.0 / b.data[0]))
        return self.new("div", a, b)


@dataclass(frozen=True)
class Trace:
    """One recorded update of an estimator.

    Attributes
    ----------
    inputs : sequence of Scalar
        In stream order.
    params : sequence of (Scalar, float, str)
        Each with its default and meaning.
    states : sequence of (Scalar, float, Scalar)
        Each with its initial value and what replaces it.
    outputs : mapping of str to Scalar
        Named results in stream order.
    fracs : mapping of str to int
        Fraction bits of the inputs whose words are not of the finest format of their range.
    """

    tracer: Tracer
    inputs: Sequence[Scalar]
    outputs: Mapping[str, Scalar]
    params: Sequence[tuple[Scalar, float, str]] = ()
    states: Sequence[tuple[Scalar, float, Scalar]] = ()
    fracs: Mapping[str, int] = field(default_factory=dict)

    @property
    def needed(self) -> list[Expression]:
        """What states or outputs need, in an order in which it can be computed."""
        wanted = {
            e.number for e in (*self.outputs.values(), *(after for _, _, after in self.states))
        }
        for e in reversed(self.tracer.expressions):
            if e.number in wanted:
                wanted.update(arg.number for arg in e.args)
        return [e for e in self.tracer.expressions if e.number in wanted]


def finite(name: str, number: float) -> float:
    """``number``, without the sign of zero.

    Raises
    ------
    InputError
        It is not finite.
    """
    number = float(number) + 0.0
    if not math.isfinite(number):
        raise InputError(f"{name}: constants must be finite, not {number!r}")
    return number


def _is(a: Scalar, number: float) -> bool:
    return a.kind == "const" and a.data[0] == number


def _author_line() -> str:
    """The line that asks for an expression: the innermost one outside the recorder."""
    frame: FrameType | None = sys._getframe(2)
    while frame is not None and (
        frame.f_code.co_filename in _OWN or frame.f_code.co_filename.startswith("<")
    ):
        frame = frame.f_back
    if frame is None:
        return ""
    return f"{frame.f_code.co_filename.rpartition('/')[2]}, line {frame.f_lineno}"
