"""The interface of a complete system, declared once: registers, result words, orders, frames.

Hardware, register map, host and the simulated board's comparison read it. `system_registers` is the
block that `gateware.attitude.system.csr` makes, from the rows of ``registers.csv``; `system_map` is
everything on the bus.

A frame of kind ATTITUDE (`gateware.boards.frames`) has a header (`HEADER`, and above it
`FRAME_FLAGS`), the stamp, and the outputs of the estimator that ran: of an attitude filter pitch,
roll and heading [half turns, 31 fraction bits; the heading counter-clockwise, seen from above], the
quaternion, body to navigation, and its status. How many fraction bits quaternion and status have
depends on the filter (`FORMATS`, or the register map's output records).

A frame of kind SENSED has six more words, 24 bytes in all, least significant byte first: gyro x, y,
z and accelerometer x, y, z in 3 bytes each, counts with 8 fraction bits (of the gyro in its range
of +-300 deg/s); and the three numbers of the compass's line in 2 bytes each, which count if the
header has ``field_used``.
"""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import Any

from boresight.gateware.attitude.sensors.adis16385 import FLAG_MEANINGS, TEST_BITS
from boresight.gateware.attitude.sensors.hmr3300 import FLAGS as COMPASS_FLAGS
from boresight.gateware.attitude.system.programs import FRONT_NAMES, reset_word
from boresight.gateware.attitude.system.system_bus import COUNTERS, CSR, FEED, RESULTS
from boresight.gateware.core import Core
from boresight.gateware.description import Description, Word, describe
from boresight.gateware.registers import Access, BitField, Register
from boresight.model.words.fixed import Format
from boresight.model.words.program import Value

#: "BORE", and the version of this map, changed with an address or a meaning.
IDENTIFICATION, VERSION = 0x424F_5245, 3

_READ, _WRITE = Access.READ_ONLY, Access.WRITE_ONLY


class Place(IntEnum):
    """Places in the result memory of an update.

    The header; beside it the time stamp; the filter's output record; the input record that it had;
    the inertial counts that this came from, and the line of the compass if a field was used.
    """

    HEADER = 0x00
    STAMP = 0x01
    OUTPUTS = 0x10
    INPUTS = 0x20
    RAWS = 0x30
    LINE = 0x38


#: Word 0 of the results. ``number`` is 1 for the first update; one that was never completed leaves
#: a gap. ``restart``: the time step was negative, also after a gap; ``restart_asked``: by
#: `CalibrateInertial`'s input, whatever the gap.
HEADER = (
    BitField("number", 0, "number of the update, modulo 2^16", width=16),
    BitField("filter", 16, "number of the filter", width=3),
    BitField("field_used", 19, "with a fresh magnetic field"),
    BitField("field_counts", 20, "made of magnetometer counts, not of a heading"),
    BitField("restart", 21, "the filter was restarted"),
    BitField("saturated", 22, "a value of the filter was clamped"),
    BitField("restart_asked", 23, "the restart was asked for, or is that of another filter"),
)
#: Additional flags in the header of a frame to the host.
FRAME_FLAGS = (
    BitField("inertial_fault", 24, "the inertial sensor is not running"),
    BitField("inertial_alarm", 25, "an alarm of the inertial sensor"),
    BitField("over_range", 26, "a gyro or accelerometer is at full scale"),
    BitField("overrun", 27, "a sample of the inertial sensor was skipped"),
    BitField("compass_stale", 28, "no good line of the compass for a while"),
    BitField("compass_fault", 29, "the compass does not answer as it should"),
    BitField("initial_states", 30, "the update began from the filter's initial states"),
    BitField("beyond", 31, "an input word of the filter was beyond its declared range"),
)
#: The next update but one restarts the filter from its initial states: a record begins there.
INITIAL_STATES = BitField(
    "initial_states", 3, "restart from the initial states, with the update after the next"
)
#: Orders of a write of register ``order``.
ORDERS = (
    BitField("restart_filter", 0, "the next update restarts the filter"),
    BitField("restart_inertial", 1, "reset the inertial sensor and set it up again"),
    BitField("clear_counters", 2, "all counters to 0"),
    INITIAL_STATES,
)
#: Additional order of a system with input registers.
TAKE_FEED = BitField(
    "take_feed", 4, "the feed registers' words, all together, from the next update on"
)


def _flags(flags: Mapping[str, str]) -> tuple[BitField, ...]:
    return tuple(BitField(name, bit, text) for bit, (name, text) in enumerate(flags.items()))


_TESTED = tuple(BitField(name, bit, "failed in a self-test") for bit, name in TEST_BITS.items())


@cache
def _declared() -> tuple[Register, ...]:
    """The rows of ``registers.csv``."""
    text = Path(__file__).with_name("registers.csv").read_text("utf-8")
    return tuple(
        Register(
            row["name"],
            CSR + int(row["address"]),
            Access(row["access"]),
            row["meaning"],
            unit=row["unit"],
            reset=int(row["reset"], 0) if row["reset"] else None,
            names=tuple(row["values"].split()),
            width=int(row["width"]) if row["width"] else None,
            signed=True if row["signed"] else None,
        )
        for row in csv.DictReader(text.splitlines())
    )


def system_registers(
    *, filters: Sequence[str], clock_hz: float, build: int, feed: bool = False
) -> tuple[Register, ...]:
    """Identification, state and settings of a system; of ``build`` the low 64 bits are shown."""
    inertial, compass = _flags(FLAG_MEANINGS), _flags(COMPASS_FLAGS)
    orders = (*ORDERS, TAKE_FEED) if feed else ORDERS
    details: dict[str, dict[str, Any]] = {
        "identification": {"reset": IDENTIFICATION},
        "map_version": {"reset": VERSION},
        "clock_hz": {"reset": round(clock_hz)},
        "system_build_low": {"reset": build & 0xFFFF_FFFF},
        "system_build_high": {"reset": build >> 32 & 0xFFFF_FFFF},
        "inertial_flags": {"fields": inertial, "width": len(inertial)},
        "compass_flags": {"fields": compass, "width": len(compass)},
        "filter": {"names": tuple(filters), "width": max(1, (len(filters) - 1).bit_length())},
        "diag_stat": {"fields": _TESTED},
        "order": {"fields": orders, "width": len(orders)},
    }
    return tuple(dataclasses.replace(r, **details.get(r.name, {})) for r in _declared())


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


def system_map(
    core: Core,
    *,
    registers: Sequence[Register],
    events: Sequence[str],
    feed: Mapping[str, Value] | None = None,
) -> Description:
    """The description of a system: its core's, with all registers on the bus.

    A word of the results has the estimators' name with the prefix ``result_`` or ``input_``, or its
    number if the names differ. A word whose fraction bits differ among estimators has no ``frac``
    here; the records of the programs have it. Of the ``events`` bit 0 comes first; ``bad_address``
    is added after them. ``feed`` are the inputs read from registers (`programs.Feed`).
    """
    description = describe(core)
    word, programs = description.word, description.programs[: -len(FRONT_NAMES)]
    running = {"access": _READ, "meaning": "number of the program that runs just now"}
    outputs, inputs = ({p.program: getattr(p, n) for p in programs} for n in ("outputs", "inputs"))
    address = RESULTS + Place.HEADER
    header = Register("result_header", address, _READ, "which update, and how it came about")
    address = RESULTS + Place.STAMP
    stamp = Register("result_stamp", address, _READ, "time at the sample's data-ready edge")
    count = "events {} since power-up or clear_counters, modulo 2^32"
    counters = (
        Register(f"count_{name}", COUNTERS + k, _READ, count.format(name), width=32)
        for k, name in enumerate((*events, "bad_address"))
    )
    feed_registers = (
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
        for k, (name, value) in enumerate((feed or {}).items())
    )
    return dataclasses.replace(
        description,
        title="attitude system",
        registers=(
            *(
                dataclasses.replace(r, **running) if r.name == "program" else r  # type: ignore[arg-type]
                for r in description.registers
            ),
            *registers,
            dataclasses.replace(header, width=word, fields=HEADER),
            dataclasses.replace(stamp, unit="cycles", width=word),
            *_record("result", Place.OUTPUTS, "output {}", outputs, word),
            *_record("input", Place.INPUTS, "input {} of that update", inputs, word),
            *counters,
            *feed_registers,
        ),
    )


#: The filter's outputs in the order of the frame and of the result memory.
OUTPUTS = ("pitch", "roll", "heading", "qw", "qx", "qy", "qz", "status")
#: Names of a frame's words.
WORDS = ("header", "stamp", *OUTPUTS)
#: The angles alone: of a filter whose other fraction bits are not known.
ANGLES = dict.fromkeys(OUTPUTS[:3], 31)
#: Fraction bits of the outputs by the filter's number, for the usual four filters.
FORMATS = {
    number: ANGLES | dict.fromkeys(("qw", "qx", "qy", "qz"), q) | {"status": status}
    for number, (q, status) in enumerate(((29, 23), (31, 27), (31, 26), (31, 24)))
}
#: Fields of the header by name; those from bit 16 on are the flags.
FIELDS = {field.name: field for field in (*HEADER, *FRAME_FLAGS)}


@dataclass(frozen=True, kw_only=True)
class Sensed:
    """What an update was computed from, and its words.

    ``outputs``: words of the filter. ``counts``: gyro and accelerometer, x, y, z each. ``line``:
    numbers of the compass's line, as its parser read them.
    """

    outputs: tuple[int, ...]
    counts: tuple[float, ...]
    line: tuple[int, ...]


#: Words of a frame that `sensed_of` reads.
SENSED_WORDS = 6


def sensed_of(words: Sequence[int]) -> Sensed:
    """What a frame of kind SENSED has beside an attitude; ``words`` are all of its signed words."""
    split = len(words) - SENSED_WORDS
    data = b"".join((w & 0xFFFF_FFFF).to_bytes(4, "little") for w in words[split:])
    parts = [data[k : k + 3] for k in range(0, 18, 3)] + [data[k : k + 2] for k in (18, 20, 22)]
    numbers = [int.from_bytes(part, "little", signed=True) for part in parts]
    return Sensed(
        outputs=tuple(words[2:split]),
        counts=tuple(count / 256 for count in numbers[:6]),
        line=tuple(numbers[6:]),
    )


@dataclass(frozen=True, kw_only=True)
class Update:
    """One update: its number, the header's upper half, its stamp, and its values.

    ``values`` are the outputs by name in their units; of an attitude ``heading_deg``,
    ``pitch_deg`` and ``roll_deg`` stand for the angles. The heading is counter-clockwise; the
    compass bearing is its negative. ``sensed`` is what it was computed from, if the frame has it.
    """

    number: int
    flags: int
    stamp: int
    values: dict[str, float]
    sensed: Sensed | None = None

    @property
    def filter(self) -> int:
        return FIELDS["filter"].of(self.flags << 16)

    @property
    def is_attitude(self) -> bool:
        return "heading_deg" in self.values

    @property
    def flag_names(self) -> tuple[str, ...]:
        return tuple(n for n, f in FIELDS.items() if f.width == 1 and f.of(self.flags << 16))


def update_of(
    words: Sequence[int], outputs: Mapping[str, int], sensed: Sensed | None = None
) -> Update:
    """The update of a frame's signed words; ``outputs`` are fraction bits in their order."""
    header, stamp, *rest = words
    parts = zip(outputs.items(), rest, strict=False)
    values = {name: word * 2.0**-frac for (name, frac), word in parts}
    if outputs is ANGLES or tuple(outputs) == OUTPUTS:
        angles = {f"{name}_deg": 180.0 * values.pop(name) for name in ("heading", *OUTPUTS[:2])}
        values = angles | values
    return Update(
        number=FIELDS["number"].of(header),
        flags=header >> 16 & 0xFFFF,
        stamp=stamp & 0xFFFF_FFFF,
        values=values,
        sensed=sensed,
    )
