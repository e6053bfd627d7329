"""Frames in hardware: what is kept, what is dropped."""

import random

import pytest

from boresight.gateware.boards.frames import CRC, END, ESC, Decoder, Kind, encode
from boresight.gateware.boards.unpack import Unpacker
from tests.support.bench import pulse

COUNTS = {Kind.WRITE: 2, Kind.READ: 1}

KINDS = [Kind.RECORD, Kind.WRITE, Kind.READ]


def unpacker(word: int, inputs: int) -> Unpacker:
    return Unpacker(word=word, lengths={Kind.RECORD: inputs, **COUNTS})


async def feed(ctx, dut, data: bytes) -> None:
    for byte in data:
        ctx.set(dut.data, byte)
        await pulse(ctx, dut.valid)
        await ctx.tick()


async def fault(ctx, dut) -> None:
    await pulse(ctx, dut.error)


async def fetch(ctx, dut, count: int) -> list[int]:
    """Words of the frame that waits; then it is done."""
    words = []
    for index in range(count):
        ctx.set(dut.index, index)
        ctx.set(dut.read, 1)
        await ctx.tick()
        words.append(ctx.get(dut.word_data))
    ctx.set(dut.read, 0)
    await pulse(ctx, dut.done)
    return words


@pytest.mark.parametrize("place", range(10))
def test_line_error_spoils_the_frame(place: int, simulate) -> None:
    dut = unpacker(32, 1)
    frame = encode(Kind.RECORD, [5], word=32)

    async def bench(ctx):
        await feed(ctx, dut, frame[:place])
        await fault(ctx, dut)
        await feed(ctx, dut, frame[place:])
        # Before and after the frame there is nothing to spoil.
        assert ctx.get(dut.pending) == (place in (0, len(frame)) or place > len(frame))

    simulate(dut, bench)


def test_third_frame_is_dropped(simulate) -> None:
    dut = unpacker(32, 1)

    async def bench(ctx):
        for value in (1, 2, 3):
            await feed(ctx, dut, encode(Kind.RECORD, [value], word=32))
            assert ctx.get(dut.pending)
        assert await fetch(ctx, dut, 1) == [1]
        assert not ctx.get(dut.pending)
        await feed(ctx, dut, encode(Kind.READ, [4], word=32))
        assert await fetch(ctx, dut, 1) == [4]

    simulate(dut, bench)


def test_same_verdict_as_the_software(simulate) -> None:
    """Frames, of which some bytes are wrong, of any kind and length, and bytes between them."""
    rng = random.Random(8)
    dut = unpacker(24, 2)
    pieces = [bytes([c]) for c in (END, END, ESC, 0xDC, 0xDD, 0, 1, 2, 3)]
    stream = []
    for _ in range(300):
        if rng.random() < 0.5:
            kind = rng.choice(KINDS)
            words = [rng.getrandbits(24) - 2**23 for _ in range(COUNTS.get(kind, 2))]
            frame = bytearray(encode(kind, words, word=24))
            if rng.random() < 0.5:
                frame[rng.randrange(len(frame))] = rng.randrange(256)
            elif rng.random() < 0.2:
                frame.insert(-1, ESC)
            stream.append(bytes(frame))
        elif rng.random() < 0.4:  # a right CRC around another kind, or too few or too many bytes
            data = bytes([rng.randrange(8), *range(rng.choice((0, 3, 4, 7, 8, 9, 12, 40, 72)))])
            data += CRC.compute(data).to_bytes(2, "little")
            stream.append(bytes([END]) + data.replace(bytes([END]), b"") + bytes([END]))
        else:
            stream.append(b"".join(rng.choices(pieces, k=rng.randrange(6))))
    decoder = Decoder(word=24)
    accepted = 0

    async def bench(ctx):
        nonlocal accepted
        for byte in b"".join(stream):
            expected = [
                (kind, [w & 0xFFFFFF for w in words])
                for kind, words in decoder.feed(bytes([byte]))
                if kind in KINDS and len(words) == COUNTS.get(kind, 2)
            ]
            await feed(ctx, dut, bytes([byte]))
            assert ctx.get(dut.pending) == len(expected)
            for kind, words in expected:
                accepted += 1
                assert ctx.get(dut.kind) == kind
                assert await fetch(ctx, dut, len(words)) == words

    simulate(dut, bench)
    assert accepted > 50
