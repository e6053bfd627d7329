"""The reader as a whole: its figures, its members, stale sentences.

`tests.sim.attitude.devices` has the rest, with the model of the compass.
"""

import random
import re

from amaranth.hdl import Module

from boresight.gateware.attitude.sensors.hmr3300 import FLAGS, Hmr3300, SentenceParser
from tests.support.bench import Pins, put, run_bench

SLOW = {"clock_hz": 19_200 * 8, "stale_s": 0.05}  # 8 cycles a bit, 4096 a tick


def happenings(
    data: list, *, after: int = 0, mode: int = 0, **times: float
) -> tuple[list, Hmr3300]:
    """(cycle, event or flags) while bytes (0: no stop bit) or pauses of so many cycles come."""
    top, dut = Module(), Hmr3300(**{**SLOW, **times})
    top.submodules.dut = dut
    flags_of_it = {name: getattr(dut.flags, name) for name in FLAGS}
    shown = Pins(top, {**flags_of_it, "line": dut.line, "events": dut.events})
    out: list = []

    async def bench(ctx):
        now, flags = 0, None
        ctx.set(dut.mode, mode)

        def look() -> None:
            nonlocal flags
            seen = shown.get(ctx)
            events = seen["events"]
            out.extend((now, name) for k, name in enumerate(dut.EVENTS) if events >> k & 1)
            if seen["line"]:
                out.append((now, tuple(ctx.get(value) for value in dut.values)))
            if (raised := {name for name in FLAGS if seen[name]}) != flags:
                flags = raised
                out.append((now, raised))

        async def wait(cycles: int) -> None:
            nonlocal now
            for _ in range(cycles):
                await ctx.tick()
                now += 1
                ctx.set(dut.time, now)
                look()

        look()
        for item in data:
            if isinstance(item, int):
                await wait(item)
                continue
            for byte in item:
                for bit in (0, *(byte >> k & 1 for k in range(8)), 1) if byte else (*[0] * 10, 1):
                    ctx.set(dut.rx, bit)
                    await wait(dut.divisor)
        await wait(after)

    run_bench(top, bench)
    return out, dut


def test_line_and_stale() -> None:
    text = b"123.4, -5.6, 7.8\r\n"
    out, dut = happenings([100, b"\n", text], after=9000, stale_s=0.02)
    begin = 100 + 80 + 80 * (len(text) - 1)
    assert [what for _, what in out] == [
        {"stale"},
        "heading_line",
        (1234, -56, 78),
        set(),
        "went_stale",
        {"stale"},
    ]
    assert out[1][0] == out[3][0] and out[4][0] == out[5][0]
    good = out[1][0]
    assert good <= begin + dut.latency
    seconds = (out[-1][0] - good) / dut.clock_hz
    assert dut.stale_s <= seconds <= dut.stale_s + 2 * dut.tick_cycles / dut.clock_hz


def test_counts_flag() -> None:
    out, _ = happenings([b"\n", b"1, 2, 3\r\n", b"1.0, 2.0, 3.0\r\n"], after=100)
    assert [what for _, what in out if isinstance(what, str)] == ["counts_line", "heading_line"]
    assert [what for _, what in out if isinstance(what, set)] == [{"stale"}, {"counts"}, set()]


def test_commands_leave_on_the_line(simulate, listen) -> None:
    dut, received = Hmr3300(**SLOW), bytearray()

    async def bench(ctx):
        await put(ctx, dut.command, ord("Q"))
        for byte in b"#Dev=7\r\n":
            await put(ctx, dut.command, 0x100 | byte)
        await put(ctx, dut.command, ord("S"))
        await ctx.tick().repeat(20 * 10 * dut.divisor)

    simulate(dut, bench, listen(dut.tx, dut.divisor, received))
    assert received == b"*Q\r\n#Dev=7\r\n*S\r\n"


def test_line_with_a_pause_or_a_framing_error_in_it_is_rejected() -> None:
    dut = Hmr3300(**SLOW)
    pause = 2 * dut.tick_cycles
    for data, wanted in (
        ([b"\n", b"12", pause, b"3.4, 5.6, 7.8\r\n"], ["rejected_line"]),
        ([b"\n", pause, b"3.4, 5.6, 7.8\r\n"], ["heading_line"]),
        ([b"\n12\x003.4, 5.6, 7.8\r\n"], ["framing_error", "rejected_line"]),
        ([b"\n", b"12", dut.tick_cycles - 100, b"3.4, 5.6, 7.8\r\n"], ["heading_line"]),
    ):
        out, _ = happenings(data, after=100)
        assert [what for _, what in out if isinstance(what, str)] == wanted


#: A sentence with headings, and one with counts; each number with its value.
HEADINGS = re.compile(r" {0,7}(\d{1,3}\.\d), {0,7}(-?\d{1,3}\.\d), {0,7}(-?\d{1,3}\.\d)\r")
COUNTS = re.compile(", ".join([r" {0,7}(-?\d{1,5})"] * 3).replace(", ", ",") + r"\r")


def wanted(line: str) -> tuple[bool, tuple[int, ...]] | None:
    """What a line up to its LF means: whether counts, and the numbers; None: rejected."""
    if match := HEADINGS.fullmatch(line):
        values = tuple(int(text.replace(".", "")) for text in match.groups())
        good = values[0] <= 3599 and max(map(abs, values[1:])) <= 900
        return (False, values) if good else None
    if match := COUNTS.fullmatch(line):
        values = tuple(map(int, match.groups()))
        return (True, values) if max(map(abs, values)) <= 32_767 else None
    return None


def random_line(rng: random.Random) -> str:
    """A sentence, good or with small damage."""

    def number(first: bool) -> str:
        if kind:
            edge = rng.choice(
                (32_767, 32_768, 65_536, 99_999, 100_000, *[rng.randrange(32_768)] * 20)
            )
            return str(rng.choice((-1, 1)) * edge)
        tenths = rng.choice((3599, 3600, 9999, 0, rng.randrange(3700)) if first else (
            900, 901, 5, rng.randrange(1000)))  # fmt: skip
        sign = "" if first and rng.random() < 0.9 else rng.choice(("", "-"))
        return f"{sign}{tenths // 10}.{tenths % 10}"

    kind = rng.random() < 0.5
    spaces = lambda: " " * rng.choice((*[0, 1, 7] * 5, 8))  # noqa: E731
    text = ",".join(spaces() + number(k == 0) for k in range(3)) + "\r"
    for _ in range(rng.choice((0, 0, 0, 1, 2))):
        at = rng.randrange(len(text))
        text = text[:at] + rng.choice(("", *"0123456789-., +#I\rx")) + text[at + rng.randrange(2) :]
    return text


def test_a_sentence_is_good_if_it_fits_the_grammar() -> None:
    rng, seen = random.Random(4), []

    async def bench(ctx):
        for begun, text in enumerate(["", *some]):
            rejected = invalid = 0
            found = None
            for character in text + "\n" + "\0" * dut.latency:
                ctx.set(dut.data, ord(character))
                ctx.set(dut.valid, character != "\0")
                await ctx.tick()
                rejected += ctx.get(dut.rejected)
                invalid += ctx.get(dut.invalid)
                if ctx.get(dut.line):
                    values = tuple(ctx.get(value) for value in dut.values)
                    found = bool(ctx.get(dut.is_counts)), values
            if begun:
                seen.append((found, rejected, invalid))

    lines = [random_line(rng) for _ in range(500)] + ["#I\r", "#D\r", "HMR3300", "#"]
    for begin in range(0, len(lines), 100):
        some = lines[begin : begin + 100]
        top, dut = Module(), SentenceParser()
        top.submodules.dut = dut
        run_bench(top, bench)
    results = [wanted(line) for line in lines]
    assert [found for found, _, _ in seen] == results
    for line, result, (_, rejected, invalid) in zip(lines, results, seen, strict=True):
        assert (rejected, invalid) == (
            (0, 1) if line.startswith("#I") else (int(result is None), 0)
        ), line
    kinds = [result[0] for result in results if result]
    assert min(kinds.count(True), kinds.count(False)) > 40 and results.count(None) > 200
