"""Drawings in the README say what the core does: it is driven as they say."""

from typing import Any

import pytest

from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.engine.engine import Engine
from boresight.gateware.texts.wave import bus_drawing, record_drawing
from boresight.sim.levels.build import Build
from tests.support.track import Track


@pytest.fixture(scope="module")
def core() -> Core:
    return Build(Track()).core


def test_a_record(core: Core, simulate: Any) -> None:
    """Two records offered one after the other, and every shown cycle of the first."""
    description = describe(core)
    drawing = record_drawing(description.programs[0], 32)
    words = [word.name for word in description.programs[0].inputs]
    seen: dict[int, tuple[Any, ...]] = {}
    dut = Engine(machine=core.machine, image=core.image)

    async def bench(ctx: Any) -> None:
        ctx.set(dut.o.ready, 1)
        while not ctx.get(dut.i.ready):
            await ctx.tick()
        n_in = n_out = 0
        for cycle in range(1, core.schedule.interval + 2):
            word, last = n_in % len(words), n_in % len(words) == len(words) - 1
            ctx.set(dut.i.payload, {"data": 0, "last": last})
            ctx.set(dut.i.valid, 1)
            ready, valid = ctx.get(dut.i.ready), ctx.get(dut.o.valid)
            output = core.program.output_names[n_out] if valid else None
            mark = ctx.get(dut.o.payload.last) if valid else None
            seen[cycle] = (1, ready, words[word], int(last), valid, 1, output, mark)
            n_in, n_out = n_in + ready, n_out + valid
            await ctx.tick()

    simulate(dut, bench)
    assert drawing.cycles[0] == 1 and drawing.cycles[-1] == core.schedule.interval + 1
    for k, cycle in enumerate(drawing.cycles):
        assert tuple(values[k] for _, values in drawing.rows) == seen[cycle], cycle


def test_the_bus(core: Core, simulate: Any) -> None:
    drawing = bus_drawing(describe(core))
    rows = dict(drawing.rows)
    dut = Engine(machine=core.machine, image=core.image)

    async def bench(ctx: Any) -> None:
        await ctx.tick().repeat(8 + core.image.restarts[0])
        for k in range(len(drawing.cycles)):
            addr = rows["bus__addr"][k]
            ctx.set(dut.bus.addr, 513 if addr is None else int(addr))
            ctx.set(dut.bus.w_stb, rows["bus__w_stb"][k])
            assert ctx.get(dut.bus.w_ack) == rows["bus__w_ack"][k]
            if rows["bus__r_data"][k] == "status":
                assert ctx.get(dut.bus.r_data) & 0b0111 == 0b0100
            await ctx.tick()

    simulate(dut, bench)
