"""README.md of a core: what somebody must know who puts it into a design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from boresight.gateware.core import Core
from boresight.gateware.core_text import BUS, RESET, STREAMS, core_ports
from boresight.gateware.integration.wave import bus_drawing, record_drawing
from boresight.gateware.register_map import register_map
from boresight.model.declarations import EXACT_UNITS
from boresight.model.words.program import InPort, Port, Program

__all__ = ["readme_context"]

_UNITS = {
    "ht": "`ht`: half turns, 1 is 180 degrees; the word wraps as the angle does.",
    "turn": "`turn`: turns from 0 to 1, the word read as an unsigned number.",
    **{
        unit: f"`{unit}`: the value is an integer, each of its bits for itself; its bit k is bit "
        "k + W - I of the word."
        for unit in EXACT_UNITS
    },
}


def readme_context(core: Core, summaries: Mapping[str, str]) -> dict[str, Any]:
    """What the template of README.md needs of a core.

    Parameters
    ----------
    core : Core
        The core.
    summaries : mapping
        A line about each program, by its name.
    """
    word = core.machine.arithmetic.word
    texts = {"Streams": STREAMS.format(last=word), "Bus": BUS, "Reset": RESET}
    parts = [core.select(k) for k in range(len(core.parts))]
    return {
        "programs": [_program(one, summaries.get(one.program.name, "")) for one in parts],
        "ports": core_ports(word),
        "rules": {name: _sentences(text) for name, text in texts.items()},
        "bus_drawing": bus_drawing(core).markdown(),
        "registers": [
            (
                str(register.address),
                f"`{register.name}`",
                f"{bit.bit}" + (" (write 1 to clear)" if bit.clear else ""),
                f"`{bit.name}`: {bit.meaning}",
            )
            for register in register_map(core).registers
            for bit in register.fields
        ],
    }


def _sentences(text: str) -> str:
    """A paragraph of the Verilog's head without its first word."""
    said = text.partition(": ")[2].replace("\n", " ")
    return said[0].upper() + said[1:] if said[:4] != "rst " else f"`rst`{said[3:]}"


def _program(core: Core, summary: str) -> dict[str, Any]:
    """Records of the core's program at hand."""
    program, plan = core.program, core.schedule
    inputs, outputs = list(_inputs(program)), list(_outputs(program, plan.latencies))
    units = [row[3] for row in inputs] + [row[4] for row in outputs]
    return {
        "number": core.number,
        "name": program.name,
        "summary": summary or program.name,
        "inputs": [_cells(row) for row in inputs],
        "outputs": [_cells(row) for row in outputs],
        "notes": [text for unit, text in _UNITS.items() if unit in units]
        + [
            f"`{program.values[number].name}` is no word of the record: it is `{link.output}` of "
            f"program `{link.program}`, as that one's last update left it."
            for number, link in program.linked.items()
        ],
        "example": _example(program),
        "latency": max(plan.latencies),
        "interval": plan.interval,
        "drawing": record_drawing(core).markdown(),
    }


def _cells(row: Sequence[str]) -> list[str]:
    return [cell.replace("|", "\\|") for cell in row]


def _inputs(program: Program) -> Iterator[tuple[str, ...]]:
    """Word, name, format, unit, range, no new sample, meaning."""
    said = dict(zip(program.inputs, program.in_ports, strict=False))
    for k, number in enumerate(program.streamed):
        value, port = program.values[number], said.get(number, InPort())
        missing = "" if port.missing is None else f"{port.missing}"
        meaning = port.meaning
        if port.flags:
            missing = "0"
            meaning = meaning or f"1: new sample of {', '.join(port.flags)}"
        if missing == "hold":
            missing = "the last word again"
        yield (
            str(k),
            f"`{value.name}`",
            f"`{program.format(number)}`",
            value.unit,
            f"{value.low:g} to {value.high:g}",
            missing,
            meaning,
        )


def _outputs(program: Program, latencies: Sequence[int]) -> Iterator[tuple[str, ...]]:
    """Word, cycle, name, format, unit, meaning."""
    said = {port.name: port for port in program.ports}
    for k, (name, number) in enumerate(zip(program.output_names, program.outputs, strict=True)):
        port = said.get(name, Port(name))
        form = f"`{program.format(number)}`"
        yield str(k), str(latencies[k]), f"`{name}`", form, port.unit, port.meaning


def _example(program: Program) -> str:
    """A value of an input and its word."""
    number = program.streamed[0]
    value, form = program.values[number], program.format(number)
    real = value.high / 2 or value.low / 2
    digits = -(-program.arithmetic.word // 4)
    word = int(form.quantise(real)) & ((1 << program.arithmetic.word) - 1)
    return (
        f"`{value.name}` = {real:g} {value.unit}".rstrip() + f" is the word `0x{word:0{digits}x}`"
    )
