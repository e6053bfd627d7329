"""The interface of a complete system, declared once: registers, result words, orders, events.

Hardware, register map, host and the judge of a simulated board read it: the conductor packs
`HEADER`, the frames to the host carry it with `FRAME_FLAGS`, a write of `ORDERS` does things once.
`system_registers` is the block that `gateware.bus.csr` makes, `system_map` everything on the bus.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from enum import IntEnum

from boresight.gateware.core import Core
from boresight.gateware.description import Description, Records, Word, describe
from boresight.gateware.registers.model import Access, BitField, Register
from boresight.gateware.system.feed import reset_word
from boresight.gateware.system.plan import FRONT_NAMES
from boresight.gateware.system.system_bus import COUNTERS, CSR, FEED, RESULTS
from boresight.model.words.fixed import Format
from boresight.model.words.program import Value

#: "BORE", and the version of this map: it changes when an address or a meaning does.
IDENTIFICATION, VERSION = 0x424F_5245, 1

_READ, _WRITE, _BOTH = Access.READ_ONLY, Access.WRITE_ONLY, Access.READ_WRITE


class Place(IntEnum):
    """Places in the result memory of an update.

    The header; beside it the time stamp; the filter's output record; the input record that it had;
    the raw words that this came from.
    """

    HEADER = 0x00
    STAMP = 0x01
    OUTPUTS = 0x10
    INPUTS = 0x20
    RAWS = 0x30


#: Word 0 of the results. ``number`` is 1 for the first update; one that was never completed leaves
#: a gap. ``restart``: the time step was negative.
HEADER = (
    BitField("number", 0, "number of the update, modulo 2^16", width=16),
    BitField("filter", 16, "number of the filter", width=3),
    BitField("field_used", 19, "with a fresh magnetic field"),
    BitField("field_counts", 20, "made of magnetometer counts, not of a heading"),
    BitField("restart", 21, "the filter was restarted"),
    BitField("saturated", 22, "a value of the filter was clamped"),
)
#: What a frame to the host has besides in its header.
FRAME_FLAGS = (
    BitField("inertial_fault", 24, "the inertial sensor is not running"),
    BitField("inertial_alarm", 25, "an alarm of the inertial sensor"),
    BitField("over_range", 26, "a gyro or accelerometer is at full scale"),
    BitField("overrun", 27, "a sample of the inertial sensor was skipped"),
    BitField("compass_stale", 28, "no good line of the compass for a while"),
    BitField("compass_fault", 29, "the compass does not answer as it should"),
)
#: What a write of register ``order`` does.
ORDERS = (
    BitField("restart_filter", 0, "the next update restarts the filter"),
    BitField("restart_inertial", 1, "reset the inertial sensor and set it up again"),
    BitField("clear_counters", 2, "all counters to 0"),
)
#: The same, of a system with input registers.
TAKE_FEED = BitField(
    "take_feed", 3, "the feed registers' words, all together, from the next update on"
)


def _flags(flags: Mapping[str, str]) -> tuple[BitField, ...]:
    return tuple(BitField(name, bit, text) for bit, (name, text) in enumerate(flags.items()))


def _constant(name: str, address: int, word: int, meaning: str, unit: str = "") -> Register:
    return Register(name, CSR + address, _READ, meaning, unit=unit, width=32, reset=word)


def _state(name: str, address: int, width: int, meaning: str, **more: object) -> Register:
    return Register(name, CSR + address, _READ, meaning, width=width, **more)  # type: ignore[arg-type]


def _setting(
    name: str, address: int, width: int, reset: int, meaning: str, names: tuple[str, ...] = ()
) -> Register:
    return Register(name, CSR + address, _BOTH, meaning, width=width, reset=reset, names=names)


def _order(name: str, address: int, width: int, meaning: str, *fields: BitField) -> Register:
    return Register(name, CSR + address, _WRITE, meaning, width=width, fields=fields)


def system_registers(
    *,
    filters: Sequence[str],
    clock_hz: float,
    build: int,
    inertial_flags: Mapping[str, str],
    compass_flags: Mapping[str, str],
    text: bool = True,
    feed: bool = False,
) -> tuple[Register, ...]:
    """Identification, state and settings of a system.

    Parameters
    ----------
    filters : sequence of str
        Names of the estimators, 1 to 8.
    clock_hz : float
        Clock, Hz.
    build : int
        Digest of programs and configuration; its low 64 bits are shown.
    inertial_flags, compass_flags : mapping
        Name and meaning of the readers' level flags, bit 0 first.
    text, feed : bool
        The output can be text; there are input registers.
    """
    if not 1 <= len(filters) <= 8:
        raise ValueError(f"filters must be 1 to 8, not {len(filters)}")
    filter_bits = max(1, (len(filters) - 1).bit_length())
    modes = ("off", "binary", *(("text",) if text else ()))
    orders = (*ORDERS, *((TAKE_FEED,) if feed else ()))
    inertial, compass = _flags(inertial_flags), _flags(compass_flags)
    return (
        _constant(
            "identification", 0, IDENTIFICATION, '"BORE" in ASCII, most significant byte first'
        ),
        _constant("map_version", 1, VERSION, "version of this register map"),
        _constant("clock_hz", 2, round(clock_hz), "clock of the system", "Hz"),
        _constant(
            "system_build_low",
            3,
            build & 0xFFFF_FFFF,
            "digest of programs and configuration, bits 31 to 0",
        ),
        _constant("system_build_high", 4, build >> 32 & 0xFFFF_FFFF, "the same, bits 63 to 32"),
        _state("time", 8, 32, "clock cycles since power-up, modulo 2^32"),
        _state(
            "inertial_flags",
            9,
            len(inertial),
            "state of the inertial sensor's reader",
            fields=inertial,
        ),
        _state("compass_flags", 10, len(compass), "state of the compass's reader", fields=compass),
        _state(
            "compass_x",
            11,
            16,
            "last good line of the compass: heading [0.1 deg], or magnetometer x [counts]; "
            "compass_flags says which",
            signed=True,
        ),
        _state(
            "compass_y",
            12,
            16,
            "the same line: pitch [0.1 deg], or magnetometer y [counts]",
            signed=True,
        ),
        _state(
            "compass_z",
            13,
            16,
            "the same line: roll [0.1 deg], or magnetometer z [counts]",
            signed=True,
        ),
        _state(
            "temperature",
            14,
            16,
            "of the inertial sensor: 25 degC + word * 0.0678 degC",
            unit="0.0678 degC",
            signed=True,
        ),
        _state("diag_stat", 15, 16, "DIAG_STAT of the inertial sensor, as last read"),
        _setting("run", 16, 1, 1, "samples go through the filter"),
        _setting(
            "filter",
            17,
            filter_bits,
            0,
            "number of the filter, from the next sample on; a new filter restarts",
            tuple(filters),
        ),
        _setting(
            "magnetic_source",
            18,
            2,
            2,
            "lines of the compass that make the magnetic field",
            ("none", "counts", "heading", "any"),
        ),
        _setting("output_mode", 19, 2, 1, "what is sent unasked", modes),
        _setting("output_divider", 20, 10, 8, "every n-th update is sent; 0 counts as 1"),
        _setting(
            "results_hold",
            21,
            1,
            0,
            "1: the results stay those of one update, to be read together; 0: they are "
            "always the newest",
        ),
        _setting(
            "inertial_msc_ctrl",
            22,
            16,
            0x0006,
            "MSC_CTRL of the inertial sensor, from its next restart on",
        ),
        _setting("inertial_smpl_prd", 23, 16, 0x0001, "SMPL_PRD, likewise"),
        _setting(
            "inertial_sens_avg", 24, 16, 0x0402, "SENS_AVG, likewise: bits 10:8 range, 2:0 filter"
        ),
        _setting(
            "compass_mode",
            25,
            2,
            1,
            "sentences that the compass is told to send",
            ("as_it_is", "heading", "counts"),
        ),
        _order("order", 26, len(orders), "a 1 does it once", *orders),
        _order("compass_command", 27, 8, "letter X of a command *X to the compass, in ASCII"),
    )


def result_registers(programs: Sequence[Records], *, word: int) -> tuple[Register, ...]:
    """The results of an update: header, time stamp, outputs, the estimator's input record.

    A word has the estimators' name for it with ``result_`` or ``input_`` before it, or where they
    have several its number. One whose fraction bits are not the same in all of them has no ``frac``
    here: the records of the programs tell.
    """
    outputs = {p.program: p.outputs for p in programs}
    inputs = {p.program: p.inputs for p in programs}
    return (
        Register(
            "result_header",
            RESULTS + Place.HEADER,
            _READ,
            "which update, and how it came about",
            width=word,
            fields=HEADER,
        ),
        Register(
            "result_stamp",
            RESULTS + Place.STAMP,
            _READ,
            "time at the sample's data-ready edge",
            unit="cycles",
            width=word,
        ),
        *_record("result", Place.OUTPUTS, "output {}", outputs, word),
        *_record("input", Place.INPUTS, "input {} of that update", inputs, word),
    )


def _record(
    prefix: str, first: Place, meaning: str, records: Mapping[str, Sequence[Word]], width: int
) -> Iterator[Register]:
    """Registers for the words of all programs' records, by the program's name."""
    for k in range(max(map(len, records.values()))):
        words = {program: record[k] for program, record in records.items() if k < len(record)}
        names = list(dict.fromkeys(w.name for w in words.values()))
        fracs, units = {w.frac for w in words.values()}, {w.unit for w in words.values()}
        text = meaning.format(names[0])
        if len(names) > 1:
            text = "; ".join(f"{meaning.format(w.name)} ({p})" for p, w in words.items())
        if len(fracs) > 1:
            text += "; fraction bits " + ", ".join(f"{w.frac} ({p})" for p, w in words.items())
        yield Register(
            f"{prefix}_{names[0] if len(names) == 1 else k}",
            RESULTS + first + k,
            _READ,
            text,
            unit=units.pop() if len(units) == 1 else "",
            frac=fracs.pop() if len(fracs) == 1 else None,
            width=width,
            signed=True,
        )


def feed_registers(values: Mapping[str, Value], *, word: int) -> tuple[Register, ...]:
    """The input registers: what estimators read that no sensor gives."""
    return tuple(
        Register(
            f"feed_{name}",
            FEED + k,
            _WRITE,
            f"input {name}, from the update on that follows order {TAKE_FEED.name}",
            unit=value.unit,
            frac=value.frac,
            low=value.low,
            high=value.high,
            minimum=int(Format(word, value.frac).quantise(value.low)),
            maximum=int(Format(word, value.frac).quantise(value.high)),
            reset=reset_word(value),
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
) -> Description:
    """The description of a system: its core's, with all registers on the bus.

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
    whole = describe(core)
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
            *result_registers(whole.programs[: -len(FRONT_NAMES)], word=whole.word),
            *counter_registers((*events, "bad_address"), bits=counter_bits),
            *feed_registers(feed or {}, word=whole.word),
        ),
    )
