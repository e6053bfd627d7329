"""The serial line by itself: every byte, unequal clocks, glitches, breaks."""

import pytest

from boresight.gateware.boards.uart import Receiver, Transmitter, divisor_for
from tests.support.bench import at_edges, run_bench
from tests.support.clock import pause


def receive(divisor: int, drive, wait: int = 5) -> list[int | None]:
    """Bytes that come out, None for an error."""
    dut, out = Receiver(divisor=divisor), []

    def take(valid: int, error: int, data: int) -> None:
        assert not (valid and error)
        out.append(data if valid else None)

    async def watch(ctx):
        await at_edges(ctx, take, dut.valid, dut.error, also=[dut.data])

    async def bench(ctx):
        await ctx.tick().repeat(wait)
        await drive(ctx, dut)
        ctx.set(dut.rx, 1)
        await pause(ctx, 12 * divisor)

    run_bench(dut, bench, background=[watch])
    return out


@pytest.mark.parametrize("divisor", [8, 11, 16, 31, 100, 108])
@pytest.mark.parametrize("sign", [-1, 1])
def test_other_side_off_by_the_tolerance(divisor: int, sign: int) -> None:
    # The first byte begins so soon after the reset that an edge seen there would be taken for its.
    # Half a cycle of a bit is lost where its edges fall between cycles.
    # The middle look of the stop bit comes 0 to spacing cycles after its middle.
    dut = Receiver(divisor=divisor)
    tolerance = min(dut.to_middle / 9, (divisor - dut.to_middle - dut.spacing) / 10) / divisor
    assert tolerance >= (0.043 if divisor >= 100 else 0.0375)
    rate = 1 + sign * (tolerance - 0.06 / divisor)
    data = bytes([0x00, 0xFF, 0x55, 0xAA, 0x80, 0x7F, 0x01, 0xFE])

    async def drive(ctx, dut):
        begin, now = 0.0, 0
        for byte in data:
            for k, bit in enumerate((0, *(byte >> j & 1 for j in range(8)), 1)):
                ctx.set(dut.rx, bit)
                end = round(begin + (k + 1) * rate * divisor)
                await ctx.tick().repeat(end - now)
                now = end
            begin = now

    assert receive(divisor, drive, wait=2) == list(data)


@pytest.mark.parametrize("divisor, pulse", [(16, 1), (40, 3)])
def test_break_is_one_error(divisor: int, pulse: int, send) -> None:
    """Whatever pulse shorter than the spacing is in it."""

    async def drive(ctx, dut):
        assert pulse == dut.spacing - 1
        await send(ctx, dut.rx, divisor, b"a")
        for high in (pulse, divisor):
            ctx.set(dut.rx, 0)
            await pause(ctx, 1000)
            ctx.set(dut.rx, 1)
            await ctx.tick().repeat(high)
        await send(ctx, dut.rx, divisor, b"b")

    assert receive(divisor, drive) == [ord("a"), None, ord("b")]


@pytest.mark.parametrize("divisor, length", [(8, 4), (16, 5), (16, 7)])
def test_glitch_is_no_byte(divisor: int, length: int, send) -> None:
    async def drive(ctx, dut):
        ctx.set(dut.rx, 0)
        await ctx.tick().repeat(length)  # over before the middle of a start bit
        ctx.set(dut.rx, 1)
        await ctx.tick().repeat(divisor - length)
        await send(ctx, dut.rx, divisor, b"b")

    assert receive(divisor, drive) == [ord("b")]


@pytest.mark.parametrize("divisor", [8, 13])
@pytest.mark.parametrize("gap", [0, 30])
def test_transmitter(divisor: int, gap: int, listen) -> None:
    dut = Transmitter(divisor=divisor)
    received, data = bytearray(), bytes(range(0, 256, 17))

    async def bench(ctx):
        cycles = 0
        for byte in data:
            ctx.set(dut.i.payload, byte)
            ctx.set(dut.i.valid, 1)
            while True:
                _, _, ready = await ctx.tick().sample(dut.i.ready)
                cycles += 1
                if ready:
                    break
            ctx.set(dut.i.valid, 0)
            for _ in range(gap):
                await ctx.tick()
        assert gap or cycles == 10 * divisor * (len(data) - 1) + 1
        await ctx.tick().repeat(11 * divisor)

    run_bench(dut, bench, background=[listen(dut.tx, divisor, received)])
    assert bytes(received) == data


@pytest.mark.parametrize(
    "clock, baud, divisor",
    [(100e6, 115_200, 868), (100e6, 1_000_000, 100), (50e6, 115_200, 434), (50e6, 6_250_000, 8)],
)
def test_divisor(clock: float, baud: float, divisor: int) -> None:
    assert divisor_for(clock_hz=clock, baud=baud) == divisor
