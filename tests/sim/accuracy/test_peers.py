"""`sim.accuracy.peers`: published filters in our frames, on the bundled log with exact truth."""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.accuracy.peers import PEERS, dip_rad, first_attitude, require_peers, run_peer
from boresight.sim.attitude.worlds.synthetic import synthetic_log
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error
from boresight.sim.rotations.rotation import quaternion_multiply
from tests.support.rmse import attitude_rmse

#: Total RMSE [deg] on synthetic_60s, magnetometer at 10 Hz: both bounds. A wrong frame gives 90 or
#: 180 degrees, a wrong step of the magnetometer tens.
BOUNDS = {
    "vqf_offline": (0.45, 0.6),
    "vqf_online": (0.95, 1.15),
    "vqf_basic": (1.0, 1.3),
    "madgwick": (2.1, 2.4),
    "madgwick_tuned": (2.0, 2.3),
    "mahony": (3.1, 3.4),
    "mahony_tuned": (3.1, 3.5),
    "ahrs_ekf": (0.9, 1.1),
    "ahrs_ekf_tuned": (0.8, 1.0),
}


@pytest.mark.parametrize("name", PEERS)
def test_accuracy_and_a_turned_world(name):
    """Sensors of one motion, turned 100 degrees about the vertical with the field: same error.

    A frame that is right only where the motion begins would show.
    """
    synthetic = read_record(bundled("synthetic_60s"))
    low, high = BOUNDS[name]
    assert low < attitude_rmse(run_peer(name, synthetic), NineAxis.of(synthetic).q).total < high
    log = NineAxis.of(synthetic_log(seconds=10, rate_hz=50, seed=4))
    turn = np.array([np.cos(np.radians(50)), 0.0, 0.0, np.sin(np.radians(50))])
    heading = np.radians(100.0)
    field = (27.9 * np.sin(heading), 27.9 * np.cos(heading), -46.2)
    other = synthetic_log(seconds=10, rate_hz=50, seed=4, field_ut=field)
    # In axes turned so that its field is to the north, the other log's attitude is turn * q.
    truth = quaternion_multiply(turn, log.q)
    turned = dataclasses.replace(NineAxis.of(other), q=truth).record()
    error = attitude_error(run_peer(name, turned)[250:], truth[250:])
    assert np.median(error.total) < 6.0


def test_start_is_the_full_attitude():
    log = NineAxis.of(synthetic_log(seconds=2, rate_hz=50, seed=3))
    assert attitude_error(first_attitude(log), log.q[0]).total < 1e-6
    late = np.arange(len(log)) >= 5
    held = dataclasses.replace(log, mag=np.where(late[:, None], log.mag, np.nan))
    assert attitude_error(first_attitude(held), log.q[0]).total < 20.0
    with pytest.raises(InputError, match=r"wanted magnetometer samples, found none"):
        first_attitude(dataclasses.replace(log, mag=np.full((len(log), 3), np.nan)))
    for held in (log, dataclasses.replace(log, q=None)):
        assert np.degrees(dip_rad(held)) == pytest.approx(58.87, abs=0.05)
    # The reference, where there is one, does not mind linear acceleration.
    pushed = dataclasses.replace(log, acc=log.acc + [8.0, 0.0, 0.0])
    assert np.degrees(dip_rad(pushed)) == pytest.approx(58.87, abs=0.05)
    assert abs(np.degrees(dip_rad(dataclasses.replace(pushed, q=None))) - 58.87) > 5.0


def test_package_that_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "ahrs", None)
    with pytest.raises(ToolMissing, match=r"ahrs was not found: pip install"):
        require_peers(["madgwick"])
