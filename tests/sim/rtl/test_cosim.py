"""What a replay is given and what becomes of its files, with a simulator that is played.

test_random_rtl.py, test_sharing.py and tests/sim/levels/test_rtl.py run the real ones.
"""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.sim.rtl import cosim
from boresight.sim.rtl.cosim import RtlSimulation, quiet
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


def part(n_inputs: int, interval: int) -> Any:
    program = SimpleNamespace(streamed=[0] * n_inputs, outputs=[0])
    return SimpleNamespace(program=program, schedule=SimpleNamespace(interval=interval))


@pytest.fixture
def played() -> Played:
    return Played()


@pytest.fixture
def simulation(played: Played, monkeypatch: pytest.MonkeyPatch) -> RtlSimulation:
    """Of a core with one program of two inputs, 18 bits."""
    identities: list[str] = []

    def get(kind: str, identity: str, make: object) -> SimpleNamespace:
        identities.append(identity)
        return SimpleNamespace(path=Path("/build"))

    monkeypatch.setattr(cosim, "require", lambda simulator: None)
    monkeypatch.setattr(cosim, "version", lambda simulator: "5.0")
    monkeypatch.setattr(cosim, "split_memories", lambda text: (text, {"rom0.hex": "7\n"}))
    monkeypatch.setattr(cosim, "Cache", lambda folder: SimpleNamespace(get=get))
    monkeypatch.setattr(RtlSimulation, "_runner", lambda self: played)
    core: Any = SimpleNamespace(
        machine=SimpleNamespace(arithmetic=SimpleNamespace(word=18), lanes=1),
        verilog=lambda *, instances: f"core, {instances}",
        parts=[part(2, 100)],
        number=0,
    )
    made = RtlSimulation(core)
    (identity,) = identities
    assert "core, False" in identity and "5.0" in identity
    return made


INPUTS = np.array([[1, -1], [2, 3]])


def test_files_of_a_run(simulation: RtlSimulation, played: Played) -> None:
    run = simulation.run(INPUTS, bus_writes=[BusWrite(1, 3, -1)], trace=0)
    assert played.files["input.hex"].split() and played.files["rom0.hex"] == "7\n"
    assert played.files["bus.txt"] == "1 3 3ffff\n"
    arguments = played.given["plusargs"]
    assert {"+steps=2", "+stall=0", "+trace=0"} <= set(arguments)
    assert "+verilator+rand+reset+2" in arguments  # unknown start values differ
    assert played.given["build_dir"] == Path("/build")
    # Cycles for each record and four more, for each write, and to begin with.
    assert played.given["extra_env"]["REPLAY_MAX_CYCLES"] == str((2 + 4) * 100 + 64 + 1000)
    assert run.outputs.tolist() == [[-1], [3]] and run.saturated.tolist() == [True, False]
    assert run.writes == (RegisterWrite(0, 0x1F, 7, 3),)
    assert not Path(played.given["test_dir"]).exists()


def test_a_run_with_pauses_may_take_longer(simulation: RtlSimulation, played: Played) -> None:
    simulation.run(INPUTS, stall=7)
    assert "+stall=7" in played.given["plusargs"] and "+trace=-1" in played.given["plusargs"]
    assert played.given["extra_env"]["REPLAY_MAX_CYCLES"] == str((2 + 4) * 100 * 16 + 1000)


def test_the_program_at_hand_is_selected_first(simulation: RtlSimulation, played: Played) -> None:
    simulation.core.parts = [part(2, 100), part(2, 300)]  # type: ignore[misc]
    simulation.core.number = 1  # type: ignore[misc]
    simulation.run(INPUTS, bus_writes=[BusWrite(1, 3, 5)])
    assert played.files["bus.txt"] == "0 204 1\n1 3 5\n"
    assert played.given["extra_env"]["REPLAY_MAX_CYCLES"] == str((2 + 4) * 300 + 2 * 64 + 1000)
    simulation.run(INPUTS, numbers=np.array([0, 0]))
    assert played.files["bus.txt"] == ""


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
    output: str, results: str, message: str, simulation: RtlSimulation, played: Played
) -> None:
    played.output, played.results = output, results
    with pytest.raises(SimulationFailed, match=message):
        simulation.run(INPUTS)
    # To find out why, the register writes alone.
    run = simulation.run(INPUTS, allow_unknown=True)
    assert len(run.outputs) == 0 and run.writes == (RegisterWrite(0, 0x1F, 7, 3),)


def test_nothing_to_compare(simulation: RtlSimulation) -> None:
    with pytest.raises(SimulationFailed, match="^nothing to compare: no input records$"):
        simulation.run(INPUTS[:0])


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
