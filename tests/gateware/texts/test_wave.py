"""Drawings say what the core does: it is driven as they say."""

from __future__ import annotations

import json
from typing import Any

import pytest
from amaranth.lib.wiring import Component

from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.engine.engine import Engine
from boresight.gateware.texts.wave import Drawing, bus_drawing, record_drawing
from boresight.sim.levels.build import Build
from tests.support.linked import Inner
from tests.support.track import Track


@pytest.fixture(scope="module")
def core() -> Core:
    return Build(Track(), restarts=0).core


def row(drawing: Drawing, name: str) -> tuple[Any, ...]:
    return dict(drawing.rows)[name]


def test_a_record(core: Core, simulate: Any) -> None:
    """Two records offered one after the other, and every shown cycle of the first."""
    drawing = record_drawing(describe(core).programs[0], 32)
    words = [core.program.values[n].name for n in core.program.streamed]
    seen: dict[int, tuple[Any, ...]] = {}
    dut: Component = Engine(machine=core.machine, image=core.image)

    async def bench(ctx: Any) -> None:
        ctx.set(dut.o.ready, 1)
        while not ctx.get(dut.i.ready):
            await ctx.tick()
        given = 0
        told = 0
        for cycle in range(1, core.schedule.interval + 2):
            word, last = given % len(words), given % len(words) == len(words) - 1
            ctx.set(dut.i.payload, {"data": 0, "last": last})
            ctx.set(dut.i.valid, 1)
            ready, valid = ctx.get(dut.i.ready), ctx.get(dut.o.valid)
            output = core.program.output_names[told] if valid else None
            mark = ctx.get(dut.o.payload.last) if valid else None
            seen[cycle] = (1, ready, words[word], int(last), valid, 1, output, mark)
            given, told = given + ready, told + valid
            await ctx.tick()

    simulate(dut, bench)
    assert drawing.cycles[0] == 1 and drawing.cycles[-1] == core.schedule.interval + 1
    assert set(core.schedule.latencies) >= {max(core.schedule.latencies)} <= set(drawing.cycles)
    for k, cycle in enumerate(drawing.cycles):
        assert tuple(values[k] for _, values in drawing.rows) == seen[cycle], cycle


@pytest.mark.parametrize("kind", [Track, Inner])
def test_the_bus(kind: Any, simulate: Any) -> None:
    """A parameter is written two cycles long; without one a flag is cleared at once."""
    core = Build(kind(), restarts=0).core
    drawing = bus_drawing(describe(core))
    dut: Component = Engine(machine=core.machine, image=core.image)
    assert len(drawing.cycles) == (4 if kind is Track else 3)

    async def bench(ctx: Any) -> None:
        await ctx.tick().repeat(8)
        for k in range(len(drawing.cycles)):
            addr, w_stb = row(drawing, "bus__addr")[k], row(drawing, "bus__w_stb")[k]
            ctx.set(dut.bus.addr, 513 if addr is None else int(addr))
            ctx.set(dut.bus.w_stb, w_stb)
            assert ctx.get(dut.bus.w_ack) == row(drawing, "bus__w_ack")[k]
            if row(drawing, "bus__r_data")[k] == "status":
                assert ctx.get(dut.bus.r_data) & 0b0111 == 0b0100
            await ctx.tick()

    simulate(dut, bench)


DRAWING = Drawing(
    (1, 2, 5, 6), (("bit", (0, 1, 1, 0)), ("word", ("a", "a", None, "b")), ("any", (None, 1, 0, 0)))
)


def test_text() -> None:
    assert DRAWING.text() == (
        "cycle | 1 | 2  .. | 5 | 6\n"
        "bit   ____/‾‾‾ .. ‾‾‾‾\\___\n"
        "word  | a      .. ....| b\n"
        "any   ....‾‾‾‾ .. \\_______\n"
    )


def test_wavedrom() -> None:
    drawn = json.loads(DRAWING.wavedrom())["signal"]
    assert [s["wave"] for s in drawn] == ["p.|..", "==|==", "01|.0", "=.|x=", "x1|0."]
    assert [s.get("data") for s in drawn] == [None, ["1", "2", "5", "6"], None, ["a", "b"], None]
    text = DRAWING.markdown()
    assert text.count("```") == 4 and DRAWING.text() in text and DRAWING.wavedrom() in text


def test_waves_have_a_letter_for_each_column(core: Core) -> None:
    drawing = record_drawing(describe(core).programs[0], 32)
    gaps = sum(b != a + 1 for a, b in zip(drawing.cycles, drawing.cycles[1:], strict=False))
    waves = [s["wave"] for s in json.loads(drawing.wavedrom())["signal"]]
    assert {len(wave) for wave in waves} == {len(drawing.cycles) + gaps}
