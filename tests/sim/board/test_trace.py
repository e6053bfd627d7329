"""The bench's events, read from their text."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.sim.board.trace import Line, read_trace
from boresight.sim.rtl.simulators import SimulationFailed

TEXT = """\
5 C 1
10 R 1
12 C 0
14 P 3
20 C 1
22 S
30 U
31 T
32 B c0
33 N 1f
34 B 0a
36 E
40 L 1 -7 8 -9 2
44 L 0 1 2 3 4
50 F 2 a0
60 R 2
61 C 0
70 V 4
"""


def test_every_kind_of_event() -> None:
    trace = read_trace(TEXT)
    np.testing.assert_array_equal(trace.ready, [[10, 1], [60, 2]])
    assert [x.tolist() for x in (trace.samples, trace.updates, trace.starts, trace.broken)] == [
        [22],
        [30],
        [31],
        [36],
    ]
    assert trace.programs.tolist() == [[14, 3]]
    assert trace.events == [(33, 0x1F)] and trace.faults == [(50, 0x2, 0xA0)]
    assert trace.lines == (Line(40, True, (-7, 8, -9), 2), Line(44, False, (1, 2, 3), 4))
    assert (trace.bytes_at.tolist(), trace.data) == ([32, 34], b"\xc0\x0a")
    assert trace.violations == 4


def test_frames_of_the_device_are_whole() -> None:
    """What rises before it fell, and what fell and never rose, is none."""
    assert read_trace(TEXT).select.tolist() == [[12, 20]]


def test_nothing_at_all() -> None:
    trace = read_trace("9 V 0\n")
    assert trace.ready.shape == trace.select.shape == trace.programs.shape == (0, 2)
    assert trace.samples.dtype == np.int64 and trace.data == b"" and trace.violations == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("7 X\n9 V 0\n", r"^unknown value \(X\) at the board's pins in cycle 7$"),
        (TEXT.replace("70 V 4\n", ""), "^the board's bench did not come to its end$"),
        ("", "^the board's bench did not come to its end$"),
    ],
)
def test_what_is_never_a_pass(text: str, message: str) -> None:
    with pytest.raises(SimulationFailed, match=message):
        read_trace(text)
