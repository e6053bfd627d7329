"""`examples/`: each against an independent reference, on its own log."""

from __future__ import annotations

import ahrs
import numpy as np
import pytest
from scipy import signal

import boresight
from boresight.sim.compare.difference import differences
from boresight.sim.records.files import bundled
from boresight.sim.rotations.accuracy import attitude_of
from boresight.sim.rotations.rotation import angle_between
from tests.support.strangers import EXAMPLES, STRANGERS, program

#: Examples with a log.
LOGGED = {"kalman": 1000, "madgwick": 600, "biquad": 500, "attitude": 600}


def columns_of(name: str) -> dict[str, np.ndarray]:
    record = boresight.record_of(EXAMPLES / f"{name}.csv")
    return {column: c.values for column, c in record.columns.items()}


def fixed(name: str) -> dict[str, np.ndarray]:
    return boresight.run(program(f"{name}.py"), EXAMPLES / f"{name}.csv", levels="fixed")["outputs"]


@pytest.mark.parametrize("name", LOGGED)
def test_the_log_is_what_its_sensors_give(name: str) -> None:
    (make,) = (make for file, make in STRANGERS.items() if file.startswith(name))
    wanted, result = make(LOGGED[name])[0], columns_of(name)
    assert result.keys() == wanted.keys()
    for column, values in wanted.items():
        assert np.allclose(result[column], values, rtol=1e-4, atol=1e-9)


def test_kalman_is_the_filter_as_matrices() -> None:
    log, result = columns_of("kalman"), fixed("kalman")
    x, p, q, r = np.zeros(2), 4.0 * np.eye(2), 0.5, 0.25
    h = np.array([[1.0, 0.0]])
    for k, (dt, z) in enumerate(zip(log["dt"], log["z"], strict=True)):
        f = np.array([[1.0, dt], [0.0, 1.0]])
        x, p = f @ x, f @ p @ f.T + np.diag([0.0, q * dt])
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
        x, p = x + gain @ (z - h @ x), (np.eye(2) - gain @ h) @ p
        assert abs(result["pos"][k] - x[0]) < 1e-5 and abs(result["vel"][k] - x[1]) < 5e-5


def test_pendulum_is_the_extended_filter_as_matrices() -> None:
    log, _ = STRANGERS["pendulum.py"](1500)
    result = boresight.run(program("pendulum.py"), log, levels="fixed")["outputs"]
    x, p, dt = np.array([0.5, 0.0]), np.diag([0.25, 1.0]), 0.01
    for k, z in enumerate(log["z"]):
        slope = -dt * 9.81 * np.cos(x[0])
        rate = (1.0 - dt * 0.1) * x[1] - dt * 9.81 * np.sin(x[0])
        x = np.array([x[0] + dt * rate, rate])
        f = np.array([[1.0 + dt * slope, dt * (1.0 - dt * 0.1)], [slope, 1.0 - dt * 0.1]])
        p = f @ p @ f.T + np.diag([0.0, dt * 0.01])
        h = np.array([[np.cos(x[0]), 0.0]])
        gain = p @ h.T @ np.linalg.inv(h @ p @ h.T + 4e-4)
        x, p = x + (gain * (z - np.sin(x[0]))).ravel(), (np.eye(2) - gain @ h) @ p
        assert abs(result["angle"][k] - x[0]) < 1e-6 and abs(result["rate"][k] - x[1]) < 1e-5


def gradient(q: np.ndarray, acc: np.ndarray) -> np.ndarray:
    """Madgwick (2010), equations 25 to 28."""
    w, x, y, z = q
    ax, ay, az = acc / np.linalg.norm(acc)
    f = [2 * (x * z - w * y) - ax, 2 * (w * x + y * z) - ay, 1 - 2 * (x * x + y * y) - az]
    j = [[-2 * y, 2 * z, -2 * w, 2 * x], [2 * x, 2 * w, 2 * z, 2 * y], [0, -4 * x, -4 * y, 0]]
    return np.array(f) @ np.array(j)


@pytest.mark.parametrize(("shrinks", "most"), [(True, 1e-6), (False, 5e-3)])
def test_madgwick_is_that_of_ahrs(shrinks: bool, most: float) -> None:
    """Theirs goes a step of constant length; ours a shorter one where the gradient is small."""
    log, result = columns_of("madgwick"), fixed("madgwick")
    theirs = ahrs.filters.Madgwick(frequency=100.0, gain=0.1)
    q, errors = np.array([1.0, 0.0, 0.0, 0.0]), []
    for k in range(len(log["dt"])):
        gyr, acc = (np.array([log[f"{s}{a}"][k] for a in "xyz"]) for s in "ga")
        if shrinks:
            theirs.gain = 0.1 * min(1.0, float(np.linalg.norm(gradient(q, acc))) / 0.08)
        q = np.asarray(theirs.updateIMU(q, gyr=gyr, acc=acc)).ravel()
        ours = np.array([result[n][k] for n in ("qw", "qx", "qy", "qz")])
        errors.append(np.abs(q - ours).max())
    assert np.max(errors) < most


def test_biquad_is_the_cascade_of_scipy() -> None:
    x = columns_of("biquad")["x"]
    wanted = signal.sosfilt(signal.butter(4, 0.1, output="sos"), x)
    assert np.abs(fixed("biquad")["y"] - wanted).max() < 1e-6
    assert np.abs(wanted).max() > 0.3


def test_attitude_is_the_truth_within_degrees() -> None:
    """From level and north on; in float64 it is the textbook's filter."""
    record = boresight.record_of(bundled("synthetic_60s"))
    truth = np.stack([record.columns[f"q{c}"].values for c in "wxyz"], axis=1)
    outputs = boresight.run(program("attitude.py"), record, levels="c")["outputs"]
    off = np.degrees(angle_between(attitude_of(outputs), truth))
    assert np.sqrt(np.mean(off[500:] ** 2)) < 3.0 and off[500:].max() < 8.0
    (checked,) = boresight.check(program("attitude.py"), record, levels=("c",), steps=200)[
        "results"
    ]
    (estimator,) = checked.build.estimators
    book = estimator.textbook(checked.given.inputs[:2000]).as_built()
    outputs = {name: values[:2000] for name, values in checked.floating.outputs.items()}
    near = differences(estimator.outputs, outputs, book)
    assert checked.good and all(d.largest < 1e-9 for d in near)
