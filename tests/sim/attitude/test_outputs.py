"""Outputs as attitudes, angles and status words."""

import numpy as np

from boresight.sim.attitude.outputs import attitude_of, euler_deg_of, status_of

OUTPUTS = {
    "pitch": np.array([0.25, -0.5]),
    "heading": np.array([1.0, -1.0]),
    "roll": np.array([0.125, 0.0]),
    "qz": np.array([4.0, 8.0]),
    "qw": np.array([1.0, 5.0]),
    "qy": np.array([3.0, 7.0]),
    "qx": np.array([2.0, 6.0]),
    "status": np.array([3.0000001, 1023.9999]),
}


def test_by_hand() -> None:
    assert attitude_of(OUTPUTS).tolist() == [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0]]
    assert euler_deg_of(OUTPUTS).tolist() == [[180.0, 45.0, 22.5], [-180.0, -90.0, 0.0]]
    assert status_of(OUTPUTS).tolist() == [3, 1024] and status_of(OUTPUTS).dtype == np.int64
    one = {name: values[0] for name, values in OUTPUTS.items()}
    assert attitude_of(one).shape == (4,)
