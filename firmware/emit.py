"""Write a program as C99: integers only, no allocation, no undefined behaviour.

The same program gives the same text.
"""

from __future__ import annotations

from collections.abc import Sequence

from boresight.firmware.body import Body
from boresight.firmware.helpers import definitions, helpers
from boresight.firmware.layout import banner, block, header, source
from boresight.firmware.names import literal, unique
from boresight.model.words.program import Program


def _members(body: Body, numbers: Sequence[int], members: Sequence[str]) -> list[str]:
    return [
        f"int32_t {member}; // {body.describe(n)}"
        for n, member in zip(numbers, members, strict=True)
    ]


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
    for title, prefix, numbers, members in (
        ("Inputs", "in_", p.inputs, body.input_members),
        ("Parameters", "", body.params, body.param_members),
        ("Outputs", "out_", p.outputs, body.output_members),
    ):
        if numbers:
            lines.append(f"// {title}: fraction bits")
        names = unique((prefix + member for member in members), reserved=reserved, fold=True)
        reserved += names
        for n, name in zip(numbers, names, strict=True):
            frac = p.values[n].frac
            text = str(frac) if frac >= 0 else f"({frac})"
            lines.append(f"#define {macro}_{name.upper()}_FRAC {text} // {body.describe(n)}")
    return "\n".join(lines)


def _table(body: Body) -> str:
    if not body.uses_table:
        return ""
    memory = body.program.table_memory
    rows = [
        " ".join(f"{literal(word)}," for word in memory[k : k + 4])
        for k in range(0, len(memory), 4)
    ]
    title = "// Function tables: 128 segments of 4 coefficients each"
    return f"{title}\n{block(f'static const int32_t TABLE[{len(memory)}] =', rows)};"


def preamble(body: Body, text: str) -> list[str]:
    """Definitions between the includes and functions with the statements ``text``."""
    return [
        banner("Definitions"),
        definitions(body.program.arithmetic),
        banner("Variables") if body.uses_table else "",
        _table(body),
        banner("Functions"),
        helpers(text),
    ]


def _assign(body: Body, group: str, numbers: Sequence[int], members: Sequence[str]) -> list[str]:
    return [
        f"self->{group}.{member} = {literal(body.program.values[n].initial)};"
        f" // {body.program.format(n)}"
        for n, member in zip(numbers, members, strict=True)
    ]


def emit_c(program: Program) -> dict[str, str]:
    """Texts of ``<name>.h`` and ``<name>.c`` by file name."""
    body = Body(program)
    p, name, brief = program, body.name, "Fixed-point estimator"
    after = [
        f"out->{member} = {body.word(n)};"
        for n, member in zip(p.outputs, body.output_members, strict=True)
    ]
    update = body.statements(after=[*after, "out->saturated = saturated;", "out->beyond = beyond;"])
    members = {
        "params": _members(body, body.params, body.param_members),
        "state": _members(body, body.states, body.state_members),
        "in": _members(body, p.inputs, body.input_members),
        "out": _members(body, p.outputs, body.output_members),
    }
    members["out"] += [
        "bool saturated; // a result of this update was clamped",
        "bool beyond; // an input of this update was beyond its declared range",
    ]
    return {
        f"{name}.h": header(
            name,
            body.head(
                ".h", f"{brief}: a word w stands for w * 2^-FRAC, x for floor(x * 2^FRAC + 0.5)."
            ),
            definitions=_constants(body),
            members=members,
            number="int32_t",
            words=f": words of {p.arithmetic.word} bits, sign-extended",
            start="reset words",
        ),
        f"{name}.c": source(
            name,
            body.head(".c", f"{brief}, {p.arithmetic.word}-bit words, {len(p.ops)} operations."),
            before=preamble(body, "\n".join(update)),
            params=_assign(body, "params", body.params, body.param_members),
            states=_assign(body, "state", body.states, body.state_members),
            update=update,
        ),
    }
