"""Records and answers to bodies, and these to frames, read back by the software's decoder."""

import random

import pytest
from amaranth.hdl import Module
from amaranth.lib import wiring

from boresight.gateware.boards.frames import Decoder, Framer, Kind, Packer
from tests.support.bench import put, run_bench


def run(
    word: int,
    records: list[list[int]],
    replies: list[tuple[Kind, int]],
    stalls: float,
    seed: int,
    pause: int = 0,
) -> bytes:
    dut, framer = Packer(word=word, records=bool(records)), Framer()
    top = Module()
    top.submodules += [dut, framer]
    wiring.connect(top, dut.o, framer.i)
    out, rng = bytearray(), random.Random(seed)
    mask = (1 << word) - 1
    done = set()

    async def put_all(ctx, port, payloads, pause=0):
        for payload in payloads:
            for _ in range(rng.randrange(pause + 1)):
                await ctx.tick()
            while rng.random() < stalls:
                await ctx.tick()
            await put(ctx, port, payload)

    async def put_records(ctx):
        if not records:
            done.add("records")
            return
        await put_all(
            ctx,
            dut.i,
            [
                {"data": w & mask, "last": k == len(words) - 1}
                for words in records
                for k, w in enumerate(words)
            ],
            pause,
        )
        done.add("records")

    async def put_replies(ctx):
        await put_all(ctx, dut.i_reply, [{"data": w & mask, "kind": k} for k, w in replies])
        done.add("replies")

    async def sink(ctx):
        idle = 0
        while len(done) < 2 or idle < 20:
            ready = rng.random() >= stalls
            ctx.set(framer.o.ready, ready)
            _, _, valid, byte = await ctx.tick().sample(framer.o.valid, framer.o.payload)
            if valid and ready:
                out.append(byte)
            idle = 0 if valid else idle + 1

    run_bench(top, put_records, put_replies, sink)
    return bytes(out)


@pytest.mark.parametrize("stalls", [0.0, 0.5])
def test_answers_come_between_records(stalls: float) -> None:
    rng = random.Random(3)
    records = [[rng.getrandbits(31) for _ in range(3)] for _ in range(10)]
    replies = [(rng.choice([Kind.READ, Kind.WRITE]), rng.getrandbits(31)) for _ in range(10)]
    decoder = Decoder(word=32)
    frames = list(decoder.feed(run(32, records, replies, stalls, seed=4, pause=40)))
    assert decoder.dropped == 0
    kinds = [kind is Kind.RECORD for kind, _ in frames]
    assert False in kinds[: kinds.index(True) + 5], "no answer came between the records"
    assert [words for kind, words in frames if kind is Kind.RECORD] == records
    assert [(kind, words[0]) for kind, words in frames if kind is not Kind.RECORD] == replies
