"""The conductor: takes samples from the readers through the core and puts the results away."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.results import ResultPort, Results
from boresight.gateware.engine.engine import word_layout
from boresight.gateware.system.conductor_words import (
    HEADER,
    OUTPUTS,
    RAWS,
    RECORDS,
    STAMP,
    Job,
    State,
    header_layout,
    input_word,
    put_away,
    waiting_words,
)
from boresight.gateware.system.plan import RAW, RECORD, Plan

__all__ = ["HEADER", "OUTPUTS", "RAWS", "RECORDS", "STAMP", "Conductor", "header_layout"]


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
    line : In(1), is_counts : In(1), values : In(3 * 16)
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
        The core (`gateware.engine.engine.Engine` with a selector).
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
    EVENTS = (
        "update",
        "field_used",
        "restart",
        "sample_dropped",
        "field_dropped",
        "framing",
        "watchdog",
    )

    def __init__(self, *, plan: Plan, readers: int = 2) -> None:
        if not 1 <= plan.filters <= 8 or not 26 <= plan.word <= 32 or plan.outputs > 16:
            raise ValueError(
                "plan must have 1 to 8 filters, words of 26 to 32 bits and at most "
                f"16 outputs, not {plan!r}"
            )
        self.plan = plan
        self.readers = readers
        word = plan.word
        super().__init__(
            {
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
            }
        )

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
        """Job, state and count; requests from outside; the words to and from the core."""
        m = Module()
        plan = self.plan
        state = Signal(State)
        job = Signal(Job)
        count = Signal(4)
        next_count = Signal(4)
        running = Signal.like(self.filter)
        use_field = Signal()  # the update at work has a fresh field
        restarting = Signal()  # ... a negative time step
        restart_next = Signal(init=1)
        waiting = Signal()  # a sample
        line_waits = Signal()  # a line of the compass, not yet at work
        line_counts = Signal()  # ... with counts
        fresh = Signal()  # a field that no update has used
        field_counts = Signal()  # ... from counts
        begin = Signal()
        complete = Signal()
        # What the core does in a cycle depends on ``valid``: a register of its own.
        offer = Signal()
        ends = Signal()
        fire = offer & self.i.ready
        is_inertial, is_filter = job == Job.INERTIAL, job == Job.FILTER

        accepted = self.line & Mux(self.is_counts, self.source[0], self.source[1])
        with m.If(accepted):
            m.d.sync += [line_waits.eq(1), line_counts.eq(self.is_counts)]
        busy = (state != State.IDLE) & ~job[1]
        with m.If(self.sample & self.run & ~busy):
            m.d.sync += waiting.eq(1)
        with m.If(self.restart | ~self.run):
            m.d.sync += restart_next.eq(1)
        late = self._watch(m, (state == State.IDLE) | complete)
        self._report(
            m,
            {
                "update": self.updated,
                "field_used": self.updated & use_field,
                "restart": self.updated & restarting,
                "sample_dropped": self.sample & self.run & (busy | waiting),
                "field_dropped": accepted & line_waits,
                "framing": self.framing,
                "watchdog": late,
            },
        )

        m.d.comb += [
            next_count.eq(count),
            self.i.valid.eq(offer),
            self.o.ready.eq(1),
            ends.eq(count == Mux(is_inertial, len(RAW) - 1, Mux(is_filter, len(RECORD) - 1, 2))),
        ]
        m.d.sync += [count.eq(next_count), self.updated.eq(complete), offer.eq(0)]
        with m.Switch(state):
            with m.Case(State.IDLE):
                m.d.comb += next_count.eq(0)
                m.d.sync += [job.eq(Job.INERTIAL), self.choice.eq(plan.inertial)]
                with m.If((self.sample | waiting) & self.run):
                    wanted = self.filter
                    if plan.filters < 1 << len(self.filter):
                        wanted = Mux(self.filter < plan.filters, self.filter, running)
                    m.d.comb += begin.eq(1)
                    m.d.sync += [
                        state.eq(State.FEED),
                        offer.eq(self.chosen),
                        waiting.eq(0),
                        self.number.eq(self.number + 1),
                        running.eq(wanted),
                        restart_next.eq(self.restart),
                        restarting.eq(restart_next | (wanted != running)),
                        fresh.eq(0),
                        use_field.eq(fresh & Mux(field_counts, self.source[0], self.source[1])),
                    ]
            with m.Case(State.FEED):
                m.d.sync += offer.eq(self.chosen & ~(fire & ends))
                with m.If(fire):
                    m.d.comb += next_count.eq(Mux(ends, 0, count + 1))
                with m.If(fire & ends):
                    m.d.sync += [
                        state.eq(State.COLLECT),
                        self.choice.eq(Mux(is_inertial, running, plan.inertial)),
                    ]
            with m.Case(State.COLLECT):
                with m.If(self.o.valid):
                    m.d.comb += next_count.eq(Mux(self.o.payload.last, 0, count + 1))
                with m.If(self.o.valid & self.o.payload.last):
                    m.d.sync += state.eq(State.FINISH)
                    with m.If(is_inertial):  # the sign of the time step, its last word
                        m.d.sync += restarting.eq(self.o.payload.data[-1])
            with m.Case(State.FINISH):
                m.d.comb += next_count.eq(0)
                with m.If(is_inertial):
                    m.d.sync += [state.eq(State.FEED), job.eq(Job.FILTER)]
                with m.Elif(is_filter):
                    with m.If(self.chosen):
                        m.d.comb += complete.eq(1)
                        m.d.sync += state.eq(State.IDLE)
                    with m.If(self.chosen & line_waits):
                        m.d.sync += [
                            state.eq(State.TURN),
                            line_waits.eq(accepted),
                            job.eq(Mux(line_counts, Job.COUNTS, Job.HEADING)),
                            self.choice.eq(Mux(line_counts, plan.field, plan.compass)),
                            field_counts.eq(line_counts),
                        ]
                with m.Else():
                    # A line that has come since may have changed the words on their way.
                    m.d.sync += [state.eq(State.IDLE), fresh.eq(~line_waits & ~accepted)]
            with m.Case(State.TURN):  # until ``chosen`` is that of the new choice
                m.d.comb += next_count.eq(0)
                m.d.sync += state.eq(State.FEED)
            with m.Default():
                m.d.comb += next_count.eq(0)
                m.d.sync += [
                    offer.eq(~fire),
                    self.choice.eq(plan.inertial),
                    job.eq(Job.INERTIAL),
                    restart_next.eq(1),
                ]
                with m.If(fire):
                    m.d.sync += state.eq(State.IDLE)
        with m.If(late):
            m.d.sync += state.eq(State.FLUSH)

        m.submodules.results = results = Results(word=plan.word, readers=self.readers)
        for mine, theirs in zip(self.ports, results.ports, strict=True):
            wiring.connect(m, wiring.flipped(mine), theirs)
        waits = waiting_words(m, self.o, job=job, count=count, fire=fire, use_field=use_field)
        m.d.comb += [
            results.begin.eq(begin),
            results.complete.eq(complete),
            self.index.eq(count),
            self.i.payload.last.eq(ends | state[2]),
            self.i.payload.data.eq(
                input_word(
                    m,
                    plan,
                    job=job,
                    count=count,
                    waits=waits,
                    stamp=self.stamp,
                    word=self.word,
                    values=self.values,
                    restarting=restarting,
                )
            ),
        ]
        put_away(
            m,
            results,
            self.i,
            self.o,
            state=state,
            job=job,
            count=count,
            header=Cat(
                self.number,
                running,
                Const(0, 3 - len(running)),
                use_field,
                field_counts & use_field,
                restarting,
                self.saturated,
            ),
        )
        return m

    def _report(self, m: Module, pulses: dict[str, Value]) -> None:
        """Events in their order."""
        m.d.comb += self.events.eq(Cat(pulses[name] for name in self.EVENTS))

    def _watch(self, m: Module, done: Value) -> Value:
        """A pulse after the watched bit of the time has changed twice without ``done``."""
        bit = Signal()
        once = Signal()
        late = Signal()
        change = bit ^ self.time[self._watch_bit]
        m.d.sync += [
            bit.eq(self.time[self._watch_bit]),
            once.eq((once | change) & ~done),
            late.eq(once & change),
        ]
        return late
