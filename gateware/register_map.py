"""The register map of a compiled core."""

from __future__ import annotations

from boresight.gateware.core import Core
from boresight.gateware.registers.core import FIXED, program_choice
from boresight.gateware.registers.files import files_of
from boresight.gateware.registers.model import Access, Port, Register, RegisterMap, Streams
from boresight.model.words.program import Program

__all__ = ["register_map", "register_map_files"]


def register_map_files(core: Core) -> dict[str, str]:
    """The register map of a core as files; see `files_of`."""
    return files_of(register_map(core))


def register_map(core: Core) -> RegisterMap:
    """The register map of a compiled core."""
    word, several = core.machine.arithmetic.word, len(core.parts) > 1
    mask = (1 << word) - 1
    parameters = []
    for number, part in enumerate(core.parts):
        for name, address in core.select(number).parameter_addresses.items():
            full = f"{part.program.name}.{name}" if several else name
            parameters.append(_parameter(part.program, name, address, full))
    choice = program_choice(core.names)
    return RegisterMap(
        name=core.name,
        digest=core.digest,
        word=word,
        build=(core.image.digest & mask, core.image.digest >> word & mask),
        registers=(*parameters, *FIXED, *([choice] if several else [])),
        streams=tuple(_streams(part.program) for part in core.parts),
    )


def _parameter(program: Program, name: str, address: int, full: str) -> Register:
    number = program.find(name)
    value, form = program.values[number], program.format(number)
    return Register(
        full,
        address,
        Access.WRITE_ONLY,
        value.meaning or "parameter",
        unit=value.unit,
        frac=value.frac,
        low=value.low,
        high=value.high,
        minimum=int(form.quantise(value.low)),
        maximum=int(form.quantise(value.high)),
        reset=value.initial,
    )


def _streams(program: Program) -> Streams:
    outputs = zip(program.output_names, program.outputs, strict=True)
    units = {port.name: port.unit for port in program.ports}
    return Streams(
        program.name,
        program.digest,
        tuple(_port(program, program.values[n].name, n) for n in program.streamed),
        tuple(_port(program, name, n, units.get(name)) for name, n in outputs),
    )


def _port(program: Program, name: str, number: int, unit: str | None = None) -> Port:
    value = program.values[number]
    return Port(name, value.frac, value.unit if unit is None else unit)
