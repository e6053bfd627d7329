"""What a replay under cocotb is given and what becomes of its files, with a runner that is played.

test_replay_bench.py, test_random_rtl.py and test_sharing.py run the real one.
"""

from __future__ import annotations

import os
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import build_core
from boresight.sim.rtl import cosim
from boresight.sim.rtl.cosim import CocotbSimulation, quiet
from boresight.sim.rtl.replay import RegisterWrite, ReplayFailed
from boresight.sim.rtl.simulators import SimulationFailed
from tests.support.random_program import random_program

PASSED = '<testsuites><testsuite tests="1" failures="0"/></testsuites>'
FAILED = PASSED.replace('failures="0"', 'failures="1"')
INPUTS = np.array([[1, -1], [2, 3]])


class Played:
    """Stands for cocotb's runner: keeps what it is given, leaves what it is told to."""

    def __init__(self) -> None:
        self.results, self.unknown = PASSED, ""
        self.files: dict[str, bytes] = {}
        self.given: dict[str, Any] = {}

    def build(self, **given: Any) -> None:
        self.given = given

    def test(self, **given: Any) -> None:
        folder = Path(given["test_dir"])
        self.files = {p.name: p.read_bytes() for p in folder.iterdir()}
        self.given = given
        os.write(1, b"chatter of the simulator\n")
        # Two records of one word, then a register write with unknown bits.
        parts = ([1, 1, 9, 1, 0, 8], [-1, 3], [4, 6], [0, -1, 0, 3])
        results = (struct.pack("q", len(x)) + np.array(x, np.int32).tobytes() for x in parts)
        (folder / "results").write_bytes(b"".join(results))
        if self.unknown:
            (folder / "unknown").write_text(self.unknown)
        Path(given["results_xml"]).write_text(self.results)


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> Played:
    """Under Icarus."""
    played = Played()
    monkeypatch.setattr(cosim, "require", lambda simulator: None)
    monkeypatch.setattr(CocotbSimulation, "_runner", lambda self: played)
    return played


@pytest.fixture
def simulation(played: Played, tmp_path: Path) -> CocotbSimulation:
    program = random_program(1, n_inputs=2, n_outputs=1)
    simulation = CocotbSimulation(build_core(program, "fast", restarts=0), cache=tmp_path)
    assert played.given["parameters"] == {"WORD": 32, "LANES": 2}
    return simulation


def test_files_of_a_run(simulation: CocotbSimulation, played: Played) -> None:
    run = simulation.run(INPUTS, stall=7, trace=0)
    batch = simulation.batch(INPUTS, stall=7, trace=0)
    assert played.files["batch"] == batch.packed() and "rom0.hex" in played.files
    assert "+verilator+rand+reset+2" in played.given["plusargs"]  # unknown start values differ
    assert run.outputs.tolist() == [[-1], [3]] and run.saturated.tolist() == [True, False]
    assert run.latency_cycles.tolist() == [[5], [7]] and run.interval_cycles.tolist() == [9, 8]
    assert run.writes == (RegisterWrite(0, -1, None, 3),)
    assert not Path(played.given["test_dir"]).exists()


def test_what_is_never_a_pass(simulation: CocotbSimulation, played: Played) -> None:
    played.unknown = "out_payload = 0X1, record 1, cycle 4"
    message = f"^icarus: unknown value \\(X\\): {played.unknown}$"
    with pytest.raises(ReplayFailed, match=message) as failed:
        simulation.run(INPUTS)
    assert failed.value.writes == (RegisterWrite(0, -1, None, 3),)
    for played.results in (FAILED, "<testsuites/>"):
        with pytest.raises(SimulationFailed, match="^icarus: the bench failed$"):
            simulation.run(INPUTS)


def test_chatter_goes_to_the_log(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with quiet(tmp_path / "log", "a tool"):
        os.write(1, b"out ")
        os.write(2, b"err")
    os.write(1, b"after")
    assert (tmp_path / "log").read_text() == "out err"
    assert capfd.readouterr() == ("after", "")


@pytest.mark.parametrize("error", [RuntimeError("it broke"), SystemExit("it broke")])
def test_a_tool_that_fails_says_why(error: BaseException, tmp_path: Path, capfd: Any) -> None:
    with pytest.raises(SimulationFailed, match="^a tool failed: "), quiet(tmp_path / "l", "a tool"):
        os.write(1, b"%Error: no such file\n")
        raise error
    os.write(2, b"still here")
    assert capfd.readouterr() == ("", "still here")
