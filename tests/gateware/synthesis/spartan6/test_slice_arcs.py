"""Slice primitives: each sum is worked out by hand from the -2 median table.

clock to Q .525, LUT .259, net of one load .553, of two .855, D setup .114, uncertainty .135.
"""

import pytest

from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import NetlistError
from boresight.gateware.synthesis.spartan6.delays import Delay, delay_table
from boresight.gateware.synthesis.timing import analyse

FAST = Delay(0.0, "out of the way")


def worst(tiny, **replaced):
    table = delay_table(grade=2, nets="median").replaced(**replaced)
    return analyse(tiny.netlist(), table=table).worst.delay_ns


def test_register_to_register(tiny):
    tiny.ff("in", "q").ff("q", "z")
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + 0.114 + 0.135)


@pytest.mark.parametrize(("pin", "setup"), [("D", 0.114), ("CE", 0.408), ("R", 0.470)])
def test_setups(tiny, pin, setup):
    tiny.ff("in", "q").ff(**{"d": "in", "q": "z", pin.replace("D", "d"): "q"})
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + setup + 0.135)


@pytest.mark.parametrize(("type_", "pin"), [("FDSE", "S"), ("FDCE", "CLR"), ("FDPE", "PRE")])
def test_set_and_clear(tiny, type_, pin):
    tiny.ff("in", "q").add(type_, "z", C="clk", D="in", Q="z", **{pin: "q"})
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + 0.470 + 0.135)


def test_two_luts(tiny):
    """The second LUT shares the slice of the flip-flop behind it."""
    tiny.ff("in", "q").lut("a", "q", "in").lut("b", "a", "in").ff("b", "z")
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + 0.259 + 0.553 + 0.259 + 0.114 + 0.135)


@pytest.mark.parametrize("pin", ["O5", "O6"])
def test_both_outputs_of_a_double_lut(tiny, pin):
    tiny.ff("in", "q").add("LUT6_2", "l", I0="q", **{pin: "y"}).ff("y", "z")
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + 0.259 + 0.114 + 0.135)


S_TO_O = {
    (0, 0): 0.197,
    (0, 1): 0.273,
    (0, 2): 0.398,
    (0, 3): 0.450,
    (1, 1): 0.185,
    (1, 2): 0.381,
    (1, 3): 0.420,
    (2, 2): 0.246,
    (2, 3): 0.330,
    (3, 3): 0.200,
}
S_TO_CO = (0.236, 0.224, 0.092, 0.084)
DI_TO_CO = (0.281, 0.197, 0.134, 0.121)
CI_TO_O = (0.220, 0.310, 0.302, 0.320)


def carry(tiny, *, port, entry, output, leave):
    """One path through a CARRY4, everything else constant."""
    four = lambda k, net: ["0"] * k + [net] + ["0"] * (3 - k)  # noqa: E731
    nets = {"S": ["0"] * 4, "DI": ["0"] * 4, "CI": "0", "CYINIT": "0"}
    tiny.ff("in", "q")
    if port == "S":
        tiny.lut("e", "q", "in")
    nets[port] = four(entry, "e" if port == "S" else "q") if port in ("S", "DI") else "q"
    tiny.add("CARRY4", "c", **nets, **{output: [f"y{i}" for i in range(4)]}).ff(f"y{leave}", "z")


@pytest.mark.parametrize(("k", "i"), S_TO_O)
def test_carry_select_to_sum(tiny, k, i):
    carry(tiny, port="S", entry=k, output="O", leave=i)
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + 0.259 + S_TO_O[k, i] + 0.114 + 0.135)


@pytest.mark.parametrize(("k", "i"), [ki for ki in S_TO_O if ki[0] < ki[1]])
def test_carry_data_to_sum(tiny, k, i):
    carry(tiny, port="DI", entry=k, output="O", leave=i)
    expected = 0.525 + 0.553 + S_TO_O[k, i] + 0.04 + 0.114 + 0.135
    assert worst(tiny) == pytest.approx(expected)


@pytest.mark.parametrize("k", range(4))
def test_carry_data_does_not_reach_its_own_sum_bit(tiny, k):
    carry(tiny, port="DI", entry=k, output="O", leave=k)
    assert analyse(tiny.netlist()).worst is None


@pytest.mark.parametrize("k", range(4))
@pytest.mark.parametrize("i", range(4))
@pytest.mark.parametrize(("port", "ns"), [("S", S_TO_CO), ("DI", DI_TO_CO)])
def test_carry_entry_to_carry_out(tiny, k, i, port, ns):
    """The carry leaves through the output multiplexer (.12) and then needs a net."""
    carry(tiny, port=port, entry=k, output="CO", leave=i)
    if k > i:
        assert analyse(tiny.netlist()).worst is None
        return
    lut = 0.259 if port == "S" else 0
    expected = 0.525 + 0.553 + lut + ns[k] + 0.12 + 0.553 + 0.114 + 0.135
    assert worst(tiny) == pytest.approx(expected)


@pytest.mark.parametrize("i", range(4))
@pytest.mark.parametrize(("port", "more"), [("CI", 0), ("CYINIT", 0.10)])
def test_carry_in_to_sum(tiny, i, port, more):
    carry(tiny, port=port, entry=0, output="O", leave=i)
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + CI_TO_O[i] + more + 0.114 + 0.135)


@pytest.mark.parametrize(("port", "more"), [("CI", 0), ("CYINIT", 0.10)])
@pytest.mark.parametrize(("i", "ns"), [(0, 0.220), (1, 0.310), (2, 0.302), (3, 0.093 + 0.12)])
def test_carry_in_to_carry_out(tiny, i, ns, port, more):
    carry(tiny, port=port, entry=0, output="CO", leave=i)
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + ns + more + 0.553 + 0.114 + 0.135)


def test_twelve_bit_chain(tiny):
    """LUT, S[0] to CO[3], across one CARRY4, out of the third at O[2]; carry nets .003."""
    tiny.ff("in", "q").lut("s", "q", "in")
    tiny.add("CARRY4", "c0", S=["s", "0", "0", "0"], CO=["x", "x", "x", "k0"])
    tiny.add("CARRY4", "c1", CI="k0", CO=["x", "x", "x", "k1"])
    tiny.add("CARRY4", "c2", CI="k1", O=["x", "x", "y", "x"]).ff("y", "z")
    expected = 0.525 + 0.553 + 0.259 + 0.236 + 0.003 + 0.093 + 0.003 + 0.302 + 0.114 + 0.135
    assert worst(tiny) == pytest.approx(expected)


def test_wide_multiplexers(tiny):
    tiny.ff("in", "q").lut("a", "q", "in")
    tiny.add("MUXF7", "m7", I0="a", I1="0", S="in", O="b")
    tiny.add("MUXF8", "m8", I0="0", I1="b", S="in", O="c").ff("c", "z")
    expected = 0.525 + 0.553 + 0.259 + 0.078 + 0.093 + 0.114 + 0.135
    assert worst(tiny) == pytest.approx(expected)


@pytest.mark.parametrize("type_", ["MUXF7", "MUXF8"])
def test_wide_multiplexer_select(tiny, type_):
    tiny.ff("in", "q").add(type_, "m", I0="0", I1="0", S="q", O="y").ff("y", "z")
    assert worst(tiny) == pytest.approx(0.525 + 0.553 + 0.22 + 0.114 + 0.135)


def srl(tiny, **pins):
    nets = {"A": ["0"] * 5, "CE": "1", "D": "in", "CLK": "clk", "Q": "y", **pins}
    tiny.ff("in", "q").add("SRLC32E", "s", **nets).ff("y", "z")


def test_shift_register_clock_to_output(tiny):
    srl(tiny)
    assert worst(tiny) == pytest.approx(1.47 + 0.553 + 0.114 + 0.135)


def test_shift_register_address(tiny):
    srl(tiny, A=["0", "q", "0", "0", "0"])
    expected = 0.525 + 0.553 + 0.259 + 0.553 + 0.114 + 0.135
    assert worst(tiny, srl_clk_q=FAST) == pytest.approx(expected)


@pytest.mark.parametrize("pin", ["D", "CE"])
def test_shift_register_setup(tiny, pin):
    srl(tiny, **{pin: "q"})
    assert worst(tiny, srl_clk_q=FAST) == pytest.approx(0.525 + 0.553 + 0.40 + 0.135)


def test_shift_register_with_single_address_pins(tiny):
    tiny.ff("in", "q").add("SRL16E", "s", A0="0", A3="q", D="in", CE="1", CLK="clk", Q="y")
    tiny.ff("y", "z")
    expected = 0.525 + 0.553 + 0.259 + 0.553 + 0.114 + 0.135
    assert worst(tiny, srl_clk_q=FAST) == pytest.approx(expected)


def lutram(tiny, type_, out, **pins):
    nets = {"WCLK": "clk", "WE": "in", **pins}
    tiny.ff("in", "q").add(type_, "r", **nets, **{out: "y"}).ff("y", "z")


READS = [
    ("RAM32M", "DOA", {"ADDRA": ["0", "q"]}),
    ("RAM32M", "DOD", {"ADDRD": ["q"]}),
    ("RAM64X1D", "DPO", {"DPRA5": "q"}),
    ("RAM64X1D", "SPO", {"A2": "q"}),
    ("RAM128X1D", "DPO", {"DPRA": ["q"]}),
    ("RAM64X1S", "O", {"A0": "q"}),
]


@pytest.mark.parametrize(("type_", "out", "pins"), READS)
def test_lutram_read(tiny, type_, out, pins):
    lutram(tiny, type_, out, **pins)
    expected = 0.525 + 0.553 + 0.259 + 0.553 + 0.114 + 0.135
    assert worst(tiny, lutram_clk_q=FAST) == pytest.approx(expected)


def test_lutram_clock_to_output(tiny):
    lutram(tiny, "RAM32M", "DOB")
    assert worst(tiny) == pytest.approx(1.20 + 0.553 + 0.114 + 0.135)


def test_lutram_ports_are_separate(tiny):
    """ADDRA does not reach DOB."""
    lutram(tiny, "RAM32M", "DOB", ADDRA=["q"])
    assert worst(tiny, lutram_clk_q=FAST) == pytest.approx(0.0 + 0.553 + 0.114 + 0.135)


WRITES = [
    ("RAM32M", {"DIA": ["q"]}),
    ("RAM32M", {"ADDRD": ["q"]}),
    ("RAM32M", {"WE": "q"}),
    ("RAM64X1D", {"D": "q"}),
    ("RAM64X1D", {"A5": "q"}),
    ("RAM128X1D", {"A": ["q"]}),
]


@pytest.mark.parametrize(("type_", "pins"), WRITES)
def test_lutram_write(tiny, type_, pins):
    out = "DOC" if type_ == "RAM32M" else "DPO"
    lutram(tiny, type_, out, **pins)
    assert worst(tiny, lutram_clk_q=FAST) == pytest.approx(0.525 + 0.553 + 0.40 + 0.135)


def test_latch_is_refused(tiny):
    with pytest.raises(
        NetlistError, match=r"^storage must be edge-triggered for timing, not a latch \(LDCE u\)$"
    ):
        build_graph(tiny.add("LDCE", "u", D="a", G="b", Q="q").netlist())


@pytest.mark.parametrize(
    ("type_", "params"),
    [
        ("FDRE_1", {}),
        ("FDRE", {"IS_C_INVERTED": "1"}),
        ("SRLC32E", {"IS_CLK_INVERTED": "1"}),
        ("RAM32M", {"IS_WCLK_INVERTED": 1}),
    ],
)
def test_falling_edge_is_refused(tiny, type_, params):
    with pytest.raises(
        NetlistError, match=rf"^clock edge must be rising for timing, not falling \({type_} u\)$"
    ):
        build_graph(tiny.add(type_, "u", params).netlist())
