"""Serial peripheral interface, mode 3: 16-bit frames, most significant bit first."""

from __future__ import annotations

import math
from typing import Any

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

#: Bits of a frame.
BITS = 16
#: Half periods of a frame, the first from ``cs_n`` to the first edge of ``sclk``.
_HALVES = 1 + 2 * BITS
#: Minimum clock cycles per half period: the reply passes two flip-flops within one.
HALF_MIN = 3


def cycles_for(*, clock_hz: float, seconds: float) -> int:
    """Clock cycles that last at least ``seconds``."""
    # Rounding errors of the product must not add a cycle.
    return math.ceil(clock_hz * seconds * (1 - 1e-12))


class SpiController(wiring.Component):
    r"""One frame per command word; the reply belongs to the same frame.

    A frame is a row of equal half periods, counted down by one counter::

        cs_n  ----\_____________________ ... ________/-------------
        sclk  ----------\____/----\____ ... __/-------------------
        mosi       x 15        x 14           x 0      x
                  setup  low  high  low          high  stall      next

    With mode 3 both sides change their bit at the falling edge and take the other's at the rising
    one. The answer is taken at the end of the high half instead, `HALF_MIN` cycles before the
    falling edge: by then it has passed the synchroniser, and a slow device has had nearly a whole
    period.

    The stall is rounded up to whole half periods. It is kept after a reset as well, so a frame that
    a reset has cut short is followed by a whole one.

    **Latency** ``o_valid`` comes `answer_latency` cycles after a command is taken; the next command
    is taken `frame_cycles` after it.

    ``half_cycles`` (3 or more) are those of half a period of ``sclk``, ``stall_cycles`` the fewest
    between frames.
    """

    def __init__(self, *, half_cycles: int, stall_cycles: int) -> None:
        self.half_cycles = half_cycles
        self.stall_halves = -(-stall_cycles // half_cycles)
        super().__init__(
            {
                "cs_n": Out(1, init=1),
                "sclk": Out(1, init=1),
                "mosi": Out(1),
                "miso": In(1),  # asynchronous to the clock
                "i": In(stream.Signature(BITS)),  # commands
                "o_data": Out(BITS),  # the reply, from ``o_valid`` until the next command is taken
                "o_valid": Out(1),  # it is new: the first cycle with ``cs_n`` high
                "busy": Out(1),  # a frame or the stall after it: no command is taken
            }
        )

    @property
    def stall_cycles(self) -> int:
        """Fewest clock cycles with ``cs_n`` high between two frames."""
        return self.stall_halves * self.half_cycles + 1

    @property
    def answer_latency(self) -> int:
        """Clock cycles from the command being taken to ``o_valid``."""
        return _HALVES * self.half_cycles + 1

    @property
    def frame_cycles(self) -> int:
        """Clock cycles from one command being taken to the next, at the soonest."""
        return (_HALVES + self.stall_halves) * self.half_cycles + 1

    def elaborate(self, platform: Any) -> Module:
        """Count half periods down: setup, 32 of the frame from base + 31 to base, stall."""
        m = Module()
        miso = Signal()
        m.submodules.synchroniser = FFSynchronizer(self.miso, miso)
        # With a power of two as base the bits tell the parts of a frame.
        base = 1 << max(6, self.stall_halves.bit_length())
        rest = base - 1 - self.stall_halves
        left = Signal(range(2 * base), init=base - 1)
        timer = Signal(range(self.half_cycles), init=self.half_cycles - 1)
        word = Signal(BITS)
        tick = Signal()  # the timer is 0
        idle = Signal()  # at most ``rest`` is left
        high = Signal()
        last = Signal()
        m.d.comb += [
            high.eq(left[-1] & ~left[5:-1].any() & ~left[0]),
            last.eq(high & ~left[1:5].any()),
            self.i.ready.eq(idle),
            self.busy.eq(~idle),
            self.mosi.eq(word[-1]),
            self.o_data.eq(word),
        ]
        m.d.sync += [self.o_valid.eq(0), timer.eq(timer - 1), tick.eq(timer == 1)]
        with m.If(idle | tick):
            m.d.sync += timer.eq(self.half_cycles - 1)
        with m.If(idle):
            m.d.sync += [self.cs_n.eq(1), self.sclk.eq(1)]
            with m.If(self.i.valid):
                m.d.sync += [
                    left.eq(base + 2 * BITS),
                    word.eq(self.i.payload),
                    self.cs_n.eq(0),
                    idle.eq(0),
                ]
        with m.Elif(tick):
            m.d.sync += [
                left.eq(left - 1),
                idle.eq(left == rest + 1),
                self.cs_n.eq(last | ~left[-1]),
                # Low is next after the setup, and after each high half but the last.
                self.sclk.eq(~((left == base + 2 * BITS) | (high & ~last))),
            ]
            with m.If(high):
                m.d.sync += [word.eq(Cat(miso, word)), self.o_valid.eq(last)]
        return m
