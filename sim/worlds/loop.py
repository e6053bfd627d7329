"""A source drives a level: closed loops, records in pieces, logs; where two loops differ first."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.model.arrays import BoolArray, FloatArray
from boresight.model.errors import require
from boresight.model.estimator import Estimator
from boresight.model.step import called
from boresight.sim.levels.build import Build, Level, Run
from boresight.sim.levels.registry import CompiledFloat
from boresight.sim.records.feed import Feed, require_rate
from boresight.sim.records.reader import InputReader
from boresight.sim.records.record import TRUTH, Column, Place, Record
from boresight.sim.worlds.world import NamedWorld, World, world_of


@dataclass(frozen=True, eq=False)
class Loop:
    """Records and outputs of a source and a level, in a whole run or a part of it.

    Of a level with several runs side by side every shape has the runs behind n: (n, runs), ...
    """

    level: str
    inputs: FloatArray  #: (n, n_inputs): records that the level saw, in the inputs' units.
    new: BoolArray  #: (n, n_inputs): where the source gave a new sample.
    run: Run  #: outputs, words, saturated updates and states of the level.
    truth: dict[str, FloatArray]  #: (n,): true values of the source, by output name; NaN: none.
    clamped: dict[str, int]  #: samples so far beyond the range of inputs that are to be clamped.
    unused: tuple[str, ...] = ()  #: columns of the source so far without a use.
    dt: FloatArray | None = None  #: (n,): time steps of a world, s; None where it gives none.

    @property
    def outputs(self) -> dict[str, FloatArray]:
        """Outputs of the level (n,), in their units."""
        return self.run.outputs

    @property
    def step_s(self) -> float | None:
        """Median of the time steps above 0 of a world; None without any."""
        steps = np.zeros(0) if self.dt is None else self.dt[self.dt > 0.0]
        return float(np.median(steps)) if len(steps) else None

    @classmethod
    def joined(cls, parts: Sequence[Loop]) -> Loop:
        """Consecutive parts as one loop."""
        run, last = Run.joined([part.run for part in parts]), parts[-1]
        inputs = np.concatenate([part.inputs for part in parts])
        new = np.concatenate([part.new for part in parts])
        truth = {
            name: np.concatenate(
                [part.truth.get(name, np.full(part.new.shape[:-1], np.nan)) for part in parts]
            )
            for name in run.outputs
            if any(name in part.truth for part in parts)
        }
        dt = [part.dt for part in parts if part.dt is not None]
        steps = np.concatenate(dt) if len(dt) == len(parts) else None
        return cls(last.level, inputs, new, run, truth, last.clamped, last.unused, steps)

    def record(self, estimator: Estimator, name: str) -> Record:
        """The inputs of the level as a record, with truths: any level can be run on it again.

        NaN where there was no new sample; a flag of validity has no column. Without an input
        ``dt`` times where the world gives time steps above 0, or a rate is declared.
        """
        samples = np.where(self.new, self.inputs, np.nan)
        columns = dict[str, Column]()
        if all(i.name != "dt" for i in estimator.inputs):
            if self.dt is not None and (self.dt > 0.0).all():
                columns["t"] = Column(np.cumsum(self.dt))
            elif "dt" in estimator.rates_hz:
                columns["t"] = Column(np.arange(len(samples)) / estimator.rates_hz["dt"])
        columns |= {
            i.name: Column(samples[:, k]) for k, i in enumerate(estimator.inputs) if not i.flags
        }
        columns |= {f"{n}{TRUTH}": Column(v) for n, v in self.truth.items()}
        return Record(name, columns, Place(name), notes=self.notes(estimator, name))

    def notes(self, estimator: Estimator, name: str) -> tuple[str, ...]:
        """A line about the columns of the source ``name`` without a use, if there are any."""
        text = f"not used: {', '.join(self.unused)} of {name}, neither inputs nor OUTPUT_true of "
        return (f"{text}{estimator.name}",) if self.unused else ()


def drive(
    source: World | Feed,
    level: Level,
    *,
    steps: int | None = None,
    keep: Collection[str] | None = None,
    anew: bool = True,
) -> Iterator[Loop]:
    """Run a level from a reset on over the records of a source, and yield the loop part by part.

    A part is a record of a world that gets the outputs, one of the `World.pieces` of a world that
    ignores them, or the whole of a log. The level has as many runs side by side as the world
    (`sim.levels.registry.make_level`). A world ends by itself, or after ``steps`` records; of its
    outputs and true values those in ``keep`` are kept, without words and states, by default all.
    ``anew``: a log begins with a reset, and does not go on where the last one ended.
    """
    if isinstance(source, World):
        yield from _world(source, level, steps, keep)
        return
    spans = source.spans(anew)
    runs = [level.run_anew(rows) if begins else level.advance(rows) for rows, begins in spans]
    run = Run.joined(runs)
    yield Loop(level.name, source.inputs, source.new, run, source.truth, source.clamped)


def _world(
    world: World, level: Level, steps: int | None, keep: Collection[str] | None
) -> Iterator[Loop]:
    """`drive` with a world."""
    estimator, runs = level.build.estimators[level.number], world.runs
    where, wanted = f"world {world.name}", f"as many runs as the level has, {level.runs or 1}"
    good = level.runs == runs or (level.runs, runs) == (None, 1)
    require(good, where, wanted, runs or 1, "make the level with runs=world.runs")

    def place(row: int, run: int, name: str) -> str:
        return f"world {world.name}, step {row}, " + (f"run {run}, " * bool(runs)) + name

    reader = InputReader(
        estimator, place, runs=runs or 1, fix="correct the record that the world returns"
    )
    axis = 0 if level.runs is None else slice(None)
    names = [o.name for o in estimator.outputs if keep is None or o.name in keep]
    known = {"t", "dt", *(i.name for i in estimator.inputs)}
    known |= {o.name + TRUTH for o in estimator.outputs}
    unused = dict[str, None]()
    _guarded(world, world.start)
    pieces = _guarded(world, world.pieces)
    good = pieces is not None or type(world).record is not World.record
    fix = "write it: it gets the last outputs and returns the next record"
    require(good, where, "a method record(self, outputs)", None, fix)
    level.reset()
    outputs: dict[str, Any] | None = None
    while steps is None or reader.rows < steps:
        call = (world.record, outputs) if pieces is None else (next, pieces, None)
        columns, n = _guarded(world, *call, step=reader.rows), 1
        if columns is None:
            break
        if pieces is not None:
            columns, n = _rows(world, reader.rows, columns, steps)
        dt = reader.number("dt", columns["dt"], n)[:, axis] if "dt" in columns else None
        if not reader.rows and dt is not None:
            rates = 1.0 / dt[dt > 0.0]  # a step below 0 restarts
            if len(rates):
                rate, fix = float(np.median(rates)), "correct dt, or rates_hz"
                require_rate(estimator, rate, f"{where}, step 0, dt", fix)
        if not known.issuperset(columns):
            unused |= dict.fromkeys(str(name) for name in columns if name not in known)
        truth = {
            name: reader.number(name + TRUTH, columns[name + TRUTH], n)[:, axis]
            for name in names
            if name + TRUTH in columns
        }
        inputs, new = reader.take(columns, n)
        run = level.advance(inputs[:, axis])
        if runs is None:
            outputs = {name: float(value[0]) for name, value in run.outputs.items()}
        else:
            outputs = {name: value[0].reshape(runs) for name, value in run.outputs.items()}
        if keep is not None:
            kept = {name: values for name, values in run.outputs.items() if name in keep}
            run = Run(kept, saturated=run.saturated, fault=run.fault)
        samples = inputs[:, axis], new[:, axis]
        yield Loop(level.name, *samples, run, truth, reader.clamped, tuple(unused), dt)
    fix = "let record() return None only at the end"
    require(reader.rows > 0, where, "at least one record", None, fix)


def close_loop(
    world: World,
    level: Level,
    *,
    steps: int | None = None,
    keep: Collection[str] | None = None,
    progress: Callable[[int], None] | None = None,
) -> Loop:
    """Run a world on a level until the world ends: all that `drive` yields, as one.

    ``progress`` is called with the number of records after each 1000.
    """
    parts, rows = list[Loop](), 0
    for part in drive(world, level, steps=steps, keep=keep):
        parts.append(part)
        previous, rows = rows, rows + len(part.inputs)
        if progress is not None and rows // 1000 > previous // 1000:
            progress(rows)
    return Loop.joined(parts)


def recorded(world: NamedWorld, build: Build, steps: int | None) -> Record:
    """The log of a world in a loop with the float64 form of an estimator."""
    source = world_of(world)
    with CompiledFloat(build) as level:
        return close_loop(source, level, steps=steps).record(build.estimators[0], source.name)


def _rows(
    world: World, rows_read: int, piece: Mapping[str, Any], steps: int | None
) -> tuple[dict[str, Any], int]:
    """Columns of a piece as (n, 1) or (n, runs), at most so many that ``steps`` are done; n."""
    lengths = {len(np.atleast_1d(column)) for column in piece.values()}
    where, found = f"world {world.name}, step {rows_read}", " and ".join(map(str, sorted(lengths)))
    good, fix = len(lengths) == 1 and 0 not in lengths, "give every column a value for each record"
    require(good, where, "columns of one length", f"lengths {found}" if found else None, fix)
    n = lengths.pop() if steps is None else min(lengths.pop(), steps - rows_read)
    columns = {name: np.atleast_1d(column)[:n] for name, column in piece.items()}
    return {name: c[:, None] if c.ndim == 1 else c for name, c in columns.items()}, n


def parting(first: Loop, second: Loop) -> str | None:
    """Where two loops of one world part, as a line for people; None if they never do.

    Outputs are compared exactly. A world gives the same records until they differ.
    """
    names = list(first.outputs)
    pairs = [(first.outputs[name], second.outputs[name]) for name in names]
    differ = np.stack([a[: len(b)] != b[: len(a)] for a, b in pairs], axis=1)
    if not differ.any():
        return None
    step, k = divmod(int(np.argmax(differ)), len(names))
    a, b = (float(values[step]) for values in pairs[k])
    levels = f"{first.level} and {second.level}"
    return f"{levels} part in step {step}: output {names[k]}, {a!r} and {b!r}"


def _guarded(world: World, call: Callable[..., Any], *args: object, step: int | None = None) -> Any:
    """Call a world's method; its exceptions become one line.

    In a step it returns the next record, or the next piece, or None at the end.
    """
    return called(
        call,
        *args,
        where=f"world {world.name}" + ("" if step is None else f", step {step}"),
        wanted="a record: values by input name, or None at the end",
        fix="correct the world",
        kind=object if step is None else Mapping | None,
        answer="return a dictionary",
    )
