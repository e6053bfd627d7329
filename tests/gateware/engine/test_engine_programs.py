"""The engine with several programs: random turns, stalls, torn records, writes, word for word."""

import functools
import itertools
import random

import numpy as np
import pytest
from amaranth.hdl import ResetInserter, Signal

from boresight.gateware.core import Core, build_shared_core
from boresight.gateware.engine.engine import Engine
from boresight.gateware.machine import CONFIGS
from boresight.gateware.registers import PROGRAM
from boresight.model.words.interpreter import Interpreter
from tests.support.bench import Simulation, pulse, put, read, write
from tests.support.random_program import random_inputs, random_programs

CONFIG = pytest.mark.parametrize("config", sorted(CONFIGS))
MASK = (1 << 32) - 1
UPDATES = 513


@functools.cache
def _made(
    config: str, seed: int, count: int, selector: bool
) -> tuple[Core, Engine, Signal, Simulation]:
    """A core of random programs and its engine, made once, and its reset."""
    core = build_shared_core(random_programs(seed, count, n_ops=6, n_states=3), config)
    dut, reset = Engine(machine=core.machine, image=core.image, selector=selector), Signal()
    return core, dut, reset, Simulation(ResetInserter(reset)(dut))


class Bench:
    """A core of small random programs, the interpreters beside it, streams that pause."""

    def __init__(
        self, config: str, seed: int, count: int, pauses: float, selector: bool = False
    ) -> None:
        self.rng = random.Random(seed)
        self.core, self.dut, self.reset, self._simulation = _made(config, seed, count, selector)
        self.models = [Interpreter(part.program) for part in self.core.parts]
        self.pauses = pauses
        self.got: list[tuple[int, int]] = []
        self.wanted: list[tuple[int, int]] = []

    def run(self, test) -> None:
        self._simulation.run(test, background=[self._sink])
        assert self.got == self.wanted
        assert len(self.wanted) > 12

    async def _sink(self, ctx):
        o = self.dut.o
        while True:
            ctx.set(o.ready, self.rng.random() >= self.pauses)
            if not ctx.get(o.valid):
                await ctx.posedge(o.valid)
            _, _, ready, valid, word, last = await ctx.tick().sample(
                o.ready, o.valid, o.payload.data, o.payload.last
            )
            if valid and ready:
                self.got.append((word, last))

    async def put(self, ctx, words: list[int], last: int) -> None:
        for k, word in enumerate(words):
            while self.rng.random() < self.pauses:
                await ctx.tick()
            await put(ctx, self.dut.i, {"data": word & MASK, "last": k == last})

    async def write(self, ctx, address: int, word: int) -> None:
        await write(ctx, self.dut.bus, address, word)

    async def read(self, ctx, address: int) -> int:
        return await read(ctx, self.dut.bus, address)

    def words(self, number: int) -> list[int]:
        """A record of a program."""
        return random_inputs(self.core.parts[number].program, self.rng.getrandbits(20), 1)[0]

    def want(self, number: int, words: list[int]) -> None:
        """The outputs of this record come next."""
        out, _ = self.models[number].update(np.array(words)[:, None])
        self.wanted += [(int(w) & MASK, int(k == len(out) - 1)) for k, w in enumerate(out[:, 0])]

    async def record(self, ctx, number: int) -> None:
        """One whole record of the program that runs."""
        words = self.words(number)
        await self.put(ctx, words, len(words) - 1)
        self.want(number, words)

    async def settle(self, ctx) -> None:
        """Wait until nothing is under way."""
        for _ in range(3000):
            if len(self.got) >= len(self.wanted):
                break
            await ctx.tick()
        await ctx.tick().repeat(max(self.core.image.lengths) + 10)


TURNS = [(8, 3, 0.4), (9, 4, 0.0), (2, 3, 0.4), (6, 4, 0.0), (1, 2, 0.0), (4, 5, 0.6)]
CASES = [(config, *turn) for config in sorted(CONFIGS) for turn in TURNS[:2]]
CASES += [(config, *TURNS[0]) for config in ("fast-1024", "fast-d9", "small-d10", "fast-d12")]
SOAK = [(config, *turn) for config in sorted(CONFIGS) for turn in TURNS[2:]]
SOAK += [(config, *TURNS[0]) for config in ("small-d9", "fast-d10", "small-d12")]


@pytest.mark.parametrize(
    ("config", "seed", "count", "pauses"),
    [*CASES, *(pytest.param(*case, marks=pytest.mark.soak) for case in SOAK)],
)
def test_turns(config: str, seed: int, count: int, pauses: float) -> None:
    bench = Bench(config, seed, count, pauses)
    rng = random.Random(seed)

    async def test(ctx):
        number = 0
        for _ in range(30):
            event = rng.random()
            if event < 0.35:  # while the last record may still be under way
                number = rng.randrange(count)
                await bench.write(ctx, PROGRAM, number)
                assert await bench.read(ctx, PROGRAM) == number
            elif event < 0.45:
                await bench.write(ctx, PROGRAM, rng.choice((count, 1 << 31, MASK)))
                assert await bench.read(ctx, PROGRAM) == number
            elif event < 0.6:  # a parameter of whichever program
                other = rng.randrange(count)
                addresses = bench.core.select(other).parameter_addresses
                if addresses:
                    name = rng.choice(list(addresses))
                    word = rng.getrandbits(24)
                    await bench.write(ctx, addresses[name], word)
                    model = bench.models[other]
                    model.params[bench.core.parts[other].program.find(name)] = word
            elif event < 0.75:  # torn: too short, or too long by some
                n = len(bench.core.parts[number].program.inputs)
                length = rng.choice([k for k in (1, n - 1, n + 1, 2 * n) if k != n and k > 0])
                await bench.put(ctx, [rng.getrandbits(20) for _ in range(length)], length - 1)
            else:
                await bench.record(ctx, number)
        for number in range(count):
            await bench.write(ctx, PROGRAM, number)
            for _ in range(2):
                await bench.record(ctx, number)
        await bench.settle(ctx)

    bench.run(test)


@CONFIG
def test_switch_in_mid_record_waits_for_its_end(config: str) -> None:
    bench = Bench(config, 8, 3, 0.0)
    n = len(bench.core.program.inputs)
    assert n > 1

    async def test(ctx):
        bus = bench.dut.bus
        for _ in range(3):
            await bench.record(ctx, 0)
        await bench.settle(ctx)
        words = bench.words(0)
        await bench.put(ctx, words[:-1], last=n)
        ctx.set(bus.addr, PROGRAM)
        ctx.set(bus.w_data, 1)
        ctx.set(bus.w_stb, 1)
        await ctx.tick().repeat(50)
        assert not ctx.get(bus.w_ack)
        await bench.put(ctx, words[-1:], last=0)
        bench.want(0, words)
        await bench.write(ctx, PROGRAM, 1)
        for _ in range(3):
            await bench.record(ctx, 1)
        await bench.settle(ctx)
        assert await bench.read(ctx, UPDATES) == 7

    bench.run(test)


@pytest.mark.parametrize(
    ("config", "after"), [("small", 1), ("fast", 2), ("small", 3), ("fast", 4)]
)
def test_reset_goes_back_to_program_0_and_all_states_begin_anew(config: str, after: int) -> None:
    bench = Bench(config, 8, 3, 0.0)

    async def test(ctx):
        for number in range(3):
            await bench.write(ctx, PROGRAM, number)
            for _ in range(number + 1):
                await bench.record(ctx, number)
        await bench.settle(ctx)
        await bench.write(ctx, PROGRAM, 1)
        await ctx.tick().repeat(after)
        await pulse(ctx, bench.reset)
        bench.models = [Interpreter(part.program) for part in bench.core.parts]
        assert await bench.read(ctx, PROGRAM) == 0
        await bench.record(ctx, 0)
        for number in (2, 1):
            await bench.write(ctx, PROGRAM, number)
            await bench.record(ctx, number)
        await bench.settle(ctx)

    bench.run(test)


@pytest.mark.parametrize("event", ["restart", "choice"])
@CONFIG
def test_event_beside_a_write(config: str, event: str) -> None:
    """What comes in a cycle counts for the records that begin after it; one always waits."""
    bench = Bench(config, 8, 3, 0.0, selector=event == "choice")
    parts, dut, i, bus = bench.core.parts, bench.dut, bench.dut.i, bench.dut.bus
    name, address = next(iter(bench.core.select(0).parameter_addresses.items()))
    writes = [PROGRAM, address] if event == "restart" else [address]

    async def test(ctx):
        number, index, words = 0, 0, bench.words(0)
        ctx.set(i.valid, 1)
        for relative, address in itertools.product(range(-6, 3), writes):
            after = parts[number].schedule.interval + relative
            word = 1 - number if address == PROGRAM else bench.rng.getrandbits(24)
            ctx.set(bus.addr, address)
            ctx.set(bus.w_data, word)
            cycle, waits = 0, True  # cycles from the first word of a record; the write waits
            while waits or cycle <= after or index:
                happens, chosen = cycle == after, number
                ctx.set(bus.w_stb, waits and cycle > 0)
                last = index == len(words) - 1
                ctx.set(i.payload, {"data": words[index] & MASK, "last": last})
                if event == "restart":
                    ctx.set(dut.restart, happens)
                elif happens:
                    chosen = 1 - number
                    ctx.set(dut.choice, chosen)
                _, _, taken, done = await ctx.tick().sample(i.ready, bus.w_ack)
                begins = taken and index == 0
                if begins:
                    bench.want(number, words)
                if happens and event == "restart":
                    params = bench.models[number].params
                    bench.models[number] = Interpreter(parts[number].program)
                    bench.models[number].params = params
                if done and address == PROGRAM:
                    chosen = word
                elif done:
                    bench.models[0].params[parts[0].program.find(name)] = word
                waits, number = waits and not done, chosen
                if taken:
                    index = (index + 1) % len(words)
                    words = words if index else bench.words(number)
                cycle += cycle > 0 or begins
        ctx.set(i.valid, 0)
        await bench.settle(ctx)

    bench.run(test)
