"""The part: figures that other data sheets of the family confirm, and messages."""

import pytest

from boresight.gateware.synthesis.device import XC6SLX9


def test_capacities():
    expected = {"lut": 5720, "ff": 11440, "dsp": 16, "ramb16": 32, "lut_ram": 1440, "carry4": 715}
    assert {key: XC6SLX9.capacity(key) for key in expected} == expected


def test_capacities_agree_with_the_slices():
    """1,430 slices of 4 LUTs and 8 flip-flops; half of them have a carry chain."""
    assert XC6SLX9.capacity("lut") == 1430 * 4
    assert XC6SLX9.capacity("ff") == 1430 * 8
    assert XC6SLX9.capacity("carry4") == 1430 // 2


def test_every_number_has_a_source():
    assert all(r.source and r.unit and r.count > 0 for r in XC6SLX9.resources.values())
    assert XC6SLX9.package_source


def test_percent():
    assert XC6SLX9.percent("dsp", 4) == 25.0
    assert XC6SLX9.percent("ramb16", 0.5) == 1.56


def test_unknown_resource():
    with pytest.raises(ValueError, match=r"^resource must be one of bufg, .*, not 'luts'$"):
        XC6SLX9.capacity("luts")


def test_ise_part():
    assert XC6SLX9.ise_part(package="tqg144", grade=2) == "xc6slx9-2-tqg144"
    with pytest.raises(ValueError, match=r"^package must be one of cpg196, .*, not 'bga1'$"):
        XC6SLX9.ise_part(package="bga1", grade=2)
    with pytest.raises(ValueError, match=r"^grade must be one of 2, 3, not 4$"):
        XC6SLX9.ise_part(package="tqg144", grade=4)
