"""The host's line: registers are read and written, bodies are pushed, nothing stops it."""

import random

import pytest
from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import memory

from boresight.gateware.attitude.system.attitude_output import Bridge
from boresight.gateware.boards.frames import END, ESC, Decoder, Kind, encode
from tests.support.bench import at_edges, put, run_bench
from tests.support.clock import pause

DIVISOR = 8


class Host:
    """A bridge, a memory on its bus, who pushes, and the host's end of the line."""

    def __init__(self, send, listen, *, delay: int = 0) -> None:
        self.dut = dut = Bridge(clock_hz=DIVISOR * 1e6, baud=1e6)
        self.top = top = Module()
        top.submodules.dut = dut
        top.submodules.words = words = memory.Memory(shape=32, depth=4096, init=[])
        w_port = words.write_port()
        r_port = words.read_port()
        waited = Signal(8)
        top.d.comb += [
            w_port.addr.eq(dut.bus.addr),
            w_port.data.eq(dut.bus.w_data),
            w_port.en.eq(dut.bus.w_stb & dut.bus.w_ack),
            dut.bus.w_ack.eq(dut.bus.w_stb & (waited == delay)),
            r_port.addr.eq(Mux(dut.reads, dut.bus.addr, ~dut.bus.addr)),
            dut.bus.r_data.eq(r_port.data),
        ]
        top.d.sync += waited.eq(Mux(dut.bus.w_stb & ~dut.bus.w_ack, waited + 1, 0))
        self._send, self._listen = send, listen
        self.received, self.decoder = bytearray(), Decoder(word=32)
        self.frames: list[tuple[Kind, list[int]]] = []
        self.events = [0, 0]

    def run(self, test) -> None:
        def count(events: int) -> None:
            for k in range(2):
                self.events[k] += events >> k & 1

        async def watch(ctx):
            await at_edges(ctx, count, self.dut.events)

        run_bench(
            self.top, test, background=[self._listen(self.dut.tx, DIVISOR, self.received), watch]
        )

    async def send(self, ctx, data: bytes, **options) -> None:
        await self._send(ctx, self.dut.rx, DIVISOR, data, **options)

    async def answer(self, ctx, limit: int = 4000) -> tuple[Kind, list[int]] | None:
        for _ in range(0, limit, DIVISOR):
            self.frames += self.decoder.feed(bytes(self.received))
            self.received.clear()
            if self.frames:
                return self.frames.pop(0)
            await pause(ctx, DIVISOR)
        return None

    async def ask(self, ctx, kind: Kind, words: list[int]) -> list[int]:
        await self.send(ctx, encode(kind, words, word=32))
        answer = await self.answer(ctx)
        assert answer is not None and answer[0] is kind, answer
        return answer[1]

    async def push(self, ctx, body: bytes, gap: int = 0, last: bool = True) -> None:
        for k, byte in enumerate(body):
            await pause(ctx, gap)
            payload = {"data": byte, "last": last and k == len(body) - 1}
            await put(ctx, self.dut.i, payload, limit=100_000)


@pytest.fixture
def host(send, listen):
    return lambda **options: Host(send, listen, **options)


@pytest.mark.parametrize("delay", [0, 100])
def test_write_then_read(delay: int, host) -> None:
    end, rng = host(delay=delay), random.Random(1)

    async def test(ctx):
        model = {}
        for _ in range(4):
            address = rng.randrange(4096)
            model[address] = rng.choice([rng.getrandbits(31), 0x40DBC0DB, -1])
            assert await end.ask(ctx, Kind.WRITE, [address, model[address]]) == [address]
        for address, word in model.items():
            assert await end.ask(ctx, Kind.READ, [address]) == [word]
        assert await end.ask(ctx, Kind.READ, [0x7FFF_F000 | address]) == [word]

    end.run(test)
    assert end.events == [0, 0] and end.decoder.dropped == 0


def test_records_are_unknown_here(host) -> None:
    end = host()

    async def test(ctx):
        await end.send(
            ctx, encode(Kind.RECORD, [1, 2], word=32) + encode(Kind.ATTITUDE, [1], word=32)
        )
        assert await end.answer(ctx, limit=2000) is None
        assert end.events == [0, 2]
        assert await end.ask(ctx, Kind.READ, [5]) == [0]

    end.run(test)


@pytest.mark.parametrize("gap", [0, 100])
def test_answers_and_bodies_take_turns(gap: int, host) -> None:
    """Both always there: whole ones, one after the other, also if a body comes slowly."""
    end, rng = host(), random.Random(2)
    bodies = [
        bytes([Kind.ATTITUDE])
        + b"".join(rng.getrandbits(32).to_bytes(4, "little") for _ in range(3))
        for _ in range(4)
    ]

    async def test(ctx):
        await end.send(ctx, encode(Kind.READ, [1], word=32))
        for body in bodies:
            await end.push(ctx, body[:1], gap=gap, last=False)
            await end.send(ctx, encode(Kind.READ, [1], word=32))
            await end.push(ctx, body[1:], gap=gap)
        while (frame := await end.answer(ctx, limit=2000)) is not None:
            got.append(frame)

    got: list = []
    end.run(test)
    assert end.decoder.dropped == 0
    pushed = [words for kind, words in got if kind is Kind.ATTITUDE]
    assert pushed == [
        [int.from_bytes(b[k : k + 4], "little", signed=True) for k in (1, 5, 9)] for b in bodies
    ]
    answers = [kind for kind, _ in got].count(Kind.READ)
    assert answers >= 4 and answers + end.events[1] == 5  # a third one ahead is dropped


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.soak) for k in range(1, 20))]
)
def test_nothing_stops_it(seed: int, host) -> None:
    end, rng = host(), random.Random(seed)
    pieces = [bytes([c]) for c in (END, ESC, 0xDC, 0xDD, 0, 1, 2, 3, 4, 0xFF)]

    async def test(ctx):
        for n in range(4):
            match n:
                case 0:
                    await end.send(ctx, rng.randbytes(rng.randrange(30)))
                case 1:
                    await end.send(ctx, b"".join(rng.choices(pieces, k=rng.randrange(20))))
                case 2:
                    frame = encode(Kind.WRITE, [1, 2], word=32)
                    place = rng.randrange(1, len(frame) - 1)
                    await end.send(ctx, frame[:place] + frame[place + 1 :])
                case 3:
                    ctx.set(end.dut.rx, 0)
                    await ctx.tick().repeat(rng.randrange(1, 300))
                    ctx.set(end.dut.rx, 1)
                    await ctx.tick().repeat(10 * DIVISOR)
            while await end.answer(ctx, limit=1000) is not None:
                pass
            word = rng.getrandbits(31)
            assert await end.ask(ctx, Kind.WRITE, [n, word]) == [n]
            assert await end.ask(ctx, Kind.READ, [n]) == [word]

    end.run(test)
