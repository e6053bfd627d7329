"""Counters, rows in turn, states that are only considered."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import boresight
import boresight.kalman
from boresight import Input, Output, Param
from boresight.kalman import Kalman, Measurement, State, in_turn
from boresight.model.errors import InputError
from boresight.sim.compare.difference import differences


class Spelled(Kalman):
    """Three rows of which inputs say the turn, and one that an input calls; b is considered."""

    inputs = (
        *(Input(f"z{k}", -8.0, 8.0) for k in range(4)),
        *(Input(f"turn{k}", 0.0, 1.0) for k in range(4)),
        Input("new", 0.0, 1.0),
    )
    params = (Param("r", 0.1, 0.01, 1.0),)
    states = (
        State("a", -8.0, 8.0, sd=1.0),
        State("b", -8.0, 8.0, sd=0.5, initial=0.25, consider=True),
        State("c", -8.0, 8.0, sd=1.0),
    )
    outputs = (Output("a", tolerance=1e-5), Output("b", tolerance=1e-5), Output("c"))

    def f(self, x: Any, u: Any, p: Any) -> Any:
        return {"a": 0.95 * x.a + 0.1 * x.b, "c": x.c + 0.1 * x.a}

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        return {"a": 0.01, "c": 0.001}

    def rows(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        return [
            Measurement(u.z0, x.a, p.r, valid=u.new > 0.5),
            Measurement(u.z1, x.c + x.b, 2.0 * p.r, valid=u.new < 0.5),
            Measurement(u.z2, x.c, p.r),
        ]

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        turns = [u.turn0 > 0.5, u.turn1 > 0.5, u.turn2 > 0.5]
        turns[:2] = turns[0] & (u.new > 0.5), turns[1] & (u.new < 0.5)
        return [
            *(
                Measurement(m.z, m.h, m.r, valid)
                for m, valid in zip(self.rows(x, u, p), turns, strict=True)
            ),
            Measurement(u.z3, x.a - x.c, p.r, valid=u.turn3 > 0.5),
        ]


class InTurn(Spelled):
    """The same by counters."""

    counters = {"row": 3, "rate": 5}

    def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
        return [
            in_turn(x.row, self.rows(x, u, p)),
            Measurement(u.z3, x.a - x.c, p.r, valid=x.rate < 0.5),
        ]


def records(n: int) -> dict[str, Any]:
    draw, k = np.random.default_rng(1), np.arange(n)
    return {
        **{f"z{j}": draw.normal(0.0, 1.0, n) for j in range(4)},
        **{f"turn{j}": (k % 3 == j).astype(float) for j in range(3)},
        "turn3": (k % 5 == 0).astype(float),
        "new": (draw.random(n) < 0.5).astype(float),
    }


def test_rows_in_turn_are_those_that_are_valid_in_their_turn() -> None:
    (a, b) = (
        boresight.run(kind, records(200), levels="float")["outputs"]
        for kind in (Spelled(), InTurn())
    )
    for name in "abc":
        assert np.asarray(a[name]) == pytest.approx(np.asarray(b[name]), abs=1e-12)
    assert set(np.asarray(a["b"])) == {0.25}


def test_levels_agree_and_float64_is_the_textbook() -> None:
    (result,) = boresight.check(InTurn(), records(60), levels=("fixed", "c", "rtl"))["results"]
    assert result.good and result.textbook, result.lines()
    (estimator,) = result.build.estimators
    book = estimator.textbook(result.given.inputs).as_built()
    near = differences(estimator.outputs, result.floating.outputs, book)
    assert all(d.largest < 1e-9 for d in near), near


def test_what_is_considered_counts() -> None:
    """Beside the same filter with b known: a and c are less sure, b stays as it was."""

    class Known(InTurn):
        states = (
            Spelled.states[0],
            State("b", -8.0, 8.0, sd=1e-3, initial=0.25, consider=True),
            Spelled.states[2],
        )

    covariances = []
    for kind in (InTurn(), Known()):
        columns = np.column_stack([records(200)[i.name] for i in kind.inputs])
        covariances.append(boresight.kalman.Textbook(kind).run(columns).covariances[-1])
    considered, known = covariances
    assert considered[1, 1] == pytest.approx(0.25, rel=1e-3)
    assert considered[0, 0] > 1.2 * known[0, 0] and considered[2, 2] > known[2, 2]


def test_mistakes() -> None:
    class Mixed(InTurn):
        def measure(self, x: Any, u: Any, p: Any) -> list[Measurement]:
            return [in_turn(x.row, [Measurement(u.z0, x.a, p.r, gate=3.0), *self.rows(x, u, p)])]

    class Short(InTurn):
        counters = {"row": 1}

    class Set(InTurn):
        def f(self, x: Any, u: Any, p: Any) -> Any:
            return {"row": x.row}

    with pytest.raises(InputError, match=r"test_turns.py.*in_turn: wanted .* same gate"):
        Mixed().record()
    with pytest.raises(InputError, match="counter row: wanted a number of updates from 2"):
        Short()
    with pytest.raises(InputError, match="wanted next values of states: .*found 'row'"):
        Set().record()
