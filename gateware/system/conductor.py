"""The conductor: takes samples from the readers through the core and puts the results away."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, enum, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from gateware.bitwise import Bitwise, multiplex
from gateware.engine import word_layout
from gateware.system.plan import RAW, RECORD, Plan
from gateware.system.results import ResultPort, Results

__all__ = ["HEADER", "OUTPUTS", "RAWS", "RECORDS", "STAMP", "Conductor", "header_layout"]

#: Places in the result memory: the header, the filter's output record, the input record that it
#: had, and the raw words that this came from.
HEADER, OUTPUTS, RECORDS, RAWS = 0x00, 0x10, 0x20, 0x30
#: The time stamp: beside the header, not among the raw words.
STAMP = 0x01
#: Where the words wait for the filter: of the inertial sample from 0 on, of the field, and a zero.
_FIELD_AT, _ZERO_AT = 8, 15


def header_layout() -> data.StructLayout:
    """Word 0 of the results.

    ``number`` counts updates, 1 the first; one that was never completed leaves a gap. ``filter``:
    which one made it. ``field_used``: the record had a fresh field, ``field_counts``: from
    magnetometer counts, not from a heading. ``restart``: the time step was negative. ``saturated``:
    a value of the filter was clamped.
    """
    return data.StructLayout({"number": 16, "filter": 3, "field_used": 1, "field_counts": 1,
                              "restart": 1, "saturated": 1})


class State(enum.Enum, shape=3):
    """Where in its job the conductor is; codes that are no state count as FLUSH."""

    IDLE = 0
    FEED = 1
    COLLECT = 2
    FINISH = 3
    FLUSH = 4
    TURN = 5


class Job(enum.Enum, shape=2):
    """What the core works at."""

    INERTIAL = 0
    FILTER = 1
    HEADING = 2
    COUNTS = 3


class Source(enum.Enum, shape=2):
    """Where a word for the core comes from."""

    WAITING = 0
    STAMP = 1
    SAMPLE = 2
    LINE = 3


class Conductor(wiring.Component):
    """Drives the core: calibration, filter, results; then the field for the next update.

    Every good inertial sample goes through `calibrate_inertial`, then its words, with those of the
    field or zeros, through the filter. A line of the compass waits until the next update is
    complete, goes through the program for it, and its field is used once, in the update after. The
    core's `calibrate_inertial` is selected as long as nothing is to do.

    The time step is the difference of the stamps of the samples used. It is negative, which
    restarts the filter, for the first sample, after ``restart``, ``run`` low or a watchdog, when
    another filter is chosen, and after a gap (`model.front.inertial.GAP_S`).

    A sample that comes while the last one is worked at is dropped, one that comes during the field
    waits. If the core does not finish a job within `patience` the job is given up: one word with
    ``last`` brings the core back to the start of a record.

    **Latency** `latency` of the filter: cycles from ``sample`` to ``updated``, without writes to
    the core's parameters, each of which can add a few.

    Parameters
    ----------
    plan : Plan
        The core's programs.
    readers : int
        Readers of the results.

    Members
    -------
    time : In(32)
        Running count of clock cycles, for the watchdog.
    sample : In(1)
        A whole sample is there, with its ``stamp``; both must hold still for 500 cycles.
    stamp : In(32)
        Clock cycle of that sample.
    index : Out(3), word : In(16)
        Which word of it (gyro x, y, z, accelerometer x, y, z); the word, in the same cycle.
    line : In(1), is_counts : In(1), values : In(3 x 16)
        A line of the compass has come; magnetometer counts, or heading, pitch and roll.
    filter : In
        Number of the filter; one that none has changes nothing.
    source : In(2)
        Lines that are used: 0 none, 1 counts, 2 headings, 3 any. After a change between the two
        ``restart`` is wise: the strength of the field is another.
    run : In(1)
        Samples are used.
    restart : In(1)
        The next update restarts the filter.
    i : Out(stream), o : In(stream), choice : Out, chosen : In(1), framing : In(1)
        The core (`gateware.engine.Engine` with a selector).
    saturated : In(1)
        Its ``saturated_update``.
    updated : Out(1)
        New results can be taken in this cycle.
    number : Out(16)
        Number of the update that was begun last.
    ports : In(ResultPort) array
        Readers of the results (`HEADER`, `OUTPUTS`, `RECORDS`, `RAWS`, `STAMP`).
    events : Out
        One-cycle pulses, by `EVENTS`.
    """

    #: Meaning of the bits of ``events``.
    EVENTS = ("update", "field_used", "restart", "sample_dropped", "field_dropped", "framing",
              "watchdog")

    def __init__(self, *, plan: Plan, readers: int = 2) -> None:
        if not 1 <= plan.filters <= 8 or not 26 <= plan.word <= 32 or plan.outputs > 16:
            raise ValueError("plan must have 1 to 8 filters, words of 26 to 32 bits and at most "
                             f"16 outputs, not {plan!r}")
        self.plan = plan
        self.readers = readers
        word = plan.word
        super().__init__({
            "time": In(32),
            "sample": In(1),
            "stamp": In(32),
            "index": Out(3),
            "word": In(16),
            "line": In(1),
            "is_counts": In(1),
            "values": In(data.ArrayLayout(16, 3)),
            "filter": In(range(plan.filters)),
            "source": In(2),
            "run": In(1),
            "restart": In(1),
            "i": Out(stream.Signature(word_layout(word))),
            "o": In(stream.Signature(word_layout(word))),
            "choice": Out(range(len(plan.names)), init=plan.inertial),
            "chosen": In(1),
            "framing": In(1),
            "saturated": In(1),
            "updated": Out(1),
            "number": Out(16),
            "ports": In(ResultPort(word=word)).array(readers),
            "events": Out(len(self.EVENTS)),
        })

    @property
    def _watch_bit(self) -> int:
        """The bit of ``time`` that stays for longer than any update takes, half as much again."""
        longest = self.plan.lengths[self.plan.inertial] + max(self.plan.lengths) + 32
        return (longest + longest // 2).bit_length()

    @property
    def patience(self) -> int:
        """Most cycles from the start of a job until it is given up; half of that is the least."""
        return 2 << self._watch_bit

    def latency(self, number: int) -> int:
        """Cycles from ``sample`` to ``updated`` with this filter.

        1 before the first word, the lengths of both programs, 4 for the change of program between
        them, 3 until the second change is seen and the results can be taken.
        """
        return 1 + self.plan.lengths[self.plan.inertial] + 4 + self.plan.lengths[number] + 3

    def elaborate(self, platform: Any) -> Module:
        """Job, state and index; requests from outside; the words to and from the core."""
        m = Module()
        plan = self.plan
        state, job = Signal(State), Signal(Job)
        index, next_index = Signal(4), Signal(4)
        running = Signal.like(self.filter)
        use_field, field_counts, restarting = Signal(), Signal(), Signal()
        fresh, line_waits, line_counts, waiting = Signal(), Signal(), Signal(), Signal()
        restart_next, begin, complete = Signal(init=1), Signal(), Signal()
        is_inertial, is_filter = job == Job.INERTIAL, job == Job.FILTER
        # What the core does in a cycle depends on ``valid``: a register of its own.
        offer, ends = Signal(), Signal()
        fire = offer & self.i.ready

        accepted = self.line & Mux(self.is_counts, self.source[0], self.source[1])
        with m.If(accepted):
            m.d.sync += [line_waits.eq(1), line_counts.eq(self.is_counts)]
        busy = (state != State.IDLE) & ~job.as_value()[1]
        with m.If(self.sample & self.run & ~busy):
            m.d.sync += waiting.eq(1)
        with m.If(self.restart | ~self.run):
            m.d.sync += restart_next.eq(1)
        late = self._watch(m, (state == State.IDLE) | complete)
        self._report(m, {
            "update": self.updated,
            "field_used": self.updated & use_field,
            "restart": self.updated & restarting,
            "sample_dropped": self.sample & self.run & (busy | waiting),
            "field_dropped": accepted & line_waits,
            "framing": self.framing,
            "watchdog": late,
        })

        m.d.comb += [next_index.eq(index), self.i.valid.eq(offer), self.o.ready.eq(1), ends.eq(
            index == Mux(is_inertial, len(RAW) - 1, Mux(is_filter, len(RECORD) - 1, 2)))]
        m.d.sync += [index.eq(next_index), self.updated.eq(complete), offer.eq(0)]
        with m.Switch(state):
            with m.Case(State.IDLE):
                m.d.comb += next_index.eq(0)
                m.d.sync += [job.eq(Job.INERTIAL), self.choice.eq(plan.inertial)]
                with m.If((self.sample | waiting) & self.run):
                    wanted = self.filter
                    if plan.filters < 1 << len(self.filter):
                        wanted = Mux(self.filter < plan.filters, self.filter, running)
                    m.d.comb += begin.eq(1)
                    m.d.sync += [
                        state.eq(State.FEED), offer.eq(self.chosen), waiting.eq(0),
                        self.number.eq(self.number + 1), running.eq(wanted),
                        restart_next.eq(self.restart),
                        restarting.eq(restart_next | (wanted != running)), fresh.eq(0),
                        use_field.eq(fresh & Mux(field_counts, self.source[0], self.source[1])),
                    ]
            with m.Case(State.FEED):
                m.d.sync += offer.eq(self.chosen & ~(fire & ends))
                with m.If(fire):
                    m.d.comb += next_index.eq(Mux(ends, 0, index + 1))
                with m.If(fire & ends):
                    m.d.sync += [state.eq(State.COLLECT),
                                 self.choice.eq(Mux(is_inertial, running, plan.inertial))]
            with m.Case(State.COLLECT):
                with m.If(self.o.valid):
                    m.d.comb += next_index.eq(Mux(self.o.payload.last, 0, index + 1))
                with m.If(self.o.valid & self.o.payload.last):
                    m.d.sync += state.eq(State.FINISH)
                    with m.If(is_inertial):  # the sign of the time step, its last word
                        m.d.sync += restarting.eq(self.o.payload.data[-1])
            with m.Case(State.FINISH):
                m.d.comb += next_index.eq(0)
                with m.If(is_inertial):
                    m.d.sync += [state.eq(State.FEED), job.eq(Job.FILTER)]
                with m.Elif(is_filter):
                    with m.If(self.chosen):
                        m.d.comb += complete.eq(1)
                        m.d.sync += state.eq(State.IDLE)
                    with m.If(self.chosen & line_waits):
                        m.d.sync += [
                            state.eq(State.TURN), line_waits.eq(accepted),
                            job.eq(Mux(line_counts, Job.COUNTS, Job.HEADING)),
                            self.choice.eq(Mux(line_counts, plan.field, plan.compass)),
                            field_counts.eq(line_counts),
                        ]
                with m.Else():
                    # A line that has come since may have changed the words on their way.
                    m.d.sync += [state.eq(State.IDLE), fresh.eq(~line_waits & ~accepted)]
            with m.Case(State.TURN):  # until ``chosen`` is that of the new choice
                m.d.comb += next_index.eq(0)
                m.d.sync += state.eq(State.FEED)
            with m.Default():
                m.d.comb += next_index.eq(0)
                m.d.sync += [offer.eq(~fire), self.choice.eq(plan.inertial), job.eq(Job.INERTIAL),
                             restart_next.eq(1)]
                with m.If(fire):
                    m.d.sync += state.eq(State.IDLE)
        with m.If(late):
            m.d.sync += state.eq(State.FLUSH)

        m.d.comb += [
            self.index.eq(index),
            self.i.payload.last.eq(ends | state.as_value()[2]),
        ]
        self._input(m, job, index, restarting,
                    self._words_that_wait(m, job, index, fire, use_field))
        header = Cat(self.number, running, Const(0, 3 - len(running)), use_field,
                     field_counts & use_field, restarting, self.saturated)
        m.submodules.results = results = Results(word=plan.word, readers=self.readers)
        self._results(m, results, state, job, index, header)
        m.d.comb += [results.begin.eq(begin), results.complete.eq(complete)]
        return m

    def _report(self, m: Module, pulses: dict[str, Value]) -> None:
        """Events in their order."""
        m.d.comb += self.events.eq(Cat(pulses[name] for name in self.EVENTS))

    def _watch(self, m: Module, done: Value) -> Value:
        """A pulse after the watched bit of the time has changed twice without ``done``."""
        bit, once, late = Signal(), Signal(), Signal()
        change = bit ^ self.time[self._watch_bit]
        m.d.sync += [bit.eq(self.time[self._watch_bit]), once.eq((once | change) & ~done),
                     late.eq(once & change)]
        return late

    def _words_that_wait(self, m: Module, job: Signal, index: Signal, fire: Value,
                         use_field: Signal) -> Value:
        """Memory of the calibrated words between the programs; the filter's word number index."""
        m.submodules.waiting = words = memory.Memory(shape=self.plan.word, depth=16, init=[],
                                                     attrs={"ram_style": "block"})
        w_port, r_port = words.write_port(), words.read_port()
        # As they come: gyro, accelerometer, time step; field.
        place = {f"{s}{a}": at + k for s, at in (("g", 0), ("a", 3), ("m", _FIELD_AT))
                 for k, a in enumerate("xyz")} | {"dt": 6}
        # The word of the next cycle: a table of index, ``fire`` and ``use_field``.
        with m.Switch(Cat(index, fire)):
            for k, name in enumerate(RECORD):
                with m.Case(k, k - 1 + 16 if k else k):
                    at: Any = place[name]
                    m.d.comb += r_port.addr.eq(
                        Mux(use_field, at, _ZERO_AT) if at >= _FIELD_AT else at)
        m.d.comb += [
            w_port.addr.eq(Cat(index[:3], job.as_value()[1])),
            w_port.data.eq(self.o.payload.data),
            w_port.en.eq(self.o.valid & (job != Job.FILTER)),
        ]
        return r_port.data

    def _input(self, m: Module, job: Signal, index: Signal, restarting: Signal, waits: Value
               ) -> None:
        """The word for the core."""
        word, bits = self.plan.word, self.plan.count_bits
        source, which = Signal(Source), Signal(2)  # which: of the values
        with m.Switch(job):
            with m.Case(Job.INERTIAL):
                m.d.comb += [which.eq(3), source.eq(Mux(
                    index[:3] < RAW.index("stamp"), Source.SAMPLE,
                    Mux(index[0], Source.LINE, Source.STAMP)))]
            with m.Case(Job.FILTER):
                m.d.comb += source.eq(Source.WAITING)
            with m.Default():
                m.d.comb += [source.eq(Source.LINE), which.eq(index)]
        # The fourth value of a line is the sample's word ``restart``.
        m.submodules.value = value = Bitwise(function=multiplex, inputs=6, width=16)
        m.submodules.high = high = Bitwise(function=multiplex, inputs=6, width=16)
        m.submodules.low = low = Bitwise(function=_either, inputs=4, width=bits)
        value.connect(m, *self.values, Cat(Const(0, 15), restarting), which[0], which[1])
        stamp, (s0, s1) = self.stamp[32 - word:], source.as_value()
        high.connect(m, waits[bits:], stamp[bits:], self.word, value.o, s0, s1)
        low.connect(m, waits[:bits], stamp[:bits], s0, s1)
        m.d.comb += self.i.payload.data.eq(Cat(low.o, high.o))

    def _results(self, m: Module, results: Results, state: Signal, job: Signal, index: Signal,
                 header: Value) -> None:
        """What goes to the result memory when, and its readers."""
        for mine, theirs in zip(self.ports, results.ports, strict=True):
            wiring.connect(m, wiring.flipped(mine), theirs)
        is_filter, region = job == Job.FILTER, Signal(2)
        with m.Switch(state):
            with m.Case(State.FEED):
                m.d.comb += [
                    results.w_en.eq(self.i.valid & self.i.ready & ~job.as_value()[1]),
                    region.eq(Mux(is_filter, RECORDS >> 4, RAWS >> 4)),
                ]
            with m.Case(State.COLLECT):
                m.d.comb += [results.w_en.eq(is_filter & self.o.valid), region.eq(OUTPUTS >> 4)]
            with m.Case(State.FINISH):
                m.d.comb += results.w_en.eq(is_filter)
        m.submodules.put = put = Bitwise(function=_put, inputs=5, width=self.plan.word)
        s0, s1, _ = state.as_value()
        m.d.comb += [
            results.w_index.eq(Mux((region == RAWS >> 4) & (index == RAW.index("stamp")), STAMP,
                                   Cat(index, region))),
            results.w_data.eq(put.connect(m, self.i.payload.data, self.o.payload.data,
                                          Cat(header, Const(0, self.plan.word - len(header))),
                                          s0, s1)),
        ]


def _either(waits: Any, stamp: Any, s0: Any, s1: Any) -> Any:
    """What `multiplex` gives where the other two words have no bits."""
    return multiplex(waits, stamp, 0, 0, s0, s1)


def _put(given: Any, taken: Any, header: Any, s0: Any, s1: Any) -> Any:
    """By the state: FEED, COLLECT, FINISH."""
    return multiplex(given, given, taken, header, s0, s1)
