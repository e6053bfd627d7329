"""`sim.accuracy.runs`: published filters in our frames, on the bundled log with exact truth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from boresight.sim.accuracy.runs import PEERS, run_peer
from boresight.sim.attitude.worlds import synthetic_log
from boresight.sim.records.files import bundled, read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.accuracy import attitude_error
from boresight.sim.rotations.rotation import quaternion_multiply
from tests.support.rmse import attitude_rmse

#: Total RMSE [deg] on synthetic_60s, magnetometer at 10 Hz: both bounds. A wrong frame gives 90 or
#: 180 degrees, a wrong step of the magnetometer tens.
BOUNDS = {"vqf_online": (0.95, 1.15), "vqf_basic": (1.0, 1.3)}


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
