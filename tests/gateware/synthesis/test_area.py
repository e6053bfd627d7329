"""Counting primitives."""

import pytest

from boresight.gateware.synthesis.area import count_area
from boresight.gateware.synthesis.celltypes import UnknownCell


def test_every_kind_once(tiny):
    for k, name in enumerate(
        [
            "LUT1",
            "LUT6",
            "LUT6_2",
            "INV",
            "SRLC32E",
            "RAM64X1S",
            "RAM32M",
            "RAM64M",
            "RAM32X1D",
            "RAM64X1D",
            "RAM128X1D",
            "FDRE",
            "FDCE",
            "LDCE",
            "CARRY4",
            "MUXF7",
            "MUXF8",
            "DSP48A1",
            "RAMB16BWER",
            "RAMB8BWER",
            "BUFG",
            "$scopeinfo",
        ]
    ):
        tiny.add(name, f"u{k}")
    area = count_area(tiny.netlist())
    assert (area.lut_logic, area.lut_inv, area.lut_srl) == (3, 1, 1)
    assert area.lut_ram == 1 + 4 + 4 + 2 + 2 + 4
    assert area.lut == 3 + 1 + 1 + 17
    assert (area.ff, area.carry4, area.muxf7, area.muxf8, area.dsp) == (3, 1, 1, 1, 1)
    assert (area.ramb16, area.ramb16_cells, area.ramb8_cells) == (1.5, 1, 1)
    assert area.special == {"BUFG": 1}
    assert area.cells["RAM32M"] == 1
    assert area.used() == {
        "lut": 22,
        "lut_ram": 18,
        "ff": 3,
        "carry4": 1,
        "dsp": 1,
        "ramb16": 1.5,
        "bufg": 1,
    }


def test_percent(tiny):
    for k in range(4):
        tiny.add("DSP48A1", f"dsp{k}")
    assert count_area(tiny.netlist()).percent()["dsp"] == 25.0


def test_overfull(tiny):
    for k in range(17):
        tiny.add("DSP48A1", f"dsp{k}")
    assert count_area(tiny.netlist()).overfull() == ("dsp",)


def test_route_through(tiny):
    """Inputs that only a LUT can feed: one from a flip-flop, one from a port, two have a LUT."""
    tiny.ff("d", "q").lut("s", "q").add("INV", "inv", I="q", O="n")
    tiny.add("CARRY4", "c", S=["q", "s", "n", "port"], DI=["q", "0", "0", "0"])
    tiny.add("MUXF7", "m", I0="s", I1="q", S="q", O="o")
    assert count_area(tiny.netlist()).route_through == 3  # c.S[0], c.S[3], m.I1


def test_unknown_cell(tiny):
    net = tiny.add("TRELLIS_FF", "u1").netlist()
    with pytest.raises(
        UnknownCell,
        match=r"^cell type must be a Spartan-6 primitive with area data, not 'TRELLIS_FF' "
        r"\(cell u1\)$",
    ):
        count_area(net)
