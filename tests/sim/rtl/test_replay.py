"""The files of the replay: records of several lengths, cycles, unknown values."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.sim.rtl.replay import (
    BusWrite,
    RegisterWrite,
    bus_text,
    input_text,
    read_output,
    register_writes,
)
from boresight.sim.rtl.simulators import SimulationFailed


def test_the_last_word_of_each_record_is_marked() -> None:
    inputs = np.array([[1, -1, 99], [2, 99, 99], [3, 4, -5]])
    text = input_text(inputs, np.array([2, 1, 3]), 18)
    assert text == "1\n7ffff\n40002\n3\n4\n7fffb\n"


def test_bus_writes() -> None:
    assert bus_text([BusWrite(0, 516, 1), BusWrite(12, 3, -1)], 18) == "0 204 1\n12 3 3ffff\n"


LINES = ["O 0 0 3ffff 4", "O 0 1 00002 5", "U 0 1 9", "O 1 0 00003 6", "U 1 0 8"]


def test_words_flags_cycles() -> None:
    run = read_output(LINES, np.array([2, 1]), 18)
    assert run.outputs.tolist() == [[-1, 2], [3, 0]]
    assert run.latency_cycles.tolist() == [[5, 6], [7, 0]]
    assert run.saturated.tolist() == [True, False] and run.interval_cycles.tolist() == [9, 8]


@pytest.mark.parametrize(
    ("place", "line", "said"),
    [
        (1, "O 0 1 0000x 5", "unknown value (X): O 0 1 0000x 5"),
        (1, "O 0 1 0000Z 5", "unknown value (X): O 0 1 0000Z 5"),
        (2, "U 0 x 9", "unknown value (X): U 0 x 9"),
        (0, "X 0 0 handshake 3", "unknown value (X): X 0 0 handshake 3"),
        (3, "O 1 1 00003 6", "unexpected output word: O 1 1 00003 6"),
        (3, "O 2 0 00003 6", "unexpected output word: O 2 0 00003 6"),
        (1, "", "update 0 of 2 did not complete"),
        (3, "", "update 1 of 2 did not complete"),
        (4, "", "update 1 of 2 did not complete"),
    ],
)
def test_what_is_no_run(place: int, line: str, said: str) -> None:
    lines = [x for x in [*LINES[:place], line, *LINES[place + 1 :]] if x]
    with pytest.raises(SimulationFailed) as error:
        read_output(lines, np.array([2, 1]), 18)
    assert str(error.value) == said


def test_register_writes() -> None:
    lines = ["R 3 1 0a 3ffff 7", "O 0 0 00001 9", "R 3 0 0x 00001 8", "R 3 0 01 0000x 9"]
    assert register_writes(lines) == (
        RegisterWrite(1, 10, 0x3FFFF, 7),
        RegisterWrite(0, -1, None, 8),
        RegisterWrite(0, -1, None, 9),
    )
