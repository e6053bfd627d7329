"""Record of an estimator's ``step``, which runs on recording scalars.

Every expression is recorded once, as its author wrote it: ranges, words and fixed point do not
exist here. The floating-point C is written from this record; `model.lowering.graph` expands it
for the fixed-point program. What needs a number, or would lose the record, is refused with its
line and with what to write instead.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, TypeAlias, TypeVar, cast

import numpy as np

from boresight.model.errors import InputError, author_line, require

#: The operation of these methods, and what to write instead.
Refused = Mapping[str, tuple[str, str]]

_TRUTH = (
    "if, and, or, not, max, min of a traced value",
    "use ops.where(condition, yes, no), & | ~, ops.maximum, ops.minimum",
)
_KEY = ("a traced value in a set, as a key, or in a cache", "use its name, or its place in a list")
NO_NUMBER: Refused = {
    "bool": _TRUTH,
    "hash": _KEY,
    "float complex": (
        "float() or a function of math, of a traced value",
        "use the functions of boresight.ops; numbers stay as they are; an array of "
        "traced values is made by np.array([...]) or with dtype=object",
    ),
    "int index round trunc floor ceil": (
        "a traced value as a whole number",
        "choose with ops.where and comparisons",
    ),
    "rmod floordiv rfloordiv divmod rdivmod": (
        "// or divmod of a traced value, or % by one",
        "x - x % c is a multiple of a number c",
    ),
    "rpow": ("a traced value as an exponent", "write ops.exp(x * log_a) for a**x, log_a a number"),
    "and rand or ror invert xor rxor": (
        "& | ^ ~ of a traced value",
        "compare it: these combine conditions such as (x < 1.0) & (y > 0.0)",
    ),
}
_ARITHMETIC = "add sub mul truediv pow mod floordiv divmod matmul lshift rshift"
_AS_NUMBER = "neg pos abs float complex int index round trunc floor ceil lt gt le ge"
NO_CONDITION: Refused = {
    "bool": _TRUTH,
    "hash": _KEY,
    f"{_ARITHMETIC} r{_ARITHMETIC.replace(' ', ' r')} {_AS_NUMBER}": (
        "a condition as a number",
        "write ops.where(condition, 1.0, 0.0)",
    ),
}


def repeatable(same: bool, line: str = "") -> None:
    """Refuse a step that computes something else when it runs again, unless it is the ``same``.

    ``line``: source location, by default the author's line that runs.
    """
    found = "another expression the second time"
    fix = "no random numbers, no time, nothing kept in self: use states and inputs"
    where = line or author_line
    require(same, where, "a step that computes the same whenever it runs", found, fix)


def refusing(operation: str, fix: str) -> Callable[..., Any]:
    """A method or function that refuses its operation, with the author's line and a cure."""

    def refuse(self: Any, *_: Any) -> Any:
        require(False, author_line, "operations that can be recorded", operation, fix)

    return refuse


class Refuses:
    """A class whose objects refuse some methods."""

    def __init_subclass__(cls, refused: Refused = {}, **options: Any) -> None:  # noqa: B006
        super().__init_subclass__(**options)
        for methods, (operation, fix) in refused.items():
            for method in methods.split():
                setattr(cls, f"__{method}__", refusing(operation, fix))


@dataclass(eq=False, repr=False)
class Expression:
    """One expression.

    ``kind`` is "leaf", "const", or the method of `model.lowering.graph.Graph` that takes ``args``
    and then ``data``; ``number`` the position in the order of computation; ``line`` the author's.
    """

    tracer: Tracer
    number: int
    kind: str
    args: tuple[Any, ...]
    data: tuple[Any, ...]
    line: str

    def __repr__(self) -> str:
        return f"a traced {self.kind}"

    @property
    def key(self) -> tuple[Any, ...]:
        """Kind, numbers of the arguments, and data: equal for equal expressions."""
        return (self.kind, *(a.number for a in self.args), *self.data)


_E = TypeVar("_E", bound=Expression)
_Arithmetic: TypeAlias = "Callable[[Any, Any], Scalar]"
_Comparison: TypeAlias = "Callable[[Any, Any], Condition]"


def _operator(kind: str, *, swapped: bool = False, inverted: bool = False) -> Any:
    """A method of `Scalar` that records an operation; arrays on its right are left to numpy."""

    def method(self: Scalar, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        sides = (self, self.tracer.lift(other))
        result = getattr(self.tracer, kind)(*(reversed(sides) if swapped else sides))
        return ~result if inverted else result

    return method


class Scalar(Refuses, Expression, refused=NO_NUMBER):
    """A number that records what is computed with it."""

    #: Functions of numpy by name, as `boresight.model.ops` records them.
    functions: ClassVar[dict[str, Callable[..., Any]]] = {}

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """An operator or a function of numpy's numbers or arrays and this: element by element."""
        if ufunc.__name__ in self.functions and method == "__call__" and not options:
            each = np.frompyfunc(self.functions[ufunc.__name__], ufunc.nin, 1)
            return each(*_objects(inputs))
        if ufunc in (np.less, np.greater, np.less_equal, np.greater_equal):
            options["dtype"] = object  # conditions, not truth values
        return getattr(ufunc, method)(*_objects(inputs), **options)

    __add__: ClassVar[_Arithmetic] = _operator("add")
    __radd__: ClassVar[_Arithmetic] = _operator("add", swapped=True)
    __sub__: ClassVar[_Arithmetic] = _operator("sub")
    __rsub__: ClassVar[_Arithmetic] = _operator("sub", swapped=True)
    __mul__: ClassVar[_Arithmetic] = _operator("mul")
    __rmul__: ClassVar[_Arithmetic] = __mul__
    __truediv__: ClassVar[_Arithmetic] = _operator("div")
    __rtruediv__: ClassVar[_Arithmetic] = _operator("div", swapped=True)
    __lt__: ClassVar[_Comparison] = _operator("less")
    __gt__: ClassVar[_Comparison] = _operator("less", swapped=True)
    __ge__: ClassVar[_Comparison] = _operator("less", inverted=True)
    __le__: ClassVar[_Comparison] = _operator("less", swapped=True, inverted=True)

    def __getattr__(self, name: str) -> Any:
        """A function, which numpy calls as a method of the elements of an array."""
        if name not in self.functions:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return lambda *others, out=None: self.functions[name](self, *others)

    def __neg__(self) -> Scalar:
        return self.tracer.neg(self)

    def __pos__(self) -> Scalar:
        return self

    def __abs__(self) -> Scalar:
        return self.tracer.new("absolute", self)

    def __pow__(self, power: Any) -> Scalar:
        return self.tracer.power(self, power)

    def __mod__(self, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented
        return self.functions["remainder"](self, other)

    def __eq__(self, other: object) -> Any:
        fix = "compare its distance, as ops.absolute(a - b) < 0.5"
        wanted = "comparisons with < > <= >="
        require(self is other, author_line, wanted, "== or != on a traced value", fix)
        return np.True_

    def __ne__(self, other: object) -> Any:
        return ~self.__eq__(other)


class Condition(Refuses, Expression, refused=NO_CONDITION):
    """A truth value; ``& | ^ ~ == !=`` combine conditions, also with Python's and numpy's bools.

    A result that bools decide is a bool of numpy.
    """

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """An operator between numpy's bools or arrays and this: element by element."""
        if method != "__call__" or ufunc not in _OF_CONDITIONS:
            return self.__float__()  # type: ignore[attr-defined]  # refused
        return np.frompyfunc(_OF_CONDITIONS[ufunc], ufunc.nin, 1)(*_objects(inputs))

    def __invert__(self) -> Condition:
        if self.kind == "invert":
            return cast(Condition, self.args[0])
        return self.tracer.condition("invert", self)

    def __and__(self, other: Any) -> Any:
        if isinstance(other, bool | np.bool_):
            return self if other else np.False_
        return self.tracer.condition("both", self, other)

    def __or__(self, other: Any) -> Any:
        if isinstance(other, bool | np.bool_):
            return np.True_ if other else self
        return self.tracer.condition("either", self, other)

    def __xor__(self, other: Any) -> Any:
        if isinstance(other, bool | np.bool_):
            return ~self if other else self
        return self.tracer.differs(self, other)

    def __ne__(self, other: object) -> Any:
        return self ^ other

    def __eq__(self, other: object) -> Any:
        return ~(self ^ other)

    __rand__, __ror__, __rxor__ = __and__, __or__, __xor__


#: What numpy does with bools, for conditions.
_OF_CONDITIONS: dict[Any, Callable[..., Any]] = {
    **dict.fromkeys((np.bitwise_and, np.logical_and), operator.and_),
    **dict.fromkeys((np.bitwise_or, np.logical_or), operator.or_),
    **dict.fromkeys((np.bitwise_xor, np.logical_xor), operator.xor),
    **dict.fromkeys((np.invert, np.logical_not), operator.invert),
    np.equal: operator.eq,
    np.not_equal: operator.ne,
}


class Tracer:
    """Expressions in the order in which they are computed, each once.

    Constants are folded where it is exact or where numpy would round a constant too; zeros that are
    added and ones that are multiplied disappear.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        #: Source location of new expressions; "": the author's line that runs.
        self.place = ""
        self.expressions: list[Expression] = []
        self._unique: dict[Any, Any] = {}
        #: Units of values that are declared, by number, with the widths of their ranges.
        self.units: dict[int, tuple[str, float]] = {}

    def new(self, kind: str, *args: Expression, data: tuple[Any, ...] = ()) -> Scalar:
        """Record a number, without simplification."""
        return self._record(Scalar, kind, args, data)

    def condition(self, kind: str, *args: Any) -> Condition:
        return self._record(Condition, kind, tuple(map(_conditional, args)))

    def differs(self, a: Condition, b: Any) -> Any:
        """Whether one of two conditions holds and the other does not."""
        sides, inverted = [a, _conditional(b)], False
        for k, side in enumerate(sides):
            if side.kind == "invert":
                sides[k], inverted = side.args[0], not inverted
        if sides[0] is sides[1]:
            return np.bool_(inverted)
        difference = self.condition("differs", *sorted(sides, key=lambda side: side.number))
        return ~difference if inverted else difference

    def less(self, a: Scalar, b: Scalar) -> Condition:
        return self._record(Condition, "less", (a, b))

    def _record(
        self, cls: type[_E], kind: str, args: tuple[Expression, ...], data: tuple[Any, ...] = ()
    ) -> _E:
        repeatable(all(arg.tracer is self for arg in args))
        key = (kind, *(a.number for a in args), *data)
        if key not in self._unique:
            line = (self.place or author_line()) if args else ""
            self._unique[key] = cls(self, len(self.expressions), kind, args, data, line)
            self.expressions.append(self._unique[key])
        return cast(_E, self._unique[key])

    def leaf(self, kind: str, name: str, low: float, high: float, unit: str = "") -> Scalar:
        """An input, parameter or state with its declared range."""
        return self.new("leaf", data=(kind, name, low, high, unit))

    def const(self, number: float) -> Scalar:
        """A constant; 0 and -0 are one."""
        return self.new("const", data=(finite(number, lambda: author_line() or self.name),))

    def lift(self, x: Any) -> Scalar:
        """A scalar as it is, a number as a constant; InputError of anything else."""
        if isinstance(x, Scalar):
            repeatable(x.tracer is self)
            return x
        if isinstance(x, np.ndarray) and x.ndim == 0:
            return self.lift(x.item())
        if isinstance(x, np.ndarray | str) or not hasattr(x, "__float__"):
            found = "None" if x is None else f"a {type(x).__name__.lower()}"
            fix = "compute it from states, inputs, parameters and numbers"
            if isinstance(x, np.ndarray | list | tuple):
                found = f"an array of shape {x.shape}" if isinstance(x, np.ndarray) else found
                fix = "give it one element at a time"
            raise InputError.at(author_line(), wanted="a number", found=found, fix=fix)
        return self.const(x)

    def add(self, a: Scalar, b: Scalar) -> Scalar:
        if a.kind == b.kind == "const":
            return self.const(a.data[0] + b.data[0])
        if _is(b, 0.0):
            return a
        return b if _is(a, 0.0) else self.new("add", a, b)

    def sub(self, a: Scalar, b: Scalar) -> Scalar:
        if a.kind == b.kind == "const":
            return self.const(a.data[0] - b.data[0])
        if _is(b, 0.0):
            return a
        return self.neg(b) if _is(a, 0.0) else self.new("sub", a, b)

    def neg(self, a: Scalar) -> Scalar:
        if a.kind == "const":
            return self.const(-a.data[0])
        return cast(Scalar, a.args[0]) if a.kind == "neg" else self.new("neg", a)

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
        require(not _is(b, 0.0), author_line, "a divisor other than 0", 0)
        if b.kind == "const":
            return self.mul(a, self.const(1.0 / b.data[0]))
        return self.new("div", a, b)

    def power(self, a: Scalar, n: Any) -> Scalar:
        """a^n of a whole number n, as products; (1 / a)^-n below zero.

        InputError: n is no whole number.
        """
        fix = "write ops.sqrt(x) for x**0.5, ops.exp(n * ops.log(x)) for others"
        whole = not isinstance(n, Scalar) and int(n) == n
        require(whole, author_line, "a whole number as exponent", n, fix)
        if n < 0:
            return self.power(self.div(self.const(1.0), a), -n)
        if n < 2:
            return a if n else self.const(1.0)
        half = self.power(a, n // 2)
        square = self.mul(half, half)
        return self.mul(square, a) if n % 2 else square


@dataclass(frozen=True)
class Trace:
    """One recorded update of an estimator.

    Inputs in stream order; outputs by name, likewise; of each parameter its default and meaning; of
    each state its initial value and what replaces it; ``fracs``: fraction bits of the inputs whose
    words are not of the finest format of their range.
    """

    tracer: Tracer
    inputs: Sequence[Scalar]
    outputs: Mapping[str, Scalar]
    params: Sequence[tuple[Scalar, float, str]] = ()
    states: Sequence[tuple[Scalar, float, Scalar]] = ()
    fracs: Mapping[str, int] = field(default_factory=dict)

    @cached_property
    def needed(self) -> list[Expression]:
        """Expressions on which states or outputs depend, in the order of computation."""
        after = [next_e for _, _, next_e in self.states]
        wanted = {e.number for e in (*self.outputs.values(), *after)}
        for e in reversed(self.tracer.expressions):
            if e.number in wanted:
                wanted.update(arg.number for arg in e.args)
        return [e for e in self.tracer.expressions if e.number in wanted]


def finite(number: float, where: Callable[[], str]) -> float:
    """``number``, without the sign of zero; ``where`` finds the place for a message.

    InputError: it is not finite.
    """
    number = float(number) + 0.0
    require(math.isfinite(number), where, "finite constants", number, "correct how it is computed")
    return number


def _objects(inputs: Sequence[Any]) -> list[Any]:
    objects = (i.item() if isinstance(i, np.generic) else i for i in inputs)
    return [np.asarray(i, dtype=object) for i in objects]


def _conditional(x: Any) -> Condition:
    found, wanted = f"{x!r} in a condition", "conditions such as x < 1.0"
    fix = "compare it; brackets around each comparison that & | ^ == or != combines"
    require(isinstance(x, Condition), author_line, wanted, found, fix)
    return cast(Condition, x)


def _is(a: Scalar, number: float) -> bool:
    return a.kind == "const" and a.data[0] == number
