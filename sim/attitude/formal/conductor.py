"""Proofs of the update controller: `gateware.attitude.system.conductor`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from amaranth.hdl import Assert, Assume, Cat, Const, Cover, Module, Mux, Signal, Value
from amaranth.lib.data import View
from amaranth.lib.wiring import In

from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.attitude.system.conductor_words import Job, State, table
from boresight.gateware.attitude.system.feed import HELD, PLACES, REGISTERS, ZERO, Fed, Feed
from boresight.gateware.attitude.system.interface import HEADER, Place
from boresight.gateware.attitude.system.plan import FRONT_NAMES, RAW, Plan
from boresight.gateware.bus.csr import layout_of
from boresight.model.words.program import Kind
from boresight.model.words.program import Value as Declared
from boresight.sim.formal.harness import Harness, after_start, before, fixed, reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PLANS", "PROOFS", "Updates", "Watched"]

#: Words of a line of the compass.
_LINE = 3
#: Bits of a word.
_WORD = 26
_REGISTER = Declared("a", Kind.INPUT, 24, -1.0, 1.0, "declared")


def _plan(records: Sequence[Sequence[Fed]], **options: Any) -> Plan:
    """A plan with these records of the estimators."""
    count = len(records)
    feed = Feed(tuple(map(tuple, records)), **options.pop("feed", {}))
    return Plan(
        word=_WORD,
        names=(*(f"estimator{k}" for k in range(count)), *FRONT_NAMES),
        filters=count,
        lengths=(1,) * (count + len(FRONT_NAMES)),
        feed=feed,
        count_bits=10,
        **options,
    )


#: Plans by name: two estimators, the second of which reads the first; one with input registers
#: that gives words before its record is complete, and reads the last field if there is no new one.
PLANS = {
    "chain": _plan(
        (
            (Fed(PLACES["gz"]), Fed(PLACES["mx"], ZERO, field=True)),
            (Fed(PLACES["dt"]), Fed(PLACES["my"], ZERO, field=True), Fed(PLACES["ax"])),
        ),
        outputs=(2, 1),
        chains=((0,), (0, 1)),
    ),
    "fed": _plan(
        ((Fed(PLACES["dt"]), Fed(REGISTERS + 1), Fed(PLACES["mz"]), Fed(REGISTERS)),),
        outputs=(3,),
        chains=((0,),),
        feed={"registers": {"a": _REGISTER, "b": _REGISTER}, "holds": True},
        early=True,
    ),
}


class _Core:
    """The core, by what the proofs of its sequencer say of it, with any delays.

    It takes the words of a record, gives those of its answer, and looks before the first word
    whether the program changes. If a record's ``last`` is in the wrong place, it begins anew.

    Attributes
    ----------
    program : Signal
        Number of the program.
    taken, given : Signal
        Words of the record, of the answer; both are 0 before a record.
    stale : Signal
        The answer is that to a record that the watchdog completed.
    takes, gives, flows : Value
        A word is taken, given in this cycle; the core does in this cycle what it can do.
    """

    def __init__(self, m: Module, dut: Conductor, flushing: Value, steady: Value) -> None:
        plan = dut.plan
        self.words_in = (*map(len, plan.feed.records), len(RAW), _LINE, _LINE)
        self.words_out = (*plan.outputs, len(RAW) - 1, _LINE, _LINE)
        self.program = program = Signal(range(len(plan.names)), name="program_at_work")
        self.taken, self.given = taken, given = Signal(4, name="taken"), Signal(4, name="given")
        self.stale = stale = Signal(name="stale")
        self.request = request = Signal(name="switch_request")
        self.size_in, self.size_out = table(program, self.words_in), table(program, self.words_out)
        go, full = unknown(m, 1, "go") | steady, taken == self.size_in
        self.first = first = (taken == 0) & (given == 0)
        differs = program != dut.choice
        can_switch, can_take = first & request, ~full & ~(first & request)
        can_give = full
        if plan.early:
            can_give = Mux(program < plan.filters, taken != 0, full)
        can_give &= given != self.size_out
        # A word is taken or given, not both.
        turn = unknown(m, 1, "turn") | steady
        ready = can_take & go & (turn | ~can_give)
        self.takes = takes = dut.i.valid & ready
        self.gives = gives = can_give & go & ~takes & (~turn | ~can_take)
        self.flows = go
        self.data = unknown(m, plan.word, "answer")
        m.d.comb += [
            dut.i.ready.eq(ready),
            dut.o.valid.eq(gives),
            dut.o.payload.data.eq(self.data),
            dut.o.payload.last.eq(given == self.size_out - 1),
            dut.framing.eq(takes & (dut.i.payload.last ^ (taken == self.size_in - 1))),
        ]
        chosen = Signal(name="chosen_before")
        m.d.comb += dut.chosen.eq(chosen)
        m.d.sync += [request.eq(differs & ~(can_switch & go)), chosen.eq(~differs)]
        with m.If(can_switch & go):
            m.d.sync += program.eq(dut.choice)
        taken_next, given_next = Signal(4), Signal(4)
        m.d.comb += [taken_next.eq(taken + takes), given_next.eq(given + gives)]
        m.d.sync += [taken.eq(taken_next), given.eq(given_next)]
        with m.If(takes & flushing & dut.i.payload.last):
            m.d.sync += stale.eq(1)
        with m.If(dut.framing | ((taken_next == self.size_in) & (given_next == self.size_out))):
            m.d.sync += [taken.eq(0), given.eq(0), stale.eq(0)]


class Updates(Harness[Conductor]):
    """Every update is whole, and comes within a bound.

    The core, the sensors' pulses, the host's settings and the watchdog's clock do anything; words
    of a line change with its pulse only. One place of the results, one word of a sensor's answer
    and one input register are followed, each any, but the same always.

    Parameters
    ----------
    dut : Conductor
        Component, of one of `PLANS`, with one reader.
    """

    def __init__(self, dut: Conductor) -> None:
        super().__init__(dut)
        self.plan = dut.plan

    def surround(self, m: Module, dut: Conductor, inside: Inside) -> None:
        """Inputs; the core; then the claims, each with the assertions of its induction."""
        plan = self.plan
        self.inside = inside
        # One of the cases, the same always: nothing stands still, and each update has all there is.
        self.steady = steady = fixed(m, 1, "steady")
        copied = ~dut.feed_busy if plan.feed.registers else 1
        started = after_start(m)
        self.at_start = steady & ~started
        in_steady = {
            "sample": started & copied,
            "time": 0,
            "filter": plan.filters - 1,
            "source": 3,
            "run": 1,
        }
        for name in ("sample", "stamp", "word", "time", "filter", "source", "run", "restart"):
            port = getattr(dut, name)
            value = unknown(m, port.shape(), f"{name}_in")
            m.d.comb += port.eq(Mux(steady, in_steady.get(name, 0), value))
        m.d.comb += dut.saturated.eq(unknown(m, 1, "saturated_in"))
        for name in ("state", "job", "count", "step", "running", "offer", "waiting", "use_field"):
            setattr(self, name, inside[name])
        self.late = inside["late"]
        self.results = inside.parts["results"].component
        self.begin, self.complete = self.results.begin, self.results.complete
        self.core = core = _Core(m, dut, self.state == State.FLUSH, steady)
        step, running, job = self.step, self.running, self.job

        def of_chain(offset: int) -> Value:
            longest = max(map(len, plan.chains))
            return table(
                running,
                [
                    table(step, [c[min(k + offset, len(c) - 1)] for k in range(longest)])
                    for c in plan.chains
                ],
            )

        self.last_step = table(running, [len(c) - 1 for c in plan.chains])
        ours = Signal.like(core.program, name="program_wanted")
        self.ours, self.last = ours, step == self.last_step
        self.of_filter, self.of_sensor = (
            job == Job.FILTER,
            (job == Job.HEADING) | (job == Job.COUNTS),
        )
        m.d.comb += ours.eq(
            Mux(
                job == Job.INERTIAL,
                plan.inertial,
                Mux(self.of_filter, of_chain(0), Mux(job == Job.HEADING, plan.compass, plan.field)),
            )
        )
        self.following = Mux(
            job == Job.INERTIAL,
            of_chain(0),
            Mux(self.of_filter & ~self.last, of_chain(1), plan.inertial),
        )
        self.at_work = (self.state == State.FEED) | (self.state == State.COLLECT)
        self.at_work |= self.state == State.FINISH
        self._order(m)
        self._update(m)
        self._line(m)
        if plan.feed.registers:
            self._registers(m)
        self._sources(m)
        self._bound(m)

    def _is(self, *states: State) -> Value:
        value: Value = Const(0)
        for state in states:
            value = value | (self.state == state)
        return value

    def _order(self, m: Module) -> None:
        """A word goes to the program that it is for, in its place; the program stays."""
        dut, plan, core = self.dut, self.plan, self.core
        job, count, ours = self.job, self.count, self.ours
        feed, flush = self._is(State.FEED), self._is(State.FLUSH)
        first, at_work = core.first, self.at_work
        size_in, size_out = table(ours, core.words_in), table(ours, core.words_out)
        inertial = job == Job.INERTIAL
        ended: Value = Const(0)
        self.fed = fed = core.takes & ~flush
        self.heard = heard = core.gives & ~core.stale & ~flush
        choice_before = before(m, dut.choice, "choice_before", init=plan.inertial)
        m.d.comb += [
            # The claims.
            Assert(~fed | (feed & (core.program == ours) & (core.taken == count))),
            Assert(~fed | (dut.i.payload.last == (count == size_in - 1))),
            Assert(~(fed & (core.taken != 0)) | (dut.choice == choice_before)),
            Assert(~heard | (core.program == ours)),
            Assert(~heard | self._is(State.COLLECT) | (feed & core_early(core, plan))),
            # The controller and the core, for induction.
            Assert(core.program < len(plan.names)),
            Assert((core.taken <= core.size_in) & (core.given <= core.size_out)),
            Assert(~(core.taken == core.size_in) | (core.given != core.size_out)),
            Assert((core.given == 0) | (core.taken == core.size_in) | core_early(core, plan)),
            Assert((core.given == 0) | (core.taken != 0)),
            Assert(~core.stale | (core.taken == core.size_in)),
            Assert(self._is(*State)),
            Assert((self.running < plan.filters) & (self.step <= self.last_step)),
            Assert(~dut.i.valid | feed | flush),
            Assert(~self._is(State.IDLE) | (dut.choice == plan.inertial)),
            Assert(~self._is(State.IDLE) | first | core.stale),
            Assert(~self._is(State.TURN) | (first & self.of_sensor & (dut.choice == ours))),
            Assert(~(at_work & inertial) | (self.step == 0)),
            Assert(~(self.of_sensor & ~flush & ~self._is(State.IDLE)) | self.last),
            Assert(~feed | (dut.choice == ours)),
            Assert(~feed | (count < size_in)),
            Assert(
                ~(feed & (count != 0))
                | ((core.program == ours) & (core.taken == count) & ~core.stale)
            ),
            Assert(~(feed & (count == 0)) | first | (core.stale & inertial)),
            Assert(~(feed & dut.i.valid) | (core.program == ours) | core.request),
            Assert(~(feed & dut.chosen) | (core.program == ours)),
            Assert(
                ~self._is(State.COLLECT, State.FINISH)
                | ((dut.choice == self.following) & ~core.stale)
            ),
            Assert(~self._is(State.FINISH) | first),
        ]
        running = (core.program == ours) & (core.taken == size_in) & ~core.stale
        collects = self._is(State.COLLECT)
        given: Value = Mux(feed, 0, count)
        if plan.early:
            given = Mux(self.of_filter, self.inside["number"], given)
            ended = self.inside["ended"]
            answer_complete = self.of_filter & (core.given == core.size_out)
            m.d.comb += [
                Assert(~feed | (ended == answer_complete)),
                Assert(~collects | ~ended | (first & self.of_filter)),
            ]
        m.d.comb += [
            Assert(~collects | ended | (running & (core.given == given))),
            Assert(~feed | core.stale | ended | (core.given == given)),
        ]
        self.given, self.ended = given, ended
        self.size_in, self.size_out = size_in, size_out

    def _update(self, m: Module) -> None:
        """A complete update has the words of one sample and of one record, and its own header."""
        dut, plan, core, results = self.dut, self.plan, self.core, self.results
        steady = self.steady
        inertial = plan.inertial
        number, filter_ = (
            Signal(16, name="number_begun"),
            Signal.like(self.running, name="chosen_filter"),
        )
        open_ = Signal(name="begun")
        step_sign = Signal(name="turned")  # the sign of this update's time step
        m.d.sync += open_.eq((open_ | self.begin) & ~self.complete & ~self.late)
        with m.If(self.begin):
            m.d.sync += number.eq(dut.number + 1)
            with m.If(dut.filter < plan.filters):
                m.d.sync += filter_.eq(dut.filter)
        fed, heard = self.fed & open_, self.heard & open_
        with m.If(heard & (core.program == inertial) & dut.o.payload.last):
            m.d.sync += step_sign.eq(core.data[-1])

        # The followed place: its expected word, and the word that the controller has written.
        place = fixed(m, 6, "place")
        wanted, stored = Signal(1 + plan.word, name="wanted"), Signal(1 + plan.word, name="stored")
        raw = Mux(core.taken == RAW.index("stamp"), Place.STAMP, Place.RAWS + core.taken)
        ours = core.program == filter_
        for hit, word in (
            (fed & (core.program == inertial) & (raw == place), dut.i.payload.data),
            (fed & ours & (Place.INPUTS + core.taken == place), dut.i.payload.data),
            (heard & ours & (Place.OUTPUTS + core.given == place), core.data),
        ):
            with m.If(hit):
                m.d.sync += wanted.eq(Cat(word, 1))
        written = Signal(1 + plan.word, name="written")
        m.d.comb += written.eq(stored)
        with m.If(results.w_en & (results.w_index == place)):
            m.d.comb += written.eq(Cat(results.w_data, 1))
        m.d.sync += stored.eq(written)
        with m.If(self.begin):
            m.d.sync += [wanted.eq(0), stored.eq(0)]
        header: Any = View(layout_of(HEADER, width=plan.word), written[:-1])
        inputs = table(filter_, core.words_in[: plan.filters])
        outputs = table(filter_, core.words_out[: plan.filters])
        region, offset = place[4:], place[:4]
        regular = Mux(
            region == Place.OUTPUTS >> 4,
            offset < outputs,
            Mux(
                region == Place.INPUTS >> 4,
                offset < inputs,
                (region == Place.RAWS >> 4) & (offset < len(RAW)) & (offset != RAW.index("stamp"))
                | (place == Place.STAMP),
            ),
        )
        m.d.comb += [
            # As `results.whole` assumes.
            Assert(~(results.w_en | self.complete) | open_),
            Assert(~(self.begin & (self.complete | results.w_en | open_))),
            # The claims.
            Assert(~(self.complete & regular) | (wanted[-1] & (written == wanted))),
            Assert(~(self.complete & (place == Place.HEADER)) | written[-1]),
            Assert(
                ~(self.complete & (place == Place.HEADER))
                | (
                    (header.number == number)
                    & (header.filter == filter_)
                    & (header.field_used == self.use_field)
                    & (header.restart == step_sign)
                )
            ),
            Assert(dut.updated == before(m, self.complete, "completed")),
            Assert(~open_ | (dut.number == number)),
            Assert(~dut.updated | (dut.last_output == outputs - 1)),
            # For induction.
            Assert((place == Place.HEADER) | (wanted == stored) | ~open_),
            Assert(open_ == (self.at_work & ~self.of_sensor)),
            Assert(filter_ == self.running),
            reached(m, steady & self.complete & (dut.number == 1), "updated"),
        ]
        self.open_, self.filter_ = open_, filter_
        # Which words have come.
        feed, of_filter, last = self._is(State.FEED), self.of_filter, self.last
        finish = self._is(State.FINISH)
        for in_region, count in (
            (region == Place.INPUTS >> 4, Mux(of_filter & last, Mux(feed, self.count, inputs), 0)),
            (
                region == Place.OUTPUTS >> 4,
                Mux(of_filter & last, Mux(finish | self.ended, outputs, self.given), 0),
            ),
        ):
            m.d.comb += Assert(~(open_ & in_region) | (wanted[-1] == (offset < count)))
        word_number = Mux(place == Place.STAMP, RAW.index("stamp"), offset)
        m.d.comb += [
            Assert(
                ~(open_ & regular & ((region == Place.RAWS >> 4) | (place == Place.STAMP)))
                | (wanted[-1] == (~feed | of_filter | (word_number < self.count)))
            ),
            Assert(~(open_ & (of_filter | finish)) | (self.inside["restarting"] == step_sign)),
        ]

    def _line(self, m: Module) -> None:
        """A field is used if its record came from one line, of the kind that is selected, once."""
        dut, plan, core, job = self.dut, self.plan, self.core, self.job
        line = Mux(self.steady, self.begin, unknown(m, 1, "line_in"))
        kind, source = unknown(m, 1, "kind_in"), dut.source
        values = [unknown(m, 16, f"value{k}_in") for k in range(_LINE)]
        kind_now, held_kind = Signal(name="kind_now"), Signal(name="held_kind")
        m.d.comb += [dut.line.eq(line), dut.is_counts.eq(kind_now)]
        m.d.comb += kind_now.eq(Mux(line, kind, held_kind))
        m.d.sync += held_kind.eq(kind_now)
        for k, value in enumerate(values):
            held_value = Signal(16, name=f"held_value{k}")
            m.d.comb += dut.values[k].eq(Mux(line, value, held_value))
            m.d.sync += held_value.eq(dut.values[k])
        # The last line was accepted and no program has had it; it was alone while one had it.
        unused, alone = Signal(name="unused"), Signal(name="alone")
        accepted = line & Mux(kind, source[0], source[1])
        turns = self._is(State.TURN)
        updated = before(m, self.complete, "turning")
        starts = self.complete & unused
        whole, ready = Signal(name="whole"), before(m, starts & ~line, "begun_alone")
        m.d.comb += whole.eq(Mux(turns, ready & (held_kind == (job == Job.COUNTS)), alone))
        m.d.sync += alone.eq(whole & ~line)
        finished = self._is(State.FINISH) & self.of_sensor
        with m.If(line):
            m.d.sync += unused.eq(accepted)
        with m.Elif(starts):
            m.d.sync += unused.eq(0)
        valid = finished & alone & ~line
        fresh, bank = self.inside["fresh"], self.inside["bank"]
        self.field_number = number = fixed(m, 2, "field_word")
        field_now, self.field = Signal(plan.word, name="field_now"), Signal(plan.word, name="field")
        with m.If(self.heard & self.of_sensor & (core.given == number)):
            m.d.sync += field_now.eq(core.data)
        with m.If(valid):
            m.d.sync += self.field.eq(field_now)
        zeros = plan.word - 16
        used = self.steady & self.complete & self.use_field
        cover = [] if plan.feed.holds else [reached(m, used, "field_used")]
        m.d.comb += [
            Assume(number < _LINE),
            *(
                Assert(
                    ~(self.fed & self.of_sensor & (core.taken == k))
                    | (dut.i.payload.data == Cat(Const(0, zeros), dut.values[k]))
                )
                for k in range(_LINE)
            ),
            Assert(
                ~before(m, finished, "field_finished") | (fresh == before(m, valid, "field_good"))
            ),
            Assert(~before(m, fresh & ~self.begin, "was_fresh") | fresh),
            *cover,
            # For induction.
            Assert(~fresh | self._is(State.IDLE, State.FLUSH)),
            Assert(~turns | updated),
            Assert(~(self.of_sensor & self.at_work | turns) | (self.inside["line_alone"] == whole)),
            Assert(self.inside["line_waits"] == unused),
            Assert(~unused | (self.inside["line_counts"] == held_kind)),
        ]
        if not plan.feed.holds:
            bank = Const(0)
        stored = self.inside.word("calibrated", Cat(number, Const(2, 2), bank))
        new_field = self.inside.word("calibrated", Cat(number, Const(2, 2), bank ^ plan.feed.holds))
        word_came = self._is(State.FINISH) | (self._is(State.COLLECT) & (core.given > number))
        used = fresh | (self.open_ & self.use_field) | Const(plan.feed.holds, 1)
        m.d.comb += [
            Assert(~used | (stored == self.field)),
            Assert(~(self.of_sensor & word_came) | (new_field == field_now)),
        ]

    def _registers(self, m: Module) -> None:
        """An update reads one set of the input registers."""
        dut, inside = self.dut, self.inside
        registers, unit = self.plan.feed.registers, inside.parts["registers"]
        writes, index = unknown(m, 1, "feed_en_in"), unknown(m, 5, "feed_index_in")
        word = unknown(m, self.plan.word, "feed_data_in")
        take = Mux(self.steady, self.at_start, unknown(m, 1, "feed_take_in"))
        m.d.comb += [
            dut.feed_en.eq(writes),
            dut.feed_index.eq(index),
            dut.feed_data.eq(word),
            dut.feed_take.eq(take),
        ]
        self.register = number = fixed(m, 5, "register")
        register_now, self.set_word = (
            Signal(self.plan.word, name="register_now"),
            Signal(self.plan.word, name="register_in_set"),
        )
        self.new_set = Signal(name="new_set")
        port = unit.component
        with m.If(writes & ~dut.feed_busy & (index == number)):
            m.d.sync += register_now.eq(word)
        with m.If(port.done):
            m.d.sync += [self.set_word.eq(register_now), self.new_set.eq(1)]
        with m.Elif(self.complete):
            m.d.sync += self.new_set.eq(0)
        copied = port.valid & (port.index > number)
        stored = inside.word("calibrated", Cat(number, Const(1, 1)))
        m.d.comb += [
            Assume(number < len(registers)),
            # The set changes between updates, and before the estimators' records.
            Assert(~(port.valid & self.of_filter & self.at_work)),
            reached(m, self.steady & self.complete & self.new_set, "set_used"),
            # For induction.
            Assert(stored == Mux(copied, register_now, self.set_word)),
            Assert(unit.word("words", number) == register_now),
            Assert(~port.valid | (port.index < len(registers))),
            Assert(~(port.valid & (port.index == number)) | (port.data == register_now)),
            Assert(port.valid == unit["going"]),
            Assert(inside["set_fresh"] == self.new_set),
        ]

    def _sources(self, m: Module) -> None:
        """Each word of an estimator's record is the one that the plan routes to its place."""
        dut, plan, core = self.dut, self.plan, self.core
        number = fixed(m, 3, "sample_word")
        word, word_came = Signal(plan.word, name="word_of_sample"), Signal(name="word_came")
        with m.If(self.heard & (core.program == plan.inertial) & (core.given == number)):
            m.d.sync += [word.eq(core.data), word_came.eq(1)]
        with m.If(self.begin):
            m.d.sync += word_came.eq(0)
        stored = self.inside.word("calibrated", Cat(number, Const(0, 1)))
        given = Mux(self._is(State.COLLECT), core.given, Mux(self._is(State.FEED), 0, len(RAW) - 1))
        feed = self._is(State.FEED)
        m.d.comb += [
            Assume(number < len(RAW) - 1),
            Assert(~self.open_ | (word_came == Mux(self.of_filter, 1, number < given))),
            Assert(~(self.open_ & word_came) | (stored == word)),
        ]
        constants = {ZERO: 0, **{HELD + k: c for k, c in enumerate(plan.feed.constants)}}
        for place, constant in constants.items():
            m.d.comb += Assert(self.inside.word("calibrated", Const(place, 6)) == constant)

        def is_routed(place: int) -> Value:
            if place < len(RAW) - 1:
                return (number != place) | (dut.i.payload.data == word)
            if place in range(PLACES["mx"], PLACES["mz"] + 1):
                is_other_word = self.field_number != place - PLACES["mx"]
                return is_other_word | (dut.i.payload.data == self.field)
            if place >= REGISTERS:
                return (self.register != place - REGISTERS) | (dut.i.payload.data == self.set_word)
            return dut.i.payload.data == constants[place]

        for program, record in enumerate(plan.feed.records):
            for k, source in enumerate(record):
                at_word = feed & self.offer & self.of_filter & (self.ours == program)
                at_word &= self.count == k
                matches = is_routed(source.place)
                if source.absent is not None:
                    matches = Mux(self.use_field, matches, is_routed(source.absent))
                m.d.comb += Assert(~at_word | matches)
        raws = [Cat(Const(0, plan.word - 16), dut.word)] * (len(RAW) - 2)
        raws += [dut.stamp[32 - plan.word :], self.inside["restarting"] << plan.word - 1]
        for k, raw in enumerate(raws):
            at_word = self.fed & (core.program == plan.inertial) & (core.taken == k)
            m.d.comb += Assert(~at_word | ((dut.i.payload.data == raw) & (dut.index == k % 8)))

    def _bound(self, m: Module) -> None:
        """An update is complete, and a sample's words are taken, within so many cycles.

        Cycles count in which the core does what it can do. ``remaining`` is the most there can be
        until the end of the update; each of them makes it smaller.
        """
        dut, plan, core, feeds = self.dut, self.plan, self.core, self._is(State.FEED)
        inertial, request, right = self.job == Job.INERTIAL, core.request, core.program == self.ours
        #: Until the first word is taken; to take and give all words of a program, and to go on.
        first = 6
        records = [i + o + first + 3 for i, o in zip(core.words_in, core.words_out, strict=True)]
        registers = len(plan.feed.registers) + 1
        filters = [
            [sum(records[p] for p in chain[k + 1 :]) + first for k in range(len(chain))]
            for chain in plan.chains
        ]
        longest = max(sum(records[p] for p in chain) + first for chain in plan.chains)
        idle = records[plan.inertial] + registers + longest + 1
        chains = table(self.running, [sum(records[p] for p in c) + first for c in plan.chains])
        after_filter = table(self.running, [table(self.step, costs) for costs in filters])
        after_program = Mux(inertial, registers + chains, Mux(self.of_filter, after_filter, idle))
        # Until the selected program is seen and a word is offered.
        turn = Mux(right, Mux(dut.chosen, 1, 2) + request, Mux(request, 3, 4))
        turn = Mux(right & self.offer, request, turn)
        answer = Mux(core.first, 0, core.size_out - core.given)
        stale = Mux(core.stale, answer, 0)
        answer_left = Mux(self.ended, 0, self.size_out - self.given)
        copy = Const(0)
        if plan.feed.registers:
            unit = self.inside.parts["registers"].component
            copy = Mux(unit.valid, len(plan.feed.registers) - unit.index, 0)
        wait = Mux(dut.chosen, 0, Mux(core.program == dut.choice, 1 + request, Mux(request, 3, 4)))
        ends = Mux(
            inertial,
            1 + copy + chains,
            Mux(self.of_filter, Mux(self.last, 1 + wait, 1 + after_filter), 1 + idle),
        )
        switch = Mux(request, 2, Mux(core.program == plan.inertial, 2 - self.offer, 3))
        taken = Mux(core.first, switch, answer + 5 - self.offer)
        flush = Mux(dut.choice == plan.inertial, taken, answer + 6) + max(core.words_out) + idle
        limit = 6 + 2 * max(core.words_out) + idle
        remaining = Signal(range(2 * limit))
        states = {
            State.IDLE: stale + idle,
            State.FEED: stale + turn + self.size_in - self.count + answer_left + 2 + after_program,
            State.COLLECT: answer_left + 2 + after_program,
            State.FINISH: ends,
            State.TURN: records[plan.field] + idle,
        }
        total: Value = flush
        for state, cycles in states.items():
            total = Mux(self._is(state), cycles, total)
        elapsed = Signal(range(2 * limit))
        m.d.comb += remaining.eq(total)
        with m.If(self.complete | self.late):
            m.d.sync += elapsed.eq(0)
        with m.Elif(core.flows & (~self._is(State.IDLE) | self.begin)):
            m.d.sync += elapsed.eq(elapsed + 1)
        m.d.comb += [Assert(elapsed <= limit), Assert(elapsed + remaining <= limit)]
        self.limit = limit

        # Of the sample whose words are taken, or that waits.
        accepted = dut.sample & dut.run & (self._is(State.IDLE) | self.of_sensor)
        age, limit = (
            Signal(range(2 * limit), name="age"),
            records[plan.field] + records[plan.inertial] + 2,
        )
        with m.If(accepted):
            m.d.sync += age.eq(0)
        with m.Elif(core.flows & (age != limit)):
            m.d.sync += age.eq(age + 1)
        first_word = records[plan.inertial] + 1
        budget = Mux(feeds & inertial, stale + turn + self.size_in - self.count, first_word)
        for state, cycles in (
            (State.TURN, records[plan.field] + first_word),
            (State.FEED, turn + self.size_in - self.count + answer_left + 2 + first_word),
            (State.COLLECT, answer_left + 2 + first_word),
            (State.FINISH, 1 + first_word),
        ):
            budget = Mux(self.of_sensor & self._is(state), cycles, budget)
        m.d.comb += [
            Assert(~(self.fed & (core.program == plan.inertial)) | (age < limit)),
            Assert(~(self.waiting | (feeds & inertial)) | (age + budget <= limit)),
            Assert(~self.waiting | self._is(State.IDLE) | self.of_sensor),
        ]


def core_early(core: _Core, plan: Plan) -> Value:
    """Whether the program gives words before its record is complete."""
    return (core.program < plan.filters) & Const(plan.early, 1)


class Watched(Harness[Conductor]):
    """The watchdog, whatever the core does.

    Parameters
    ----------
    dut : Conductor
        Component, of a plan without input registers.
    """

    def surround(self, m: Module, dut: Conductor, inside: Inside) -> None:
        """Cycles since the controller last waited for a sample or ended an update."""
        patience = dut.patience
        half = patience // 2
        bits = half.bit_length()
        for name, member in dut.signature.members.items():
            if member.flow is In and name not in ("i", "o", "ports", "time", "values"):
                port = getattr(dut, name)
                m.d.comb += port.eq(unknown(m, port.shape(), f"{name}_in"))
        m.d.comb += [
            dut.i.ready.eq(unknown(m, 1, "ready")),
            dut.o.valid.eq(unknown(m, 1, "valid")),
            dut.o.payload.last.eq(unknown(m, 1, "last")),
        ]
        time, time_at_start = Signal(bits), fixed(m, bits, "time_at_start")
        m.d.sync += time.eq(time + 1)
        m.d.comb += dut.time.eq(time + time_at_start)
        state, late = inside["state"], dut.events[dut.EVENTS.index("watchdog")]
        job_ended = (state == State.IDLE) | inside.parts["results"].component.complete
        at_work = Signal(range(2 * patience))
        m.d.sync += at_work.eq(Mux(job_ended | late, 0, at_work + 1))
        aborted, once = Signal(name="aborted"), inside["once"]
        m.d.sync += aborted.eq(~job_ended & (aborted | (late & once)))
        ended_after = before(m, Mux(job_ended, at_work, 0), "ended_after")
        aborted_before = before(m, aborted, "aborted_before")
        phase, watched = dut.time[: bits - 1], dut.time[bits - 1]
        since = Mux(phase == 0, half, phase)  # the watched bit has changed
        watched_before, started = before(m, watched, "watched_before"), after_start(m)
        m.d.comb += [
            # Also one that just ends is aborted.
            Assert(~late | aborted | (at_work >= half) | aborted_before | (ended_after >= half)),
            Assert(at_work <= patience),
            Assert(~before(m, late, "late_before") | (state == State.FLUSH)),
            Cover(late),
            # For induction.
            Assert(inside["bit"] == watched_before),
            Assert(Mux(started, (watched_before ^ watched) == (phase == 0), ~once & ~late)),
            Assert(~aborted | once),
            Assert(~aborted | (at_work < since) | late),
            Assert(aborted | once | (at_work < since)),
            Assert(aborted | ~once | ((at_work >= since) & ((at_work < since + half) | late))),
        ]


def _proof(name: str, cover: int, plan: str) -> Proof:
    return Proof(
        name=f"conductor.updates_{name}",
        depth=12,
        induction=3,
        cover=range(cover, cover + 1),
        short=False,
        reset=False,
        claim=f"Conductor, {plan}, no reset, any core, sensors, settings and watchdog: each word "
        "goes to the program that it is for, in its place, and the program stays for the record; "
        "a complete update's words in the results are those of one sample, of one record and its "
        "answer, and of one field, which is one line's; an update is complete, and a sample's "
        "words are taken, within so many cycles in which the core flows",
        harness=lambda: Updates(Conductor(plan=PLANS[name], readers=1)),
    )


PROOFS = (
    _proof("chain", 97, "an estimator and one that reads it"),
    _proof("fed", 50, "an estimator with input registers and a held field, early answers"),
    Proof(
        name="conductor.watched",
        depth=8,
        induction=2,
        cover=range(140, 141),
        claim="Conductor, any core, sensors and settings: a job that does not end is aborted, "
        "after half of `patience` at the soonest and `patience` cycles at the latest",
        harness=lambda: Watched(Conductor(plan=PLANS["chain"], readers=1)),
    ),
)
