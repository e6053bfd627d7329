"""Counters of events: one adder and one memory for all of them."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Array, Cat, Module, Mux, Signal
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.attitude.bus.csr import attributes

#: Cycles of each counter's turn.
_SLOT = 4


class EventCounters(wiring.Component):
    """Counts one-cycle events of several kinds.

    Every event toggles a flip-flop of its kind. Each counter in turn has 4 cycles in which it is
    read from the memory together with the flip-flop's last state, and incremented if that has
    changed. So events of a kind are all counted if they are at least `interval` cycles apart; of
    more events in that time, pairs are lost. Kinds are independent of each other.

    Counters wrap. Like all memories, they keep their values in a reset of domain ``sync``.

    **Latency** an event is counted after at most `interval` + 4 cycles; reading takes
    ``read_cycles``: with 2, registers are directly behind the memory, as block RAM has them inside.
    """

    def __init__(self, *, count: int, bits: int = 32, read_cycles: int = 1) -> None:
        self.count = count
        self.bits = bits
        self.read_cycles = read_cycles
        self.index_bits = (count - 1).bit_length() + 1
        super().__init__(
            {
                "events": In(count),  # bit k: an event of kind k in this cycle
                # All counters to 0, one by one in their turns. An event that is counted in the very
                # turn makes it 1.
                "clear": In(1),
                # The counter to read, with one bit more than the kinds need; others read 0.
                "index": In(self.index_bits),
                "value": Out(bits),  # of the ``index`` ``read_cycles`` before
            }
        )

    @property
    def interval(self) -> int:
        """Minimum cycles between events of one kind for which all are counted."""
        return _SLOT << self.index_bits - 1

    def elaborate(self, platform: Any) -> Module:
        """A turn: read, compare the flip-flop with its last state, write."""
        m = Module()
        word = data.StructLayout({"value": self.bits, "seen": 1})
        m.submodules.memory = words = memory.Memory(
            shape=word, depth=1 << self.index_bits, init=[], attrs=attributes(self.read_cycles)
        )
        w_port = words.write_port()
        scan = words.read_port()
        read = words.read_port()

        turned = Signal(1 << self.index_bits - 1, reset_less=True)
        m.d.sync += turned.eq(turned ^ self.events)

        turn = Signal(self.index_bits - 1 + 2)
        number, step = turn[2:], turn[:2]
        now = Signal()
        clearing = Signal()
        left = Signal.like(turn)
        m.d.sync += [
            turn.eq(turn + 1),
            now.eq(Array(turned)[number] if self.count > 1 else turned[0]),
        ]
        with m.If(self.clear):
            m.d.sync += [clearing.eq(1), left.eq(turn)]
        with m.Elif(left == turn):
            m.d.sync += clearing.eq(0)
        old: Any = scan.data
        value: Any = read.data.value
        if self.read_cycles == 1:
            m.d.comb += scan.en.eq(step == 1)
        else:
            # Memory and register have one enable; what is being written is not read for counting.
            # The host may read it: then the counter as it was before is still behind this port.
            old = Signal(word, reset_less=True)
            value = Signal(self.bits, reset_less=True)
            clashed = Signal(2)
            m.d.comb += scan.en.eq(step != 3)
            with m.If(scan.en):
                m.d.sync += old.eq(scan.data)
            m.d.sync += [
                value.eq(read.data.value),
                clashed.eq(Cat(w_port.en & (self.index == number), clashed)),
            ]
            value = Mux(clashed[1], old.value, value)
        m.d.comb += [
            scan.addr.eq(number),
            w_port.addr.eq(number),
            w_port.en.eq(step == 3),
            w_port.data.seen.eq(now),
            w_port.data.value.eq(Mux(clearing, 0, old.value) + (now ^ old.seen)),
            read.addr.eq(self.index),
            self.value.eq(value),
        ]
        return m
