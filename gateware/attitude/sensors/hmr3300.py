"""The HMR3300 compass on its serial line."""

from __future__ import annotations

import math
from typing import Any

from amaranth.hdl import Array, Const, Module, Signal, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.sensors.hmr3300_command import Commander
from boresight.gateware.attitude.sensors.hmr3300_sentence import SentenceParser
from boresight.gateware.boards.uart import Receiver, Transmitter, divisor_for
from boresight.model.words.rounded import binary_exponent

#: Rate of the line as delivered (maker's sibling part, and two drivers of this part).
BAUD = 19_200
#: Sentences a second (maker).
LINES_HZ = 8.0

#: Level flags and their meanings.
FLAGS = {
    "stale": "no good sentence for the stale time, or none yet",
    "counts": "the last good sentence was magnetometer counts",
    "commanding": "a sequence of commands is under way",
    "paused": "the compass did not do what is wanted; the next attempt waits",
}

#: Longest beat of the slow counters, s.
_TICK_S = 0.05


class Hmr3300(wiring.Component):
    r"""Reads both kinds of sentences, and commands the compass to send the selected kind.

    A line in which no byte comes for one to two ticks of `tick_cycles` is spoiled.

    **Latency** ``line`` comes `latency` cycles after the start edge of LF at most, or 2^``slower``
    times that. A good sentence stays fresh for ``stale_s``, and up to two ticks more.

    Parameters
    ----------
    clock_hz, baud : float
        Clock; rate of the line.
    stale_s : float, > 0
        Time without a good sentence after which the last one is stale.
    quiet_s : float, > 0
        Time without a byte that means: stopped. More than the time from sentence to sentence
        (`LINES_HZ`); polling has 0.4 of it between a sentence and the next command.
    timeout_s : float, > 0
        Longest time that a command may take to have its effect, and that no wanted sentence may
        come before commands are sent. More than the compass's start of about 0.8 s (maker's
        sibling part).
    """

    #: Bit k of ``events``: heading or counts sentence that is good; line that is not, byte without
    #: stop bit; command sent, had its effect, had none in time (or was refused in a sequence),
    #: refusal (#I) by the compass; the last sentence became stale.
    EVENTS = (
        "heading_line",
        "counts_line",
        "rejected_line",
        "framing_error",
        "command_sent",
        "command_acknowledged",
        "command_timed_out",
        "invalid_command",
        "went_stale",
    )

    def __init__(
        self,
        *,
        clock_hz: float,
        baud: float = BAUD,
        stale_s: float = 0.5,
        quiet_s: float = 0.3,
        timeout_s: float = 1.3,
    ) -> None:
        self.divisor = divisor_for(clock_hz=clock_hz, baud=baud)
        self.clock_hz, self.baud = clock_hz, baud
        self.stale_s, self.quiet_s, self.timeout_s = stale_s, quiet_s, timeout_s
        #: Bit of ``time`` that beats.
        beat_s = min(_TICK_S, stale_s / 8, quiet_s / 4)
        self.beat = max(binary_exponent(clock_hz * beat_s), 0)
        self._receiver = Receiver(divisor=self.divisor)
        self._parser = SentenceParser()
        self._commander = Commander(
            timeout_ticks=self._ticks(timeout_s),
            quiet_ticks=self._ticks(quiet_s) + 1,
            poll_ticks=self._ticks(0.4 * quiet_s),
        )
        super().__init__(
            {
                "rx": In(1, init=1),  # asynchronous
                "tx": Out(1, init=1),
                "time": In(32),  # clock cycles, free-running: beat of the slow counters
                "mode": In(2),  # 0 any sentences, 1 heading, 2 and 3 magnetometer counts
                "poll": In(1),  # sentences are asked for one by one, by ``*Q``
                "slower": In(2),  # the rate of the line is ``baud / 2**slower``
                # Letter to send as ``*X\r\n``, or with bit 8 a byte to send as it is, when no
                # sequence of commands is under way.
                "command": In(stream.Signature(9)),
                # A good sentence: the next two are new with this cycle and stay until the next.
                "line": Out(1),
                "is_counts": Out(1),
                # Heading 0..3599, pitch, roll in tenths of a degree; or counts x, y, z.
                "values": Out(signed(16)).array(3),
                "flags": Out(data.StructLayout({name: 1 for name in FLAGS})),
                "events": Out(len(self.EVENTS)),
            }
        )

    def _ticks(self, seconds: float) -> int:
        """Whole ticks that last ``seconds`` or more."""
        return math.ceil(seconds * self.clock_hz / self.tick_cycles)

    @property
    def tick_cycles(self) -> int:
        """Clock cycles from tick to tick."""
        return 1 << self.beat

    @property
    def latency(self) -> int:
        """Maximum cycles from the start edge of LF to ``line``."""
        return self._receiver.latency + self._parser.latency

    def elaborate(self, platform: Any) -> Module:
        """Line, parser, commands; the stale counter."""
        m = Module()
        m.submodules.receiver = receiver = self._receiver
        m.submodules.transmitter = transmitter = Transmitter(divisor=self.divisor)
        # At a lower rate one of 2^slower cycles counts.
        counts = Signal(init=1)
        rates = [self.time[:k].all() if k else Const(1) for k in range(4)]
        m.d.sync += counts.eq(Array(rates)[self.slower])
        m.submodules.parser = parser = self._parser
        m.submodules.commander = commander = self._commander
        wiring.connect(m, commander.o, transmitter.i)
        wiring.connect(m, wiring.flipped(self.command), commander.command)

        beat = Signal()
        tick = Signal()
        m.d.sync += [beat.eq(self.time[self.beat]), tick.eq(beat ^ self.time[self.beat])]

        ticks = self._ticks(self.stale_s) + 1
        age = Signal(ticks.bit_length(), init=-1)  # ticks, up to all ones
        stale = Signal()
        was_stale = Signal(init=1)
        m.d.comb += stale.eq(age.all() & ~parser.line)
        m.d.sync += was_stale.eq(stale)
        with m.If(parser.line):
            m.d.sync += age.eq(-1 - ticks)
        with m.Else():
            m.d.sync += age.eq(age + (tick & ~stale))

        heard = Signal()  # since the last tick
        m.d.sync += heard.eq(receiver.valid | (heard & ~tick))

        m.d.comb += [
            receiver.rx.eq(self.rx),
            self.tx.eq(transmitter.tx),
            parser.data.eq(receiver.data),
            parser.valid.eq(receiver.valid),
            parser.error.eq(receiver.error),
            receiver.en.eq(counts),
            transmitter.en.eq(counts),
            parser.pause.eq(tick & ~heard),
            self.line.eq(parser.line),
            self.is_counts.eq(parser.is_counts),
            *(mine.eq(its) for mine, its in zip(self.values, parser.values, strict=True)),
            commander.mode.eq(self.mode),
            commander.poll.eq(self.poll),
            commander.tick.eq(tick),
            commander.heard.eq(receiver.valid | receiver.error),
            commander.line.eq(parser.line),
            commander.is_counts.eq(parser.is_counts),
            commander.invalid.eq(parser.invalid),
            self.flags.stale.eq(stale),
            self.flags.counts.eq(parser.is_counts),
            self.flags.commanding.eq(commander.busy),
            self.flags.paused.eq(commander.paused),
        ]
        happened = {
            "heading_line": parser.line & ~parser.is_counts,
            "counts_line": parser.line & parser.is_counts,
            "rejected_line": parser.rejected,
            "framing_error": receiver.error,
            "command_sent": commander.sent,
            "command_acknowledged": commander.acknowledged,
            "command_timed_out": commander.timed_out,
            "invalid_command": parser.invalid,
            "went_stale": stale & ~was_stale,
        }
        m.d.comb += [self.events[k].eq(happened[name]) for k, name in enumerate(self.EVENTS)]
        return m
