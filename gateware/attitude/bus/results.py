"""Memory of results: one writer, and readers that never see a mixture of two updates."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

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

    There is a bank for each reader, one with the newest update and one to write: so an update that
    a reader has taken stays until that reader takes another, after any time, and the writer never
    waits. Each reader has a copy of the memory.

    **Latency** ``read_cycles`` for reading, with 2 through a register behind the memory; an update
    is the newest from the cycle after ``complete``.
    """

    def __init__(self, *, readers: int = 2, read_cycles: int = 1) -> None:
        self.readers = readers
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
                "ports": In(ResultPort()).array(readers),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """Banks and copies."""
        m = Module()
        bits = (self.readers + 1).bit_length()
        write = Signal(bits, init=1)
        newest = Signal(bits)
        banks = [Signal(bits, name=f"held{k}") for k in range(self.readers)]
        with m.If(write == newest):  # in the cycle after ``complete``
            m.d.sync += write.eq(_free(newest, *banks))
        with m.If(self.complete):
            m.d.sync += newest.eq(write)
        for k, (bank, port) in enumerate(zip(banks, self.ports, strict=True)):
            with m.If(port.take):
                m.d.sync += bank.eq(newest)
            m.submodules[f"copy{k}"] = words = memory.Memory(
                shape=32, depth=1 << (bits + INDEX_BITS), init=[], attrs={"ram_style": "block"}
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
