"""The reader as a whole: its figures, its members, stale sentences.

`tests.sim.attitude.devices` has the rest, with the model of the compass.
"""

from amaranth.hdl import Module

from boresight.gateware.attitude.sensors.hmr3300 import FLAGS, Hmr3300
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
    out, dut = happenings([100, b"\n", text], after=20_000)
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
        await ctx.tick().repeat(4 * 10 * dut.divisor)

    simulate(dut, bench, listen(dut.tx, dut.divisor, received))
    assert received == b"*Q\r\n"


def test_a_command_without_an_effect_is_told_after_the_time_out() -> None:
    out, dut = happenings([], after=24_000, mode=2, timeout_s=0.05, quiet_s=0.02)
    sent, late = (
        [at for at, what in out if what == name] for name in ("command_sent", "command_timed_out")
    )
    assert sent and late and sent[0] < late[0]
    assert dut.timeout_cycles < late[0] - sent[0] < 2 * dut.timeout_cycles


def test_a_refusal_ends_the_attempt_that_is_under_way() -> None:
    out, _ = happenings([9000, b"\n#I\r\n"], mode=2, timeout_s=0.05, quiet_s=0.02)
    names = [what for _, what in out if isinstance(what, str)]
    assert names[0] == "command_sent" and {*names[1:]} == {"invalid_command", "command_timed_out"}
    flags = [what for _, what in out if isinstance(what, set)]
    assert flags == [{"stale"}, {"stale", "commanding"}, {"stale"}]


def test_after_four_attempts_without_an_effect_the_next_one_waits() -> None:
    tick = 32 / SLOW["clock_hz"]
    times = {"stale_s": 8 * tick, "quiet_s": 4 * tick, "timeout_s": tick}
    out, _ = happenings([], after=1600, mode=2, **times)
    flags = [what - {"stale"} for _, what in out if isinstance(what, set)]
    assert flags == [set(), *({"commanding"}, set()) * 3, {"commanding"}, {"paused"}]


def test_a_compass_that_goes_on_is_not_stopped() -> None:
    """Its bytes are heard: no command counts as obeyed, and the time-out comes."""
    lines = [b"\n", *(b"1.0, 2.0, 3.0\r\n", 500) * 9]
    out, _ = happenings(lines, mode=2, timeout_s=0.05, quiet_s=0.02)
    names = {what for _, what in out if isinstance(what, str)}
    assert names == {"heading_line", "command_sent", "command_timed_out"}


def test_line_with_a_pause_or_a_framing_error_in_it_is_rejected() -> None:
    _, dut = happenings([])
    pause = 2 * dut.tick_cycles
    for data, wanted in (
        ([b"\n", b"12", pause, b"3.4, 5.6, 7.8\r\n"], ["rejected_line"]),
        ([b"\n", pause, b"3.4, 5.6, 7.8\r\n"], ["heading_line"]),
        ([b"\n12\x003.4, 5.6, 7.8\r\n"], ["framing_error", "rejected_line"]),
        ([b"\n", b"12", dut.tick_cycles - 100, b"3.4, 5.6, 7.8\r\n"], ["heading_line"]),
    ):
        out, _ = happenings(data, after=100)
        assert [what for _, what in out if isinstance(what, str)] == wanted
