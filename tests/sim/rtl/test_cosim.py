"""What a replay under cocotb is given and what becomes of its files, with a runner that is played.

test_replay_bench.py, test_random_rtl.py and test_sharing.py run the real one.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.sim.rtl import cosim, replay
from boresight.sim.rtl.cosim import (
    CocotbSimulation,
    bus_text,
    input_text,
    quiet,
    read_output,
    register_writes,
)
from boresight.sim.rtl.replay import BusWrite, RegisterWrite
from boresight.sim.rtl.simulators import SimulationFailed

GOOD = "R 0 0 1f 00007 3\nO 0 0 3ffff 4\nU 0 1 9\nO 1 0 00003 6\nU 1 0 8\n"
PASSED = '<testsuites><testsuite tests="1" failures="0"/></testsuites>'
FAILED = PASSED.replace('failures="0"', 'failures="1"')


class Played:
    """Stands for cocotb's runner: keeps what it is given, leaves what it is told to."""

    def __init__(self) -> None:
        self.output, self.results, self.error = GOOD, PASSED, ""
        self.files: dict[str, str] = {}
        self.given: dict[str, Any] = {}

    def test(self, **given: Any) -> None:
        folder = Path(given["test_dir"])
        self.files = {p.name: p.read_text() for p in folder.iterdir() if p.suffix != ".log"}
        self.given = given
        os.write(1, b"chatter of the simulator\n")
        if self.error:
            raise RuntimeError(self.error)
        (folder / "output.txt").write_text(self.output)
        Path(given["results_xml"]).write_text(self.results)


@pytest.fixture
def played() -> Played:
    return Played()


@pytest.fixture
def simulation(played: Played, monkeypatch: pytest.MonkeyPatch) -> CocotbSimulation:
    """Of a core with one program of two inputs, 18 bits."""
    identities: list[str] = []

    def get(kind: str, identity: str, make: object) -> SimpleNamespace:
        identities.append(identity)
        return SimpleNamespace(path=Path("/build"))

    monkeypatch.setattr(cosim, "require", lambda simulator: None)
    monkeypatch.setattr(cosim, "version", lambda simulator: "5.0")
    monkeypatch.setattr(replay, "split_memories", lambda text: (text, {"rom0.hex": "7\n"}))
    monkeypatch.setattr(cosim, "Cache", lambda folder: SimpleNamespace(get=get))
    monkeypatch.setattr(CocotbSimulation, "_runner", lambda self: played)
    program = SimpleNamespace(streamed=[0, 0], outputs=[0])
    core: Any = SimpleNamespace(
        machine=SimpleNamespace(arithmetic=SimpleNamespace(word=18), lanes=1),
        verilog=lambda *, instances: f"core, {instances}",
        parts=[SimpleNamespace(program=program, schedule=SimpleNamespace(interval=100))],
        number=0,
    )
    simulation = CocotbSimulation(core, simulator="verilator")
    (identity,) = identities
    assert "core, False" in identity and "5.0" in identity
    return simulation


INPUTS = np.array([[1, -1], [2, 3]])


def test_files_of_a_run(simulation: CocotbSimulation, played: Played) -> None:
    run = simulation.run(INPUTS, bus_writes=[BusWrite(1, 3, -1)], stall=7, trace=0)
    assert played.files["input.hex"].split() and played.files["rom0.hex"] == "7\n"
    assert played.files["bus.txt"] == "1 3 3ffff\n"
    arguments = played.given["plusargs"]
    assert {"+steps=2", "+stall=7", "+trace=0"} <= set(arguments)
    assert "+verilator+rand+reset+2" in arguments  # unknown start values differ
    assert played.given["build_dir"] == Path("/build")
    assert played.given["extra_env"]["REPLAY_MAX_CYCLES"] == str((2 + 4) * 100 * 16 + 64 + 1000)
    assert run.outputs.tolist() == [[-1], [3]] and run.saturated.tolist() == [True, False]
    assert run.writes == (RegisterWrite(0, 0x1F, 7, 3),)
    assert not Path(played.given["test_dir"]).exists()


@pytest.mark.parametrize(
    ("output", "results", "message"),
    [
        (GOOD.replace("00003", "0000x"), PASSED, "^verilator: "),
        (GOOD.replace("U 1 0 8\n", ""), PASSED, "^verilator: "),
        (GOOD, FAILED, "^verilator: the bench failed$"),
        (GOOD, "<testsuites/>", "^verilator: expected 1 bench to run, 0 ran$"),
    ],
)
def test_what_is_never_a_pass(
    output: str, results: str, message: str, simulation: CocotbSimulation, played: Played
) -> None:
    played.output, played.results = output, results
    with pytest.raises(SimulationFailed, match=message):
        simulation.run(INPUTS)
    # To find out why, the register writes alone.
    run = simulation.run(INPUTS, allow_unknown=True)
    assert len(run.outputs) == 0 and run.writes == (RegisterWrite(0, 0x1F, 7, 3),)


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


def test_the_last_word_of_each_record_is_marked() -> None:
    inputs = np.array([[1, -1, 99], [2, 99, 99], [3, 4, -5]])
    text = input_text(inputs, np.array([2, 1, 3]), 18)
    assert text == "1\n7ffff\n40002\n3\n4\n7fffb\n"


def test_bus_writes() -> None:
    assert bus_text([BusWrite(0, 516, 1), BusWrite(12, 3, -1)], 18) == "0 204 1\n12 3 3ffff\n"


LINES = ["O 0 0 3ffff 4", "O 0 1 00002 5", "U 0 1 9", "O 1 0 00003 6", "U 1 0 8"]


def test_words_flags_cycles() -> None:
    run = read_output(LINES, np.array([2, 1]), 18)
    assert run.outputs.tolist() == [[-1, 2], [3, 0]]
    assert run.latency_cycles.tolist() == [[5, 6], [7, 0]]
    assert run.saturated.tolist() == [True, False] and run.interval_cycles.tolist() == [9, 8]


@pytest.mark.parametrize(
    ("place", "line", "said"),
    [
        (1, "O 0 1 0000x 5", "unknown value (X): O 0 1 0000x 5"),
        (1, "O 0 1 0000Z 5", "unknown value (X): O 0 1 0000Z 5"),
        (2, "U 0 x 9", "unknown value (X): U 0 x 9"),
        (0, "X 0 0 handshake 3", "unknown value (X): X 0 0 handshake 3"),
        (3, "O 1 1 00003 6", "unexpected output word: O 1 1 00003 6"),
        (3, "O 2 0 00003 6", "unexpected output word: O 2 0 00003 6"),
        (1, "", "update 0 of 2 did not complete"),
        (3, "", "update 1 of 2 did not complete"),
        (4, "", "update 1 of 2 did not complete"),
    ],
)
def test_what_is_no_run(place: int, line: str, said: str) -> None:
    lines = [x for x in [*LINES[:place], line, *LINES[place + 1 :]] if x]
    with pytest.raises(SimulationFailed) as error:
        read_output(lines, np.array([2, 1]), 18)
    assert str(error.value) == said


def test_register_writes() -> None:
    lines = ["R 3 1 0a 3ffff 7", "O 0 0 00001 9", "R 3 0 0x 00001 8", "R 3 0 01 0000x 9"]
    assert register_writes(lines) == (
        RegisterWrite(1, 10, 0x3FFFF, 7),
        RegisterWrite(0, -1, None, 8),
        RegisterWrite(0, -1, None, 9),
    )
