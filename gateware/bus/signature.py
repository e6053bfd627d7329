"""The register bus."""

from __future__ import annotations

from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class BusSignature(wiring.Signature):
    """A small synchronous register bus, as its initiator sees it.

    Parameters
    ----------
    address : int
        Bits of an address, A: 10 for a core.
    """

    def __init__(self, *, word: int, address: int = 10) -> None:
        super().__init__(
            {
                "addr": Out(address),  # Word address.
                "w_data": Out(word),  # Word to write.
                "w_stb": Out(1),  # Write; to be held with ``addr`` and ``w_data`` until ``w_ack``.
                "w_ack": In(1),  # The write is done with this cycle.
                "r_data": In(word),  # Word at the ``addr`` of the cycle before.
            }
        )
