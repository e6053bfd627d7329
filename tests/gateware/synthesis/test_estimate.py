"""Estimates of area and clock."""

import json
from itertools import combinations

import pytest

from boresight.gateware.synthesis import estimate as module
from boresight.gateware.synthesis.estimate import estimate
from boresight.gateware.synthesis.graph import build_graph
from boresight.gateware.synthesis.netlist import NetlistError
from boresight.gateware.synthesis.spartan6 import celltypes as ct
from boresight.gateware.synthesis.spartan6.area import count_area
from boresight.gateware.synthesis.spartan6.celltypes import UnknownCell
from boresight.gateware.synthesis.spartan6.delays import (
    GRADES,
    NET_MODELS,
    Delay,
    delay_table,
    fanout_key,
)
from boresight.gateware.synthesis.spartan6.device import XC6SLX9
from boresight.gateware.synthesis.yosys import Synthesis

# -- small Verilog designs through the real synthesiser, against areas and sums by hand -----------

VERILOG = """
module adder(input clk, input [31:0] a, b, output reg [31:0] y);
    reg [31:0] ar, br;
    always @(posedge clk) begin ar <= a; br <= b; y <= ar + br; end
endmodule

module mac(input clk, rst, ce, input signed [17:0] a, b, output reg signed [47:0] p);
    reg signed [17:0] ar, br;
    reg signed [35:0] m;
    always @(posedge clk) begin
        ar <= a; br <= b; m <= ar * br;
        if (rst) p <= 0; else if (ce) p <= p + m;
    end
endmodule

module memory(input clk, we, input [8:0] ra, wa, input [31:0] d, output reg [31:0] q, output s);
    reg [31:0] data [0:511];
    reg [31:0] r;
    reg [8:0] rar;
    reg [19:0] shift;
    always @(posedge clk) begin
        rar <= ra;
        if (we) data[wa] <= d;
        r <= data[rar];
        q <= r ^ {r[0], r[31:1]};
        shift <= {shift[18:0], we};
    end
    assign s = shift[19];
endmodule

module negate(input clk, input [47:0] a, output reg [47:0] y);
    reg [47:0] ar;
    always @(posedge clk) begin ar <= a; y <= 48'd3 - ar; end
endmodule
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Estimate each design once."""
    cache = tmp_path_factory.mktemp("netlists")
    done = {}

    def get(top):
        if top not in done:
            done[top] = estimate(VERILOG, top, cache_dir=cache)
        return done[top]

    get.cache = cache
    return get


def test_adder(results):
    """Bit 0 enters by a LUT, ripples through 7 CARRY4 and leaves the eighth at O[3].

    The register of ``a`` feeds the LUT and DI: two loads.
    """
    got = results("adder")
    assert (got.area.lut, got.area.ff, got.area.carry4, got.area.dsp) == (32, 96, 8, 0)
    chain = 0.236 + 7 * 0.003 + 6 * 0.093 + 0.320
    expected = 0.525 + 0.855 + 0.259 + chain + 0.114 + 0.135
    assert got.corner().worst.delay_ns == pytest.approx(expected)
    assert got.corner().fmax_mhz == pytest.approx(1000 / expected, abs=0.1)
    worst = got.corner().worst
    assert (worst.start.split("[")[0], worst.end) in {("ar", "y[31].Q"), ("br", "y[31].Q")}
    assert worst.points[0].src.startswith("design.v:4")


def test_multiply_accumulate(results):
    """All in one DSP48A1; A1REG to MREG is the slowest of its stages."""
    got = results("mac")
    assert (got.area.dsp, got.area.lut, got.area.ff) == (1, 0, 0)
    assert got.corner().worst.delay_ns == pytest.approx(3.003)
    assert set(got.corner().guessed) == {"dsp_abreg_mreg"}
    assert [got.corner(grade=3, nets=n).fmax_mhz for n in ("median", "p75")] == [390.0, 390.0]
    assert any("guessed constants: dsp_abreg_mreg" in w for w in got.warnings)


def test_block_ram_and_shift_register(results):
    """Block RAM output to a LUT at the flip-flop; each output bit feeds two LUTs.

    The address register lies in front of the block RAM; the read register inside it is its own.
    """
    got = results("memory")
    assert (got.area.ramb16, got.area.ramb16_cells, got.area.ramb8_cells) == (1.0, 1, 0)
    assert (got.area.lut_srl, got.area.lut_logic) == (1, 32)
    groups = {g.name: g.worst_ns for g in got.corner().groups}
    read = next(p for p in got.corner().ends if p.group == "FDRE.D")
    assert read.delay_ns == pytest.approx(2.10 + 0.855 + 0.259 + 0.114 + 0.135)
    address = next(v for name, v in groups.items() if name.startswith("RAMB16BWER.ADDR"))
    assert address == pytest.approx(0.525 + 0.553 + 0.400 + 0.135)
    assert groups["RAMB16BWER period"] == pytest.approx(3.570)


def test_inverters_on_a_carry_chain(results):
    """3 - a is 3 + ~a + 1: one inverter per bit, each a LUT beside its carry bit."""
    got = results("negate")
    assert got.area.lut_inv > 40
    assert got.area.lut <= 49
    assert got.area.route_through == 0
    worst = got.corner().worst
    assert [p.type for p in worst.points[:2]] in (["FDRE", "INV"], ["FDRE", "LUT1"])
    assert worst.points[1].cell_ns == pytest.approx(0.259)
    assert worst.points[2].type == "CARRY4"
    assert worst.points[2].net_ns == 0.0


def test_four_corners(results):
    got = results("adder")
    assert [(t.grade, t.nets) for t in got.timing] == [
        (2, "median"),
        (2, "p75"),
        (3, "median"),
        (3, "p75"),
    ]
    with pytest.raises(ValueError, match=r"^corner must be grade 2 or 3, .*, not \(4, 'p75'\)$"):
        got.corner(grade=4, nets="p75")


def test_json(results):
    got = results("adder")
    data = json.loads(json.dumps(got.to_json(), allow_nan=False))
    assert data == got.to_json()  # only plain values
    for key, number in data["area"].items():
        assert number["available"] > 0, key
        assert number["source"].startswith("cells of the netlist by Yosys")
        assert "synth_xilinx -family xc6s -flatten -noiopad -top adder" in number["command"]
    assert data["area"]["lut"] == {**data["area"]["lut"], "value": 32, "percent": 0.56}
    for corner in data["timing"]:
        assert "not ISE; sign-off needs trce" in corner["fmax_mhz"]["source"]
        assert corner["worst"]["points"][-1]["total_ns"] == corner["worst"]["delay_ns"]
    assert data["warnings"][0] == "timing is an estimate, not ISE; sign-off needs trce"


def test_cache_is_used(results, monkeypatch):
    first = results("adder")
    monkeypatch.setattr("boresight.gateware.synthesis.yosys._run", None)  # would fail if it ran
    assert estimate(VERILOG, "adder", cache_dir=results.cache) == first


def test_slack_against_a_clock(results):
    results("adder")
    got = estimate(VERILOG, "adder", cache_dir=results.cache, clock_mhz=100)
    assert got.corner().period_ns == 10.0
    assert got.corner().worst.slack_ns == pytest.approx(10.0 - results("adder").corner().period_ns)


def given(monkeypatch, tiny):
    made = Synthesis(netlist=tiny.json(), version="Yosys 9.99", command="by hand", cached=False)
    monkeypatch.setattr(module, "synthesise", lambda *args, **kwargs: made)
    return lambda: estimate("", "tiny")


def test_warnings(monkeypatch, tiny):
    tiny.ff("a", "q").add("FDRE", "u", C="clk2", D="q", Q="r")
    for k in range(17):
        tiny.add("DSP48A1", f"d{k}", OPMODE=list("00000000"))
    assert given(monkeypatch, tiny)().warnings == (
        "timing is an estimate, not ISE; sign-off needs trce",
        "dsp: 17 needed, xc6slx9 has 16",
        "2 clocks (clk, clk2) are taken for one: paths between them are timed as if they met at "
        "every edge",
    )


def test_nothing_to_time(monkeypatch, tiny):
    got = given(monkeypatch, tiny.lut("y", "a").leave("y"))()
    assert got.warnings[-1] == "no path from register to register: nothing limits the clock"
    assert got.to_json()["timing"][0]["fmax_mhz"]["value"] is None
    assert got.to_json()["timing"][0]["worst"] is None


@pytest.mark.parametrize(("loads", "warned"), [(60, False), (61, True)])
def test_crowded_net_is_pointed_out(monkeypatch, tiny, loads, warned):
    tiny.ff("in", "enable")
    for k in range(loads):
        tiny.ff("in", f"q{k}", CE="enable")
    warnings = given(monkeypatch, tiny)().warnings
    text = "a worst path crosses net enable with 61 loads: "
    assert any(w.startswith(text) for w in warnings) is warned


def test_refusals_come_through(monkeypatch, tiny):
    with pytest.raises(UnknownCell, match="not 'PLLE2_BASE'"):
        given(monkeypatch, tiny.add("PLLE2_BASE", "p"))()
    del tiny.cells["p"]
    with pytest.raises(NetlistError, match="combinational loop"):
        given(monkeypatch, tiny.lut("y", "y"))()


# -- counting primitives --------------------------------------------------------------------------


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


# -- the sorts of primitives do not overlap, and each has both area and timing --------------------

SORTS = [
    ct.LUTS,
    ct.FLIP_FLOPS,
    ct.LATCHES,
    ct.SHIFT_REGISTERS,
    set(ct.LUTRAMS),
    set(ct.BLOCK_RAMS),
    ct.SPECIALS,
]
NO_TIMING = ct.LATCHES | {name for name in ct.FLIP_FLOPS if name.endswith("_1")}


def test_sorts_are_disjoint():
    assert all(not set(a) & set(b) for a, b in combinations(SORTS, 2))


@pytest.mark.parametrize("name", sorted(set().union(*SORTS)))
def test_every_type_is_counted_and_timed_or_refused(tiny, name):
    net = tiny.add(name, "u").netlist()
    assert count_area(net).cells == {name: 1}
    if name in NO_TIMING:
        with pytest.raises(NetlistError, match="for timing, not"):
            build_graph(net)
    else:
        build_graph(net)


def test_unknown_cell_message():
    error = ct.UnknownCell(cell="u1", type="EHXPLLL", use="area")
    assert str(error) == (
        "cell type must be a Spartan-6 primitive with area data, not 'EHXPLLL' (cell u1)"
    )


# -- the part: figures that other data sheets of the family confirm, and messages -----------------


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


def test_device_percent():
    assert XC6SLX9.percent("dsp", 4) == 25.0
    assert XC6SLX9.percent("ramb16", 0.5) == 1.56


def test_unknown_resource():
    with pytest.raises(ValueError, match=r"^resource must be one of bufg, .*, not 'luts'$"):
        XC6SLX9.capacity("luts")


# -- delay tables: every record has a source, guesses are marked, order is physical ---------------

CORNERS = [(g, n) for g in GRADES for n in NET_MODELS]


@pytest.mark.parametrize(("grade", "nets"), CORNERS)
def test_every_record_is_complete(grade, nets):
    table = delay_table(grade=grade, nets=nets)
    assert len(table) > 70
    for name, delay in table.items():
        assert 0 <= delay.ns < 5, name
        assert len(delay.source) > 20, name
        assert delay.guessed == ("guess" in delay.source), name


def test_same_names_in_all_tables():
    assert len({tuple(delay_table(grade=g, nets=n)) for g, n in CORNERS}) == 1


def test_all_dsp_delays_of_grade_2_are_guesses():
    table = delay_table(grade=2, nets="median")
    assert all(table[name].guessed for name in table if name.startswith("dsp_"))


def test_what_is_not_guessed_of_the_dsp_of_grade_3():
    table = delay_table(grade=3, nets="median")
    seen = {name for name in table if name.startswith("dsp_") and not table[name].guessed}
    assert seen == {"dsp_su_b0", "dsp_su_c", "dsp_ab_p", "dsp_pcin_p"}


@pytest.mark.parametrize(
    ("grade", "name", "guessed"),
    [
        (2, "ramb_clk_do", False),
        (3, "ramb_clk_do", True),
        (2, "carry_s0_o0", True),
        (2, "carry_s0_co", False),
        (3, "carry_s3_co", True),
        (2, "clock_uncertainty", True),
        (2, "ff_clk_q", False),
        (2, "lut", False),
        (3, "bufg_period", True),
    ],
)
def test_guess_marks(grade, name, guessed):
    assert delay_table(grade=grade, nets="median")[name].guessed is guessed


def test_observed_sums_come_out():
    """Differences of observed constants add up to them again: LUT to carry-out, LUT to D."""
    for grade, topcy, tas in (
        (2, (0.495, 0.483, 0.351, 0.343), 0.373),
        (3, (0.395, 0.375, 0.295), 0.341),
    ):
        table = delay_table(grade=grade, nets="median")
        for k, observed in enumerate(topcy):
            assert table.total(("lut", f"carry_s{k}_co")) == pytest.approx(observed, abs=1e-9)
        assert table.total(("lut", "ff_d_lut")) == pytest.approx(tas, abs=1e-9)


def test_grade_3_is_faster_in_nets_and_blocks():
    two, three = (delay_table(grade=g, nets="p75") for g in GRADES)
    for name in two:
        if name.startswith(("net_", "dsp_", "ramb_", "bufg")):
            assert three[name].ns <= two[name].ns, name


@pytest.mark.parametrize("nets", NET_MODELS)
def test_more_loads_never_make_a_net_faster(nets):
    table = delay_table(grade=2, nets=nets)
    times = [table[fanout_key(n)].ns for n in range(1, 40)]
    assert times == sorted(times)


def test_p75_is_slower_than_median():
    median, p75 = (delay_table(grade=2, nets=n) for n in NET_MODELS)
    assert all(median[fanout_key(n)].ns < p75[fanout_key(n)].ns for n in range(1, 40))


@pytest.mark.parametrize(
    ("fanout", "key"),
    [
        (1, "net_1"),
        (2, "net_2_3"),
        (3, "net_2_3"),
        (4, "net_4_8"),
        (8, "net_4_8"),
        (9, "net_9_20"),
        (20, "net_9_20"),
        (21, "net_21_up"),
        (5000, "net_21_up"),
    ],
)
def test_fanout_classes(fanout, key):
    assert fanout_key(fanout) == key


def test_net_statistics():
    table = delay_table(grade=2, nets="median")
    keys = ("net_1", "net_2_3", "net_4_8", "net_9_20", "net_21_up")
    assert [table[k].ns for k in keys] == [0.553, 0.855, 0.897, 1.10, 1.42]
    assert delay_table(grade=3, nets="median")["net_1"].ns == pytest.approx(0.553 * 0.88, abs=1e-3)


def test_replaced():
    table = delay_table(grade=2, nets="median")
    other = table.replaced(lut=Delay(1.0, "what if"))
    assert (other["lut"].ns, table["lut"].ns, other.grade, other.nets) == (1.0, 0.259, 2, "median")
    with pytest.raises(ValueError, match=r"^delay name must be one of the table's, not 'lutt'$"):
        table.replaced(lutt=Delay(1.0, "typo"))


def test_messages():
    with pytest.raises(ValueError, match=r"^grade must be 2 or 3, not 4$"):
        delay_table(grade=4, nets="median")
    with pytest.raises(ValueError, match=r"^nets must be 'median' or 'p75', not 'p90'$"):
        delay_table(grade=2, nets="p90")
    with pytest.raises(ValueError, match=r"^fanout must be at least 1, not 0$"):
        fanout_key(0)
