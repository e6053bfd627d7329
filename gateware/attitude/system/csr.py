"""Registers in hardware from their declaration, counters of events, and the memory of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from amaranth.hdl import Array, Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.registers import Access, BitField, Register

#: Bits of a bus word.
WORD = 32


def attributes(read_cycles: int) -> dict[str, Any]:
    """Attributes of a block RAM of the register bus.

    With two cycles to read, a register is behind it, and what is read in the cycle in which it is
    written does not count: so synthesis adds no logic between the two.
    """
    return {"ram_style": "block"} | ({"no_rw_check": 1} if read_cycles == 2 else {})


def packed(fields: Sequence[BitField], values: Mapping[str, Any], *, first: int = 0) -> Value:
    """Word, from bit ``first`` on, with these values in its fields and 0 between them."""
    parts: list[Any] = []
    end = first
    for field in sorted(fields, key=lambda field: field.bit):
        value = Value.cast(values[field.name])
        parts += [Const(0, field.bit - end), value, Const(0, field.width - len(value))]
        end = field.bit + field.width
    return Cat(part for part in parts if len(part))


class Csr(wiring.Component):
    """A block of registers.

    ============================ =======================================================
    access                       hardware
    ============================ =======================================================
    read-only with a ``reset``   a constant
    read-only without one        an input, ``name``: In(width)
    read-write                   an output with the written word, ``name``: Out(width)
    write-only                   an order: ``name``: Out(width), not 0 only in one cycle, and
                                 ``name_stb``: Out(1), 1 in that cycle
    ============================ =======================================================

    A memory holds the constants and copies of the written words, so that only inputs need a
    multiplexer. Writes of a number without a name are ignored if a register has ``names``. Like the
    memory, written registers are not changed by a reset of domain ``sync``.

    The registers are in the order of addresses, the first one's a multiple of the block's size.

    **Latency** ``read_cycles`` for reading; outputs change 1 cycle after the write. With
    ``read_cycles`` 2, registers are directly behind the memory, and no word is read in the cycle of
    its write.
    """

    def __init__(self, registers: Sequence[Register], *, read_cycles: int = 1) -> None:
        self.registers = tuple(registers)
        self.read_cycles = read_cycles
        self.first = registers[0].address
        span = max(r.address for r in registers) - self.first
        self.bits = max(1, span.bit_length())  # of an offset
        #: Members besides those of the bus.
        self.ports: dict[str, Any] = {}
        ports = self.ports
        for register in registers:
            width, reset = register.width or WORD, register.reset or 0
            if register.is_live:
                ports[register.name] = In(width)
            elif register.access is Access.READ_WRITE:
                ports[register.name] = Out(width, init=reset)
            elif register.access is Access.WRITE_ONLY:
                ports[register.name] = Out(width)
                ports[f"{register.name}_stb"] = Out(1)
        super().__init__(
            {
                # Address less that of the first register, with one bit more: with that bit, or if
                # no register is there, ``r_data`` is 0.
                "offset": In(self.bits + 1),
                "w_data": In(WORD),
                # Write, to the offset of the cycle before, whatever its highest bit.
                "w_en": In(1),
                "r_data": Out(WORD),  # of the ``offset`` ``read_cycles`` before
                "known": Out(1),  # such a register exists
                **ports,
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        marker = 1 << WORD  # an additional bit that marks existing registers
        depth = 2 << self.bits
        init = [0] * depth
        for register in self.registers:
            init[register.address - self.first] = marker | (register.reset or 0)
        m.submodules.memory = words = memory.Memory(
            shape=WORD + 1, depth=depth, init=init, attrs=attributes(self.read_cycles)
        )
        w_port = words.write_port()
        r_port = words.read_port()
        live = Signal(WORD)
        is_live = Signal()
        word, seen = r_port.data, live & is_live.replicate(WORD)
        if self.read_cycles == 2:
            word, here = Signal(WORD + 1, reset_less=True), seen
            seen = Signal(WORD)
            m.d.sync += [word.eq(r_port.data), seen.eq(here)]
        copy = Signal(WORD)
        low = self.offset[: self.bits]
        m.d.comb += [
            w_port.addr.eq(low),
            w_port.data.eq(copy | marker),
            r_port.addr.eq(self.offset),
            self.r_data.eq(word | seen),
            self.known.eq(word[WORD]),
        ]
        stored = {
            r.name: Signal(r.width or WORD, name=r.name, init=r.reset or 0, reset_less=True)
            for r in self.registers
            if r.access is Access.READ_WRITE
        }
        for name, value in stored.items():
            m.d.comb += getattr(self, name).eq(value)
        at_live = sum(1 << r.address - self.first for r in self.registers if r.is_live)
        m.d.sync += is_live.eq(Const(at_live, 2 << self.bits).bit_select(self.offset, 1))
        with m.Switch(low):
            for register in self.registers:
                if register.is_live:
                    with m.Case(register.address - self.first):
                        m.d.sync += live.eq(getattr(self, register.name))
        for register in self.registers:
            if register.access is Access.READ_ONLY:
                continue
            here = Signal(name=f"at_{register.name}")
            m.d.sync += here.eq(low == register.address - self.first)
            with m.If(here):
                if register.name in stored:
                    self._write(m, register, w_port.en, copy, stored[register.name])
                else:
                    with m.If(self.w_en):
                        m.d.comb += [
                            getattr(self, f"{register.name}_stb").eq(1),
                            getattr(self, register.name).eq(self.w_data),
                        ]
        return m

    def _write(
        self, m: Module, register: Register, enable: Signal, copy: Signal, stored: Signal
    ) -> None:
        legal = self.w_en
        if register.names and len(register.names) < 1 << len(stored):
            legal = legal & (self.w_data[: len(stored)] < len(register.names))
        m.d.comb += copy.eq(self.w_data[: len(stored)])
        with m.If(legal):
            m.d.comb += enable.eq(1)
            m.d.sync += stored.eq(self.w_data)


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


#: Bits of the index of a word within an update.
INDEX_BITS = 6


class ResultPort(wiring.Signature):
    """Port of a reader of the results.

    ``take``: read the newest complete update from the next cycle on; held high: always the newest.
    ``value`` is the word at the ``index`` of ``read_cycles`` before.
    """

    def __init__(self) -> None:
        super().__init__({"take": Out(1), "index": Out(INDEX_BITS), "value": In(32)})


class Results(wiring.Component):
    """Complete updates of up to 64 words, in banks.

    There is a bank for each of the two readers, one with the newest update and one to write: so an
    update that a reader has taken stays until that reader takes another, after any time, and the
    writer never waits. Each reader has a copy of the memory.

    **Latency** ``read_cycles`` for reading, with 2 through a register behind the memory; an update
    is the newest from the cycle after ``complete``.
    """

    def __init__(self, *, read_cycles: int = 1) -> None:
        self.read_cycles = read_cycles
        super().__init__(
            {
                # The update is complete with the word written in this cycle. Words written later,
                # but for the next cycle, in which none may be, are those of the next update.
                "complete": In(1),
                "w_en": In(1),
                "w_index": In(INDEX_BITS),
                "w_data": In(32),
                # Words not written by an update are those of an older one.
                "ports": In(ResultPort()).array(2),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        m = Module()
        write = Signal(2, init=1)
        newest = Signal(2)
        banks = [Signal(2, name=f"held{k}") for k in range(len(self.ports))]
        with m.If(write == newest):  # in the cycle after ``complete``
            m.d.sync += write.eq(_free(newest, *banks))
        with m.If(self.complete):
            m.d.sync += newest.eq(write)
        for k, (bank, port) in enumerate(zip(banks, self.ports, strict=True)):
            with m.If(port.take):
                m.d.sync += bank.eq(newest)
            m.submodules[f"copy{k}"] = words = memory.Memory(
                shape=32, depth=1 << (2 + INDEX_BITS), init=[], attrs={"ram_style": "block"}
            )
            w_port = words.write_port()
            r_port = words.read_port()
            m.d.comb += [
                w_port.addr.eq(Cat(self.w_index, write)),
                w_port.data.eq(self.w_data),
                w_port.en.eq(self.w_en),
                r_port.addr.eq(Cat(port.index, bank)),
            ]
            domain = m.d.sync if self.read_cycles == 2 else m.d.comb
            domain += port.value.eq(r_port.data)
        return m


def _free(*used: Value) -> Value:
    """The first bank that is not in ``used``."""
    choice: Value = Const(len(used))
    for k in reversed(range(len(used))):
        used_bank = Cat(bank == k for bank in used).any()
        choice = Mux(used_bank, choice, k)
    return choice
