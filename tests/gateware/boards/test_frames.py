"""Frames: in software, from bodies, and to the core's streams and bus."""

import random

import pytest

from boresight.gateware.boards.frames import CRC, END, ESC, Decoder, Framer, Kind, encode
from tests.support.bench import run_bench

# -- frames in software: known bytes, round trips, damage -----------------------------------------


def test_known_frame() -> None:
    assert encode(Kind.READ, [512], word=32) == bytes.fromhex("c0 03 00020000 0367 c0")


def test_crc_is_that_of_hdlc() -> None:
    """Known value of the catalogue; and a bit-by-bit calculation of the frame above."""
    assert CRC.compute(b"123456789") == 0x906E
    check = 0xFFFF
    for byte in bytes.fromhex("0300020000"):
        for bit in range(8):
            check = check >> 1 ^ (0x8408 if (check ^ byte >> bit) & 1 else 0)
    assert check ^ 0xFFFF == CRC.compute(bytes.fromhex("0300020000"))


@pytest.mark.parametrize("word", [18, 24, 25, 32])
def test_round_trip(word: int) -> None:
    rng = random.Random(word)
    half = 1 << word - 1
    frames = [
        (rng.choice(list(Kind)), rng.choices(range(-half, half), k=rng.randrange(9)))
        for _ in range(100)
    ]
    frames.append((Kind.RECORD, [int.from_bytes(bytes([END, ESC]), "little")]))
    decoder = Decoder(word=word)
    line = b"".join(encode(kind, words, word=word) for kind, words in frames)
    assert list(decoder.feed(line)) == frames
    assert decoder.dropped == 0


@pytest.mark.parametrize(
    "damaged",
    [
        b"\x00",
        b"\x01\x02",
        bytes([ESC]),
        bytes([ESC, 0x55]),
        b"\0" + CRC.compute(b"\0").to_bytes(2, "little"),
        CRC.compute(b"").to_bytes(2, "little"),
        b"\1\2\3" + CRC.compute(b"\1\2\3").to_bytes(2, "little"),
    ],
)
def test_damaged_frames_are_dropped_and_the_next_is_not(damaged: bytes) -> None:
    decoder = Decoder(word=32)
    good = encode(Kind.WRITE, [7], word=32)
    assert list(decoder.feed(damaged + good)) == [(Kind.WRITE, [7])]
    assert decoder.dropped == 1


def test_every_changed_bit_is_found() -> None:
    good = encode(Kind.RECORD, [1, -2], word=24)
    for place in range(1, len(good) - 1):
        for bit in range(8):
            changed = bytearray(good)
            changed[place] ^= 1 << bit
            assert list(Decoder(word=24).feed(bytes(changed))) == []


# -- bodies to frames ------------------------------------------------------------------------------


def run(bodies: list[bytes], *, stalls: float, gaps: float) -> bytes:
    dut, out, rng = Framer(), bytearray(), random.Random(1)

    async def put(ctx):
        for body in bodies:
            for k, byte in enumerate(body):
                while rng.random() < gaps:
                    await ctx.tick()
                ctx.set(dut.i.payload, {"data": byte, "last": k == len(body) - 1})
                ctx.set(dut.i.valid, 1)
                await ctx.tick().until(dut.i.ready)
                ctx.set(dut.i.valid, 0)
        await ctx.tick().repeat(50)

    async def take(ctx):
        while True:
            ready = rng.random() >= stalls
            ctx.set(dut.o.ready, ready)
            _, _, valid, byte = await ctx.tick().sample(dut.o.valid, dut.o.payload)
            if valid and ready:
                out.append(byte)

    run_bench(dut, put, background=[take])
    return bytes(out)


@pytest.mark.parametrize("stalls, gaps", [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
def test_frames(stalls: float, gaps: float) -> None:
    rng = random.Random(2)
    bodies, wanted = [], b""
    for _ in range(40):
        words = [
            int.from_bytes(bytes(rng.choices([END, ESC, 0, rng.getrandbits(8)], k=4)), signed=True)
            for _ in range(rng.randrange(5))
        ]
        kind = rng.choice(list(Kind))
        bodies.append(bytes([kind]) + b"".join(w.to_bytes(4, "little", signed=True) for w in words))
        wanted += encode(kind, words, word=32)
    assert run(bodies, stalls=stalls, gaps=gaps) == wanted
