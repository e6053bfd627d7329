"""`core.v` as a user takes it: a bench in plain Verilog, every language mode, any start."""

import random
import subprocess
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.gateware.microcode.assemble import decode
from boresight.gateware.registers.core import PROGRAM
from boresight.gateware.texts.render import render
from boresight.model.attitude import estimator
from boresight.model.words.interpreter import Interpreter
from boresight.sim.levels.build import Build
from boresight.sim.rtl.simulators import available
from boresight.sim.rtl.verilator import build_program
from tests.support.compiler_calls import compiler_calls

BENCH = Path(__file__).with_name("plain_bench.v")
MODES = ("2001", "2005", "2005-sv", "2009", "2012")
#: Estimators, configuration: the smallest, and several on two lanes.
CORES = {"one": (("complementary",), "small"), "several": (("complementary", "mekf"), "fast")}
CORE = pytest.mark.parametrize("name", CORES)
RECORDS = 10


@cache
def core_of(name: str) -> Core:
    names, config = CORES[name]
    return Build(*(estimator(n) for n in names), config=config).core


@dataclass
class Host:
    """Commands for the bench, and the lines that it must write."""

    core: Core
    commands: list[int] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    updates: int = 0
    saturated: bool = False

    def __post_init__(self) -> None:
        self.models = [Interpreter(part.program) for part in self.core.parts]
        self.parities = [0] * len(self.models)
        #: Programs that load their states before their next update.
        self.due: set[int] = set()

    def add(self, what: int, number: int, word: int = 0) -> None:
        self.commands.append(what << 60 | number << 32 | word & 0xFFFFFFFF)

    def read(self, address: int, word: int) -> None:
        self.add(5, address)
        self.lines.append(f"R {address} {word:08x}")

    def status(self, number: int) -> None:
        """Flags, idle, parity; updates; program."""
        self.read(512, self.saturated | 4 | self.parities[number] << 3)
        self.read(513, self.updates)
        self.read(PROGRAM, number)

    def reset(self, cycles: int) -> None:
        """After it: program 0 idle, no flags, no updates; parameters stay, states begin anew."""
        self.add(2, cycles)
        self.lines.append("RESET")
        self.add(4, self.core.image.restarts[0] + 10)
        self.updates, self.saturated = 0, False
        for model in self.models:
            model.values = Interpreter(model.program).values
        self.due = set(range(len(self.models)))
        self.load(0)
        self.status(0)

    def load(self, number: int) -> None:
        """The routine that loads the states of a program writes the other copy, as an update."""
        if number in self.due:
            self.parities[number] ^= 1
            self.due.remove(number)

    def select(self, number: int) -> None:
        if len(self.models) > 1:
            self.add(3, PROGRAM, number)
        self.load(number)

    def parameter(self, number: int, word: int) -> None:
        """Another value of the program's first parameter."""
        name, address = next(iter(self.core.select(number).parameter_addresses.items()))
        self.add(3, address, word)
        self.models[number].params[self.core.parts[number].program.find(name)] = word

    def offer(self, words: list[int], count: int) -> None:
        for k, word in enumerate(words[:count]):
            self.add(1, int(k == len(words) - 1), word)

    def update(self, number: int, words: list[int]) -> list[str]:
        out, saturated = self.models[number].update(np.array(words)[:, None])
        self.parities[number] ^= 1
        self.updates += 1
        self.saturated |= bool(saturated[0])
        last = len(out) - 1
        return [f"O {int(w) & 0xFFFFFFFF:08x} {int(k == last)}" for k, w in enumerate(out[:, 0])]

    def cut(self, number: int, words: list[int], wait: int) -> bool:
        """A reset ``wait`` cycles after the last word of a record; whether it came too late.

        An update is complete if its last cycle is the first one of the reset, or earlier.
        """
        part = self.core.select(number)
        rom = [decode(self.core.machine, w) for w in self.core.image.program(number)]
        got = next(k for k, w in enumerate(rom) if w["get_last"])
        self.offer(words, len(words))
        self.add(4, wait)
        emitted = sum(cycle - 1 - got <= wait for cycle in part.schedule.latencies)
        if late := wait + 1 >= len(rom) - 1 - got:
            lines = self.update(number, words)
        else:
            before = [v.copy() for v in self.models[number].values]
            whole = self.parities[:], self.updates, self.saturated
            lines = self.update(number, words)
            self.models[number].values = before
            self.parities, self.updates, self.saturated = whole
        self.lines += lines[:emitted]
        return late


def scenario(core: Core, seed: int, *, before: int) -> Host:
    """Records of all programs in turn, with resets in the midst of some, and between records.

    The first reset comes ``before`` cycles after power-up.
    """
    rng = random.Random(seed)
    host = Host(core)
    host.parities[0] = int(before > core.image.restarts[0] + 3)  # its states were loaded already
    host.reset(1)
    ends = []
    for step in range(RECORDS):
        number = step % len(core.parts)
        words = [rng.randrange(-(1 << 26), 1 << 26) for _ in core.parts[number].program.inputs]
        words[0] = rng.randrange(1 << 24)  # a time step
        host.select(number)
        if step == 3:
            host.parameter(number, 0x1234567)
        if step % 4 == 1:  # while it waits for input
            host.offer(words, rng.randrange(1, len(words)))
            host.reset(rng.randrange(1, 4))
        elif step in (2, 7):  # while it works; at the last moment, and one cycle earlier
            length = core.parts[number].schedule.length
            rom = [decode(core.machine, w) for w in core.image.program(number)]
            end = length - 2 - next(k for k, w in enumerate(rom) if w["get_last"])
            for wait in (rng.randrange(1, end), end - 1, end, end + 5):
                ends.append(host.cut(number, words, wait))
                host.reset(rng.randrange(1, 4))
                host.select(number)
        elif step == 4:  # while it is idle
            host.reset(2)
        host.select(number)
        host.offer(words, len(words))
        host.add(4, core.parts[number].schedule.length)
        host.lines += host.update(number, words)
        host.status(number)
    assert ends == 2 * [False, False, True, True]
    host.commands.append(0)
    host.lines.append("DONE")
    return host


def files(folder: Path, name: str, host: Host) -> None:
    """Core, bench, commands."""
    (folder / "core.v").write_text(core_of(name).verilog(instances=True))
    (folder / "spartan6.v").write_text(render("spartan6.v"))
    (folder / "plain_bench.v").write_text(BENCH.read_text())
    commands = [*host.commands, *[0] * (1024 - len(host.commands))]
    (folder / "commands.hex").write_text("".join(f"{c:016x}\n" for c in commands))


def told(command: list[str], folder: Path) -> list[str]:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert not done.returncode, done.stdout + done.stderr
    return [line for line in done.stdout.splitlines() if not line.startswith("- ")]


@pytest.mark.skipif(not available("icarus"), reason="Icarus Verilog: apt-get install iverilog")
@pytest.mark.parametrize(
    ("name", "before", "mode"),
    # What one mode takes, the modes between the first and the last take too, in this core or that.
    [
        *(("one", 0, mode) for mode in MODES),
        *(("several", 20, mode) for mode in (MODES[0], MODES[-1])),
    ],
)
def test_icarus(name: str, mode: str, before: int, tmp_path: Path) -> None:
    """No bit is unknown after the first reset, whatever was not driven before it."""
    host = scenario(core_of(name), seed=MODES.index(mode), before=before)
    files(tmp_path, name, host)
    build = ["iverilog", f"-g{mode}", "-DWORD=32", f"-DBEFORE={before}", "-o", "bench"]
    told([*build, "core.v", "spartan6.v", "plain_bench.v"], tmp_path)
    assert told(["vvp", "-n", "bench"], tmp_path) == host.lines


@CORE
def test_verilator(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Random start values of everything that has none."""
    compiled = compiler_calls(tmp_path / "calls", monkeypatch)
    host = scenario(core_of(name), seed=10, before=2)
    files(tmp_path, name, host)
    # Two cycles: so early nothing that is asked at random can be granted.
    build = ["--main", "--timing", "-Wno-fatal", "-DWORD=32", "-DBEFORE=2"]
    build += ["--output-split", "0", "-CFLAGS", "-std=c++20 -O0"]
    build += ["--x-initial", "unique", "--x-assign", "unique"]
    sources = {
        name: (tmp_path / name).read_text() for name in ("core.v", "spartan6.v", "plain_bench.v")
    }
    build_program(tmp_path / "bench", sources, build, top="plain_bench")
    assert compiled() == ["Vplain_bench__ALL.cpp"]
    for seed in (1, 2, 3, 4):
        run = ["./bench", "+verilator+rand+reset+2", f"+verilator+seed+{seed}"]
        assert told(run, tmp_path) == host.lines, f"seed {seed}"
