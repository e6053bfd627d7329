"""Nexus: cells are counted, carry chains begin as the router wants it, and a clock is driven."""

import pytest

from boresight.gateware.synthesis.routed import enclosed, implement, netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.tools import command
from boresight.model.errors import ToolMissing
from tests.support.router import is_installed

DESIGN = """
module top(input clk, input go, input signed [17:0] a, input signed [17:0] b,
           output reg [35:0] product, output reg [7:0] n, input [8:0] at, output reg [17:0] word);
    (* ram_style = "block" *) reg [17:0] memory [0:511];
    reg signed [17:0] ra, rb;
    always @(posedge clk) begin
        word <= memory[at];
        if (go) begin
            ra <= a; rb <= b; product <= ra * rb; n <= n + 1; memory[n] <= word;
        end
    end
endmodule
"""
TARGET = TARGETS["lifcl-17"]


@pytest.fixture(scope="module")
def mapped():
    return netlist_for(DESIGN, "top", TARGET)


def cells(netlist, kind):
    return [c for c in netlist["modules"]["top"]["cells"].values() if c["type"] == kind]


def test_registers_of_a_multiplier_are_not_flip_flops(mapped):
    assert mapped.used["dsp"] == mapped.used["ram"] == 1 and mapped.used["ff"] == 8
    (multiplier,) = cells(mapped.netlist, "MULT18X18")
    registers = {multiplier["parameters"][f"REG{name}"] for name in ("INPUTA", "INPUTB", "OUTPUT")}
    assert registers == {"REGISTER"}
    assert "1 MULT18X18, 1 EBR" in str(mapped)


def test_the_input_of_a_carry_chain_is_open(mapped):
    chain = cells(mapped.netlist, "CCU2")
    first = [cell for cell in chain if "CIN" not in cell["connections"]]
    assert len(first) == 1 and len(chain) == 5
    assert "CIN" not in first[0]["port_directions"]


def test_a_buffer_drives_the_clock_and_a_cell_the_constant(mapped):
    netlist = enclosed(mapped.netlist, "top", TARGET.family)
    assert not netlist["modules"]["top"]["ports"]
    (source,), (multiplier,) = cells(netlist, "DCC"), cells(netlist, "MULT18X18")
    assert source["connections"]["CLKO"] == multiplier["connections"]["CLK"]
    lows = {cell["connections"]["Z"][0] for cell in cells(netlist, "VLO")}
    inputs = [c["connections"]["D"][0] for c in cells(netlist, "FD1P3IX")]
    assert "0" not in inputs and lows & {*inputs}


def test_the_speed_grade_is_in_the_name_of_the_part():
    options = command(TARGETS["lifcl-40-9"], seed=1, clock_mhz=100)
    assert options[:2] == ("--device", "LIFCL-40-9BG256C")


def test_it_is_routed():
    """By nextpnr itself; without it, the line that installs it is the answer."""
    if not is_installed("nextpnr-nexus"):
        with pytest.raises(ToolMissing, match=r"boresight\[nexus\]"):
            implement(DESIGN, "top", TARGET)
        return
    routed = implement(DESIGN, "top", TARGET)
    assert routed.clock_mhz is not None and 50 < routed.clock_mhz < 1000
