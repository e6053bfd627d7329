"""Verdicts on accuracy: tolerances, saturation, ranges, rounding."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.declarations import Input, Output, State
from boresight.model.estimator import Estimator
from boresight.sim.compare import verdict
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.influence import UPDATES
from boresight.sim.compare.verdict import Accuracy, Judge, Traversed
from boresight.sim.fit.fitting import fitted
from boresight.sim.levels.build import Build
from boresight.sim.levels.floating import CompiledFloat
from tests.support.faulty import (
    HERE,
    Bounded,
    Delayed,
    Kept,
    Loose,
    NegativeRoot,
    Slow,
    Snug,
    Stateless,
    Sums,
    Unnamed,
    judge,
)


def test_good() -> None:
    made = judge(Slow(), [1.0] * 5, clamped={"u": 2})
    assert made.good and made.culprit == "" and made.saturated == {}
    assert made.largest("y") == made.differences[0].largest < 1e-7
    assert made.largest("z") is None
    assert made.lines() == [
        f"fixed against float64: {made.differences[0].line()}",
        "inputs clamped, as declared: u (2)",
    ]
    judging, records = Judge(build := Build(Slow()), 0), np.zeros((3, 1))
    nothing = judging.result({"u": 0}, list)
    assert not nothing.good and nothing.clamped == {"u": 0}
    real = CompiledFloat(build).run(records)
    assert judging.add(records, real, real).shape == (3, 0) and judging.result({}, list).good


@pytest.mark.parametrize("sizes", [(UPDATES,), (UPDATES + 1,), (UPDATES - 2, 3), (UPDATES, 2)])
def test_the_last_updates_are_kept_with_the_states_before_them(sizes: tuple[int, ...]) -> None:
    program = Build(Sums()).programs[0]
    inputs = np.zeros((sum(sizes), len(program.inputs)), dtype=np.int64)
    states = np.arange(1, len(inputs) + 1)[:, None] * np.ones((1, len(program.states)), np.int64)
    cuts = np.cumsum(sizes)[:-1]
    pieces = zip(np.split(inputs, cuts), np.split(states, cuts), strict=True)
    seen = Traversed(program, pieces)
    assert (seen.count, len(seen.inputs), len(seen.states)) == (len(inputs), UPDATES, UPDATES)
    spare = len(inputs) - UPDATES
    assert (seen.before is None) == (spare == 0) and seen.states[0, 0] == spare + 1
    assert seen.before is None or seen.before[0] == spare
    assert seen.changes.tolist() == [1] * len(program.states)


def test_saturation_is_no_success_though_it_be_near() -> None:
    made = judge(Sums(), [4.0, 0.0, 4.0, 4.0])
    assert not made.good and made.saturated_updates == 2
    assert made.saturated == {"state y": 2}
    first = made.culprit.partition(":")[0]
    assert re.fullmatch(rf"step 0, value state y {HERE}", first)
    assert made.lines()[1:] == ["2 updates SATURATED: state y (2)", f"first wrong: {made.culprit}"]
    plain = made.to_json()
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["good"] is False and plain["saturated"] == {"state y": 2}
    assert plain["outputs"][0]["output"] == "y" and plain["culprit"] == made.culprit
    near = Accuracy((Difference("y", "", 1, 0.0, 0.0, 0, 1.0),), 1, {"y": 1}, (), {}, "")
    assert not near.good


def test_a_value_without_a_name_is_called_by_the_nearest_that_has_one() -> None:
    """Of two on one line the count is that of the one that saturates more often."""
    made = judge(Unnamed(), [4.0, 0.0, 2.0])
    ((name, count),) = made.saturated.items()
    assert count == 2 and re.fullmatch(r"bounded in sum_of_squares, faulty\.py, line \d+", name)


def test_those_that_saturate_most_are_named_first() -> None:
    """Five of them."""
    counts = {name: n for n, name in enumerate("abcdefg", 1)}
    most = "g (7), f (6), e (5), d (4), c (3)"
    near = Difference("y", "", 1, 0.0, 0.0, 0, 1.0)
    for few, said in ((5, "e (5), d (4), c (3), b (2), a (1)"), (7, f"{most}, and 2 more values")):
        some = {name: n for name, n in counts.items() if n <= few}
        made = Accuracy((near,), 9, some, ("it left",), {"u": 2, "v": 1}, "x")
        assert made.causes() == [f"9 updates SATURATED: {said}", "it left", "first wrong: x"]
        assert made.faults() == made.causes() and not made.good
        assert made.lines()[1] == "inputs clamped, as declared: u (2), v (1)"
    assert not Accuracy((near,), 0, {}, ("it left",), {}, "").good
    far = Difference("y", "", 1, 2.0, 2.0, 0, 1.0)
    made = Accuracy((near, far), 0, {}, (), {}, "")
    assert made.faults() == [far.line()] and not made.good


def test_saturated_values_have_lines() -> None:
    (name,) = judge(Bounded(), [0.0, 4.0, 4.0]).saturated
    assert re.fullmatch(r"total, faulty\.py, line \d+", name)
    made = judge(Loose(), [0.0, 4.0, 4.0])
    assert all(d.good for d in made.differences) and not made.good
    assert re.match(r"step 1, value total \(faulty\.py, line \d+\): ", made.culprit)


def test_what_an_output_beyond_its_tolerance_comes_from() -> None:
    """Though nothing saturates."""
    made = judge(NegativeRoot(), [1.0, 0.5, -2.0])
    assert not made.saturated_updates and not made.beyond_range
    assert re.match(rf"step 2, value bounded in y_out {HERE}: -2 does not fit", made.culprit)


class Accepted(NegativeRoot):
    """Beside an output whose claim is wrong before, but which is as exact as it is to be."""

    outputs = (*NegativeRoot.outputs, Output("spare", tolerance=0.1))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        spare = ops.named("spare", ops.bounded(0.75 * u.u, -1.0, 1.0, "hoped"))
        states, outputs = super().step(x, u, p)
        return states, {**outputs, "spare": spare}


def test_what_an_accepted_output_is_made_of_is_not_to_blame() -> None:
    made = judge(Accepted(), [1.5, 0.5, -2.0])
    assert [d.good for d in made.differences] == [False, True] and not made.saturated_updates
    assert re.match(rf"step 2, value bounded in y_out {HERE}: -2 does not fit", made.culprit)


class Growing(Estimator):
    """A state that grows without end, in float64 too."""

    inputs = (Input("u", -1.0, 1.0),)
    states = (State("y", -1.0, 1.0),)
    outputs = (Output("y", tolerance=1e-3),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A thousand times."""
        return {"y": 1000.0 * x.y + u.u}, {"y": x.y}


def test_an_estimator_that_diverges_is_told_so() -> None:
    made = judge(Growing(), [1.0] * 120)
    y, step = 0.0, 0
    while math.isfinite(y):
        y, step = 1000.0 * y + 1.0, step + 1
    assert made.culprit.startswith(f"float64 is no number from step {step} on: the estimator div")


class Beside(Stateless):
    """The same behind an output that may be that wrong."""

    outputs = (Output("loose", tolerance=1.0), *Stateless.outputs)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        return {}, {"loose": 0.7 * u.u, **super().step(x, u, p)[1]}


class Two(Slow):
    """The same behind a state that changes more, and one that does not."""

    states = (State("fast", -4.0, 4.0), State("still", -1.0, 1.0), *Slow.states)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        states, outputs = super().step(x, u, p)
        return {"fast": x.fast + 0.5 * (u.u - x.fast), "still": 0.5, **states}, outputs


class Spare(Slow):
    """With a bit more to spare than `Snug`."""

    states = (State("y", -1.0, 1.0, "", 0.4),)


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
    assert judge(Two(), [1.0] * 200, 18).culprit.startswith(f"{said}; state y ")
    assert re.fullmatch(
        rf"{said}; of the error of y 100% from y {HERE}; one more bit of the first leaves 50%: it "
        r"leaves 2 bits unused: get formats by boresight fit; where .* or a wider word",
        judge(Stateless(), [1.0], 18).culprit,
    )
    beside = judge(Beside(), [1.0], 18).culprit
    assert beside.startswith(f"{said}; of the error of y 100% from y (faulty.py, line "), beside
    assert judge(Stateless(), [2.0], 18).culprit.endswith(" leaves 50%: use a wider word")
    for inputs in ([1.0, 0.0], [-1.0, 0.0]):
        assert "it leaves 2 bits unused" in judge(Stateless(), inputs, 18).culprit
    culprit = judge(Kept(), [1.0, -0.5, 0.25], 18).culprit
    assert culprit.startswith(f"{said}; of the error of y 100% from y_out (faulty.py, line "), (
        culprit
    )
    delayed = judge(Delayed(), [1.0] * 200, 18).culprit
    assert delayed.startswith(f"{said}; state y "), delayed


def test_sources_of_rounding_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to three of more than a hundredth, where they explain more than an eighth."""
    real, rms = verdict.influences, judge(Stateless(), [1.0], 18).differences[0].rms
    y = rf"y {HERE}"
    for explains, text in (
        (0.125, f", to one side; y depends most on the rounding of {y}: "),
        (0.126, f"; of the error of y 90% from {y}, 2% from {y}; one more bit "),
    ):

        def few(*made: Any, explains: float = explains) -> Any:
            (first,) = real(*made)["y"]
            rest = [dataclasses.replace(first, rms=0.0, share=x) for x in (0.01, 0.02, 0.5)]
            return {"y": [dataclasses.replace(first, rms=explains * rms, share=0.9), *rest]}

        monkeypatch.setattr(verdict, "influences", few)
        culprit = judge(Stateless(), [1.0], 18).culprit
        assert re.match(f"no operation leaves its float twin: rounding adds up{text}", culprit)


def test_a_state_that_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its range is narrowed where it leaves more than a bit."""
    wider = "use a wider word, or carry the remainder in a second state"
    for estimator, level, explained, unexplained in (
        (Snug(), 1.0, "%: ", "1 bits of its range [-1, 1] unused: "),
        (
            *(Spare(), 0.4, ": narrow its range [-1, 1], which leaves 2 bits unused, "),
            "2 bits of its range [-1, 1] unused: narrow that range, ",
        ),
    ):
        for least, cure in ((0.0, explained), (math.inf, unexplained)):
            monkeypatch.setattr(verdict, "_EXPLAINED", least)
            assert judge(estimator, [level] * 200, 18).culprit.endswith(cure + wider)


def test_rounding_to_one_side(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which independent rounding does not explain: of a value with bits to spare, or a state."""
    monkeypatch.setattr("boresight.sim.compare.verdict._EXPLAINED", math.inf)
    said = "no operation leaves its float twin: rounding adds up"
    assert re.fullmatch(
        rf"{said}, to one side; y depends most on the rounding of y {HERE}: it leaves 2 bits "
        r"unused: get formats by boresight fit; where .* or a wider word",
        judge(Stateless(), [1.0], 18).culprit,
    )
    assert judge(Beside(), [1.0], 18).culprit.startswith(f"{said}, to one side; y depends most ")
    assert judge(Stateless(), [2.0], 18).culprit == f"{said}; use a wider word"  # one bit to spare
    assert judge(Kept(), [2.0] * 3, 18).culprit.startswith(f"{said}; state y ")
    assert judge(Slow(), [1.0] * 200, 18).culprit.startswith(f"{said}; state y ")


class Claimed(Estimator):
    """A claim that is far too wide."""

    inputs = (Input("u", -1.0, 1.0),)
    outputs = (Output("y", tolerance=1e-9),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A small square."""
        return {}, {"y": ops.bounded(1e-3 * u.u * u.u, -64.0, 64.0, "by hand")}


def test_a_claim_that_is_too_wide_with_a_profile() -> None:
    """A profile leaves its margins; only its author may say less."""
    claimed, inputs = Claimed(), [0.1 * k - 1.0 for k in range(21)]
    assert "get formats by boresight fit" in judge(claimed, inputs, 18).culprit
    claimed.profile = fitted(claimed, {"log": np.array(inputs)[:, None]}, starts=()).profile
    assert judge(claimed, inputs, 18).culprit.endswith(
        "bits unused with the profile, too: narrow the range [-64, 64] that ops.bounded states "
        "there, or use a wider word"
    )


def test_a_state_beyond_its_range_is_no_success_though_its_word_holds_it() -> None:
    """[-1, 1] in a word that holds [-2, 2)."""
    made = judge(Sums(), [1.0, 1.0, 1.0, 0.0])
    assert made.saturated_updates == 0 and all(d.good for d in made.differences)
    assert not made.good
    assert made.beyond_range == (
        "state y is 1.25 in step 2, BEYOND its declared range [-1, 1]: widen it",
    )
    assert made.lines()[-2:] == [*made.beyond_range, f"first wrong: {made.culprit}"]
    assert made.to_json()["beyond_range"] == list(made.beyond_range)
    assert re.match(rf"step 2, value state y {HERE}: 1\.25 does not fit", made.culprit)
    assert judge(Sums(), [1.0, 1.0, 0.0]).good
    # Rounding may leave a range by some thousandth of it.
    assert judge(Sums(), [1.0, 1.003]).good and judge(Sums(), [1.0, 1.015]).good
    assert not judge(Sums(), [1.0, 1.0, 0.017]).good
    # What saturates is named once.
    assert judge(Sums(), [4.0, 4.0]).beyond_range == ()
