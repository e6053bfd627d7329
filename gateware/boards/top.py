"""A core with a serial line, for a clock and four pins."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.board import Line
from boresight.gateware.boards.frames import Framer, Kind, Packer, word_bytes
from boresight.gateware.boards.uart import Receiver, Transmitter, divisor_for
from boresight.gateware.boards.unpack import Dispatcher, Unpacker
from boresight.gateware.core import Core
from boresight.gateware.description import describe
from boresight.gateware.engine.engine import Engine
from boresight.gateware.registers import PROGRAM, STATUS
from boresight.model.errors import InputError


class Top(wiring.Component):
    """The engine with its programs, its streams and registers on a serial line.

    ::

                    frames          words, bus          words          frames
        rx -> Receiver -> Unpacker -> Dispatcher -> Engine -> Packer -> Framer -> Transmitter -> tx

    `gateware.boards.frames` describes the frames. No sequence of bytes stops it: only
    whole records of the right length reach the engine, and the transmitter always takes bytes.

    **Latency** that of the program (`Schedule.interval` cycles per update), which the times of the
    frames on the line exceed by far.

    The clock has at least 8 times `BAUD`. Raises InputError for programs with different numbers of
    inputs.
    """

    #: Bits per second.
    BAUD = 115_200
    #: Bits of the counter of updates whose highest one is the heartbeat.
    COUNTER = 6

    def __init__(self, *, core: Core, clock_hz: float) -> None:
        if len({len(part.program.inputs) for part in core.parts}) > 1:
            raise InputError.at(
                "programs",
                wanted="equally many inputs",
                found=", ".join(f"{len(p.program.inputs)} ({p.program.name})" for p in core.parts),
                fix="put them into cores of their own",
            )
        self.divisor = divisor_for(clock_hz=clock_hz, baud=self.BAUD)
        self.core = core
        self.clock_hz = clock_hz
        self.title = core.name
        to_board, from_board = (f"serial line {way} the board" for way in ("to", "from"))
        self.lines = (
            Line("rx", "host_rx", f"{to_board}: TXD of the adapter", input=True, pull_up=True),
            Line("tx", "host_tx", f"{from_board}: RXD of the adapter"),
            Line("heartbeat", "led0", f"LED: toggles every {2 ** (self.COUNTER - 1)} updates"),
            Line("saturated", "led1", "LED: a result of the last update was clamped"),
        )
        super().__init__(
            {"rx": In(1, init=1), "tx": Out(1, init=1), "heartbeat": Out(1), "saturated": Out(1)}
        )

    readme = "board_records"

    def facts(self) -> dict[str, Any]:
        core = describe(self.core)
        return {
            "core": core,
            "first": core.programs[0],
            "baud": self.BAUD,
            "choice": PROGRAM,
            "status": STATUS,
            "intervals": sorted({program.interval for program in core.programs}),
            "word_bytes": word_bytes(core.word),
            "programs": [
                ("number", "name", "cycles per update"),
                *((k, p.program, p.interval) for k, p in enumerate(core.programs)),
            ],
            "words": [
                [
                    ("", "name", "f", "unit", "range", "meaning"),
                    *(
                        ("in", w.name, w.frac, w.unit, f"{w.low:g} to {w.high:g}", w.meaning)
                        for w in program.inputs
                    ),
                    *(("out", w.name, w.frac, w.unit, "", "") for w in program.outputs),
                ]
                for program in core.programs
            ],
        }

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        word, inputs = self.core.machine.arithmetic.word, len(self.core.program.inputs)
        m.submodules.receiver = receiver = Receiver(divisor=self.divisor)
        m.submodules.unpacker = unpacker = Unpacker(
            word=word, lengths={Kind.RECORD: inputs, Kind.WRITE: 2, Kind.READ: 1}
        )
        m.submodules.dispatcher = dispatcher = Dispatcher(
            word=word, inputs=inputs, depth=unpacker.depth
        )
        m.submodules.engine = engine = Engine(machine=self.core.machine, image=self.core.image)
        m.submodules.packer = packer = Packer(word=word)
        m.submodules.framer = framer = Framer()
        m.submodules.transmitter = transmitter = Transmitter(divisor=self.divisor)

        wiring.connect(m, dispatcher.o, engine.i)
        wiring.connect(m, dispatcher.bus, engine.bus)
        wiring.connect(m, dispatcher.o_reply, packer.i_reply)
        wiring.connect(m, engine.o, packer.i)
        wiring.connect(m, packer.o, framer.i)
        wiring.connect(m, framer.o, transmitter.i)
        m.d.comb += [
            receiver.rx.eq(self.rx),
            *dispatcher.fed_by(unpacker, receiver),
            self.tx.eq(transmitter.tx),
            self.saturated.eq(engine.saturated_update),
        ]
        updates = Signal(self.COUNTER)
        m.d.comb += dispatcher.answered.eq(engine.o.valid & engine.o.ready & engine.o.payload.last)
        with m.If(dispatcher.answered):
            m.d.sync += updates.eq(updates + 1)
        m.d.comb += self.heartbeat.eq(updates[-1])
        return m


def records_design(core: Core) -> Callable[[int], Top]:
    """Return the design for `gateware.boards.board.write_project`: `Top` for a clock."""
    return lambda clock_hz: Top(core=core, clock_hz=clock_hz)
