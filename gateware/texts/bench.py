"""Words for the plain bench: inputs, expected outputs, and their cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from boresight.gateware.description import Description
from boresight.gateware.registers import BUILD_HIGH, BUILD_LOW, RESTART, STATUS, UPDATES
from boresight.model.arrays import BoolArray, IntArray

#: Marks of a line besides its word: of input and output; of input; of output.
LAST, PAUSES, SATURATED, BEYOND = 1, 2, 2, 4


@dataclass(frozen=True, eq=False)
class Recorded:
    """Records of one program of a core, from power-up on, and results of the integer model."""

    #: Number of the program.
    number: int
    #: int (n, n_inputs): The words of its input records.
    inputs: IntArray
    #: int (n, n_outputs): The words of its output records.
    outputs: IntArray
    #: bool (n,): Whether a result of the update was clamped, an input word beyond its range.
    saturated: BoolArray
    beyond: BoolArray
    #: Source of the inputs.
    source: str

    @property
    def unhurried(self) -> int:
        """Number of leading records without pauses, whose cycles are compared."""
        return (len(self.inputs) + 1) // 2


def input_hex(core: Description, runs: Sequence[Recorded]) -> str:
    """A line ``cycles_marks_word`` for each input word, in the order of the runs.

    ``cycles`` are those since the first word of the record before, in the first word of a record;
    0 says that they are not compared. Of the marks 1 is the last word of the record, 2 that pauses
    are made.
    """
    lines = []
    for run in runs:
        interval, last = core.programs[run.number].interval, run.inputs.shape[1] - 1
        for k, record in enumerate(run.inputs.tolist()):
            cycles = interval if 0 < k < run.unhurried else 0
            for n, word in enumerate(record):
                marks = LAST * (n == last) + PAUSES * (k >= run.unhurried)
                lines.append(_line(cycles if n == 0 else 0, marks, word, core.word))
    return "".join(lines)


def expected_hex(core: Description, runs: Sequence[Recorded]) -> str:
    """A line ``cycles_marks_word`` for each output word, in the order of the runs.

    ``cycles`` are those since the first word of the input record, both counted; 0 says that they
    are not compared. Mark 1 is the last word of the record; with it, 2 says that the update
    saturated and 4 that an input word was beyond its range.
    """
    lines = []
    for run in runs:
        latencies, last = core.programs[run.number].latencies, run.outputs.shape[1] - 1
        for k, record in enumerate(run.outputs.tolist()):
            flags = LAST + SATURATED * bool(run.saturated[k]) + BEYOND * bool(run.beyond[k])
            for n, word in enumerate(record):
                cycles = latencies[n] if k < run.unhurried else 0
                lines.append(_line(cycles, flags * (n == last), word, core.word))
    return "".join(lines)


def _line(cycles: int, marks: int, value: int, word: int) -> str:
    digits = -(-word // 4)
    return f"{cycles:04x}_{marks:x}_{value & ((1 << word) - 1):0{digits}x}\n"


def bench_context(core: Description, runs: Sequence[Recorded]) -> dict[str, Any]:
    """Values of the bench besides the words."""
    inputs, outputs = (
        list(accumulate(words.size for words in side))
        for side in ([run.inputs for run in runs], [run.outputs for run in runs])
    )
    rows = [
        {
            "number": run.number,
            "name": core.programs[run.number].program,
            "records": len(run.inputs),
            "source": run.source,
            "inputs": inputs[k],
            "outputs": outputs[k],
        }
        for k, run in enumerate(runs)
    ]
    return {
        "runs": rows,
        "again": {"inputs": runs[0].inputs.shape[1], "outputs": runs[0].outputs.shape[1]},
        "inputs": inputs[-1],
        "outputs": outputs[-1],
        "digits": -(-core.word // 4),
        "patience": 4 * max(program.interval for program in core.programs) + 200,
        "build": list(zip((BUILD_LOW.address, BUILD_HIGH.address), core.build, strict=True)),
        **{r.name: r.address for r in (STATUS, UPDATES, RESTART)},
    }
