"""Writes a program as C99: integers only, no allocation, no undefined behaviour.

`emit_c` gives three files. ``<name>.h`` and ``<name>.c`` are the firmware; ``<name>_host.c``
includes ``<name>.c`` and adds what only a host needs: many updates in one call, and every word of
one update. The same program gives the same text.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from boresight.firmware.body import Body
from boresight.firmware.helpers import definitions, helpers
from boresight.firmware.host import host_source
from boresight.firmware.layout import END, banner, block, head, join
from boresight.firmware.names import literal, unique
from boresight.model.words.program import Program

__all__ = ["emit_c"]


def _struct(name: str, members: Iterable[str], *, note: str) -> str:
    lines = list(members) or ["int32_t none; // nothing: C99 has no empty structure"]
    return f"// {note}\n{block('typedef struct', lines)} {name};"


def _members(body: Body, numbers: Sequence[int], members: Sequence[str]) -> list[str]:
    return [
        f"int32_t {member}; // {body.describe(n)}"
        for n, member in zip(numbers, members, strict=True)
    ]


def _constants(body: Body) -> str:
    """Macros with the fraction bits of every input, parameter and output."""
    p, macro = body.program, body.name.upper()
    lines = [
        f'#define {macro}_DIGEST "{p.digest}"',
        f"#define {macro}_WORD {p.arithmetic.word} // bits of a word",
        f"#define {macro}_INPUTS {len(p.inputs)}",
        f"#define {macro}_OUTPUTS {len(p.outputs)}",
        "",
    ]
    taken: list[str] = []
    for title, suffix, numbers, members in (
        ("Inputs", "_in", p.inputs, body.input_members),
        ("Parameters", "_param", body.params, body.param_members),
        ("Outputs", "_out", p.outputs, body.output_members),
    ):
        if numbers:
            lines.append(f"// {title}: fraction bits")
        used = {name.upper() for name in taken}
        stems = [m + suffix if m.upper() in used else m for m in members]
        names = unique(stems, taken=taken, fold=True)
        taken += names
        for n, name in zip(numbers, names, strict=True):
            frac = p.values[n].frac
            text = str(frac) if frac >= 0 else f"({frac})"
            lines.append(f"#define {macro}_{name.upper()}_FRAC {text} // {body.describe(n)}")
    return "\n".join(lines)


def _header(body: Body) -> str:
    p, name = body.program, body.name
    guard = f"{name.upper()}_H"
    return join(
        head(body, ".h", "Fixed-point estimator: a word w stands for w * 2^-FRAC."),
        f"#ifndef {guard}\n#define {guard}",
        banner("Includes"),
        "#include <stdbool.h>\n#include <stdint.h>",
        banner("Definitions"),
        _constants(body),
        _struct(
            f"{name}_params_t",
            _members(body, body.params, body.param_members),
            note="Parameters: may be changed between updates.",
        ),
        _struct(
            f"{name}_state_t",
            _members(body, body.states, body.state_members),
            note="States: all members private.",
        ),
        _struct(
            f"{name}_t", [f"{name}_params_t params;", f"{name}_state_t state;"], note="Estimator."
        ),
        _struct(
            f"{name}_in_t",
            _members(body, p.inputs, body.input_members),
            note=f"Inputs of one update: words of {p.arithmetic.word} bits, sign-extended.",
        ),
        _struct(
            f"{name}_out_t",
            [
                *_members(body, p.outputs, body.output_members),
                "bool saturated; // a result of this update was clamped",
            ],
            note="Outputs of one update.",
        ),
        banner("Function declarations"),
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        f"// Sets the parameters to their defaults and the states to their reset words.\n"
        f"void {name}_init({name}_t *self);",
        f"// Sets the states to their reset words.\nvoid {name}_reset({name}_t *self);",
        f"// Runs one update.\n"
        f"void {name}_update({name}_t *self, const {name}_in_t *in, {name}_out_t *out);",
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    )


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


def _assign(body: Body, group: str, numbers: Sequence[int], members: Sequence[str]) -> list[str]:
    return [
        f"self->{group}.{member} = {literal(body.program.values[n].initial)};"
        f" // {body.program.format(n)}"
        for n, member in zip(numbers, members, strict=True)
    ]


def _source(body: Body) -> str:
    p, name = body.program, body.name
    after = [
        f"out->{member} = {body.word(n)};"
        for n, member in zip(p.outputs, body.output_members, strict=True)
    ]
    statements = body.statements(after=[*after, "out->saturated = saturated;"])
    text = "\n".join(statements)
    unused = [
        f"(void) {name};" for name, use in (("self", "self->"), ("in", "in->")) if use not in text
    ]
    states = _assign(body, "state", body.states, body.state_members)
    params = _assign(body, "params", body.params, body.param_members)
    return join(
        head(
            body,
            ".c",
            f"Fixed-point estimator, {p.arithmetic.word}-bit words, {len(p.ops)} operations.",
        ),
        banner("Includes"),
        f'#include "{name}.h"',
        banner("Definitions"),
        definitions(p.arithmetic),
        banner("Variables") if body.uses_table else "",
        _table(body),
        banner("Functions"),
        helpers(text),
        block(f"void {name}_init({name}_t *const self)", [*params, f"{name}_reset(self);"]),
        block(f"void {name}_reset({name}_t *const self)", states or ["(void) self;"]),
        block(
            f"void {name}_update({name}_t *const self, const {name}_in_t *const in, "
            f"{name}_out_t *const out)",
            unused + statements,
        ),
        END,
    )


def emit_c(program: Program, *, prefix: str | None = None) -> dict[str, str]:
    """Texts of ``<name>.h``, ``<name>.c`` and ``<name>_host.c`` by file name.

    Parameters
    ----------
    program : Program
        What to write.
    prefix : str or None
        Name of the files and beginning of every public name; None: the program's name.

    Raises
    ------
    ValueError
        If the program is incomplete or the prefix is no identifier.
    """
    body = Body(program, prefix=prefix)
    return {
        f"{body.name}.h": _header(body),
        f"{body.name}.c": _source(body),
        f"{body.name}_host.c": host_source(body),
    }
