"""Recorded expressions as C text."""

from __future__ import annotations

import math
import re
from collections import Counter

from boresight.firmware.floating.precision import FUNCTIONS, SINGLE, Precision
from boresight.firmware.names import identifier
from boresight.model.lowering.trace import Condition, Expression, Trace
from boresight.model.ops import OPERATIONS

#: Longest expression that is written inline.
_INLINE = 60

# Precedences of C.
_PRIMARY, _UNARY, _TIMES, _PLUS, _LESS, _AND, _OR, _CHOICE = range(16, 0, -2)

#: Text of each kind of expression, how strongly it binds, and how strongly its arguments must:
#: here C's operators, functions from their records.
_FORMS: dict[str, tuple[str, int, tuple[int, ...]]] = {
    "add": ("{} + {}", _PLUS, (_PLUS, _PLUS + 1)),
    "sub": ("{} - {}", _PLUS, (_PLUS, _PLUS + 1)),
    "mul": ("{} * {}", _TIMES, (_TIMES, _TIMES + 1)),
    "div": ("{} / {}", _TIMES, (_TIMES, _TIMES + 1)),
    "neg": ("-{}", _UNARY, (_PRIMARY,)),
    "less": ("{} < {}", _LESS, (_LESS, _LESS + 1)),
    "invert": ("!{}", _UNARY, (_UNARY,)),
    "both": ("{} && {}", _AND, (_AND, _AND + 1)),
    "either": ("{} || {}", _OR, (_LESS, _LESS)),  # brackets around && inside || for readers
    "differs": ("{} != {}", _LESS - 1, (_LESS + 1, _LESS + 1)),
    "select": ("{} ? {} : {}", _CHOICE, 3 * (_CHOICE + 1,)),
    "flip": ("{0} ? -{1} : {1}", _CHOICE, (_CHOICE + 1, _PRIMARY)),
}


def _form(text: str) -> tuple[str, int, tuple[int, ...]]:
    """A function's entry of `_FORMS`."""
    factors = re.search(r" [*/] ", re.sub(r"\(.*\)", "", text))
    needs = _TIMES + 1 if "* {}" in text else 0
    return text, _TIMES if factors else _PRIMARY, (needs,) * 4


_FORMS |= {kind: _form(o.c) for kind, o in OPERATIONS.items() if o.c}

#: Reserved names: parameters, and functions in single and double precision.
_RESERVED = ("self", "in", "out", *FUNCTIONS, *(f"{name}f" for name in FUNCTIONS))

_HELPERS = {
    "clamp": """\
// x limited to [low, high]
static inline float clamp(const float x, const float low, const float high) {
    if (x < low) {
        return low;
    }
    return x > high ? high : x;
}""",
    "larger": """\
// The larger of two
static inline float larger(const float a, const float b) {
    return a < b ? b : a;
}""",
    "smaller": """\
// The smaller of two
static inline float smaller(const float a, const float b) {
    return a < b ? a : b;
}""",
    "wrap_half_turns": """\
// x half turns wrapped to [-1, 1)
static inline float wrap_half_turns(const float x) {
    return x >= -1.0f && x < 1.0f ? x : x - 2.0f * floorf(0.5f * (x + 1.0f));
}""",
    "wrap_turns": """\
// x turns wrapped to [-1/2, 1/2)
static inline float wrap_turns(const float x) {
    return x >= -0.5f && x < 0.5f ? x : x - floorf(x + 0.5f);
}""",
    "arc_tangent": """\
// Angle of the vector (x, y) in rad; a negative zero x counts as zero
static inline float arc_tangent(const float y, const float x) {
    return atan2f(y, x + 0.0f);
}""",
}


def float_helpers(text: str) -> str:
    """Definitions of the helpers that ``text`` calls."""
    return "\n\n".join(body for name, body in _HELPERS.items() if re.search(rf"\b{name}\(", text))


class Expressions:
    """Texts of expressions, some of them in variables.

    An expression used once is written inline, as long as the line stays readable; so is one needed
    only on one side of a selection, so that only that side computes it.

    Parameters
    ----------
    trace : Trace
        Trace to write; declared ranges have no effect.
    precision : Precision
        Precision of constants; functions have single precision's names (`Precision.of_single`).
    """

    def __init__(self, trace: Trace, precision: Precision = SINGLE) -> None:
        self.trace, self.precision = trace, precision
        self._results = [(_plain(e).number, name) for name, e in trace.outputs.items()]
        self._results += [(_plain(e).number, f"{s.data[1]}_next") for s, _, e in trace.states]
        used = [arg for e in trace.needed if e.kind in _FORMS for arg in e.args]
        # A flip writes its number twice.
        used += [e.args[1] for e in trace.needed if e.kind == "flip"]
        self._uses = Counter([*(_plain(e).number for e in used), *(n for n, _ in self._results)])
        self._text: dict[int, tuple[str, int]] = {}
        self._used = {*_RESERVED, *_HELPERS}

    def _name(self, e: Expression) -> str:
        """Name of an expression: that of a result, else by its number."""
        names = [identifier(name) for number, name in self._results if number == e.number]
        return next(
            (name for name in names if name not in self._used),
            f"{'c' if isinstance(e, Condition) else 't'}{e.number}",
        )

    def statements(self) -> list[str]:
        """A declaration for every expression that has a variable."""
        lines: list[str] = []
        for e in self.trace.needed:
            uses, number = self._uses[e.number], e.number
            if e.kind == "const":
                text = self.precision.literal(e.data[0])
                self._text[number] = (text, _UNARY if text.startswith("-") else _PRIMARY)
            elif e.kind == "leaf":
                kind, name = e.data[0], identifier(e.data[1])
                group = {"input": "in->", "param": "self->params.", "state": "self->state."}[kind]
                self._text[number] = (f"{group}{name}", _PRIMARY)
                if uses > 1:
                    self._store(e, f"{name}_{kind[0]}", lines)
            elif e.kind in _FORMS:
                self._text[number] = self._expression(e)
                if uses > 1 or len(self._text[number][0]) > _INLINE:
                    self._store(e, self._name(e), lines)
        return lines

    def results(self) -> list[str]:
        """Stores of outputs, then of next states; what reads a stored state is computed before."""
        lines = [f"out->{identifier(o)} = {self.text(e)};" for o, e in self.trace.outputs.items()]
        stores: list[tuple[str, str]] = []
        for s, _, e in self.trace.states:
            if any(re.search(rf"{re.escape(state)}\b", self.text(e)) for state, _ in stores):
                self._store(_plain(e), self._name(_plain(e)), lines)
            target = f"self->state.{identifier(s.data[1])}"
            if target != self.text(e):
                stores.append((target, self.text(e)))
        return lines + [f"{target} = {text};" for target, text in stores]

    def _store(self, e: Expression, name: str, lines: list[str]) -> None:
        while name in self._used:
            name += "_"
        self._used.add(name)
        kind = "bool" if isinstance(e, Condition) else "float"
        lines.append(f"const {kind} {name} = {self._text[e.number][0]};")
        self._text[e.number] = (name, _PRIMARY)

    def text(self, e: Expression, binding: int = 0) -> str:
        """An expression, in brackets where it binds less than ``binding``."""
        text, binds = self._text[_plain(e).number]
        return text if binds >= binding else f"({text})"

    def _expression(self, e: Expression) -> tuple[str, int]:
        form, binds, bindings = _FORMS[e.kind]
        args = [self.text(arg, bound) for arg, bound in zip(e.args, bindings, strict=False)]
        if binds == _PLUS and args[1].startswith("-"):  # plus minus: minus
            form = _FORMS["sub" if e.kind == "add" else "add"][0]
            args[1] = args[1][1:]
        literal = self.precision.literal
        numbers = {"pi": math.pi, "turns": 1.0 / math.pi, "least": 1e-300}
        named = {name: literal(number) for name, number in numbers.items()}
        return form.format(*args, *map(literal, e.data), **named), binds


def _plain(e: Expression) -> Expression:
    """An expression without its name and range."""
    while e.kind in ("named", "same", "bounded"):
        e = e.args[0]
    return e
