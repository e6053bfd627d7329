"""Waveforms with a program's own names: a core's signals in a window of updates, as VCD.

The simulator writes what the core does. Its writes of registers, its words in and out and its
program counter become the program's values in their units (half turns in degrees), the microword at
work, and the author's line of the value that each lane computes; nothing is taken from a model. A
cycle is 10 ns, in which everything is as before the rising edge that ends it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TextIO

from vcd.gtkw import GTKWSave

from boresight.gateware.core import Core
from boresight.gateware.microcode.listing import actions
from boresight.model.places import Place
from boresight.model.words.fixed import IntArray, wrap
from boresight.model.words.program import Kind
from boresight.sim.rtl.harness import CompiledSimulation

_WaveValue = int | float | str

#: Nanoseconds of a cycle.
_CYCLE = 10
#: Scopes of the bench and of the core in the simulator's file.
_BENCH, CORE = "TOP.stepped.bench", "TOP.stepped.bench.dut"
_VAR = re.compile(r"\$var \w+ +\d+ (\S+) ([\w.]+) (?:\[\S+\] )?\$end")
#: Blanks in strings, an extension of GTKWave's.
_ESCAPED = str.maketrans({" ": r"\x20", "\t": r"\t", "\\": r"\\"})


@dataclass(frozen=True)
class Signal:
    """A signal of a file: path, label in a viewer, kind (wire, integer, real or string)."""

    path: str
    label: str
    kind: str = "real"


@dataclass(frozen=True)
class Wave:
    """Signals of a file of waveforms, for the layouts of viewers.

    Attributes
    ----------
    groups : mapping of str to sequence of Signal
        Shown signals, from top to bottom.
    cycles : int
        Cycles of the clock.
    """

    groups: Mapping[str, Sequence[Signal]]
    cycles: int

    def gtkwave(self, file: TextIO, vcd: str) -> None:
        """Write the save file with which GTKWave opens ``vcd``."""
        save = GTKWSave(file)
        save.dumpfile(vcd, abspath=False)
        save.signals_width(300)
        forms = {"wire": "bin", "integer": "dec", "real": "real", "string": "ascii"}
        for group, signals in self.groups.items():
            with save.group(group, closed=group == "values"):
                for s in signals:
                    save.trace(s.path, alias=s.label, datafmt=forms[s.kind])

    def surfer(self, file: TextIO, vcd: str) -> None:
        """Write the command file with which Surfer opens ``vcd``."""
        print(f"load_file {vcd}", file=file)
        for group, signals in self.groups.items():
            print(f"divider_add {group}", file=file)
            for s in signals:
                print(f"variable_add {s.path}", file=file)
        print("zoom_fit", file=file)


def write_wave(
    core: Core, lines: Mapping[int, str], inputs: IntArray, first: int, stop: int, file: TextIO
) -> Wave:
    """Run records in Verilator, and write updates ``first`` to ``stop`` - 1 as VCD.

    Parameters
    ----------
    core : Core
        Its selected program runs.
    lines : mapping of int to str
        The author's line of values of the program, "file.py, line 41".
    inputs : int64 (steps, n_inputs)
        Records from the core's reset on, at least ``stop``.

    Raises
    ------
    ToolMissing, SimulationFailed
        As `CompiledSimulation`.
    """
    start = max(first - 1, 0)  # all values are written in an update: then all are known
    simulation = CompiledSimulation(core, trace=True)
    with simulation.record(inputs[:stop], start, stop) as path, path.open() as trace:
        scopes, core_codes, codes = wires_of(trace)
        view, state = _View(core, lines, start), dict[str, str]()
        head = "$version Boresight $end\n$timescale 1 ns $end\n"
        print(f"{head}{view.declarations()}{scopes}$enddefinitions $end", file=file)

        def wire(name: str) -> int:
            return _bits(state[codes[name]])

        cycles = 0
        for cycle, changes in changes_of(trace):
            state |= changes
            row, changed = view.row, view.cycle(wire)
            if row < first:
                continue
            if not cycles:
                changes, changed = state, view.values
            cycles += row < stop
            wires = (line for code, line in changes.items() if code in core_codes)
            text = [*wires, *(view.change(*item) for item in changed.items())]
            time = _CYCLE * cycle
            print(f"#{time}", *text, view.change("clk", 1), sep="\n", file=file)
            if row == stop:  # writes of the last cycle of the window
                break
            print(f"#{time + _CYCLE // 2}", view.change("clk", 0), sep="\n", file=file)
        return Wave(view.groups, cycles)


def wires_of(trace: TextIO) -> tuple[str, set[str], dict[str, str]]:
    """The scopes of the core, the codes in them, and the code of each wire by its path."""
    path, out, core_codes, codes = list[str](), list[str](), set[str](), dict[str, str]()
    for line in map(str.strip, trace):
        if line.startswith("$enddefinitions"):
            break
        if line.startswith("$scope"):
            path.append(line.split()[2])
        match, inside = _VAR.fullmatch(line), ".".join(path).startswith(CORE)
        if match:
            codes[".".join([*path, match[2]])] = match[1]
            core_codes |= {match[1]} if inside else set()
        if inside and (match or line.startswith(("$scope", "$upscope"))):
            out.append(line.replace("module dut", "module core"))
        if line.startswith("$upscope"):
            path.pop()
    return "\n".join([*out, ""]), core_codes, codes


def changes_of(trace: TextIO) -> Iterator[tuple[int, dict[str, str]]]:
    """Each cycle, and the lines of its changes by code."""
    cycle, last, changes = None, None, dict[str, str]()
    for line in map(str.strip, trace):
        if line.startswith("#"):
            if cycle is not None:
                yield cycle, changes
            last, cycle, changes = cycle, int(line[1:]), {}
            # Nothing has changed in cycles that the simulator left out.
            yield from ((k, {}) for k in range(cycle if last is None else last + 1, cycle))
        elif line[:1] in ("0", "1"):
            changes[line[1:]] = line
        elif line[:1] == "b":
            changes[line.rpartition(" ")[2]] = line
    if cycle is not None:
        yield cycle, changes


def _bits(line: str) -> int:
    return int(line[1:].partition(" ")[0], 2) if line[0] == "b" else int(line[0])


class _View:
    """The program's values as the core computes them: `cycle` for each cycle, in order.

    ``values`` are by path, as they are now; ``row`` is the number of the update.
    """

    def __init__(self, core: Core, lines: Mapping[int, str], row: int) -> None:
        schedule, machine, program = core.schedule, core.machine, core.schedule.program
        self.program, self.row, self.word = program, row, machine.arithmetic.word
        self.lanes = machine.lanes
        self.base = core.image.bases[core.number]
        texts = actions(core.image.program(core.number), schedule, core.allocation)
        self.at_work: list[dict[str, str]] = []
        computed = {
            (s.cycle, s.lane): program.ops[s.op].dest for s in schedule.slots if s.op is not None
        }
        names = self._names()
        for k, (*issued, events) in enumerate(texts):
            row_texts = {"moves": events}
            for lane in range(self.lanes):
                value = computed.get((k, lane))
                row_texts[f"operation{lane}"] = issued[lane].strip()
                row_texts[f"value{lane}"] = "" if value is None else names[value]
                row_texts[f"line{lane}"] = "" if value is None else _source(lines.get(value, ""))
            self.at_work.append({f"machine.{name}": text for name, text in row_texts.items()})
        gets = zip(schedule.gets, program.inputs, strict=True)
        self.writes = {(0, cycle): value for cycle, value in gets} | {
            (schedule.ends[k].lane, schedule.write_cycle(k)): op.dest
            for k, op in enumerate(program.ops)
        }
        self.emits = {cycle - 1: k for k, cycle in enumerate(schedule.latencies)}
        self._declare(names)
        self.words = {
            k: v.initial
            for k, v in enumerate(program.values)
            if v.kind in (Kind.CONST, Kind.PARAM, Kind.STATE)
        }
        self._next_values = dict[str, _WaveValue]()  # values from the next cycle on
        # Addresses of the word at work and of the one out of the ROM.
        self.work = self.rom = self.base
        for value in self.words:
            self._show(value)

    def _names(self) -> list[str]:
        """A name for each value: of a next value that of its state."""
        program = self.program
        nexts = {successor: program.values[state].name for state, successor in program.states}
        names = list[str]()
        for k, value in enumerate(program.values):
            is_computed = value.kind is Kind.OP
            name = f"{nexts[k]}_next" if is_computed and k in nexts else value.name
            name = re.sub(r"\W", "_", name)
            names.append(f"{name}_{k}" if name in names else name)
        return names

    def _declare(self, names: Sequence[str]) -> None:
        """Paths, identifiers and groups of all signals."""
        program = self.program
        scopes = {Kind.INPUT: "inputs", Kind.PARAM: "params", Kind.STATE: "states"}
        units = {p.name: p.unit for p in program.ports}
        self.paths = dict[int, str]()
        groups: dict[str, list[Signal]] = {
            "machine": [
                Signal("clk", "clk", "wire"),
                Signal("row", "row", "integer"),
                Signal("cycle", "cycle", "integer"),
                *(
                    Signal(f"machine.{name}{lane}", f"{name}, lane {lane}", "string")
                    for lane in range(self.lanes)
                    for name in ("operation", "value", "line")
                ),
                Signal("machine.moves", "written, streams", "string"),
            ],
            **{name: [] for name in ("inputs", "outputs", "states", "params", "values")},
        }
        for k, value in enumerate(program.values):
            scope = scopes.get(value.kind, "values")
            if value.kind is not Kind.CONST:
                self.paths[k] = f"{scope}.{names[k]}"
                label = _labelled(names[k], value.unit)
                groups[scope].append(Signal(self.paths[k], label))
        for name in program.output_names:
            groups["outputs"].append(
                Signal(f"outputs.{name}", _labelled(name, units.get(name, "")))
            )
        self._kinds = {s.path: s.kind for signals in groups.values() for s in signals}
        self._ids = {path: f"own{k}" for k, path in enumerate(self._kinds)}
        root = re.sub(r"\W", "_", program.name)
        self.groups = {
            name: [Signal(f"{root}.{s.path}", s.label, s.kind) for s in signals]
            for name, signals in groups.items()
            if signals
        }
        initial: dict[str, _WaveValue] = {"string": "", "real": 0.0}
        self.values: dict[str, _WaveValue] = {
            path: initial.get(kind, 0) for path, kind in self._kinds.items() if path != "clk"
        }
        self.values["row"] = self.row
        self._texts = [path for path, kind in self._kinds.items() if kind == "string"]
        #: Factors of values in half turns.
        self.scales = {k: 180.0 for k, v in enumerate(program.values) if v.unit == "ht"}

    def declarations(self) -> str:
        """Lines of the header."""
        root = re.sub(r"\W", "_", self.program.name)
        out, scope = [f"$scope module {root} $end"], ""
        types = {"wire": "wire 1", "integer": "integer 64", "real": "real 64", "string": "string 1"}
        for path, kind in self._kinds.items():
            parent, _, name = path.rpartition(".")
            if parent != scope:
                out += ["$upscope $end"] if scope else []
                out += [f"$scope module {parent} $end"] if parent else []
                scope = parent
            out.append(f"$var {types[kind]} {self._ids[path]} {name} $end")
        return "\n".join([*out, *(["$upscope $end"] if scope else []), "$upscope $end", ""])

    def change(self, path: str, value: _WaveValue) -> str:
        """The line of a change."""
        kind, code = self._kinds[path], self._ids[path]
        if kind == "wire":
            return f"{value}{code}"
        if kind == "integer":
            return f"b{int(value):b} {code}"
        return (
            f"s{str(value).translate(_ESCAPED)} {code}" if kind == "string" else f"r{value} {code}"
        )

    def cycle(self, wire: Callable[[str], int]) -> dict[str, _WaveValue]:
        """Take the wires of a cycle, by path; return the changes."""
        changed, self._next_values = self._next_values, {}
        at = self.work - self.base
        active = bool(wire(f"{CORE}.sequencer.active")) and 0 <= at < len(self.at_work)
        changed |= self.at_work[at] | {"cycle": at} if active else dict.fromkeys(self._texts, "")
        if active:
            self._take(at, wire)
        if wire(f"{CORE}.en"):
            self.work, self.rom = self.rom, wire(f"{CORE}.sequencer.pc")
        changed = {path: x for path, x in changed.items() if self.values[path] != x}
        self.values |= changed
        return changed

    def _take(self, at: int, wire: Callable[[str], int]) -> None:
        """Words that the core writes and sends in a cycle are shown in the next one."""
        for lane in range(self.lanes):
            value = self.writes.get((lane, at))
            if value is not None and wire(f"{_BENCH}.w_en") >> lane & 1:
                self.words[value] = wrap(wire(f"{_BENCH}.w_data") >> self.word * lane, self.word)
                self._show(value)
        output = self.emits.get(at)
        if output is not None and wire(f"{_BENCH}.out_valid") and wire(f"{_BENCH}.out_ready"):
            word = wrap(wire(f"{_BENCH}.out_payload"), self.word)
            path = f"outputs.{self.program.output_names[output]}"
            self._next_values[path] = self._real(self.program.outputs[output], word)
        if wire(f"{CORE}.commit"):
            nexts = [(state, self.words.get(successor)) for state, successor in self.program.states]
            self.words |= {state: word for state, word in nexts if word is not None}
            for state, _ in nexts:
                self._show(state)
            self.row += 1
            self._next_values["row"] = self.row

    def _real(self, value: int, word: int) -> float:
        return float(self.program.format(value).real(word)) * self.scales.get(value, 1.0)

    def _show(self, value: int) -> None:
        """Show the word of a value from the next cycle on."""
        if value in self.paths:
            self._next_values[self.paths[value]] = self._real(value, self.words[value])


def _labelled(name: str, unit: str) -> str:
    unit = "deg" if unit == "ht" else unit
    return f"{name}, {unit}" if unit else name


def _source(place: str) -> str:
    """A line, "file.py, line 41", with its text where its file can be read."""
    text = place.source() if isinstance(place, Place) else ""
    return f"{place}: {text}" if text else place
