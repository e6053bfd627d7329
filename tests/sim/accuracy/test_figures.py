"""Figures of errors: which there are, their units, and the samples that count."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.accuracy.figures import Alignment, Errors, units_of
from boresight.sim.records.feed import Feed, feed
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_multiply, rotation_vector_to_quaternion
from tests.support.rmse import attitude_rmse

NAN = float("nan")
Q = ("qw", "qx", "qy", "qz")


class Mixed(Estimator):
    """A length, half turns, a word of flags, and one without truth."""

    inputs = (Input("z", -8.0, 8.0, "m"),)
    outputs = (Output("y", "m"), Output("turn", "ht"), Output("word", "flags"), Output("free"))


class Attitude(Estimator):
    """An attitude, an angle of the figures' name, and a bias."""

    inputs = (Input("z", -8.0, 8.0, "m"),)
    outputs = (*(Output(n) for n in Q), Output("heading", "ht"), Output("bias", "rad/s"))


def fed(estimator: Estimator, **columns: Any) -> Feed:
    return feed(estimator, Record.of({"z": np.zeros(4), **columns}))


def test_one_figure_for_each_output_with_truth() -> None:
    log = fed(
        Mixed(),
        **{"y_true[cm]": [100.0, NAN, 300.0, 0.0]},
        turn_true=[0.9, -0.9, 0.0, 0.0],
        word_true=[1.0, 2.0, 3.0, NAN],
        mov=[1, 1, 1, 0],
    )
    assert units_of(Mixed(), log) == {"y": "m", "turn": "ht", "word": "words"}

    def of(outputs: dict[str, Any]) -> dict[str, float]:
        accumulator = Errors(Mixed())
        accumulator.add(log, outputs)
        return accumulator.result()

    outputs = {
        "y": np.array([1.0, 7.0, 6.0, 50.0]),
        "turn": np.array([-0.9, -0.9, 0.0, 1.0]),
        "word": np.array([1.0, 3.0, 3.0, 0.0]),
        "free": np.zeros(4),
    }
    deviations = of(outputs)
    assert deviations["y"] == pytest.approx(np.sqrt(9.0 / 2))
    assert deviations["turn"] == pytest.approx(np.sqrt(0.04 / 3))
    assert deviations["word"] == pytest.approx(np.sqrt(1 / 3))
    assert list(deviations) == ["y", "turn", "word"]
    outputs["y"][0] = NAN  # an estimate that is none is no excuse
    assert np.isnan(of(outputs)["y"])


@pytest.mark.parametrize(
    ("align", "turn", "left"),
    [("heading", [0, 0, -12.0], 0), ("full", [3.0, -2.0, 190.0], 0), ("heading", [5.0, 0, 9.0], 5)],
)
def test_a_constant_offset_is_taken_out(align: str, turn: list[float], left: float) -> None:
    """Of either sign of the quaternions, over what counts, where there is an attitude."""
    rng = np.random.default_rng(2)
    r = rng.normal(size=(6, 4))
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    q = quaternion_multiply(rotation_vector_to_quaternion(np.radians(turn)), r)
    q *= rng.choice([-1.0, 1.0], (6, 1))
    q[0], r[1], counts = 0.0, NAN, np.array([1, 1, 1, 1, 1, 0], dtype=bool)
    q[5] = [1.0, 0.0, 0.0, 0.0]
    made = Alignment(align)
    for part in (slice(0, 3), slice(3, 6)):
        made.add(q[part], r[part], counts[part])
    turned, offset = made.turned(q), made.offset_deg
    rows = slice(2, 5)
    error = attitude_rmse(turned[rows], r[rows])
    assert error.total == pytest.approx(left, abs=0.02) and error.heading < 1e-6
    size = np.linalg.norm(turn)
    wanted = np.array(turn) * (1.0 - 360.0 / size if size > 180.0 else 1.0)
    assert offset == pytest.approx([0, 0, turn[2]] if align == "heading" else wanted, abs=0.02)
    assert not turned[0].any()  # no attitude yet
    for kind, rows in (("none", counts), (align, counts & False)):
        none = Alignment(kind)
        none.add(q, r, rows)
        assert none.turned(q) is q and none.offset_deg == ()
    log = fed(Attitude(), z=np.zeros(6), **dict(zip(Q, r.T, strict=True)), mov=counts)
    outputs = dict(zip(Q, q.T, strict=True)) | {"bias": np.ones(6)}
    of_run = Alignment(align)
    of_run.add_outputs(log, outputs)
    same = of_run.turned_outputs(outputs)
    assert of_run.offset_deg == pytest.approx(offset) and same["bias"] is outputs["bias"]
    assert same["qz"] == pytest.approx(turned[:, 3])
