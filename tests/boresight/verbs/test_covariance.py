"""`boresight covariance`: figures, exit codes, and the initial covariances it tries."""

import json

import pytest

from boresight.cli import main
from boresight.model.errors import InputError
from boresight.model.estimators import estimator
from boresight.verbs.covariance import P0, initial_covariances


def test_initial_variances_in_each_filters_own_unit() -> None:
    assert initial_covariances(estimator("ekf_bias")) == [{"p0_sd": p**0.5} for p in P0]
    assert initial_covariances(estimator("mekf")) == [{"p0_tilt": p, "p0_heading": p} for p in P0]
    with pytest.raises(InputError, match="^complementary: wanted a Kalman filter"):
        initial_covariances(estimator("complementary"))


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["covariance", "ekf_quaternion", "--updates", "2000", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["results"]
    assert found["updates"] == 2000 and found["good"] and found["negative_diagonals"] == 0
    assert main(["covariance", "complementary"]) == 2
    assert main(["covariance", "ekf_quaternion", "--updates", "0"]) == 2
    assert capsys.readouterr().err.count("\n") == 2
