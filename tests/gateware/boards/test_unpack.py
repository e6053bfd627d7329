"""Frames in hardware: what is kept, what is dropped."""

import random

import pytest

from boresight.gateware.boards.frames import CRC, END, ESC, ESC_ESCAPED, Decoder, Kind, encode
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


@pytest.mark.parametrize("word", [18, 24, 25, 32])
@pytest.mark.parametrize("inputs", [1, 2, 5])
def test_good_frames(word: int, inputs: int, simulate) -> None:
    dut = unpacker(word, inputs)
    rng = random.Random(inputs)
    mask = (1 << word) - 1

    async def bench(ctx):
        for _ in range(30):
            kind = rng.choice(KINDS)
            words = [
                rng.choice([rng.getrandbits(word), 0xC0DBC0DB & mask, 0])
                for _ in range(COUNTS.get(kind, inputs))
            ]
            assert not ctx.get(dut.pending)
            await feed(ctx, dut, encode(kind, words, word=word))
            assert ctx.get(dut.pending) and ctx.get(dut.kind) == kind
            assert await fetch(ctx, dut, len(words)) == words

    simulate(dut, bench)


def body(data: bytes) -> bytes:
    """A frame with a right CRC around any bytes, none of which needs an escape."""
    whole = data + CRC.compute(data).to_bytes(2, "little")
    assert not {END, ESC} & set(whole)
    return bytes([END]) + whole + bytes([END])


@pytest.mark.parametrize(
    "damaged",
    [
        bytes([END, END, END]),
        body(b""),
        body(b"\1"),
        body(b"\0" + bytes(12)),  # no such kind
        body(b"\4" + bytes(12)),
        *(body(bytes([1 | 1 << bit]) + bytes(12)) for bit in range(2, 8)),
        body(b"\1" + bytes(11)),  # bytes, words too few or too many
        body(b"\1" + bytes(13)),
        body(b"\1" + bytes(8)),
        body(b"\1" + bytes(16)),
        body(b"\1" + bytes(20)),
        body(b"\1" + bytes(4 * 3 + 4 * 8)),  # and so many that a counter would come round
        body(b"\1" + bytes(4 * 3 + 4 * 16)),
        body(b"\2" + bytes(12)),
        body(b"\3" + bytes(12)),
        bytes([END, 1, *range(12), 0x55, END]),  # CRC
        body(b"\1" + bytes(12))[:-1] + bytes([ESC, END]),  # escapes
        bytes([END, 1, ESC, 0x11, *range(12), END]),
        encode(Kind.RECORD, [ESC, 2, 3], word=32).replace(bytes([ESC_ESCAPED]), b"\x11"),
        bytes([ESC]),
    ],
)
def test_damaged_frames_are_dropped_and_the_next_is_not(damaged: bytes, simulate) -> None:
    dut = unpacker(32, 3)

    async def bench(ctx):
        await feed(ctx, dut, damaged)
        assert not ctx.get(dut.pending)
        await feed(ctx, dut, encode(Kind.RECORD, [1, 2, 3], word=32))
        assert ctx.get(dut.pending)
        assert await fetch(ctx, dut, 3) == [1, 2, 3]

    simulate(dut, bench)


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
    """Random bytes that are rich in what matters."""
    rng = random.Random(8)
    dut = unpacker(24, 2)
    pieces = [bytes([c]) for c in (END, END, ESC, 0xDC, 0xDD, 0, 1, 2, 3)]
    stream = []
    for _ in range(300):
        if rng.random() < 0.5:
            kind = rng.choice(KINDS)
            words = [rng.getrandbits(24) for _ in range(COUNTS.get(kind, 2))]
            frame = bytearray(encode(kind, words, word=24))
            if rng.random() < 0.5:
                frame[rng.randrange(len(frame))] = rng.randrange(256)
            stream.append(bytes(frame))
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
                if len(words) == COUNTS.get(kind, 2)
            ]
            await feed(ctx, dut, bytes([byte]))
            assert ctx.get(dut.pending) == len(expected)
            for kind, words in expected:
                accepted += 1
                assert ctx.get(dut.kind) == kind
                assert await fetch(ctx, dut, len(words)) == words

    simulate(dut, bench)
    assert accepted > 50
