"""Write an estimator as readable C99 in single or double precision.

The mathematics is that of the float reference, traced from `step` (`model.lowering.trace`), with
the functions of ``math.h``. Units and formats are those of the estimator's declarations: SI, angles
in half turns. The interface has the form of the integer C's.
"""

from __future__ import annotations

from collections.abc import Iterable

from boresight.firmware.floating.precision import SINGLE, Precision
from boresight.firmware.floating.text import Expressions, float_helpers
from boresight.firmware.layout import banner, head, header, source
from boresight.firmware.names import identifier
from boresight.model.estimator import Estimator, Input, Param, State
from boresight.model.tools.c_names import comment

_ADJECTIVE = {"float": "Single", "double": "Double"}
#: Longest line inside a function's braces.
_WIDTH = 92


def float_prefix(estimator: Estimator, precision: Precision = SINGLE) -> str:
    """Name of the files and prefix of every public name."""
    return f"{identifier(estimator.name)}_{precision.type}"


def _folded(line: str) -> list[str]:
    """A statement as lines of at most `_WIDTH` characters, broken before operators."""
    lines: list[str] = []
    while len(line) > _WIDTH:
        cut = max(
            line.rfind(f" {sign} ", 8, _WIDTH)
            for sign in ("+", "-", "*", "/", "?", ":", "&&", "||")
        )
        if cut == -1:
            break
        lines.append(line[:cut])
        line = f"    {line[cut + 1 :]}"
    return [*lines, line]


def _member(name: str, meaning: str) -> str:
    return f"float {identifier(name)};" + (f" // {comment(meaning)}" if meaning else "")


def _members(declared: Iterable[Input | Param | State]) -> list[str]:
    return [
        _member(d.name, f"{d.unit}, [{d.low:.6g}, {d.high:.6g}]".removeprefix(", "))
        for d in declared
    ]


def emit_float_c(estimator: Estimator, precision: Precision = SINGLE) -> dict[str, str]:
    """Texts of ``<name>_float.h`` and ``<name>_float.c`` (or ``_double``) by file name.

    Raises
    ------
    InputError
        The estimator's ``step`` raises, or does not return its states and outputs.
    """
    e, name = estimator, float_prefix(estimator, precision)
    expressions, literal = Expressions(e.record(), precision), precision.literal
    update = [*expressions.statements(), *expressions.results()]

    def first(suffix: str) -> str:
        brief = f"{_ADJECTIVE[precision.type]}-precision estimator."
        origin = f'Generated from the estimator "{comment(e.name)}"; do not edit.'
        return head(f"{name}{suffix}", brief, origin)

    files = {
        f"{name}.h": header(
            name,
            first(".h"),
            includes="",
            definitions=f"#define {name.upper()}_INPUTS {len(e.inputs)}\n"
            f"#define {name.upper()}_OUTPUTS {len(e.outputs)}",
            members={
                "params": _members(e.params),
                "state": _members(e.states),
                "in": _members(e.inputs),
                "out": [_member(o.name, o.unit) for o in e.outputs],
            },
            number="float",
            words="",
            start="start values",
        ),
        f"{name}.c": source(
            name,
            first(".c"),
            includes="\n\n#include <math.h>\n#include <stdbool.h>",
            before=[banner("Functions"), float_helpers("\n".join(update))],
            params=[f"self->params.{identifier(p.name)} = {literal(p.default)};" for p in e.params],
            states=[f"self->state.{identifier(s.name)} = {literal(s.initial)};" for s in e.states],
            update=[part for line in update for part in _folded(line)],
        ),
    }
    return {file: precision.of_single(text) for file, text in files.items()}
