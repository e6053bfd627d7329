"""Verdicts on accuracy, and the operation that is to blame."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare import culprit as module
from boresight.sim.compare.culprit import Culprit, find_culprit
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.verdict import Accuracy, judge_accuracy
from boresight.sim.levels.floating import CompiledFloat
from boresight.sim.levels.integer import words_of
from boresight.sim.levels.level import run_of_words

HERE = r"\(test_verdict\.py, line \d+\)"


class Base(Estimator):
    inputs = (Input("u", -4.0, 4.0, ""),)
    states = (State("y", -1.0, 1.0, "", 0.5),)
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


class Root(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        root = ops.bounded(ops.rsqrt(ops.named("power", u.u * u.u)), 0.0, 4096.0, "")
        return {"y": x.y}, {"y": root}


class NegativeRoot(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"y": x.y}, {"y": ops.bounded(ops.rsqrt(u.u + 0.0), 0.0, 64.0, "")}


class Sine(Base):
    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {"y": x.y}, {"y": ops.asin_ht(u.u)}


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

    states = (State("y", -256.0, 256.0, "", 0.5),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + 0.001 * (u.u - x.y)
        return {"y": y}, {"y": y}


class Snug(Slow):
    states = (State("y", -1.0, 1.0, "", 0.9),)


class Stateless(Base):
    states = ()
    outputs = (Output("y", "", tolerance=1e-12),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        return {}, {"y": 0.3 * u.u}


def traced(estimator: Estimator, inputs: list[float], word: int) -> dict[str, Any]:
    """Words of a run, as `judge_accuracy` takes them."""
    program, nodes = estimator.compile_traced(word=word)
    words = words_of(program, np.array(inputs)[:, None])
    machine = Interpreter(program)
    states, saturated, found = [], [], []
    for row in words:
        out, clamped = machine.update(row[:, None])
        found.append(out[:, 0])
        saturated.append(bool(clamped[0]))
        states.append([int(machine.values[s][0]) for s, _ in program.states])
    return {
        "program": program,
        "nodes": nodes,
        "inputs": words,
        "states": np.array(states).reshape(len(words), -1),
        "saturated": np.array(saturated),
        "found": run_of_words(program, np.stack(found), np.array(saturated)).outputs,
    }


def look(estimator: Estimator, inputs: list[float], word: int = 32) -> Culprit | None:
    run = traced(estimator, inputs, word)
    return find_culprit(*(run[n] for n in ("program", "nodes", "inputs", "states")))


def judge(
    estimator: Estimator, inputs: list[float], word: int = 32, clamped: Any = None
) -> Accuracy:
    run = traced(estimator, inputs, word)
    reference = CompiledFloat(estimator).run(np.array(inputs)[:, None]).outputs
    return judge_accuracy(
        estimator.outputs, run.pop("found"), reference, clamped=clamped or {}, **run
    )


@pytest.mark.parametrize("word", [18, 32])
@pytest.mark.parametrize(
    "estimator, inputs, step, text",
    [
        (Bounded, [0.0, 4.0, 4.0], 1, rf"step 1, value total {HERE}: saturates: 4\.5 does not fit "
         r"its range \[-2, 2\]; widen the range \(declared: by hand\) or limit the value"),
        (NegativeRoot, [1.0, 0.5, -2.0, -3.0], 2, rf"step 2, value bounded_\d+, bounded {HERE}: "
         r"rsqrt: argument -2 is negative; keep u at 0 or above"),
        (Sine, [0.1, 0.5, 0.8], 2, rf"step 2, value asin_\d+, asin {HERE}: asin: argument 0\.8 is "
         r"outside 0 to 0\.7188; limit u"),
        (Sine, [0.1, -0.5, 0.8], 1, rf"step 1, value asin_\d+, asin {HERE}: asin: argument -0\.5 "),
        (Sums, [1.0, 2.0, 4.0, 0.0], 1, rf"step 1, value state y {HERE}: 1\.25 does not "
         r"fit its range \[-1, 1\]; widen the range \(declared\) or limit the value"),
        (Sums, [-4.0, -2.0, -4.0], 2, rf"step 2, value state y {HERE}: saturates: -2 does"),
    ],
)  # fmt: skip
def test_culprits(
    estimator: type[Estimator], inputs: list[float], step: int, text: str, word: int
) -> None:
    found = look(estimator(), inputs, word)
    assert found is not None and found.step == step
    assert re.match(text, str(found)), str(found)
    assert look(estimator(), inputs[:step], word) is None


def test_below_the_floor_of_a_function() -> None:
    found = str(look(Root(), [1.0, 0.1, 1e-3]))
    assert re.match(rf"step 2, value bounded_\d+, bounded {HERE}: rsqrt: argument ", found)
    assert found.endswith(
        "e-08 of full scale is below the floor 2^-22; scale power up, or declare a narrower range "
        "than [0, 16]"
    )


@pytest.mark.parametrize("word", [18, 32])
def test_nobody_is_to_blame_for_rounding(word: int) -> None:
    inputs = np.random.default_rng(5).uniform(-4.0, 4.0, 300).tolist()
    assert look(All(), inputs, word) is None
    assert look(Slow(), inputs, word) is None


def test_nothing_times_the_root_of_nothing_is_nothing() -> None:
    class Direction(Base):
        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"y": x.y}, {"y": ops.bounded(u.u * ops.rsqrt(u.u * u.u), -2.0, 2.0, "")}

    assert look(Direction(), [1.0, 0.0, -1.0]) is None


def test_only_the_last_updates_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    inputs = [4.0, 0.0, 0.0, 0.0, 0.0]
    monkeypatch.setattr(module, "WINDOW", 5)
    assert getattr(look(Bounded(), inputs), "step", None) == 0
    monkeypatch.setattr(module, "WINDOW", 4)
    assert look(Bounded(), inputs) is None
    # The steps count from the run's start, and the states go on from before the window.
    found = look(Sums(), [1.0, 0.0, 0.0, 2.0])
    assert found is not None and (found.step, found.value) == (3, "state y")
    monkeypatch.setattr(module, "WINDOW", 1)
    assert look(Sums(), [1.0, 0.0, 0.0, 2.0]) == found


def test_texts_of_culprits() -> None:
    assert str(Culprit(3, "v", "f.py, line 2", "why", "cure")) == (
        "step 3, value v (f.py, line 2): why; cure"
    )
    assert str(Culprit(3, "v", "", "why", "cure")) == "step 3, value v: why; cure"


def test_good() -> None:
    made = judge(Slow(), [1.0] * 5, clamped={"u": 2})
    assert made.good and made.culprit == "" and made.saturated == {}
    assert made.largest("y") == made.differences[0].largest < 1e-7
    assert made.largest("z") is None
    assert made.lines() == [
        f"fixed against float64: {made.differences[0].line()}",
        "inputs clamped, as declared: u (2)",
    ]


def test_saturation_is_no_success_though_it_be_near() -> None:
    made = judge(Sums(), [4.0, 0.0, 4.0, 0.0])
    assert not made.good and made.saturated_updates == 2
    assert made.saturated == {"state y": 2}
    first = made.culprit.partition(":")[0]
    assert re.fullmatch(rf"step 0, value state y {HERE}", first)
    assert made.lines()[1:] == ["2 updates SATURATED: state y (2)", f"first wrong: {made.culprit}"]
    plain = made.to_json()
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["good"] is False and plain["saturated"] == {"state y": 2}
    assert plain["outputs"][0]["output"] == "y" and plain["culprit"] == made.culprit
    near = Accuracy((Difference("y", "", 1, 0.0, 0.0, 0, 1.0),), 1, {"y": 1}, {}, "")
    assert not near.good


def test_saturated_values_have_lines() -> None:
    (name,) = judge(Bounded(), [0.0, 4.0, 4.0]).saturated
    assert re.fullmatch(r"total, test_verdict\.py, line \d+", name)


def test_rounding_that_adds_up() -> None:
    said = "no operation leaves its float twin: rounding adds up"
    made = judge(Slow(), [1.0] * 200, 18)
    assert not made.good and made.saturated_updates == 0
    cure = re.escape(
        "narrow that range, use a wider word, or carry the remainder in a second state"
    )
    assert re.fullmatch(
        rf"{said}; state y {HERE} changes by no more than 0 of its least significant bits in an "
        rf"update and leaves 9 bits of its range \[-256, 256\] unused: {cure}",
        made.culprit,
    ), made.culprit
    assert judge(Snug(), [1.0] * 200, 18).culprit.endswith(
        "use a wider word, or carry the remainder in a second state"
    )
    assert judge(Stateless(), [1.0], 18).culprit == f"{said}; use a wider word"
