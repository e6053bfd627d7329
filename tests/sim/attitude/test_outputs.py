"""Outputs of attitude filters by name, put together."""

import numpy as np

from boresight.sim.attitude.outputs import attitude_of, euler_deg_of, status_of

OUTPUTS = {
    **{name: np.array([k, k + 0.5]) for k, name in enumerate(("qz", "qy", "qx", "qw"))},
    "pitch": np.array([0.25, -0.5]),
    "roll": np.array([0.1, 0.2]),
    "heading": np.array([-1.0, 0.5]),
    "status": np.array([2.9999, 32.0001]),
}


def test_scalar_first() -> None:
    np.testing.assert_array_equal(attitude_of(OUTPUTS), [[3, 2, 1, 0], [3.5, 2.5, 1.5, 0.5]])


def test_heading_first_in_degrees() -> None:
    np.testing.assert_allclose(euler_deg_of(OUTPUTS), [[-180, 45, 18], [90, -90, 36]])


def test_status_words_are_whole() -> None:
    status = status_of(OUTPUTS)
    assert status.tolist() == [3, 32] and status.dtype == np.int64
