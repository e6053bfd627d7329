"""A board's design after synthesis, at its pins: bytes to its serial line, frames from it."""

import re
import subprocess
from pathlib import Path

import pytest

from boresight.firmware.build import CModel
from boresight.gateware.boards.frames import Decoder, Kind, encode
from boresight.gateware.boards.project import prepared
from boresight.gateware.boards.top import records_design
from boresight.gateware.core import build_core
from boresight.gateware.registers.core import UPDATES
from boresight.gateware.synthesis.routed import netlist_for
from boresight.sim.rtl.netlist import CELLS, verilog_of
from boresight.sim.rtl.simulators import available
from tests.support.estimators import Leaky

CLOCK_HZ, BAUD = 30_000_000, 3_000_000

#: The board's oscillator, a host at the serial line with a clock of its own, and the LEDs.
BENCH = """
`timescale 1ns/1ps
module bench;
    localparam real BIT = 1e9 / {baud} * 1.003;
    reg clk = 0, rx = 1;
    wire tx, led0, led1, line;
    assign line = rx;
    always #41.667 clk = ~clk;
    top board (
        .clk12_0__io(clk), .rx_0__io(line), .tx_0__io(tx), .led_0__io(led0), .led_1__io(led1)
    );
    reg [7:0] sent [0:{bytes} - 1], heard;
    integer k, place, at;
    initial begin
        $readmemh("sent.hex", sent);
        #25000;  // the board's reset
        for (k = 0; k < {bytes}; k = k + 1) begin
            rx = 0;
            #BIT;
            for (place = 0; place < 8; place = place + 1) begin
                rx = sent[k][place];
                #BIT;
            end
            rx = 1;
            #BIT;
        end
        #(300 * BIT) $finish;
    end
    initial #20000 forever begin
        @(negedge tx) #(1.5 * BIT);
        for (at = 0; at < 8; at = at + 1) begin
            heard[at] = tx;
            #BIT;
        end
        if (tx !== 1) heard = 8'hxx;
        $display("%h", heard);
    end
endmodule
"""

#: The PLL at a pin, which yosys' library does not describe; feedback SIMPLE alone.
PLL = """
`timescale 1ns/1ps
module SB_PLL40_PAD (
    input PACKAGEPIN, RESETB, BYPASS,
    output reg PLLOUTGLOBAL, LOCK
);
    parameter FEEDBACK_PATH = "SIMPLE";
    parameter [3:0] DIVR = 0;
    parameter [6:0] DIVF = 0;
    parameter [2:0] DIVQ = 0;
    parameter [2:0] FILTER_RANGE = 0;

    realtime first = 0, half;
    initial begin
        PLLOUTGLOBAL = 0;
        LOCK = 0;
        if (FEEDBACK_PATH != "SIMPLE") $fatal(1, "PLL: feedback path is not described");
        // Two periods of the pin, then the clock that they give.
        @(posedge PACKAGEPIN) first = $realtime;
        @(posedge PACKAGEPIN) half = ($realtime - first) / 2;
        half = half * (DIVR + 1) * 2.0 ** DIVQ / (DIVF + 1);
        forever #half PLLOUTGLOBAL = RESETB & ~BYPASS & ~PLLOUTGLOBAL;
    end
    always @(posedge PACKAGEPIN) if (first > 0) LOCK <= #(100 * half) RESETB;
endmodule
"""


def simulated(folder: Path, sources: dict[str, str], data: bytes) -> bytes:
    """What a board answers to bytes."""
    bench = BENCH.format(baud=BAUD, bytes=len(data))
    for name, text in {**sources, "bench.v": bench, "sent.hex": data.hex("\n")}.items():
        (folder / name).write_text(text)
    # Icarus has no defaults of inputs.
    build = ["iverilog", "-g2012", "-DNO_ICE40_DEFAULT_ASSIGNMENTS", "-o", "bench"]
    subprocess.run([*build, "bench.v", *sources], cwd=folder, check=True)
    run = subprocess.run(
        ["vvp", "-n", "bench"], cwd=folder, check=True, capture_output=True, text=True
    )
    return bytes.fromhex(run.stdout)  # an unknown bit is no digit


@pytest.mark.soak
@pytest.mark.skipif(not available("icarus"), reason="needs icarus")
def test_icebreaker(tmp_path) -> None:
    """PLL, pads, reset, serial line, core: records in, the model's words out; registers."""
    word = 18
    core = build_core(Leaky().compile(word=word), "small")
    made = prepared(records_design(core, baud=BAUD), "icebreaker", clock_hz=CLOCK_HZ)
    mapped = netlist_for(made.verilog, "top", made.target)
    cells = CELLS[made.target.family.name]
    sources = cells.sources()
    plain = re.sub(r"(?ms)^module SB_PLL40_PAD\b.*?^endmodule", "", sources["cells.v"])
    sources["cells.v"] = plain
    records = [[1000, -2000], [30_000, 7], [-5, 1234], [0, 0]]
    frames = [(Kind.RECORD, record) for record in records] + [(Kind.READ, [UPDATES.address])]
    heard = simulated(
        tmp_path,
        {"top.v": verilog_of(mapped.netlist, "top", cells), "pll.v": PLL, **sources},
        b"".join(encode(kind, words, word=word) for kind, words in frames),
    )
    wanted, _ = CModel(core.program).update(records)
    assert list(Decoder(word=word).feed(heard)) == [
        *((Kind.RECORD, words) for words in wanted.tolist()),
        (Kind.READ, [len(records)]),
    ]
