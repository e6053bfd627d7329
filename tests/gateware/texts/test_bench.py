"""Lines of the bench's words."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.gateware.description import describe
from boresight.gateware.texts.bench import Recorded, expected_hex, input_hex
from boresight.sim.levels.build import Build
from tests.support.track import Track


@pytest.fixture(scope="module")
def build() -> Build:
    return Build(Track(), restarts=0, word=21)


def run_of(saturated: list[bool]) -> Recorded:
    count = len(saturated)
    inputs = np.arange(4 * count).reshape(count, 4) - 6
    return Recorded(0, inputs, -np.arange(3 * count).reshape(count, 3), np.array(saturated), "")


def test_input_lines(build: Build) -> None:
    """Cycles and flags with the first word of a record; pauses in the second half."""
    lines = input_hex(describe(build.core), [run_of([False, True, False, True])]).splitlines()
    marks = [line.split("_")[:2] for line in lines]
    interval = f"{build.core.schedule.interval:04x}"
    none = "0000"
    assert marks == [
        *([none, "0"], [none, "0"], [none, "0"], [none, "1"]),
        *([interval, "4"], [none, "0"], [none, "0"], [none, "1"]),
        *([none, "e"], [none, "2"], [none, "2"], [none, "3"]),
        *([none, "6"], [none, "2"], [none, "2"], [none, "3"]),
    ]
    assert [line.split("_")[2] for line in lines[5:8]] == ["1fffff", "000000", "000001"]


def test_expected_lines(build: Build) -> None:
    """Cycles where there are no pauses: in the first half, or more than that."""
    lines = expected_hex(describe(build.core), [run_of([False, True, False])] * 2).splitlines()
    assert lines[:9] == lines[9:]
    cycles = [f"{c:04x}" for c in build.core.schedule.latencies]
    assert [line[:4] for line in lines[:9]] == [*cycles, *cycles, "0000", "0000", "0000"]
    assert [line[5] for line in lines[:9]] == ["0", "0", "1"] * 3
    assert [line[7:] for line in lines[:3]] == ["000000", "1fffff", "1ffffe"]
