"""Addresses that every core has; `tests/gateware/bus/test_core_registers.py` asks the hardware."""

import pytest

from boresight.gateware.registers.core import CHOICE, FIXED, PROGRAM, STATUS
from boresight.gateware.registers.model import Access


def test_places() -> None:
    names = {"status": 512, "updates": 513, "build_low": 514, "build_high": 515}
    assert {r.name: r.address for r in FIXED} == names
    assert PROGRAM == 516
    assert [r.name for r in FIXED if r.access is Access.READ_WRITE] == ["status"]


def test_bits_of_the_status() -> None:
    """What has happened is cleared by writing 1; what is, is only read."""
    assert [(f.name, f.bit, f.width, f.clear) for f in STATUS.fields] == [
        ("saturated", 0, 1, True),
        ("framing", 1, 1, True),
        ("idle", 2, 1, False),
        ("parity", 3, 1, False),
    ]
    assert STATUS.field("idle").of(0b0101) == 1 and STATUS.field("parity").of(0b0101) == 0
    with pytest.raises(KeyError):
        STATUS.field("busy")


def test_choice_of_the_program() -> None:
    assert (CHOICE.address, CHOICE.access) == (PROGRAM, Access.READ_WRITE)
