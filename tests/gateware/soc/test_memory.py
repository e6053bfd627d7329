"""The soft core's memory on its two buses: bytes, bursts, and what is refused."""

from __future__ import annotations

import pytest

from boresight.gateware.soc.bus import BURST
from boresight.gateware.soc.memory import PAGE_WORDS, Ram

WORDS = 3 * PAGE_WORDS


async def access(ctx, dut, bus, address: int, word: int | None = None, sel: int = 0xF) -> tuple:
    """One access: (word that was read, whether it was refused)."""
    ctx.set(bus.adr, address)
    ctx.set(bus.we, word is not None)
    ctx.set(bus.dat_w, word or 0)
    ctx.set(bus.sel, sel)
    ctx.set(bus.cyc, 1)
    ctx.set(bus.stb, 1)
    assert not ctx.get(bus.ack)
    await ctx.tick()
    assert ctx.get(bus.ack), "a cycle later"
    result = ctx.get(bus.dat_r), bool(ctx.get(dut.refused))
    await ctx.tick()
    assert not ctx.get(bus.ack), "one acknowledgement an access"
    ctx.set(bus.cyc, 0)
    ctx.set(bus.stb, 0)
    return result


def test_words_on_both_buses(ram, simulate) -> None:
    dut = Ram(words=WORDS)

    async def bench(ctx):
        for address in (0, 1, 2, 255, 256, WORDS - 1):
            assert (await access(ctx, dut, dut.dbus, address, address * 0x10101 + 7))[1] is False
        for address in (0, 1, 2, 255, 256, WORDS - 1):
            for bus in (dut.ibus, dut.dbus):
                assert await access(ctx, dut, bus, address) == (address * 0x10101 + 7, False)

    simulate(dut, bench)


@pytest.mark.parametrize("sel", range(16))
def test_bytes(ram, simulate, sel: int) -> None:
    dut = Ram(words=WORDS)

    async def bench(ctx):
        await access(ctx, dut, dut.dbus, 5, 0x11223344)
        await access(ctx, dut, dut.dbus, 5, 0xAABBCCDD, sel)
        new, old = (w.to_bytes(4, "little") for w in (0xAABBCCDD, 0x11223344))
        wanted = bytes(new[k] if sel >> k & 1 else old[k] for k in range(4))
        assert await access(ctx, dut, dut.dbus, 5) == (int.from_bytes(wanted, "little"), False)

    simulate(dut, bench)


@pytest.mark.parametrize("beyond", [0, 1, PAGE_WORDS, 1 << 28])
def test_beyond_the_memory(ram, simulate, beyond: int) -> None:
    """From the first word on that is not there: reads 0, is not written, is refused."""
    dut = Ram(words=WORDS)

    async def bench(ctx):
        for address in range(WORDS):
            ctx.set(ram.contents.data[address], address + 1)
        assert await access(ctx, dut, dut.dbus, WORDS - 1) == (WORDS, False)
        for bus in (dut.ibus, dut.dbus):
            assert await access(ctx, dut, bus, WORDS + beyond) == (0, True)
        assert (await access(ctx, dut, dut.dbus, WORDS + beyond, 99))[1]
        await ctx.tick()
        assert [ctx.get(ram.contents.data[k]) for k in range(WORDS)] == list(range(1, WORDS + 1))
        assert await access(ctx, dut, dut.ibus, WORDS - 1) == (WORDS, False)

    simulate(dut, bench)


def test_a_write_at_the_size_itself_wraps_nowhere(ram, simulate) -> None:
    """A memory of 2^n words has no address bit to spare: word 2^n must not become word 0."""
    dut = Ram(words=PAGE_WORDS)
    assert len(dut.fence) == 1, "no page, or the only one"

    async def bench(ctx):
        await access(ctx, dut, dut.dbus, 0, 1234)
        assert (await access(ctx, dut, dut.dbus, PAGE_WORDS, 99))[1]
        assert await access(ctx, dut, dut.dbus, 0) == (1234, False)
        ctx.set(dut.fence, 1)
        assert (await access(ctx, dut, dut.dbus, 0, 99))[1]
        assert await access(ctx, dut, dut.dbus, 0) == (1234, False)

    simulate(dut, bench)


@pytest.mark.parametrize("fence", range(4))
def test_pages_below_the_fence_are_not_written(ram, simulate, fence: int) -> None:
    dut = Ram(words=WORDS)
    assert len(dut.fence) == 2, "none to all three"

    async def bench(ctx):
        ctx.set(dut.fence, fence)
        for page in range(3):
            for address in (page * PAGE_WORDS, (page + 1) * PAGE_WORDS - 1):
                below = page < fence
                assert (await access(ctx, dut, dut.dbus, address, 77))[1] is below
                assert await access(ctx, dut, dut.dbus, address) == (0 if below else 77, False)

    simulate(dut, bench)


@pytest.mark.parametrize("name", ["ibus", "dbus"])
def test_a_burst_gives_a_word_in_each_cycle(ram, simulate, name: str) -> None:
    dut = Ram(words=WORDS)
    bus = getattr(dut, name)

    async def bench(ctx):
        for address in range(16):
            ctx.set(ram.contents.data[address], 100 + address)
        ctx.set(bus.adr, 4)
        ctx.set(bus.cyc, 1)
        ctx.set(bus.stb, 1)
        ctx.set(bus.cti, BURST)
        got = []
        await ctx.tick()
        for k in range(8):
            assert ctx.get(bus.ack) and not ctx.get(dut.refused)
            got.append(ctx.get(bus.dat_r))
            if k < 7:
                await ctx.tick()
                ctx.set(bus.adr, 4 + k + 1)
                ctx.set(bus.cti, 7 if k == 6 else BURST)
        await ctx.tick()
        assert not ctx.get(bus.ack), "the last word ends it"
        assert got == list(range(104, 112))

    simulate(dut, bench)


@pytest.mark.parametrize("missing", ["cyc", "stb"])
def test_without_a_strobe_nothing_happens(ram, simulate, missing: str) -> None:
    dut = Ram(words=WORDS)
    bus = dut.dbus

    async def bench(ctx):
        ctx.set(bus.sel, 0xF)
        ctx.set(bus.dat_w, 9)
        ctx.set(bus.we, 1)
        ctx.set(bus.stb if missing == "cyc" else bus.cyc, 1)
        for _ in range(4):
            await ctx.tick()
            assert not ctx.get(bus.ack) and not ctx.get(dut.refused)
        assert ctx.get(ram.contents.data[0]) == 0

    simulate(dut, bench)
