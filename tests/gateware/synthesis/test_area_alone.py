"""Families without a router: their cells are counted, and there is no clock."""

import pytest

from boresight.gateware.synthesis.routed import netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.model.errors import InputError
from boresight.verbs.compile import check_routable

DESIGN = """
module top(input clk, input go, input signed [17:0] a, input signed [17:0] b,
           output reg [35:0] product, output reg [7:0] n, input [8:0] at, output reg [17:0] word);
    reg [17:0] memory [0:511];
    always @(posedge clk) begin
        word <= memory[at];
        if (go) begin product <= a * b; n <= n + 1; memory[n] <= word; end
    end
endmodule
"""


@pytest.mark.parametrize(
    ("target", "dsp", "ram", "flip_flops"), [("artix7-35t", 1, 0.5, 8), ("cyclone5-a4", 0.5, 1, 44)]
)
def test_cells_are_counted(target, dsp, ram, flip_flops):
    used = netlist_for(DESIGN, "top", TARGETS[target]).used
    assert used["dsp"] == dsp and used["ram"] == ram and used["ff"] == flip_flops
    assert 1 <= used["lut"] <= 24


def test_no_tool_routes_them():
    with pytest.raises(InputError, match="lfd2nx-40, or --synth for area alone"):
        check_routable("artix7-35t")
