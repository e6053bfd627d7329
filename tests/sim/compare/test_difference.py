"""Differences: half turns modulo 2, flags exactly, quaternions of either sign, no numbers."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from boresight.model.estimator import Output
from boresight.sim.compare import difference as module
from boresight.sim.compare.difference import (
    ATTITUDE,
    QUATERNION,
    Decided,
    Difference,
    Differences,
    differences,
)

NAN, INF = float("nan"), float("inf")


def apart(
    output: Output, result: list[float], reference: list[float], judged: bool = True
) -> Difference:
    (made,) = differences(
        [output], {output.name: np.array(result)}, {output.name: np.array(reference)}, judged=judged
    )
    return made


def test_an_output_may_be_called_attitude() -> None:
    assert apart(Output(ATTITUDE, "deg"), [1.0, 5.0], [1.0, 3.0]).largest == 2.0


def test_figures() -> None:
    made = apart(Output("y", "m", tolerance=2.0), [1.0, 5.0, 0.0, 3.0], [1.0, 3.0, 1.0, 1.0])
    assert made == Difference("y", "m", 4, 2.0, 1.5, 1, 2.0)
    assert made.good
    assert not apart(Output("y", "m", tolerance=1.9), [1.0, 5.0], [1.0, 3.0]).good
    assert made.to_json() == {
        "output": "y", "unit": "m", "samples": 4, "max": 2.0, "rms": 1.5, "at_step": 1,
        "tolerance": 2.0, "good": True,
    }  # fmt: skip


@pytest.mark.parametrize(
    "reason, reference, wanted",
    [
        (0.75, 0.5, 0.25),
        (-1.0, 1.0, 0.0),
        (0.9375, -0.9375, 0.125),
        (-0.9375, 0.9375, 0.125),
        (0.5, -0.5, 1.0),
        (3.25, 0.75, 0.5),
    ],
)
def test_half_turns_are_modulo_two(reason: float, reference: float, wanted: float) -> None:
    assert apart(Output("h", "ht"), [reason], [reference]).largest == wanted
    assert apart(Output("h", "deg"), [reason], [reference]).largest == abs(reason - reference)


@pytest.mark.parametrize("unit", ["flags", "bits"])
def test_flags_are_compared_exactly(unit: str) -> None:
    flags = Output("s", unit)
    made = apart(flags, [3.0, 4.0, 4.0, 7.0], [3.0, 4.0, 5.0, 0.0])
    decided = Decided(2, 4, 2, 1e-5, 10)
    assert made == Difference("s", "words", 4, 1.0, math.sqrt(0.5), 2, 0.0, decided=decided)
    assert not made.good
    assert apart(flags, [3.0 + 1e-9, 8.0], [3.0, 8.0 - 1e-9]).good


def decisions(rows: list[int], n: int = 200_000, **accepted: float) -> list[Difference]:
    """A status that differs in some rows, and a value that is 3 off in row 150,000 alone."""
    outputs = [Output("s", "bits", **accepted), Output("y", "m", tolerance=1.0)]
    zero = np.zeros(n)
    results = {"s": zero.copy(), "y": zero.copy()}
    results["s"][rows], results["y"][150_000] = 2.0, 3.0
    return differences(outputs, results, {"s": zero, "y": zero})


def test_a_share_of_decisions_may_differ_and_so_many_in_a_row() -> None:
    assert decisions([5, 9])[0].good
    assert not decisions([5, 9, 12])[0].good
    assert decisions([5, 9, 12], share=2e-5)[0].good
    row = list(range(20, 40))
    assert decisions(row, share=1e-4, longest=20)[0].good
    made = decisions(row, share=1e-4)[0]
    assert not made.good and made.first_beyond == 20
    assert made.line() == (
        "s            20 of 200000 decisions differ, a share of 0.0001 (accepted 0.0001), up to 20 "
        "in a row (accepted 10) from step 20 on: BEYOND what is accepted"
    )
    assert made.to_json()["decisions"] == {
        "differing": 20, "of": 200_000, "longest": 20, "most_share": 1e-4, "most_longest": 10,
    }  # fmt: skip


def test_values_are_judged_up_to_the_first_decision_that_differs_and_behind_it_by_rms() -> None:
    assert not decisions([])[1].good and not decisions([150_001])[1].good
    made = decisions([150_000, 160_000])[1]
    assert made.good and (made.samples, made.largest, made.apart[150_000]) == (150_000, 0.0, 3.0)
    assert made.after == Difference(
        "y", "m", 50_000, 3.0, pytest.approx(3.0 / math.sqrt(5e4)), 150_000, None
    )
    assert "in 50000 updates after a decision that differs, max 3 in step 150000" in made.line()
    json.dumps(made.to_json(), allow_nan=False)
    far = {"s": np.array([0.0, 1.0, 0.0]), "y": np.array([0.0, 2.0, 2.0])}
    outputs = [Output("s", "flags", share=1.0), Output("y", tolerance=1.5)]
    lost = differences(outputs, far, {name: np.zeros(3) for name in far})
    assert lost[0].good and not lost[1].good and lost[1].first_beyond == 1
    truth = differences(outputs, far, {name: np.zeros(3) for name in far}, judged=False)
    assert truth[1].samples == 3 and truth[0].decided is None


def test_gaps_of_a_truth_are_left_out_and_those_of_a_run_are_faults() -> None:
    results, reference = [0.0, 1.0, 5.0], [NAN, 3.0, NAN]
    truth = apart(Output("y", "m", tolerance=9.0), results, reference, judged=False)
    assert truth == Difference("y", "m", 1, 2.0, 2.0, 1, None, limit=math.inf)
    run = apart(Output("y", "m", tolerance=9.0), results, reference)
    assert (run.samples, run.at_step, run.good) == (3, 0, False)
    assert math.isnan(run.largest) and math.isnan(run.rms)
    assert run.to_json()["max"] is None and run.to_json()["rms"] is None
    assert json.loads(json.dumps(run.to_json(), allow_nan=False))["good"] is False
    for values in ([1.0, NAN], [1.0, 1.0]), ([1.0, 1.0], [1.0, NAN]):
        none = apart(Output("s", "flags"), *values)
        assert math.isnan(none.largest) and not none.good


@pytest.mark.parametrize(("unit", "tolerance"), [("m", 1e300), ("ht", 1e300), ("flags", None)])
def test_infinite_references_are_beyond(unit: str, tolerance: float | None) -> None:
    for reference in (INF, -INF):
        output = Output("y", unit, tolerance=tolerance)
        assert not apart(output, [0.0, 0.0], [0.0, reference]).good
        assert apart(output, [0.0, 0.0], [0.0, reference]).first_beyond == 1


ATTITUDES = tuple(Output(n, "", tolerance=1e-3) for n in QUATERNION)


def columns(q: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(QUATERNION, q.T, strict=True))


def turned(degrees: float, axis: int = 3) -> np.ndarray:
    q = np.zeros(4)
    q[0], q[axis] = math.cos(math.radians(degrees) / 2), math.sin(math.radians(degrees) / 2)
    return q


def test_quaternions_of_either_sign_are_one_attitude() -> None:
    q = np.stack([turned(10.0), turned(200.0, 1), turned(-90.0, 2)])
    signs = np.array([[1.0], [-1.0], [-1.0]])
    made = differences(ATTITUDES, columns(q), columns(signs * q))
    assert [d.output for d in made] == [*QUATERNION, ATTITUDE]
    assert all(d.largest == 0.0 and d.good for d in made[:4])
    assert made[4].largest < 1e-6
    # One sign for all four: a component alone that is mirrored stays apart.
    q[0, 3] = -q[0, 3]
    assert not differences(ATTITUDES, columns(q), columns(np.stack([turned(10.0)] * 3)))[3].good


def test_attitudes_by_their_angle() -> None:
    q, r = np.stack([turned(10.0), turned(0.0)]), np.stack([turned(12.0), -turned(0.0)])
    made = differences(ATTITUDES, columns(q), columns(r))[4]
    assert (made.output, made.unit, made.at_step, made.samples) == ("attitude", "deg", 0, 2)
    assert made.largest == pytest.approx(2.0, rel=1e-9)
    # 1e-3 in a component is at most 4e-3 rad.
    assert made.tolerance == pytest.approx(math.degrees(4e-3)) and not made.good
    near = differences(ATTITUDES, columns(q[:1]), columns(turned(10.2)[None, :]))[4]
    assert near.good and near.largest == pytest.approx(0.2)
    far = differences(ATTITUDES, columns(q[1:]), columns(turned(190.0, 2)[None, :]))[4]
    assert far.largest == pytest.approx(170.0)


@pytest.mark.parametrize(("norm", "angle"), [(0.0, 180.0), (0.4, 180.0), (0.6, 0.0), (3.0, 180.0)])
@pytest.mark.parametrize("both", [False, True])
def test_a_quaternion_that_is_no_attitude_is_half_a_turn_off(norm, angle, both) -> None:
    q = np.stack([turned(10.0)] * 2)
    r = np.stack([turned(10.0), norm * turned(10.0)])
    made = differences(ATTITUDES, columns(r), columns(r if both else q))[4]
    assert made.largest == pytest.approx(angle, abs=1e-5)
    whole = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert differences(ATTITUDES, columns(whole), columns(2.0 * whole))[4].largest == 0.0
    assert not angle or (made.at_step == 1 and not made.good and "norm beyond" in made.line())


@pytest.mark.parametrize("rows", [1, 7, 1000])
def test_pieces_give_the_same_figures(rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last bit, with a decision that differs, runs of them across pieces, gaps and NaN."""
    monkeypatch.setattr(module, "_SUMMED", 64)  # several sums too
    n, rng = 1500, np.random.default_rng(5)
    outputs = [
        *(Output(q, tolerance=1e-2) for q in QUATERNION),
        Output("s", unit="flags"),
        Output("y", unit="m", tolerance=1e-3),
    ]
    right = {o.name: rng.normal(size=n) for o in outputs}
    right["s"] = rng.integers(0, 3, n).astype(float)
    values = {k: v + rng.normal(scale=1e-3, size=n) for k, v in right.items()}
    values["s"] = right["s"].copy()
    values["s"][[500, *range(690, 711)]] += 1.0
    values["y"][40] = math.inf
    right["qx"][300] = math.nan
    for judged in (True, False):
        whole, parts = (Differences(outputs, right, judged=judged) for _ in range(2))
        whole.add(values, right)
        for start in range(0, n, rows):
            some = slice(start, start + rows)
            parts.add(*({k: v[some] for k, v in x.items()} for x in (values, right)))
        assert repr(parts.result()) == repr(whole.result())
        firsts = [[d.first_beyond for d in x.result()] for x in (parts, whole)]
        assert firsts[0] == firsts[1]
    made = {d.output: d for d in whole.result()}
    assert made["qx"].samples == n - 1
    apart = values["qx"] - right["qx"]
    assert made["qx"].rms == pytest.approx(math.sqrt(np.nanmean(apart**2)))
    judge = Differences(outputs, right)
    judge.add(values, right)
    decided = next(d.decided for d in judge.result() if d.output == "s")
    assert decided is not None and (decided.differing, decided.longest) == (22, 21)
