"""The board's core end to end, through the serial line: equal to the C model; nothing stops it."""

import random

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.gateware.boards.frames import END, ESC, Decoder, Kind, encode
from boresight.gateware.boards.top import Top
from boresight.gateware.core import Core
from boresight.gateware.registers import PROGRAM
from boresight.model.estimator import input_words
from tests.support.bench import run_bench
from tests.support.clock import pause

DIVISOR = 8
STATUS, UPDATES, BUILD = 512, 513, 514


class Line:
    """A `Top` and both ends of its serial line."""

    def __init__(self, core: Core, send, listen) -> None:
        self.core = core
        self.word = core.machine.arithmetic.word
        self.dut = Top(core=core, clock_hz=DIVISOR * Top.BAUD)
        self._send, self._listen = send, listen
        self._received = bytearray()
        self._decoder = Decoder(word=self.word)
        self._frames: list[tuple[Kind, list[int]]] = []

    def run(self, test) -> None:
        run_bench(self.dut, test, background=[self._listen(self.dut.tx, DIVISOR, self._received)])
        assert self._decoder.dropped == 0

    async def send(self, ctx, data: bytes, **options) -> None:
        await self._send(ctx, self.dut.rx, DIVISOR, data, **options)

    async def answer(self, ctx, limit: int = 20_000) -> tuple[Kind, list[int]] | None:
        """Next frame from the board; None if there is none for a while."""
        for _ in range(0, limit, DIVISOR):
            self._frames += self._decoder.feed(bytes(self._received))
            self._received.clear()
            if self._frames:
                return self._frames.pop(0)
            await pause(ctx, DIVISOR)
        return None

    async def ask(self, ctx, kind: Kind, words: list[int]) -> list[int]:
        await self.send(ctx, encode(kind, words, word=self.word))
        answer = await self.answer(ctx)
        assert answer is not None and answer[0] is kind
        return answer[1]


@pytest.fixture
def line(send, listen):
    return lambda core: Line(core, send, listen)


def random_words(core: Core, count: int, seed: int) -> np.ndarray:
    """Records of input words inside the declared ranges."""
    rng = np.random.default_rng(seed)
    values = [core.program.values[n] for n in core.program.inputs]
    real = np.stack([rng.uniform(v.low, v.high, (count, 1)) for v in values], axis=1)
    return input_words(core.program, real)[..., 0]


@pytest.mark.parametrize("config, word", [("small", 18), ("fast", 25)])
def test_small_program(config: str, word: int, leaky_of, line) -> None:
    core = leaky_of(config, word)
    bench = line(core)
    inputs = random_words(core, 3, seed=1)
    expected = CModel(core.program).update(inputs)[0]

    async def test(ctx):
        for words, wanted in zip(inputs, expected, strict=True):
            assert await bench.ask(ctx, Kind.RECORD, words.tolist()) == wanted.tolist()

    bench.run(test)


def test_parameters_and_status(leaky: Core, line) -> None:
    bench, model = line(leaky), CModel(leaky.program)
    address = leaky.parameter_addresses["gain"]
    gain = int(leaky.program.format(leaky.program.find("gain")).quantise(-0.25))
    inputs = random_words(leaky, 2, seed=3)
    mask = (1 << bench.word) - 1

    async def test(ctx):
        wanted = model.update(inputs[:1])[0][0].tolist()
        assert await bench.ask(ctx, Kind.RECORD, inputs[0].tolist()) == wanted
        assert await bench.ask(ctx, Kind.WRITE, [address, gain]) == [address]
        model.set_param("gain", gain)
        wanted = model.update(inputs[1:])[0][0].tolist()
        assert await bench.ask(ctx, Kind.RECORD, inputs[1].tolist()) == wanted
        assert await bench.ask(ctx, Kind.READ, [UPDATES]) == [2]
        # Idle; the parity of three: the states were loaded, then came two updates.
        assert await bench.ask(ctx, Kind.READ, [STATUS]) == [0b1100]
        (low,) = await bench.ask(ctx, Kind.READ, [BUILD])
        (high,) = await bench.ask(ctx, Kind.READ, [BUILD + 1])
        assert (low & mask) | (high & mask) << bench.word == (
            leaky.image.digest & (1 << 2 * bench.word) - 1
        )

    bench.run(test)


def test_programs_are_selected_over_the_line(both: Core, line) -> None:
    bench = line(both)
    models = [CModel(part.program) for part in both.parts]
    inputs = random_words(both, 4, seed=5)

    async def test(ctx):
        for k, (number, words) in enumerate(zip((0, 1, 0, 1), inputs, strict=True)):
            if k:
                assert await bench.ask(ctx, Kind.WRITE, [PROGRAM, number]) == [PROGRAM]
            wanted = models[number].update(words[None])[0][0].tolist()
            assert await bench.ask(ctx, Kind.RECORD, words.tolist()) == wanted
        assert await bench.ask(ctx, Kind.WRITE, [PROGRAM, 2]) == [PROGRAM]
        assert await bench.ask(ctx, Kind.READ, [PROGRAM]) == [number]

    bench.run(test)


def test_two_frames_ahead(leaky: Core, line) -> None:
    """Records sent without a pause; requests among them are answered in order."""
    bench, model = line(leaky), CModel(leaky.program)
    inputs = random_words(leaky, 3, seed=4)
    expected = model.update(inputs)[0].tolist()

    async def test(ctx):
        await bench.send(
            ctx, encode(Kind.RECORD, inputs[0], word=32) + encode(Kind.READ, [UPDATES], word=32)
        )
        assert await bench.answer(ctx) == (Kind.RECORD, expected[0])
        kind, words = await bench.answer(ctx)
        assert kind is Kind.READ and words[0] in (0, 1)
        for record, wanted in zip(inputs[1:].tolist(), expected[1:], strict=True):
            assert await bench.ask(ctx, Kind.RECORD, record) == wanted

    bench.run(test)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(k, marks=pytest.mark.soak) for k in range(1, 20))]
)
def test_nothing_stops_it(seed: int, leaky: Core, line) -> None:
    """Noise, then a record: always one answer, and states that only whole records have changed."""
    bench, model = line(leaky), CModel(leaky.program)
    rng = random.Random(seed)
    pieces = [bytes([c]) for c in (END, ESC, 0xDC, 0xDD, 0, 1, 2, 3, 0xFF)]
    records = random_words(leaky, 5, seed).tolist()

    async def test(ctx):
        for noise, record in enumerate(records):
            match noise:
                case 0:
                    await bench.send(ctx, rng.randbytes(rng.randrange(40)))
                case 1:
                    await bench.send(ctx, b"".join(rng.choices(pieces, k=rng.randrange(30))))
                case 2:  # a frame of which something is lost or doubled
                    frame = encode(Kind.RECORD, record, word=32)
                    place = rng.randrange(1, len(frame) - 1)
                    lost = frame[:place] + frame[place + rng.choice([-1, 1]) :]
                    await bench.send(ctx, lost)
                case 3:  # a line held low, then high in the middle of a byte
                    ctx.set(bench.dut.rx, 0)
                    await pause(ctx, rng.randrange(1, 300))
                    ctx.set(bench.dut.rx, 1)
                    await pause(ctx, 10 * DIVISOR)
                case 4:  # bytes at another rate
                    for _ in range(rng.randrange(300)):
                        ctx.set(bench.dut.rx, rng.getrandbits(1))
                        await pause(ctx, rng.randrange(1, 12))
                    ctx.set(bench.dut.rx, 1)
                    await pause(ctx, 10 * DIVISOR)
            wanted = model.update(np.array([record]))[0][0].tolist()
            assert await bench.ask(ctx, Kind.RECORD, record) == wanted
        assert await bench.answer(ctx, limit=3000) is None

    bench.run(test)
