"""Closed loops: a plant model drives a level record by record; where two loops differ first."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.levels.level import Level, Run
from boresight.sim.records.reader import InputReader
from boresight.sim.records.record import TRUTH, Column, Record, index_place
from boresight.sim.worlds.world import World

__all__ = ["Loop", "Parting", "close_loop", "parting"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Loop:
    """What happened between a world and a level.

    Of a level with several runs side by side every shape has the runs behind n: (n, runs), ...

    Attributes
    ----------
    level : str
    inputs : float64 (n, n_inputs)
        Records that the level saw, in the inputs' units.
    new : bool (n, n_inputs)
        Where the world gave a new sample.
    run : Run
        Outputs, words, saturated updates and states of the level.
    truth : dict of str to float64 (n,)
        True values that the world gave, by output name; NaN where it gave none.
    clamped : dict of str to int
        Samples beyond the range of inputs that are declared to be clamped.
    records_per_s : float
        Of the whole loop.
    """

    level: str
    inputs: FloatArray
    new: npt.NDArray[np.bool_]
    run: Run
    truth: dict[str, FloatArray]
    clamped: dict[str, int]
    records_per_s: float

    @property
    def outputs(self) -> dict[str, FloatArray]:
        """Outputs of the level (n,), in their units."""
        return self.run.outputs

    def record(self, estimator: Estimator, name: str) -> Record:
        """What the level saw as a record, with truths: any level can be run on it again.

        NaN where there was no new sample; a flag of validity has no column.
        """
        seen = np.where(self.new, self.inputs, np.nan)
        columns = {
            i.name: Column(seen[:, k]) for k, i in enumerate(estimator.inputs) if not i.flags
        }
        columns |= {f"{n}{TRUTH}": Column(v) for n, v in self.truth.items()}
        return Record(name, columns, index_place(name))


@dataclass(frozen=True)
class Parting:
    """Where two loops part.

    Attributes
    ----------
    step : int
        First step in which they differ.
    what : str
        Name of the first input that differs there; an output's, if the records were still equal:
        then it is the level, not the loop.
    levels : (str, str)
    values : (float, float)
    same_records : bool
        The records were equal up to and with this step: the levels are to blame.
    """

    step: int
    what: str
    levels: tuple[str, str]
    values: tuple[float, float]
    same_records: bool

    def line(self) -> str:
        """One line for people."""
        a, b = self.levels
        why = "on the same records: these levels differ" if self.same_records else "of the record"
        return (
            f"{a} and {b} part in step {self.step}: {self.what} {why}, "
            f"{self.values[0]!r} and {self.values[1]!r}"
        )


def close_loop(
    world: World,
    level: Level,
    *,
    steps: int | None = None,
    keep: Collection[str] | None = None,
    progress: Callable[[int], None] | None = None,
) -> Loop:
    """Run a world on a level until the world ends, or for ``steps`` records.

    Parameters
    ----------
    world : World
    level : Level
        With as many runs side by side as the world (`sim.levels.registry.make_level`).
    keep : names of outputs, optional
        Outputs and true values that are kept, without words and states; by default everything.
    progress : callable, optional
        Called with the number of records after each 1000.

    Raises
    ------
    InputError
        The world raises, gives no record at all, or one that the estimator cannot take; it has
        another number of runs than the level.
    """
    estimator, runs = level.build.estimators[level.number], world.runs
    if level.runs != runs and (level.runs, runs) != (None, 1):
        raise InputError.at(
            f"world {world.name}",
            wanted=f"as many runs as the level has, {level.runs or 1}",
            found=f"{runs or 1}",
            fix="make the level with runs=world.runs",
        )

    def place(row: int, run: int, name: str) -> str:
        return f"world {world.name}, step {row}, " + (f"run {run}, " * bool(runs)) + name

    reader = InputReader(
        estimator, place, runs=runs or 1, fix="correct the record that the world returns"
    )
    history = _History([o.name for o in estimator.outputs if keep is None or o.name in keep], keep)
    _guarded(world, world.start)
    level.reset()
    outputs: dict[str, Any] | None = None
    start = time.perf_counter()
    while steps is None or reader.rows < steps:
        record = _guarded(world, world.record, outputs)
        if record is None:
            break
        if not isinstance(record, Mapping):
            raise InputError.at(
                f"world {world.name}, step {reader.rows}",
                wanted="a record: values by input name, or None at the end",
                found=type(record).__name__,
                fix="return a dictionary",
            )
        truth = {
            n: reader.number(n + TRUTH, record[n + TRUTH])
            for n in history.names
            if n + TRUTH in record
        }
        row, new = (table[0] for table in reader.take(record))
        run = level.step(row[0] if level.runs is None else row)
        if runs is None:
            outputs = {name: float(value[0]) for name, value in run.outputs.items()}
        else:
            outputs = {name: value.reshape(runs) for name, value in run.outputs.items()}
        history.add(row, new, run, truth)
        if progress is not None and reader.rows % 1000 == 0:
            progress(reader.rows)
    seconds = time.perf_counter() - start
    if not reader.rows:
        raise InputError.at(
            f"world {world.name}",
            wanted="at least one record",
            found="none",
            fix="let record() return None only at the end",
        )
    return history.loop(level, reader.clamped, reader.rows / seconds)


class _History:
    """Records, outputs and true values of a loop, row by row.

    Parameters
    ----------
    names : sequence of str
        Outputs that are kept.
    keep : collection of str or None
        None: words and states are kept too.
    """

    def __init__(self, names: Sequence[str], keep: Collection[str] | None) -> None:
        self.names, self.keep = names, keep
        self.rows: list[tuple[FloatArray, BoolArray]] = []
        self.runs: list[tuple[Any, ...]] = []
        self.truths: list[dict[str, FloatArray]] = []

    def add(self, row: FloatArray, new: BoolArray, run: Run, truth: dict[str, FloatArray]) -> None:
        """Add one record (runs, n_inputs), and what the level and the world gave."""
        whole = (run.words, run.states) if self.keep is None else (None, None)
        self.rows.append((row, new))
        self.runs.append(([run.outputs[n] for n in self.names], run.saturated, *whole))
        self.truths.append(truth)

    def loop(self, level: Level, clamped: dict[str, int], records_per_s: float) -> Loop:
        """Everything as arrays."""
        runs = self.rows[0][0].shape[:1]
        at = 0 if level.runs is None else slice(None)
        inputs, new = (np.stack(part)[:, at] for part in zip(*self.rows, strict=True))
        outputs, *rest = zip(*self.runs, strict=True)
        table = np.array(outputs)[:, :, 0]
        saturated, words, states = (
            None if part[0] is None else np.concatenate(part) for part in rest
        )
        gap = np.full(runs, np.nan)
        known = [n for n in self.names if any(n in truth for truth in self.truths)]
        return Loop(
            level.name,
            inputs,
            new,
            Run({n: table[:, k] for k, n in enumerate(self.names)}, words, saturated, states),
            {n: np.array([t.get(n, gap) for t in self.truths])[:, at] for n in known},
            clamped,
            records_per_s,
        )


def parting(estimator: Estimator, first: Loop, second: Loop) -> Parting | None:
    """Where two loops of one world part; None if they never do.

    Records and outputs are compared exactly: equal levels give equal loops.
    """
    n = min(len(first.inputs), len(second.inputs))
    seen = first.inputs[:n] != second.inputs[:n]
    names = list(first.outputs)
    answered = np.stack([first.outputs[k][:n] != second.outputs[k][:n] for k in names], axis=1)
    differs = seen.any(axis=1) | answered.any(axis=1)
    if not differs.any():
        return None
    step = int(np.argmax(differs))
    levels = (first.level, second.level)
    if seen[step].any():
        k = int(np.argmax(seen[step]))
        values = (float(first.inputs[step, k]), float(second.inputs[step, k]))
        return Parting(step, f"input {estimator.inputs[k].name}", levels, values, False)
    name = names[int(np.argmax(answered[step]))]
    pair = (float(first.outputs[name][step]), float(second.outputs[name][step]))
    return Parting(step, f"output {name}", levels, pair, True)


def _guarded(world: World, call: Callable[..., object], *args: object) -> object:
    """Call a world's method; what it raises becomes one line."""
    try:
        return call(*args)
    except InputError:
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise InputError.at(
            f"world {world.name}, {last.filename.rpartition('/')[2]}, line {last.lineno}",
            wanted="a record",
            found=f"{type(error).__name__}: {error}".splitlines()[0][:200],
            fix="correct the world",
        ) from error
