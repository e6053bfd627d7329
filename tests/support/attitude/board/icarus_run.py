"""The board's bench in Icarus Verilog, whose values may be unknown (X)."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Mapping
from pathlib import Path

from boresight.sim.attitude.board.build import Board, board_parameters, board_sources
from boresight.sim.attitude.board.run import (
    BoardRun,
    Stimulus,
    cycles_limit,
    files_and_arguments,
    frames_of,
    read_trace,
)
from boresight.sim.rtl.simulators import require

#: Cycles of reset, as in the compiled bench.
_RESET = 4
_CLOCK = """`timescale 1ns/1ps
module clocked;
    reg clk = 0, rst = 1;
    wire done, byte_strobe;
    wire [7:0] byte_heard;
    always #5 clk = !clk;
    initial begin
        repeat (RESET) @(posedge clk);
        @(negedge clk) rst = 0;
    end
    bench #(PARAMETERS) bench (
        .clk(clk), .rst(rst), .done(done), .byte_strobe(byte_strobe), .byte_heard(byte_heard)
    );
endmodule
"""


def run_in_icarus(
    board: Board, what: Stimulus, *, updates: int, settings: Mapping[str, int]
) -> BoardRun:
    """Run the bench until so many updates are done: some 9,000 cycles a second.

    Raises
    ------
    ToolMissing
        Icarus is not installed.
    subprocess.CalledProcessError
        It failed.
    SimulationFailed
        The trace has no end, or an X.
    """
    require("icarus")
    files, arguments = files_and_arguments(board, what, updates, settings, {})
    values = ", ".join(f".{k}({v})" for k, v in board_parameters(board.setup).items())
    clock = _CLOCK.replace("RESET", str(_RESET)).replace("PARAMETERS", values)
    sources = {**board_sources(board), "clocked.sv": clock}
    limit = cycles_limit(board, updates)
    with tempfile.TemporaryDirectory(prefix="boresight-board-") as temporary:
        folder = Path(temporary)
        for name, text in {**files, **sources}.items():
            (folder / name).write_text(text)
        for command in (
            ["iverilog", "-g2012", "-s", "clocked", "-o", "bench.vvp", *sources],
            ["vvp", "-n", "bench.vvp", f"+cycles={limit}"]
            + [f"+{name}={value}" for name, value in arguments.items()],
        ):
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
        trace = read_trace((folder / "trace.txt").read_text())
    return BoardRun(trace, *frames_of(trace))
