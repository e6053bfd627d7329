"""The emitted C's figures are those of a plain run, whatever ran before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boresight.model.attitude.complementary import Complementary
from boresight.model.errors import InputError
from boresight.model.estimator import with_params
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.levels.level import outputs_of
from boresight.sim.records import feed as feed_module
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.segments import interpret
from boresight.sim.rotations.accuracy import attitude_rmse
from boresight.sim.rotations.outputs import attitude_of

PARAMS = {"kp_heading_per_s": 1.0}


@pytest.fixture(scope="module")
def logs():
    """The second has a gap in its reference and samples that do not count."""
    logs = [
        synthetic_log(seconds=s, rate_hz=50, seed=s, name=f"log{s}", mag_error=SensorError(2.0))
        for s in (3, 5, 4)
    ]
    second = NineAxis.of(logs[1])
    q = second.attitude.copy()
    q[100:120] = np.nan
    logs[1] = dataclasses.replace(second, q=q, mov=np.arange(len(q)) > 60).record()
    return logs


def feeds(logs):
    return [feed(Complementary(), log) for log in logs]


def test_scores_are_those_of_the_interpreter(logs):
    estimator = Complementary()
    wanted = []
    for log in logs:
        program = with_params(estimator.compile(), estimator, PARAMS)
        words = interpret(program, feed(estimator, log).words(program))[0]
        q, view = attitude_of(outputs_of(program, words)), NineAxis.of(log)
        wanted.append(attitude_rmse(q, view.attitude, view.counts)._asdict())
    for jobs in (1, 3):
        scorer = Scorer(estimator, feeds(logs), jobs=jobs)
        default = scorer.scores()
        assert scorer.scores(PARAMS) == wanted
        assert scorer.scores(PARAMS, [2, 0]) == [wanted[2], wanted[0]]
        assert scorer.scores() == default != wanted  # parameters do not stay
        assert scorer.each(lambda k, level: k, PARAMS) == [0, 1, 2]


def test_a_long_log_is_run_in_pieces(logs, monkeypatch):
    wanted = Scorer(Complementary(), feeds(logs)).scores()
    monkeypatch.setattr(feed_module, "ROWS", 37)
    assert Scorer(Complementary(), feeds(logs)).scores() == wanted


def test_a_log_without_truth_has_no_score(logs):
    bare = dataclasses.replace(NineAxis.of(logs[0]), q=None).record()
    with pytest.raises(InputError, match=r"^log 'log3': wanted a truth of complementary's outputs"):
        Scorer(Complementary(), feeds([bare])).scores()


def test_bad_parameters(logs):
    scorer = Scorer(Complementary(), feeds(logs[:1]))
    with pytest.raises(InputError, match=r"parameter kp: wanted one of"):
        scorer.scores({"kp": 1.0})
    with pytest.raises(InputError, match=r"wanted 0 to 32"):
        scorer.scores({"kp_pitch_per_s": 33.0})
