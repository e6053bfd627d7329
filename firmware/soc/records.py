"""``records.h``: the records of a system's estimators, as its register map gives them to C."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from boresight.model.declarations import EXACT_UNITS
from boresight.model.words.program import Program

__all__ = ["records_header", "sizes"]

#: What a line of the console tells of an attitude.
_ATTITUDE = ("heading", "pitch", "roll", "status")
_HEAD = """\
/**
 * @file records.h
 * @brief Records of the estimators {names}, by their numbers.
 *
 * Generated; do not edit.
 */

#ifndef RECORDS_H
#define RECORDS_H

#include <stdint.h>

// How a word is shown: in degrees, as bits, with two decimals.
#define RECORD_ANGLE 0u
#define RECORD_BITS 1u
#define RECORD_NUMBER 2u

"""


def sizes(programs: Sequence[Program]) -> tuple[int, int]:
    """Most inputs and most outputs of a record."""
    return max(len(p.streamed) for p in programs), max(len(p.outputs) for p in programs)


def records_header(programs: Sequence[Program], *, outputs: int, inputs: int) -> str:
    """Text of ``records.h``.

    Parameters
    ----------
    programs : sequence of Program
        The estimators, by their numbers.
    outputs, inputs : int
        Addresses of the first output and the first input of an update.
    """
    most_in, most_out = sizes(programs)
    said = [_said(p) for p in programs]
    steps = [[k for k, n in enumerate(p.streamed) if p.values[n].name == "dt"] for p in programs]
    fields = [
        sum(1 << k for k, n in enumerate(p.streamed) if p.values[n].name in ("mx", "my", "mz"))
        for p in programs
    ]
    most_said = max(map(len, said))
    tables = (
        ("uint8_t", "record_inputs", [len(p.streamed) for p in programs]),
        ("uint8_t", "record_outputs", [len(p.outputs) for p in programs]),
        ("int8_t", "record_step", [s[0] if s else -1 for s in steps]),
        ("uint32_t", "record_field", [f"UINT32_C({mask})" for mask in fields]),
        ("uint8_t", "record_said", [len(s) for s in said]),
    )
    wide = (
        (
            "int8_t",
            "record_in_frac",
            most_in,
            [[p.values[n].frac for n in p.streamed] for p in programs],
        ),
        (
            "int8_t",
            "record_out_frac",
            most_out,
            [[p.values[n].frac for n in p.outputs] for p in programs],
        ),
        ("uint8_t", "record_place", most_said, [[k for k, _ in s] for s in said]),
        ("uint8_t", "record_kind", most_said, [[f"{kind}u" for _, kind in s] for s in said]),
    )
    lines = [
        f"#define RECORD_INPUTS {most_in}u // of the longest record",
        f"#define RECORD_OUTPUTS {most_out}u",
        f"#define RECORD_INPUT_ADDR {inputs}u // where the words of an update begin",
        f"#define RECORD_OUTPUT_ADDR {outputs}u",
        "",
        "// By estimator: words in and out, place of the time step or -1, bits of the words that a",
        "// compass gives; how many words a line says.",
        *(
            f"static const {kind} {name}[{len(row)}] = {{{_row(row)}}};"
            for kind, name, row in tables
        ),
        "",
        "// Fraction bits of its words; which words a line says, and how.",
        *(
            f"static const {kind} {name}[{len(rows)}][{most}] = {{"
            + ", ".join(f"{{{_row(row or [0])}}}" for row in rows)
            + "};"
            for kind, name, most, rows in wide
        ),
    ]
    names = ", ".join(p.name for p in programs)
    return _HEAD.format(names=names) + "\n".join(lines) + "\n\n#endif\n"


def _row(values: Iterable[object]) -> str:
    return ", ".join(map(str, values))


def _said(program: Program) -> list[tuple[int, int]]:
    """Places of the outputs that a line says, and how: of an attitude the angles and the status."""
    names = program.output_names
    told = _ATTITUDE if set(_ATTITUDE) <= set(names) else names
    units = {p.name: p.unit for p in program.ports}

    def kind(name: str) -> int:
        unit = units.get(name, "")
        return 0 if unit == "ht" else 1 if unit in EXACT_UNITS else 2

    return [(names.index(name), kind(name)) for name in told]
