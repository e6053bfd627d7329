"""Reading yosys JSON."""

import pytest

from boresight.gateware.synthesis.netlist import Netlist, NetlistError, Pin


def test_drivers_loads_and_fanout(tiny):
    net = tiny.ff("a", "q").lut("y", "q", "q").ff("y", "z").leave("q").netlist()
    q = tiny.bit("q")
    assert net.top == "tiny"
    assert net.drivers[q] == Pin("q", "Q", 0)
    assert net.loads[q] == (Pin("lut_y", "I0", 0), Pin("lut_y", "I1", 0))
    assert net.fanout(q) == 3  # two pins and the port
    assert tiny.bit("a") not in net.drivers


def test_constants_are_no_nets(tiny):
    net = tiny.lut("y", "0", "1", "x").netlist()
    assert net.loads == {}
    assert net.cells["lut_y"].inputs["I2"] == ("x",)


def test_bookkeeping_cells_are_left_out(tiny):
    net = tiny.add("$scopeinfo", "scope").ff("a", "q").netlist()
    assert list(net.cells) == ["q"]


def test_parameters():
    raw = {
        "type": "T",
        "port_directions": {},
        "connections": {},
        "parameters": {"A": "00000000000000000000000000000011", "B": 5, "C": "1", "S": "SYNC "},
    }
    cell = Netlist.from_json({"modules": {"m": {"cells": {"c": raw}}}}).cells["c"]
    assert [cell.number(p, 7) for p in "ABCD"] == [3, 5, 1, 7]
    assert (cell.text("S", ""), cell.text("R", "ASYNC")) == ("SYNC", "ASYNC")
    with pytest.raises(NetlistError, match=r"^parameter S of cell c must be an integer, not 'SYNC"):
        cell.number("S", 0)
    with pytest.raises(NetlistError, match=r"^parameter B of cell c must be a string, not 5$"):
        cell.text("B", "")


def test_names_prefer_what_a_person_wrote():
    module = {
        "netnames": {
            "$auto$1": {"hide_name": 1, "bits": [2]},
            "top_sub_sum": {"hide_name": 0, "bits": [2, 3]},
            "sum": {"hide_name": 0, "bits": [2, "0"]},
        }
    }
    net = Netlist.from_json({"modules": {"m": module}})
    assert [net.name_of(b) for b in (2, 3, 4)] == ["sum[0]", "top_sub_sum[1]", "net#4"]


def test_source_skips_the_cell_library(tiny):
    net = (
        tiny.add("LUT1", "a", src="/share/xilinx/lut_map.v:1.1-2.2|top.v:4.5-4.9", I0="x", O="y")
        .add("LUT1", "b", src="/share/xilinx/lut_map.v:1.1-2.2", I0="x", O="z")
        .netlist()
    )
    assert (net.cells["a"].src, net.cells["b"].src) == ("top.v:4.5-4.9", "")


def test_two_drivers(tiny):
    net = tiny.lut("y", "a").add("LUT1", "other", I0="b", O="y").netlist()
    with pytest.raises(
        NetlistError, match=r"^net y must have one driver, not both lut_y\.O and other\.O$"
    ):
        _ = net.drivers


def test_messages():
    with pytest.raises(NetlistError, match=r"^netlist must have a non-empty 'modules' object$"):
        Netlist.from_json({})
    with pytest.raises(NetlistError, match=r"^netlist must mark one module as top, not 0$"):
        Netlist.from_json({"modules": {"a": {}, "b": {}}})
    with pytest.raises(NetlistError, match=r"^top must be a module of the netlist, not 'c'$"):
        Netlist.from_json({"modules": {"a": {}}}, top="c")
    cell = {"type": "LUT1", "connections": {"I0": [2]}, "port_directions": {}}
    with pytest.raises(
        NetlistError, match=r"^port I0 of cell u \(LUT1\) must have a direction, not None$"
    ):
        Netlist.from_json({"modules": {"a": {"cells": {"u": cell}}}})
