"""The engine with a selector: the program follows a port, beside writes of the host, and resets."""

import random

import numpy as np
import pytest

from boresight.gateware.core import build_shared_core
from boresight.gateware.engine.engine import Engine
from boresight.gateware.machine import CONFIGS
from boresight.gateware.registers.core import PROGRAM
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind
from tests.support.bench import at_edges, put_record, read, run_bench, write
from tests.support.random_program import random_inputs, random_programs

MASK = (1 << 32) - 1


@pytest.mark.parametrize("config", sorted(CONFIGS))
@pytest.mark.parametrize("seed", [1, 2, pytest.param(3, marks=pytest.mark.soak)])
def test_turns_beside_writes(config: str, seed: int) -> None:
    core = build_shared_core(random_programs(seed, 3, n_ops=6, n_states=3), config)
    dut = Engine(machine=core.machine, image=core.image, selector=True)
    models = [Interpreter(part.program) for part in core.parts]
    rng = random.Random(seed)
    got: list[int] = []
    wanted: list[int] = []
    writes: list[tuple[int, int]] = []
    idle = [True]

    async def sink(ctx):
        ctx.set(dut.o.ready, 1)
        await at_edges(ctx, lambda _, w: got.append(w), dut.o.valid, also=[dut.o.payload.data])

    async def host(ctx):
        """Writes parameters while the test says so, and now and then the program's number."""
        noise = random.Random(seed + 50)
        while True:
            while not writes:
                await ctx.tick()
            idle[0] = False
            address, word = writes.pop()
            await write(ctx, dut.bus, address, word, limit=400)
            # What stands on the bus without a write is none, wherever it points.
            ctx.set(dut.bus.w_data, noise.getrandbits(32))
            ctx.set(dut.bus.addr, noise.choice((address, noise.randrange(512))))
            idle[0] = True
            for _ in range(noise.randrange(4)):
                await ctx.tick()

    async def test(ctx):
        for _ in range(60):
            number = rng.randrange(3)
            # A parameter of this program or another, asked for with the change of program.
            other = rng.randrange(3)
            places = core.select(other).parameter_addresses
            if rng.random() < 0.7:
                writes.append((PROGRAM, rng.randrange(9)))
            if places and rng.random() < 0.7:
                name, address = rng.choice(sorted(places.items()))
                word = rng.getrandbits(20)
                writes.append((address, word))
                models[other].params[core.parts[other].program.find(name)] = word
            for _ in range(rng.randrange(4)):
                await ctx.tick()
            ctx.set(dut.choice, number)
            await ctx.tick()
            await ctx.tick()
            for _ in range(400):
                if ctx.get(dut.chosen) and not writes and idle[0]:
                    break
                await ctx.tick()
            assert ctx.get(dut.chosen), "the program is not changed"
            program = core.parts[number].program
            words = random_inputs(program, rng.getrandbits(20), 1)[0]
            await put_record(ctx, dut.i, words, limit=400)
            out, _ = models[number].update(np.array(words)[:, None])
            wanted.extend(int(w) & MASK for w in out[:, 0])
            if rng.random() < 0.5:  # else the change is asked for while the program still runs
                await ctx.tick().repeat(60)
        await ctx.tick().repeat(300)
        assert await read(ctx, dut.bus, PROGRAM) == ctx.get(dut.choice)

    run_bench(dut, test, background=[sink, host])
    assert got == wanted
    assert len(wanted) >= 60
    assert any(part.program.of_kind(Kind.PARAM) for part in core.parts)


def test_a_torn_record_is_told(simulate) -> None:
    core = build_shared_core(random_programs(1, 2, n_ops=4, n_states=2), "small")
    dut = Engine(machine=core.machine, image=core.image, selector=True)

    async def bench(ctx):
        ctx.set(dut.i.valid, 1)
        ctx.set(dut.i.payload.last, 1)  # the records have two words or more
        pulses = 0
        for _ in range(30):
            _, _, framing, ready = await ctx.tick().sample(dut.framing, dut.i.ready)
            pulses += framing
            if ready:
                ctx.set(dut.i.valid, 0)
        assert pulses == 1

    assert len(core.program.inputs) > 1
    simulate(dut, bench)
