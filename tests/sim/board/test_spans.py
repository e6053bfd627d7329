"""One update's way, out of a run made by hand: every border in microseconds from data-ready."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.gateware.boards.frames import Kind, encode
from boresight.sim.board.setup import REAL
from boresight.sim.board.spans import timeline_of
from boresight.sim.board.timeline import Span
from boresight.sim.board.trace import read_trace

#: Data-ready of two samples, nine frames in each, sample and update behind them; at 100 MHz.
READY = (1_000, 101_000)
BOARD: Any = SimpleNamespace(
    setup=REAL,
    system=SimpleNamespace(
        plan=SimpleNamespace(
            names=("complementary", "own", "calibrate_inertial"), lengths=(250, 350, 60), inertial=2
        )
    ),
)


def run(frames: int = 9, number: int = 2) -> Any:
    """A run whose second update, of the filter 1, goes to the host."""
    events = []
    for k, ready in enumerate(READY):
        events.append((ready, f"R {k + 1}"))
        for n in range(frames):
            at = ready + 10 + 3_000 * n
            events += [(at, "C 0"), (at + 1_600, "C 1")]
        events += [(ready + 30_000, "S"), (ready + 30_600, "U")]
    words = encode(Kind.ATTITUDE, [number, *[0] * 9], word=32)
    events += [(132_000 + 1_000 * k, f"B {byte:02x}") for k, byte in enumerate(words)]
    text = "".join(f"{at} {what}\n" for at, what in sorted(events)) + "999999 V 0\n"
    return SimpleNamespace(trace=read_trace(text), frames=np.array([[number, *[0] * 9]])), words


def test_every_border() -> None:
    made, words = run()
    line = timeline_of(BOARD, made, filter=1, update=1)
    assert (line.filter, line.paper_us) == ("own", None)
    assert line.period_us == 1e6 / 1024
    assert [s.name for s in line.frames] == [
        *("temp", "gx", "gy", "gz", "ax", "ay", "az", "diag", "check")
    ]
    assert line.frames[0] == Span("temp", 0.1, 16.1)
    assert line.frames[8].start_us == pytest.approx(240.1)
    sample, updated = 300.0, 306.0
    assert [(s.name, s.start_us, s.end_us) for s in line.core] == [
        ("calibrate", sample, pytest.approx(sample + 0.61)),
        ("switch", pytest.approx(sample + 0.61), pytest.approx(updated - 3.52)),
        ("filter", pytest.approx(updated - 3.52), updated),
    ]
    # The frame begins with the update and ends with its last byte.
    end = (132_000 + 1_000 * (len(words) - 1) - READY[1]) / 100
    assert line.line == Span("frame", updated, pytest.approx(end))
    assert line.in_registers_us == updated


def test_the_papers_time_is_that_of_the_same_filter() -> None:
    assert timeline_of(BOARD, run()[0], filter=0, update=1).paper_us == 316.0


def test_what_is_no_whole_update() -> None:
    with pytest.raises(ValueError, match="^update 1 must have 9 SPI frames, not 8$"):
        timeline_of(BOARD, run(frames=8)[0], filter=1, update=1)
    with pytest.raises(ValueError, match="^update 1 must have a frame, not none$"):
        timeline_of(BOARD, run(number=3)[0], filter=1, update=1)
    # Nobody's: frames between the updates, and one that ends behind the sample.
    made, _ = run()
    more = np.concatenate([made.trace.select, [[90_000, 91_000], [130_900, 131_100]]])
    made.trace = dataclasses.replace(made.trace, select=more)
    assert len(timeline_of(BOARD, made, filter=1, update=1).frames) == 9
