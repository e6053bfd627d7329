"""A world and a level, step by step; several levels, and where their loops part."""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.sim.levels.level import Level
from boresight.sim.records.record import TRUTH, Column, Record, index_place
from boresight.sim.worlds.intake import Intake
from boresight.sim.worlds.world import World

__all__ = ["Loop", "Parting", "close_loop", "parting"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Loop:
    """What happened between a world and a level.

    Attributes
    ----------
    level : str
    inputs : float64 (n, n_inputs)
        Records that the level saw, in the inputs' units.
    outputs : dict of str to float64 (n,)
        What it answered, in the outputs' units.
    truth : dict of str to float64 (n,)
        Truths that the world told, by output name; NaN where it told none.
    clamped : dict of str to int
        See `Intake`.
    records_per_s : float
        Of the whole loop.
    """

    level: str
    inputs: FloatArray
    outputs: dict[str, FloatArray]
    truth: dict[str, FloatArray]
    clamped: dict[str, int]
    records_per_s: float

    def record(self, estimator: Estimator, name: str) -> Record:
        """What the level saw as a record, with truths: any level can be run on it again."""
        columns = {i.name: Column(self.inputs[:, k]) for k, i in enumerate(estimator.inputs)}
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
    estimator: Estimator,
    level: Level,
    *,
    steps: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> Loop:
    """Run a world on a level until the world ends, or for ``steps`` records.

    Raises
    ------
    InputError
        The world raises, gives no record at all, or one that the estimator cannot take.
    """
    intake = Intake(estimator, f"world {world.name}")
    _guarded(world, world.start)
    level.reset()
    rows: list[FloatArray] = []
    answers: list[list[float]] = []
    truths: list[dict[str, float]] = []
    names = [o.name for o in estimator.outputs]
    outputs: dict[str, float] | None = None
    start = time.perf_counter()
    while steps is None or len(rows) < steps:
        record = _guarded(world, world.record, outputs)
        if record is None:
            break
        if not isinstance(record, Mapping):
            raise InputError.at(
                f"world {world.name}, step {len(rows)}",
                wanted="a record: values by input name, or None at the end",
                found=type(record).__name__,
                fix="return a dictionary",
            )
        row = intake.take(record)
        truths.append({n: intake.number(record, n + TRUTH) for n in names if n + TRUTH in record})
        outputs = level.step(row)
        rows.append(row)
        answers.append([outputs[name] for name in names])
        if progress is not None and len(rows) % 1000 == 0:
            progress(len(rows))
    seconds = time.perf_counter() - start
    if not rows:
        raise InputError.at(
            f"world {world.name}",
            wanted="at least one record",
            found="none",
            fix="let record() return None only at the end",
        )
    table = np.array(answers)
    told = [n for n in names if any(n in t for t in truths)]
    return Loop(
        level.name,
        np.array(rows),
        {n: table[:, k] for k, n in enumerate(names)},
        {n: np.array([t.get(n, np.nan) for t in truths]) for n in told},
        intake.clamped,
        len(rows) / seconds,
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
