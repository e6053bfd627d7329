"""Write a program as C99: integers only, no allocation, no undefined behaviour.

Every operation is straight-line code on named locals. The same program gives the same text.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

from boresight.firmware import layout
from boresight.model.errors import require
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

    ``name`` is that of the files and the prefix of every public name; ``members`` are those of the
    structures ``params``, ``state``, ``in`` and ``out``: number of a value, name.
    """

    #: Where an update finds the members of a structure.
    PLACES = {"in": "in->", "params": "self->params.", "state": "self->state."}

    def __init__(self, program: Program) -> None:
        self.program = program
        self.name = layout.stem(program.name)
        macro = self.name.upper()
        reserved = [f"{macro}_{end}" for end in ("H", "DIGEST", "WORD", "INPUTS", "OUTPUTS")]
        groups = {
            "in": program.inputs,
            "params": program.of_kind(Kind.PARAM),
            "state": [state for state, _ in program.states],
        }
        self.members = dict[str, list[tuple[int, str]]]()
        for group, numbers in groups.items():
            names = layout.unique((program.values[n].name for n in numbers), reserved=reserved)
            self.members[group] = list(zip(numbers, names, strict=True))
        reserved += ["saturated", "beyond"]
        results = layout.unique(program.output_names, reserved=reserved)
        self.members["out"] = list(zip(program.outputs, results, strict=True))
        ports = zip(program.outputs, program.ports, strict=False)  # made by hand: no ports
        self._units = {number: port.unit for number, port in ports}

    def head(self, suffix: str, brief: str) -> str:
        origin = f'Generated from the program "{comment(self.program.name)}"; do not edit.'
        digest = f"Program digest: {self.program.digest}"
        return layout.head(f"{self.name}{suffix}", brief, origin, digest)

    def word(self, number: int) -> str:
        """Expression of a value: its local variable, or a literal for a constant."""
        value = self.program.values[number]
        if value.kind is Kind.CONST:
            return layout.literal(value.initial)
        return f"v{number}_{layout.identifier(value.name)}"

    def describe(self, number: int) -> str:
        """Format, unit and range of a value, for a comment."""
        value = self.program.values[number]
        unit = value.unit or self._units.get(number, "")
        parts = (str(self.program.format(number)), unit, f"[{value.low:.6g}, {value.high:.6g}]")
        return comment(", ".join(filter(None, parts)))

    def captures(self, kind: int) -> bool:
        """Whether some operation uses what `_captured` has at this place; 2: the table memory."""
        return any(_captured(op)[kind] is not None for op in self.program.ops)

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
        operands = [self.program.values[n] for n in (term.a, term.b) if n is not None]
        constants = [value.name for value in operands if value.kind is Kind.CONST]
        note = f" // {comment(', '.join(constants))}" if constants else ""
        return f"acc {sign} {text};{note}"

    def _op(self, op: Op) -> Iterator[str]:
        name = comment(self.program.values[op.dest].name)
        yield f"// {name}: {self.describe(op.dest)}, {op.overflow.value}"
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

    def _read(self) -> set[int | None]:
        """Values that operations, outputs or states read."""
        read: set[int | None] = {*self.program.outputs}
        read |= {after for state, after in self.program.states if state != after}
        for op in self.program.ops:
            read |= {*_captured(op), *(n for term in op.terms for n in (term.a, term.b))}
        return read - {None}

    def statements(
        self,
        *,
        after: Iterable[str],
        every_word: bool = False,
        behind: Callable[[Op], Iterable[str]] = lambda op: (),
    ) -> list[str]:
        """Loads, operations, statements ``after`` these, and the replacement of the states.

        With ``every_word``, ``after`` uses every value; ``behind`` gives statements after an
        operation.
        """
        p = self.program
        read = {*range(len(p.values))} if every_word else self._read()
        lines = [
            f"const int32_t {self.word(n)} = {place}{member}; // {self.describe(n)}"
            for group, place in self.PLACES.items()
            for n, member in self.members[group]
            if n in read
        ]
        lines += ["bool saturated = false;", "bool beyond = false;"]
        if p.ops:
            lines.append("uint64_t acc; // accumulator, modulo 2^64")
        captures = (
            "uint64_t flag; // all ones where the sign bit of the flag is set",
            "uint32_t n; // normalisation count",
            "const int32_t *segment; // coefficients of one segment of a table",
        )
        lines += [line for kind, line in enumerate(captures) if self.captures(kind)]
        for op in p.ops:
            lines += ["", *self._op(op), *behind(op)]
            if op.dest not in read:
                lines.append(f"(void) {self.word(op.dest)};")
        lines += ["", *after]
        lines += [
            f"self->state.{member} = {self.word(after)};"
            for (_, member), (state, after) in zip(self.members["state"], p.states, strict=True)
            if state != after
        ]
        return lines


def _constants(body: Body) -> str:
    """Macros with the fraction bits of every input, parameter and output, as in registers.h."""
    p, macro = body.program, body.name.upper()
    lines = [
        f'#define {macro}_DIGEST "{p.digest}"',
        f"#define {macro}_WORD {p.arithmetic.word} // bits of a word",
        f"#define {macro}_INPUTS {len(p.inputs)}",
        f"#define {macro}_OUTPUTS {len(p.outputs)}",
        "",
    ]
    reserved: list[str] = []
    groups = (("Inputs", "in_", "in"), ("Parameters", "", "params"), ("Outputs", "out_", "out"))
    for title, prefix, group in groups:
        members = body.members[group]
        if members:
            lines.append(f"// {title}: fraction bits")
        names = layout.unique((prefix + name for _, name in members), reserved=reserved, fold=True)
        reserved += names
        for (n, _), name in zip(members, names, strict=True):
            frac = p.values[n].frac
            text = str(frac) if frac >= 0 else f"({frac})"
            lines.append(f"#define {macro}_{name.upper()}_FRAC {text} // {body.describe(n)}")
    return "\n".join(lines)


def _table(body: Body) -> str:
    if not body.captures(2):
        return ""
    memory = [f"{layout.literal(word)}," for word in body.program.table_memory]
    rows = [" ".join(memory[k : k + 4]) for k in range(0, len(memory), 4)]
    title = "// Function tables: 128 segments of 4 coefficients each"
    return f"{title}\n{layout.block(f'static const int32_t TABLE[{len(memory)}] =', rows)};"


def preamble(body: Body, text: str) -> list[str]:
    """Definitions between the includes and functions with the statements ``text``."""
    return [
        layout.banner("Definitions"),
        layout.definitions(body.program.arithmetic),
        layout.banner("Variables") if body.captures(2) else "",
        _table(body),
        layout.banner("Functions"),
        layout.helpers(text),
    ]


def _assign(body: Body, group: str) -> list[str]:
    return [
        f"self->{group}.{member} = {layout.literal(body.program.values[n].initial)};"
        f" // {body.program.format(n)}"
        for n, member in body.members[group]
    ]


def emit_c(program: Program) -> dict[str, str]:
    """Texts of ``<name>.h`` and ``<name>.c`` by file name."""
    body = Body(program)
    p, name, brief = program, body.name, "Fixed-point estimator"
    note = "a word w stands for w * 2^-FRAC, x for floor(x * 2^FRAC + 0.5)"
    after = [f"out->{member} = {body.word(n)};" for n, member in body.members["out"]]
    update = body.statements(after=[*after, "out->saturated = saturated;", "out->beyond = beyond;"])
    members = {
        group: [f"int32_t {member}; // {body.describe(n)}" for n, member in pairs]
        for group, pairs in body.members.items()
    }
    members["out"] += [
        "bool saturated; // a result of this update was clamped",
        "bool beyond; // an input of this update was beyond its declared range",
    ]
    return {
        f"{name}.h": layout.header(
            name,
            body.head(".h", f"{brief}: {note}."),
            definitions=_constants(body),
            members=members,
            number="int32_t",
            words=f": words of {p.arithmetic.word} bits, sign-extended",
            start="reset words",
        ),
        f"{name}.c": layout.source(
            name,
            body.head(".c", f"{brief}, {p.arithmetic.word}-bit words, {len(p.ops)} operations."),
            before=preamble(body, "\n".join(update)),
            params=_assign(body, "params"),
            states=_assign(body, "state"),
            update=update,
        ),
    }


def check_together(programs: Iterable[Program]) -> None:
    """Refuse programs whose C headers define the same name: no source could include both."""
    owners: dict[str, str] = {}
    for program in programs:
        header = next(iter(emit_c(program).values()))
        for name in re.findall(r"(?m)^(?:#define|\}|void) (\w+)", header):
            owner = owners.setdefault(name, program.name)
            where, fix = f"{owner} and {program.name}", "rename an estimator or what it declares"
            wanted = "C headers that define different names"
            require(owner == program.name, where, wanted, f"{name} in both", fix)
