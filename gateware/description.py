"""The description of a compiled core: ports, rules, registers, and the words of its records.

The texts about a core (`gateware.texts`), its bench, the register map of a complete system and
the host of a board all read this one object; ``registers.json`` is its serialised form.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated

from boresight.gateware.core import Core
from boresight.gateware.registers import (
    ADDRESS_BITS,
    CHOICE,
    FIXED,
    RESTART,
    STATUS,
    Access,
    Register,
)
from boresight.model.lowering.profile import OBSERVED
from boresight.model.tools.c_names import identifier, unique
from boresight.model.tools.reading import Within
from boresight.model.words.program import InPort, Program

STREAMS = """\
a word passes at the rising edge of clk at which valid and ready are both 1. Keep valid
and payload until then. ready does not wait for valid, nor valid for ready. Bit {last} of a payload,
`last`, is 1 with the last word of a record and 0 with the others. If `last` comes too early or
is missing, the update is dropped and bit {bit} of the status register is set; words after a missing
`last` are swallowed up to the next one. While an input word is missing or an output word is not
taken the whole core stands still."""

BUS = """\
drive addr, w_data and w_stb, and keep them until the cycle in which w_ack is 1; the write
is done at its rising edge. Writes of parameters and of the program's number wait for the first
word of a record to be due, so they never change an update at work. r_data is the word at the
addr of the cycle before. Status flags are cleared by writing 1 (address {status})."""

RESET = """\
rst is synchronous, active high; one cycle is enough. It abandons the update at work,
clears flags and the count of updates, and selects program 0; the next update of every program
begins from its initial states. Parameters stay as they were written. Power-up (configuration;
time 0 in simulation) does the same and gives parameters their defaults; a reset after it is not
needed. A cycle of restart, or a write of any word to register {restart}, restarts the selected
program alone: an update at work ends with its old states, and the one whose first word passes
after that cycle begins from the initial states. Flags, the count, other programs and parameters
stay. i__ready is 0 while the states are loaded, for at most {cycles} cycles. While restart is 1
no further record begins."""


@dataclass(frozen=True)
class Pin:
    """A port of the module ``core``; ``direction`` is "input" or "output"."""

    direction: str
    name: str
    bits: int
    meaning: str = ""


def core_pins(word: int) -> tuple[Pin, ...]:
    """Ports of the module ``core`` with words of ``word`` bits, in order."""
    payload = f"put record: bit {word} last, below it a word"
    clamped = "a result of the last complete update was clamped"
    beyond = "an input word of the last complete update was beyond its declared range"
    return (
        Pin("input", "clk", 1, "clock; everything happens at its rising edge"),
        Pin("input", "rst", 1, "reset, synchronous, active high"),
        Pin("input", "i__payload", word + 1, f"in{payload}"),
        Pin("input", "i__valid", 1, "the word is there"),
        Pin("output", "i__ready", 1, "the word is taken"),
        Pin("output", "o__payload", word + 1, f"out{payload}"),
        Pin("output", "o__valid", 1, "the word is there"),
        Pin("input", "o__ready", 1, "the word is taken"),
        Pin("input", "bus__addr", ADDRESS_BITS, "word address of a register"),
        Pin("input", "bus__w_data", word, "word to write"),
        Pin("input", "bus__w_stb", 1, "write"),
        Pin("output", "bus__w_ack", 1, "the write is done with this cycle"),
        Pin("output", "bus__r_data", word, "word at the addr of the cycle before"),
        Pin("input", "restart", 1, "the next update begins from the initial states"),
        Pin("output", "saturated_update", 1, clamped),
        Pin("output", "beyond_update", 1, beyond),
    )


@dataclass(frozen=True)
class Word:
    """One word of a record: value = word * 2^-frac, in ``unit``.

    A register map has these three fields only. ``cycle`` is that in which an output word passes,
    if the record's first word passes in cycle 1 and the core never stalls. ``missing`` describes
    the value of an input without a new sample; empty if every record needs one.
    """

    name: str
    frac: Annotated[int, Within(-128, 128)]
    unit: str = ""
    meaning: str = ""
    low: float | None = None
    high: float | None = None
    missing: str = ""
    cycle: int | None = None


@dataclass(frozen=True)
class Records:
    """The records of a program.

    ``interval`` is the number of cycles from the first word of a record to that of the next,
    ``restart`` that of a restart between records; ``assumed`` are the values whose ranges a profile
    of `boresight fit` chose: name, low, high.
    """

    program: str
    digest: str
    inputs: tuple[Word, ...]
    outputs: tuple[Word, ...]
    summary: str = ""
    interval: int = 0
    assumed: tuple[tuple[str, float, float], ...] = ()
    restart: int = 0

    @property
    def latencies(self) -> tuple[int, ...]:
        """Cycles from the first input word to each output word, both counted."""
        return tuple(word.cycle or 0 for word in self.outputs)

    @property
    def units(self) -> set[str]:
        return {word.unit for word in (*self.inputs, *self.outputs)}


@dataclass(frozen=True)
class Description:
    """A core, or a system around one, as seen from outside."""

    #: Name and digest of all programs.
    name: str
    digest: str
    #: W, bits of a word.
    word: int
    #: Words of the registers ``build_low`` and ``build_high``.
    build: tuple[int, int]
    #: Registers; with several programs, parameters are named like ``mekf.gain``.
    registers: tuple[Register, ...]
    #: Records of the programs, by number.
    programs: tuple[Records, ...]
    #: Kind: a core, or a system with more registers than the core's.
    title: str = "core"
    #: Properties of the machine; not part of the register map.
    configuration: str = ""
    lanes: int = 0
    microwords: int = 0

    @property
    def pins(self) -> tuple[Pin, ...]:
        return core_pins(self.word)

    @property
    def rules(self) -> Mapping[str, str]:
        """Rules of streams, bus and reset, in lines of at most 97 characters."""
        bit = STATUS.field("framing").bit
        return {
            "streams": STREAMS.format(last=self.word, bit=bit),
            "bus": BUS.format(status=STATUS.address),
            "reset": RESET.format(
                restart=RESTART.address, cycles=max(p.restart for p in self.programs)
            ),
        }

    @property
    def mask(self) -> int:
        return (1 << self.word) - 1

    def mask_of(self, register: Register) -> int:
        return (1 << (register.width or self.word)) - 1

    @property
    def parameters(self) -> tuple[Register, ...]:
        return tuple(r for r in self.registers if r.is_parameter)

    def parameters_of(
        self, program: str, written: Mapping[str, int] | None = None
    ) -> dict[str, float]:
        """Parameters of a program: as compiled, or as ``written``, words by the register's name."""
        values = {}
        for r in self.parameters:
            owner, _, name = r.name.rpartition(".")
            if owner in ("", program) and r.reset is not None and r.frac is not None:
                word = (written or {}).get(r.name, r.reset) & self.mask
                signed = word - (1 << self.word if word >> self.word - 1 else 0)
                values[name] = signed * 2.0**-r.frac
        return values

    def find(self, name: str) -> Register:
        """Register called ``name``, a parameter before a fixed one; raises KeyError for others."""
        return {register.name: register for register in reversed(self.registers)}[name]

    @property
    def identifiers(self) -> dict[int, str]:
        """C identifier of every register, by address; unique even if case is ignored."""
        ordered = sorted(self.registers, key=lambda r: r.is_parameter)  # the fixed names first
        names = unique(r.name for r in ordered)
        return {r.address: name for r, name in zip(ordered, names, strict=True)}

    @property
    def identifier(self) -> str:
        return identifier(self.name)

    @property
    def named_records(self) -> list[tuple[str, str, list[tuple[str, Word]]]]:
        """For every record: "input" or "output", its program, and its words by C identifiers."""
        reserved = set(self.identifiers.values())
        records = []
        for program in self.programs:
            prefix = f"{identifier(program.program)}_" if len(self.programs) > 1 else ""
            for title, words in (("input", program.inputs), ("output", program.outputs)):
                kind = title.removesuffix("put").upper()
                stems = unique((f"{prefix}{kind}_{word.name}" for word in words), reserved=reserved)
                reserved.update(stems)
                records.append((title, program.program, list(zip(stems, words, strict=True))))
        return records

    def to_json(self) -> str:
        """The register map as JSON, the same text for the same map; `typed` is the inverse."""

        def plain(register: Register) -> dict[str, object]:
            values = {k: v for k, v in asdict(register).items() if v is not None and v != ()}
            return {**values, "byte_offset": 4 * register.address}

        def words(record: tuple[Word, ...]) -> list[dict[str, object]]:
            return [{"name": w.name, "frac": w.frac, "unit": w.unit} for w in record]

        data = {
            **{key: getattr(self, key) for key in ("name", "title", "digest", "word", "build")},
            "registers": [plain(r) for r in self.registers],
            "programs": [
                {
                    **{"number": k, "program": p.program, "digest": p.digest},
                    **{"inputs": words(p.inputs), "outputs": words(p.outputs)},
                }
                for k, p in enumerate(self.programs)
            ],
        }
        return json.dumps(data, indent=1) + "\n"


def describe(core: Core, summaries: Mapping[str, str] | None = None) -> Description:
    """The description of a compiled core; ``summaries``: a line about each program, by its name."""
    word, several = core.machine.arithmetic.word, len(core.parts) > 1
    mask = (1 << word) - 1
    parts = [core.select(number) for number in range(len(core.parts))]
    lines = summaries or {}
    return Description(
        name=core.name,
        digest=core.digest,
        word=word,
        build=(core.image.digest & mask, core.image.digest >> word & mask),
        registers=(
            *(register for part in parts for register in _parameters(part, several)),
            *FIXED,
            *([replace(CHOICE, names=core.names)] if several else []),
            RESTART,
        ),
        programs=tuple(_records(part, lines.get(part.program.name, "")) for part in parts),
        configuration=core.machine.name,
        lanes=core.machine.lanes,
        microwords=len(core.image.rom),
    )


def _parameters(core: Core, several: bool) -> Iterator[Register]:
    program = core.program
    for name, address in core.parameter_addresses.items():
        number = program.find(name)
        value, form = program.values[number], program.format(number)
        yield Register(
            f"{program.name}.{name}" if several else name,
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


def _records(core: Core, summary: str) -> Records:
    program, plan = core.program, core.schedule
    assumed = (v for v in program.values if v.range_source.startswith(OBSERVED))
    return Records(
        program.name,
        program.digest,
        tuple(_inputs(program)),
        tuple(_outputs(program, plan.latencies)),
        summary or program.name,
        plan.interval,
        tuple((v.name, v.low, v.high) for v in assumed),
        core.image.restarts[core.number] + core.machine.prefetch + 2,
    )


def _inputs(program: Program) -> Iterator[Word]:
    ports = dict(zip(program.inputs, program.in_ports, strict=False))
    for number in program.inputs:
        value, port = program.values[number], ports.get(number, InPort())
        missing, meaning = "" if port.missing is None else str(port.missing), port.meaning
        if port.flags:
            missing, meaning = "0", meaning or f"1: new sample of {', '.join(port.flags)}"
        if missing == "hold":
            missing = "the last word again"
        yield Word(value.name, value.frac, value.unit, meaning, value.low, value.high, missing)


def _outputs(program: Program, cycles: tuple[int, ...]) -> Iterator[Word]:
    ports = {port.name: (port.unit, port.meaning) for port in program.ports}
    for name, number, cycle in zip(program.output_names, program.outputs, cycles, strict=True):
        value = program.values[number]
        unit, meaning = ports.get(name, (value.unit, ""))
        yield Word(name, value.frac, unit, meaning, value.low, value.high, cycle=cycle)
