"""`boresight covariance`: figures, exit codes, and the initial covariances it tries."""

import json

import numpy as np
import pytest

import boresight
from boresight.cli import main
from boresight.model.attitude import estimator
from boresight.model.estimator import Estimator, Param
from boresight.sim.accuracy.covariance import P0, initial_covariances
from tests.support.strangers import csv, kalman, program


class Own(Estimator):
    params = (
        Param("p0_pos", 4.0, 0.5, 64.0, "m^2"),
        Param("p0_sd", 3.0, 0.25, 30.0, "m"),
        Param("r", 1.0, 0.1, 2.0, "m^2"),
    )


def test_initial_variances_in_each_filters_own_unit() -> None:
    assert initial_covariances(estimator("ekf_bias")) == [{"p0_sd": p**0.5} for p in P0]
    results = [p["p0_bias"] for p in initial_covariances(estimator("mekf"))]
    assert results == pytest.approx([4.5e-9, 4.5e-7, 4.5e-5, 6e-5, 6e-5])  # up to the legal most
    assert initial_covariances(estimator("complementary")) == [{}]
    assert initial_covariances(Own()) == [
        {"p0_pos": 0.5, "p0_sd": 0.25},
        {"p0_pos": 0.5, "p0_sd": pytest.approx(0.3)},
        {"p0_pos": 4.0, "p0_sd": 3.0},
        {"p0_pos": 64.0, "p0_sd": 30.0},
        {"p0_pos": 64.0, "p0_sd": 30.0},
    ]


def test_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["covariance", "ekf_quaternion", "--updates", "2000", "--json"]) == 0
    (result,) = json.loads(capsys.readouterr().out)["results"]
    assert result["updates"] == 2000 and result["good"] and result["negative_diagonals"] == 0


def test_any_filter_that_names_its_covariance(tmp_path, capsys) -> None:
    """A user's Kalman filter, on inputs within its ranges and on a log."""
    log = csv(tmp_path / "log.csv", kalman(400))
    line = ["covariance", program("kalman.py"), "--log", str(log), "--updates", "7000"]
    code = main([*line, "--json"])
    (result,) = json.loads(capsys.readouterr().out)["results"]
    assert code == 1 - result["good"]
    assert result["updates"] == 7000 and result["eigenvalues_checked"] == 7 * 20
    assert set(result["drift"]) == {"pos m", "vel m/s"} and all(
        np.isfinite([*result["drift"].values()])
    )
    again = boresight.covariance(program("kalman.py"), boresight.record_of(log), updates=7000)
    assert again.to_json() == result
    other = boresight.covariance(
        program("kalman.py"), boresight.record_of(log), updates=7000, seed=2
    )
    assert other.to_json() != result
