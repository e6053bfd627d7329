"""The compass's sentences: the parser and its numbers."""

import functools
import random

import pytest

from boresight.gateware.attitude.sensors.hmr3300_number import (
    BITS,
    COUNT_MAX,
    HEADING_MAX,
    DecimalNumber,
)
from boresight.gateware.attitude.sensors.hmr3300_sentence import SentenceParser
from tests.support.bench import Simulation, at_edges
from tests.support.clock import pause

# -- the parser by itself: each rule of the grammar, each limit, each way to begin anew -----------

GOOD = b"1.0, 2.0, 3.0\r\n"


@functools.cache
def made(angle_max: int) -> tuple[SentenceParser, Simulation]:
    """The parser, made once."""
    dut = SentenceParser(angle_max=angle_max)
    return dut, Simulation(dut)


def parse(
    data: bytes, *, angle_max: int = 900, spoil: dict[int, str] | None = None, begin: bytes = b"\n"
) -> list:
    """What happens; ``spoil`` says before which byte "error" or "pause" comes."""
    (dut, simulation), out = made(angle_max), []

    def take(line: int, rejected: int, invalid: int, is_counts: int, *values: int) -> None:
        if line:
            out.append(("counts" if is_counts else "heading", *values))
        out.extend(["rejected"] * rejected + ["invalid"] * invalid)

    async def watch(ctx):
        signals = dut.line, dut.rejected, dut.invalid
        await at_edges(ctx, take, *signals, also=(dut.is_counts, *dut.values))

    async def pulse(ctx, signal):
        ctx.set(signal, 1)
        await ctx.tick()
        ctx.set(signal, 0)
        await pause(ctx, dut.cycles_per_byte - 1)

    async def bench(ctx):
        for k, byte in enumerate(begin + data):
            how = (spoil or {}).get(k - len(begin))
            if how:
                await pulse(ctx, getattr(dut, how))
            ctx.set(dut.data, byte)
            await pulse(ctx, dut.valid)
        await ctx.tick().repeat(dut.cycles_per_byte)

    simulation.run(bench, background=[watch])
    return out


@pytest.mark.parametrize(
    "text, reason",
    [
        (b"123.4, 18.6, -0.5\r\n", ("heading", 1234, 186, -5)),
        (b"1256, -234, -1894\r\n", ("counts", 1256, -234, -1894)),
        (b"0.0, 0.0, 0.0\r\n", ("heading", 0, 0, 0)),
        (b"359.9, 90.0, -90.0\r\n", ("heading", 3599, 900, -900)),
        (b"000.0,-0.0,-000.1\r\n", ("heading", 0, 0, -1)),
        (b"1.2,3.4,5.6\r\n", ("heading", 12, 34, 56)),
        (b"       1.2,       3.4,       5.6\r\n", ("heading", 12, 34, 56)),
        (b"32767, -32767, 0\r\n", ("counts", 32_767, -32_767, 0)),
        (b"00001,-00009,99\r\n", ("counts", 1, -9, 99)),
        (b"0,0,0\r\n", ("counts", 0, 0, 0)),
        (b"6, 57, 8\r\n", ("counts", 6, 57, 8)),
    ],
)
def test_good(text: bytes, reason: tuple) -> None:
    assert parse(text + text) == [reason, reason]


@pytest.mark.parametrize(
    "text",
    [
        b"360.0, 0.0, 0.0\r\n",
        b"999.9, 0.0, 0.0\r\n",
        b"-1.0, 0.0, 0.0\r\n",
        b"-0.0, 0.0, 0.0\r\n",
        b"1.0, 90.1, 0.0\r\n",
        b"1.0, 0.0, -90.1\r\n",
        b"1.0, 999.9, 0.0\r\n",
        b"32768, 0, 0\r\n",
        b"0, -32768, 0\r\n",
        b"0, 0, 65535\r\n",
        b"0, 0, 65536\r\n",
        b"98304, 0, 0\r\n",
        b"99999, 0, 0\r\n",
        b"65537, 0, 0\r\n",
        b"000001, 0, 0\r\n",
        b"1.0, 2.0\r\n",
        b"1, 2\r\n",
        b"1\r\n",
        b"1.0, 2.0, 3.0, 4.0\r\n",
        b"1, 2, 3, 4\r\n",
        b"1, 2, 3, 4, 5, 6\r\n",
        b"1.0, 2.0, 3.0, 4.0, 5.0, 6.0\r\n",
        b"1.0, 2, 3.0\r\n",
        b"1, 2.0, 3\r\n",
        b"1, 2, 3.0\r\n",
        b"1.0, 2.0, 3\r\n",
        b"1.00, 2.0, 3.0\r\n",
        b"1., 2.0, 3.0\r\n",
        b".1, 2.0, 3.0\r\n",
        b"1000.0, 2.0, 3.0\r\n",
        b"1.0, 0001.0, 3.0\r\n",
        b"1..0, 2.0, 3.0\r\n",
        b"1.2.3, 2.0, 3.0\r\n",
        b"+1.0, 2.0, 3.0\r\n",
        b"1.0, +2.0, 3.0\r\n",
        b"1.0, --2.0, 3.0\r\n",
        b"1.0, - 2.0, 3.0\r\n",
        b"1.0, 2-.0, 3.0\r\n",
        b"1.0 , 2.0, 3.0\r\n",
        b"1.0, 2.0, 3.0 \r\n",
        b"1 0.0, 2.0, 3.0\r\n",
        b"1.0, 2.0, 3.0\n",
        b"1.0, 2.0, 3.0\r\r\n",
        b"1.0, 2.0,\r\n",
        b", 2.0, 3.0\r\n",
        b"-\r\n",
        b"1.0,, 3.0\r\n",
        b"1.0; 2.0, 3.0\r\n",
        b"\r\n",
        b"\n",
        b" \r\n",
        b"1.0\t, 2.0, 3.0\r\n",
        b"        1.0, 2.0, 3.0\r\n",
        b"1.0,        2.0, 3.0\r\n",
        b"HMR3300 1.0\r\n",
        b"#\r\n",
        b"#D\r\n",
        b" #I\r\n",
        b"1.0, #I\r\n",
        b"##I\r\n",
        b"1\xb2.0, 2.0, 3.0\r\n",
        b"1.0, 2.0, 3.0\x8d\n",
        b"/.0, 2.0, 3.0\r\n",
        b":.0, 2.0, 3.0\r\n",
        b"1.0, 2.0, 3.0\rx\n",
        b" " * 300 + b"1.0, 2.0, 3.0\r\n",
        b"1" * 300 + b"\r\n",
    ],
)
def test_not_good_counts_once_and_the_next_line_is_taken(text: bytes) -> None:
    assert parse(text + GOOD) == ["rejected", ("heading", 10, 20, 30)]


@pytest.mark.parametrize(
    "limit, text, good",
    [
        (600, b"1.0, 60.0, -60.0\r\n", True),
        (600, b"1.0, 60.1, 0.0\r\n", False),
        (600, b"60.1, 0.0, 0.0\r\n", True),
        (600, b"1.0, 0.0, -60.1\r\n", False),
        (9999, b"1.0, 999.9, -999.9\r\n", True),
        (0, b"1.0, 0.0, 0.1\r\n", False),
        (0, b"1.0, 0.0, 0.0\r\n", True),
        (600, b"601, 700, -800\r\n", True),
    ],
)
def test_limit_of_pitch_and_roll(limit: int, text: bytes, good: bool) -> None:
    assert ("rejected" not in parse(text, angle_max=limit)) == good


def test_refusal_is_no_rejected_line() -> None:
    assert parse(b"#I\r\n#I and more\r\n#Ix\n" + GOOD) == ["invalid"] * 3 + [
        ("heading", 10, 20, 30)
    ]


@pytest.mark.parametrize("at", range(len(GOOD)))
def test_framing_error_spoils_the_line(at: int) -> None:
    assert parse(GOOD + GOOD, spoil={at: "error"}) == ["rejected", ("heading", 10, 20, 30)]


@pytest.mark.parametrize("at", range(1, len(GOOD)))
def test_pause_in_a_line_spoils_it(at: int) -> None:
    assert parse(GOOD + GOOD, spoil={at: "pause"}) == ["rejected", ("heading", 10, 20, 30)]


def test_pause_between_lines_is_nothing() -> None:
    assert (
        parse(GOOD + GOOD, spoil={0: "pause", len(GOOD): "pause"}) == [("heading", 10, 20, 30)] * 2
    )


def test_two_errors_in_a_line_reject_it_once() -> None:
    assert parse(GOOD + GOOD, spoil={2: "error", 5: "pause", 7: "error"}) == [
        "rejected",
        ("heading", 10, 20, 30),
    ]


def test_the_kind_of_a_line_is_its_own() -> None:
    heading = ("heading", 10, 20, 30)
    assert parse(GOOD + b"1, 2, 3\r\n" + GOOD) == [heading, ("counts", 1, 2, 3), heading]


def test_begins_with_a_whole_line() -> None:
    assert parse(b"23.4, 5.6, 7.8\r\n" + GOOD, begin=b"") == [("heading", 10, 20, 30)]


def test_values_stay_while_the_next_line_comes(simulate) -> None:
    dut = SentenceParser()

    async def bench(ctx):
        shown = set()
        for byte in b"\n-1, 2, -3\r\n" + b"44, 55, 66, 77\r\n" + b"123.4, 5.6, 7.8\r":
            ctx.set(dut.data, byte)
            ctx.set(dut.valid, 1)
            await ctx.tick()
            ctx.set(dut.valid, 0)
            for _ in range(dut.cycles_per_byte - 1):
                shown.add((ctx.get(dut.is_counts), *(ctx.get(v) for v in dut.values)))
                await ctx.tick()
        assert shown == {(0, 0, 0, 0), (1, -1, 2, -3)}
        ctx.set(dut.data, ord("\n"))
        ctx.set(dut.valid, 1)
        for _ in range(dut.latency):
            assert not ctx.get(dut.line)
            await ctx.tick()
            ctx.set(dut.valid, 0)
        assert ctx.get(dut.line)
        assert (ctx.get(dut.is_counts), *(ctx.get(v) for v in dut.values)) == (0, 1234, 56, 78)

    simulate(dut, bench)


@pytest.mark.parametrize("value", [-1, 10_000, 60.0, True, "60"])
def test_angle_max_is_checked(value) -> None:
    with pytest.raises(
        ValueError,
        match=r"^angle_max must be tenths of a degree from 0 to 9999, "
        r"not ",
    ):
        SentenceParser(angle_max=value)


# -- numbers digit by digit against Python's, beyond the range that the grammar leaves ------------

NUMBERS = [
    0,
    1,
    9,
    10,
    599,
    600,
    601,
    3599,
    3600,
    32_767,
    32_768,
    65_535,
    65_536,
    65_545,
    98_304,
    99_999,
    *random.Random(1).sample(range(100_000), 60),
]


@pytest.mark.parametrize(
    "tenths, first, limit", [(0, 0, COUNT_MAX), (0, 1, COUNT_MAX), (1, 1, HEADING_MAX), (1, 0, 600)]
)
def test_value_and_limit(tenths: int, first: int, limit: int, simulate) -> None:
    dut = DecimalNumber(angle_max=600)

    async def bench(ctx):
        ctx.set(dut.tenths, tenths)
        ctx.set(dut.first, first)
        stored: list[int] = []
        for k, number in enumerate(NUMBERS):
            negative = k % 2
            for digit in str(number):
                ctx.set(dut.digit, int(digit))
                ctx.set(dut.take, 1)
                await ctx.tick()
                ctx.set(dut.take, 0)
                await pause(ctx, BITS + 1)
            assert ctx.get(dut.over) == (number > limit), number
            ctx.set(dut.negative, negative)
            ctx.set(dut.store, 1)
            await ctx.tick()
            ctx.set(dut.store, 0)
            await pause(ctx, BITS)
            stored.append((-number if negative else number) % (1 << BITS))
            values = ctx.get(dut.values)
            for back, value in enumerate(reversed(stored[-3:])):
                assert values >> BITS * (2 - back) & (1 << BITS) - 1 == value

    simulate(dut, bench)
