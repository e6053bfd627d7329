"""The conductor alone, beside a core that the test plays: order of words, faults, any state."""

import random
from dataclasses import replace

import pytest
from amaranth.sim import Simulator

from boresight.gateware.system.conductor import Conductor
from boresight.gateware.system.feed import HELD, PLACES, REGISTERS, ZERO, Fed, Feed
from boresight.gateware.system.interface import HEADER, Place
from boresight.gateware.system.plan import FRONT_NAMES, RAW, Plan
from boresight.model.estimators.nine_axis import INPUTS
from boresight.model.words.program import Kind, Value

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
#: Words of the input and output records of each program.
RECORDS_IN = (10, 10, 10, 8, 3, 3)
RECORDS_OUT = (8, 8, 8, 7, 3, 3)
MASK = (1 << 32) - 1
FIELDS = {field.name: field for field in HEADER}


def field_of(header: int, name: str) -> int:
    return FIELDS[name].of(header)


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
        self.dut = Conductor(plan=plan)
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
            return 1 << 31 if self.restarting else 839
        return 1000 * (program + 1) + 10 * at + k

    async def pause(self, ctx, cycles: int) -> None:
        for _ in range(cycles):
            await ctx.tick()

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
        sim = Simulator(self.dut)
        sim.add_clock(1e-8)
        sim.add_testbench(self.core, background=True)
        sim.add_testbench(self.clock, background=True)
        sim.add_process(self.reader)

        async def whole(ctx):
            ctx.set(self.dut.run, 1)
            ctx.set(self.dut.source, 3)
            await ctx.tick().repeat(3)
            await test(ctx)

        for other in others:
            sim.add_testbench(other, background=True)
        sim.add_testbench(whole)
        sim.run()

    async def reader(self, ctx):
        """The sensor's words, in the cycle in which they are asked for."""
        async for index, _ in ctx.changed(self.dut.index, self.dut.sample):
            ctx.set(self.dut.word, self.words[min(index, 5)])

    async def pulse(self, ctx, signal) -> None:
        ctx.set(signal, 1)
        await ctx.tick()
        ctx.set(signal, 0)

    async def sample(self, ctx, stamp: int = 5000, wait: bool = True) -> None:
        self.words = [self.rng.getrandbits(16) for _ in range(6)]
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


def test_a_sample_goes_through_calibration_and_filter() -> None:
    bench = Bench()

    async def test(ctx):
        ctx.set(bench.dut.filter, 2)
        await bench.sample(ctx, 0x87654321)
        await bench.sample(ctx, 0x87656321)
        words = await bench.results(ctx)
        (p0, _), (p1, _), (p2, raw), (p3, record) = bench.records
        assert (p0, p1, p2, p3) == (3, 2, 3, 2)
        counts = [w << 16 for w in bench.words]
        assert raw == [*counts, 0x87656321, 0]
        calibrated = [4000 + 30 + k for k in range(6)]
        assert record == [839, *calibrated[:3], 0, 0, 0, *calibrated[3:]]
        assert words[Place.RAWS : Place.RAWS + 6] == counts
        assert words[Place.RAWS + RAW.index("restart")] == 0
        assert words[Place.STAMP] == 0x87656321
        assert words[Place.INPUTS : Place.INPUTS + len(RECORD)] == record
        assert words[Place.OUTPUTS : Place.OUTPUTS + 8] == [3000 + 40 + k for k in range(8)]
        header = words[Place.HEADER]
        assert [field_of(header, n) for n in ("number", "filter", "field_used", "restart")] == [
            2,
            2,
            0,
            0,
        ]

    bench.run(test)


def test_a_narrower_word() -> None:
    """Raw words keep their binary point: counts lose low zeros, stamps their lowest cycles."""
    bench = Bench(replace(PLAN, word=26, count_bits=10))

    async def test(ctx):
        await bench.sample(ctx, 0x87654321)
        counts = [w << 10 for w in bench.words]
        assert bench.records[0][1] == [*counts, 0x87654321 >> 6, 1 << 25]

    bench.run(test)


def test_restarts() -> None:
    """The first sample, on demand, another filter, run low, and what the time step says."""
    bench = Bench()

    async def flags(ctx) -> tuple[int, int]:
        header = (await bench.results(ctx))[Place.HEADER]
        inertial = [r for p, r in bench.records if p == 3][-1]
        return inertial[7] >> 31, field_of(header, "restart")

    async def test(ctx):
        bench.restarting = True
        await bench.sample(ctx)
        assert await flags(ctx) == (1, 1)
        bench.restarting = False
        await bench.sample(ctx)
        assert await flags(ctx) == (0, 0)
        bench.restarting = True  # a gap, which only the calibration sees
        await bench.sample(ctx)
        assert await flags(ctx) == (0, 1)
        for action in (bench.dut.restart, None, "run", "filter"):
            bench.restarting = False
            await bench.sample(ctx)
            assert await flags(ctx) == (0, 0)
            if action is bench.dut.restart:
                await bench.pulse(ctx, action)
            elif action == "run":
                ctx.set(bench.dut.run, 0)
                before = bench.updates
                await bench.sample(ctx, wait=False)
                await ctx.tick().repeat(300)
                assert bench.updates == before
                ctx.set(bench.dut.run, 1)
            elif action == "filter":
                ctx.set(bench.dut.filter, 3)  # there is none
                await bench.sample(ctx)
                assert await flags(ctx) == (0, 0)
                ctx.set(bench.dut.filter, 1)
            bench.restarting = action is not None
            await bench.sample(ctx)
            assert await flags(ctx) == ((1, 1) if action is not None else (0, 0)), action
        assert bench.events.count("restart") == 5
        assert "sample_dropped" not in bench.events

    bench.run(test)


@pytest.mark.parametrize("counts", [0, 1])
def test_a_field_is_used_once(counts: int) -> None:
    bench = Bench()
    program = PLAN.field if counts else PLAN.compass

    async def test(ctx):
        await bench.line(ctx, (5, -6, 7), counts)
        await bench.sample(ctx)
        assert field_of((await bench.results(ctx))[Place.HEADER], "field_used") == 0
        await bench.until(ctx, lambda: len(bench.records) == 3)
        await ctx.tick().repeat(60)
        assert bench.records[2] == (program, [5 << 16, (-6 & 0xFFFF) << 16, 7 << 16])
        field = [1000 * (program + 1) + 30 + k for k in range(3)]
        await bench.sample(ctx)
        words = await bench.results(ctx)
        assert bench.records[-1][1][4:7] == field == words[Place.INPUTS + 4 : Place.INPUTS + 7]
        assert field_of(words[Place.HEADER], "field_used") == 1
        assert field_of(words[Place.HEADER], "field_counts") == counts
        await bench.sample(ctx)
        words = await bench.results(ctx)
        assert bench.records[-1][1][4:7] == [0, 0, 0] == words[Place.INPUTS + 4 : Place.INPUTS + 7]
        assert field_of(words[Place.HEADER], "field_used") == 0
        assert bench.events.count("field_used") == 1

    bench.run(test)


@pytest.mark.parametrize("source", range(4))
@pytest.mark.parametrize("counts", [0, 1])
def test_source_says_which_lines_count(source: int, counts: int) -> None:
    bench = Bench()
    wanted = bool(source >> (0 if counts else 1) & 1)

    async def test(ctx):
        ctx.set(bench.dut.source, source)
        await bench.line(ctx, (1, 2, 3), counts)
        await bench.sample(ctx)
        await ctx.tick().repeat(100)
        assert (len(bench.records) == 3) == wanted
        ctx.set(bench.dut.source, 0)  # what was fresh is not wanted any more
        await bench.sample(ctx)
        assert bench.records[-1][1][4:7] == [0, 0, 0]
        ctx.set(bench.dut.source, source)
        await bench.sample(ctx)
        assert bench.records[-1][1][4:7] == [0, 0, 0]
        assert "field_used" not in bench.events

    bench.run(test)


@pytest.mark.parametrize("delay", range(0, 60, 4))
def test_a_line_in_the_midst_of_another_never_mixes(delay: int) -> None:
    """Whenever it comes: a field that is used is of one line, and the newer one is used."""
    bench = Bench(seed=delay)

    async def test(ctx):
        await bench.line(ctx, (1, 1, 1), 1)
        await bench.sample(ctx)
        await bench.pause(ctx, delay)
        await bench.line(ctx, (2, 2, 2), 0)
        await ctx.tick().repeat(120)
        used = []
        for _ in range(3):
            await bench.sample(ctx)
            words = await bench.results(ctx)
            if field_of(words[Place.HEADER], "field_used"):
                number = words[Place.INPUTS + 4] % 1000 // 10
                program, record = bench.records[number - 1]
                assert program == words[Place.INPUTS + 4] // 1000 - 1
                assert len(set(record)) == 1, "two lines mixed"
                assert record[0] >> 16 == (1 if program == PLAN.field else 2)
                assert field_of(words[Place.HEADER], "field_counts") == (program == PLAN.field)
                used.append(record[0] >> 16)
            await ctx.tick().repeat(120)
        assert used[-1:] == [2]
        assert used in ([2], [1, 2])

    bench.run(test)


@pytest.mark.parametrize("early", range(-2, 8))
def test_a_line_in_the_cycle_in_which_another_is_begun(early: int) -> None:
    """It counts as come later, of its own kind: the first is not used if its words were gone."""
    cycles = []
    for lead in (None, early):
        bench = Bench(seed=5)

        async def test(ctx, bench=bench, lead=lead):
            await bench.line(ctx, (1, 1, 1), 1)
            await bench.sample(ctx, wait=False)
            for k in range(400):
                if lead is None and bench.updates:
                    cycles.append(k)
                    return
                if lead is not None and k == cycles[0] - lead:
                    await bench.line(ctx, (2, 2, 2), 0)
                await ctx.tick()
            for _ in range(3):
                await bench.sample(ctx)
                words = await bench.results(ctx)
                if field_of(words[Place.HEADER], "field_used"):
                    program, record = bench.records[words[Place.INPUTS + 4] % 1000 // 10 - 1]
                    kind = field_of(words[Place.HEADER], "field_counts")
                    assert program == (PLAN.field if kind else PLAN.compass)
                    assert record == [(1 if kind else 2) << 16] * 3
                await bench.pause(ctx, 120)
            assert [r for p, r in bench.records if p == PLAN.compass] == [[2 << 16] * 3]

        bench.run(test)


def test_lines_that_are_too_many_are_counted() -> None:
    bench = Bench()

    async def test(ctx):
        for _ in range(3):
            await bench.line(ctx, (1, 2, 3), 1)
        assert bench.events.count("field_dropped") == 2

    bench.run(test)


@pytest.mark.parametrize("delay", [1, 5, 20, 50, 70])
def test_a_sample_too_early_is_dropped_and_told(delay: int) -> None:
    bench = Bench()

    async def test(ctx):
        await bench.sample(ctx, wait=False)
        await bench.pause(ctx, delay)
        early = bench.updates == 0
        await bench.sample(ctx, wait=False)
        await ctx.tick().repeat(600)
        assert early
        assert bench.updates == 1
        assert bench.events.count("sample_dropped") == 1
        await bench.sample(ctx)
        assert field_of((await bench.results(ctx))[Place.HEADER], "number") == 2

    bench.run(test)


@pytest.mark.parametrize("delay", range(0, 50, 7))
def test_a_sample_during_the_field_waits(delay: int) -> None:
    bench = Bench()

    async def test(ctx):
        await bench.line(ctx, (1, 2, 3), 1)
        await bench.sample(ctx)
        await bench.pause(ctx, delay)
        await bench.sample(ctx)
        assert bench.updates == 2
        assert "sample_dropped" not in bench.events

    bench.run(test)


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


def test_an_idle_conductor_needs_no_watchdog() -> None:
    bench = Bench()

    async def test(ctx):
        await ctx.tick().repeat(3 * bench.dut.patience)
        assert bench.events == []

    bench.run(test)


def test_latency_and_patience_are_of_the_plan() -> None:
    dut = Conductor(plan=PLAN)
    assert dut.latency(1) - dut.latency(0) == 20
    assert dut.patience >= 2 * (20 + 80)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"filters": 0}, "plan must have 1 to 8 estimators"),
        ({"filters": 9}, "plan must have 1 to 8 estimators"),
        ({"word": 25}, "plan must have 1 to 8 estimators and words of 26 to 32 bits"),
        ({"word": 33}, "plan must have 1 to 8 estimators and words of 26 to 32 bits"),
        ({"outputs": (8, 17, 8)}, "records must have 1 to 16 words"),
        ({"feed": Feed((NINE_AXIS, ()))}, "records must have 1 to 16 words"),
        ({"feed": Feed((NINE_AXIS * 2,))}, "records must have 1 to 16 words"),
    ],
)
def test_plan_is_checked(change, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        replace(PLAN, **change)


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


def chain_bench(plan: Plan = CHAINS) -> Bench:
    return Bench(plan, records_in=(10, 2, 5, 8, 3, 3), records_out=(8, 3, 2, 7, 3, 3))


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


def test_a_chain_runs_what_it_reads() -> None:
    bench = chain_bench()

    async def test(ctx):
        for filter, programs in ((0, [3, 0]), (2, [3, 0, 1, 2]), (1, [3, 0, 1])):
            ctx.set(bench.dut.filter, filter)
            before = len(bench.records)
            await bench.sample(ctx)
            assert [p for p, _ in bench.records[before:]] == programs
            words = await bench.results(ctx)
            number, record = bench.records[-1]
            assert words[Place.INPUTS : Place.INPUTS + len(record)] == record
            at = len(bench.records)
            out = [1000 * (number + 1) + 10 * at + k for k in range(CHAINS.outputs[filter])]
            assert words[Place.OUTPUTS : Place.OUTPUTS + len(out)] == out
            assert ctx.get(bench.dut.last_output) == len(out) - 1
            assert field_of(words[Place.HEADER], "filter") == filter
        assert bench.events.count("update") == 3

    bench.run(test)


def test_a_chain_tells_every_saturation() -> None:
    bench = chain_bench()

    async def test(ctx):
        ctx.set(bench.dut.filter, 1)
        for clamps in ((), (0,), (1,), ()):
            bench.clamps = clamps
            await bench.sample(ctx)
            words = await bench.results(ctx)
            assert field_of(words[Place.HEADER], "saturated") == bool(clamps), clamps

    bench.run(test)


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


def test_a_large_set_that_is_still_on_its_way() -> None:
    """Thirty-two words take longer than the calibration of a sample that comes meanwhile."""
    words = tuple(Fed(REGISTERS + k) for k in range(16, 32))
    registers = {f"r{k}": VALUE for k in range(32)}
    plan = replace(
        PLAN,
        filters=1,
        names=("one", *FRONT_NAMES),
        lengths=(60, 20, 15, 18),
        outputs=(1,),
        chains=((0,),),
        feed=Feed((words,), registers=registers),
    )
    bench = Bench(plan, records_in=(16, 8, 3, 3), records_out=(1, 1, 3, 3))

    async def test(ctx):
        seen = []
        for turn in range(1, 13):
            await write_set(ctx, bench.dut, [turn] * 32)
            await bench.pause(ctx, turn % 3)
            await bench.sample(ctx)
            record = bench.records[-1][1]
            assert len(set(record)) == 1, record
            seen.append(record[0])
        # Whether it was in time or not, it is there for the next one.
        assert all(turn - 1 <= word <= turn for turn, word in enumerate(seen, 1)), seen
        assert any(word == turn for turn, word in enumerate(seen, 1))

    bench.run(test)


def test_a_field_is_held_until_the_next_whole_one() -> None:
    bench = chain_bench()

    async def test(ctx):
        ctx.set(bench.dut.filter, 2)
        found = []
        for k in range(10):
            await bench.sample(ctx)
            found.append(bench.records[-1][1][1:3])
            if k in (2, 5):
                await bench.line(ctx, (k, k, k), 1)
        assert found[:4] == [[0, 0]] * 4, "before the first line"
        # The line after update 2 is worked at behind update 3, and makes that of update 4 fresh.
        first, second = found[4][0], found[7][0]
        assert first and second and first != second
        assert [f[0] for f in found[4:7]] == [first] * 3
        assert [f[0] for f in found[7:]] == [second] * 3
        assert [k for k, f in enumerate(found) if f[1] == 77] == [4, 7]

    bench.run(test)


def test_words_that_come_before_the_record_ends() -> None:
    bench = chain_bench(replace(CHAINS, early=True))
    bench.early = True

    async def test(ctx):
        ctx.set(bench.dut.filter, 2)
        for _ in range(4):
            await bench.sample(ctx)
            words = await bench.results(ctx)
            at = len(bench.records)
            assert words[Place.OUTPUTS : Place.OUTPUTS + 2] == [3000 + 10 * at, 3000 + 10 * at + 1]
            assert words[Place.INPUTS : Place.INPUTS + 5] == bench.records[-1][1]

    bench.run(test)
