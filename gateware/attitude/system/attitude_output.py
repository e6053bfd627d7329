"""The host's serial line: register accesses, and frames of updates, as many as it can carry."""

from __future__ import annotations

from enum import IntEnum
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.system.csr import INDEX_BITS, ResultPort
from boresight.gateware.attitude.system.interface import Place
from boresight.gateware.boards.frames import Framer, Kind, Packer, body_layout
from boresight.gateware.boards.uart import Receiver, Transmitter, divisor_for
from boresight.gateware.boards.unpack import Dispatcher, Unpacker
from boresight.gateware.bus.core_registers import BusSignature


class _State(IntEnum):
    """States of a byte: address of the result, byte of the result, transmission."""

    IDLE, KIND, FETCH, LOAD, FORM, PUT = range(6)


class AttitudeOutput(wiring.Component):
    """Sends every n-th update, unless the one before is still being sent: then that is skipped.

    An update being sent is held by this reader of the results, so it does not change while the
    line needs it, and nothing ever waits for the line. A frame has 2 words, header and stamp, as
    many as the update has outputs, and with ``record`` six with the counts of the sensors
    (`gateware.attitude.system.interface`).

    **Latency** 1 cycle from ``updated`` to a frame's first byte; then 4 cycles per byte of a word,
    5 with ``read_cycles`` 2 (of the results), or what the line needs.
    """

    #: Meaning of the bits of ``events``: an update is sent; one that was due is not.
    EVENTS = ("attitude_sent", "attitude_skipped")

    def __init__(self, *, read_cycles: int = 1) -> None:
        self.read_cycles = read_cycles
        super().__init__(
            {
                "updated": In(1),  # a new update is complete; with it the next three are taken
                "last_output": In(4),  # number of its last output word
                "on": In(1),  # updates are sent
                "record": In(1),  # ... in frames of kind SENSED
                "divider": In(10),  # from the next update sent on; 0 counts as 1
                "flags": In(8),  # upper byte of the header, taken with the update
                "port": Out(ResultPort()),
                "o": Out(stream.Signature(body_layout)),  # bodies of frames
                "events": Out(len(self.EVENTS)),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Start of a transmission; place in the frame, byte within word of the results; its byte.

        Of the counts the highest three bytes are sent, of the numbers of a line two.
        """
        m = Module()
        state = Signal(_State)
        place = Signal(2 + INDEX_BITS)
        code = Signal.like(place)
        byte = Signal(8)
        last = Signal(4)
        record = Signal()
        ends = Signal()
        start, flags = self._begin(m, last, record, (state == _State.PUT) & self.o.ready & ends)

        value = self.port.value
        of_outputs = Signal()  # the last byte of the outputs
        # Header and stamp, outputs, counts: regions 0, 1, 3 of 16 places each.
        region, index, part = place[-2:], place[2:6], place[:2]
        of_counts, of_line, ends_word = region[1], index[3], part.all()
        unused = of_counts & ((part == 0) | (of_line & ~part[1]) | (~of_line & index[1:3].all()))
        leap = of_outputs | (~region.any() & index[0] & ends_word)
        following = Mux(leap, Cat(Const(0, 6), 1, region[0]), place + 1)
        m.d.comb += [
            self.port.index.eq(place[2:]),
            of_outputs.eq(place == Cat(Const(3, 2), last, Const(Place.OUTPUTS >> 4, 2))),
        ]
        m.d.sync += [
            code.eq(place),
            ends.eq(Mux(record, of_counts & of_line & index[1] & ends_word, of_outputs)),
            byte.eq(value.word_select(code[:2], 8)),
        ]
        m.d.comb += self.o.valid.eq((state == _State.KIND) | (state == _State.PUT))

        with m.Switch(state):
            with m.Case(_State.IDLE):
                m.d.sync += [
                    place.eq(0),
                    self.o.payload.data.eq(Kind.ATTITUDE | self.record),
                    self.o.payload.last.eq(0),
                ]
                with m.If(start):
                    m.d.sync += state.eq(_State.KIND)
            with m.Case(_State.KIND), m.If(self.o.ready):
                m.d.sync += state.eq(_State.FETCH)
            with m.Case(_State.FETCH):
                if self.read_cycles == 1:
                    m.d.sync += state.eq(_State.LOAD)
                else:
                    again = Signal()
                    m.d.sync += again.eq(~again)
                    with m.If(again):
                        m.d.sync += state.eq(_State.LOAD)
            with m.Case(_State.LOAD):
                m.d.sync += state.eq(_State.FORM)
                with m.If(unused):
                    m.d.sync += [place.eq(following), state.eq(_State.FETCH)]
            with m.Case(_State.FORM):
                m.d.sync += [
                    # In place of the header's upper byte.
                    self.o.payload.data.eq(Mux(code == 3, flags, byte)),
                    self.o.payload.last.eq(ends),
                    state.eq(_State.PUT),
                ]
            with m.Case(_State.PUT), m.If(self.o.ready):
                m.d.sync += [place.eq(following), state.eq(Mux(ends, _State.IDLE, _State.FETCH))]
        return m

    def _begin(self, m: Module, last: Signal, record: Signal, done: Any) -> tuple[Signal, Signal]:
        """Select the updates to send, and store their data."""
        left = Signal(10)  # updates until the next one that is sent
        due = Signal()
        later = left[1:].any()
        idle = Signal(init=1)
        start = Signal()
        flags = Signal(8)
        m.d.comb += [
            due.eq(self.updated & self.on & ~later),
            start.eq(due & idle),
            self.port.take.eq(start),
            self.events.eq(Cat(start, due & ~idle)),
        ]
        with m.If(start):
            m.d.sync += idle.eq(0)
        with m.If(done):
            m.d.sync += idle.eq(1)
        with m.If(due):
            m.d.sync += left.eq(self.divider)
        with m.Elif(self.updated & later):
            m.d.sync += left.eq(left - 1)
        with m.If(idle):  # up to ``start``
            m.d.sync += [flags.eq(self.flags), last.eq(self.last_output), record.eq(self.record)]
        return start, flags


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
                "bus": Out(BusSignature(word=32, address=12)),
                "reads": Out(1),  # a word of the bus, in this cycle
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
            self.reads.eq(dispatcher.reads),
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
