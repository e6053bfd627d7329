"""The update controller: takes samples through the core's programs and stores the results."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.csr import packed
from boresight.gateware.attitude.bus.results import ResultPort, Results
from boresight.gateware.attitude.sensors.adis16385_device import FRACTION
from boresight.gateware.attitude.system.conductor_words import (
    Job,
    State,
    Step,
    StreamBuffer,
    Words,
    last_words,
    table,
)
from boresight.gateware.attitude.system.interface import HEADER
from boresight.gateware.attitude.system.plan import plan_of, reset_word
from boresight.gateware.bus.signature import BusSignature
from boresight.gateware.core import Core
from boresight.gateware.engine.engine import Engine


class Conductor(wiring.Component):
    """The core with its update controller: calibration, filter, results, field.

    Every good inertial sample goes through `calibrate_inertial`, then its words, with those of the
    field or zeros, through the filter. A line of the compass waits until the next update is
    complete, goes through the program for it, and its field is used once, in the update after
    that. `calibrate_inertial` is selected while the controller is idle.

    The time step is the difference of the stamps of the samples used. It is negative, which
    restarts the filter, for the first sample, after ``restart``, ``run`` low or a watchdog, when
    another filter is chosen, and after a gap (`model.attitude.front.inertial.GAP_S`).

    Words of a record that no sensor gives come from input registers. They are written one by one;
    ``feed_take`` copies all of them to the controller's memory while no estimator is being fed, so
    that every update reads one complete set. ``feed_busy`` is high until the last one is copied;
    no word is written meanwhile.

    A sample that comes during the update of the last one is dropped, one that comes while the field
    is computed waits. If the core does not finish a job within `patience`, the job is aborted: one
    word with ``last`` brings the core back to the start of a record.

    With a core whose memories have a register behind them (`Machine.has`), so have the results, and
    two words wait between controller and core.

    **Latency** `latency` of the filter: cycles from ``sample`` to ``updated``, without writes to
    the core's parameters or a new set of input registers, each of which can add a few. The first
    update of a filter after a reset loads its states, in `Image.restarts` cycles more; the states
    of program 0 are loaded at the reset.
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

    def __init__(self, *, core: Core) -> None:
        self.core = core
        self.plan = plan = plan_of(core)
        #: Cycles to read a result.
        self.read_cycles = 2 if core.machine.has("memory") else 1
        word = plan.word
        feed = {"feed_en": In(1), "feed_index": In(5), "feed_data": In(word)}
        feed |= {"feed_take": In(1), "feed_busy": Out(1)}
        super().__init__(
            {
                "time": In(32),  # running count of clock cycles, for the watchdog
                # A complete sample with the clock cycle of its edge: stable for 500 cycles.
                "sample": In(1),
                "stamp": In(32),
                # Which word of it, gyro and accelerometer x, y, z; the word, in the same cycle.
                "index": Out(3),
                "word": In(16 + FRACTION),
                # A line of the compass has come: magnetometer counts, or heading, pitch and roll.
                "line": In(1),
                "is_counts": In(1),
                "values": In(data.ArrayLayout(16, 3)),
                "filter": In(range(plan.filters)),  # unused numbers are ignored
                # Lines that are used: 0 none, 1 counts, 2 headings, 3 any. After a change between
                # the two ``restart`` is advisable, since the strength of the field differs.
                "source": In(2),
                "run": In(1),  # samples are used
                "restart": In(1),  # the next update restarts the filter
                # The update after the next begins from its initial states, if of the same filter.
                "load_states": In(1),
                "choice": Out(range(len(plan.names)), init=plan.inertial),  # told to the core
                "updated": Out(1),  # new results can be taken in this cycle
                "number": Out(16),  # of the update that was begun last
                "from_initial": Out(1),  # the update of ``updated`` began from initial states
                "beyond": Out(1),  # an input word of it was beyond its declared range
                "last_output": Out(4),  # number of its last output word
                "ports": In(ResultPort(word=word)).array(2),  # by `interface.Place`
                "events": Out(len(self.EVENTS)),
                # The core's registers: parameters and status. The program is not chosen here.
                # Writes take 2 cycles more than those of a core, to be acknowledged early.
                "bus": In(BusSignature(word=word)),
                **(feed if plan.feed.registers else {}),
            }
        )

    @property
    def _watch_bit(self) -> int:
        """Bit of ``time`` whose half period is longer than 1.5 times any update."""
        loading = self.core.image.restarts
        longest = max(self.latency(number) + cycles for number, cycles in enumerate(loading))
        return (longest + longest // 2).bit_length()

    @property
    def patience(self) -> int:
        """Maximum cycles from the start of a job until it is aborted; the minimum is half of it."""
        return 2 << self._watch_bit

    def latency(self, number: int) -> int:
        """Cycles from ``sample`` to ``updated`` with this filter.

        1 before the first word, the lengths of calibration and filter, 4 for the change between
        the two, 3 until the last change is seen and the results can be taken; and 1 for each of
        the two if words wait before the core.
        """
        lengths = self.plan.lengths
        waits = 2 if self.read_cycles == 2 else 0
        return 1 + lengths[self.plan.inertial] + 4 + lengths[number] + 3 + waits

    def elaborate(self, platform: Any) -> Module:
        """Requests from outside; job, state and count; the words to and from the core."""
        m = Module()
        s = Step(self.plan)
        m.submodules.engine = engine = Engine(
            machine=self.core.machine, image=self.core.image, selector=True
        )
        i = self._to_core(m, s, engine)
        # While the filter ends, since it is still selected: its next update loads its states.
        m.d.comb += engine.restart.eq(s.load & (s.job == Job.FILTER) & (s.state == State.COLLECT))
        with m.If(engine.restarting & (s.job == Job.FILTER)):
            m.d.sync += s.initial.eq(1)
        with m.Elif(self.updated):
            m.d.sync += s.initial.eq(0)
        self._bus(m, engine)
        fire = s.offer & i.ready
        accepted = self.line & Mux(self.is_counts, self.source[0], self.source[1])
        late = self._requests(m, s, accepted, engine.framing)
        words = Words(self, s, i=i, o=engine.o, fire=fire)
        new_set = self._registers(m, s, words)
        m.d.comb += [s.next_count.eq(s.count), i.valid.eq(s.offer), engine.o.ready.eq(1)]
        ends = [s.count == last_words(self.plan, s, before=n) for n in range(2)]
        m.d.sync += [
            s.count.eq(s.next_count),
            s.ends.eq(Mux(fire, ends[1], ends[0])),
            self.updated.eq(s.complete),
            s.offer.eq(0),
        ]
        with m.If(s.complete):
            m.d.sync += self.beyond.eq(engine.beyond_update)
        with m.Switch(s.state):
            with m.Case(State.IDLE):
                self._idle(m, s)
            with m.Case(State.FEED):
                self._feed(m, s, fire)
            with m.Case(State.COLLECT):
                self._collect(m, s, engine.o)
            with m.Case(State.FINISH):
                self._finish(m, s, accepted, new_set)
            with m.Case(State.TURN):  # until ``chosen`` is that of the new choice
                m.d.comb += s.next_count.eq(0)
                m.d.sync += s.state.eq(State.FEED)
            with m.Default():
                self._flush(m, s, fire)
        with m.If(late):
            m.d.sync += [s.state.eq(State.FLUSH), s.ends.eq(1)]
        self._outputs(m, s, words, i.payload, engine.saturated_update)
        return m

    def _to_core(self, m: Module, s: Step, engine: Engine) -> Any:
        """The stream to the core and the choice of its program, through a buffer if it is deep."""
        if self.read_cycles == 1:
            m.d.comb += [engine.choice.eq(self.choice), s.chosen.eq(engine.chosen)]
            return engine.i
        m.submodules.words = words = StreamBuffer(layout=engine.i.payload.shape())
        wiring.connect(m, words.o, engine.i)
        # Words of a record that wait are of the program chosen for them.
        choice = Signal.like(self.choice)
        same = Signal()  # as of the cycle before, like the engine's ``chosen``
        with m.If(words.empty):
            m.d.sync += choice.eq(self.choice)
        m.d.sync += same.eq(choice == self.choice)
        m.d.comb += [engine.choice.eq(choice), s.chosen.eq(engine.chosen & same)]
        return words.i

    def _bus(self, m: Module, engine: Engine) -> None:
        """The core's registers: strobe and acknowledgement of a write through flip-flops."""
        bus, core = self.bus, engine.bus
        done = Signal()
        m.d.comb += [
            core.addr.eq(bus.addr),
            core.w_data.eq(bus.w_data),
            bus.r_data.eq(core.r_data),
            bus.w_ack.eq(done),
        ]
        m.d.sync += [core.w_stb.eq(bus.w_stb & ~core.w_ack & ~done), done.eq(core.w_ack)]

    def _requests(self, m: Module, s: Step, accepted: Value, framing: Value) -> Value:
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
        with m.If(s.complete & s.load):
            m.d.sync += s.restart_next.eq(1)
        with m.If(self.load_states):
            m.d.sync += s.load_next.eq(1)
        late = self._watch(m, (s.state == State.IDLE) | s.complete)
        pulses = {
            "update": self.updated,
            "field_used": self.updated & s.use_field,
            "restart": self.updated & s.restarting,
            "sample_dropped": self.sample & self.run & (busy | s.waiting),
            "field_dropped": self.line & s.line_waits,
            "framing": framing,
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
                s.offer.eq(s.chosen),
                s.waiting.eq(0),
                self.number.eq(self.number + 1),
                s.running.eq(wanted),
                s.restart_next.eq(self.restart),
                s.restarting.eq(s.restart_next | (wanted != s.running)),
                s.asked.eq(s.restart_next | (wanted != s.running)),
                s.load.eq(s.load_next),
                s.load_next.eq(self.load_states),
                s.fresh.eq(0),
                s.use_field.eq(s.fresh & Mux(s.field_counts, self.source[0], self.source[1])),
            ]

    def _feed(self, m: Module, s: Step, fire: Value) -> None:
        """Feed the record, then choose the next state."""
        m.d.sync += s.offer.eq(s.chosen & ~(fire & s.ends))
        with m.If(fire):
            m.d.comb += s.next_count.eq(Mux(s.ends, 0, s.count + 1))
        with m.If(fire & s.ends):
            m.d.sync += [
                s.state.eq(State.COLLECT),
                self.choice.eq(Mux(s.job == Job.INERTIAL, s.running, self.plan.inertial)),
            ]

    def _collect(self, m: Module, s: Step, o: Any) -> None:
        """Collect output words."""
        ended: Value = o.valid & o.payload.last
        if self.plan.early:
            ended = ended | s.ended
        with m.If(o.valid):
            m.d.comb += s.next_count.eq(Mux(o.payload.last, 0, s.count + 1))
        with m.If(ended):
            m.d.sync += s.state.eq(State.FINISH)
            with m.If(s.job == Job.INERTIAL):  # the sign of the time step, its last word
                m.d.sync += s.restarting.eq(o.payload.data[-1])

    def _finish(self, m: Module, s: Step, accepted: Value, new_set: Value) -> None:
        """Choose the next job."""
        plan = self.plan
        m.d.comb += s.next_count.eq(0)
        with m.If(s.job == Job.INERTIAL):  # unless the registers' words are still on their way
            m.d.sync += [
                s.state.eq(Mux(new_set, State.FINISH, State.FEED)),
                s.job.eq(Mux(new_set, Job.INERTIAL, Job.FILTER)),
            ]
        with m.Elif(s.job == Job.FILTER):
            with m.If(s.chosen):
                m.d.comb += s.complete.eq(1)
                m.d.sync += s.state.eq(State.IDLE)
            with m.If(s.chosen & s.line_waits):
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
        """Input registers, and their copy to the memory. Returns whether a copy is under way."""
        plan = self.plan
        if not plan.feed.registers:
            return Const(0)
        mask = (1 << plan.word) - 1
        m.submodules.registers = registers = memory.Memory(
            shape=plan.word,
            depth=32,
            init=[reset_word(value) & mask for value in plan.feed.registers.values()],
            attrs={"ram_style": "distributed"},
        )
        w_port, r_port = registers.write_port(), registers.read_port()
        wanted = Signal()
        going = Signal()
        index = Signal(5)
        following = Signal(5)
        ready = ~words.calibrated
        done = going & ready & (index == len(plan.feed.registers) - 1)
        m.d.comb += [
            w_port.addr.eq(self.feed_index),
            w_port.data.eq(self.feed_data),
            w_port.en.eq(self.feed_en & ~self.feed_busy),
            r_port.addr.eq(following),
            following.eq(Mux(going, index + ready, 0)),
            self.feed_busy.eq(wanted | going),
            words.set_valid.eq(going),
            words.set_index.eq(index),
            words.set_data.eq(r_port.data),
        ]
        m.d.sync += index.eq(following)
        with m.If(self.feed_take):
            m.d.sync += wanted.eq(1)
        with m.If(wanted & (s.state == State.IDLE) & ~s.begin & ~going):
            m.d.sync += [going.eq(1), wanted.eq(0)]
        with m.If(s.complete):
            m.d.sync += s.set_fresh.eq(0)
        with m.If(done):
            m.d.sync += [going.eq(0), s.set_fresh.eq(1)]
        return going

    def _outputs(self, m: Module, s: Step, words: Words, payload: Any, saturated: Value) -> None:
        """Words to the core and to the results."""
        plan = self.plan
        m.submodules.results = results = Results(word=plan.word, read_cycles=self.read_cycles)
        for mine, theirs in zip(self.ports, results.ports, strict=True):
            wiring.connect(m, wiring.flipped(mine), theirs)
        words.remember(m)
        m.d.comb += [
            results.complete.eq(s.complete),
            self.index.eq(s.count),
            self.last_output.eq(table(s.running, [n - 1 for n in plan.outputs])),
            self.from_initial.eq(s.initial),
            payload.last.eq(s.ends),
            payload.data.eq(words.offered(m)),
        ]
        header = packed(
            HEADER,
            {
                "number": self.number,
                "filter": s.running,
                "field_used": s.use_field,
                "field_counts": s.field_counts & s.use_field,
                "restart": s.restarting,
                "saturated": saturated,
                "restart_asked": s.asked,
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
