"""Any bytes, and any levels of the line: the HMR3300's reader against its grammar in Python."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from boresight.gateware.attitude.sensors.hmr3300 import Hmr3300
from boresight.gateware.attitude.sensors.hmr3300_sentence import SentenceParser
from boresight.gateware.boards.uart import Receiver
from boresight.gateware.verilog import to_verilog
from boresight.sim.rtl.compiled import build
from tests.support.attitude.devices.hmr3300_grammar import BROKEN, Event, events_of
from tests.support.attitude.devices.hmr3300_symbols import hostile_bytes, hostile_line, noise

#: Cycles of a bit in the runs at the pin: the clock is scaled down, the line is not.
DIVISOR = 32


@dataclass(frozen=True)
class Fuzzed:
    """What came out.

    Attributes
    ----------
    symbols : int
        Bytes and framing errors.
    events : Counter
        Of each kind.
    cycles : int
        Clock cycles.
    seconds : float
        Of the simulation.
    difference : str
        The first event that is not the model's; "" if there is none.
    """

    symbols: int
    events: Mapping[str, int]
    cycles: int
    seconds: float
    difference: str = field(default="")


def _read(text: str) -> Event:
    kind, *values = text.split()
    return Event(kind, tuple(map(int, values)))


def _difference(result: list[Event], wanted: list[Event]) -> str:
    """Framing errors are counted; a line is rejected before its end, the model knows at its end."""
    framing = [sum(e.kind == "framing" for e in events) for events in (result, wanted)]
    if framing[0] != framing[1]:
        return f"{framing[0]} framing errors, not {framing[1]}"
    result, wanted = ([e for e in events if e.kind != "framing"] for events in (result, wanted))
    for k, (have, want) in enumerate(zip(result, wanted, strict=False)):
        if have != want:
            return f"event {k}: {have}, not {want}"
    if len(result) != len(wanted):
        return f"{len(result)} events, not {len(wanted)}"
    return ""


def _bench(name: str) -> str:
    return (Path(__file__).parent / name).read_text()


def fuzz_parser(size: int, *, seed: int = 1, angle_max: int = 900) -> Fuzzed:
    """``size`` symbols straight into the parser, as fast as it takes them."""
    parser = SentenceParser(angle_max=angle_max)
    symbols = hostile_bytes(size, seed=seed, broken=0.002, pauses=0.002)
    bench = build(
        "hmr3300_parser_bench",
        {
            "parser.v": to_verilog(parser, "hmr3300_parser", instances=False),
            "bench.sv": _bench("hmr3300_parser_bench.sv"),
        },
        parameters={"GAP": parser.cycles_per_byte},
    )
    run = bench.run(
        {"symbols": "symbols.txt"},
        max_cycles=60 * size + 10_000,
        files={"symbols.txt": "".join(f"{s:x}\n" for s in symbols)},
    )
    results = [
        _read(line) for line in run.stdout.splitlines() if not line.startswith("-")
    ]  # Verilator says where it finished
    wanted = list(events_of(symbols, angle_max=angle_max))
    return Fuzzed(
        len(symbols),
        Counter(e.kind for e in results),
        run.cycles,
        run.seconds,
        _difference(results, wanted),
    )


def _run_line(
    levels: Sequence[tuple[int, int]], receiver: Receiver
) -> tuple[list[int], list[Event], int, float]:
    """Symbols as the receiver gets them, events of the reader, cycles, seconds."""
    reader = Hmr3300(clock_hz=19_200 * DIVISOR)
    bench = build(
        "hmr3300_line_bench",
        {
            "reader.v": to_verilog(reader, "hmr3300_reader", instances=False),
            "receiver.v": to_verilog(receiver, "hmr3300_receiver", instances=False),
            "bench.sv": _bench("hmr3300_line_bench.sv"),
        },
    )
    run = bench.run(
        {"levels": "levels.txt"},
        max_cycles=sum(n for _, n in levels) + 10_000,
        files={"levels.txt": "".join(f"{v} {n}\n" for v, n in levels)},
    )
    symbols, events = [], []
    for text in run.stdout.splitlines():
        if text.startswith("byte"):
            symbols.append(int(text.split()[1], 16))
        elif not text.startswith("-"):
            events.append(_read(text))
            if text == "framing":
                symbols.append(BROKEN)
    return symbols, events, run.cycles, run.seconds


def fuzz_pin(size: int, *, seed: int = 1, glitch: int | None = None) -> Fuzzed:
    """``size`` symbols at the pin, with wrong rates, glitches, false starts, framing faults.

    Glitches are as long as the receiver says it does not see, or up to ``glitch`` cycles.
    """
    receiver = Receiver(divisor=DIVISOR)
    symbols = hostile_bytes(size, seed=seed, broken=0.01)
    levels = hostile_line(
        symbols,
        divisor=DIVISOR,
        seed=seed,
        glitch=receiver.spacing - 1 if glitch is None else glitch,
    )
    received, result, cycles, seconds = _run_line(levels, receiver)
    difference = _difference(result, list(events_of(symbols)))
    if not difference and received != symbols:
        difference = "other bytes"
    return Fuzzed(len(symbols), Counter(e.kind for e in result), cycles, seconds, difference)


def fuzz_noise(cycles: int, *, seed: int = 1) -> Fuzzed:
    """Levels that mean nothing, and a good sentence after them.

    What the receiver makes of the noise is its affair; what the reader makes of that is not. The
    noise ends with two idle bytes' time and a line end, so the sentence has to come through.
    """
    tail = [10, *b"123.4, -5.6, 7.8\r\n"]
    levels = [
        *hostile_line([10], divisor=DIVISOR, glitch=0, seed=seed),
        *noise(cycles, seed=seed, longest=4 * DIVISOR),
        (1, 20 * DIVISOR),
        *hostile_line(tail, divisor=DIVISOR, glitch=0, seed=seed),
    ]
    received, result, ran, seconds = _run_line(levels, Receiver(divisor=DIVISOR))
    difference = _difference(result, list(events_of(received)))
    if not difference and (
        received[-len(tail) :] != tail or result[-1] != Event("heading", (1234, -56, 78))
    ):
        difference = "the sentence after the noise did not come through"
    return Fuzzed(len(received), Counter(e.kind for e in result), ran, seconds, difference)
