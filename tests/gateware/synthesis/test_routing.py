"""Nets, wires inside a slice, dedicated cascades, and inverters."""

import pytest

from boresight.gateware.synthesis.netlist import Pin
from boresight.gateware.synthesis.routing import Hop, route
from boresight.gateware.synthesis.timing import analyse


def hop(tiny, net, load, fanout=1):
    netlist = tiny.netlist()
    bit = tiny.bit(net)
    return route(netlist, bit, netlist.drivers[bit], Pin(*load), fanout=fanout)


@pytest.mark.parametrize(
    ("loads", "net_ns"),
    [(1, 0.553), (2, 0.855), (3, 0.855), (4, 0.897), (8, 0.897), (9, 1.10), (20, 1.10), (21, 1.42)],
)
def test_fanout_of_a_register(tiny, loads, net_ns):
    tiny.ff("in", "q")
    for k in range(loads):
        tiny.ff("q", f"z{k}")
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(0.525 + net_ns + 0.114 + 0.135)


def test_leaving_the_module_is_a_load(tiny):
    tiny.ff("in", "q").ff("q", "z").leave("q")
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(0.525 + 0.855 + 0.114 + 0.135)


def test_lut_beside_its_register(tiny):
    tiny.lut("y", "a").ff("y", "z")
    assert hop(tiny, "y", ("z", "D", 0)) == Hop("", in_slice=True)
    assert hop(tiny, "y", ("z", "D", 0), fanout=2) == Hop("net_2_3")


def test_lut_beside_its_register_has_its_own_setup_on_grade_3(tiny):
    """Clock to Q .447, net .487, LUT .261, D behind a LUT .080 (not .136), .135."""
    tiny.ff("in", "q").lut("y", "q").ff("y", "z")
    got = analyse(tiny.netlist(), grade=3).worst.delay_ns
    assert got == pytest.approx(0.447 + 0.487 + 0.261 + 0.080 + 0.135)


def test_lut_to_enable_is_routed(tiny):
    tiny.lut("y", "a").ff("b", "z", CE="y")
    assert hop(tiny, "y", ("z", "CE", 0)) == Hop("net_1")


def test_carry_chain_nets(tiny):
    tiny.add("CARRY4", "c", CO=["k0", "k1", "k2", "k3"], O=["s0", "s1", "s2", "s3"])
    tiny.add("CARRY4", "e", CI="k3", CYINIT="k3").ff("s0", "z")
    assert hop(tiny, "k3", ("e", "CI", 0)) == Hop("net_carry")
    assert hop(tiny, "k3", ("e", "CYINIT", 0)) == Hop("net_1", ("carry_exit",))
    assert hop(tiny, "k1", ("e", "CI", 0)) == Hop("net_1")  # CO[1] has left already
    assert hop(tiny, "s0", ("z", "D", 0)) == Hop("")
    assert hop(tiny, "s0", ("z", "D", 0), fanout=2) == Hop("net_2_3")


def test_carry_select_from_a_lut_is_free_even_if_the_lut_has_other_loads(tiny):
    tiny.lut("s", "a").add("CARRY4", "c", S=["s"], DI=["s"]).ff("s", "z")
    assert hop(tiny, "s", ("c", "S", 0), fanout=3) == Hop("")


def test_carry_select_fed_by_a_shared_lut(tiny):
    """One LUT cannot sit beside two carry bits: the others go through LUTs of their own."""
    tiny.lut("s", "a").add("CARRY4", "c", S=["s", "s"])
    assert hop(tiny, "s", ("c", "S", 0), fanout=2) == Hop("net_2_3", ("lut",))


def test_carry_select_from_a_register(tiny):
    tiny.ff("a", "q").add("CARRY4", "c", S=["q"], O=["y"]).ff("y", "z")
    assert hop(tiny, "q", ("c", "S", 0)) == Hop("net_1", ("lut",))
    expected = 0.525 + 0.553 + 0.259 + 0.197 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_carry_out_into_logic(tiny):
    """CO[3] pays the output multiplexer (.12) in front of a LUT as well."""
    tiny.ff("a", "q").add("CARRY4", "c", DI=["q"], CO=["x", "x", "x", "k"]).lut("y", "k")
    tiny.ff("y", "z")
    expected = 0.525 + 0.553 + 0.281 + 0.12 + 0.553 + 0.259 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_wide_multiplexer_inputs(tiny):
    tiny.lut("a", "x1").ff("b", "q").add("MUXF7", "m", I0="a", I1="q", S="a", O="y")
    tiny.add("MUXF8", "n", I0="y", I1="a", O="w")
    assert hop(tiny, "a", ("m", "I0", 0), fanout=3) == Hop("")
    assert hop(tiny, "q", ("m", "I1", 0)) == Hop("net_1", ("lut",))
    assert hop(tiny, "a", ("m", "S", 0), fanout=3) == Hop("net_2_3")
    assert hop(tiny, "y", ("n", "I0", 0)) == Hop("")
    assert hop(tiny, "a", ("n", "I1", 0), fanout=3) == Hop("net_2_3")


def test_dsp_cascades(tiny):
    tiny.add("DSP48A1", "d", PCOUT=["p"], P=["f"], BCOUT=["b"], CARRYOUT="c")
    tiny.add("DSP48A1", "e", PCIN=["p"], B=["b"], C=["f"], CARRYIN="c")
    assert hop(tiny, "p", ("e", "PCIN", 0)) == Hop("net_dsp")
    assert hop(tiny, "b", ("e", "B", 0)) == Hop("net_dsp")
    assert hop(tiny, "c", ("e", "CARRYIN", 0)) == Hop("net_dsp")
    assert hop(tiny, "f", ("e", "C", 0)) == Hop("net_1")


def test_inverter_in_front_of_a_lut_is_absorbed(tiny):
    tiny.ff("in", "q").add("INV", "i", I="q", O="n").lut("y", "n").ff("y", "z")
    expected = 0.525 + 0.553 + 0.259 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_inverter_in_front_of_a_carry_is_a_lut(tiny):
    tiny.ff("in", "q").add("INV", "i", I="q", O="n").add("CARRY4", "c", S=["n"], O=["y"])
    tiny.ff("y", "z")
    expected = 0.525 + 0.553 + 0.259 + 0.197 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_inverter_in_front_of_a_register_shares_its_slice(tiny):
    tiny.ff("in", "q").add("INV", "i", I="q", O="n").ff("n", "z")
    expected = 0.525 + 0.553 + 0.259 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_inverter_into_block_ram_is_routed_twice(tiny):
    tiny.ff("in", "q").add("INV", "i", I="q", O="n").add("RAMB16BWER", "r", DIA=["n"])
    worst = {g.name: g.worst_ns for g in analyse(tiny.netlist()).groups}
    expected = 0.525 + 0.553 + 0.259 + 0.553 + 0.40 + 0.135
    assert worst["RAMB16BWER.DIA"] == pytest.approx(expected)


def test_fanout_looks_through_an_absorbed_inverter(tiny):
    """q feeds one LUT directly and three behind an inverter: four loads, .897."""
    tiny.ff("in", "q").add("INV", "i", I="q", O="n").lut("y0", "q")
    for k in (1, 2, 3):
        tiny.lut(f"y{k}", "n")
    tiny.ff("y1", "z")
    expected = 0.525 + 0.897 + 0.259 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)


def test_fanout_of_an_inverter_that_stays(tiny):
    """n feeds a LUT (absorbed there) and a register: its own net has one load, q has two."""
    tiny.ff("in", "q").add("INV", "i", I="q", O="n").lut("y", "n").ff("n", "z")
    expected = 0.525 + 0.855 + 0.259 + 0.0 + 0.114 + 0.135
    assert analyse(tiny.netlist()).worst.delay_ns == pytest.approx(expected)
