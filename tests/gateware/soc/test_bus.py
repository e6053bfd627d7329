"""The processor's bus: its members, its widths."""

import pytest
from amaranth.lib.wiring import In, Out

from boresight.gateware.soc.bus import BURST, ProcessorBus


def test_members_as_the_processor_sees_them() -> None:
    members = ProcessorBus(addr_width=14).members
    assert {name: (member.flow, member.shape) for name, member in members.items()} == {
        "adr": (Out, 14),
        "dat_w": (Out, 32),
        "dat_r": (In, 32),
        "sel": (Out, 4),
        **{name: (Out, 1) for name in ("cyc", "stb", "we")},
        "cti": (Out, 3),
        "ack": (In, 1),
    }
    assert ProcessorBus().members["adr"].shape == 30
    assert BURST == 0b010  # Wishbone B4: incrementing burst


@pytest.mark.parametrize("width", [0, 31])
def test_address_bits(width: int) -> None:
    assert ProcessorBus(addr_width=1).members["adr"].shape == 1
    with pytest.raises(ValueError, match=f"^addr_width must be 1 to 30, not {width}$"):
        ProcessorBus(addr_width=width)
