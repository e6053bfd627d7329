"""Run an estimator on a log, in a closed loop with a world, or on the simulated board.

boresight run my_filter.py log.csv -o out.csv  # fixed point; one row for each row of the log
boresight run my_filter.py log.csv --levels float  # float64; writes my_filter-float.csv
boresight run my_filter.py log.csv --param @tuned.json --param alpha=0.02  # other parameters
boresight run pi.py plant.py:Plant --levels rtl,c  # a closed loop, in two forms
boresight run pi.py plant.py:Plant -o loop.csv  # write the records of the loop as a log
boresight run mekf board -o build  # the complete system with its sensors
boresight run mekf "board(source='counts', seconds=2)" -o build  # with other settings
boresight run flight.ulg -o flight.csv --from 10s --to 70s  # convert a log
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter

from boresight import options
from boresight.gateware.machine import machine_named
from boresight.model.arrays import FloatArray
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError, require, require_choice, require_whole
from boresight.model.estimator import Estimator
from boresight.model.resolve import call_of
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.settings import CURRENT
from boresight.model.tools.files import OutputFile, output_folder
from boresight.model.words.fixed import check_word
from boresight.sim.accuracy.figures import Angles
from boresight.sim.boards import board_system
from boresight.sim.compare.difference import Differences, differences, turn_notes
from boresight.sim.compare.textbook import wrong_steps
from boresight.sim.compare.verdict import judge, saturated_text, saturations
from boresight.sim.levels.build import Build
from boresight.sim.levels.build import Level as Machine
from boresight.sim.levels.registry import LEVELS, make_level
from boresight.sim.records import files
from boresight.sim.records.feed import Feed, feeds
from boresight.sim.records.record import Column, Record
from boresight.sim.result import Result
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.worlds.loop import Loop, close_loop, drive, parting
from boresight.sim.worlds.world import World, drawn, is_world, world_of

GROUPS = (options.rows, options.profiles)

#: Levels without words.
_FLOATS = {"numpy", "float"}
#: Rows of a log that are in memory at once where nothing but a summary is asked for.
_ROWS = 1 << 15
#: Largest seed of a draw.
_SEED_MOST = 2**31
_ROW_OPTIONS = "--from, --to, --every, --gaps, --map"
#: Options that some sources have no use for, and the sources that have.
_SOURCES = {
    "levels": "a log or a world",
    "word": "a log or a world",
    "steps": "a log or a world",
    "seed": "a world",
    _ROW_OPTIONS: "a log",
    "config": "an estimator, and no faults",
    "param": "an estimator, and no faults",
    "--profile": "an estimator",
    "output": "a log, a world, or a board without faults",
}


def run(
    estimator: options.EstimatorName,
    source: Annotated[Any, Parameter(show_default=False)] = None,
    /,
    *,
    levels: options.Level = (),
    config: options.Config = "small",
    word: options.Word = 32,
    params: options.Params = None,
    steps: options.Steps = None,
    seed: int | None = None,
    output: Annotated[
        str | Path | None, Parameter(name=["--output", "-o"], metavar="FILE|DIR")
    ] = None,
    progress: options.Progress = None,
    rows: Annotated[int | None, options.PythonOnly] = None,
) -> Result:
    """Run an estimator on a log, in a closed loop with a world, or on the simulated board.

    A log alone is converted to another kind of file. Returns on a log ``outputs`` by name, ``t``,
    ``truth`` (differences from the log's truths), ``clamped``, ``saturated``; in a loop
    ``accuracy`` and ``truth``, ``records``, ``parting``. Raises InputError for an unknown
    estimator, source or form, a bad log, a world that raises or returns no record, and output that
    cannot be written.

    Parameters
    ----------
    source : path, mapping of arrays, table, Record, World or str
        A log; a world, as FILE.py:CLASS or by its name; or board, the complete system with its
        sensors, simulated. Settings, as in board(seconds=2): seconds to simulate, by default 1;
        source, what the compass sends, "heading" or "counts"; feed={"NAME": VALUE}, the inputs
        without a sensor; log=FILE, the nine-axis log that the sensors repeat; faults=True, every
        fault of both sensors in turn, and nothing else.
    levels : sequence of str
        On a log one form: float (compiled float64), numpy (float64 as written), fixed (the integer
        model, the default), c or rtl. In a loop one or several, c by default; each further form is
        compared with the first.
    seed : int, optional
        Seed of the world's draw, as in montecarlo; by default the world as it is.
    output : path, optional
        File for the outputs of a log or the records of a loop; the suffix decides the format, and
        angles are in degrees. The command line writes ESTIMATOR-FORM.csv by default. A folder
        for the board.
    rows : int, optional
        Read, run and write a file in pieces of so many rows, for a log that is longer than memory;
        the result has no arrays then. By default all at once.
    """
    given = {"levels": bool(levels), "word": word != 32, "steps": steps is not None}
    given["seed"] = seed is not None
    profiles = CURRENT.get().profiles
    if source is None:
        others = {"config": config != "small", "param": params, "--profile": profiles is not None}
        _refuse_unused("a log alone", {**given, **others})
        return _copied(estimator, output)
    machine_named(config)
    check_word(word)
    require_whole("steps", steps, 1)
    require_whole("seed", seed, 0, _SEED_MOST)
    levels = [levels] if isinstance(levels, str) else [*levels]
    for level in levels:
        require_choice("levels", level, LEVELS)
    if isinstance(source, str) and source.partition("(")[0] == "board":
        wanted = "32, the bits in which the simulated board computes"
        require(word == 32, "word", wanted, word, "leave it out")
        _refuse_unused("a board", given)
        return _on_board(estimator, source, config, params, output, progress)
    found = find_estimator(estimator)
    build = Build(found, config=config, word=word, params=[options.params_of(estimator, params)])
    if is_world(source):
        _refuse_unused("a world", {_ROW_OPTIONS: CURRENT.get().rows})
        world = world_of(source)
        if seed is not None:
            drawn(world, seed)
        return _in_loop(world, build, levels or ["c"], steps, output, progress)
    _refuse_unused("a log", {"seed": given["seed"]})
    require(len(levels) < 2, "levels", "a world", "a log", "choose one form")
    return _on_log(build, source, levels[0] if levels else "fixed", steps, output, rows)


def typed(words: Sequence[Any], given: Mapping[str, Any], shown: Any) -> dict[str, Any]:
    """Write the outputs of a log, piece by piece."""
    if len(words) < 2 or is_world(words[1]) or words[1].partition("(")[0] == "board":
        return {}
    level = (given.get("levels") or ["fixed"])[0]
    more: dict[str, Any] = {"rows": None if shown.json else _ROWS}
    if "output" not in given and not shown.json:
        more["output"] = f"{find_estimator(words[0]).name}-{level}.csv"
    return more


def _refuse_unused(source: str, given: Mapping[str, Any]) -> None:
    """Raise InputError for the first option that is given and that ``source`` does not use."""
    for name, value in given.items():
        require(not value, name, _SOURCES[name], source, "leave it out")


def _copied(log: Any, output: str | Path | None) -> Result:
    """A log written as another kind of file, block by block."""
    is_log = isinstance(log, str | Path) and ".py" not in str(log) and Path(log).exists()
    fix = "name both; a log alone is written as another file"
    require(is_log, "run", "an estimator and a log, a world or board", f"{log} alone", fix)
    if output is None:
        raise InputError.at("--output", wanted="the file to write", found="none", fix="name it")
    files.check_written(output)
    count, notes = 0, dict[str, None]()

    def counted() -> Iterator[Record]:
        nonlocal count
        for block in files.blocks_of(log):
            count += len(block)
            notes.update(dict.fromkeys(block.notes))
            yield block

    with OutputFile(output, inputs=[log]).opened() as file:
        files.write_pieces(str(output), file, counted())
    data = {"log": str(output), "rows": count}
    return Result(data, summary=f"{count:,} rows to {output}", notes=[*notes])


def _on_board(
    estimator: Any,
    source: str,
    config: str,
    params: options.Params,
    output: str | Path | None,
    progress: options.Progress,
) -> Result:
    _, unnamed, given = call_of(source, source)
    found = ", ".join(map(repr, unnamed))
    require(not unnamed, "board", "settings by name, as in board(seconds=1)", found)
    settings: dict[str, Any] = {"seconds": 1.0, "source": "heading", "feed": None, "log": None}
    for name in given:
        require_choice("board", name, [*settings, "faults"])
    settings |= given
    faults, log = settings.pop("faults", False), settings.pop("log")
    inputs = [log] if isinstance(log, str | Path) else []
    _refuse_unused("a board without log=FILE", {_ROW_OPTIONS: CURRENT.get().rows and not inputs})
    board = board_system()
    programs = [estimator, *board.programs]
    values = options.params_of_each([estimator], params, board.programs)
    of = {find_estimator(n).name: v for n, v in zip(programs, values, strict=True) if v}
    result: Result
    if faults:
        unused = {"param": of, "config": config != "small", "output": output}
        _refuse_unused("a board with faults", unused)
        found = f"{', '.join(sorted({*given} - {'faults'}))} beside faults"
        require(len(given) == 1, "board", "faults=True alone", found, "leave the others out")
        result = board.simulate_faults(estimator, progress=progress)
        return result
    say = progress or (lambda text: None)
    with output_folder(output or "build", "run", files=board.files, inputs=inputs) as place:
        more = {"config": config, "params": of, "say": say, **settings}
        result = board.simulate(place, estimator, log, **more)
    return result


def _in_loop(
    world: World,
    build: Build,
    levels: Sequence[str],
    steps: int | None,
    output: str | Path | None,
    progress: options.Progress,
) -> Result:
    """The loop of a world and an estimator on each level.

    Integer levels (fixed, c, rtl) give the same loop, bit by bit: where they part, something is
    wrong. Float64 runs on the records that the first loop saw, since loops of their own part
    sooner or later: its differences are judged by the outputs' tolerances. The first loop with
    words is judged.
    """
    (estimator,) = build.estimators
    target = None if output is None else OutputFile(output)
    say = progress or (lambda text: None)

    def close(name: str) -> Loop:
        say(f"{world.name} and {estimator.name} on {name}")
        with make_level(name, build) as level:
            return close_loop(
                world, level, steps=steps, progress=lambda n: say(f"{name}: {n:,} records")
            )

    loops = {name: close(name) for name in dict.fromkeys(levels)}
    first, loop = next(iter(loops.items()))
    partings = {n: parting(loop, other) for n, other in loops.items() if n != first}
    judged = next((x for n, x in loops.items() if n not in _FLOATS), loop)
    reference = make_level("float", build).run(judged.inputs)
    accuracy = judge(build, 0, judged.inputs, judged.run, reference, judged.clamped)
    if target is not None:
        target.write(files.content_of(str(output), loop.record(estimator, world.name)))
    lines = [
        f"{world.name} and {estimator.name} on {first}: {len(loop.inputs):,} records",
        *(p or f"the same records and outputs as on {n}, bit by bit" for n, p in partings.items()),
    ]
    parted = [n for n, p in partings.items() if p and not {first, n} & _FLOATS]
    failures = [f"{first} and {n} part" for n in parted]
    lines += loop.notes(estimator, world.name)
    if loops.keys() <= _FLOATS:
        lines.append("no fixed point was judged: choose --levels fixed, c or rtl")
    failures += [] if accuracy.good else accuracy.faults()
    truth = differences(estimator.outputs, loop.outputs, loop.truth, judged=False)
    compared = {"from float64 on the same records": accuracy.differences, "from truth": truth}
    heads = ("output", "error", "max", "rms", "unit", "accepted")
    rows = [
        dict(zip(heads, (d.output, what, d.largest, d.rms, d.unit, d.tolerance), strict=True))
        for what, several in compared.items()
        for d in several
        if math.isfinite(d.largest)
    ]
    data = {
        "world": world.name,
        "estimator": estimator.name,
        "levels": [*loops],
        "records": len(loop.inputs),
        "parting": partings,
        "accuracy": [*accuracy.differences],
        "truth": truth,
        "clamped": loop.clamped,
        "saturated_updates": accuracy.saturated_updates,
        "saturated": accuracy.saturated,
        "unused": loop.unused,
        "causes": accuracy.causes(),
    }
    notes = [*wrong_steps(build, loop.inputs, loop.step_s), *turn_notes(truth)]
    notes += accuracy.causes()
    return Result(data, {"errors": rows}, "\n".join(lines), notes, failures)


class _Summary:
    """Summary of a log, built piece by piece; arrays are kept only if it is read at once."""

    def __init__(self, build: Build, *, whole: bool) -> None:
        self.build, self.estimator, self.whole = build, build.estimators[0], whole
        self.rows, self.saturated, self.fault = 0, 0, ""
        self.angles, self.warnings = Angles(), list[str]()

    def add(self, columns: Feed, loop: Loop) -> None:
        """Take the next rows; raises InputError if an output is infinite."""
        outputs = loop.outputs
        _check_finite(self.estimator, outputs, self.rows)
        if not self.rows:
            self.warnings = wrong_steps(self.build, columns.inputs, columns.step_s)
            declared = self.estimator.outputs
            self.truth = Differences(declared, columns.truth, judged=False, curves=self.whole)
        truth = {n: np.where(columns.counts, v, np.nan) for n, v in columns.truth.items()}
        self.truth.add(outputs, truth)
        if {*QUATERNION} <= outputs.keys() & columns.truth.keys():
            self.angles.add(attitude_of(outputs), attitude_of(columns.truth), columns.counts)
        self.rows += len(columns)
        self.saturated += loop.run.n_saturated
        self.fault = self.fault or loop.run.fault
        self.columns, self.outputs = columns, outputs

    def result(self, level: str, saturated: Mapping[str, int], output: str | Path | None) -> Result:
        """The result; ``saturated`` are updates by the name of the value, of a pipe none."""
        every = self.truth.result()
        rmse = self.angles.result() if self.angles.samples else None
        data = {
            "estimator": self.estimator.name,
            "level": level,
            "log": self.columns.record.name,
            "rows": self.rows,
            "t": self.columns.t if self.whole else None,
            "outputs": self.outputs if self.whole else {},
            "units": {o.name: o.unit for o in self.estimator.outputs},
            "truth": every,
            "rmse_deg": rmse,
            "clamped": dict(self.columns.clamped),
            "saturated_updates": self.saturated,
            "saturated": saturated,
        }
        text, of = f"{self.rows} rows" + (f" to {output}" if output is not None else ""), "truth"
        known = [d for d in every if math.isfinite(d.rms)]
        figures = [f"{d.output} {d.rms:.4g} {d.unit}".rstrip() for d in known]
        if rmse is not None:
            figures, of = [f"{n} {value:.3f}" for n, value in rmse.items()], "reference, deg"
        if figures:
            text += f", RMSE against the log's {of}: {', '.join(figures)}"
        notes = [*self.columns.warnings, *self.warnings, *turn_notes(every)]
        notes += [saturated_text(self.saturated, saturated)] if self.saturated else []
        failures = [f"{level}: {self.fault}"] if self.fault else []
        return Result(data, {}, "" if self.fault else text, notes, failures)


def _on_log(
    build: Build,
    log: Any,
    level: str,
    steps: int | None,
    output: str | Path | None,
    rows: int | None,
) -> Result:
    (estimator,) = build.estimators
    is_file = isinstance(log, str | Path)
    target = None
    if output is not None:
        where, wanted = f"{estimator.name}, output t", "another name for what is written"
        found, fix = "t, the column of the times", "rename the output, or leave -o out"
        require(all(o.name != "t" for o in estimator.outputs), where, wanted, found, fix)
        files.check_written(output)
        target = OutputFile(output, inputs=[log] if is_file else [])
    summary = _Summary(build, whole=rows is None)

    def read() -> Iterator[Feed]:
        """The leading rows of the log, in pieces or as one."""
        if is_file and rows is not None:
            return feeds(estimator, files.Log("", Path(log), steps).blocks(rows))
        return feeds(estimator, [files.record_of(log).head(steps)])

    def written(machine: Machine) -> Iterator[Record]:
        """The level on the log, piece by piece: its rows, if a file takes them."""
        for piece, columns in enumerate(read()):
            (loop,) = drive(columns, machine, anew=piece == 0)
            summary.add(columns, loop)
            if target is not None:
                yield _record(estimator, columns.t, loop.outputs)

    with make_level(level, build) as machine:
        machine.traced = False
        if target is None:
            deque(written(machine), maxlen=0)
        else:
            with target.opened() as file:
                files.write_pieces(str(output), file, written(machine))
        saturated = dict[str, int]()
        is_pipe = is_file and Path(log).is_fifo()
        if summary.saturated and not is_pipe:  # which gives its rows once
            spans = (s for columns in read() for s in columns.spans(False))
            saturated = saturations(machine, spans)
    return summary.result(level, saturated, output)


def _check_finite(estimator: Estimator, outputs: Mapping[str, FloatArray], start: int) -> None:
    """Raise InputError if an output of the steps from ``start`` on is infinite."""
    infinite = {o: int(np.argmax(at)) for o, v in outputs.items() if (at := np.isinf(v)).any()}
    if infinite:
        output = min(infinite, key=infinite.__getitem__)
        step = start + infinite[output]
        where = f"{estimator.name}, output {output}, step {step}"
        found = "an infinite one: the estimator diverges"
        fix = f"--steps {step} gives the rows before it" if step else "correct the estimator"
        require(False, where, "a finite value", found, fix)


def _record(
    estimator: Estimator, t: FloatArray | None, outputs: Mapping[str, FloatArray]
) -> Record:
    columns = {} if t is None else {"t": Column(t, "s")}
    for o in estimator.outputs:
        half_turns = o.unit == "ht"
        values = outputs[o.name] * (180.0 if half_turns else 1.0)
        columns[o.name] = Column(values, "deg" if half_turns else o.unit or None)
    return Record(estimator.name, columns).of_numbers()
