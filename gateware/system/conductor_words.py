"""The words of the conductor: where those for the core come from, and where its own go."""

from __future__ import annotations

from enum import Enum
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, memory

from boresight.gateware.bus.results import Results
from boresight.gateware.engine.bitwise import Bitwise, multiplex
from boresight.gateware.system.plan import RAW, RECORD, Plan

__all__ = [
    "HEADER",
    "OUTPUTS",
    "RAWS",
    "RECORDS",
    "STAMP",
    "Job",
    "State",
    "header_layout",
    "input_word",
    "put_away",
    "waiting_words",
]

#: Places in the result memory: the header, the filter's output record, the input record that it
#: had, and the raw words that this came from.
HEADER, OUTPUTS, RECORDS, RAWS = 0x00, 0x10, 0x20, 0x30
#: The time stamp: beside the header, not among the raw words.
STAMP = 0x01
#: Where the words wait for the filter: of the inertial sample from 0 on, of the field, and a zero.
_FIELD_AT, _ZERO_AT = 8, 15


def header_layout() -> data.StructLayout:
    """Word 0 of the results.

    ``number`` counts updates, 1 the first; one that was never completed leaves a gap. ``filter``:
    which one made it. ``field_used``: the record had a fresh field, ``field_counts``: from
    magnetometer counts, not from a heading. ``restart``: the time step was negative. ``saturated``:
    a value of the filter was clamped.
    """
    return data.StructLayout(
        {
            "number": 16,
            "filter": 3,
            "field_used": 1,
            "field_counts": 1,
            "restart": 1,
            "saturated": 1,
        }
    )


class State(Enum):
    """Where in its job the conductor is; codes that are no state count as FLUSH."""

    IDLE = 0
    FEED = 1
    COLLECT = 2
    FINISH = 3
    FLUSH = 4
    TURN = 5


class Job(Enum):
    """What the core works at."""

    INERTIAL = 0
    FILTER = 1
    HEADING = 2
    COUNTS = 3


class Source(Enum):
    """Where a word for the core comes from."""

    WAITING = 0
    STAMP = 1
    SAMPLE = 2
    LINE = 3


def waiting_words(
    m: Module, o: Any, *, job: Signal, count: Signal, fire: Value, use_field: Signal
) -> Value:
    """Memory of the calibrated words between the programs; the filter's word number ``count``."""
    m.submodules.calibrated = words = memory.Memory(
        shape=len(o.payload.data), depth=16, init=[], attrs={"ram_style": "block"}
    )
    w_port, r_port = words.write_port(), words.read_port()
    # As they come: gyro, accelerometer, time step; field.
    place = {
        f"{s}{a}": at + k
        for s, at in (("g", 0), ("a", 3), ("m", _FIELD_AT))
        for k, a in enumerate("xyz")
    } | {"dt": 6}
    # The word of the next cycle: a table of count, ``fire`` and ``use_field``.
    with m.Switch(Cat(count, fire)):
        for k, name in enumerate(RECORD):
            with m.Case(k, k - 1 + 16 if k else k):
                at: Any = place[name]
                m.d.comb += r_port.addr.eq(Mux(use_field, at, _ZERO_AT) if at >= _FIELD_AT else at)
    m.d.comb += [
        w_port.addr.eq(Cat(count[:3], job[1])),
        w_port.data.eq(o.payload.data),
        w_port.en.eq(o.valid & (job != Job.FILTER)),
    ]
    return r_port.data


def input_word(
    m: Module,
    plan: Plan,
    *,
    job: Signal,
    count: Signal,
    waits: Value,
    stamp: Value,
    word: Value,
    values: Any,
    restarting: Signal,
) -> Value:
    """The word for the core: out of the memory, or raw."""
    bits = plan.count_bits
    source = Signal(Source)
    which = Signal(2)  # of the values
    with m.Switch(job):
        with m.Case(Job.INERTIAL):
            m.d.comb += [
                which.eq(3),
                source.eq(
                    Mux(
                        count[:3] < RAW.index("stamp"),
                        Source.SAMPLE,
                        Mux(count[0], Source.LINE, Source.STAMP),
                    )
                ),
            ]
        with m.Case(Job.FILTER):
            m.d.comb += source.eq(Source.WAITING)
        with m.Default():
            m.d.comb += [source.eq(Source.LINE), which.eq(count)]
    # The fourth value of a line is the sample's word ``restart``.
    m.submodules.value = value = Bitwise(function=multiplex, inputs=6, width=16)
    m.submodules.high = high = Bitwise(function=multiplex, inputs=6, width=16)
    m.submodules.low = low = Bitwise(function=_either, inputs=4, width=bits)
    value.connect(m, *values, Cat(Const(0, 15), restarting), which[0], which[1])
    stamp, (s0, s1) = stamp[32 - plan.word :], source
    high.connect(m, waits[bits:], stamp[bits:], word, value.o, s0, s1)
    low.connect(m, waits[:bits], stamp[:bits], s0, s1)
    return Cat(low.o, high.o)


def put_away(
    m: Module,
    results: Results,
    i: Any,
    o: Any,
    *,
    state: Signal,
    job: Signal,
    count: Signal,
    header: Value,
) -> None:
    """What goes to the result memory when."""
    is_filter = job == Job.FILTER
    region = Signal(2)
    with m.Switch(state):
        with m.Case(State.FEED):
            m.d.comb += [
                results.w_en.eq(i.valid & i.ready & ~job[1]),
                region.eq(Mux(is_filter, RECORDS >> 4, RAWS >> 4)),
            ]
        with m.Case(State.COLLECT):
            m.d.comb += [results.w_en.eq(is_filter & o.valid), region.eq(OUTPUTS >> 4)]
        with m.Case(State.FINISH):
            m.d.comb += results.w_en.eq(is_filter)
    m.submodules.put = put = Bitwise(function=_put, inputs=5, width=results.word)
    s0, s1, _ = state
    m.d.comb += [
        results.w_index.eq(
            Mux((region == RAWS >> 4) & (count == RAW.index("stamp")), STAMP, Cat(count, region))
        ),
        results.w_data.eq(
            put.connect(
                m,
                i.payload.data,
                o.payload.data,
                Cat(header, Const(0, results.word - len(header))),
                s0,
                s1,
            )
        ),
    ]


def _either(waits: Any, stamp: Any, s0: Any, s1: Any) -> Any:
    """What `multiplex` gives where the other two words have no bits."""
    return multiplex(waits, stamp, 0, 0, s0, s1)


def _put(given: Any, taken: Any, header: Any, s0: Any, s1: Any) -> Any:
    """By the state: FEED, COLLECT, FINISH."""
    return multiplex(given, given, taken, header, s0, s1)
