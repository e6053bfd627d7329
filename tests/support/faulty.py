"""Small estimators that look right and are wrong in fixed point, or right and look wrong."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.words.fixed import IntArray
from boresight.sim.compare.diagnosis import Culprit, find_culprit
from boresight.sim.compare.twin import Traced
from boresight.sim.compare.verdict import Accuracy, Judge
from boresight.sim.compare.verdict import judge as judge_run
from boresight.sim.levels.build import Build, Run, words_of
from boresight.sim.levels.registry import CompiledFloat, Interpreted
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record

#: A line of this file.
HERE = r"\(faulty\.py, line \d+\)"


class Base(Estimator):
    inputs = (Input("u", -4.0, 4.0, ""),)
    states: tuple[State, ...] = (State("y", -1.0, 1.0, "", 0.5),)
    outputs = (Output("y", "", tolerance=1e-6),)


class Sums(Base):
    """Its state holds what lies in [-2, 2)."""

    def step(self, x: Any, u: Any, p: Any) -> Any:
        total = x.y + 0.25 * u.u
        return {"y": total}, {"y": total}


class Bounded(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        total = ops.named("total", ops.bounded(x.y + u.u, -2.0, 2.0, "by hand"))
        return {"y": x.y}, {"y": total}


class Unnamed(Base):
    """Products without names of their own, too large for their format: the first more often."""

    def step(self, x: Any, u: Any, p: Any) -> Any:
        squares = [ops.bounded(gain * u.u * u.u, 0.0, 2.0, "by hand") for gain in (1.0, 0.25)]
        return {"y": x.y}, {"y": ops.named("sum_of_squares", 0.25 * (squares[0] + squares[1]))}


class Loose(Bounded):
    """No limit on its error."""

    outputs = (Output("y", "", tolerance=100.0),)


class Root(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        root = ops.bounded(ops.rsqrt(ops.named("power", u.u * u.u)), 0.0, 4096.0, "")
        return {"y": x.y}, {"y": root}


class NegativeRoot(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        hoped = ops.bounded(u.u, 0.0, 4.0, "hoped")
        return {"y": x.y}, {"y": ops.bounded(ops.rsqrt(hoped), 0.0, 64.0, "")}


class Sine(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"y": x.y}, {"y": ops.asin_ht(ops.saturated(u.u, 4.0))}


class All(Base):
    """Every kind of operation, each inside its domain."""

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = ops.clip(x.y + 0.125 * u.u, -1.0, 1.0)
        sized = ops.absolute(u.u) + 0.5
        out = (
            ops.sincos_ht(u.u)[0] * ops.sincos_ht(3.0 * u.u)[1]
            + 1.0 / sized
            + ops.rsqrt(sized)
            + ops.where(u.u < 0.25, y, -y)
            + ops.wrap_ht(y + 0.75)
            + ops.asin_ht(0.15 * ops.absolute(u.u))
        )
        return {"y": y}, {"y": out}


class Slow(Base):
    """What 18 bits of a wide range do not carry."""

    states: tuple[State, ...] = (State("y", -256.0, 256.0, "", 0.5),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + 0.001 * (u.u - x.y)
        return {"y": y}, {"y": y}


class Snug(Slow):
    states = (State("y", -1.0, 1.0, "", 0.9),)


class Stateless(Base):
    states: tuple[State, ...] = ()
    outputs = (Output("y", "", tolerance=1e-12),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"y": 0.3 * u.u}


class Kept(Stateless):
    """The same beside a state that is nothing but the last input."""

    states = (State("y", -4.0, 4.0),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"y": u.u}, {"y": 0.3 * x.y}


def words_and_states(build: Build, inputs: list[float]) -> tuple[IntArray, IntArray]:
    """Input words (n, 1), and state words after each update."""
    records = np.array(inputs)[:, None]
    states = Interpreted(build).run(records).states
    assert states is not None
    return words_of(build.programs[0], records), states


def look(estimator: Estimator, inputs: list[float], word: int = 32) -> Culprit | None:
    """Who is to blame for the last update."""
    build = Build(estimator, word=word)
    words, states = words_and_states(build, inputs)
    pieces = [(words, states, np.zeros(len(words), dtype=np.bool_))]
    return find_culprit(Traced.of(build, 0), pieces, [len(inputs) - 1])


def rows_of(run: Run, start: int, stop: int) -> Run:
    """Some rows of a run."""
    cut: Any = {k: v[start:stop] for k, v in vars(run).items() if isinstance(v, np.ndarray)}
    outputs = {name: values[start:stop] for name, values in run.outputs.items()}
    return dataclasses.replace(run, outputs=outputs, **cut)


def judge(
    estimator: Estimator, inputs: list[float], word: int = 32, clamped: Any = None
) -> Accuracy:
    """The verdict on a run."""
    build = Build(estimator, word=word)
    columns = feed(estimator, Record.of({"u": np.array(inputs)}))
    columns = dataclasses.replace(columns, clamped=clamped or {})
    run, reference = (level(build).run(columns.inputs) for level in (Interpreted, CompiledFloat))
    made = judge_run(build, 0, columns.inputs, run, reference, columns.clamped)
    judging = Judge(build, 0)
    hidden, pieces = dataclasses.replace(run, states=None), []
    for k in range(0, len(columns), 7):
        some = columns.inputs[k : k + 7]
        states = judging.add(some, rows_of(hidden, k, k + 7), rows_of(reference, k, k + 7))
        pieces.append((some, states, np.zeros(len(some), dtype=np.bool_)))
    assert repr(judging.result(columns.clamped, lambda: pieces)) == repr(made)
    return made
