"""Bodies to frames, and raw text between them."""

import random

import pytest
from amaranth.sim import Simulator

from boresight.gateware.boards.framer import Framer
from boresight.gateware.boards.frames import CRC, END, ESC, Kind, encode


def run(bodies: list[tuple[bytes, bool]], *, stalls: float, gaps: float) -> bytes:
    dut, out, rng = Framer(), bytearray(), random.Random(1)

    async def put(ctx):
        for body, raw in bodies:
            for k, byte in enumerate(body):
                while rng.random() < gaps:
                    await ctx.tick()
                ctx.set(dut.i.payload, {"data": byte, "last": k == len(body) - 1, "raw": raw})
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

    sim = Simulator(dut)
    sim.add_clock(1e-8)
    sim.add_testbench(take, background=True)
    sim.add_testbench(put)
    sim.run()
    return bytes(out)


@pytest.mark.parametrize("stalls, gaps", [(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)])
def test_frames_and_text(stalls: float, gaps: float) -> None:
    rng = random.Random(2)
    bodies, wanted = [], b""
    for _ in range(40):
        if rng.random() < 0.3:
            text = bytes(rng.choices([END, ESC, 65, 66], k=rng.randrange(1, 20)))
            bodies.append((text, True))
            wanted += text
        else:
            words = [
                int.from_bytes(bytes(rng.choices([END, ESC, 0, rng.getrandbits(8)], k=4)), "little")
                for _ in range(rng.randrange(5))
            ]
            kind = rng.choice(list(Kind))
            frame = encode(kind, words, word=32)
            bodies.append((bytes([kind]) + b"".join(w.to_bytes(4, "little") for w in words), False))
            wanted += frame
    assert run(bodies, stalls=stalls, gaps=gaps) == wanted


def test_check_bytes_are_escaped() -> None:
    for byte in range(2**16):
        body = bytes([Kind.READ, byte & 0xFF, byte >> 8])
        check = CRC.compute(body).to_bytes(2, "little")
        if check[0] in (END, ESC) or check[1] in (END, ESC):
            break
    escaped = check.replace(b"\xdb", b"\xdb\xdd").replace(b"\xc0", b"\xdb\xdc")
    assert run([(body, False)], stalls=0.0, gaps=0.0)[-len(escaped) - 1 : -1] == escaped
