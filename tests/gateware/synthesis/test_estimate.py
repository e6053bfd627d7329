"""Small Verilog designs through the real synthesiser, against areas and sums by hand."""

import json

import pytest

from boresight.gateware.synthesis import estimate as module
from boresight.gateware.synthesis.celltypes import UnknownCell
from boresight.gateware.synthesis.estimate import estimate
from boresight.gateware.synthesis.netlist import NetlistError
from boresight.gateware.synthesis.yosys import Synthesis

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
