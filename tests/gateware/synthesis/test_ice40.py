"""iCE40: yosys uses the registers of its multipliers, and cells are counted."""

from boresight.gateware.synthesis.routed import netlist_for
from boresight.gateware.synthesis.targets import TARGETS

DESIGN = """
module top(input clk, input go, input signed [15:0] a, input signed [15:0] b,
           output reg [31:0] product, output reg [3:0] n);
    reg signed [15:0] ra, rb;
    always @(posedge clk) if (go) begin ra <= a; rb <= b; product <= ra * rb; n <= n + 1; end
endmodule
"""


def test_registers_of_a_multiplier_are_not_flip_flops():
    mapped = netlist_for(DESIGN, "top", TARGETS["ice40-up5k"])
    assert mapped.used["dsp"] == 1 and mapped.used["ff"] == 4 and not mapped.used["ram"]
    assert 4 <= mapped.used["lut"] <= 8
    assert "1 SB_MAC16" in str(mapped)
