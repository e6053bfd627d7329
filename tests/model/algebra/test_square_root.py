"""Whitening and Potter's update against matrices of numpy; the sum in two words."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from boresight.firmware.build import CModel
from boresight.model import ops
from boresight.model.algebra.carried import BELOW, carried
from boresight.model.algebra.square_root import WIDE, potter, whitened
from boresight.model.estimator import Estimator, Input, Output, State, input_words


def test_whitened_rows_are_those_of_the_cholesky_factor() -> None:
    rng = np.random.default_rng(1)
    h, z = rng.normal(size=(3, 6)) * [[900.0], [400.0], [60.0]], rng.normal(size=3) * 500.0
    rows, white = whitened(h.tolist(), z.tolist(), 8192.0, 2.0**15)
    lower = np.linalg.cholesky(h @ h.T)
    assert np.array(rows) == pytest.approx(np.linalg.solve(lower, h), abs=1e-12)
    assert np.array(white) == pytest.approx(np.linalg.solve(lower, z), abs=1e-9)


@pytest.mark.parametrize("live", [True, False])
def test_potter_is_the_kalman_update(live: bool) -> None:
    rng = np.random.default_rng(2)
    s, x = 0.3 * rng.normal(size=(4, 4)), rng.normal(size=4)
    a, y = rng.normal(size=(2, 4)), rng.normal(size=2)
    found = potter(s, a, y - a @ x, np.bool_(live), np.bool_(False))
    p = s @ s.T
    inside = a @ p @ a.T + np.eye(2)
    gain = p @ a.T @ np.linalg.inv(inside)
    moved = x + [sum(t * w for t, w in pairs) for pairs in found.moves]
    after = np.array(found.root)
    if live:
        assert moved == pytest.approx(x + gain @ (y - a @ x), abs=1e-12)
        assert after @ after.T == pytest.approx(p - gain @ a @ p, abs=1e-12)
    else:
        assert (moved == x).all() and after == pytest.approx(s)
    # Innovations one after the other: their squares add up to those of both together.
    assert not found.wide
    if live:
        nu = y - a @ x
        assert np.dot(found.white, found.white) == pytest.approx(nu @ np.linalg.solve(inside, nu))


def test_potter_begins_with_the_identity() -> None:
    found = potter(0.1 * np.eye(2), [[1.0, 0.0]], [0.5], np.bool_(True), np.bool_(True))
    assert np.array(found.root) == pytest.approx(BELOW * np.eye(2))


@pytest.mark.parametrize("size, used", [(0.7 * WIDE, True), (0.72 * WIDE, False)])
def test_a_row_that_is_too_wide_changes_nothing(size: float, used: bool) -> None:
    found = potter(np.eye(2), [[size, 0.0]], [1.0], np.bool_(True), np.bool_(False))
    assert found.wide == (not used)
    assert (np.array(found.root)[0, 0] < 0.5) == used
    assert (sum(t * w for t, w in found.moves[0]) != 0.0) == used


class Sum(Estimator):
    """Sums of products, in two words and in one."""

    inputs = (
        Input("a", -1.0, 1.0),
        Input("b", -1.0, 1.0),
        Input("new", 0.0, 1.0),
        Input("c", -1.0, 1.0),
    )
    states = (
        State("high", -8.0, 8.0 * BELOW),
        State("low", -(2.0**-12), 2.0**-12 * BELOW),
        State("plain", -8.0, 8.0 * BELOW),
    )
    outputs = (Output("high"), Output("low"), Output("plain"))

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        high, low = carried(x.high, x.low, [(u.a, u.b)], 8.0, u.new > 0.5)
        plain = ops.saturated(x.plain + u.c * u.b, 8.0)  # a product of three uses is a word
        after = {"high": high, "low": low, "plain": plain}
        return after, after


def test_a_carried_sum_keeps_what_one_word_rounds_away() -> None:
    n = 4000
    rng = np.random.default_rng(3)
    u = np.zeros((n, 4, 1))
    u[:, :2, 0] = 1e-4 * rng.normal(size=(n, 2)) + 2e-5
    u[:, 3] = u[:, 0]
    program = Sum().compile()
    words = input_words(program, u)[:, :, 0]
    seen = [program.format(k).real(words[:, j]) for j, k in enumerate(program.inputs)]
    out, saturated = CModel(program).update(words)
    high, low, plain = (program.format(k).real(out[:, j]) for j, k in enumerate(program.outputs))
    exact = np.cumsum(seen[0] * seen[1])
    assert np.abs(high + low - exact).max() < 1e-11 < 1e-8 < np.abs(plain - exact).max()
    assert not saturated.any()
    x = SimpleNamespace(high=1.0, low=1e-5, plain=0.0)
    after, _ = Sum().step(x, SimpleNamespace(a=0.5, b=0.5, c=0.5, new=1.0), None)
    assert after["high"] == 0.0 == after["low"]
