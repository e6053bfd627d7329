"""Compiled simulation: cycles are counted, arguments and files arrive, a hang is a failure."""

from pathlib import Path

import pytest

from boresight.sim.compiled import RESET_CYCLES, Compiled, build
from boresight.sim.cosim import SimulationFailed

BENCH = """
module bench #(parameter STEP = 1) (input clk, input rst);
    integer count, limit, file, word, scanned;
    initial begin
        if (!$value$plusargs("limit=%d", limit)) limit = 1 << 30;
        file = $fopen("words.txt", "r");
        if (file != 0) begin
            scanned = $fscanf(file, "%d", word);
            $display("word %0d", word);
        end
    end
    always @(posedge clk) begin
        count <= rst ? 0 : count + STEP;
        if (!rst && count == limit) begin
            $display("count %0d", count);
            $finish;
        end
    end
endmodule
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    return build("bench", {"bench.sv": BENCH}, cache=tmp_path_factory.mktemp("builds"))


def test_counts_cycles_and_takes_arguments(tmp_path: Path) -> None:
    bench = build("bench", {"bench.sv": BENCH}, parameters={"STEP": 2}, cache=tmp_path)
    run = bench.run({"limit": 20}, max_cycles=1000, files={"words.txt": "42\n"})
    assert "word 42" in run.stdout
    assert "count 20" in run.stdout
    assert run.cycles == RESET_CYCLES + 11
    assert run.seconds >= 0
    assert "word" not in bench.run({"limit": 20}, max_cycles=1000).stdout


def test_a_hang_is_a_failure(bench: Compiled) -> None:
    with pytest.raises(SimulationFailed, match="not finished after 1000 cycles"):
        bench.run(max_cycles=1000)


def test_files_stay_in_the_given_folder(bench: Compiled, tmp_path: Path) -> None:
    bench.run({"limit": 3}, max_cycles=1000, files={"words.txt": "1"}, folder=tmp_path)
    assert (tmp_path / "words.txt").read_text() == "1"


def test_a_build_that_fails_says_why(tmp_path: Path) -> None:
    with pytest.raises(SimulationFailed, match="(?s)build of bench failed.*nonsense"):
        build(
            "bench",
            {"bench.sv": "module bench(input clk, input rst); nonsense; endmodule"},
            cache=tmp_path,
        )
