"""Float expressions as C text."""

from __future__ import annotations

import re

from boresight.firmware.float_program import FloatProgram
from boresight.firmware.float_trace import CONDITIONS, Value
from boresight.firmware.names import identifier
from boresight.firmware.precision import SINGLE, Precision

__all__ = ["Expressions", "float_helpers"]

#: Longest expression that is written into the one that uses it.
_INLINE = 60

# Precedences of C.
_PRIMARY, _UNARY, _TIMES, _PLUS, _LESS, _AND, _OR, _CHOICE = range(16, 0, -2)

_BINARY = {
    "add": ("+", _PLUS),
    "sub": ("-", _PLUS),
    "mul": ("*", _TIMES),
    "div": ("/", _TIMES),
    "less": ("<", _LESS),
    "and": ("&&", _AND),
    "or": ("||", _OR),
}
_CALLS = {
    "abs": "fabsf",
    "sqrt": "sqrtf",
    "sin": "sinf",
    "cos": "cosf",
    "asin": "asinf",
    "atan2": "arc_tangent",
    "clip": "clamp",
    "max": "larger",
    "wrap_ht": "wrap_half_turns",
}

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
    "wrap_half_turns": """\
// x half turns wrapped to [-1, 1)
static inline float wrap_half_turns(const float x) {
    return x >= -1.0f && x < 1.0f ? x : x - 2.0f * floorf(0.5f * (x + 1.0f));
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
    """Which values get a variable, and the text of each.

    A value used once is written where it is used, as long as the line stays readable; so is
    what only one side of a selection needs, and then only that side computes it.

    Parameters
    ----------
    program : FloatProgram
        What to write.
    precision : Precision
        Of the constants; functions are named as for single precision (`Precision.of_single`).
    """

    def __init__(self, program: FloatProgram, precision: Precision = SINGLE) -> None:
        self.program, self.precision = program, precision
        self._uses: dict[int, int] = {}
        for value in program.values:
            for arg in value.args:
                self._count(arg)
        for value in (*program.states.values(), *program.outputs.values()):
            self._count(value)
        self._names: dict[int, str] = {}
        self._text: dict[int, tuple[str, int]] = {}
        self._taken: set[str] = set()

    def _count(self, value: Value) -> None:
        self._uses[value.index] = self._uses.get(value.index, 0) + 1

    def _name(self, value: Value) -> str:
        for names, suffix in ((self.program.outputs, ""), (self.program.states, "_next")):
            for name, source in names.items():
                text = f"{identifier(name)}{suffix}"
                if source is value and text not in self._taken:
                    self._taken.add(text)
                    return text
        return f"{'c' if value.kind in CONDITIONS else 't'}{value.index}"

    def statements(self) -> list[str]:
        """A declaration for every value that has a variable."""
        lines: list[str] = []
        for value in self.program.values:
            if value.kind == "const":
                self._text[value.index] = (self.precision.literal(value.number), _PRIMARY)
            elif not value.args:
                group = {"input": "in->", "param": "self->params.", "state": "self->state."}[
                    value.kind
                ]
                self._text[value.index] = (f"{group}{identifier(value.name)}", _PRIMARY)
                self._store(value, lines)
            else:
                self._text[value.index] = self._expression(value)
                if self._uses[value.index] > 1 or len(self._text[value.index][0]) > _INLINE:
                    self._store(value, lines)
        return lines

    def _store(self, value: Value, lines: list[str]) -> None:
        name = self._name(value) if value.args else f"{identifier(value.name)}_{value.kind[0]}"
        if value.args or self._uses[value.index] > 1:
            kind = "bool" if value.kind in CONDITIONS else "float"
            lines.append(f"const {kind} {name} = {self._text[value.index][0]};")
            self._text[value.index] = (name, _PRIMARY)

    def text(self, value: Value, least: int = 0) -> str:
        """Expression of a value, in brackets where it binds less than ``least``."""
        text, binds = self._text[value.index]
        return text if binds >= least else f"({text})"

    def _expression(self, value: Value) -> tuple[str, int]:
        args, kind = value.args, value.kind
        if kind in _BINARY:
            sign, binds = _BINARY[kind]
            first, second = binds, binds + 1
            if kind == "or":  # && inside || is clear to C, but not to the reader
                second = _LESS
                first = _LESS if self._text[args[0].index][1] == _AND else _OR
            return f"{self.text(args[0], first)} {sign} {self.text(args[1], second)}", binds
        if kind == "neg":
            return f"-{self.text(args[0], _PRIMARY)}", _UNARY
        if kind == "not":
            return f"!{self.text(args[0], _UNARY)}", _UNARY
        if kind == "select":
            condition, yes, no = args
            return (
                f"{self.text(condition, _CHOICE + 1)} ? {self.text(yes, _CHOICE + 1)} "
                f": {self.text(no, _CHOICE + 1)}"
            ), _CHOICE
        if kind in _CALLS:
            return f"{_CALLS[kind]}({', '.join(self.text(a) for a in args)})", _PRIMARY
        raise ValueError(f"C has no counterpart of {kind!r}")
