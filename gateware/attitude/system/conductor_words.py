"""The words of the update controller: sources of those for the core, targets of its results."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import memory, stream, wiring
from amaranth.lib.data import Layout
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.results import Results
from boresight.gateware.attitude.sensors.adis16385_device import FRACTION
from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.attitude.system.plan import (
    FIELD,
    HELD,
    RAW,
    REGISTERS,
    Fed,
    Plan,
    reset_word,
)
from boresight.gateware.engine.bitwise import Bitwise, multiplex


class State(Enum):
    """State within a job; unused codes count as FLUSH."""

    IDLE, FEED, COLLECT, FINISH, FLUSH, TURN = range(6)


class Job(Enum):
    """Job of the core."""

    INERTIAL, FILTER, HEADING, COUNTS = range(4)


class Source(Enum):
    """Source of a word for the core."""

    WAITING, STAMP, SAMPLE, LINE = range(4)


class Step:
    """Registers of the update controller, and signals between its parts."""

    def __init__(self, plan: Plan) -> None:
        self.state = Signal(State)
        self.job = Signal(Job)
        self.count = Signal(4)
        self.next_count = Signal(4)
        self.running = Signal(range(plan.filters))  # the estimator of the update
        self.use_field = Signal()  # the update at work has a fresh field
        self.restarting = Signal()  # ... a negative time step
        self.restart_next = Signal(init=1)
        self.asked = Signal()  # for the restart, whatever the time step
        self.load_next = Signal()  # an order to load the initial states waits for an update
        self.load = Signal()  # the update at work ends with it
        self.initial = Signal(init=1)  # the update at work began from them
        self.waiting = Signal()  # a sample
        self.line_waits = Signal()  # a line of the compass, not yet at work
        self.line_counts = Signal()  # ... with counts
        self.line_alone = Signal()  # none has come since the one at work
        self.fresh = Signal()  # a field that no update has used
        self.field_counts = Signal()  # ... from counts
        self.bank = Signal()  # where the last whole field stands, if it is held
        self.set_fresh = Signal()  # the input registers' words are new
        self.begin = Signal()
        self.complete = Signal()
        # The core's clock enable depends on the word offered and whether it ends a record.
        self.offer = Signal()
        self.ends = Signal()
        self.ended = Signal()  # the last word has come before the record was given
        self.chosen = Signal()  # the core runs ``choice`` since the cycle before


def table(index: Value, entries: Sequence[Any]) -> Value:
    """Entry with a number; the last one for larger numbers."""
    entries = [Value.cast(e) for e in entries]
    first = entries[0]
    equal = all(
        isinstance(e, Const) and isinstance(first, Const) and e.value == first.value
        for e in entries
    )
    if len(entries) == 1 or equal:
        return first
    chosen = entries[-1]
    for k in reversed(range(len(entries) - 1)):
        chosen = Mux(index == k, entries[k], chosen)
    return chosen


def last_words(plan: Plan, s: Step, *, before: int = 0) -> Value:
    """Number of the word so many ``before`` the last one of the current job's record."""
    last = 1 + before
    counts = [(len(record) - last) % (1 << len(s.count)) for record in plan.feed.records]
    of_filter = table(s.running, counts)
    is_inertial, is_filter = s.job == Job.INERTIAL, s.job == Job.FILTER
    return Mux(is_inertial, len(RAW) - last, Mux(is_filter, of_filter, 3 - last))


class Words:
    """The words between the programs, to the core and to the results.

    ``calibrated``: a word of a program before the estimators is written to the memory in this
    cycle; ``set_valid``, ``set_index``, ``set_data``: a word of an input register, if permitted.
    ``conductor`` has the members for the words of the sensors.
    """

    def __init__(self, conductor: Any, s: Step, *, i: Any, o: Any, fire: Value) -> None:
        self.conductor, self.plan, self.s = conductor, conductor.plan, s
        self.i, self.o, self.fire = i, o, fire
        self.calibrated = o.valid & (s.job != Job.FILTER)
        self.waits = Signal(self.plan.word)
        self.set_valid = Signal()
        self.set_index = Signal(5)
        self.set_data = Signal(self.plan.word)

    def remember(self, m: Module) -> None:
        """The memory: calibrated words, constants, registers; the next word of the record."""
        s, o, feed = self.s, self.o, self.plan.feed
        depth = 64 if feed.wide else 16
        init = [0] * depth
        mask = (1 << self.plan.word) - 1
        for k, value in enumerate(feed.registers.values()):
            init[REGISTERS + k] = reset_word(value) & mask
        for k, constant in enumerate(feed.constants):
            init[HELD + k] = constant & mask
        m.submodules.calibrated = words = memory.Memory(
            shape=self.plan.word,
            depth=depth,
            init=init if feed.wide else [],
            attrs={"ram_style": "block"},
        )
        w_port = words.write_port()
        r_port = words.read_port()
        m.d.comb += self.waits.eq(r_port.data)
        self._address(m, r_port.addr)
        field_bank = s.job[1] & ~s.bank if feed.holds else Const(0)
        m.d.comb += [
            w_port.addr.eq(Cat(s.count[:3], s.job[1], field_bank)),
            w_port.data.eq(o.payload.data),
            w_port.en.eq(self.calibrated),
        ]
        if feed.registers:
            with m.If(~self.calibrated):
                m.d.comb += [
                    w_port.addr.eq(Cat(self.set_index, Const(1))),
                    w_port.data.eq(self.set_data),
                    w_port.en.eq(self.set_valid),
                ]

    def _address(self, m: Module, address: Value) -> None:
        """Place of the next cycle's word: a table of count, ``fire`` and fresh data."""
        s = self.s
        records = self.plan.feed.records
        distinct = sorted(set(records), key=records.index)
        which = table(s.running, [distinct.index(r) for r in records])
        with m.Switch(which):
            for number, record in enumerate(distinct):
                case = m.Case(number) if number < len(distinct) - 1 else m.Default()
                with case, m.Switch(Cat(s.count, self.fire)):
                    for k, fed in enumerate(record):
                        with m.Case(k, k - 1 + 16 if k else k):
                            m.d.comb += address.eq(self._address_of(fed))

    def _address_of(self, fed: Fed) -> Any:
        s = self.s
        address: Any = fed.place
        if fed.place in FIELD and self.plan.feed.holds:
            address = Mux(s.bank, fed.place + HELD, fed.place)
        if fed.absent is None:
            return address
        new = Const(1)
        if fed.field:
            new = s.use_field
        if fed.registers:
            new = s.set_fresh & new if fed.field else s.set_fresh
        return Mux(new, address, fed.absent)

    def offered(self, m: Module) -> Value:
        """The word for the core: from the memory, or raw."""
        s, bits = self.s, self.plan.count_bits
        source = Signal(Source)
        which = Signal(2)  # number of the value
        with m.Switch(s.job):
            with m.Case(Job.INERTIAL):
                counts = Const((1 << RAW.index("stamp")) - 1, 8).bit_select(s.count[:3], 1)
                rest = Mux(s.count[0], Source.LINE, Source.STAMP)
                m.d.comb += [which.eq(3), source.eq(Mux(counts, Source.SAMPLE, rest))]
            with m.Case(Job.FILTER):
                m.d.comb += source.eq(Source.WAITING)
            with m.Default():
                m.d.comb += [source.eq(Source.LINE), which.eq(s.count)]
        # The fourth value of a line is the sample's word ``restart``.
        m.submodules.value = value = Bitwise(function=multiplex, inputs=6, width=16)
        m.submodules.high = high = Bitwise(function=multiplex, inputs=6, width=16)
        m.submodules.low = low = Bitwise(function=_either, inputs=5, width=bits)
        value.connect(
            m, *self.conductor.values, Cat(Const(0, 15), s.restarting), which[0], which[1]
        )
        stamp, (s0, s1) = self.conductor.stamp[32 - self.plan.word :], source
        fraction = Cat(Const(0, bits - FRACTION), self.conductor.word[:FRACTION])
        high.connect(
            m, self.waits[bits:], stamp[bits:], self.conductor.word[FRACTION:], value.o, s0, s1
        )
        low.connect(m, self.waits[:bits], stamp[:bits], fraction, s0, s1)
        return Cat(low.o, high.o)

    def put_away(self, m: Module, results: Results, header: Value) -> None:
        """Write words to the result memory."""
        s, i, o = self.s, self.i, self.o
        is_filter = s.job == Job.FILTER
        region = Signal(2)
        count = s.count
        taking = s.state
        if self.plan.early:
            # Words may come while the record is fed, but never both in a cycle.
            number = Signal(4)
            early = Signal()
            m.d.comb += early.eq((s.state == State.FEED) & o.valid)
            count, taking = Mux(early, number, s.count), Mux(early, State.COLLECT, s.state)
            count = Mux(s.state == State.COLLECT, number, count)
            # Not those of a record that the watchdog has completed: they come before INERTIAL's.
            with m.If(o.valid & (s.job == Job.FILTER)):
                m.d.sync += [number.eq(number + 1), s.ended.eq(o.payload.last)]
            with m.If((s.state == State.FINISH) | (s.state == State.IDLE)):
                m.d.sync += [number.eq(0), s.ended.eq(0)]
        with m.Switch(taking):
            with m.Case(State.FEED):
                m.d.comb += [
                    results.w_en.eq(i.valid & i.ready),
                    region.eq(Mux(is_filter, Place.INPUTS >> 4, Place.RAWS >> 4)),
                ]
            with m.Case(State.COLLECT):
                m.d.comb += [results.w_en.eq(is_filter & o.valid), region.eq(Place.OUTPUTS >> 4)]
            with m.Case(State.FINISH):
                m.d.comb += results.w_en.eq(is_filter)
        m.submodules.put = put = Bitwise(function=_put, inputs=5, width=results.word)
        s0, s1, _ = Value.cast(taking)
        of_line = s.job[1] << Place.LINE.bit_length() - 3
        is_stamp = (region == Place.RAWS >> 4) & (count == RAW.index("stamp"))
        header = Cat(header, Const(0, results.word - len(header)))
        m.d.comb += [
            results.w_index.eq(Mux(is_stamp, Place.STAMP, Cat(count, region) | of_line)),
            results.w_data.eq(put.connect(m, i.payload.data, o.payload.data, header, s0, s1)),
        ]


def _either(waits: Any, stamp: Any, sample: Any, s0: Any, s1: Any) -> Any:
    """`multiplex` of bits that a line's words lack."""
    return multiplex(waits, stamp, sample, 0, s0, s1)


def _put(offered: Any, collected: Any, header: Any, s0: Any, s1: Any) -> Any:
    """Word to write, by the state: FEED, COLLECT, FINISH."""
    return multiplex(offered, offered, collected, header, s0, s1)


class StreamBuffer(wiring.Component):
    """A buffer of two words: every output is a register, and a word can pass in each cycle.

    **Latency** 1 cycle. ``empty``: no word is inside.
    """

    def __init__(self, *, layout: Layout) -> None:
        self.layout = layout
        words = stream.Signature(layout)
        super().__init__({"i": In(words), "o": Out(words), "empty": Out(1)})

    def elaborate(self, platform: Any) -> Module:
        """The first word is on the output; the second waits while it is not taken."""
        m = Module()
        full = Signal()
        second = Signal(self.layout)
        m.d.comb += [self.i.ready.eq(~full), self.empty.eq(~self.o.valid)]
        with m.If(self.o.ready | ~self.o.valid):
            m.d.sync += [self.o.valid.eq(self.i.valid | full), full.eq(0)]
            m.d.sync += self.o.payload.eq(self.i.payload)
            with m.If(full):
                m.d.sync += self.o.payload.eq(second)
        with m.Elif(self.i.valid):
            m.d.sync += full.eq(1)
        with m.If(~full):
            m.d.sync += second.eq(self.i.payload)
        return m
