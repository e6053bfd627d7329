"""Proof of the serial line from end to end: transmitter, wire, receiver."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Assert, Cat, Const, Elaboratable, Module, Mux, Signal

from boresight.gateware.boards.uart import Receiver, Transmitter
from boresight.sim.formal.blocks.uart import LineFrame
from boresight.sim.formal.harness import reached, unknown
from boresight.sim.formal.inside import Inside
from boresight.sim.formal.prove import Proof

__all__ = ["PROOFS", "Loop"]


class Loop(Elaboratable):
    """Every byte arrives once, unchanged, in order and in time, and no others.

    The statement is about a queue of the bytes under way, at most two. The rest is for induction:
    the frame on the line (`uart.LineFrame`), the reception from the start bit on, and the limits of
    their offset.

    Parameters
    ----------
    sender : Transmitter
        One side.
    receiver : Receiver
        The other; its bit time may differ within its `tolerance`.
    count : int, 1 or 2
        Bytes that arrive in the proof's cover.
    """

    def __init__(self, sender: Transmitter, receiver: Receiver, *, count: int = 2) -> None:
        self.count = count
        self.sender = sender
        self.receiver = receiver

    def elaborate(self, platform: Any) -> Module:
        """Queue, frame, reception."""
        m = Module()
        sender, receiver = self.sender, self.receiver
        m.submodules.sender = (sending := Inside(sender, platform)).module
        m.submodules.receiver = (receiving := Inside(receiver, platform)).module
        valid, payload = unknown(m, 1, "valid"), unknown(m, 8, "payload")
        m.d.comb += [
            sender.i.valid.eq(valid),
            sender.i.payload.eq(payload),
            receiver.rx.eq(sender.tx),
        ]
        self.take = valid & sender.i.ready
        self.payload = payload
        self.frame = LineFrame(m, divisor=sender.divisor, take=self.take, payload=payload)
        m.d.comb += self.frame.invariant(sender, sending)
        self._queue(m)
        self._reception(m, receiving)
        self._relations(m)
        return m

    def _queue(self, m: Module) -> None:
        """The statement."""
        receiver = self.receiver
        # The next start bit may begin while the receiver looks at a stop bit.
        self.waiting = Signal(2, name="waiting")
        self.newer, self.older = Signal(8, name="newer"), Signal(8, name="older")
        self.age = Signal(range(receiver.latency + 3))  # cycles since the older byte's start bit
        self.took = Signal.like(self.age)  # since the newer one's
        m.d.comb += [
            Assert(~receiver.error),
            Assert(~receiver.valid | ((self.waiting != 0) & (receiver.data == self.older))),
            Assert((self.waiting == 0) | (self.age <= receiver.latency)),
            Assert(~receiver.valid | (self.age > receiver.latency - receiver.spacing)),
            Assert(~self.take | (self.waiting < 2)),
        ]
        remaining = (self.waiting - receiver.valid)[:2]
        m.d.sync += [
            self.age.eq(self.age + 1),
            self.took.eq(self.took + 1),
            self.waiting.eq(remaining + self.take),
        ]
        with m.If(receiver.valid):
            m.d.sync += [self.older.eq(self.newer), self.age.eq(self.took + 1)]
        with m.If(self.take):
            m.d.sync += [self.newer.eq(self.payload), self.took.eq(0)]
            with m.If(remaining == 0):
                m.d.sync += [self.older.eq(self.payload), self.age.eq(0)]
        arrived = Signal(2, name="arrived")
        with m.If(receiver.valid):
            m.d.sync += arrived.eq(arrived + 1)
        m.d.comb += reached(m, receiver.valid & (arrived == self.count - 1), "bytes_arrived")

    def _reception(self, m: Module, inside: Inside) -> None:
        """State of the receiver, from the start bit on."""
        frame, divisor, middle = self.frame, self.receiver.divisor, self.receiver.to_middle
        length = 10 * self.sender.divisor
        busy, got = Signal(name="r_busy"), Signal(name="got")
        starting = Signal(name="r_starting")  # until the middle of the start bit
        number, phase = Signal(range(9), name="r_number"), Signal(range(divisor), name="r_phase")
        since = Signal(range(length + 10 * divisor), name="r_since")  # beginning of the frame
        ran = Signal(range(10 * divisor), name="r_ran")
        byte = Signal(8, name="r_byte")
        m.d.sync += [since.eq(since + 1), ran.eq(ran + 1)]
        with m.If(self.take):
            m.d.sync += got.eq(0)
        with m.If(busy):
            m.d.sync += phase.eq(phase + 1)
            with m.If(starting):
                m.d.sync += starting.eq(phase != middle - 1)
                with m.If(phase == middle - 1):
                    m.d.sync += phase.eq(0)
            with m.Elif(phase == divisor - 1):
                m.d.sync += [phase.eq(0), number.eq(number + 1)]
                with m.If(number == 8):
                    m.d.sync += busy.eq(0)
                    with m.If((since < length) & ~self.take):
                        m.d.sync += got.eq(1)
        begins = inside.state("IDLE") & inside["sample"] & ~inside["line"]
        with m.If(begins):
            m.d.sync += [
                busy.eq(1),
                starting.eq(1),
                number.eq(0),
                phase.eq(0),
                ran.eq(1),
                since.eq(frame.time + 1),
                byte.eq(frame.byte),
            ]

        timer, bits = inside["timer"], inside["bits"]
        m.d.comb += [
            Assert(inside["sample"] == (timer == 0)),
            Assert(inside.state("IDLE") == ~busy),
            Assert(inside.state("START") == (busy & starting)),
            Assert(inside.state("DATA") == (busy & ~starting)),
            Assert(busy | (timer == 0) | (timer > (1 << len(timer)) - self.receiver.spacing)),
            Assert(~(busy & starting) | (timer == (phase - (middle - 1))[: len(timer)])),
            Assert(~(busy & ~starting) | (timer == (phase - (divisor - 1))[: len(timer)])),
            Assert(
                ~(busy & ~starting) | (bits == (Cat(Const(1, 1), byte) << (8 - number)[:4])[:9])
            ),
            Assert(~busy | (phase < divisor) & (number < 9)),
            Assert(~(busy & starting) | ((phase < middle) & (number == 0))),
            Assert(~busy | (ran == 1 + phase + Mux(starting, 0, middle) + number * divisor)),
        ]
        self.begins, self.busy, self.got = begins, busy, got
        self.since, self.ran, self.byte = since, ran, byte

    def _relations(self, m: Module) -> None:
        """Relations of the reception to frame and queue: for induction."""
        receiver, frame = self.receiver, self.frame
        busy, got, since, ran, byte = self.busy, self.got, self.since, self.ran, self.byte
        length = 10 * self.sender.divisor
        earliest, latest = 2 + receiver.spacing, 1 + 2 * receiver.spacing
        current, unseen = busy & (since < length), Signal(name="unseen")
        m.d.comb += [
            unseen.eq(frame.busy & ~got & ~current),
            # Reception and frame.
            Assert(~self.begins | (unseen & (frame.time >= earliest) & (frame.time <= latest))),
            Assert(~busy | ((since >= ran + earliest) & (since <= ran + latest))),
            Assert(~current | (frame.busy & (since == frame.time) & (byte == frame.byte) & ~got)),
            Assert(~busy | current | ~frame.busy | (frame.time <= since - length)),
            Assert(~unseen | (frame.time <= latest)),
            Assert(~(frame.busy & got) | (frame.number == 9)),
            # Reception and queue.
            Assert(self.waiting == receiver.valid + busy + unseen),
            Assert(~(receiver.valid & busy)),
            Assert(~busy | ((self.older == byte) & (self.age == since))),
            Assert(
                busy
                | receiver.valid
                | ~unseen
                | ((self.older == frame.byte) & (self.age == frame.time))
            ),
            Assert(
                ~((busy | receiver.valid) & unseen)
                | ((self.newer == frame.byte) & (self.took == frame.time))
            ),
        ]


def _proof(sender: int, receiver: int, *, spacing: int, short: bool = False) -> Proof:
    # Three samples of the line must be within the cycles of the induction.
    count = 2 if sender < 10 else 1
    last = (10 * count + 1) * sender + 2 * spacing
    return Proof(
        name=f"uart.loop_{receiver}" + ("" if sender == receiver else f"_from_{sender}"),
        depth=4 * spacing,
        induction=4 * spacing,
        cover=range(last, last + 1),
        short=short,
        reset=False,
        claim=f"Transmitter with {sender} to Receiver with {receiver} cycles per bit, no reset: "
        "every byte arrives once, unchanged, in order, within `latency`; nothing else arrives and "
        "no error is shown",
        harness=lambda: Loop(Transmitter(divisor=sender), Receiver(divisor=receiver), count=count),
    )


PROOFS = (
    _proof(8, 8, spacing=1, short=True),
    _proof(9, 9, spacing=1),
    _proof(17, 17, spacing=2),
    _proof(24, 25, spacing=2),
    _proof(26, 25, spacing=2),
    _proof(109, 109, spacing=8),
)
