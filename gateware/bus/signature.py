"""The register bus."""

from __future__ import annotations

from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class BusSignature(wiring.Signature):
    """A small synchronous register bus, as its initiator sees it.

    Parameters
    ----------
    word : int
        Bits of a word, W.
    address : int
        Bits of an address, A: 10 for a core.

    Members
    -------
    addr : Out(A)
        Word address.
    w_data : Out(W)
        Word to write.
    w_stb : Out(1)
        Write; to be held with ``addr`` and ``w_data`` until ``w_ack``.
    w_ack : In(1)
        The write is done with this cycle.
    r_data : In(W)
        Word at the ``addr`` of the cycle before.
    """

    def __init__(self, *, word: int, address: int = 10) -> None:
        super().__init__(
            {
                "addr": Out(address),
                "w_data": Out(word),
                "w_stb": Out(1),
                "w_ack": In(1),
                "r_data": In(word),
            }
        )
