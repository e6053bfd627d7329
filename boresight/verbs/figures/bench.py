"""Interpreter against C on 10,000,000 updates, and their rates.

boresight bench  # the filters of the main job
boresight bench my_filter.py --updates 100000  # one's own, for less long
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from boresight.arguments import check_number
from boresight.firmware.build import CModel
from boresight.model.arrays import BoolArray
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator
from boresight.model.resolve import Named
from boresight.model.resolve import estimator_of as find_estimator
from boresight.model.words.fixed import IntArray
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program
from boresight.options import Arguments, EstimatorName, Outcome, PythonOnly, Verb
from boresight.sharing import estimator_names
from boresight.sim.answer import Answer
from boresight.sim.levels.build import Build
from boresight.sim.levels.integer import words_of
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record

__all__ = ["BenchResult", "bench", "random_inputs"]


@dataclass(frozen=True)
class BenchResult(Answer):
    """What `bench` gives.

    Attributes
    ----------
    estimator : str
    updates_compared, mismatches : int
        Updates of interpreter and C, and how many differ.
    interpreter_updates_per_s, c_updates_per_s : int
    ratio_c_to_interpreter : float
        Of the two rates.
    compile_seconds : float
        CPU time from the estimator to the core's Verilog.
    source : str
        How all this was measured.
    """

    estimator: str
    updates_compared: int
    mismatches: int
    interpreter_updates_per_s: int
    c_updates_per_s: int
    ratio_c_to_interpreter: float
    compile_seconds: float
    source: str

    def __str__(self) -> str:
        return "\n".join(
            f"{k:28s} {v:,}" if isinstance(v, int) else f"{k:28s} {v}"
            for k, v in self.to_json().items()
        )


#: Most updates of a comparison: all their words are held in memory.
_MOST = 100_000_000


def random_inputs(n: int, count: int, word: int, rng: np.random.Generator) -> IntArray:
    """Input words (n, count): uniform, small and extreme ones mixed."""
    limit = 1 << (word - 1)
    words = rng.integers(-limit, limit, (n, count))
    kind = rng.integers(0, 4, (n, count))
    words = np.where(kind == 1, words >> rng.integers(1, word - 1, (n, count)), words)
    return np.where(kind == 2, np.where(words < 0, -limit, limit - 1), words)


def _recorded(
    estimator: Estimator, program: Program, count: int, rng: np.random.Generator
) -> tuple[IntArray, str]:
    """Input words (n, n_inputs) as sensors give them, at least ``count``, and what they are."""
    try:
        words = feed(estimator, read_record(bundled("ximu_walk"))).words(program)
        if len(words) > count:
            return words, "windows of the bundled recording"
    except InputError:
        pass  # it asks for other columns
    low = np.array([i.low for i in estimator.inputs])
    high = np.array([i.high for i in estimator.inputs])
    real = rng.uniform(low, high, (max(count + 1, 10_000), len(low)))
    return words_of(program, real), "drawn from the declared ranges"


def bench(
    name: Named = "complementary",
    *,
    updates: int = 10_000_000,
    runs: Annotated[int, PythonOnly] = 20_000,
    progress: Callable[[str], None] | None = None,
) -> BenchResult:
    """Measure updates per second and prove interpreter = C over ``updates`` updates.

    The interpreter runs ``runs`` logs side by side: one half windows of the bundled recording (of
    values drawn from the declared ranges, where it does not feed the estimator), one half random
    words; the C model gets the same words.

    Parameters
    ----------
    updates : int
        Updates of each estimator.
    runs : int
        Logs side by side.

    Returns
    -------
    BenchResult
        Rates, the number of updates compared and of mismatches, compile time.
    """
    say = progress or (lambda text: None)
    estimator = find_estimator(name)
    check_number("updates", updates, 1, _MOST)
    start = time.process_time()
    build = Build(estimator, config="fast")
    build.core.verilog(instances=True)
    compile_seconds = _cpu_since(start)
    (program,) = build.programs
    rng = np.random.default_rng(1)
    steps = -(-updates // runs)
    recorded, source = _recorded(estimator, program, steps + 1, rng)
    words = _many(recorded, program, steps, runs, rng)
    outputs, flags, seconds = _interpreted(program, words, say)
    mismatches, c_rate = _compared(program, words, outputs, flags, recorded)
    return BenchResult(
        estimator=estimator.name,
        updates_compared=steps * runs,
        mismatches=mismatches,
        interpreter_updates_per_s=round(steps * runs / seconds),
        c_updates_per_s=round(c_rate),
        ratio_c_to_interpreter=round(c_rate * seconds / (steps * runs), 2),
        compile_seconds=round(compile_seconds, 2),
        source=f"boresight bench, CPU time of one core; one half of the inputs {source}, "
        "the other random words",
    )


def _many(
    recorded: IntArray, program: Program, steps: int, runs: int, rng: np.random.Generator
) -> npt.NDArray[np.int32]:
    """Input words (steps, n_inputs, runs): one half windows of a record, one half random words."""
    half, n_in = runs // 2, len(program.inputs)
    at = rng.integers(0, len(recorded) - steps, half)
    words = np.empty((steps, n_in, runs), dtype=np.int32)
    for k in range(steps):
        words[k, :, :half] = recorded[at + k].T
        words[k, :, half:] = random_inputs(runs - half, n_in, program.arithmetic.word, rng).T
    return words


def _cpu_since(start: float) -> float:
    """CPU seconds; never 0, though the clock of some systems ticks slowly."""
    return max(time.process_time() - start, 1e-9)


def _interpreted(
    program: Program, words: npt.NDArray[np.int32], say: Callable[[str], None]
) -> tuple[npt.NDArray[np.int32], BoolArray, float]:
    """Outputs (steps, n_outputs, runs) and flags (steps, runs) of all runs; seconds."""
    steps, _, runs = words.shape
    machine = Interpreter(program, runs)
    outputs = np.empty((steps, len(program.outputs), runs), dtype=np.int32)
    flags = np.empty((steps, runs), dtype=bool)
    seconds = 0.0
    for k in range(steps):
        start = time.process_time()
        outputs[k], flags[k] = machine.update(words[k])
        seconds += _cpu_since(start)
        done = (k + 1) * runs
        say(f"interpreter: {done:,} of {steps * runs:,} updates, {done / seconds:,.0f}/s")
    return outputs, flags, seconds


def _compared(
    program: Program,
    words: npt.NDArray[np.int32],
    outputs: npt.NDArray[np.int32],
    flags: BoolArray,
    recorded: IntArray,
) -> tuple[int, float]:
    """Updates in which the C differs, and its rate over one long run."""
    model, mismatches = CModel(program, cflags=("-O2",)), 0
    for r in range(words.shape[2]):
        model.reset()
        out, saturated = model.update(np.ascontiguousarray(words[:, :, r], dtype=np.int64))
        mismatches += int(
            ((out != outputs[:, :, r]).any(axis=1) | (saturated != flags[:, r])).sum()
        )
    long = np.tile(recorded, (max(1, 1_000_000 // len(recorded)), 1))
    start = time.process_time()
    model.update(long)
    return mismatches, len(long) / _cpu_since(start)


def call(arguments: Arguments, *names: EstimatorName) -> Outcome:
    """One after the other.

    Parameters
    ----------
    names : estimators
        By default those of the main job, one after the other.
    """
    every = estimator_names(*(names or ("complementary", "ekf_quaternion", "ekf_bias", "mekf")))
    results = [arguments.call(bench, name) for name in every]
    good = all(result.mismatches == 0 for result in results)
    text = "\n\n".join(map(str, results))
    return int(not good), {"results": [result.to_json() for result in results]}, text


VERB = Verb(bench, call=call)
