"""A core with AXI: `core_axi`, around the module `core`."""

from __future__ import annotations

from typing import Any

from amaranth.hdl import ClockDomain, ClockSignal, Instance, Module, ResetSignal, Shape
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Member, Out, Signature

from boresight.gateware.bus.axi_lite import AxiLiteSignature, AxiLiteSlave
from boresight.gateware.bus.axi_stream import AxiStreamSignature, StreamFromAxi, StreamToAxi

#: Bits of a core's word address.
_ADDRESS = 10


def _flat(prefix: str, signature: Signature) -> dict[str, Member]:
    """The members as separate ports; tools infer an interface from names like ``s_axis_tdata``."""
    return {f"{prefix}_{name}": member for name, member in signature.members.items()}


_MEMBERS = {
    **{"aclk": In(1), "aresetn": In(1)},  # The reset is synchronous, active low.
    **_flat("s_axis", AxiStreamSignature().flip()),  # Input records.
    **_flat("m_axis", AxiStreamSignature()),  # Output records.
    **_flat("s_axi", AxiLiteSignature(address=_ADDRESS + 2).flip()),  # Registers.
    "restart": In(1),  # This and the following are as those of the core.
    "saturated_update": Out(1),
    "beyond_update": Out(1),
}


class AxiCore(wiring.Component):
    """Records over AXI4-Stream, registers over AXI4-Lite, around the unchanged module ``core``.

    **Latency** two cycles more than the core's: one for each stream.

    Parameters
    ----------
    word : int
        W of the core.
    """

    def __init__(self, *, word: int) -> None:
        self.word = word
        super().__init__(_MEMBERS)

    def elaborate(self, platform: Any) -> Module:
        """The core between three adapters."""
        m = Module()
        m.domains.sync = ClockDomain()
        m.d.comb += [ClockSignal().eq(self.aclk), ResetSignal().eq(~self.aresetn)]
        m.submodules.records_in = records_in = StreamFromAxi(word=self.word)
        m.submodules.records_out = records_out = StreamToAxi(word=self.word)
        m.submodules.registers = slave = AxiLiteSlave(word=self.word, address=_ADDRESS)
        self._outside(m, "s_axis", records_in.axi)
        self._outside(m, "m_axis", records_out.axi)
        self._outside(m, "s_axi", slave.axi)
        m.submodules.core = Instance(
            "core",
            i_clk=ClockSignal(),
            i_rst=ResetSignal(),
            i_i__payload=records_in.o.payload,
            i_i__valid=records_in.o.valid,
            o_i__ready=records_in.o.ready,
            o_o__payload=records_out.i.payload,
            o_o__valid=records_out.i.valid,
            i_o__ready=records_out.i.ready,
            i_bus__addr=slave.bus.addr,
            i_bus__w_data=slave.bus.w_data,
            i_bus__w_stb=slave.bus.w_stb,
            o_bus__w_ack=slave.bus.w_ack,
            o_bus__r_data=slave.bus.r_data,
            i_restart=self.restart,
            o_saturated_update=self.saturated_update,
            o_beyond_update=self.beyond_update,
        )
        return m

    def _outside(self, m: Module, prefix: str, inner: Any) -> None:
        """Connect the ports with a prefix to an adapter's interface."""
        for name in inner.signature.members:
            outer = f"{prefix}_{name}"
            port, inside = getattr(self, outer), getattr(inner, name)
            is_input = self.signature.members[outer].flow == In
            m.d.comb += inside.eq(port) if is_input else port.eq(inside)


def axi_ports() -> tuple[tuple[str, str, int], ...]:
    """Direction, name and bits of every port of `AxiCore`, which is the module ``core_axi``."""
    return tuple(
        ("input" if member.flow == In else "output", name, Shape.cast(member.shape).width)
        for name, member in _MEMBERS.items()
    )
