"""The register bus: registers, signature, counters, inputs."""

import random

import pytest
from amaranth.hdl import Array, Const, Module, Mux, Shape, Signal, Value
from amaranth.lib import memory
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.counters import EventCounters
from boresight.gateware.attitude.bus.feed_registers import FeedRegisters
from boresight.gateware.bus.csr import Csr, packed
from boresight.gateware.bus.signature import BusSignature
from boresight.gateware.registers.model import Access, BitField, Register
from tests.support.bench import pulse, run_bench

# -- registers: what is written is read, what is not there does nothing ---------------------------

RO, WO, RW = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE
REGISTERS = (
    Register("magic", 0x40, RO, "", width=32, reset=0xDEAD_BEEF),
    Register("state", 0x41, RO, "", width=9),
    Register("wide", 0x42, RW, "", width=32, reset=7),
    Register("small", 0x44, RW, "", width=3, reset=5),
    Register("choice", 0x45, RW, "", width=2, reset=1, names=("a", "b", "c")),
    Register("order", 0x46, WO, "", width=2),
    Register("clock", 0x47, RO, "", width=32),
)


async def write(ctx, dut: Csr, offset: int, word: int) -> None:
    ctx.set(dut.offset, offset)
    ctx.set(dut.w_data, word)
    await ctx.tick()
    ctx.set(dut.w_en, offset < 8)  # others' writes do not come here
    await ctx.tick()
    ctx.set(dut.w_en, 0)


async def read(ctx, dut: Csr, offset: int) -> int:
    ctx.set(dut.offset, offset)
    await ctx.tick().repeat(dut.read_cycles)
    assert ctx.get(dut.known) == (0x40 + offset in {r.address for r in REGISTERS})
    return ctx.get(dut.r_data)


def test_after_power_up(simulate) -> None:
    dut = Csr(REGISTERS)

    async def bench(ctx):
        ctx.set(dut.state, 0x155)
        ctx.set(dut.clock, 0x8000_0001)
        assert [await read(ctx, dut, k) for k in range(16)] == [
            0xDEAD_BEEF,
            0x155,
            7,
            0,
            5,
            1,
            0,
            0x8000_0001,
            *[0] * 8,
        ]
        assert (ctx.get(dut.wide), ctx.get(dut.small), ctx.get(dut.choice)) == (7, 5, 1)

    simulate(dut, bench)


@pytest.mark.parametrize("read_cycles", [1, 2])
def test_random_accesses_against_a_model(read_cycles: int, simulate) -> None:
    dut, rng = Csr(REGISTERS, read_cycles=read_cycles), random.Random(1)
    widths = {2: ("wide", 32), 4: ("small", 3), 5: ("choice", 2)}
    model = {"wide": 7, "small": 5, "choice": 1, "state": 0, "clock": 0}

    async def bench(ctx):
        for _ in range(1500):
            offset, word = rng.randrange(16), rng.choice([rng.getrandbits(32), rng.randrange(5)])
            for name, width in (("state", 9), ("clock", 32)):
                if rng.random() < 0.3:
                    model[name] = rng.getrandbits(width)
                    ctx.set(getattr(dut, name), model[name])
            if rng.random() < 0.5:
                await write(ctx, dut, offset, word)
                if offset in widths:
                    name, width = widths[offset]
                    if name != "choice" or word & 3 < 3:
                        model[name] = word & (1 << width) - 1
            else:
                wanted = {
                    0: 0xDEAD_BEEF,
                    1: model["state"],
                    7: model["clock"],
                    **{k: model[name] for k, (name, _) in widths.items()},
                }.get(offset, 0)
                assert await read(ctx, dut, offset) == wanted
            for name, _ in widths.values():
                assert ctx.get(getattr(dut, name)) == model[name]

    simulate(dut, bench)


@pytest.mark.parametrize("read_cycles", [1, 2])
def test_words_follow_their_offsets(read_cycles: int, simulate) -> None:
    """A word is there ``read_cycles`` after its offset, whatever is asked for in between."""
    dut = Csr(REGISTERS, read_cycles=read_cycles)
    wanted = {0: 0xDEAD_BEEF, 1: 0x155, 2: 7, 4: 5, 5: 1, 7: 0x8000_0001}

    async def bench(ctx):
        ctx.set(dut.state, 0x155)
        ctx.set(dut.clock, 0x8000_0001)
        offsets, seen = [*wanted, *reversed(wanted)], []
        for offset in [*offsets, *[0] * read_cycles]:
            seen.append(ctx.get(dut.r_data))
            ctx.set(dut.offset, offset)
            await ctx.tick()
        seen.append(ctx.get(dut.r_data))
        assert seen[read_cycles:][: len(offsets)] == [wanted[offset] for offset in offsets]

    simulate(dut, bench)


def test_orders_last_one_cycle(simulate) -> None:
    dut = Csr(REGISTERS)

    async def bench(ctx):
        for offset, word, wanted in ((6, 0b101, (1, 0b01)), (6, 2, (1, 2)), (4, 3, (0, 0))):
            ctx.set(dut.offset, offset)
            ctx.set(dut.w_data, word)
            assert (ctx.get(dut.order_stb), ctx.get(dut.order)) == (0, 0)
            await ctx.tick()
            ctx.set(dut.w_en, 1)
            _, _, strobe, order = await ctx.tick().sample(dut.order_stb, dut.order)
            assert (strobe, order) == wanted
            ctx.set(dut.w_en, 0)
            _, _, strobe, order = await ctx.tick().sample(dut.order_stb, dut.order)
            assert (strobe, order) == (0, 0)

    simulate(dut, bench)


def test_members_of_a_block() -> None:
    block = Csr([*REGISTERS, Register("free", 0x48, RW, "", width=4)])
    assert {name: (port.flow, port.shape, port.init) for name, port in block.ports.items()} == {
        "state": (In, 9, None),
        "wide": (Out, 32, 7),
        "small": (Out, 3, 5),
        "choice": (Out, 2, 1),
        "order": (Out, 2, None),
        "order_stb": (Out, 1, None),
        "clock": (In, 32, None),
        "free": (Out, 4, 0),
    }


def test_without_a_reset_value_a_register_begins_with_0(simulate) -> None:
    dut = Csr([Register("free", 0x40, RW, "", width=4)])

    async def bench(ctx):
        assert ctx.get(dut.free) == await read(ctx, dut, 0) == 0

    simulate(dut, bench)


def test_packed_word_has_its_fields_in_their_places(simulate) -> None:
    """In any order, with gaps, values shorter than their fields, a word that begins at bit 1."""
    fields = [BitField("high", 9, "", width=3), BitField("low", 3, "", width=4)]
    word = packed(fields, {"high": Const(0b101, 3), "low": Const(0b110, 3)}, first=1)
    top, shown = Module(), Signal(32)
    top.d.comb += shown.eq(word)

    async def bench(ctx):
        assert ctx.get(shown) << 1 == 0b101 << 9 | 0b110 << 3

    simulate(top, bench)
    assert len(word) == 11


@pytest.mark.parametrize(
    "registers, message",
    [
        ((), r"^registers must not be empty$"),
        (
            (Register("a", 1, RW, "", width=1), Register("b", 2, RW, "", width=1)),
            r"^first address must be a multiple of 2, not 1$",
        ),
        (
            (Register("a", 4, RW, "", width=1), Register("b", 4, RW, "", width=1)),
            r"^addresses must ascend, not 4 \(b\) after 4$",
        ),
        (
            (Register("a", 4, RW, "", width=2, reset=4),),
            r"^a must have 1 to 32 bits that hold its reset value, not 2 bits for 4$",
        ),
        (
            (Register("a", 4, RW, "", width=33),),
            r"^a must have 1 to 32 bits that hold its reset value, not 33 bits for 0$",
        ),
    ],
)
def test_declaration_is_checked(registers, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Csr(registers)


# -- the register bus: who drives what, and how wide it is ----------------------------------------


@pytest.mark.parametrize(("word", "address"), [(18, 10), (32, 12)])
def test_members_as_the_initiator_sees_them(word: int, address: int) -> None:
    members = BusSignature(word=word, address=address).members
    assert {name: (member.flow, member.shape) for name, member in members.items()} == {
        "addr": (Out, address),
        "w_data": (Out, word),
        "w_stb": (Out, 1),
        "w_ack": (In, 1),
        "r_data": (In, word),
    }


def test_a_core_has_ten_bits_of_address() -> None:
    assert BusSignature(word=32).members["addr"].shape == 10


# -- every event is counted once, whatever the others do ------------------------------------------


async def counters_read(ctx, dut: EventCounters, index: int) -> int:
    ctx.set(dut.index, index)
    await ctx.tick().repeat(dut.read_cycles)
    return ctx.get(dut.value)


@pytest.mark.parametrize("read_cycles", [1, 2])
@pytest.mark.parametrize("count", [1, 2, 5, 32])
def test_events_as_close_as_allowed(count: int, read_cycles: int, simulate) -> None:
    dut = EventCounters(count=count, bits=16, read_cycles=read_cycles)
    rng = random.Random(count)
    assert len(dut.index) == (count - 1).bit_length() + 1
    assert dut.interval == 4 * max(1, 1 << (count - 1).bit_length())

    async def bench(ctx):
        last, wanted = [-dut.interval] * count, [0] * count
        for cycle in range(60 * dut.interval):
            events = 0
            for k in range(count):
                if cycle - last[k] >= dut.interval and rng.random() < 0.3:
                    events |= 1 << k
                    last[k], wanted[k] = cycle, wanted[k] + 1
            ctx.set(dut.events, events)
            await ctx.tick()
        ctx.set(dut.events, 0)
        await ctx.tick().repeat(dut.interval + 4)
        assert [await counters_read(ctx, dut, k) for k in range(count)] == wanted
        assert min(wanted) > 30
        assert [await counters_read(ctx, dut, k) for k in range(count, 1 << len(dut.index))] == [
            0
        ] * ((1 << len(dut.index)) - count)

    simulate(dut, bench)


def test_every_phase_of_the_turn(simulate) -> None:
    dut = EventCounters(count=4)

    async def bench(ctx):
        for phase in range(dut.interval):
            await ctx.tick().repeat(3 * dut.interval + 1)
            ctx.set(dut.events, 0b1010)
            await ctx.tick()
            ctx.set(dut.events, 0)
            await ctx.tick().repeat(dut.interval + 4)
            assert [await counters_read(ctx, dut, k) for k in range(4)] == [
                0,
                phase + 1,
                0,
                phase + 1,
            ]

    simulate(dut, bench)


def test_clear_and_wrap(simulate) -> None:
    dut = EventCounters(count=3, bits=4)

    async def count(ctx, events: int, times: int) -> None:
        for _ in range(times):
            ctx.set(dut.events, events)
            await ctx.tick()
            ctx.set(dut.events, 0)
            await ctx.tick().repeat(dut.interval + 3)

    async def bench(ctx):
        await count(ctx, 0b111, 18)
        assert [await counters_read(ctx, dut, k) for k in range(3)] == [2, 2, 2]
        for wait in range(dut.interval):
            await pulse(ctx, dut.clear)
            await ctx.tick().repeat(dut.interval + 4)
            assert [await counters_read(ctx, dut, k) for k in range(3)] == [0, 0, 0]
            await count(ctx, 0b101, 3)
            assert [await counters_read(ctx, dut, k) for k in range(3)] == [3, 0, 3]
            await ctx.tick().repeat(wait + 1)

    simulate(dut, bench)


class Colliding(memory.Memory):
    """A block RAM: what is read from the place that is being written is wrong."""

    def elaborate(self, platform):
        m = Module()
        words = Array(Signal(Shape.cast(self.shape), name=f"word{k}") for k in range(self.depth))
        (writer,) = self.write_ports
        for reader in self.read_ports:
            wrong = writer.en & (writer.addr == reader.addr)
            with m.If(reader.en):
                m.d.sync += Value.cast(reader.data).eq(Mux(wrong, -1, words[reader.addr]))
        with m.If(writer.en):
            m.d.sync += words[writer.addr].eq(writer.data)
        return m


def test_a_counter_that_is_being_written_is_read(simulate, monkeypatch) -> None:
    """As it was before."""
    monkeypatch.setattr(memory, "Memory", Colliding)
    dut = EventCounters(count=3, bits=3, read_cycles=2)

    async def bench(ctx):
        ctx.set(dut.index, 2)
        seen = []
        for cycle in range(4 * dut.interval):
            ctx.set(dut.events, 4 * (cycle % dut.interval == 0))
            await ctx.tick()
            seen.append(ctx.get(dut.value))
        assert seen == sorted(seen) and set(seen) == {0, 1, 2, 3, 4}

    simulate(dut, bench)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"count": 0}, r"^count must be an integer from 1 to 256, not 0$"),
        ({"count": 3, "bits": 36}, r"^bits must be an integer from 1 to 35, not 36$"),
    ],
)
def test_parameters_are_checked(options: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EventCounters(**options)


# -- input registers: a set goes as a whole, whatever is written meanwhile ------------------------


@pytest.mark.parametrize("count", [1, 2, 7, 32])
def test_sets_are_whole(count: int) -> None:
    dut = FeedRegisters(word=32, init=range(100, 100 + count))
    rng = random.Random(count)
    live = [-1] * count  # what the conductor has
    sets: list[list[int]] = []
    wanted = list(range(100, 100 + count))

    async def conductor(ctx):
        while True:
            ctx.set(dut.free, rng.random() < 0.3)
            ctx.set(dut.ready, rng.random() < 0.7)
            _, _, valid, ready, index, data, done = await ctx.tick().sample(
                dut.valid, dut.ready, dut.index, dut.data, dut.done
            )
            if valid and ready:
                live[index] = data
            assert not done or (valid and ready and index == count - 1)
            if done:
                sets.append(list(live))

    async def host(ctx):
        for turn in range(12):
            for _ in range(rng.randrange(3) + (turn > 0)):
                k, word = rng.randrange(count), rng.getrandbits(32)
                ctx.set(dut.w_index, k)
                ctx.set(dut.w_data, word)
                ctx.set(dut.w_en, 1)
                busy = 1
                while busy:  # the bus waits
                    _, _, busy = await ctx.tick().sample(dut.busy)
                ctx.set(dut.w_en, 0)
                wanted[k] = word
            await pulse(ctx, dut.take)
            expected = list(wanted)
            if rng.random() < 0.5:
                continue  # writes at once, and has to wait
            while ctx.get(dut.busy):
                await ctx.tick()
            assert sets[-1] == expected
        while ctx.get(dut.busy):
            await ctx.tick()
        assert sets[-1] == wanted and len(sets) == 12

    run_bench(dut, host, background=[conductor])


def test_a_set_begins_with_words_of_either_sign(simulate) -> None:
    """Which stay while nothing is written."""
    dut = FeedRegisters(word=26, init=[-3, 1])

    async def bench(ctx):
        ctx.set(dut.w_data, 7)
        await ctx.tick()
        ctx.set(dut.free, 1)
        ctx.set(dut.ready, 1)
        await pulse(ctx, dut.take)
        words = []
        while ctx.get(dut.busy):
            _, _, valid, word = await ctx.tick().sample(dut.valid, dut.data)
            words += [word] * valid
        assert words == [(1 << 26) - 3, 1]

    simulate(dut, bench)


@pytest.mark.parametrize("count", [0, 33])
def test_count_is_checked(count: int) -> None:
    with pytest.raises(ValueError, match=rf"^init must have 1 to 32 words, not {count}$"):
        FeedRegisters(word=32, init=[0] * count)
