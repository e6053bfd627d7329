"""Writes an estimator as C99 in single or double precision, as one would write it by hand.

The mathematics is that of the float reference (`firmware.float_program`), with the functions of
``math.h``. Units and formats are those of the estimator's
declarations: SI, angles in half turns. The interface has the form of the integer C's.
"""

from __future__ import annotations

from collections.abc import Iterable

from boresight.firmware.float_program import FloatProgram, trace_float
from boresight.firmware.float_text import Expressions, float_helpers
from boresight.firmware.layout import END, banner, block, join
from boresight.firmware.names import comment, identifier
from boresight.firmware.precision import SINGLE, Precision
from boresight.model.estimator import Estimator

__all__ = ["emit_float_c", "float_prefix"]


_ADJECTIVE = {"float": "Single", "double": "Double"}
#: Longest line inside a function's braces.
_WIDTH = 92


def float_prefix(estimator: Estimator, precision: Precision = SINGLE) -> str:
    """Name of the files and beginning of every public name."""
    return f"{identifier(estimator.name)}_{precision.type}"


def _head(name: str, suffix: str, brief: str, estimator: Estimator) -> str:
    return (
        f"/**\n * @file {name}{suffix}\n * @brief {brief}\n *\n"
        f' * Generated from the estimator "{comment(estimator.name)}"; do not edit.\n */'
    )


def _folded(line: str) -> list[str]:
    """A statement as lines of at most `_WIDTH` characters, broken before operators."""
    lines: list[str] = []
    while len(line) > _WIDTH:
        cut = max(
            line.rfind(f" {sign} ", 8, _WIDTH)
            for sign in ("+", "-", "*", "/", "?", ":", "&&", "||")
        )
        if cut < 0:
            break
        lines.append(line[:cut])
        line = f"    {line[cut + 1 :]}"
    return [*lines, line]


def _struct(name: str, members: Iterable[tuple[str, str]], note: str) -> str:
    lines = [
        f"float {identifier(member)};" + (f" // {comment(said)}" if said else "")
        for member, said in members
    ]
    lines = lines or ["float none; // nothing: C99 has no empty structure"]
    return f"// {note}\n{block('typedef struct', lines)} {name};"


def _header(e: Estimator, name: str, precision: Precision) -> str:
    guard = f"{name.upper()}_H"

    def ranges(declared: Iterable[object]) -> list[tuple[str, str]]:
        return [
            (d.name, f"{d.unit}, [{d.low:.6g}, {d.high:.6g}]".removeprefix(", "))  # type: ignore[attr-defined]
            for d in declared
        ]

    return join(
        _head(name, ".h", f"{_ADJECTIVE[precision.type]}-precision estimator.", e),
        f"#ifndef {guard}\n#define {guard}",
        banner("Definitions"),
        f"#define {name.upper()}_INPUTS {len(e.inputs)}\n"
        f"#define {name.upper()}_OUTPUTS {len(e.outputs)}",
        _struct(
            f"{name}_params_t", ranges(e.params), "Parameters: may be changed between updates."
        ),
        _struct(f"{name}_state_t", ranges(e.states), "States: all members private."),
        f"// Estimator.\ntypedef struct {{\n    {name}_params_t params;\n"
        f"    {name}_state_t state;\n}} {name}_t;",
        _struct(f"{name}_in_t", ranges(e.inputs), "Inputs of one update."),
        _struct(f"{name}_out_t", [(o.name, o.unit) for o in e.outputs], "Outputs of one update."),
        banner("Function declarations"),
        '#ifdef __cplusplus\nextern "C" {\n#endif',
        "// Sets the parameters to their defaults and the states to their start values.\n"
        f"void {name}_init({name}_t *self);",
        f"// Sets the states to their start values.\nvoid {name}_reset({name}_t *self);",
        "// Runs one update.\n"
        f"void {name}_update({name}_t *self, const {name}_in_t *in, {name}_out_t *out);",
        "#ifdef __cplusplus\n}\n#endif",
        "#endif",
    )


def _source(program: FloatProgram, name: str, precision: Precision) -> str:
    e, x, literal = program.estimator, Expressions(program, precision), precision.literal
    body = x.statements()
    body += [f"out->{identifier(o)} = {x.text(v)};" for o, v in program.outputs.items()]
    body += [
        f"self->state.{identifier(s)} = {x.text(v)};"
        for s, v in program.states.items()
        if x.text(v) != f"self->state.{identifier(s)}"
    ]
    text = "\n".join(body)
    unused = [f"(void) {word};" for word in ("self", "in", "out") if f"{word}->" not in text]
    states = [f"self->state.{identifier(s.name)} = {literal(s.initial)};" for s in e.states]
    params = [f"self->params.{identifier(p.name)} = {literal(p.default)};" for p in e.params]
    return join(
        _head(name, ".c", f"{_ADJECTIVE[precision.type]}-precision estimator.", e),
        banner("Includes"),
        f'#include "{name}.h"\n\n#include <math.h>\n#include <stdbool.h>',
        banner("Functions"),
        float_helpers(text),
        block(f"void {name}_init({name}_t *const self)", [*params, f"{name}_reset(self);"]),
        block(f"void {name}_reset({name}_t *const self)", states or ["(void) self;"]),
        block(
            f"void {name}_update(\n    {name}_t *const self,\n"
            f"    const {name}_in_t *const in,\n    {name}_out_t *const out)",
            [part for line in unused + body for part in _folded(line)],
        ),
        END,
    )


def emit_float_c(estimator: Estimator, precision: Precision = SINGLE) -> dict[str, str]:
    """Texts of ``<name>_float.h`` and ``<name>_float.c`` (or ``_double``) by file name.

    Raises
    ------
    TypeError
        The estimator's ``step`` uses something that cannot be recorded.
    """
    name = float_prefix(estimator, precision)
    return {
        f"{name}.h": precision.of_single(_header(estimator, name, precision)),
        f"{name}.c": precision.of_single(_source(trace_float(estimator), name, precision)),
    }
