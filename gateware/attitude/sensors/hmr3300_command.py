"""Commands to the HMR3300: selection of the kind of sentence, single letters, bytes."""

from __future__ import annotations

from enum import Enum
from typing import Any

from amaranth.hdl import Const, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

#: Attempts in a row before a pause.
TRIES = 4


class Stage(Enum):
    """State of a sequence of commands."""

    WATCH = 0  #: no sequence: sentences are of the selected kind
    STOP = 1  #: ``*S`` (if sentences come); until the line is quiet
    SELECT = 2  #: ``*H`` or ``*M``; until the line is quiet
    START = 3  #: ``*S``; until a sentence comes that is wanted
    PAUSE = 4  #: after `TRIES` attempts that failed


class _Sequence:
    """Registers of a sequence of commands."""

    def __init__(self, timer_bits: int) -> None:
        self.stage = Signal(Stage)
        self.left = Signal(range(5))  # characters of the command
        self.manual = Signal()  # the letter is the user's
        self.raw = Signal()  # ... a byte that is sent as it is
        self.tries = Signal(range(TRIES))
        self.timer = Signal(timer_bits)
        self.sending = Signal()  # characters are left

    def go_to(self, stage: Stage, *, command: bool = False) -> list[Any]:
        """Enter a stage, with its command."""
        return [self.stage.eq(stage), self.timer.eq(0), *(self.send() if command else ())]

    def send(self, raw: Any = 0) -> list[Any]:
        """Send a command, or of its characters the letter alone."""
        return [self.left.eq(Mux(raw, 3, 4)), self.raw.eq(raw), self.sending.eq(1)]


class Commander(wiring.Component):
    r"""Makes the compass send the selected kind of sentence, and passes single letters on.

    The compass accepts ``*H`` (heading sentences) and ``*M`` (counts) while it is stopped, and
    ``*S`` stops and starts it in turn; it replies ``#I`` to rejected commands (maker), and no other
    reply is known. So a command is acknowledged by its effect: silence after a stop, a sentence of
    the selected kind after a start. Without the effect the attempt ends with a time-out, or with
    ``#I`` at once. A new attempt begins when a sentence of the other kind comes, or none for the
    time-out; after `TRIES` consecutive failures it waits for four time-outs.

    An attempt stops the compass only if the line is not quiet, since ``*S`` would start a stopped
    one. If the line was quiet because of a fault, the next attempt corrects the state: at most six
    time-outs and two silences after the line works again.

    With ``poll`` an attempt ends with ``*Q`` in place of the start, and ``*Q`` is sent again
    ``poll_ticks`` after each sentence, as long as one comes. ``#I`` in place of one says that the
    compass sends by itself: a new attempt stops it.

    With ``mode`` 0 no attempt begins, and nothing is polled. One under way is finished, so that the
    compass is not left stopped.

    Times are in ticks: a time-out comes with the tick after ``timeout_ticks`` whole ones (made one
    less than a power of two), the line is quiet ``quiet_ticks`` after a byte, and ``*Q`` follows
    ``poll_ticks`` after a sentence.
    """

    def __init__(self, *, timeout_ticks: int, quiet_ticks: int, poll_ticks: int) -> None:
        self.timeout_ticks = (1 << timeout_ticks.bit_length()) - 1
        self.quiet_ticks, self.poll_ticks = quiet_ticks, poll_ticks
        super().__init__(
            {
                "mode": In(2),  # 0 any sentences, 1 heading sentences, 2 and 3 counts
                "poll": In(1),  # sentences are asked for one by one
                # Letter X, sent as ``*X\r\n``; or with bit 8 a byte that is sent as it is, for
                # commands that begin with ``#``. It waits for the end of a sequence. With ``mode``
                # 0 no sequence begins between two bytes.
                "command": In(stream.Signature(9)),
                "o": Out(stream.Signature(8)),
                "tick": In(1),
                "heard": In(1),  # a byte, with or without a framing error
                "line": In(1),  # with the next two from the parser
                "is_counts": In(1),
                "invalid": In(1),
                "sent": Out(1),  # a command
                "acknowledged": Out(1),  # a command of a sequence had its effect
                "timed_out": Out(1),  # ... had none in time, or was rejected
                "busy": Out(1),  # a sequence is under way
                "paused": Out(1),  # it waits after attempts that failed
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Stages, time-outs, four characters."""
        m = Module()
        at = _Sequence(self.timeout_ticks.bit_length())
        stage, left, manual, raw, tries = at.stage, at.left, at.manual, at.raw, at.tries
        timer, sending = at.timer, at.sending
        silence = Signal(self.quiet_ticks.bit_length())  # ticks, up to all ones
        quiet, expired, wanted, other, poll, again = (
            Signal(name=n) for n in ("quiet", "expired", "wanted", "other", "poll_due", "again")
        )
        m.d.comb += [
            quiet.eq(silence.all()),
            expired.eq(self.tick & timer.all()),
            other.eq(self.line & self.mode.any() & (self.is_counts ^ self.mode[1])),
            wanted.eq(self.line & ~other),
            poll.eq(self.poll & self.tick & (timer == self.poll_ticks - 1)),
            again.eq(poll & tries.any()),
            self.busy.eq((stage != Stage.WATCH) & (stage != Stage.PAUSE)),
            self.paused.eq(stage == Stage.PAUSE),
        ]

        with m.If(self.heard | sending):
            m.d.sync += silence.eq(-1 - self.quiet_ticks)
        with m.Else():
            m.d.sync += silence.eq(silence + (self.tick & ~quiet))
        m.d.sync += timer.eq(timer + self.tick)

        with m.If(sending & self.o.ready):
            m.d.sync += [left.eq(left - 1), sending.eq((left != 1) & ~raw)]
        with m.If(sending):
            m.d.sync += timer.eq(0)
        with m.Else():
            m.d.sync += manual.eq(0)
            with m.Switch(stage):
                self._attempt(m, at, quiet=quiet, expired=expired, wanted=wanted)
                with m.Case(Stage.PAUSE):
                    with m.If(expired):
                        m.d.sync += tries.eq(tries + 1)
                        with m.If(tries == TRIES - 1):
                            m.d.sync += at.go_to(Stage.WATCH)
                    with m.If(self.command.valid):
                        m.d.sync += [manual.eq(1), *at.send(raw=self.command.payload[8])]
                with m.Default():
                    with m.If(wanted | ~self.mode.any()):
                        m.d.sync += at.go_to(Stage.WATCH)
                    with m.If(self.command.valid):
                        m.d.sync += [manual.eq(1), *at.send(raw=self.command.payload[8])]
                    with m.Elif((expired | other | again) & self.mode.any()):
                        m.d.sync += at.go_to(Stage.STOP, command=True)
                        with m.If(quiet):
                            m.d.sync += at.go_to(Stage.SELECT)
                    with m.Elif(poll & self.mode.any()):
                        m.d.sync += at.go_to(Stage.START, command=True)
        m.d.comb += [self.o.valid.eq(sending), *self._characters(at)]
        return m

    def _attempt(
        self, m: Module, at: _Sequence, *, quiet: Value, expired: Value, wanted: Value
    ) -> None:
        """Stages of an attempt, each up to the effect of its command."""

        def otherwise_failed() -> None:
            with m.Elif(expired | self.invalid):
                m.d.comb += self.timed_out.eq(1)
                m.d.sync += at.tries.eq(at.tries + 1)
                m.d.sync += at.go_to(Stage.WATCH)
                with m.If(at.tries == TRIES - 1):
                    m.d.sync += at.go_to(Stage.PAUSE)

        with m.Case(Stage.STOP):
            with m.If(quiet):
                m.d.comb += self.acknowledged.eq(1)
                m.d.sync += at.go_to(Stage.SELECT, command=True)
            otherwise_failed()
        with m.Case(Stage.SELECT):
            with m.If(quiet):
                m.d.sync += at.go_to(Stage.START, command=True)
            otherwise_failed()
        with m.Case(Stage.START):
            with m.If(wanted):
                m.d.comb += self.acknowledged.eq(1)
                m.d.sync += at.tries.eq(0)
                m.d.sync += at.go_to(Stage.WATCH)
            otherwise_failed()

    def _characters(self, at: _Sequence) -> list[Any]:
        """The characters of the command, with the letter of the stage or of the user."""
        start = Mux(self.poll & (at.stage == Stage.START), ord("Q"), ord("S"))
        left, of_stage = at.left, Mux(self.mode[1], ord("M"), ord("H"))
        of_stage = Mux(at.stage != Stage.SELECT, start, of_stage)
        letter = Mux(at.manual, self.command.payload[:8], of_stage)
        first = Mux(left[0], ord("\n"), Const(ord("*"), 8))
        return [
            self.o.payload.eq(Mux(left[1], Mux(left[0], letter, ord("\r")), first)),
            self.command.ready.eq(at.manual & (left == 3) & self.o.ready),
            self.sent.eq(((left == 1) | at.raw) & self.o.ready),
        ]
