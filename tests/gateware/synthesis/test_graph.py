"""The timing graph: order, loops, what starts and what ends a path."""

import pytest

from boresight.gateware.synthesis.celltypes import UnknownCell
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import NetlistError
from boresight.gateware.synthesis.timing import analyse


def test_order_puts_sources_first(tiny):
    tiny.ff("in", "q").lut("c", "b", "a").lut("b", "a").lut("a", "q").ff("c", "z")
    graph = build_graph(tiny.netlist())
    place = {node: k for k, node in enumerate(graph.order)}
    assert len(place) == len(graph.incoming)
    assert all(place[e.source] < place[e.target] for edges in graph.incoming for e in edges)


def test_deep_chain_needs_no_recursion(tiny):
    tiny.ff("in", "n0")
    for k in range(5000):
        tiny.lut(f"n{k + 1}", f"n{k}")
    tiny.ff("n5000", "z")
    expected = 0.525 + 5000 * (0.553 + 0.259) + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_combinational_loop(tiny):
    tiny.ff("in", "q").lut("a", "q", "c").lut("b", "a").lut("c", "b").ff("c", "z")
    with pytest.raises(
        NetlistError,
        match=r"^netlist must have no combinational loop, not one through "
        r"(lut_[abc] -> ){3}lut_[abc]$",
    ):
        build_graph(tiny.netlist())


def test_loop_names_only_the_loop(tiny):
    tiny.lut("a", "a", "in").lut("b", "a").lut("c", "b")
    with pytest.raises(NetlistError, match=r"through lut_a -> lut_a$"):
        build_graph(tiny.netlist())


def test_ring_of_inverters(tiny):
    tiny.add("INV", "i", I="b", O="a").add("INV", "j", I="a", O="b").lut("y", "a")
    with pytest.raises(NetlistError, match=r"^netlist must have no combinational loop, not one"):
        build_graph(tiny.netlist())


def test_loop_through_a_register_is_fine(tiny):
    tiny.lut("d", "q").ff("d", "q")
    assert analyse(tiny.netlist()).worst.end == "q.Q"


def test_ports_and_clock_cells_start_no_path(tiny):
    tiny.add("BUFG", "b", I="port", O="clk").add("IBUF", "i", I="pad", O="in").lut("y", "in", "clk")
    tiny.ff("y", "z")
    assert [g.name for g in analyse(tiny.netlist()).groups] == ["BUFG period"]


def test_paths_to_ports_are_not_counted(tiny):
    tiny.ff("in", "q").lut("y", "q").leave("y")
    assert analyse(tiny.netlist()).worst is None


def test_clocks_are_named(tiny):
    tiny.ff("a", "q").add("FDRE", "u", C="clk2", D="q", Q="r")
    tiny.add("DSP48A1", "d", C=["r"], CLK="clk")
    assert build_graph(tiny.netlist()).clocks == ("clk", "clk2")


def test_unknown_cell(tiny):
    with pytest.raises(
        UnknownCell,
        match=r"^cell type must be a Spartan-6 primitive with timing data, not 'MUXCY' \(cell m\)$",
    ):
        build_graph(tiny.add("MUXCY", "m").netlist())
