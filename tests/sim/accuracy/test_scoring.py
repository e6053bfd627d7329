"""`sim.accuracy.scoring`: the C model's figures are those of a plain run, whatever ran before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.estimator import input_words, with_params
from boresight.model.estimators.complementary import Complementary
from boresight.sim.accuracy.scoring import Scorer, has_truth
from boresight.sim.attitude.accuracy import attitude_rmse
from boresight.sim.attitude.feed import attitude_of, inputs_of, named_outputs
from boresight.sim.records.segments import interpret
from boresight.sim.worlds.synthetic import SensorError, synthetic_log

PARAMS = {"kp_heading_per_s": 1.0}


@pytest.fixture(scope="module")
def logs():
    """The second has a gap in its reference and samples that do not count."""
    logs = [
        synthetic_log(seconds=s, rate_hz=50, seed=s, name=f"log{s}", mag_error=SensorError(2.0))
        for s in (3, 5, 4)
    ]
    q = logs[1].q.copy()
    q[100:120] = np.nan
    logs[1] = dataclasses.replace(logs[1], q=q, mov=np.arange(len(q)) > 60)
    return logs


def test_scores_are_those_of_the_interpreter(logs):
    estimator = Complementary()
    wanted = []
    for log in logs:
        program = with_params(estimator.compile(), estimator, PARAMS)
        words = input_words(program, inputs_of(estimator, log)[:, :, None])[..., 0]
        run = interpret(program, words)
        q = attitude_of(named_outputs(program, run.outputs))
        wanted.append(attitude_rmse(q, log.q, log.mov))
    for jobs in (1, 3):
        scorer = Scorer(estimator, logs, jobs=jobs)
        default = scorer.scores()
        assert scorer.scores(PARAMS) == wanted
        assert scorer.scores(PARAMS, [2, 0]) == [wanted[2], wanted[0]]
        assert scorer.scores() == default != wanted  # parameters do not stay
        runs = scorer.runs(PARAMS)
        assert [len(r.outputs) for r in runs] == list(map(len, logs))


def test_truth(logs):
    log = logs[0]
    assert has_truth(log)
    assert not has_truth(dataclasses.replace(log, q=None))
    still = np.zeros(len(log), dtype=bool)
    assert not has_truth(dataclasses.replace(log, mov=still))
    gap = np.full((len(log), 4), np.nan)
    gap[3] = 1.0, 0.0, 0.0, 0.0
    assert has_truth(dataclasses.replace(log, q=gap))
    still[4] = True
    assert not has_truth(dataclasses.replace(log, q=gap, mov=still))
    with pytest.raises(InputError, match=r"^log 'log3': wanted a reference attitude"):
        Scorer(Complementary(), [dataclasses.replace(log, q=None)]).scores()


def test_bad_parameters(logs):
    scorer = Scorer(Complementary(), logs[:1])
    with pytest.raises(InputError, match=r"parameter kp: wanted one of"):
        scorer.scores({"kp": 1.0})
    with pytest.raises(InputError, match=r"wanted 0 to 32"):
        scorer.scores({"kp_pitch_per_s": 33.0})
