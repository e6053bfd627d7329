"""The conductor alone, beside a core that the test plays: order of words, faults, any state."""

import random
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest
from amaranth.hdl import Module

from boresight.gateware.attitude.system import conductor
from boresight.gateware.attitude.system.conductor import Conductor
from boresight.gateware.attitude.system.conductor_words import Step
from boresight.gateware.attitude.system.feed import FIELD, HELD, PLACES, REGISTERS, ZERO, Fed, Feed
from boresight.gateware.attitude.system.interface import HEADER, Place
from boresight.gateware.attitude.system.plan import FRONT_NAMES, RAW, Plan
from boresight.model.nine_axis import INPUTS
from boresight.model.words.program import Kind, Value
from tests.support.bench import Pins, Simulation
from tests.support.clock import pause

RECORD = tuple(i.name for i in INPUTS)
NINE_AXIS = tuple(
    Fed(PLACES[n], ZERO, field=True) if n[0] == "m" else Fed(PLACES[n]) for n in RECORD
)
VALUE = Value("a", Kind.INPUT, 30, -1.0, 1.0, "declared")
PLAN = Plan(
    word=32,
    names=("one", "two", "three", *FRONT_NAMES),
    filters=3,
    lengths=(60, 80, 70, 20, 15, 18),
    outputs=(8, 8, 8),
    chains=((0,), (1,), (2,)),
    feed=Feed((NINE_AXIS,) * 3),
    count_bits=16,
)
#: With one estimator of one output, whose feed a test gives.
#: Words of the input and output records of each program.
RECORDS_IN = (10, 10, 10, 8, 3, 3)
RECORDS_OUT = (8, 8, 8, 7, 3, 3)
MASK = (1 << 32) - 1
FIELDS = {field.name: field for field in HEADER}


_MADE: dict[str, tuple[Conductor, Pins, Simulation]] = {}


def _made(plan: Plan) -> tuple[Conductor, Pins, Simulation]:
    """The conductor of a plan, made once, and all that is `watched`."""
    if repr(plan) not in _MADE:
        top, dut = Module(), Conductor(plan=plan)
        top.submodules.dut = dut
        shown = Pins(top, watched(dut))
        _MADE[repr(plan)] = dut, shown, Simulation(top)
    return _MADE[repr(plan)]


class Bench:
    """A conductor, a core that answers word k of program p with ``answer``, and readers."""

    def __init__(
        self,
        plan: Plan = PLAN,
        seed: int = 0,
        *,
        records_in: tuple[int, ...] = RECORDS_IN,
        records_out: tuple[int, ...] = RECORDS_OUT,
    ) -> None:
        self.records_in, self.records_out = records_in, records_out
        self.clamps: tuple[int, ...] = ()  # programs whose updates saturate
        self.early = False  # programs 0 to 2 give their words before the last of the record
        self.dut, self.shown, self.simulation = _made(plan)
        self.plan = plan
        self.rng = random.Random(seed)
        self.records: list[tuple[int, list[int]]] = []
        self.events: list[str] = []
        self.updates = 0
        self.broken = False  # the core stands still
        self.restarting = False  # ... gives a negative time step
        self.words = [0] * 6
        self.framing = 0
        self.running = 0

    def answer(self, program: int, k: int, at: int) -> int:
        if program == self.plan.inertial and k == 6:
            return 1 << self.plan.word - 1 if self.restarting else 839
        return 1000 * (program + 1) + 10 * at + k

    async def pause(self, ctx, cycles: int) -> None:
        await pause(ctx, cycles)

    async def core(self, ctx):
        """Programs in turn: takes a record, answers, then looks whether it shall change."""
        dut = self.dut
        while True:
            ctx.set(dut.i.ready, 0)
            ctx.set(dut.o.valid, 0)
            if ctx.get(dut.choice) != self.running:
                await self.pause(ctx, self.rng.randrange(1, 6))
                self.running = ctx.get(dut.choice)
                continue
            running = self.running
            record: list[int] = []
            while True:
                ctx.set(dut.i.ready, int(not self.broken and (self.rng.random() < 0.8)))
                if self.early and running < 3 and len(record) == self.records_in[running] - 1:
                    ctx.set(dut.i.ready, 0)
                    await self.give(ctx, running, len(self.records) + 1)
                    ctx.set(dut.i.ready, 1)
                _, _, valid, ready, data, last = await ctx.tick().sample(
                    dut.i.valid, dut.i.ready, dut.i.payload.data, dut.i.payload.last
                )
                if valid and ready:
                    record.append(data)
                    if last:
                        break
                if not record and not valid and ctx.get(dut.choice) != running:
                    break
            ctx.set(dut.i.ready, 0)
            if not record:
                continue
            if len(record) != self.records_in[running]:
                ctx.set(dut.framing, 1)
                self.framing += 1
                await ctx.tick()
                ctx.set(dut.framing, 0)
                continue
            self.records.append((running, record))
            if not self.early or running >= 3:
                await self.give(ctx, running, len(self.records))
            ctx.set(dut.saturated, running in self.clamps)
            await self.pause(ctx, 2)

    async def give(self, ctx, running: int, at: int) -> None:
        """The words of an update, the ``at``-th record."""
        dut = self.dut
        for k in range(self.records_out[running]):
            ctx.set(dut.o.valid, 0)
            await self.pause(ctx, self.rng.randrange(1, 4))
            while self.broken:
                await ctx.tick()
            ctx.set(dut.o.valid, 1)
            ctx.set(dut.o.payload.data, self.answer(running, k, at))
            ctx.set(dut.o.payload.last, k == self.records_out[running] - 1)
            await ctx.tick()
        ctx.set(dut.o.valid, 0)

    async def clock(self, ctx):
        now, offered = self.rng.getrandbits(20), False
        while True:
            now = (now + 1) & MASK
            ctx.set(self.dut.time, now)
            running = self.running
            _, _, events, updated, valid, ready, choice = await ctx.tick().sample(
                self.dut.events,
                self.dut.updated,
                self.dut.i.valid,
                self.dut.i.ready,
                self.dut.choice,
            )
            ctx.set(self.dut.chosen, choice == running)  # one cycle late, as the core does
            assert valid or not offered, "a word was withdrawn"
            offered = valid and not ready
            self.events += [n for k, n in enumerate(Conductor.EVENTS) if events >> k & 1]
            self.updates += updated

    def run(self, test, *others) -> None:
        async def whole(ctx):
            ctx.set(self.dut.run, 1)
            ctx.set(self.dut.source, 3)
            await ctx.tick().repeat(3)
            await test(ctx)

        self.simulation.run(whole, background=[self.core, self.clock, *others], process=self.reader)

    async def reader(self, ctx):
        """The sensor's words, in the cycle in which they are asked for."""
        async for index, _ in ctx.changed(self.dut.index, self.dut.sample):
            ctx.set(self.dut.word, self.words[min(index, 5)])

    async def pulse(self, ctx, signal) -> None:
        ctx.set(signal, 1)
        await ctx.tick()
        ctx.set(signal, 0)

    async def sample(self, ctx, stamp: int = 5000, wait: bool = True) -> None:
        self.words = [self.rng.getrandbits(18) for _ in range(6)]
        ctx.set(self.dut.stamp, stamp)
        before = self.updates
        await self.pulse(ctx, self.dut.sample)
        if wait:
            await self.until(ctx, lambda: self.updates > before)

    async def line(self, ctx, values, counts: int) -> None:
        for k, value in enumerate(values):
            ctx.set(self.dut.values[k], value & 0xFFFF)
        ctx.set(self.dut.is_counts, counts)
        await self.pulse(ctx, self.dut.line)

    async def until(self, ctx, condition, cycles: int = 3000) -> None:
        for _ in range(cycles):
            if condition():
                return
            await ctx.tick()
        raise AssertionError("it never came")

    async def results(self, ctx, port: int = 0) -> list[int]:
        ports = self.dut.ports[port]
        await self.pulse(ctx, ports.take)
        out = []
        for k in range(64):
            ctx.set(ports.index, k)
            await ctx.tick()
            out.append(ctx.get(ports.value))
        return out


@pytest.mark.parametrize("when", range(2, 150, 17))
def test_watchdog(when: int) -> None:
    """A core that stands still, at any time of the job; then it goes on."""
    bench = Bench(seed=when)

    async def test(ctx):
        await bench.line(ctx, (1, 2, 3), 1)
        await bench.sample(ctx, wait=False)
        await ctx.tick().repeat(when)
        working = bench.updates == 0 or len(bench.records) < 3
        bench.broken = True
        await ctx.tick().repeat(bench.dut.patience + 20)
        if working:
            assert bench.events.count("watchdog") >= 1
        bench.broken = False
        await ctx.tick().repeat(300)
        before, watchdogs = bench.updates, bench.events.count("watchdog")
        bench.restarting = True
        for number in range(3):
            await bench.sample(ctx)
            assert bench.updates == before + number + 1
            inertial = [r for p, r in bench.records if p == 3][-1]
            if working:
                assert inertial[7] >> 31 == (number == 0)
            bench.restarting = False
        assert bench.events.count("watchdog") == watchdogs
        assert bench.events.count("framing") == bench.framing

    bench.run(test)


def test_upsets_of_an_idle_conductor_heal(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[Step] = []
    monkeypatch.setattr(conductor, "Step", lambda plan: steps.append(Step(plan)) or steps[-1])
    monkeypatch.setitem(globals(), "_MADE", {})
    bench = Bench()

    async def test(ctx):
        (step,) = steps
        for upset, value in ((step.count, 5), (step.ends, 1), (bench.dut.choice, 0)):
            ctx.set(upset, value)
            await ctx.tick().repeat(10)
            await bench.sample(ctx)
        assert [p for p, _ in bench.records] == [PLAN.inertial, 0] * 3 and not bench.framing

    bench.run(test)


def test_latency_is_that_of_the_chain() -> None:
    dut = Conductor(plan=replace(PLAN, chains=((0,), (1,), (0, 2))))
    assert dut.latency(1) == 1 + (20 + 80) + 4 + 3
    assert dut.latency(2) == 1 + (20 + 60 + 70) + 2 * 4 + 3


#: Three estimators: one for itself; one that reads the first; one that reads both, of registers,
#: a held field and flags.
CHAINS = replace(
    PLAN,
    outputs=(8, 3, 2),
    chains=((0,), (0, 1), (0, 1, 2)),
    feed=Feed(
        (
            NINE_AXIS,
            (Fed(REGISTERS + 1), Fed(PLACES["dt"])),
            (
                Fed(REGISTERS),
                Fed(PLACES["mx"]),
                Fed(HELD, ZERO, field=True),
                Fed(HELD, ZERO, registers=True),
                Fed(HELD),
            ),
        ),
        constants=(77,),
        registers={"a": VALUE, "b": VALUE},
        holds=True,
    ),
)


def chain_bench(plan: Plan = CHAINS, seed: int = 0) -> Bench:
    return Bench(plan, seed, records_in=(10, 2, 5, 8, 3, 3), records_out=(8, 3, 2, 7, 3, 3))


async def write_set(ctx, dut, words) -> None:
    for k, word in enumerate(words):
        ctx.set(dut.feed_index, k)
        ctx.set(dut.feed_data, word)
        ctx.set(dut.feed_en, 1)
        busy = 1
        while busy:
            _, _, busy = await ctx.tick().sample(dut.feed_busy)
        ctx.set(dut.feed_en, 0)
    ctx.set(dut.feed_take, 1)
    await ctx.tick()
    ctx.set(dut.feed_take, 0)


class Model:
    """The conductor's rules, cycle by cycle, beside a core that is only watched.

    ``check`` compares events, number and every word of a record. At each update ``results`` has
    the words that its readers must find, by place. Input registers keep their words.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan, self.state = plan, "idle"
        self.waiting = self.line_waits = self.fresh = self.updated = False
        self.use_field = self.restarting = self.clamped = self.alone = False
        self.restart_next = True
        self.line_counts = self.field_counts = self.running = self.number = 0
        self.memory = {ZERO: 0} | {REGISTERS + k: 0 for k in range(len(plan.feed.registers))}
        self.memory |= {HELD + k: c for k, c in enumerate(plan.feed.constants)}
        self.memory |= dict.fromkeys(FIELD, 0)
        self.results: dict[int, int] = {}
        self.seen: set[str] = set()

    def check(self, c: SimpleNamespace) -> None:
        """One cycle; ``c`` are the values before its edge."""
        wanted = c.source >> (1 - c.is_counts) & 1
        accepted = bool(c.line and wanted)
        busy = self.state not in ("idle", "line", "line ends")
        names = {
            "update": self.updated,
            "field_used": self.updated and self.use_field,
            "restart": self.updated and self.restarting,
            "sample_dropped": c.sample and c.run and (busy or self.waiting),
            "field_dropped": c.line and self.line_waits,
        }
        events = [name for k, name in enumerate(Conductor.EVENTS) if c.events >> k & 1]
        assert events == [name for name, pulse in names.items() if pulse]
        assert c.number == self.number
        self.seen.update(events)
        self.updated = False
        self.waiting = bool(c.run) and (self.waiting or bool(c.sample and not busy))
        # One that is not used replaces the words of one that waits.
        waits = accepted if c.line else self.line_waits
        self.alone &= not c.line
        if self.state == "idle" and (c.sample or self.waiting) and c.run:
            self._begin(c)
        elif self.state == "filter ends" and self.chain:
            self.clamped |= bool(c.saturated)
            self._start("filter", self.chain.pop(0))
        elif self.state == "filter ends" and c.chosen:
            self._complete(bool(c.saturated))
            if self.line_waits:
                waits, self.field_counts, self.alone = accepted, self.line_counts, not c.line
                self._start("line", (self.plan.compass, self.plan.field)[self.line_counts])
        elif self.state == "line ends":
            self.state, self.fresh = "idle", self.alone  # else its words may be of two lines
            if self.fresh:
                self.memory |= dict(zip(FIELD, self.given, strict=True))
            self.seen.add("whole line" if self.fresh else "line replaced")
        self.line_waits = waits
        if c.line:
            self.line_counts = c.is_counts
        self.restart_next |= bool(c.restart or not c.run)
        if c.taken:
            record = self._record(c)
            assert (c.choice, c.i_last) == (self.program, len(self.taken) == len(record) - 1)
            assert c.i_data == record[len(self.taken)], self.state
            self.taken.append(c.i_data)
        if c.given:
            self._give(c.o_data, c.o_last)

    def _begin(self, c: SimpleNamespace) -> None:
        running = c.filter if c.filter < self.plan.filters else self.running
        self.restarting = self.restart_next or running != self.running
        self.use_field = self.fresh and bool(c.source >> (1 - self.field_counts) & 1)
        self.running, self.number = running, self.number + 1
        self.restart_next = self.fresh = self.waiting = self.clamped = False
        self.chain = list(self.plan.chains[running])
        self._start("inertial", self.plan.inertial)

    def _start(self, state: str, program: int) -> None:
        self.state, self.program, self.taken, self.given = state, program, [], []

    def _record(self, c: SimpleNamespace) -> list[int]:
        """The record of the program at work."""
        plan = self.plan
        if self.state == "line":
            return [value << plan.count_bits for value in c.values]
        if self.state == "inertial":
            counts = [count << plan.count_bits - 2 for count in c.counts]
            return [*counts, c.stamp >> 32 - plan.word, self.restarting << plan.word - 1]
        assert self.state == "filter"
        return [
            self.memory[fed.place]
            if fed.absent is None or (self.use_field or not fed.field) and not fed.registers
            else self.memory[fed.absent]
            for fed in plan.feed.records[self.program]
        ]

    def _give(self, word: int, last: int) -> None:
        """A word from the core."""
        self.given.append(word)
        if last and self.state == "inertial":
            self.raw = self.taken
            self.restarting = bool(word >> self.plan.word - 1)
            self.memory |= dict(enumerate(self.given))
            self._start("filter", self.chain.pop(0))
        elif last:
            self.state += " ends"

    def _complete(self, saturated: bool) -> None:
        self.updated, self.state = True, "idle"
        fields = {
            "number": self.number,
            "filter": self.running,
            "field_used": self.use_field,
            "field_counts": self.use_field and self.field_counts,
            "restart": self.restarting,
            "saturated": saturated or self.clamped,
        }
        self.results = {
            Place.HEADER: sum(int(value) << FIELDS[n].bit for n, value in fields.items()),
            **{Place.OUTPUTS + k: word for k, word in enumerate(self.given)},
            **{Place.INPUTS + k: word for k, word in enumerate(self.taken)},
            **{Place.RAWS + k: word for k, word in enumerate(self.raw)},
        }
        self.results[Place.STAMP] = self.results.pop(Place.RAWS + RAW.index("stamp"))


def watched(dut: Conductor) -> dict[str, Any]:
    """What the model is shown, by its names; ``values`` in three."""
    names = ("sample", "line", "is_counts", "source", "filter", "run", "restart", "stamp", "events")
    names += ("number", "chosen", "choice", "saturated")
    return {
        **{name: getattr(dut, name) for name in names},
        **{"taken": dut.i.valid & dut.i.ready, "given": dut.o.valid},
        **{"i_data": dut.i.payload.data, "i_last": dut.i.payload.last},
        **{"o_data": dut.o.payload.data, "o_last": dut.o.payload.last},
        **{f"values{k}": value for k, value in enumerate(dut.values)},
    }


async def watch(ctx, bench: Bench, model: Model) -> None:
    """Show the model every cycle."""
    async for _, _, word in ctx.tick().sample(bench.shown.word):
        c = SimpleNamespace(**bench.shown.parts(word), counts=bench.words)
        c.values = [c.values0, c.values1, c.values2]
        model.check(c)


@pytest.mark.parametrize(
    "make, seed",
    [
        (Bench, 0),
        (Bench, 1),
        (partial(Bench, replace(PLAN, word=26, count_bits=10)), 5),
        (chain_bench, 13),
        (chain_bench, 4),
    ],
)
def test_any_events_in_any_cycle(make, seed: int) -> None:
    """Samples, lines, settings and orders at random; filters that read each other."""
    bench = make(seed=seed)
    dut, model, rng = bench.dut, Model(bench.plan), random.Random(seed)
    updates = []

    async def results(ctx):
        while True:
            _, _, updated = await ctx.tick().sample(dut.updated)
            if updated:
                wanted, last = model.results, ctx.get(dut.last_output)
                words = await bench.results(ctx, seed % 2)
                assert {place: words[place] for place in wanted} == wanted
                assert last == max(wanted.keys() & range(16, 32)) - Place.OUTPUTS
                updates.append(wanted)

    async def test(ctx):
        for _ in range(200):
            event = rng.random()
            if rng.random() < 0.3:  # beside the end of a job
                for _ in range(200):
                    if model.state.endswith("ends"):
                        break
                    await ctx.tick()
                await bench.pause(ctx, rng.randrange(3))
            if event < 0.5:  # the reader holds the words of a sample that is at work
                if model.state in ("idle", "line") and not model.waiting:
                    bench.words = [rng.getrandbits(18) for _ in range(6)]
                    ctx.set(dut.stamp, rng.getrandbits(32))
                await bench.pulse(ctx, dut.sample)
            elif event < 0.8:
                await bench.line(ctx, [rng.getrandbits(16) for _ in range(3)], rng.randrange(2))
            elif event < 0.85:
                ctx.set(dut.filter, rng.randrange(4))
            elif event < 0.89:
                ctx.set(dut.source, rng.choice((0, 1, 2, 3, 3, 3)))
            elif event < 0.92:
                await bench.pulse(ctx, dut.restart)
            elif event < 0.95:
                ctx.set(dut.run, rng.randrange(2))
            bench.restarting = rng.random() < 0.1
            bench.clamps = tuple(k for k in range(3) if rng.random() < 0.2)
            if event > 0.85 and rng.random() < 0.5:
                ctx.set(dut.run, 1)
            await bench.pause(ctx, rng.randrange(rng.choice((1, 4, 40, 240))))

    bench.run(test, partial(watch, bench=bench, model=model), results)
    assert len(updates) > 30
    wanted = {"update", "field_used", "restart", "sample_dropped", "field_dropped"}
    assert model.seen == {*wanted, "whole line", "line replaced"}


def test_registers_are_taken_as_a_set() -> None:
    """A record has words of one set, wherever the host is with the next one."""
    bench = chain_bench()
    sets = [(0, 0)]

    async def host(ctx):
        for k in range(1, 60):
            await write_set(ctx, bench.dut, (2 * k, 2 * k + 1))
            sets.append((2 * k, 2 * k + 1))
            await bench.pause(ctx, bench.rng.randrange(900))

    async def test(ctx):
        ctx.set(bench.dut.filter, 2)
        flags = []
        for _ in range(25):
            await bench.sample(ctx)
            (_, of_one), (_, of_two) = bench.records[-2:]
            assert (of_two[0], of_one[0]) in sets, "half of one set, half of another"
            flags.append(of_two[3])
            seen.append((of_two[0], of_one[0]))
            assert of_two[4] == 77
        assert all(flag in (0, 77) for flag in flags)
        # The flag says whether the set is another one than that of the update before.
        for k in range(1, 25):
            assert (flags[k] == 77) == (seen[k] != seen[k - 1]), k
        assert len(set(seen)) > 5 and 0 in flags[1:]

    seen: list[tuple[int, int]] = []
    bench.run(test, host)


def test_a_set_is_taken_without_a_sample() -> None:
    bench = chain_bench()

    async def test(ctx):
        await write_set(ctx, bench.dut, (1, 2))
        assert ctx.get(bench.dut.feed_busy)
        await ctx.tick().repeat(2 + 2)
        assert not ctx.get(bench.dut.feed_busy)

    bench.run(test)
