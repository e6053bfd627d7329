"""Waveforms: the values in a window are the interpreter's, with names, microwords and lines."""

import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from vcd.reader import TokenKind, tokenize

from boresight.cli import main
from boresight.model.attitude import complementary
from boresight.model.attitude.complementary import Complementary
from boresight.model.words.interpreter import Interpreter
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.records.bundled import bundled
from boresight.sim.rtl.wave import write_wave

SYNTHETIC = bundled("synthetic_60s")
FIRST, STOP = 4, 6


@dataclass
class Seen:
    """A file of waveforms, read by another program than wrote it."""

    build: Build
    inputs: Any
    paths: set[str]
    cycles: list[dict[str, Any]]  # by path, as after the changes of each cycle
    layouts: list[str]

    def row(self, number: int) -> list[dict[str, Any]]:
        return [now for now in self.cycles if now["complementary.row"] == number]


def cycles_of(path: Path) -> Iterator[dict[str, Any]]:
    """The declared paths, each with None, and then the values of every cycle."""
    scope, paths, now = list[str](), dict[str, list[str]](), dict[str, Any]()
    with path.open("rb") as file:
        for token in tokenize(file):
            if token.kind is TokenKind.SCOPE:
                scope.append(token.scope.ident)
            elif token.kind is TokenKind.UPSCOPE:
                scope.pop()
            elif token.kind is TokenKind.VAR:
                paths.setdefault(token.var.id_code, []).append(
                    ".".join([*scope, token.var.reference])
                )
            elif token.kind is TokenKind.ENDDEFINITIONS:
                yield {p: None for many in paths.values() for p in many}
            elif token.kind is TokenKind.CHANGE_TIME and now:
                if token.time_change % 10 == 5:
                    yield dict(now)
            elif token.kind is not TokenKind.CHANGE_TIME and hasattr(token.data, "id_code"):
                now |= dict.fromkeys(paths[token.data.id_code], token.data.value)
    yield now


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Seen:
    build = Build(Complementary(), config="fast")
    ((log),) = recorded(build)[:1]
    file = tmp_path_factory.mktemp("wave") / "wave.vcd"
    lines = {number: node.line for number, node in build.nodes[0].items()}
    with file.open("w") as out:
        wave = write_wave(build.core, lines, log.inputs[:20], FIRST, STOP, out)
    layouts = []
    for write in (wave.gtkwave, wave.surfer):
        with (file.parent / "layout").open("w") as out:
            write(out, file.name)
        layouts.append((file.parent / "layout").read_text())
    paths, *cycles = cycles_of(file)
    assert len(cycles) - 1 == wave.cycles == 2 * build.core.schedule.interval
    return Seen(build, log.inputs[:20], set(paths), cycles, layouts)


def test_values_are_the_interpreters(seen: Seen) -> None:
    program = seen.build.core.schedule.program
    machine, half_turns = Interpreter(program), 0
    for k, record in enumerate(seen.inputs[:STOP]):
        out, _ = machine.update(np.array(record)[:, None])
        if k < FIRST:
            continue
        last = seen.row(k + 1)[0]  # what is written in a cycle is there in the next
        words = [int(w[0]) for w in machine.values_before_commit()]

        def real(value: int, word: int) -> float:
            scale = 180.0 if program.values[value].unit == "ht" else 1.0
            return float(program.format(value).real(word)) * scale

        for state, after in program.states:
            shown = last[f"complementary.states.{program.values[state].name}"]
            assert shown == real(state, words[after])
        for name, value, word in zip(
            program.output_names, program.outputs, out[:, 0].tolist(), strict=True
        ):
            assert last[f"complementary.outputs.{name}"] == real(value, word), name
            half_turns += program.values[value].unit == "ht"
        for value in program.inputs:
            name = program.values[value].name
            assert last[f"complementary.inputs.{name}"] == real(value, words[value]), name
        nexts = {after: f"{program.values[state].name}_next" for state, after in program.states}
        for op in program.ops:
            name = nexts.get(op.dest, program.values[op.dest].name)
            paths = [f"complementary.values.{x}" for x in (f"{name}_{op.dest}", name)]
            shown = last[next(path for path in paths if path in seen.paths)]
            assert shown == real(op.dest, words[op.dest]), name
    assert half_turns


def test_microword_value_and_line_at_work(seen: Seen) -> None:
    schedule = seen.build.core.schedule
    source, first = inspect.getsourcelines(complementary)
    lines = 0
    for lane in (0, 1):
        slots = {s.cycle: s for s in schedule.slots if s.lane == lane and s.op is not None}
        for cycle, now in enumerate(seen.row(FIRST)):
            assert now["complementary.cycle"] == cycle
            at_work = {
                x: now[f"complementary.machine.{x}{lane}"] for x in ("operation", "value", "line")
            }
            if cycle not in slots:
                assert at_work["value"] == at_work["line"] == ""
                continue
            op = schedule.program.ops[slots[cycle].op]
            node = seen.build.nodes[0].get(op.dest)
            name = schedule.program.values[op.dest].name
            assert at_work["operation"]
            assert at_work["value"].startswith(name) or "_next" in at_work["value"]
            if node is not None and node.line.startswith("complementary.py"):
                number = int(node.line.rpartition(" ")[2])
                text = source[number - max(first, 1)].strip().replace(" ", r"\x20")
                wanted = f"{node.line}: ".replace(" ", r"\x20") + text
                assert at_work["line"].replace(" ", r"\x20") == wanted
                lines += 1
    assert lines > 50


def test_the_cores_own_signals(seen: Seen) -> None:
    wires = [p for p in seen.paths if p.startswith("core.")]
    assert "core.sequencer.pc" in wires and "core.lane1.acc" in wires
    written = [now["core.o__payload"] for now in seen.row(FIRST) if now["core.o__valid"] == "1"]
    assert len(written) == len(seen.build.core.schedule.program.outputs)


def test_layouts_name_signals_of_the_file(seen: Seen) -> None:
    gtkwave, surfer = seen.layouts
    shown = [line.split()[-1] for line in gtkwave.splitlines() if line.startswith("+{")]
    added = [line.split()[1] for line in surfer.splitlines() if line.startswith("variable_add")]
    assert shown == added and set(added) <= seen.paths and len(added) > 60
    assert "+{pitch, deg} complementary.outputs.pitch" in gtkwave
    assert surfer.startswith("load_file wave.vcd\n")


# --------------------------------------------------------------------------------------------------


def test_check_writes_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    line = ["check", "complementary", str(SYNTHETIC), "--steps", "9", "--levels", "fixed"]
    assert main([*line, "--config", "fast", "--wave", "0:1"]) == 0
    assert "rows 0 to 0, " in capsys.readouterr().err
    names = {p.name for p in Path("wave").iterdir()} - {".boresight.json"}
    assert names == {f"complementary.{suffix}" for suffix in ("vcd", "gtkw", "sucl")}
    _, start, *_, last = cycles_of(Path("wave/complementary.vcd"))
    assert (start["complementary.row"], last["complementary.row"]) == (0, 1)
