"""Writes a program as C99: integers only, no allocation, no undefined behaviour.

`emit_c` gives three files. ``<name>.h`` and ``<name>.c`` are the firmware; ``<name>_host.c``
includes ``<name>.c`` and adds what only a host needs: many updates in one call, and every word of
one update. The same program gives the same text.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from firmware.check import check
from firmware.helpers import definitions, helpers
from firmware.host import host_source
from firmware.names import comment, identifier, literal, unique
from model.program import Kind, Negate, Op, Overflow, Program, Scale, Term, When

__all__ = ["Emitter", "emit_c"]

_RULE = "//" + 78 * "-"
#: Stems whose ``<stem>_t`` belongs to the standard headers.
_TYPE_STEM = re.compile(r"u?int((_least|_fast)?\d+|ptr|max)|size|ptrdiff|wchar|max_align|ssize")


def _banner(title: str) -> str:
    return f"{_RULE}\n// {title}\n"


def _trailing(text: str) -> str:
    return f" // {text}" if text else ""


class Emitter:
    """Names and texts that the files of one program share.

    Parameters
    ----------
    program : Program
        What to write.
    prefix : str or None
        Name of the files and beginning of every public name; None: the program's name.
    """

    def __init__(self, program: Program, *, prefix: str | None = None) -> None:
        check(program)
        if prefix is not None and identifier(prefix) != prefix:
            raise ValueError(f"prefix must be a C identifier, not {prefix!r}")
        name = identifier(program.name) if prefix is None else prefix
        self.program = program
        self.name = f"{name}_program" if _TYPE_STEM.fullmatch(name) else name
        self.params = program.of_kind(Kind.PARAM)
        self.states = [state for state, _ in program.states]
        self.input_members = unique(self._names(program.inputs))
        self.output_members = unique(program.output_names, taken=["saturated"])
        self.param_members = unique(self._names(self.params))
        self.state_members = unique(self._names(self.states))

    def _names(self, values: Iterable[int]) -> list[str]:
        return [self.program.values[n].name for n in values]

    # ---------------------------------------------------------------- texts of values

    def local(self, number: int) -> str:
        """Name of the local variable of a value; a literal for a constant."""
        value = self.program.values[number]
        if value.kind is Kind.CONST:
            return literal(value.initial)
        return f"v{number}_{identifier(value.name)}"

    def describe(self, number: int, *, name: bool = False) -> str:
        """Format, unit and range of a value, as a comment."""
        value = self.program.values[number]
        parts = [str(self.program.format(number)), value.unit,
                 f"[{value.low:.6g}, {value.high:.6g}]"]
        text = ", ".join(part for part in parts if part)
        return comment(f"{value.name}: {text}" if name else text)

    # ---------------------------------------------------------------- operations

    def _term(self, term: Term) -> str:
        a = self.local(term.a)
        if term.fraction_a:
            a = f"fraction({a})"
        if term.b is None:
            b = f"segment[{term.coefficient}]"
        else:
            b = f"fraction({self.local(term.b)})" if term.fraction_b else self.local(term.b)
        shift = f"{term.shift}u"
        count = {Scale.FULL: "n", Scale.EVEN: "n & ~1u", Scale.HALF: "n >> 1"}.get(term.scale)
        if count is not None:
            shift = f"shift_less({shift}, {count})"
        text = f"mul_shift({a}, {b}, {shift})"
        if term.negate in (Negate.IF, Negate.UNLESS):
            mask = "flag" if term.negate is Negate.IF else "~flag"
            text = f"negate_where({text}, {mask})"
        if term.when is not When.ALWAYS:
            text += " & flag" if term.when is When.IF else " & ~flag"
        sign = "-=" if term.negate is Negate.YES else "+="
        constants = [n for n in (term.a, term.b)
                     if n is not None and self.program.values[n].kind is Kind.CONST]
        return f"acc {sign} {text};" + _trailing(
            comment(", ".join(self.program.values[n].name for n in constants)))

    def _op(self, op: Op) -> Iterator[str]:
        yield f"// {self.describe(op.dest, name=True)}, {op.overflow.value}"
        terms = op.terms
        conditional = any(t.negate in (Negate.IF, Negate.UNLESS) or t.when is not When.ALWAYS
                          for t in terms)
        if op.flag is not None and conditional:
            helper = "sign_mask_quarter" if op.flag_quarter else "sign_mask"
            yield f"flag = {helper}({self.local(op.flag)});"
        if op.norm is not None and any(t.scale is not Scale.NONE for t in terms):
            yield f"n = sign_count({self.local(op.norm)});"
        if op.index is not None and any(t.coefficient is not None for t in terms):
            assert op.table is not None
            helper = "segment_index_quarter" if op.index_quarter else "segment_index"
            yield f"segment = &TABLE[{512 * op.table}u + 4u * {helper}({self.local(op.index)})];"
        yield "acc = ROUND;"
        for term in terms:
            yield self._term(term)
        result = {Overflow.SAT: "saturate(acc, &saturated)", Overflow.CLIP: "clip(acc)",
                  Overflow.WRAP: "wrap(acc)"}[op.overflow]
        yield f"const int32_t {self.local(op.dest)} = {result};"

    def body(self, *, after: Iterable[str], every_word: bool = False) -> list[str]:
        """Statements of one update: loads, operations, ``after``, then the new states.

        ``every_word`` loads also what no operation reads.
        """
        p = self.program
        ops = [(op, list(self._op(op))) for op in p.ops]
        text = "\n".join([*(line for _, lines in ops for line in lines), *after,
                          *(self.local(source) for _, source in p.states)])
        words = set(re.findall(r"\bv\d+_\w*", "\n".join(
            line.split(" // ")[0] for line in text.split("\n") if not line.startswith("//"))))
        lines: list[str] = []
        for group, numbers, members in (
            ("in->", p.inputs, self.input_members),
            ("self->params.", self.params, self.param_members),
            ("self->state.", self.states, self.state_members),
        ):
            lines += [f"const int32_t {self.local(n)} = {group}{member};"
                      f" // {self.describe(n)}"
                      for n, member in zip(numbers, members, strict=True)
                      if every_word or self.local(n) in words]
        called = set(re.findall(r"\b(acc|flag|n|segment|saturated)\b", text))
        lines += [declaration for name, declaration in (
            ("acc", "uint64_t acc; // accumulator"),
            ("flag", "uint64_t flag; // all ones where the condition of the operation holds"),
            ("n", "uint32_t n; // normalisation count"),
            ("segment", "const int32_t *segment; // coefficients of the table's segment"),
        ) if name in called and any(
            re.match(rf"{name} =", line) for _, ls in ops for line in ls)]
        lines.append("bool saturated = false;")
        for op, op_lines in ops:
            lines += ["", *op_lines]
            used = self.local(op.dest)
            uses = sum(used in line.split(" // ")[0] for line in text.split("\n")
                       if not line.startswith("//"))
            if uses == 1:
                lines.append(f"(void) {used};")
        lines += ["", *after]
        lines += [f"self->state.{member} = {self.local(source)};"
                  for member, (state, source) in zip(self.state_members, p.states, strict=True)
                  if state != source]
        return lines
