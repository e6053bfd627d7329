"""The times of one update on the board, from a trace."""

from __future__ import annotations

import numpy as np

from boresight.sim.attitude.board.build import Board
from boresight.sim.attitude.board.run import BoardRun, frame_ends
from boresight.sim.attitude.board.timeline import Span, Timeline
from boresight.sim.attitude.ma2014.paper import BESIDE, TIME_US

__all__ = ["timeline_of"]

#: Word in each SPI frame: the one requested in the frame before.
_ANSWERS = ("temp", "gx", "gy", "gz", "ax", "ay", "az", "diag", "check")


def timeline_of(board: Board, run: BoardRun, *, filter: int, update: int) -> Timeline:
    """The timeline of update ``update`` (from 0 on) with filter number ``filter``.

    Raises
    ------
    ValueError
        The run has no such update with its own frame and nine SPI frames.
    """
    trace, setup = run.trace, board.setup
    us = 1e6 / setup.clock_hz
    sample, updated = int(trace.samples[update]), int(trace.updates[update])
    ready = int(trace.ready[np.searchsorted(trace.ready[:, 0], sample) - 1, 0])

    def span(name: str, start: float, end: float) -> Span:
        return Span(name, (start - ready) * us, (end - ready) * us)

    select = trace.select[(trace.select[:, 0] >= ready) & (trace.select[:, 1] <= sample)]
    if len(select) != len(_ANSWERS):
        raise ValueError(f"update {update} must have {len(_ANSWERS)} SPI frames, not {len(select)}")
    lengths = board.system.plan.lengths
    switch = updated - lengths[filter] - 2
    numbers = run.frames[:, 0] & 0xFFFF
    frames = np.flatnonzero(numbers == update + 1)
    if not len(frames):
        raise ValueError(f"update {update} must have a frame, not none")
    ends = frame_ends(trace)
    return Timeline(
        filter=board.system.plan.names[filter],
        frames=tuple(
            span(name, *pair) for name, pair in zip(_ANSWERS, select.tolist(), strict=True)
        ),
        core=(
            span("calibrate", sample, sample + 1 + lengths[board.system.plan.inertial]),
            span("switch", sample + 1 + lengths[board.system.plan.inertial], switch),
            span("filter", switch, updated),
        ),
        line=span("frame", updated, float(ends[frames[0]])),
        period_us=1e6 / setup.rate_hz,
        paper_us=TIME_US.get(BESIDE.get(board.system.plan.names[filter], "")),
    )
