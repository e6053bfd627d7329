"""The update controller: takes samples through the core and stores the results."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.feed_registers import FeedRegisters
from boresight.gateware.attitude.bus.results import ResultPort, Results
from boresight.gateware.attitude.sensors.adis16385_frames import FRACTION
from boresight.gateware.attitude.system.conductor_words import (
    Job,
    State,
    Step,
    Words,
    last_words,
    table,
)
from boresight.gateware.attitude.system.feed import reset_word
from boresight.gateware.attitude.system.interface import HEADER
from boresight.gateware.attitude.system.plan import Plan
from boresight.gateware.bus.csr import packed
from boresight.gateware.engine.engine import word_layout


class Conductor(wiring.Component):
    """The update controller: calibration, filter, results; then the field for the next update.

    Every good inertial sample goes through `calibrate_inertial`, then its words, with those of the
    field or zeros, through the filter, after those estimators whose words it reads (its chain). A
    line of the compass waits until the next update is complete, goes through the program for it,
    and its field is used once, in the update after that. `calibrate_inertial` is selected while
    the controller is idle.

    The time step is the difference of the stamps of the samples used. It is negative, which
    restarts the filter, for the first sample, after ``restart``, ``run`` low or a watchdog, when
    another filter is chosen, and after a gap (`model.attitude.front.inertial.GAP_S`).

    Words of a record that no sensor gives come from registers, whose words an update takes all
    together (`gateware.attitude.bus.feed_registers`).

    A sample that comes during the update of the last one is dropped, one that comes while the field
    is computed waits. If the core does not finish a job within `patience`, the job is aborted: one
    word with ``last`` brings the core back to the start of a record.

    **Latency** `latency` of the filter: cycles from ``sample`` to ``updated``, without writes to
    the core's parameters or a new set of input registers, each of which can add a few.

    Parameters
    ----------
    plan : Plan
        The core's programs.
    readers : int
        Readers of the results.
    read_cycles : int
        Of the results.

    Members
    -------
    time : In(32)
        Running count of clock cycles, for the watchdog.
    sample : In(1)
        A complete sample with its ``stamp``; both must be stable for 500 cycles.
    stamp : In(32)
        Clock cycle of that sample.
    index : Out(3), word : In(16 + FRACTION)
        Which word of it (gyro x, y, z, accelerometer x, y, z); the word, in the same cycle.
    line : In(1), is_counts : In(1), values : In(3 * 16)
        A line of the compass has come; magnetometer counts, or heading, pitch and roll.
    filter : In
        Number of the filter; unused numbers are ignored.
    source : In(2)
        Lines that are used: 0 none, 1 counts, 2 headings, 3 any. After a change between the two
        ``restart`` is advisable, since the strength of the field differs.
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
    last_output : Out(4)
        Number of the last output word of the update of ``updated``.
    ports : In(ResultPort(word=W)) array
        Readers of the results (`gateware.attitude.system.interface.Place`).
    events : Out
        One-cycle pulses, by `EVENTS`.
    feed_en : In(1), feed_index : In(5), feed_data : In(W), feed_take : In(1), feed_busy : Out(1)
        Input registers, see `FeedRegisters`; only if an estimator has some.
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

    def __init__(self, *, plan: Plan, readers: int = 2, read_cycles: int = 1) -> None:
        self.plan = plan
        self.readers = readers
        self.read_cycles = read_cycles
        word = plan.word
        feed = {
            "feed_en": In(1),
            "feed_index": In(5),
            "feed_data": In(word),
            "feed_take": In(1),
            "feed_busy": Out(1),
        }
        super().__init__(
            {
                "time": In(32),
                "sample": In(1),
                "stamp": In(32),
                "index": Out(3),
                "word": In(16 + FRACTION),
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
                "last_output": Out(4),
                "ports": In(ResultPort(word=word)).array(readers),
                "events": Out(len(self.EVENTS)),
                **(feed if plan.feed.registers else {}),
            }
        )

    @property
    def _watch_bit(self) -> int:
        """Bit of ``time`` whose half period is longer than 1.5 times any update."""
        lengths = self.plan.lengths
        chains = [sum(lengths[k] for k in chain) for chain in self.plan.chains]
        longest = lengths[self.plan.inertial] + max(*chains, *lengths) + 32
        return (longest + longest // 2).bit_length()

    @property
    def patience(self) -> int:
        """Maximum cycles from the start of a job until it is aborted; the minimum is half of it."""
        return 2 << self._watch_bit

    def latency(self, number: int) -> int:
        """Cycles from ``sample`` to ``updated`` with this filter.

        1 before the first word, the lengths of all programs, 4 for the change of program between
        two of them, 3 until the last change is seen and the results can be taken.
        """
        lengths = [self.plan.lengths[k] for k in (self.plan.inertial, *self.plan.chains[number])]
        return 1 + sum(lengths) + 4 * (len(lengths) - 1) + 3

    def elaborate(self, platform: Any) -> Module:
        """Requests from outside; job, state and count; the words to and from the core."""
        m = Module()
        s = Step(self.plan)
        fire = s.offer & self.i.ready
        accepted = self.line & Mux(self.is_counts, self.source[0], self.source[1])
        late = self._requests(m, s, accepted)
        words = Words(
            self.plan,
            s,
            i=self.i,
            o=self.o,
            fire=fire,
            stamp=self.stamp,
            word=self.word,
            values=self.values,
        )
        new_set = self._registers(m, s, words)
        m.d.comb += [s.next_count.eq(s.count), self.i.valid.eq(s.offer), self.o.ready.eq(1)]
        ends = [s.count == last_words(self.plan, s, before=n) for n in range(2)]
        m.d.sync += [
            s.count.eq(s.next_count),
            s.ends.eq(Mux(fire, ends[1], ends[0])),
            self.updated.eq(s.complete),
            s.offer.eq(0),
        ]
        with m.Switch(s.state):
            with m.Case(State.IDLE):
                self._idle(m, s)
            with m.Case(State.FEED):
                self._feed(m, s, fire)
            with m.Case(State.COLLECT):
                self._collect(m, s)
            with m.Case(State.FINISH):
                self._finish(m, s, accepted, new_set)
            with m.Case(State.TURN):  # until ``chosen`` is that of the new choice
                m.d.comb += s.next_count.eq(0)
                m.d.sync += s.state.eq(State.FEED)
            with m.Default():
                self._flush(m, s, fire)
        with m.If(late):
            m.d.sync += [s.state.eq(State.FLUSH), s.ends.eq(1)]
        self._outputs(m, s, words)
        return m

    def _requests(self, m: Module, s: Step, accepted: Value) -> Value:
        """Requests of samples, lines, host and clock; events. Returns the watchdog."""
        with m.If(self.line):  # also one that is not used has changed the words
            m.d.sync += [
                s.line_waits.eq(accepted),
                s.line_counts.eq(self.is_counts),
                s.line_alone.eq(0),
            ]
        busy = (s.state != State.IDLE) & ~s.job[1]
        with m.If(self.sample & self.run & ~busy):
            m.d.sync += s.waiting.eq(1)
        with m.If(~self.run):  # its words do not stay
            m.d.sync += s.waiting.eq(0)
        with m.If(self.restart | ~self.run):
            m.d.sync += s.restart_next.eq(1)
        late = self._watch(m, (s.state == State.IDLE) | s.complete)
        pulses = {
            "update": self.updated,
            "field_used": self.updated & s.use_field,
            "restart": self.updated & s.restarting,
            "sample_dropped": self.sample & self.run & (busy | s.waiting),
            "field_dropped": self.line & s.line_waits,
            "framing": self.framing,
            "watchdog": late,
        }
        m.d.comb += self.events.eq(Cat(pulses[name] for name in self.EVENTS))
        return late

    def _idle(self, m: Module, s: Step) -> None:
        """Wait for a sample."""
        plan = self.plan
        m.d.comb += s.next_count.eq(0)
        m.d.sync += [s.job.eq(Job.INERTIAL), self.choice.eq(plan.inertial), s.ends.eq(0)]
        with m.If((self.sample | s.waiting) & self.run):
            wanted: Value = self.filter
            if plan.filters < 1 << len(self.filter):
                wanted = Mux(self.filter < plan.filters, self.filter, s.running)
            m.d.comb += s.begin.eq(1)
            m.d.sync += [
                s.state.eq(State.FEED),
                s.offer.eq(self.chosen),
                s.waiting.eq(0),
                self.number.eq(self.number + 1),
                s.running.eq(wanted),
                s.restart_next.eq(self.restart),
                s.restarting.eq(s.restart_next | (wanted != s.running)),
                s.fresh.eq(0),
                s.use_field.eq(s.fresh & Mux(s.field_counts, self.source[0], self.source[1])),
                s.step.eq(0),
                s.clamped.eq(0),
            ]

    def _feed(self, m: Module, s: Step, fire: Value) -> None:
        """Feed the record, then choose the next state."""
        plan = self.plan
        is_inertial = s.job == Job.INERTIAL
        behind = Mux(s.last, plan.inertial, s.following)
        m.d.sync += s.offer.eq(self.chosen & ~(fire & s.ends))
        with m.If(fire):
            m.d.comb += s.next_count.eq(Mux(s.ends, 0, s.count + 1))
        with m.If(fire & s.ends):
            m.d.sync += [
                s.state.eq(State.COLLECT),
                self.choice.eq(Mux(is_inertial, s.program, behind)),
            ]

    def _collect(self, m: Module, s: Step) -> None:
        """Collect output words."""
        ended: Value = self.o.valid & self.o.payload.last
        if self.plan.early:
            ended = ended | s.ended
        with m.If(self.o.valid):
            m.d.comb += s.next_count.eq(Mux(self.o.payload.last, 0, s.count + 1))
        with m.If(ended):
            m.d.sync += s.state.eq(State.FINISH)
            with m.If(s.job == Job.INERTIAL):  # the sign of the time step, its last word
                m.d.sync += s.restarting.eq(self.o.payload.data[-1])

    def _finish(self, m: Module, s: Step, accepted: Value, new_set: Value) -> None:
        """Choose the next job."""
        plan = self.plan
        m.d.comb += s.next_count.eq(0)
        with m.If(s.job == Job.INERTIAL):  # unless the registers' words are still on their way
            m.d.sync += [
                s.state.eq(Mux(new_set, State.FINISH, State.FEED)),
                s.job.eq(Mux(new_set, Job.INERTIAL, Job.FILTER)),
            ]
        with m.Elif((s.job == Job.FILTER) & ~s.last):
            m.d.sync += [
                s.state.eq(State.FEED),
                s.step.eq(s.step + 1),
                s.clamped.eq(s.clamped | self.saturated),
            ]
        with m.Elif(s.job == Job.FILTER):
            with m.If(self.chosen):
                m.d.comb += s.complete.eq(1)
                m.d.sync += s.state.eq(State.IDLE)
            with m.If(self.chosen & s.line_waits):
                m.d.sync += [
                    s.state.eq(State.TURN),
                    s.line_waits.eq(accepted),
                    s.line_alone.eq(~self.line),
                    s.job.eq(Mux(s.line_counts, Job.COUNTS, Job.HEADING)),
                    self.choice.eq(Mux(s.line_counts, plan.field, plan.compass)),
                    s.field_counts.eq(s.line_counts),
                ]
        with m.Else():
            # A line received since may have changed the words being copied.
            good = s.line_alone & ~self.line
            m.d.sync += [s.state.eq(State.IDLE), s.fresh.eq(good), s.bank.eq(s.bank ^ good)]

    def _flush(self, m: Module, s: Step, fire: Value) -> None:
        """Bring the core back to the start of a record."""
        m.d.comb += s.next_count.eq(0)
        m.d.sync += [
            s.offer.eq(~fire),
            s.ends.eq(1),
            self.choice.eq(self.plan.inertial),
            s.job.eq(Job.INERTIAL),
            s.restart_next.eq(1),
            s.waiting.eq(0),
        ]
        with m.If(fire):
            m.d.sync += s.state.eq(State.IDLE)

    def _registers(self, m: Module, s: Step, words: Words) -> Value:
        """Copy input registers to the memory. Returns whether a copy is under way."""
        registers = self.plan.feed.registers
        if not registers:
            return Const(0)
        m.submodules.registers = unit = FeedRegisters(
            word=self.plan.word, init=[reset_word(value) for value in registers.values()]
        )
        m.d.comb += [
            unit.w_en.eq(self.feed_en),
            unit.w_index.eq(self.feed_index),
            unit.w_data.eq(self.feed_data),
            unit.take.eq(self.feed_take),
            self.feed_busy.eq(unit.busy),
            unit.free.eq((s.state == State.IDLE) & ~s.begin),
            unit.ready.eq(~words.calibrated),
            words.set_valid.eq(unit.valid),
            words.set_index.eq(unit.index),
            words.set_data.eq(unit.data),
        ]
        with m.If(s.complete):
            m.d.sync += s.set_fresh.eq(0)
        with m.If(unit.done):
            m.d.sync += s.set_fresh.eq(1)
        return unit.valid

    def _outputs(self, m: Module, s: Step, words: Words) -> None:
        """Words to the core and to the results."""
        plan = self.plan
        m.submodules.results = results = Results(
            word=plan.word, readers=self.readers, read_cycles=self.read_cycles
        )
        for mine, theirs in zip(self.ports, results.ports, strict=True):
            wiring.connect(m, wiring.flipped(mine), theirs)
        words.remember(m)
        m.d.comb += [
            results.begin.eq(s.begin),
            results.complete.eq(s.complete),
            self.index.eq(s.count),
            self.last_output.eq(table(s.running, [n - 1 for n in plan.outputs])),
            self.i.payload.last.eq(s.ends),
            self.i.payload.data.eq(words.offered(m)),
        ]
        header = packed(
            HEADER,
            {
                "number": self.number,
                "filter": s.running,
                "field_used": s.use_field,
                "field_counts": s.field_counts & s.use_field,
                "restart": s.restarting,
                "saturated": self.saturated | s.clamped,
            },
        )
        words.put_away(m, results, header)

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
