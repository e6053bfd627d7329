"""Spartan-6: area by yosys, and the longest path against sums by hand of the constants in use."""

import pytest

from boresight.gateware.synthesis.routed import netlist_for
from boresight.gateware.synthesis.targets import TARGETS
from boresight.gateware.synthesis.tools import SynthesisError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.levels.build import Build

DESIGNS = """
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

module product(input clk, input signed [17:0] a, b, output reg signed [35:0] p);
    reg signed [17:0] ar, br;
    always @(posedge clk) begin ar <= a; br <= b; p <= ar * br; end
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
"""
SKEW = 0.135
#: 32 bits: bit 0 enters by a table, ripples through 7 CARRY4 and leaves the eighth at O[3]; the
#: register of ``a`` has two loads.
CHAIN = 0.259 + 0.236 + 7 * 0.003 + 6 * 0.093 + 0.320
LONGEST = {
    "adder": 0.525 + 0.855 + CHAIN + 0.114 + SKEW,
    "mac": 3.003,  # all in one DSP48A1: from the registers of the factors to that of the product
    "product": 3.003,
    "memory": 3.570,  # the least period of a block RAM
}
CELLS = {
    "adder": {"lut": 32, "ff": 96, "carry4": 8},
    "mac": {"dsp": 1},
    "product": {"dsp": 1},
    "memory": {"lut": 33, "lut_ram": 1, "ff": 41, "ramb16": 1, "bufg": 0},
}


class Track(Estimator):
    """The filter of the README."""

    inputs = (Input("dt", 0.0, 0.1, "s"), Input("z", -100.0, 100.0, "m"))
    params = (Param("alpha", 0.2, 0.0, 1.0), Param("beta", 2.0, 0.0, 16.0, "1/s"))
    states = (State("pos", -128.0, 128.0, "m"), State("vel", -16.0, 16.0, "m/s"))
    outputs = (Output("pos", "m"), Output("vel", "m/s"))

    def step(self, x, u, p):
        ahead = x.pos + u.dt * x.vel
        innovation = u.z - ahead
        pos = ahead + p.alpha * innovation
        vel = x.vel + p.beta * (u.dt * innovation)
        return {"pos": pos, "vel": vel}, {"pos": pos, "vel": vel}


@pytest.mark.parametrize("top", LONGEST)
def test_area_and_clock(top):
    mapped = netlist_for(DESIGNS, top, TARGETS["xc6slx9"])
    assert mapped.clock.median_mhz == int(10_000 / LONGEST[top]) / 10
    assert mapped.clock.p75_mhz <= mapped.clock.median_mhz
    used = {key: n for key, n in mapped.used.items() if n and key != "bufg"}
    assert used == {key: n for key, n in CELLS[top].items() if n}


def test_core_of_the_readme():
    """Not larger or slower than it was; the band is printed with the area."""
    target = TARGETS["xc6slx9"]
    mapped = netlist_for(Build(Track()).core.verilog(instances=True), "core", target)
    assert mapped.used["lut"] <= 380 and mapped.used["dsp"] == 4 and mapped.used["ramb16"] == 6
    assert mapped.clock.median_mhz >= 129.9 and mapped.clock.p75_mhz >= 101.1
    assert "LUT6" in str(mapped) and "101.1 to 129.9 MHz (estimate" in str(mapped)


def test_the_faster_grade_is_faster():
    slow, fast = (netlist_for(DESIGNS, "adder", TARGETS[t]) for t in ("xc6slx9", "xc6slx9-3"))
    assert fast.clock.median_mhz > slow.clock.median_mhz


def test_what_has_no_delays_or_a_loop_is_refused():
    latch = "module top(input g, d, output reg q); always @* if (g) q = d; endmodule"
    with pytest.raises(SynthesisError, match="LD"):
        netlist_for(latch, "top", TARGETS["xc6slx9"])
    loop = "module top(input clk, d, output reg q); wire a, b; assign a = ~(b & d);"
    loop += "assign b = ~(a | q); always @(posedge clk) q <= a; endmodule"
    with pytest.raises(SynthesisError, match="^a loop of logic through .*; put a register into it"):
        netlist_for(loop, "top", TARGETS["xc6slx9"])
