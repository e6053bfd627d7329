"""The register bus: who drives what, and how wide it is."""

import pytest
from amaranth.lib.wiring import In, Out

from boresight.gateware.bus.signature import BusSignature


@pytest.mark.parametrize(("word", "address"), [(18, 10), (32, 12)])
def test_members_as_the_initiator_sees_them(word: int, address: int) -> None:
    members = BusSignature(word=word, address=address).members
    assert {name: (member.flow, member.shape) for name, member in members.items()} == {
        "addr": (Out, address),
        "w_data": (Out, word),
        "w_stb": (Out, 1),
        "w_ack": (In, 1),
        "r_data": (In, word),
    }


def test_a_core_has_ten_bits_of_address() -> None:
    assert BusSignature(word=32).members["addr"].shape == 10
