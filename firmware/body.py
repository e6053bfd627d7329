"""Statements of one update in C: every operation as straight-line code on named locals."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from boresight.firmware.layout import head
from boresight.firmware.names import identifier, literal, stem, unique
from boresight.model.tools.c_names import comment
from boresight.model.words.program import Kind, Negate, Op, Overflow, Program, Scale, Term, When

_RESULT = {
    Overflow.SAT: "saturate(acc, &saturated)",
    Overflow.CLIP: "clip(acc)",
    Overflow.WRAP: "wrap(acc)",
    Overflow.RANGE: "overflow(acc, &beyond)",
}


def _captured(op: Op) -> tuple[int | None, int | None, int | None]:
    """Values whose flag, normalisation count and table segment the terms use; None: they do not."""
    return (
        op.flag if any(term.conditional for term in op.terms) else None,
        op.norm if any(term.scale is not Scale.NONE for term in op.terms) else None,
        op.index if any(term.coefficient is not None for term in op.terms) else None,
    )


class Body:
    """Names and statements that the files of one program share.

    Attributes
    ----------
    name : str
        Name of the files and prefix of every public name.
    params, states : list of int
        Value numbers of the parameters and of the states, in the order of their structures.
    input_members, param_members, state_members, output_members : list of str
        Names of the members of the structures.
    """

    def __init__(self, program: Program) -> None:
        self.params = program.of_kind(Kind.PARAM)
        self.states = [state for state, _ in program.states]
        self.program = program
        self.name = stem(program.name)
        names = [value.name for value in program.values]
        self.input_members = unique(names[n] for n in program.inputs)
        self.param_members = unique(names[n] for n in self.params)
        self.state_members = unique(names[n] for n in self.states)
        ports = zip(program.outputs, program.ports, strict=False)  # made by hand: no ports
        self._units = {number: port.unit for number, port in ports}
        self.output_members = unique(program.output_names, reserved=["saturated", "beyond"])

    def head(self, suffix: str, brief: str) -> str:
        """First comment of a file."""
        origin = f'Generated from the program "{comment(self.program.name)}"; do not edit.'
        digest = f"Program digest: {self.program.digest}"
        return head(f"{self.name}{suffix}", brief, origin, digest)

    def word(self, number: int) -> str:
        """Expression of a value: its local variable, or a literal for a constant."""
        value = self.program.values[number]
        if value.kind is Kind.CONST:
            return literal(value.initial)
        return f"v{number}_{identifier(value.name)}"

    def describe(self, number: int, *, name: bool = False) -> str:
        """Format, unit and range of a value, for a comment."""
        value = self.program.values[number]
        parts = (
            str(self.program.format(number)),
            value.unit or self._units.get(number, ""),
            f"[{value.low:.6g}, {value.high:.6g}]",
        )
        text = ", ".join(part for part in parts if part)
        return comment(f"{value.name}: {text}" if name else text)

    @property
    def uses_table(self) -> bool:
        """Whether some operation reads the table memory."""
        return any(_captured(op)[2] is not None for op in self.program.ops)

    def _term(self, term: Term) -> str:
        a = f"fraction({self.word(term.a)})" if term.fraction_a else self.word(term.a)
        if term.b is None:
            b = f"segment[{term.coefficient}]"
        else:
            b = f"fraction({self.word(term.b)})" if term.fraction_b else self.word(term.b)
        shift = f"{term.shift}u"
        if term.scale is not Scale.NONE:
            count = {Scale.FULL: "n", Scale.EVEN: "n & ~1u", Scale.HALF: "n >> 1"}[term.scale]
            shift = f"shift_less({shift}, {count})"
        text = f"mul_shift({a}, {b}, {shift})"
        if term.negate in (Negate.IF, Negate.UNLESS):
            text = f"negate_where({text}, {'flag' if term.negate is Negate.IF else '~flag'})"
        if term.when is not When.ALWAYS:
            text += " & flag" if term.when is When.IF else " & ~flag"
        sign = "-=" if term.negate is Negate.YES else "+="
        constants = [
            self.program.values[n].name
            for n in (term.a, term.b)
            if n is not None and self.program.values[n].kind is Kind.CONST
        ]
        note = f" // {comment(', '.join(constants))}" if constants else ""
        return f"acc {sign} {text};{note}"

    def _op(self, op: Op) -> Iterator[str]:
        yield f"// {self.describe(op.dest, name=True)}, {op.overflow.value}"
        flag, norm, index = _captured(op)
        if flag is not None:
            helper = "sign_mask_quarter" if op.flag_quarter else "sign_mask"
            yield f"flag = {helper}({self.word(flag)});"
        if norm is not None:
            yield f"n = sign_count({self.word(norm)});"
        if index is not None and op.table is not None:
            helper = "segment_index_quarter" if op.index_quarter else "segment_index"
            yield f"segment = &TABLE[{512 * op.table}u + 4u * {helper}({self.word(index)})];"
        yield "acc = ROUND;"
        yield from map(self._term, op.terms)
        yield f"const int32_t {self.word(op.dest)} = {_RESULT[op.overflow]};"

    def _read(self) -> set[int]:
        """Values that operations, outputs or states read."""
        read = set(self.program.outputs)
        read.update(source for state, source in self.program.states if state != source)
        for op in self.program.ops:
            operands = [n for term in op.terms for n in (term.a, term.b)]
            read.update(n for n in (*operands, *_captured(op)) if n is not None)
        return read

    def statements(
        self,
        *,
        after: Iterable[str],
        every_word: bool = False,
        behind: Callable[[Op], Iterable[str]] = lambda op: (),
    ) -> list[str]:
        """Loads, operations, ``after``, and the replacement of the states.

        Parameters
        ----------
        after : iterable of str
            Statements after the last operation.
        every_word : bool
            Whether ``after`` uses every value.
        behind : callable
            Statements after each operation.
        """
        p = self.program
        read = set(range(len(p.values))) if every_word else self._read()
        lines = [
            f"const int32_t {self.word(n)} = {group}{member}; // {self.describe(n)}"
            for group, numbers, members in (
                ("in->", p.inputs, self.input_members),
                ("self->params.", self.params, self.param_members),
                ("self->state.", self.states, self.state_members),
            )
            for n, member in zip(numbers, members, strict=True)
            if n in read
        ]
        lines += ["bool saturated = false;", "bool beyond = false;"]
        if p.ops:
            lines.append("uint64_t acc; // accumulator, modulo 2^64")
        if any(_captured(op)[0] is not None for op in p.ops):
            lines.append("uint64_t flag; // all ones where the sign bit of the flag is set")
        if any(_captured(op)[1] is not None for op in p.ops):
            lines.append("uint32_t n; // normalisation count")
        if self.uses_table:
            lines.append("const int32_t *segment; // coefficients of one segment of a table")
        for op in p.ops:
            lines += ["", *self._op(op), *behind(op)]
            if op.dest not in read:
                lines.append(f"(void) {self.word(op.dest)};")
        lines += ["", *after]
        lines += [
            f"self->state.{member} = {self.word(source)};"
            for member, (state, source) in zip(self.state_members, p.states, strict=True)
            if state != source
        ]
        return lines
