"""The engine with small programs assembled by hand: results, cycles, streams, faults, bus."""

import functools
import random
from dataclasses import dataclass, field

import pytest
from amaranth.hdl import ResetInserter, Signal

from boresight.gateware.engine.engine import Engine
from boresight.gateware.machine import ALL_CONFIGS, CONFIGS, Machine
from boresight.gateware.microcode.image import Image
from boresight.model.words.fixed import saturate, wrap
from tests.support.bench import Simulation, pulse, put, read, write

WORD = 32
MASK = (1 << WORD) - 1
#: Registers of the test program: offset in bank 0, except the parameter and its result (last lane).
ONE, X, Y, PARAM, PRODUCT = 0, 10, 11, 5, 12
DIGEST = 0x0123_4567_89AB_CDEF
STATUS, UPDATES = 512, 513
CONFIG = pytest.mark.parametrize("config", sorted(CONFIGS))
ANY_CONFIG = pytest.mark.parametrize("config", sorted(ALL_CONFIGS))


@dataclass
class Assembler:
    """Builds a ROM: fields of a slot go to the words of their stages."""

    machine: Machine
    words: dict[int, dict[str, int]] = field(default_factory=dict)

    def slot(self, cycle: int, lane: int = 0, **fields: int) -> None:
        """One slot issued at ``cycle``."""
        stages = {f.name: f.stage for f in self.machine.fields}
        for name, value in {"when": 1, **fields}.items():
            name = f"{name}{lane}"
            self.word(cycle + stages[name], **{name: value})

    def word(self, cycle: int, **fields: int) -> None:
        """Fields at work in ``cycle``."""
        for name, value in fields.items():
            assert self.words.setdefault(cycle, {}).setdefault(name, value) == value, name

    def rom(self) -> list[int]:
        """The microwords."""
        self.word(max(self.words), home=1)
        out = []
        for cycle in range(max(self.words) + 1):
            value = position = 0
            for f in self.machine.fields:
                part = self.words.get(cycle, {}).get(f.name, 0)
                assert 0 <= part < 1 << f.width, (f.name, part)
                value |= part << position
                position += f.width
            out.append(value)
        return out


def register(machine: Machine, offset: int, bank: int = 0) -> int:
    """Register address."""
    return bank * machine.bank_depth + offset


def parameter(machine: Machine, offset: int, bank: int = 0) -> int:
    """Its address on the bus."""
    return 512 // machine.lanes * bank + offset


def state_offsets(machine: Machine) -> tuple[int, int]:
    """Offsets of state 0: current and next."""
    half = machine.bank_depth // 2
    return half, half + half // 2


def image(machine: Machine) -> Image:
    """s' = sat(s + x y / 2^16), output s' and p x / 2^16; one input word missing in between."""
    asm = Assembler(machine)
    now, after = state_offsets(machine)
    other = machine.lanes - 1
    asm.word(0, get=1, dest0=X)
    asm.word(2, get=1, get_last=1, dest0=Y)
    asm.slot(3, a_addr=X, b_addr=Y, shift=8, first=1)
    asm.slot(4, a_addr=now, b_addr=ONE, shift=8, we=1, sticky=1, dest=after)
    asm.slot(
        5,
        other,
        a_addr=register(machine, PARAM, other),
        b_addr=X,
        shift=8,
        first=1,
        we=1,
        wrap=1,
        dest=PRODUCT,
    )
    asm.slot(4 + machine.depth, a_addr=after)
    asm.word(5 + machine.depth, emit=1)
    asm.slot(5 + machine.depth, a_addr=register(machine, PRODUCT, other))
    asm.word(6 + machine.depth, emit=1, emit_last=1)
    asm.word(8 + machine.depth, home=1)
    registers = [0] * machine.register_words
    registers[ONE] = 1 << 16
    registers[register(machine, PARAM, other)] = 3 << 16
    rom = asm.rom()
    return Image(
        rom=rom, registers=registers, tables=[0] * 1536, lengths=(len(rom),), digest=DIGEST
    )


@dataclass
class Model:
    """The same in Python."""

    state: int = 0
    param: int = 3 << 16

    def update(self, x: int, y: int) -> tuple[list[tuple[int, int]], bool]:
        """Output record and whether it saturates."""
        acc = (1 << 7) + (x * y >> 8) + (self.state << 8)
        q = acc >> 8
        self.state = int(saturate(q, WORD))
        product = wrap(((1 << 7) + (self.param * x >> 8)) >> 8, WORD)
        return [(self.state & MASK, 0), (product & MASK, 1)], self.state != q


@functools.cache
def _made(config: str, program) -> tuple[Engine, Signal, Simulation]:
    """An engine with its program, made once, and its reset."""
    machine, reset = ALL_CONFIGS[config], Signal()
    dut = Engine(machine=machine, image=program(machine))
    return dut, reset, Simulation(ResetInserter(reset)(dut))


class Bench:
    """Drives an engine."""

    def __init__(
        self, config: str, seed: int = 0, gaps: float = 0.0, blocked: float = 0.0, program=image
    ) -> None:
        self.machine = ALL_CONFIGS[config]
        self.dut, self.reset, self.simulation = _made(config, program)
        self.rng = random.Random(seed)
        self.gaps, self.blocked = gaps, blocked
        self.outputs: list[tuple[int, int]] = []
        self.output_cycles: list[int] = []
        self.input_cycles: list[int] = []
        self.updates_saturated: list[int] = []
        self.cycle = 0

    def run(self, test) -> "Bench":
        """Run ``test(ctx)`` beside the sink of the output stream."""
        self.simulation.run(test, background=[self._sink])
        return self

    async def _sink(self, ctx):
        o = self.dut.o
        held = None
        while True:
            ready = self.rng.random() >= self.blocked
            ctx.set(o.ready, ready)
            _, _, valid, word, last = await ctx.tick().sample(
                o.valid, o.payload.data, o.payload.last
            )
            if held is not None:
                assert (valid, word, last) == held, "the output changed while it waited"
            held = (valid, word, last) if valid and not ready else None
            if valid and ready:
                self.outputs.append((word, last))
                self.output_cycles.append(self.cycle)
                self.updates_saturated.append(ctx.get(self.dut.saturated_update))
            self.cycle += 1

    async def put(self, ctx, *words: int, last: int | None = -1, limit: int = 300) -> None:
        """Send words; ``last`` is the position of the one so marked."""
        i = self.dut.i
        for number, value in enumerate(words):
            while self.rng.random() < self.gaps:
                await ctx.tick()
            marked = last is not None and number == last % len(words)
            await put(ctx, i, {"data": value & MASK, "last": marked}, limit)
            self.input_cycles.append(self.cycle - 1)

    async def drain(self, ctx, count: int, limit: int = 300) -> None:
        """Wait until ``count`` output words have come, and a program's length more."""
        for _ in range(limit):
            if len(self.outputs) >= count:
                break
            await ctx.tick()
        await ctx.tick().repeat(20)
        assert len(self.outputs) == count

    async def write(self, ctx, address: int, value: int, limit: int = 200) -> int:
        """Bus write; cycles that it took."""
        return await write(ctx, self.dut.bus, address, value, limit)

    async def read(self, ctx, address: int) -> int:
        """Bus read."""
        return await read(ctx, self.dut.bus, address)


def random_records(seed: int, count: int) -> list[tuple[int, int]]:
    """Input pairs, some so large that the state saturates."""
    rng = random.Random(seed)
    return [
        (
            wrap(rng.getrandbits(WORD) >> rng.randrange(20), WORD),
            wrap(rng.getrandbits(WORD) >> rng.randrange(20), WORD),
        )
        for _ in range(count)
    ]


@CONFIG
@pytest.mark.parametrize("gaps, blocked", [(0, 0), (0.5, 0), (0, 0.5), (0.3, 0.7)])
def test_results_under_stalls(config: str, gaps: float, blocked: float) -> None:
    bench = Bench(config, seed=1, gaps=gaps, blocked=blocked)
    records = random_records(2, 25)

    async def test(ctx):
        for x, y in records:
            await bench.put(ctx, x, y)
        await bench.drain(ctx, 2 * len(records))
        assert await bench.read(ctx, UPDATES) == len(records)
        assert await bench.read(ctx, STATUS) & 0b0011 == 0b0001
        assert await bench.read(ctx, 514) == DIGEST & MASK
        assert await bench.read(ctx, 515) == DIGEST >> WORD

    bench.run(test)
    model = Model()
    results = [model.update(x, y) for x, y in records]
    assert bench.outputs == [word for words, _ in results for word in words]
    # While a record is put out the flag still tells of the update before.
    assert bench.updates_saturated[2::2] == [int(s) for _, s in results[:-1]]
    assert {s for _, s in results} == {False, True}


@CONFIG
def test_no_framing_hangs_the_engine(config: str) -> None:
    bench, model = Bench(config, seed=5, gaps=0.2, blocked=0.3), Model()
    rng = random.Random(6)

    async def test(ctx):
        for k in range(40):
            count = rng.randrange(1, 6)
            words = [rng.getrandbits(10) for _ in range(count)]
            await bench.put(ctx, *words)
            if count == 2:
                expected.extend(model.update(*words)[0])
            if k % 10 == 0:
                await bench.put(ctx, *range(1 + 2 * (k % 20 == 0)))  # too short or too long
                await bench.drain(ctx, len(expected))
                assert await bench.read(ctx, STATUS) & 2
                await bench.write(ctx, STATUS, 2)
                assert await bench.read(ctx, STATUS) & 2 == 0
        await bench.drain(ctx, len(expected))
        assert await bench.read(ctx, UPDATES) == len(expected) // 2

    expected: list[tuple[int, int]] = []
    bench.run(test)
    assert bench.outputs == expected


@CONFIG
def test_reset_in_mid_update_keeps_the_states(config: str) -> None:
    bench, model = Bench(config), Model()
    engine = bench.dut

    async def updates(ctx, x: int, q: int) -> None:
        bench.outputs.clear()
        await bench.put(ctx, x, q)
        await bench.drain(ctx, 2)
        assert bench.outputs == model.update(x, q)[0]

    async def test(ctx):
        parities = set()
        for after in range(1, 18):
            await updates(ctx, 1 << 16, 5)
            before = await bench.read(ctx, STATUS) >> 3
            ctx.set(engine.i.valid, 1)
            ctx.set(engine.i.payload.data, 1 << 16)
            ctx.set(engine.i.payload.last, 0)
            for _ in range(after):
                _, _, ready = await ctx.tick().sample(engine.i.ready)
                if ready:  # the words alternate between not last and last
                    ctx.set(engine.i.payload.last, ~ctx.get(engine.i.payload.last))
            ctx.set(engine.i.valid, 0)
            await pulse(ctx, bench.reset)
            ended = after > 14  # the second update ended before the reset
            assert await bench.read(ctx, STATUS) >> 3 == before ^ ended, after
            parities.add(before)
            if ended:
                model.update(1 << 16, 1 << 16)
            await updates(ctx, 1 << 16, 7 + after)
        assert parities == {0, 1}

    bench.run(test)


@ANY_CONFIG
def test_parameter_written_while_idle_counts_at_once(config: str) -> None:
    bench, model = Bench(config), Model()
    address = parameter(bench.machine, PARAM, bench.machine.lanes - 1)

    async def test(ctx):
        await ctx.tick().repeat(5)
        assert await bench.read(ctx, STATUS) >> 2 & 1, "not idle"
        assert await bench.write(ctx, address, 5 << 16) == 2
        await bench.put(ctx, 1000, 5)
        await bench.drain(ctx, 2)

    bench.run(test)
    model.param = 5 << 16
    assert bench.outputs == model.update(1000, 5)[0]


@CONFIG
@pytest.mark.parametrize("blocked", [0.0, 0.5])
def test_parameter_written_while_busy_waits(config: str, blocked: float) -> None:
    """With the input always valid the write takes one cycle between two records."""
    bench, model = Bench(config, blocked=blocked), Model()
    address = parameter(bench.machine, PARAM, bench.machine.lanes - 1)
    expected = []

    async def test(ctx):
        i = bench.dut.i
        await bench.put(ctx, 1000, 1)
        expected.extend(model.update(1000, 1)[0])
        # The second record stands at the door while the write waits for the first to end.
        ctx.set(i.valid, 1)
        ctx.set(i.payload.data, 1000)
        ctx.set(i.payload.last, 0)
        cycles = await bench.write(ctx, address, 7 << 16)
        assert cycles > 10
        model.param = 7 << 16
        await bench.put(ctx, 1000, 2)
        expected.extend(model.update(1000, 2)[0])
        await bench.drain(ctx, 4)

    bench.run(test)
    assert bench.outputs == expected


@CONFIG
def test_parameter_write_in_mid_record_does_not_hold_the_record(config: str) -> None:
    bench, model = Bench(config), Model()
    address = parameter(bench.machine, PARAM, bench.machine.lanes - 1)
    bus = bench.dut.bus

    async def test(ctx):
        await bench.put(ctx, 1000, last=None)
        ctx.set(bus.addr, address)
        ctx.set(bus.w_data, 5 << 16)
        ctx.set(bus.w_stb, 1)
        await ctx.tick().repeat(30)
        assert not ctx.get(bus.w_ack)
        await bench.put(ctx, 2)
        await bench.drain(ctx, 2)
        ctx.set(bus.w_stb, 0)
        await bench.put(ctx, 1000, 3)
        await bench.drain(ctx, 4)

    bench.run(test)
    first = model.update(1000, 2)[0]
    model.param = 5 << 16
    assert bench.outputs == first + model.update(1000, 3)[0]


@CONFIG
def test_clearing_one_flag_keeps_the_other(config: str) -> None:
    bench = Bench(config)

    async def test(ctx):
        await bench.put(ctx, 1)
        await bench.put(ctx, (1 << 31) - 1, (1 << 31) - 1)
        await bench.drain(ctx, 2)
        assert await bench.read(ctx, STATUS) & 3 == 3
        await bench.write(ctx, STATUS, 1)
        assert await bench.read(ctx, STATUS) & 3 == 2
        await bench.write(ctx, UPDATES, 3)
        assert await bench.read(ctx, STATUS) & 3 == 2
        assert ctx.get(bench.dut.saturated_update) == 1
        await bench.put(ctx, 0, 0)
        await bench.drain(ctx, 4)
        assert ctx.get(bench.dut.saturated_update) == 0

    bench.run(test)
