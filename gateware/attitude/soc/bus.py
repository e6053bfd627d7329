"""The processor's bus: Wishbone with bytes and bursts."""

from __future__ import annotations

from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

#: ``cti`` of a word of a burst that is not the last: the next word follows, at the next address.
BURST = 2


class ProcessorBus(wiring.Signature):
    """Wishbone B4 with registered-feedback bursts, as the processor sees it.

    Members
    -------
    adr : Out(addr_width)
        Word address.
    dat_w : Out(32), dat_r : In(32)
        Written and read word.
    sel : Out(4)
        Bytes that are written.
    cyc, stb, we : Out(1)
        The processor's request; held until ``ack``.
    cti : Out(3)
        `BURST` if another word follows.
    ack : In(1)
        The word is taken or ``dat_r`` is there.

    Parameters
    ----------
    addr_width : int, 1 to 30
        Bits of the word address.
    """

    def __init__(self, *, addr_width: int = 30) -> None:
        if not 1 <= addr_width <= 30:
            raise ValueError(f"addr_width must be 1 to 30, not {addr_width!r}")
        super().__init__(
            {
                "adr": Out(addr_width),
                "dat_w": Out(32),
                "dat_r": In(32),
                "sel": Out(4),
                "cyc": Out(1),
                "stb": Out(1),
                "we": Out(1),
                "cti": Out(3),
                "ack": In(1),
            }
        )
