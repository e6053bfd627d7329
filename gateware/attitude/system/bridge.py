"""The host's serial line: register accesses, and data pushed to the host."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.boards.frames import Kind
from boresight.gateware.boards.pack import Framer, Packer, body_layout
from boresight.gateware.boards.uart import Receiver, Transmitter, divisor_for
from boresight.gateware.boards.unpack import Dispatcher, Unpacker
from boresight.gateware.bus.core_registers import BusSignature


class Bridge(wiring.Component):
    r"""READ and WRITE frames to the register bus; replies and pushed bodies to the host.

    ::

        rx -> Receiver -> Unpacker -> Dispatcher -> bus
                                          | answers
                                        Packer -\
                                              i --> Framer -> Transmitter -> tx

    `gateware.boards.frames` defines the frames. Replies and pushed bodies
    alternate as complete units. No sequence of bytes stops the bridge.

    **Latency** 9 cycles from the end of a frame's last byte to the begin of its answer for a
    register that does not wait, while nothing is being pushed.
    """

    #: Bits of ``events``: a byte without stop bit; a frame damaged, unknown or one too many.
    EVENTS = ("line_error", "bad_frame")

    def __init__(self, *, clock_hz: float, baud: float = 921_600, read_cycles: int = 1) -> None:
        self.divisor = divisor_for(clock_hz=clock_hz, baud=baud)
        self.baud = baud
        self.read_cycles = read_cycles
        super().__init__(
            {
                "rx": In(1, init=1),
                "tx": Out(1, init=1),
                # An initiator of `gateware.attitude.bus.wishbone.BusArbiter`.
                "bus": Out(BusSignature(word=32, address=12)),
                "request": Out(1),
                "grant": In(1, init=1),
                "i": In(stream.Signature(body_layout)),  # bodies to push
                "events": Out(len(self.EVENTS)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Connect the parts; arbitrate between replies and pushed bodies."""
        m = Module()
        m.submodules.receiver = receiver = Receiver(divisor=self.divisor)
        m.submodules.unpacker = unpacker = Unpacker(word=32, lengths={Kind.WRITE: 2, Kind.READ: 1})
        m.submodules.dispatcher = dispatcher = Dispatcher(
            word=32, inputs=0, depth=unpacker.depth, address=12, read_cycles=self.read_cycles
        )
        m.submodules.packer = packer = Packer(word=32, records=False)
        m.submodules.framer = framer = Framer()
        m.submodules.transmitter = transmitter = Transmitter(divisor=self.divisor)
        wiring.connect(m, wiring.flipped(self.bus), dispatcher.bus)
        wiring.connect(m, dispatcher.o_reply, packer.i_reply)
        wiring.connect(m, framer.o, transmitter.i)
        m.d.comb += [
            receiver.rx.eq(self.rx),
            *dispatcher.fed_by(unpacker, receiver),
            self.request.eq(dispatcher.request),
            dispatcher.grant.eq(self.grant),
            self.tx.eq(transmitter.tx),
            self.events.eq(Cat(receiver.error, unpacker.dropped)),
        ]

        # One of the two has the framer until its last byte.
        push = Signal()
        within = Signal()
        offered = Mux(push, self.i.valid, packer.o.valid)
        payload = Signal(body_layout)
        full = Signal()  # a byte is on its way to the framer
        m.d.comb += [
            payload.eq(Mux(push, self.i.payload.as_value(), packer.o.payload.as_value())),
            self.i.ready.eq(~full & push),
            packer.o.ready.eq(~full & ~push),
            framer.i.valid.eq(full),
        ]
        with m.If(full):
            m.d.sync += full.eq(~framer.i.ready)
        with m.Elif(offered):
            m.d.sync += [full.eq(1), within.eq(~payload.last)]
            with m.If(payload.last):
                m.d.sync += push.eq(~push)
        with m.Elif(~within):
            m.d.sync += push.eq(~push)
        with m.If(~full):
            m.d.sync += framer.i.payload.eq(payload)
        return m
