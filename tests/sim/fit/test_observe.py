"""What expressions reach, on records and where words would stay."""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.fit.observe import CHUNK, Observer


class Sum(Estimator):
    """A sum, a comparison and a claim."""

    inputs = (Input("u", -1.0, 1.0),)
    params = (Param("gain", 1.0, 0.0, 4.0),)
    states = (State("x", -8.0, 8.0, initial=2.0),)
    outputs = (Output("y"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        claim = ops.bounded(x.x * u.u, -3.0, 3.0, "a test")
        return {"x": x.x + p.gain * u.u}, {"y": ops.where(u.u < 0.5, claim, claim * claim)}


def seen(inputs: list[float], **params: float) -> dict[str, tuple[float, float]]:
    """Ranges by the kind of the expression; of several of a kind the last."""
    estimator, columns = Sum(), np.array(inputs)[:, None]
    trace = estimator.record()
    whole, pieces = (Observer(trace, estimator, params) for _ in range(2))
    whole.add(columns)
    for row in columns:
        pieces.add(row[None])
    assert pieces.reached == whole.reached and pieces.updates == whole.updates == len(columns)
    return {e.kind: whole.reached[e.number] for e in trace.needed if e.number in whole.reached}


def states(inputs: list[float], **params: float) -> list[float]:
    """The state after each update."""
    after = Observer(Sum().record(), Sum(), params).add(np.array(inputs)[:, None])
    return [float(x) for x in after[:, 0]]


def test_states_follow_each_other_from_their_start() -> None:
    assert states([1.0, 0.5, -0.25], gain=2.0) == [4.0, 5.0, 4.5]


def test_states_stay_in_their_ranges() -> None:
    assert states([1.0] * 9)[-1] == 8.0


def test_values_of_all_updates_count() -> None:
    result = seen([1.0, 0.5, -0.25])
    assert result["add"] == (3.0, 3.5)
    assert result["select"] == (3.5 * -0.25, 4.0)
    assert result["less"] == (-0.75, 0.5)  # the difference


def test_a_claim_holds_what_is_beyond_it_as_its_word_does() -> None:
    result = seen([1.0, 1.0, 1.0])
    assert result["bounded"] == (2.0, 3.0)


def test_chunks_are_joined() -> None:
    inputs = np.zeros(CHUNK + 2)
    inputs[0], inputs[-1] = 1.0, -1.0
    assert seen(inputs.tolist())["add"] == (2.0, 3.0)


def test_what_is_no_number_does_not_count() -> None:
    class Root(Estimator):
        """An inverse root of what may be negative in float64."""

        inputs = (Input("u", 0.0, 1.0),)
        outputs = (Output("y"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            return {}, {"y": ops.sqrt(u.u) / ops.maximum(u.u, 0.1)}

    estimator, columns = Root(), np.array([[-1.0], [0.25]])
    trace = estimator.record()
    observer = Observer(trace, estimator)
    observer.add(columns)
    root = next(e for e in trace.needed if e.kind == "sqrt")
    assert observer.reached[root.number] == (0.5, 0.5)
