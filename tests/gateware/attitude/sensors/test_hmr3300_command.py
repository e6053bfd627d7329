"""Sequences of commands against a compass of a few lines, and against none."""

import functools

import pytest
from amaranth.hdl import Module

from boresight.gateware.attitude.sensors.hmr3300_command import TRIES, Commander, Stage
from tests.support.bench import Pins, Simulation, run_bench

#: Cycles from tick to tick, from line to line, of one character.
TICK, LINE, CHARACTER = 10, 30, 3
FLAGS = ("sent", "acknowledged", "timed_out", "paused")


class Compass:
    """What the maker says: *S in turn, *H and *M when stopped."""

    def __init__(self, *, deaf: bool = False, streaming: bool = True, stubborn: bool = False):
        self.deaf, self.streaming, self.stubborn = deaf, streaming, stubborn
        self.counts = False
        self.text, self.refusals = b"", 0
        self.commands: list[bytes] = []
        self.busy: list[int] = []  # cycles in which the commander is

    def hear(self, character: int) -> None:
        self.text += bytes([character])
        if character != ord("\n"):
            return
        command, self.text = self.text, b""
        self.commands.append(command)
        assert len(command) == 4 and command[:1] == b"*" and command[2:] == b"\r\n"
        if self.deaf:
            return
        if command[1:2] == b"S":
            self.streaming = not self.streaming
        elif command[1:2] in b"HM" and not self.streaming and not self.stubborn:
            self.counts = command[1:2] == b"M"
        else:
            self.refusals += 1


@functools.cache
def made() -> tuple[Commander, Pins, Simulation]:
    """The commander, made once, and what it shows."""
    top, dut = Module(), Commander(timeout_ticks=10, quiet_ticks=5)
    top.submodules.dut = dut
    signals = {name: getattr(dut, name) for name in ("busy", *FLAGS)}
    taken = dut.command.valid & dut.command.ready
    return dut, Pins(top, {"valid": dut.o.valid, "taken": taken, **signals}), Simulation(top)


def run(
    compass: Compass,
    cycles: int,
    mode,
    *,
    commands: dict[int, str] | None = None,
    silent=range(0),
    deaf=None,
) -> tuple[list, Commander]:
    """(cycle, event) pairs; ``mode`` is a number or a mapping from cycles to numbers."""
    dut, shown, simulation = made()
    events: list[tuple[int, str]] = []

    async def bench(ctx):
        wait, refusals, driven = 0, 0, {}

        def drive(name: str, value: int, port=dut) -> None:
            if driven.get(name) != value:
                ctx.set(getattr(port, name), value)
                driven[name] = value

        for cycle in range(cycles):
            if isinstance(mode, int) or cycle in mode:
                ctx.set(dut.mode, mode if isinstance(mode, int) else mode[cycle])
            if cycle in (commands or {}):
                ctx.set(dut.command.payload, ord(commands[cycle]))
                ctx.set(dut.command.valid, 1)
            if deaf is not None:
                compass.deaf = any(cycle in span for span in deaf)
            drive("tick", cycle % TICK == 0)
            speaks = compass.streaming and cycle % LINE == 0 and cycle not in silent
            refuses = compass.refusals > refusals and cycle not in silent
            refusals = compass.refusals
            drive("line", speaks)
            drive("is_counts", compass.counts)
            drive("invalid", refuses)
            drive("heard", speaks or refuses)
            drive("ready", wait == 0, dut.o)
            seen = shown.get(ctx)
            if seen["valid"] and wait == 0:
                compass.hear(ctx.get(dut.o.payload))
                wait = CHARACTER
            elif wait:
                wait -= 1
            if seen["busy"]:
                compass.busy.append(cycle)
            events.extend((cycle, name) for name in FLAGS if seen[name])
            await ctx.tick()
            if seen["taken"]:
                ctx.set(dut.command.valid, 0)
                ctx.set(dut.command.payload, 0)

    simulation.run(bench)
    return events, dut


def letters(compass: Compass) -> str:
    return "".join(chr(command[1]) for command in compass.commands)


def names(events: list) -> list[str]:
    return [name for _, name in events]


@pytest.mark.parametrize("mode", [2, 3])
def test_brings_counts(mode: int) -> None:
    compass = Compass()
    events, _ = run(compass, 1000, mode)
    assert letters(compass) == "SMS" and compass.counts and compass.streaming
    # Busy from the first letter to the last answer, and no longer.
    begin, end = next(iter(events))[0], events[-1][0]
    assert compass.busy == list(range(compass.busy[0], compass.busy[-1] + 1))
    assert compass.busy[0] < begin and compass.busy[-1] in (end - 1, end)
    assert names(events) == ["sent", "acknowledged", "sent", "sent", "acknowledged"]


def test_brings_headings_back() -> None:
    compass = Compass()
    compass.counts = True
    run(compass, 1000, 1)
    assert letters(compass) == "SHS" and not compass.counts and compass.streaming


@pytest.mark.parametrize("mode", [0, 1])
def test_says_nothing_while_all_is_well(mode: int) -> None:
    compass = Compass()
    assert run(compass, 2000, mode)[0] == [] and letters(compass) == ""


def test_mode_0_takes_silence_and_counts() -> None:
    compass = Compass(streaming=False)
    compass.counts = True
    assert run(compass, 2000, 0)[0] == [] and letters(compass) == ""


def test_starts_a_compass_that_is_stopped_without_stopping_it() -> None:
    compass = Compass(streaming=False)
    events, dut = run(compass, 1000, 1)
    assert letters(compass) == "HS" and compass.streaming
    # Time for the answer to *H, not a tick more; then the command.
    quiet = events[1][0] - events[0][0] - 3 * (CHARACTER + 1)
    assert (dut.quiet_ticks - 1) * TICK < quiet <= dut.quiet_ticks * TICK


def test_begins_after_the_time_out() -> None:
    compass = Compass(streaming=False)
    events, dut = run(compass, 1000, 1)
    assert dut.timeout_ticks == 15
    assert 15 * TICK <= events[0][0] - 3 * (CHARACTER + 1) - 1 <= 16 * TICK


def test_the_time_out_begins_with_the_last_character() -> None:
    """However the ticks fall: while a command is sent the timer stands."""
    for begin in range(300, 300 + TICK):
        compass = Compass(deaf=True)
        events, dut = run(compass, 700, {0: 0, begin: 2})
        (sent, name), (failed, what) = events[:2]
        assert (name, what) == ("sent", "timed_out")
        assert dut.timeout_ticks * TICK < failed - sent <= (dut.timeout_ticks + 1) * TICK


def test_tries_four_times_then_waits_four_time_outs() -> None:
    compass = Compass(deaf=True)
    events, dut = run(compass, 6000, 2)
    failed = [cycle for cycle, name in events if name == "timed_out"]
    assert letters(compass) == "S" * len(compass.commands)
    pauses = [b - a for a, b in zip(failed, failed[1:], strict=False)]
    whole = (dut.timeout_ticks + 1) * TICK
    for k, pause in enumerate(pauses):
        if k % TRIES == TRIES - 1:
            assert 5 * whole < pause < 6 * whole
        else:
            assert whole < pause < 2 * whole
    assert len(failed) > TRIES and {"paused"} < set(names(events))


def test_success_gives_all_tries_again() -> None:
    compass = Compass()
    events, _ = run(compass, 5000, {0: 2, 1500: 1}, deaf=(range(0, 500), range(1500, 5000)))
    assert 2 <= sum(cycle < 1500 for cycle, name in events if name == "timed_out") < TRIES
    late = [name for cycle, name in events if cycle > 1500 and name in ("timed_out", "paused")]
    assert late[:TRIES] == ["timed_out"] * TRIES and late[TRIES] == "paused"


def test_the_time_out_begins_with_the_mode() -> None:
    for begin in range(500, 700, 20):
        compass = Compass(streaming=False)
        events, _ = run(compass, 1000, {0: 0, begin: 1})
        assert events[0][0] - begin >= 15 * TICK


def test_refusal_ends_an_attempt_at_once() -> None:
    compass = Compass(stubborn=True)
    events, dut = run(compass, 400, 2)
    assert names(events)[:4] == ["sent", "acknowledged", "sent", "timed_out"]
    assert events[3][0] - events[2][0] < 2 * (CHARACTER + 1)


def test_effect_in_the_cycle_of_the_time_out_counts() -> None:
    dut = Commander(timeout_ticks=1, quiet_ticks=1)

    async def bench(ctx):
        async def ticks(count: int) -> None:
            for value in (1, 0) * count:
                ctx.set(dut.tick, value)
                await ctx.tick()

        ctx.set(dut.mode, 2)
        ctx.set(dut.o.ready, 1)
        await ticks(2)  # nothing comes: *M
        await ctx.tick().repeat(4)
        await ticks(1)  # quiet: *S
        await ctx.tick().repeat(4)
        await ticks(1)
        for name in ("tick", "line", "is_counts"):
            ctx.set(getattr(dut, name), 1)
        assert ctx.get(dut.acknowledged) and not ctx.get(dut.timed_out)

    run_bench(dut, bench)


def test_line_that_was_dead_leaves_no_compass_stopped() -> None:
    # While nothing is heard, *S stops what cannot be heard. Six time-outs and two silences later
    # at most it has been started again.
    stopped = 0
    for end in range(300, 2300, 83):
        if end % 4 == 0:
            compass = Compass()
            run(compass, end, 1, silent=range(100, end))
            stopped += not compass.streaming
        compass = Compass()
        events, _ = run(compass, end + 6 * 16 * TICK + 2 * 6 * TICK, 1, silent=range(100, end))
        assert compass.streaming and names(events)[-1] != "sent"
    assert stopped > 1


def test_mode_taken_back_on_the_way_leaves_the_compass_started() -> None:
    for back in range(5, 300, 13):
        compass = Compass()
        run(compass, 800, {0: 2, back: 0})
        assert compass.streaming, back


def test_single_letters() -> None:
    compass = Compass(streaming=False)
    events, _ = run(compass, 400, 0, commands={20: "Q", 100: "?", 200: "S"})
    assert letters(compass) == "Q?S" and names(events) == ["sent"] * 3
    compass = Compass()
    run(compass, 1000, {0: 0, 200: 2}, commands={20: "Q"})
    assert letters(compass) == "QSMS"


def test_single_letters_in_the_pause_after_four_attempts() -> None:
    compass = Compass(deaf=True)
    events, _ = run(compass, 6000, 2)
    pause = next(cycle for cycle, name in events if name == "paused")
    compass = Compass(deaf=True)
    run(compass, pause + 300, 2, commands={pause + 20: "Q", pause + 120: "?"})
    assert letters(compass) == "S" * TRIES + "Q?"


def test_single_letter_waits_for_the_end_of_a_sequence() -> None:
    compass = Compass()
    run(compass, 1000, 2, commands={60: "Q"})
    assert letters(compass) == "SMSQ"


def test_stages_without_meaning_end() -> None:
    # Stage is three bits; the values beyond its last are as WATCH.
    dut = Commander(timeout_ticks=3, quiet_ticks=2)
    assert max(stage.value for stage in Stage) == 4
    assert (dut.timeout_ticks, dut.quiet_ticks) == (3, 2)


@pytest.mark.parametrize(
    "name, value",
    [("timeout_ticks", 0), ("quiet_ticks", -1), ("timeout_ticks", 1.5), ("quiet_ticks", True)],
)
def test_parameters_are_checked(name: str, value) -> None:
    with pytest.raises(ValueError, match=rf"^{name} must be an integer from 1 on, not "):
        Commander(**{"timeout_ticks": 3, "quiet_ticks": 2, name: value})
