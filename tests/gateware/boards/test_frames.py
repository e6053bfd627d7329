"""Frames: in software, from bodies, and to the core's streams and bus."""

import random

import pytest

from boresight.gateware.boards.dispatch import Dispatcher
from boresight.gateware.boards.framer import Framer
from boresight.gateware.boards.frames import CRC, END, ESC, Decoder, Kind, encode
from tests.support.bench import pulse, run_bench

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
    frames.append((Kind.RECORD, [int.from_bytes(bytes([END, ESC, END]), "little") - 2**24]))
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
            int.from_bytes(bytes(rng.choices([END, ESC, 0, rng.getrandbits(8)], k=4)), "little")
            for _ in range(rng.randrange(5))
        ]
        kind = rng.choice(list(Kind))
        bodies.append(bytes([kind]) + b"".join(w.to_bytes(4, "little") for w in words))
        wanted += encode(kind, words, word=32)
    assert run(bodies, stalls=stalls, gaps=gaps) == wanted


# -- frames to the core's streams and bus, with a core that takes its time ------------------------


def dispatch_run(
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
                    await pulse(ctx, dut.answered)

    async def bus(ctx):
        asked = [0] * dut.read_cycles
        while True:
            ack = rng.random() >= stalls
            ctx.set(dut.bus.w_ack, ctx.get(dut.bus.w_stb & dut.request) and ack)
            _, _, stb, ack, addr, data = await ctx.tick().sample(
                dut.bus.w_stb, dut.bus.w_ack, dut.bus.addr, dut.bus.w_data
            )
            asked.append(addr)
            ctx.set(dut.bus.r_data, asked[-dut.read_cycles] ^ 0x2_0155)
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

    run_bench(dut, unpacker, background=[core, bus, replies])
    return events


@pytest.mark.parametrize("stalls, read_cycles", [(0.0, 1), (0.7, 1), (0.0, 2), (0.0, 3)])
def test_in_order(stalls: float, read_cycles: int) -> None:
    dut = Dispatcher(word=32, inputs=3, depth=4, read_cycles=read_cycles)
    events = dispatch_run(
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
        ("reply", Kind.READ, 513 ^ 0x2_0155),
        ("write", 7, 99),
        ("reply", Kind.WRITE, 7),
        ("write", 8, 98),
        ("reply", Kind.WRITE, 8),  # bits above the address: ignored
        ("record", [4, 5, 6]),
        ("answered",),
        ("reply", Kind.READ, 1 ^ 0x2_0155),
    ]
