"""Several initiators on one register bus."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.signature import BusSignature


class BusArbiter(wiring.Component):
    """Grants the bus to one initiator at a time, for one transfer, in turns.

    A transfer that has been granted is finished before another begins: a write with ``w_ack``, a
    read with the cycle of its grant (the word comes in the next one).

    **Latency** none for the last initiator, else 1 cycle.

    Parameters
    ----------
    count : int, >= 2
        Initiators.

    Members
    -------
    initiators : In(BusSignature(word=32, address=12)) array
        The initiators. ``r_data`` goes to all of them.
    request : In(count)
        Bit k: initiator k requests the bus; held, with its other signals, until the transfer's
        end. With ``w_stb`` it writes, else it reads.
    grant : Out(count)
        Bit k: initiator k has the bus in this cycle.
    bus : Out(BusSignature(word=32, address=12))
        The bus.
    read : Out(1)
        A read, in this cycle.
    """

    def __init__(self, *, count: int = 2) -> None:
        self.count = count
        signature = BusSignature(word=32, address=12)
        super().__init__(
            {
                "initiators": In(signature).array(count),
                "request": In(count),
                "grant": Out(count),
                "bus": Out(signature),
                "read": Out(1),
            }
        )

    def elaborate(self, platform: Any) -> Module:
        """An owner, which changes at the end of a transfer or without a request."""
        m = Module()
        owner = Signal(range(self.count))
        ended = Signal(init=1)
        with m.Switch(owner):
            for k, initiator in enumerate(self.initiators):
                # Also for the last one: unused numbers.
                with m.Case(k) if k < self.count - 1 else m.Default():
                    m.d.comb += [
                        self.bus.addr.eq(initiator.addr),
                        self.bus.w_data.eq(initiator.w_data),
                        self.bus.w_stb.eq(initiator.w_stb & self.request[k]),
                        self.read.eq(~initiator.w_stb & self.request[k]),
                        self.grant[k].eq(self.request[k]),
                        initiator.w_ack.eq(self.bus.w_ack & self.request[k]),
                        ended.eq(~self.request[k] | ~initiator.w_stb | self.bus.w_ack),
                    ]
        for k in range(self.count):
            m.d.comb += self.initiators[k].r_data.eq(self.bus.r_data)
            # The next requesting initiator, the owner last.
            with m.If(ended & (owner == k)):
                for after in reversed(range(1, self.count)):
                    with m.If(self.request[(k + after) % self.count]):
                        m.d.sync += owner.eq((k + after) % self.count)
        with m.If(owner >= self.count):
            m.d.sync += owner.eq(0)
        return m
