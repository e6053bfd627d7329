"""Static timing: graph, arcs, routing."""

from itertools import product

import pytest

from boresight.gateware.synthesis.arcs import CellTiming
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import Cell, NetlistError, Pin
from boresight.gateware.synthesis.spartan6.celltypes import (
    BLOCK_RAMS,
    FLIP_FLOPS,
    LUTRAMS,
    LUTS,
    SHIFT_REGISTERS,
    UnknownCell,
)
from boresight.gateware.synthesis.spartan6.delays import Delay, delay_table
from boresight.gateware.synthesis.spartan6.dsp_arcs import dsp_timing
from boresight.gateware.synthesis.spartan6.primitives import cell_timing
from boresight.gateware.synthesis.spartan6.routing import Hop, route
from boresight.gateware.synthesis.timing import NOTE, analyse

# -- longest paths as they are reported -----------------------------------------------------------


@pytest.fixture
def two_paths(tiny):
    """q to z through a LUT, and q to w straight; q has two loads."""
    tiny.ff("in", "q").lut("y", "q", "in").ff("y", "z").ff("q", "w")
    return tiny.netlist()


def test_worst_path_step_by_step(two_paths):
    worst = analyse(two_paths).worst
    steps = [
        (p.cell, p.type, p.entry, p.exit, p.net, p.fanout, p.net_ns, p.cell_ns, p.total_ns)
        for p in worst.points
    ]
    assert steps == [
        ("q", "FDRE", "Q", "Q[0]", "", 0, 0.0, 0.525, 0.525),
        ("lut_y", "LUT2", "I0[0]", "O[0]", "q", 2, 0.855, 0.259, 1.639),
        ("z", "FDRE", "D[0]", "Q", "y", 1, 0.0, 0.114, 1.753),
        ("", "clock", "", "", "", 0, 0.0, 0.135, 1.888),
    ]
    assert (worst.start, worst.end, worst.group) == ("q.Q", "z.Q", "FDRE.D")
    assert (worst.logic_ns, worst.net_ns, worst.delay_ns) == (1.033, 0.855, 1.888)


def test_fmax_is_rounded_down(two_paths):
    assert analyse(two_paths).fmax_mhz == 529.6  # 1000 / 1.888 = 529.66


def test_every_point_adds_up_to_the_delay(two_paths):
    for nets in ("median", "p75"):
        worst = analyse(two_paths, nets=nets, grade=3).worst
        assert sum(p.net_ns + p.cell_ns for p in worst.points) == pytest.approx(worst.delay_ns)


def test_ends_are_sorted_and_cut(two_paths):
    ends = analyse(two_paths).ends
    assert [(p.end, p.slack_ns) for p in ends] == [("z.Q", 0.0), ("w.Q", 0.259)]
    assert [p.end for p in analyse(two_paths, top=1).ends] == ["z.Q"]


def test_slack_against_a_clock(two_paths):
    timing = analyse(two_paths, clock_mhz=500)
    assert timing.period_ns == 2.0
    assert [p.slack_ns for p in timing.ends] == [0.112, 0.371]
    assert analyse(two_paths, clock_mhz=1000).worst.slack_ns == -0.888


def test_groups(tiny):
    tiny.ff("in", "q").lut("y", "q").ff("y", "z").ff("in", "w", CE="q").ff("in", "v", CE="q")
    groups = {g.name: g for g in analyse(tiny.netlist()).groups}
    assert set(groups) == {"FDRE.D", "FDRE.CE"}
    assert (groups["FDRE.CE"].count, groups["FDRE.D"].count) == (2, 1)
    # .525 + .855 + .408 + .135 and .525 + .855 + .259 + .114 + .135
    assert groups["FDRE.CE"].worst_ns == pytest.approx(1.923)
    assert groups["FDRE.D"].histogram == {1: 1}


def test_four_corners_are_ordered(two_paths):
    graph = build_graph(two_paths)
    slow = {
        (g, n): analyse(graph, grade=g, nets=n).fmax_mhz for g in (2, 3) for n in ("median", "p75")
    }
    assert slow[2, "p75"] < slow[2, "median"] < slow[3, "median"]
    assert slow[2, "p75"] < slow[3, "p75"] < slow[3, "median"]


def test_guesses_on_the_path_are_listed(tiny):
    tiny.add("DSP48A1", "d", OPMODE=list("10000000"), P=["p"]).add("RAMB16BWER", "r", ADDRA=["p"])
    table = delay_table(grade=2, nets="median").replaced(
        ramb_period=Delay(0, "off"), dsp_abreg_mreg=Delay(0, "off"), dsp_mreg_preg=Delay(0, "off")
    )
    timing = analyse(tiny.netlist(), table=table)
    assert timing.worst.group == "RAMB16BWER.ADDRA"
    assert set(timing.guessed) == {"dsp_preg_p", "clock_uncertainty"}
    assert all(d.guessed for d in timing.guessed.values())


def test_observed_constants_are_not_listed(two_paths):
    assert set(analyse(two_paths).guessed) == {"clock_uncertainty"}


def test_path_inside_a_cell(tiny):
    worst = analyse(tiny.add("DSP48A1", "d", OPMODE=list("10000000"), P=["p"]).netlist()).worst
    assert (worst.start, worst.end, worst.group) == ("d.A1REG", "d.MREG", "DSP48A1 inside")
    assert [(p.entry, p.exit, p.total_ns) for p in worst.points] == [("A1REG", "MREG", 3.003)]


def test_made_up_cell_names_give_way_to_net_names(tiny):
    tiny.add("FDRE", "$auto$1", C="clk", D="in", Q="count").ff("count", "z")
    assert analyse(tiny.netlist()).worst.start == "count.Q"


def test_source_locations_are_kept(tiny):
    tiny.ff("in", "q").ff("q", "z", src="top.v:7.3-7.9")
    assert analyse(tiny.netlist()).worst.points[1].src == "top.v:7.3-7.9"


def test_nothing_to_time(tiny):
    timing = analyse(tiny.lut("y", "a").leave("y").netlist())
    assert (timing.worst, timing.fmax_mhz, timing.ends, timing.guessed) == (None, None, (), {})


def test_always_called_an_estimate(two_paths):
    timing = analyse(two_paths, grade=3, nets="p75")
    assert NOTE == "estimate, not ISE; sign-off needs trce"
    assert timing.source == (
        "static timing, grade -3, p75 nets: estimate, not ISE; sign-off needs trce, "
        "1 guessed constant on the worst path"
    )


def test_messages(two_paths):
    with pytest.raises(ValueError, match=r"^clock_mhz must be above 0, not 0$"):
        analyse(two_paths, clock_mhz=0)
    with pytest.raises(ValueError, match=r"^top must be at least 1, not 0$"):
        analyse(two_paths, top=0)
    with pytest.raises(ValueError, match=r"^grade must be 2 or 3, not 1$"):
        analyse(two_paths, grade=1)


# -- the timing graph: order, loops, what starts and what ends a path -----------------------------


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


# -- what cells say about timing uses only names that the delay tables have -----------------------

TABLE = delay_table(grade=2, nets="median")
REGISTERS = (
    "A0REG",
    "A1REG",
    "B0REG",
    "B1REG",
    "CREG",
    "DREG",
    "MREG",
    "PREG",
    "OPMODEREG",
    "CARRYINREG",
)


def names_in(timing: CellTiming) -> set[str]:
    records = [*timing.arcs, *timing.launches, *timing.setups, *timing.insides]
    return {key for record in records for key in record.keys}


def make(type_, params=None, inputs=None, outputs=None):
    wide = {p: tuple(range(100, 100 + n)) for p, n in (inputs or {}).items()}
    out = {p: tuple(range(500, 500 + n)) for p, n in (outputs or {}).items()}
    return Cell(name="u", type=type_, inputs=wide, outputs=out, params=params or {}, src="")


@pytest.mark.parametrize(
    "name",
    sorted(
        {
            *LUTS,
            *SHIFT_REGISTERS,
            *LUTRAMS,
            *BLOCK_RAMS,
            "INV",
            "CARRY4",
            "MUXF7",
            "MUXF8",
            "BUFG",
            *(f for f in FLIP_FLOPS if not f.endswith("_1")),
        }
    ),
)
def test_names_exist(name):
    pins = ("I0", "S", "A", "A0", "DPRA0", "ADDRA", "ADDRD", "D", "DIA", "WE", "CE", "CLKA")
    timing = cell_timing(
        make(name, inputs=dict.fromkeys(pins, 1), outputs={"O": 1, "Q": 1, "DOA": 1, "DPO": 1})
    )
    assert names_in(timing) <= set(TABLE)


@pytest.mark.parametrize("opmode", [None, "10010000", "10110000", "11110000", "00000000"])
def test_names_exist_for_every_choice_of_dsp_registers(opmode):
    inputs = {"A": 18, "B": 18, "C": 48, "D": 18, "PCIN": 48, "CARRYIN": 1, "OPMODE": 8}
    outputs = {"P": 48, "PCOUT": 48, "M": 36, "BCOUT": 18, "CARRYOUT": 1}
    seen = set()
    for values in product((0, 1), repeat=len(REGISTERS)):
        cell = make("DSP48A1", dict(zip(REGISTERS, values, strict=True)), inputs, outputs)
        if opmode is not None:
            cell.inputs["OPMODE"] = tuple(opmode)
            if opmode == "10010000" and not cell.params["PREG"]:
                continue  # an accumulator without a register is refused
        names = names_in(dsp_timing(cell))
        assert "" not in names
        seen |= names
    assert seen <= set(TABLE)
    if opmode is None:
        assert seen == {name for name in TABLE if name.startswith("dsp_")}, "a delay is never used"


# -- block RAM and clock limits, sums by hand from the -2 median table ----------------------------


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


# -- nets, wires inside a slice, dedicated cascades, and inverters --------------------------------


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
