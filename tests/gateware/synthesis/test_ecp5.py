"""Flip-flops that move into multipliers and memories: the netlist computes what its source does."""

import copy

import pytest

from boresight.gateware.engine.leading import LeadingSignCount
from boresight.gateware.synthesis.ecp5.family import ECP5
from boresight.gateware.synthesis.routed import netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.yosys import synthesise
from boresight.gateware.verilog import to_verilog
from boresight.model.words.fixed import Arithmetic
from tests.support.netlists import differences

#: Multiplier and memory with registers around them, as yosys leaves them.
DESIGN = """
module top(input clk, input [1:0] stop, input [8:0] at, input [8:0] to, input we, input [35:0] word,
           output reg [35:0] product, output [35:0] read);
    wire go = ~&stop;
    (* ram_style = "block" *) reg [35:0] memory [0:511];
    reg [35:0] out, behind;
    reg signed [17:0] a, b;
    always @(posedge clk) begin
        if (we) memory[to] <= word;
        if (go) begin
            out <= memory[at];
            behind <= out;
            a <= behind[17:0] ^ {18{at[0]}};
            b <= behind[35:18];
            product <= a * b;
        end
    end
    assign read = behind;
endmodule
"""

#: Not the word that is read.
BENCH = """
module bench (input clk, input rst);
    integer cycle = 0, differ = 0, changes = 0;
    reg [1:0] stop = 0;
    reg [8:0] at = 0, to = 1;
    reg we = 0;
    reg [35:0] word = 0, product, last;
    wire [71:0] x, y;
    source one (clk, stop, at, to, we, word, x[71:36], x[35:0]);
    top two (clk, stop, at, to, we, word, y[71:36], y[35:0]);
    always @(posedge clk) begin
        if (cycle > 200 && x !== y) differ <= differ + 1;
        last <= x[71:36];
        if (last != x[71:36]) changes <= changes + 1;
        cycle <= cycle + 1;
        {stop, we} <= $random;
        at <= cycle / 5 % 4;
        to <= (cycle / 5 + 1 + {$random} % 3) % 4;
        word <= {$random, $random};
        if (cycle == 20000) begin
            if (changes < 1000) $fatal(1, "nothing is computed");
            $display("differ %0d", differ);
            $finish;
        end
    end
endmodule
"""


@pytest.fixture(scope="module")
def netlists():
    """Before and after, and how many flip-flops moved."""
    command = ECP5.synthesis.replace("*operands*/m:*", "top/m:*")
    before = synthesise(DESIGN, top="top", command=command).netlist
    after = copy.deepcopy(before)
    return before, after, ECP5.absorb(after, "top")


def cells(netlist, kind):
    return [c for c in netlist["modules"]["top"]["cells"].values() if c["type"] == kind]


def test_every_register_is_used(netlists):
    before, after, moved = netlists
    (memory,), (multiplier,) = cells(after, "DP16KD"), cells(after, "MULT18X18D")
    assert memory["parameters"]["REGMODE_A"] == memory["parameters"]["REGMODE_B"] == "OUTREG"
    for register in ("INPUTA", "INPUTB", "OUTPUT"):
        assert multiplier["parameters"][f"REG_{register}_CLK"] == "CLK0"
    assert not cells(after, "TRELLIS_FF") and moved == len(cells(before, "TRELLIS_FF")) == 108
    enables = {str(memory["connections"][port]) for port in ("CEB", "OCEA", "OCEB")}
    assert enables == {str(multiplier["connections"]["CE0"])}


def test_it_computes_the_same(netlists):
    assert differences(BENCH, DESIGN, netlists[1], top="top", family="ecp5") == 0


@pytest.mark.parametrize(
    ("changed", "left"),
    [
        ({"REGSET": "SET"}, "starts at 1"),
        ({"CEMUX": "1 "}, "another enable"),
        ({"CLKMUX": "INV"}, "the falling edge"),
    ],
)
def test_a_register_that_differs_stays(netlists, changed, left):
    netlist = copy.deepcopy(netlists[0])
    module = netlist["modules"]["top"]
    (memory,) = cells(netlist, "DP16KD")
    read = memory["connections"]["DOB3"][0]
    (beside,) = (c for c in cells(netlist, "TRELLIS_FF") if c["connections"]["DI"] == [read])
    beside["parameters"] |= changed
    ECP5.absorb(netlist, "top")
    assert memory["parameters"]["REGMODE_B"] == "NOREG", left
    assert len([c for c in module["cells"].values() if c["type"] == "TRELLIS_FF"]) == 36


def test_an_output_that_is_read_before_its_register_stays(netlists):
    netlist = copy.deepcopy(netlists[0])
    (memory,) = cells(netlist, "DP16KD")
    netlist["modules"]["top"]["ports"]["early"] = {
        "direction": "output",
        "bits": memory["connections"]["DOA1"],
    }
    ECP5.absorb(netlist, "top")
    assert memory["parameters"]["REGMODE_A"] == "NOREG"


@pytest.mark.parametrize("free", [False, True])
def test_an_enable_that_is_free_reaches_every_register_directly(free):
    dut = LeadingSignCount(arithmetic=Arithmetic(18), free=free)
    netlist = netlist_for(to_verilog(dut, "top", instances=False), "top", TARGETS["ecp5-25k"])
    cells = netlist.netlist["modules"]["top"]["cells"].values()
    enables = {c["connections"]["CE"][0] for c in cells if c["type"] == "TRELLIS_FF"}
    enable = netlist.netlist["modules"]["top"]["ports"]["en"]["bits"][0]
    assert enable in enables and len(enables) == (1 if free else 2)
