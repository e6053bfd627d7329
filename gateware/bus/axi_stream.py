"""AXI4-Stream on both sides of a core's records."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Cat, Module
from amaranth.lib import stream, wiring
from amaranth.lib.fifo import SyncFIFO
from amaranth.lib.wiring import In, Out

#: Bits of TDATA, for all word widths.
DATA = 32


class AxiStreamSignature(wiring.Signature):
    """AXI4-Stream (ARM IHI 0051A) as its transmitter sees it; a packet is a record.

    ``tdata`` has a word in the low bits, ``tlast`` marks the last word of a record.
    """

    def __init__(self) -> None:
        super().__init__({"tdata": Out(DATA), "tlast": Out(1), "tvalid": Out(1), "tready": In(1)})


def _words(word: int) -> stream.Signature:
    """A core's stream: the word, with ``last`` as the next higher bit."""
    return stream.Signature(word + 1)


class StreamFromAxi(wiring.Component):
    """Converts packets from AXI to records, with a buffer of two words.

    All outputs are registered: AXI permits no path from input to output, and the core's clock
    enable must not depend on signals of the interconnect.

    **Latency** 1 cycle; a word in each.

    Parameters
    ----------
    word : int
        W, 32 or fewer; upper bits of ``tdata`` are ignored.
    """

    def __init__(self, *, word: int) -> None:
        self.word = word
        super().__init__({"axi": In(AxiStreamSignature()), "o": Out(_words(word))})

    def elaborate(self, platform: Any) -> Module:
        """Two words of memory."""
        m = Module()
        axi = self.axi
        m.submodules.fifo = fifo = SyncFIFO(width=self.word + 1, depth=2)
        m.d.comb += [
            fifo.w_data.eq(Cat(axi.tdata[: self.word], axi.tlast)),
            fifo.w_en.eq(axi.tvalid),
            axi.tready.eq(fifo.w_rdy),
        ]
        wiring.connect(m, fifo.r_stream, wiring.flipped(self.o))
        return m


class StreamToAxi(wiring.Component):
    """Converts records to packets, with a buffer of two words.

    **Latency** 1 cycle; a word in each.

    Parameters
    ----------
    word : int
        W, 32 or fewer; in ``tdata`` its sign fills the bits above.
    """

    def __init__(self, *, word: int) -> None:
        self.word = word
        super().__init__({"i": In(_words(word)), "axi": Out(AxiStreamSignature())})

    def elaborate(self, platform: Any) -> Module:
        """Two words of memory."""
        m = Module()
        axi = self.axi
        m.submodules.fifo = fifo = SyncFIFO(width=self.word + 1, depth=2)
        wiring.connect(m, wiring.flipped(self.i), fifo.w_stream)
        m.d.comb += [
            axi.tdata.eq(fifo.r_data[: self.word].as_signed()),
            axi.tlast.eq(fifo.r_data[self.word]),
            axi.tvalid.eq(fifo.r_rdy),
            fifo.r_en.eq(axi.tready),
        ]
        return m
