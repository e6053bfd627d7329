"""The HMR3300 compass on its serial line: bytes to checked numbers, commands, stale data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import Any

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.uart import Receiver, Transmitter, divisor_for
from boresight.model.words.rounded import binary_exponent

#: Bits of a value.
BITS = 16
#: Largest heading, tenths of a degree, and magnitude of pitch and roll (what an inclination can be;
#: the compass itself says it measures to +-60 degrees, maker); largest magnitude of a count.
HEADING_MAX, ANGLE_MAX, COUNT_MAX = 3599, 900, 32_767
#: Maximum spaces before a number.
SPACES_MAX = 7
#: Digits in front of a point, digits of a count.
WHOLE_MAX, DIGITS_MAX = 3, 5


class Step(Enum):
    """State of the parser: the part that it expects."""

    NUMBER = 0  #: a number, or spaces in front of it; also the begin of a line
    FIRST = 1  #: the first digit after a sign
    MORE = 2  #: more digits, a point, or the end of the number
    TENTH = 3  #: the digit after the point
    AFTER = 4  #: the end of a number that has a point
    LF = 5  #: the end of a line that is good so far
    REPLY = 6  #: what follows a leading '#'
    SKIP = 7  #: the end of a line that is not good


#: Classes of bytes with one member.
_SIGNS = {"space": " ", "minus": "-", "point": ".", "comma": ",", "cr": "\r", "lf": "\n"}
_SIGNS |= {"sharp": "#", "refusal": "I"}


class _Line:
    """State of the parser within a line."""

    def __init__(self) -> None:
        self.step = Signal(Step, init=Step.SKIP)
        self.field = Signal(2)  # 0 to 2
        self.count = Signal(3)  # of spaces, then of digits
        self.tenths = Signal()  # its numbers have points
        self.negative = Signal()


class SentenceParser(wiring.Component):
    r"""Bytes to headings and magnetometer counts.

    A line ends with LF. It is good if all of it reads as one of these; all else is rejected, once
    for each line, at its first byte that does not fit::

        heading      _* D{1,3}.D , _* -?D{1,3}.D , _* -?D{1,3}.D CR LF
        counts       _* -?D{1,5} , _* -?D{1,5} , _* -?D{1,5} CR LF
        D 0 to 9, _* up to 7 spaces

    with a heading of at most 359.9, pitch and roll of at most +-90.0 degrees, counts of at
    most +-32,767. There is no plus sign. So no good line is longer than 43 bytes, and "-0.0"
    is 0. A line that begins with ``#I`` is the compass's answer to a command that it does not
    take; it counts as that and not as rejected, and the rest of it is skipped. A byte with a
    framing error spoils its line, and so does a pause in it: the rest may belong to the next one.

    **Latency** ``line`` comes `latency` cycles after LF. A byte may come in every cycle.
    """

    #: Cycles from the LF of a good line to ``line``.
    latency = 3

    def __init__(self) -> None:
        super().__init__(
            {
                "data": In(8),
                "valid": In(1),
                "error": In(1),  # a byte had a framing error
                "pause": In(1),  # one that is longer than in any good line
                "line": Out(1),  # a good one; ``values`` and ``is_counts`` are new, and stay
                "is_counts": Out(1),  # else heading, pitch, roll
                "values": Out(signed(BITS)).array(3),  # counts, or tenths of a degree
                "rejected": Out(1),  # a line
                "invalid": Out(1),  # the compass has rejected a command
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        valid = Signal()
        error = Signal()
        m.d.sync += [valid.eq(self.valid), error.eq(self.error)]
        nibble = Signal(4)
        classes = {"digit": (self.data[4:] == 3) & (self.data[:4] < 10)}
        classes |= {name: self.data == ord(sign) for name, sign in _SIGNS.items()}
        byte = {name: Signal(name=name) for name in classes}
        m.d.sync += nibble.eq(self.data[:4])
        m.d.sync += [byte[name].eq(condition) for name, condition in classes.items()]

        line = _Line()
        step, field, tenths = line.step, line.field, line.tenths
        values, over = self._arithmetic(m, valid, nibble, byte, line)
        good = Signal()
        kind = Signal()
        m.d.sync += [good.eq(0), self.line.eq(good), self.rejected.eq(0), self.invalid.eq(0)]
        with m.If(good):
            m.d.sync += self.is_counts.eq(kind)
            for k, value in enumerate(self.values):
                m.d.sync += value.eq(values.word_select(k, BITS))
        at_begin, following = self._following(m, byte, line, over)

        with m.If(valid):
            m.d.sync += [
                step.eq(following),
                self.rejected.eq((following == Step.SKIP) & (step != Step.SKIP)),
            ]
            self._advance(m, byte, line)
            with m.If((step == Step.REPLY) & byte["refusal"]):
                m.d.sync += [self.invalid.eq(1), self.rejected.eq(0)]
            with m.If(byte["lf"]):
                m.d.sync += [step.eq(Step.NUMBER), field.eq(0), tenths.eq(0)]
                with m.If(step == Step.LF):
                    m.d.sync += [good.eq(1), kind.eq(~tenths), self.rejected.eq(0)]
        with m.Elif(error | (self.pause & ~at_begin)):
            m.d.sync += [step.eq(Step.SKIP), self.rejected.eq(step != Step.SKIP)]
        return m

    def _arithmetic(
        self, m: Module, valid: Signal, nibble: Signal, byte: Mapping[str, Signal], line: _Line
    ) -> tuple[Signal, Value]:
        """The last three values, and whether the number so far is too large for its place."""
        number = Signal(range(10**DIGITS_MAX))
        values = Signal(3 * BITS)
        value = (number ^ line.negative.replicate(len(number))) + line.negative
        tenfold = (number << 3) + (number << 1) + nibble
        with m.If(valid & ~byte["point"]):
            m.d.sync += number.eq(Mux(byte["digit"], tenfold, 0))
        with m.If(valid & (byte["comma"] | byte["cr"])):
            m.d.sync += values.eq(Cat(values[BITS:], value[:BITS]))
        angle = Mux(line.field == 0, HEADING_MAX, ANGLE_MAX)
        return values, number > Mux(line.tenths, angle, COUNT_MAX)

    def _following(
        self, m: Module, byte: Mapping[str, Signal], line: _Line, over: Value
    ) -> tuple[Signal, Signal]:
        """Whether a line has not begun yet, and the parser's next state."""
        step, count, field = line.step, line.count, line.field
        at_begin = Signal()
        following = Signal(Step)
        m.d.comb += at_begin.eq((step == Step.NUMBER) & (field == 0) & (count == 0))
        m.d.comb += following.eq(Step.SKIP)

        def end_of_number() -> None:
            with m.If(byte["comma"] & ~field[1] & ~over):
                m.d.comb += following.eq(Step.NUMBER)
            with m.If(byte["cr"] & field[1] & ~over):
                m.d.comb += following.eq(Step.LF)

        with m.Switch(step):
            with m.Case(Step.NUMBER):
                with m.If(byte["space"] & (count != SPACES_MAX)):
                    m.d.comb += following.eq(Step.NUMBER)
                with m.If(byte["minus"]):
                    m.d.comb += following.eq(Step.FIRST)
                with m.If(byte["digit"]):
                    m.d.comb += following.eq(Step.MORE)
                with m.If(byte["sharp"] & at_begin):
                    m.d.comb += following.eq(Step.REPLY)
            with m.Case(Step.FIRST), m.If(byte["digit"]):
                m.d.comb += following.eq(Step.MORE)
            with m.Case(Step.MORE):
                with m.If(byte["digit"] & (count != DIGITS_MAX)):
                    m.d.comb += following.eq(Step.MORE)
                signed_as_it_may = Mux(field == 0, ~line.negative, line.tenths)
                with m.If(byte["point"] & (count <= WHOLE_MAX) & signed_as_it_may):
                    m.d.comb += following.eq(Step.TENTH)
                with m.If(~line.tenths):
                    end_of_number()
            with m.Case(Step.TENTH), m.If(byte["digit"]):
                m.d.comb += following.eq(Step.AFTER)
            with m.Case(Step.AFTER):
                end_of_number()
            with m.Case(Step.LF, Step.REPLY, Step.SKIP):
                pass
        return at_begin, following

    def _advance(self, m: Module, byte: Mapping[str, Signal], line: _Line) -> None:
        with m.If(line.step == Step.NUMBER):
            m.d.sync += line.negative.eq(byte["minus"])
        with m.If((line.step == Step.MORE) & byte["point"]):
            m.d.sync += line.tenths.eq(1)
        # Spaces or digits: as many as before and one; the first digit is 1.
        ends = byte["comma"] | byte["cr"] | byte["lf"]
        first = byte["digit"] & (line.step == Step.NUMBER)
        with m.If(ends | (line.step == Step.FIRST) | first):
            m.d.sync += line.count.eq(byte["digit"])
        with m.Else():
            m.d.sync += line.count.eq(line.count + 1)
        with m.If(byte["comma"]):
            m.d.sync += line.field.eq(Cat(line.field == 0, line.field[0]))


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

    With ``mode`` 0 no attempt begins. One under way is finished, so that the compass is not left
    stopped.

    Times are in ticks: a time-out comes with the tick after ``timeout_ticks`` whole ones (made one
    less than a power of two), the line is quiet ``quiet_ticks`` after a byte.
    """

    def __init__(self, *, timeout_ticks: int, quiet_ticks: int) -> None:
        self.timeout_ticks = (1 << timeout_ticks.bit_length()) - 1
        self.quiet_ticks = quiet_ticks
        super().__init__(
            {
                "mode": In(2),  # 0 any sentences, 1 heading sentences, 2 and 3 counts
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
        m = Module()
        at = _Sequence(self.timeout_ticks.bit_length())
        stage, left, manual, raw, tries = at.stage, at.left, at.manual, at.raw, at.tries
        timer, sending = at.timer, at.sending
        silence = Signal(self.quiet_ticks.bit_length())  # ticks, up to all ones
        quiet, expired, wanted, other = (
            Signal(name=n) for n in ("quiet", "expired", "wanted", "other")
        )
        m.d.comb += [
            quiet.eq(silence.all()),
            expired.eq(self.tick & timer.all()),
            other.eq(self.line & self.mode.any() & (self.is_counts ^ self.mode[1])),
            wanted.eq(self.line & ~other),
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
                    with m.Elif((expired | other) & self.mode.any()):
                        m.d.sync += at.go_to(Stage.STOP, command=True)
                        with m.If(quiet):
                            m.d.sync += at.go_to(Stage.SELECT)
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
        left, of_stage = at.left, Mux(self.mode[1], ord("M"), ord("H"))
        of_stage = Mux(at.stage != Stage.SELECT, ord("S"), of_stage)
        letter = Mux(at.manual, self.command.payload[:8], of_stage)
        first = Mux(left[0], ord("\n"), Const(ord("*"), 8))
        return [
            self.o.payload.eq(Mux(left[1], Mux(left[0], letter, ord("\r")), first)),
            self.command.ready.eq(at.manual & (left == 3) & self.o.ready),
            self.sent.eq(((left == 1) | at.raw) & self.o.ready),
        ]


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

    ``baud`` is the rate of the line; ``stale_s`` the time without a good sentence after which the
    last one is stale; ``quiet_s`` the time without a byte that means: stopped, more than from
    sentence to sentence (1 / `LINES_HZ`); ``timeout_s`` the longest time that a command may take to
    have its effect, and that no wanted sentence may come before commands are sent, more than the
    compass's start of about 0.8 s (maker's sibling part).
    """

    #: Bit k of ``events``: heading or counts sentence that is good; line that is not, byte without
    #: stop bit; command sent, had its effect, had none in time (or was refused in a sequence),
    #: refusal (#I) by the compass; the last sentence became stale.
    EVENTS = (
        *("heading_line", "counts_line", "rejected_line", "framing_error", "command_sent"),
        *("command_acknowledged", "command_timed_out", "invalid_command", "went_stale"),
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
            timeout_ticks=self._ticks(timeout_s), quiet_ticks=self._ticks(quiet_s) + 1
        )
        super().__init__(
            {
                "rx": In(1, init=1),  # asynchronous
                "tx": Out(1, init=1),
                "time": In(32),  # clock cycles, free-running: beat of the slow counters
                "mode": In(2),  # 0 any sentences, 1 heading, 2 and 3 magnetometer counts
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
