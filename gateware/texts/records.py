"""``records.h``: the records of a system's estimators, for the firmware of a soft core."""

from __future__ import annotations

from collections.abc import Sequence

from boresight.gateware.description import Records
from boresight.gateware.texts.render import render
from boresight.model.declarations import EXACT_UNITS

#: Outputs of an attitude on a line of the console.
_ATTITUDE = ("heading", "pitch", "roll", "status")
_FIELD = ("mx", "my", "mz")


def records_header(programs: Sequence[Records], *, outputs: int, inputs: int) -> str:
    """Text of ``records.h``.

    Parameters
    ----------
    programs : sequence of Records
        Records of the estimators, by number.
    outputs, inputs : int
        Addresses of the first output and the first input of an update.
    """
    names = [[w.name for w in p.inputs] for p in programs]
    line_words = [_line_words(p) for p in programs]
    fields = [sum(1 << k for k, n in enumerate(record) if n in _FIELD) for record in names]
    return render(
        "records.h",
        programs=programs,
        outputs=outputs,
        inputs=inputs,
        most_inputs=max(len(p.inputs) for p in programs),
        most_outputs=max(len(p.outputs) for p in programs),
        tables=(
            ("uint8_t", "record_inputs", [len(p.inputs) for p in programs]),
            ("uint8_t", "record_outputs", [len(p.outputs) for p in programs]),
            ("int8_t", "record_step", [n.index("dt") if "dt" in n else -1 for n in names]),
            ("uint32_t", "record_field", [f"UINT32_C({mask})" for mask in fields]),
            ("uint8_t", "record_said", [len(words) for words in line_words]),
        ),
        wide=(
            ("int8_t", "record_in_frac", [[w.frac for w in p.inputs] for p in programs]),
            ("int8_t", "record_out_frac", [[w.frac for w in p.outputs] for p in programs]),
            ("uint8_t", "record_place", [[k for k, _ in words] for words in line_words]),
            ("uint8_t", "record_kind", [[f"{kind}u" for _, kind in words] for words in line_words]),
        ),
    )


def _line_words(program: Records) -> list[tuple[int, int]]:
    """Positions of the outputs on a line, and their form: of an attitude angles and status."""
    units = {w.name: w.unit for w in program.outputs}
    places = {name: k for k, name in enumerate(units)}
    names = _ATTITUDE if set(_ATTITUDE) <= set(units) else tuple(units)

    def kind(name: str) -> int:
        return 0 if units[name] == "ht" else 1 if units[name] in EXACT_UNITS else 2

    return [(places[name], kind(name)) for name in names]
