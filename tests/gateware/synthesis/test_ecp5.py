"""Flip-flops that move into multipliers and memories."""

import copy

import pytest

from boresight.gateware.engine.parts import LeadingSignCount
from boresight.gateware.synthesis.routed import netlist_for
from boresight.gateware.synthesis.targets import ECP5, TARGETS
from boresight.gateware.synthesis.tools import synthesise, to_verilog
from boresight.model.words.fixed import Arithmetic

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


@pytest.fixture(scope="module")
def netlists():
    """Before and after, and how many flip-flops moved."""
    command = ECP5.synthesis.replace("*operands*/m:*", "top/m:*")
    before = synthesise(DESIGN, top="top", command=command)
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


def test_every_pin_has_what_its_flip_flop_had(netlists):
    before, after, _ = netlists
    beside = [c["connections"] for c in cells(before, "TRELLIS_FF")]
    moved = {(c["DI"][0], c["Q"][0]) for c in beside}
    for kind in ("DP16KD", "MULT18X18D"):
        (old,), (new,) = cells(before, kind), cells(after, kind)
        for port, (net,) in old["connections"].items():
            if port.rstrip("0123456789") in ("A", "B", "P", "DOA", "DOB"):
                pair = (net, new["connections"][port][0])
                moved.remove(pair if new["port_directions"][port] == "output" else pair[::-1])
    assert not moved
    # They are enabled by a low net, the registers by its inverse.
    (low,) = {c["CE"][0] for c in beside}
    high = cells(after, "MULT18X18D")[0]["connections"]["CE0"][0]
    tables = {c["connections"]["Z"][0]: c for c in cells(after, "LUT4")}
    assert all(tables[low]["connections"][p] == tables[high]["connections"][p] for p in "ABCD")
    assert sum(int(tables[net]["parameters"]["INIT"], 2) for net in (low, high)) == 0xFFFF


@pytest.mark.parametrize(
    ("changed", "left"),
    [
        ({"REGSET": "SET"}, "starts at 1"),
        ({"CEMUX": "1 "}, "another enable"),
        ({"CLKMUX": "INV"}, "the falling edge"),
        ({"CLK": [10**6]}, "another clock"),
    ],
)
def test_a_register_that_differs_stays(netlists, changed, left):
    netlist = copy.deepcopy(netlists[0])
    module = netlist["modules"]["top"]
    (memory,) = cells(netlist, "DP16KD")
    read = memory["connections"]["DOB3"][0]
    (beside,) = (c for c in cells(netlist, "TRELLIS_FF") if c["connections"]["DI"] == [read])
    beside["connections" if "CLK" in changed else "parameters"] |= changed
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
