"""The registers of a complete system, declared once: hardware, files and host read this.

`system_registers` is the block that `gateware.bus.csr` makes; `system_map` is everything on the
bus of `gateware.system.system_bus`, for JSON, SVD, C header, page (`gateware.registers.files`) and
`boresight monitor`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

from boresight.gateware.core import Core
from boresight.gateware.register_map import register_map
from boresight.gateware.registers.model import Access, BitField, Register, RegisterMap
from boresight.gateware.system.attitude_frame import STAMP
from boresight.gateware.system.feed import first_word
from boresight.gateware.system.plan import FRONT_NAMES
from boresight.gateware.system.system_bus import COUNTERS, CSR, FEED, RESULTS
from boresight.model.words.fixed import Format
from boresight.model.words.program import Program, Value

__all__ = [
    "IDENTIFICATION",
    "VERSION",
    "counter_registers",
    "feed_registers",
    "result_registers",
    "system_map",
    "system_registers",
]

#: "BORE", and the version of this map: it changes when an address or a meaning does.
IDENTIFICATION, VERSION = 0x424F_5245, 1

_TAKE_FEED = "the feed registers' words, all together, from the next update on"

_READ, _WRITE, _BOTH = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE


def _flags(flags: Mapping[str, str]) -> tuple[BitField, ...]:
    return tuple(BitField(name, bit, text) for bit, (name, text) in enumerate(flags.items()))


def system_registers(
    *,
    filters: Sequence[str],
    clock_hz: float,
    build: int,
    inertial_flags: Mapping[str, str],
    compass_flags: Mapping[str, str],
    msc_ctrl: int = 0x0006,
    smpl_prd: int = 0x0001,
    sens_avg: int = 0x0402,
    magnetic_source: int = 2,
    compass_mode: int = 1,
    output_mode: int = 1,
    output_divider: int = 8,
    text: bool = True,
    feed: bool = False,
) -> tuple[Register, ...]:
    """Identification, state and settings of a system.

    Parameters
    ----------
    filters : sequence of str
        Names of the filters, 1 to 8.
    clock_hz : float
        Clock, Hz.
    build : int
        Digest of programs and configuration; its low 64 bits are shown.
    inertial_flags, compass_flags : mapping
        Name and meaning of the readers' level flags, bit 0 first.
    msc_ctrl, smpl_prd, sens_avg, magnetic_source, compass_mode, output_mode, output_divider : int
        Settings after power-up.
    text, feed : bool
        The output can be text; there are input registers.
    """
    if not 1 <= len(filters) <= 8:
        raise ValueError(f"filters must be 1 to 8, not {len(filters)}")
    rows = (
        # Constants.
        Register(
            "identification",
            0,
            _READ,
            '"BORE" in ASCII, most significant byte first',
            width=32,
            reset=IDENTIFICATION,
        ),
        Register("map_version", 1, _READ, "version of this register map", width=32, reset=VERSION),
        Register(
            "clock_hz", 2, _READ, "clock of the system", unit="Hz", width=32, reset=round(clock_hz)
        ),
        Register(
            "system_build_low",
            3,
            _READ,
            "digest of programs and configuration, bits 31 to 0",
            width=32,
            reset=build & 0xFFFF_FFFF,
        ),
        Register(
            "system_build_high",
            4,
            _READ,
            "the same, bits 63 to 32",
            width=32,
            reset=build >> 32 & 0xFFFF_FFFF,
        ),
        # State.
        Register("time", 8, _READ, "clock cycles since power-up, modulo 2^32", width=32),
        Register(
            "inertial_flags",
            9,
            _READ,
            "state of the inertial sensor's reader",
            width=len(inertial_flags),
            fields=_flags(inertial_flags),
        ),
        Register(
            "compass_flags",
            10,
            _READ,
            "state of the compass's reader",
            width=len(compass_flags),
            fields=_flags(compass_flags),
        ),
        Register(
            "compass_x",
            11,
            _READ,
            "last good line of the compass: heading [0.1 deg], or "
            "magnetometer x [counts]; compass_flags says which",
            width=16,
            signed=True,
        ),
        Register(
            "compass_y",
            12,
            _READ,
            "the same line: pitch [0.1 deg], or magnetometer y [counts]",
            width=16,
            signed=True,
        ),
        Register(
            "compass_z",
            13,
            _READ,
            "the same line: roll [0.1 deg], or magnetometer z [counts]",
            width=16,
            signed=True,
        ),
        Register(
            "temperature",
            14,
            _READ,
            "of the inertial sensor: 25 degC + word * 0.0678 degC",
            unit="0.0678 degC",
            width=16,
            signed=True,
        ),
        Register(
            "diag_stat", 15, _READ, "DIAG_STAT of the inertial sensor, as last read", width=16
        ),
        # Settings.
        Register("run", 16, _BOTH, "samples go through the filter", width=1, reset=1),
        Register(
            "filter",
            17,
            _BOTH,
            "number of the filter, from the next sample on; a new filter restarts",
            width=max(1, (len(filters) - 1).bit_length()),
            reset=0,
            names=tuple(filters),
        ),
        Register(
            "magnetic_source",
            18,
            _BOTH,
            "lines of the compass that make the magnetic field",
            width=2,
            reset=magnetic_source,
            names=("none", "counts", "heading", "any"),
        ),
        Register(
            "output_mode",
            19,
            _BOTH,
            "what is sent unasked",
            width=2,
            reset=output_mode,
            names=("off", "binary", *(("text",) if text else ())),
        ),
        Register(
            "output_divider",
            20,
            _BOTH,
            "every n-th update is sent; 0 counts as 1",
            width=10,
            reset=output_divider,
        ),
        Register(
            "results_hold",
            21,
            _BOTH,
            "1: the results stay those of one update, to be read "
            "together; 0: they are always the newest",
            width=1,
            reset=0,
        ),
        Register(
            "inertial_msc_ctrl",
            22,
            _BOTH,
            "MSC_CTRL of the inertial sensor, from its next restart on",
            width=16,
            reset=msc_ctrl,
        ),
        Register("inertial_smpl_prd", 23, _BOTH, "SMPL_PRD, likewise", width=16, reset=smpl_prd),
        Register(
            "inertial_sens_avg",
            24,
            _BOTH,
            "SENS_AVG, likewise: bits 10:8 range, 2:0 filter",
            width=16,
            reset=sens_avg,
        ),
        Register(
            "compass_mode",
            25,
            _BOTH,
            "sentences that the compass is told to send",
            width=2,
            reset=compass_mode,
            names=("as_it_is", "heading", "counts"),
        ),
        # Orders.
        Register(
            "order",
            26,
            _WRITE,
            "a 1 does it once",
            width=3 + feed,
            fields=(
                BitField("restart_filter", 0, "the next update restarts the filter"),
                BitField("restart_inertial", 1, "reset the inertial sensor and set it up again"),
                BitField("clear_counters", 2, "all counters to 0"),
                *((BitField("take_feed", 3, _TAKE_FEED),) if feed else ()),
            ),
        ),
        Register(
            "compass_command",
            27,
            _WRITE,
            "letter X of a command *X to the compass, in ASCII",
            width=8,
        ),
    )
    return tuple(dataclasses.replace(row, address=CSR + row.address) for row in rows)


def result_registers(core: Core) -> tuple[Register, ...]:
    """The results of an update: header, time stamp, outputs, the estimator's input record.

    A word has the estimators' name for it with ``result_`` or ``input_`` before it, or where they
    have several its number. One whose fraction bits are not the same in all of them has no ``frac``
    here: the records of the programs tell.
    """
    word = core.machine.arithmetic.word
    programs = [p.program for p in core.parts[: -len(FRONT_NAMES)]]
    header = Register(
        "result_header",
        RESULTS,
        _READ,
        "which update, and how it came about",
        width=word,
        fields=(
            BitField("number", 0, "number of the update, modulo 2^16", width=16),
            BitField("filter", 16, "number of the filter", width=3),
            BitField("field_used", 19, "with a fresh magnetic field"),
            BitField("field_counts", 20, "made of magnetometer counts, not of a heading"),
            BitField("restart", 21, "the filter was restarted"),
            BitField("saturated", 22, "a value of the filter was clamped"),
        ),
    )
    stamp = Register(
        "result_stamp",
        RESULTS + STAMP,
        _READ,
        "time at the sample's data-ready edge",
        unit="cycles",
        width=word,
    )
    outputs = [list(zip(p.output_names, p.outputs, strict=True)) for p in programs]
    inputs = [[(p.values[n].name, n) for n in p.streamed] for p in programs]
    return (
        header,
        stamp,
        *_record("result", RESULTS + 0x10, "output {}", programs, outputs),
        *_record("input", RESULTS + 0x20, "input {} of that update", programs, inputs),
    )


def _record(
    prefix: str,
    first: int,
    meaning: str,
    programs: Sequence[Program],
    records: Sequence[Sequence[tuple[str, int]]],
) -> Iterator[Register]:
    """Registers for the words of all programs' records: names and values of each."""
    for k in range(max(map(len, records))):
        words = [(p, *r[k]) for p, r in zip(programs, records, strict=True) if k < len(r)]
        names = list(dict.fromkeys(name for _, name, _ in words))
        values = [p.values[n] for p, _, n in words]
        said, fracs = meaning.format(names[0]), {v.frac for v in values}
        if len(names) > 1:
            said = "; ".join(f"{meaning.format(name)} ({p.name})" for p, name, _ in words)
        if len(fracs) > 1:
            said += "; fraction bits " + ", ".join(
                f"{v.frac} ({p.name})" for v, (p, _, _) in zip(values, words, strict=True)
            )
        units = {v.unit for v in values}
        yield Register(
            f"{prefix}_{names[0] if len(names) == 1 else k}",
            first + k,
            _READ,
            said,
            unit=units.pop() if len(units) == 1 else "",
            frac=fracs.pop() if len(fracs) == 1 else None,
            width=programs[0].arithmetic.word,
            signed=True,
        )


def feed_registers(values: Mapping[str, Value], *, word: int) -> tuple[Register, ...]:
    """The input registers: what estimators read that no sensor gives."""
    return tuple(
        Register(
            f"feed_{name}",
            FEED + k,
            Access.WRITE_ONLY,
            f"input {name}, from the update on that follows order take_feed",
            unit=value.unit,
            frac=value.frac,
            low=value.low,
            high=value.high,
            minimum=int(Format(word, value.frac).quantise(value.low)),
            maximum=int(Format(word, value.frac).quantise(value.high)),
            reset=first_word(value),
        )
        for k, (name, value) in enumerate(values.items())
    )


def counter_registers(events: Sequence[str], *, bits: int = 32) -> tuple[Register, ...]:
    """A counter for each event, in the order of their bits."""
    return tuple(
        Register(
            f"count_{name}",
            COUNTERS + k,
            _READ,
            f"events {name} since power-up or clear_counters, modulo 2^{bits}",
            width=bits,
        )
        for k, name in enumerate(events)
    )


def system_map(
    core: Core,
    *,
    registers: Sequence[Register],
    events: Sequence[str],
    feed: Mapping[str, Value] | None = None,
    counter_bits: int = 32,
) -> RegisterMap:
    """All registers of a system.

    Parameters
    ----------
    core : Core
        Its core (`gateware.system.programs.system_core`).
    registers : sequence of Register
        From `system_registers`.
    events : sequence of str
        Names of the counted events, bit 0 first; ``bad_address`` comes behind them.
    feed : mapping, optional
        Inputs that registers give (`gateware.system.feed.Feed`).
    counter_bits : int
        Bits of a counter.
    """
    whole = register_map(core)
    own = tuple(
        dataclasses.replace(r, access=_READ, meaning="number of the program that runs just now")
        if r.name == "program"
        else r
        for r in whole.registers
    )
    return dataclasses.replace(
        whole,
        title="attitude system",
        registers=(
            *own,
            *registers,
            *result_registers(core),
            *counter_registers((*events, "bad_address"), bits=counter_bits),
            *feed_registers(feed or {}, word=core.machine.arithmetic.word),
        ),
    )
