"""The update controller: takes samples through the core's programs and stores the results."""

from __future__ import annotations

from enum import Enum
from typing import Any

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.data import Layout
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.sensors.adis16385 import FRACTION
from boresight.gateware.attitude.system import programs
from boresight.gateware.attitude.system.csr import ResultPort, Results, packed
from boresight.gateware.attitude.system.interface import HEADER, Place
from boresight.gateware.bus.core_registers import BusSignature
from boresight.gateware.core import Core
from boresight.gateware.engine.engine import Engine
from boresight.gateware.engine.parts import Bitwise, multiplex


class State(Enum):
    """State within a job; unused codes count as TURN."""

    IDLE, FEED, COLLECT, FINISH, TURN = range(5)


class Job(Enum):
    """Job of the core."""

    INERTIAL, FILTER, HEADING, COUNTS = range(4)


class Step:
    """Registers of the update controller, and signals between its parts."""

    def __init__(self, plan: programs.Plan) -> None:
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


def last_words(plan: programs.Plan, s: Step, *, before: int = 0) -> Value:
    """Number of the word so many ``before`` the last one of the current job's record."""
    last = 1 + before
    counts = [(len(record) - last) % (1 << len(s.count)) for record in plan.feed.records]
    is_inertial, is_filter = s.job == Job.INERTIAL, s.job == Job.FILTER
    of_filter = Mux(is_filter, Array(counts)[s.running], 3 - last)
    return Mux(is_inertial, len(programs.RAW) - last, of_filter)


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
        self.waits = Signal(programs.WORD)
        self.set_valid = Signal()
        self.set_index = Signal(5)
        self.set_data = Signal(programs.WORD)

    def remember(self, m: Module) -> None:
        """The memory: calibrated words, constants, registers; the next word of the record."""
        s, o, feed = self.s, self.o, self.plan.feed
        depth = 64 if feed.wide else 16
        init = [0] * depth
        mask = (1 << programs.WORD) - 1
        for k, value in enumerate(feed.registers.values()):
            init[programs.REGISTERS + k] = programs.reset_word(value) & mask
        for k, constant in enumerate(feed.constants):
            init[programs.HELD + k] = constant & mask
        m.submodules.calibrated = words = memory.Memory(
            shape=programs.WORD,
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
        which = Array([distinct.index(r) for r in records])[s.running]
        with m.Switch(which):
            for number, record in enumerate(distinct):
                case = m.Case(number) if number < len(distinct) - 1 else m.Default()
                with case, m.Switch(Cat(s.count, self.fire)):
                    for k, fed in enumerate(record):
                        with m.Case(k, k - 1 + 16 if k else k):
                            m.d.comb += address.eq(self._address_of(fed))

    def _address_of(self, fed: programs.Fed) -> Any:
        s = self.s
        address: Any = fed.place
        if fed.place in programs.FIELD and self.plan.feed.holds:
            address = Mux(s.bank, fed.place + programs.HELD, fed.place)
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
        waits, stamp, sample = self.waits, self.conductor.stamp, self.conductor.word
        source = Signal(2)  # a word that waits, stamp, sample, line
        which = Signal(2)  # number of a line's value; the fourth one is ``restart``
        with m.Switch(s.job):
            with m.Case(Job.INERTIAL):
                of_sample = s.count[:3] < programs.RAW.index("stamp")
                m.d.comb += [which.eq(3), source.eq(Mux(of_sample, 2, Mux(s.count[0], 3, 1)))]
            with m.Case(Job.HEADING, Job.COUNTS):
                m.d.comb += [which.eq(s.count), source.eq(3)]
        m.submodules.value = value = Bitwise(function=multiplex, inputs=6, width=16)
        m.submodules.offered = word = Bitwise(function=multiplex, inputs=6, width=programs.WORD)
        value.connect(m, *self.conductor.values, Cat(Const(0, 15), s.restarting), *which)
        low = Const(0, bits)
        return word.connect(
            m, waits, stamp, Cat(low[FRACTION:], sample), Cat(low, value.o), *source
        )

    def put_away(self, m: Module, results: Results, header: Value) -> None:
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
        of_line = s.job[1] << Place.LINE.bit_length() - 3
        is_stamp = (region == Place.RAWS >> 4) & (count == programs.RAW.index("stamp"))
        index = Mux(is_stamp, Place.STAMP, Cat(count, region) | of_line)
        m.submodules.put = put = Bitwise(function=multiplex, inputs=6, width=programs.WORD)
        offered, collected, (s0, s1, _) = i.payload.data, o.payload.data, Value.cast(taking)
        m.d.comb += [
            results.w_index.eq(index),
            results.w_data.eq(put.connect(m, offered, offered, collected, header, s0, s1)),
        ]


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


class Conductor(wiring.Component):
    """The core with its update controller: calibration, filter, results, field.

    Every good inertial sample goes through `calibrate_inertial`, then its words, with those of the
    field or zeros, through the filter. A line of the compass waits until the next update is
    complete, goes through the program for it, and its field is used once, in the update after
    that. `calibrate_inertial` is selected while the controller is idle.

    The time step is the difference of the stamps of the samples used. It is negative, which
    restarts the filter, for the first sample, after ``restart`` or ``run`` low, when another filter
    is chosen, and after a gap (`model.attitude.front.GAP_S`).

    Words of a record that no sensor gives come from input registers. They are written one by one;
    ``feed_take`` copies all of them to the controller's memory while no estimator is being fed, so
    that every update reads one complete set. ``feed_busy`` is high until the last one is copied;
    no word is written meanwhile.

    A sample that comes during the update of the last one is dropped, one that comes while the field
    is computed waits.

    With a core whose memories have a register behind them (`Machine.has`), so have the results, and
    two words wait between controller and core.

    **Latency** `latency` of the filter: cycles from ``sample`` to ``updated``, without writes to
    the core's parameters or a new set of input registers, each of which can add a few. The first
    update of a filter after a reset loads its states, in `Image.restarts` cycles more; the states
    of program 0 are loaded at the reset.
    """

    #: Meaning of the bits of ``events``.
    EVENTS = ("update", "field_used", "restart", "sample_dropped", "field_dropped", "framing")

    def __init__(self, *, core: Core) -> None:
        self.core = core
        self.plan = plan = programs.plan_of(core)
        #: Cycles to read a result.
        self.read_cycles = 2 if core.machine.has("memory") else 1
        feed = {"feed_en": In(1), "feed_index": In(5), "feed_data": In(programs.WORD)}
        feed |= {"feed_take": In(1), "feed_busy": Out(1)}
        super().__init__(
            {
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
                "ports": In(ResultPort()).array(2),  # by `interface.Place`
                "events": Out(len(self.EVENTS)),
                # The core's registers: parameters and status. The program is not chosen here.
                # Writes take 2 cycles more than those of a core: acknowledged early in a cycle.
                "bus": In(BusSignature(word=programs.WORD)),
                **(feed if plan.feed.registers else {}),
            }
        )

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
        # The core's registers: strobe and acknowledgement of a write pass flip-flops.
        bus, core = self.bus, engine.bus
        done = Signal()
        m.d.comb += [
            core.addr.eq(bus.addr),
            core.w_data.eq(bus.w_data),
            bus.r_data.eq(core.r_data),
            bus.w_ack.eq(done),
        ]
        m.d.sync += [core.w_stb.eq(bus.w_stb & ~core.w_ack & ~done), done.eq(core.w_ack)]
        fire = s.offer & i.ready
        accepted = self.line & Mux(self.is_counts, self.source[0], self.source[1])
        self._requests(m, s, accepted, engine.framing)
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
            with m.Default():  # TURN: until ``chosen`` is that of the new choice
                m.d.comb += s.next_count.eq(0)
                m.d.sync += s.state.eq(State.FEED)
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

    def _requests(self, m: Module, s: Step, accepted: Value, framing: Value) -> None:
        """Requests of samples, lines and host; events."""
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
        with m.If(self.restart | ~self.run | (s.complete & s.load)):
            m.d.sync += s.restart_next.eq(1)
        with m.If(self.load_states):
            m.d.sync += s.load_next.eq(1)
        pulses = {
            "update": self.updated,
            "field_used": self.updated & s.use_field,
            "restart": self.updated & s.restarting,
            "sample_dropped": self.sample & self.run & (busy | s.waiting),
            "field_dropped": self.line & s.line_waits,
            "framing": framing,
        }
        m.d.comb += self.events.eq(Cat(pulses[name] for name in self.EVENTS))

    def _idle(self, m: Module, s: Step) -> None:
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
        m.d.sync += s.offer.eq(s.chosen & ~(fire & s.ends))
        with m.If(fire):
            m.d.comb += s.next_count.eq(Mux(s.ends, 0, s.count + 1))
        with m.If(fire & s.ends):
            m.d.sync += [
                s.state.eq(State.COLLECT),
                self.choice.eq(Mux(s.job == Job.INERTIAL, s.running, self.plan.inertial)),
            ]

    def _collect(self, m: Module, s: Step, o: Any) -> None:
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

    def _registers(self, m: Module, s: Step, words: Words) -> Value:
        """Input registers, and their copy to the memory. Returns whether a copy is under way."""
        plan = self.plan
        if not plan.feed.registers:
            return Const(0)
        mask = (1 << programs.WORD) - 1
        m.submodules.registers = registers = memory.Memory(
            shape=programs.WORD,
            depth=32,
            init=[programs.reset_word(value) & mask for value in plan.feed.registers.values()],
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
        plan = self.plan
        m.submodules.results = results = Results(read_cycles=self.read_cycles)
        for mine, theirs in zip(self.ports, results.ports, strict=True):
            wiring.connect(m, wiring.flipped(mine), theirs)
        words.remember(m)
        m.d.comb += [
            results.complete.eq(s.complete),
            self.index.eq(s.count),
            self.last_output.eq(Array([n - 1 for n in plan.outputs])[s.running]),
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
