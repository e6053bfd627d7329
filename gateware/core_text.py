"""What stands at the head of a core's Verilog: its ports, their timing, how to instantiate it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from boresight.gateware.core import Core
from boresight.gateware.register_map import register_map
from boresight.gateware.registers.model import Port, Streams
from boresight.model.tools.c_names import comment
from boresight.model.words.fixed import Format

__all__ = ["BUS", "RESET", "STREAMS", "core_ports", "core_text"]

_FOR = {
    (True, True): (
        "For synthesis to Spartan-6: it instantiates vendor primitives (LUT6, DSP48A1). Simulate",
        "core_sim.v, which is the same core cycle by cycle.",
    ),
    (False, True): (
        "For synthesis to any part, and for simulation in any language mode from Verilog-2001 on:",
        "it has no vendor primitives.",
    ),
    (False, False): (
        "For simulation, in any language mode from Verilog-2001 on, and for synthesis to other",
        "parts: the same core as core.v cycle by cycle, with the behaviour of the vendor",
        "primitives in their place. Its build identifier reads 0.",
    ),
}

STREAMS = """\
Streams: a word passes at the rising edge of clk at which valid and ready are both 1. Keep valid
and payload until then. ready does not wait for valid, nor valid for ready. Bit {last} of a payload,
`last`, is 1 with the last word of a record and 0 with the others. If `last` comes too early or
is missing, the update is dropped and bit 1 of the status register is set; words after a missing
`last` are swallowed up to the next one. While an input word is missing or an output word is not
taken the whole core stands still."""

BUS = """\
Bus: drive addr, w_data and w_stb, and keep them until the cycle in which w_ack is 1; the write
is done at its rising edge. Writes of parameters and of the program's number wait for the first
word of a record to be due, so they never change an update at work. r_data is the word at the
addr of the cycle before. Status flags are cleared by writing 1 (address 512)."""

RESET = """\
Reset: rst is synchronous, active high; one cycle is enough. i__ready is 1 three cycles after it.
It abandons the update at work, unless that one's last cycle is the first one of rst, clears
flags and the count of updates, and selects program 0. States stay as the last complete update
left them, and parameters as they were written. Power-up (configuration; time 0 in simulation)
gives states their initial words and parameters their defaults; a reset after it is not needed.
To start an estimator anew, use what its inputs offer for that, or configure again."""

_WORDS = "Words: fixed<W,I> has W bits, two's complement, I of them before the binary point."


def core_ports(word: int) -> tuple[tuple[str, str, int, str], ...]:
    """Direction, name, bits and meaning of every port of a core with words of so many bits."""
    return (
        ("input", "clk", 1, "clock; everything happens at its rising edge"),
        ("input", "rst", 1, "reset, synchronous, active high"),
        ("input", "i__payload", word + 1, f"input record: bit {word} last, below it a word"),
        ("input", "i__valid", 1, "the word is there"),
        ("output", "i__ready", 1, "the word is taken"),
        ("output", "o__payload", word + 1, f"output record: bit {word} last, below it a word"),
        ("output", "o__valid", 1, "the word is there"),
        ("input", "o__ready", 1, "the word is taken"),
        ("input", "bus__addr", 10, "word address of a register (registers.md)"),
        ("input", "bus__w_data", word, "word to write"),
        ("input", "bus__w_stb", 1, "write"),
        ("output", "bus__w_ack", 1, "the write is done with this cycle"),
        ("output", "bus__r_data", word, "word at the addr of the cycle before"),
        ("output", "saturated_update", 1, "a result of the last complete update was clamped"),
    )


def core_text(core: Core, *, instances: bool, identified: bool | None = None) -> str:
    """Comment for the head of ``core.verilog``; the source alone decides it.

    Parameters
    ----------
    core : Core
        The core.
    instances, identified : bool
        As of `Core.verilog`.
    """
    word = core.machine.arithmetic.word
    paragraphs = [
        (
            f"core: {', '.join(core.names)}; configuration {core.machine.name}, {word}-bit words.",
            f"Digest {core.digest}.",
        ),
        _FOR[instances, instances if identified is None else identified],
        tuple(_port_lines(word)),
        STREAMS.format(last=word).splitlines(),
        BUS.splitlines(),
        RESET.splitlines(),
        (_WORDS,),
        *(_record_lines(core, number, s) for number, s in enumerate(register_map(core).streams)),
        tuple(_template(word)),
    ]
    lines = "\n\n".join("\n".join(p) for p in paragraphs).splitlines()
    return "".join(f"// {line}".rstrip() + "\n" for line in lines) + "\n"


def _port_lines(word: int) -> Iterator[str]:
    """The ports as a table."""
    yield "Ports:"
    for direction, name, bits, meaning in core_ports(word):
        width = f"[{bits - 1}:0]" if bits > 1 else ""
        yield f"  {direction:<6} {width:<6} {name:<16} {meaning}"


def _record_lines(core: Core, number: int, streams: Streams) -> Sequence[str]:
    """The words of a program's records, and when they come."""
    one = core.select(number)
    plan, word = one.schedule, core.machine.arithmetic.word
    latencies = ", ".join(map(str, plan.latencies))
    return (
        f"Program {number}, {comment(streams.program)}: takes a record every {plan.interval} "
        "cycles. Its output words pass in",
        f"cycles {latencies}, where the first input word",
        "passes in cycle 1, and cycles in which the core stands still do not count.",
        *_words("in ", streams.inputs, word),
        *_words("out", streams.outputs, word),
    )


def _words(side: str, ports: Sequence[Port], word: int) -> Iterator[str]:
    for number, port in enumerate(ports):
        name, form, unit = comment(port.name), str(Format(word, port.frac)), comment(port.unit)
        yield f"  {side} {number:<3} {name:<20} {form:<14} {unit}".rstrip()


def _template(word: int) -> Iterator[str]:
    """An instance with every port."""
    ports = [f"    .{name}({name})" for _, name, _, _ in core_ports(word)]
    yield "Instance:"
    yield "  core estimator ("
    yield ",\n".join(ports)
    yield "  );"
