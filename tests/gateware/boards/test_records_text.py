"""What a project says of a core that the host feeds: the core's own figures, nothing else."""

from __future__ import annotations

import re

from boresight.gateware.boards.frames import word_bytes
from boresight.gateware.boards.records_text import records_text
from boresight.gateware.core import Core


def rows(text: str) -> list[list[str]]:
    return [re.split(r"  +", line.strip()) for line in text.splitlines()]


def test_one_program(leaky: Core) -> None:
    head, body = records_text(leaky, baud=115_200)
    assert f"Core     {leaky.name}, configuration small, 1 lane(s), 32-bit words" in head
    interval = leaky.parts[0].schedule.interval
    assert f"2 inputs, 3 outputs, {interval} cycles per update\n" in head
    assert f"Program  {leaky.digest}\nLine     115200 baud, " in head
    assert head.endswith("3.3 V levels\n") and "The core holds these programs" not in head
    assert "1 record  2 words  answered by kind 1 with 3 words" in body
    assert f"words ({word_bytes(32)} bytes each" in body
    program = leaky.program
    frac = {v.name: str(v.frac) for v in program.values}
    assert [row for row in rows(body) if row[0] in ("in", "out") and len(row) == 3] == [
        ["in", "u", frac["u"]],
        ["in", "v", frac["v"]],
        *(
            ["out", name, str(program.values[n].frac)]
            for name, n in zip(program.output_names, program.outputs, strict=True)
        ),
    ]
    assert "{" not in head + body


def test_several_programs_have_numbers_and_records_of_their_own(both: Core) -> None:
    head, body = records_text(both, baud=9600)
    intervals = [part.schedule.interval for part in both.parts]
    spans = sorted(set(intervals))
    span = f"{spans[0]} to {spans[-1]}" if len(spans) > 1 else str(spans[0])
    assert f" {span} cycles per update" in head
    assert "write another number to register 516\n" in head
    assert [row for row in rows(head) if row[0].isdigit()] == [
        ["0", "leaky", str(intervals[0])],
        ["1", "growing", str(intervals[1])],
    ]
    assert body.count("\nleaky\n") == body.count("\ngrowing\n") == 1
    assert len([row for row in rows(body) if row[0] == "out"]) == 6
