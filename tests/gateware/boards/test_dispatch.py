"""Frames to the core's streams and bus, with a core that takes its time."""

import random

import pytest
from amaranth.sim import Simulator

from boresight.gateware.boards.dispatch import Dispatcher
from boresight.gateware.boards.frames import Kind


def run(
    dut: Dispatcher, frames: list[tuple[Kind, list[int]]], *, stalls: float, answer_after: int = 0
) -> list[tuple]:
    """Events seen by a core: records, writes, and the answers with what they say."""
    rng = random.Random(1)
    events: list[tuple] = []

    async def unpacker(ctx):
        for kind, words in frames:
            ctx.set(dut.pending, 1)
            ctx.set(dut.kind, kind)
            while True:
                _, _, read, index, done = await ctx.tick().sample(dut.read, dut.index, dut.done)
                if read:
                    ctx.set(dut.word_data, words[index])
                if done:
                    break
            ctx.set(dut.pending, 0)

    async def core(ctx):
        record = []
        while True:
            ready = rng.random() >= stalls
            ctx.set(dut.o.ready, ready)
            _, _, valid, data, last = await ctx.tick().sample(
                dut.o.valid, dut.o.payload.data, dut.o.payload.last
            )
            if valid and ready:
                record.append(data)
                if last:
                    events.append(("record", record))
                    record = []
                    ctx.set(dut.o.ready, 0)
                    await ctx.tick().repeat(answer_after + 1)
                    events.append(("answered",))
                    ctx.set(dut.answered, 1)
                    await ctx.tick()
                    ctx.set(dut.answered, 0)

    async def bus(ctx):
        while True:
            ack = rng.random() >= stalls
            ctx.set(dut.bus.w_ack, ctx.get(dut.bus.w_stb & dut.request) and ack)
            _, _, stb, ack, addr, data = await ctx.tick().sample(
                dut.bus.w_stb, dut.bus.w_ack, dut.bus.addr, dut.bus.w_data
            )
            ctx.set(dut.bus.r_data, addr ^ 0x155)
            ctx.set(dut.grant, ctx.get(dut.request))  # as an arbiter: only who asks
            if stb and ack:
                events.append(("write", addr, data))
                ctx.set(dut.bus.w_ack, 0)

    async def replies(ctx):
        while True:
            ready = rng.random() >= stalls
            ctx.set(dut.o_reply.ready, ready)
            _, _, valid, kind, data = await ctx.tick().sample(
                dut.o_reply.valid, dut.o_reply.payload.kind, dut.o_reply.payload.data
            )
            if valid and ready:
                events.append(("reply", Kind(kind), data))

    sim = Simulator(dut)
    sim.add_clock(1e-8)
    for background in (core, bus, replies):
        sim.add_testbench(background, background=True)
    sim.add_testbench(unpacker)
    sim.run()
    return events


@pytest.mark.parametrize("stalls", [0.0, 0.7])
def test_in_order(stalls: float) -> None:
    dut = Dispatcher(word=32, inputs=3, depth=4)
    events = run(
        dut,
        [
            (Kind.RECORD, [1, 2, 3]),
            (Kind.READ, [513]),
            (Kind.WRITE, [7, 99]),
            (Kind.WRITE, [0xFFFF_FC08, 98]),
            (Kind.RECORD, [4, 5, 6]),
            (Kind.READ, [1]),
        ],
        stalls=stalls,
        answer_after=40,
    )
    assert events == [
        ("record", [1, 2, 3]),
        ("answered",),
        ("reply", Kind.READ, 513 ^ 0x155),
        ("write", 7, 99),
        ("reply", Kind.WRITE, 7),
        ("write", 8, 98),
        ("reply", Kind.WRITE, 8),  # bits above the address: ignored
        ("record", [4, 5, 6]),
        ("answered",),
        ("reply", Kind.READ, 1 ^ 0x155),
    ]


@pytest.mark.parametrize("inputs", [1, 2, 5])
def test_an_access_waits_for_the_record_before_it(inputs: int) -> None:
    """Also behind a record that is over with its first word."""
    dut = Dispatcher(word=18, inputs=inputs, depth=8)
    records = [[5 + k for k in range(inputs)], [50 + k for k in range(inputs)]]
    events = run(
        dut,
        [
            (Kind.RECORD, records[0]),
            (Kind.READ, [3]),
            (Kind.RECORD, records[1]),
            (Kind.WRITE, [7, 9]),
        ],
        stalls=0.0,
        answer_after=40,
    )
    assert events == [
        ("record", records[0]),
        ("answered",),
        ("reply", Kind.READ, 3 ^ 0x155),
        ("record", records[1]),
        ("answered",),
        ("write", 7, 9),
        ("reply", Kind.WRITE, 7),
    ]


def test_records_of_one_word_follow_each_other() -> None:
    dut = Dispatcher(word=18, inputs=1, depth=2)
    events = run(dut, [(Kind.RECORD, [5]), (Kind.RECORD, [6])], stalls=0.0)
    assert [e for e in events if e[0] == "record"] == [("record", [5]), ("record", [6])]
