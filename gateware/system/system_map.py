"""Everything on the bus of a complete system (`gateware.system.system_bus`), for files and host.

JSON, SVD, C header, page (`gateware.registers.files`) and `boresight monitor` read it.
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
from boresight.gateware.system.system_bus import COUNTERS, FEED, RESULTS
from boresight.model.words.fixed import Format
from boresight.model.words.program import Program, Value

__all__ = ["counter_registers", "feed_registers", "result_registers", "system_map"]

_READ = Access.READ_ONLY


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
