"""Block RAM and clock limits, sums by hand from the -2 median table."""

import pytest

from boresight.gateware.synthesis.delays import Delay, delay_table
from boresight.gateware.synthesis.timing import analyse


def group(tiny, name):
    """Return the longest delay among the endpoints of one kind."""
    return next(g.worst_ns for g in analyse(tiny.netlist()).groups if g.name == name)


@pytest.mark.parametrize(
    ("port", "params", "out"),
    [
        ("DOA", {}, 2.10),
        ("DOPB", {}, 2.10),
        ("DOB", {"DOB_REG": "1"}, 1.75),
        ("DOB", {"DOA_REG": "1"}, 2.10),
        ("DOPA", {"DOA_REG": 1}, 1.75),
    ],
)
def test_clock_to_output(tiny, port, params, out):
    tiny.add("RAMB16BWER", "r", params, CLKA="clk", **{port: ["0", "y"]}).ff("y", "z")
    assert group(tiny, "FDRE.D") == pytest.approx(out + 0.553 + 0.114 + 0.135)


def test_half_size_port_names(tiny):
    tiny.add("RAMB8BWER", "r", {"DOA_REG": "1"}, DOADO=["y"]).ff("y", "z")
    assert group(tiny, "FDRE.D") == pytest.approx(1.75 + 0.553 + 0.114 + 0.135)


@pytest.mark.parametrize("pin", ["ADDRA", "ADDRB", "DIA", "DIPB", "WEA", "ENB", "REGCEA", "RSTB"])
def test_setup(tiny, pin):
    tiny.ff("in", "q").add("RAMB16BWER", "r", CLKA="clk", **{pin: ["0", "q"]})
    assert group(tiny, f"RAMB16BWER.{pin}") == pytest.approx(0.525 + 0.553 + 0.40 + 0.135)


def test_setup_of_address_and_data_are_separate_constants(tiny):
    tiny.ff("in", "q").add("RAMB16BWER", "r", ADDRA=["q"], DIA=["q"])
    table = delay_table(grade=2, nets="median").replaced(ramb_setup=Delay(0.7, "what if"))
    got = {g.name: g.worst_ns for g in analyse(tiny.netlist(), table=table).groups}
    assert got["RAMB16BWER.ADDRA"] == pytest.approx(0.525 + 0.855 + 0.40 + 0.135)
    assert got["RAMB16BWER.DIA"] == pytest.approx(0.525 + 0.855 + 0.70 + 0.135)


def test_clock_pins_are_no_endpoints(tiny):
    tiny.ff("in", "q").add("RAMB16BWER", "r", CLKA="q", CLKB="q")
    assert [g.name for g in analyse(tiny.netlist()).groups] == ["RAMB16BWER period"]


@pytest.mark.parametrize(
    ("type_", "grade", "mhz"),
    [
        ("RAMB16BWER", 2, 280.1),
        ("RAMB16BWER", 3, 320.1),
        ("RAMB8BWER", 2, 280.1),
        ("BUFG", 2, 375.0),
        ("BUFG", 3, 400.0),
    ],
)
def test_minimum_period_limits_the_clock(tiny, type_, grade, mhz):
    """1000 / 3.570 and 1000 / 3.124 MHz, rounded down; no clock uncertainty on top."""
    timing = analyse(tiny.add(type_, "u").netlist(), grade=grade)
    assert timing.fmax_mhz == pytest.approx(mhz)
    assert timing.worst.group == f"{type_} period"
