"""What only `ekf_quaternion_vector` does; test_ekf_quaternion.py has what both filters do.

What it computes is in test_ekf_textbook.py.
"""

import numpy as np

from boresight.model.estimators.ekf_quaternion_vector import EkfQuaternionVector
from tests.support.compiled_float import compiled_float

LEVEL = np.array([0.01, 0.0, 0.0, 0.0, 0.0, 14.7, -40.6, 0.0, 0.0, 9.80665])
MAG = slice(4, 7)


def run(records, **params):
    out = compiled_float(EkfQuaternionVector(), records[:, :, None], params)[0]
    return {name: value[:, 0] for name, value in out.items()}


def test_an_alignment_takes_sixteen_samples_with_both_vectors() -> None:
    records = np.tile(LEVEL, (40, 1))
    records[5:12, MAG] = 0.0  # seven that do not count
    status = run(records)["status"].astype(int)
    aligning = status & 1
    assert aligning.tolist() == [1] * 23 + [0] * 17
    assert ((status >> 3 & 1).nonzero()[0] == np.arange(5, 12)).all()


def test_an_axis_with_little_noise_is_followed_and_no_other() -> None:
    """An upset of 1 deg in roll and pitch: the accelerometer's y axis tells of pitch, x of roll."""
    records = np.tile(LEVEL, (300, 1))
    angle = np.radians(1.0)
    records[100:, 7:] = 9.80665 * np.array([-np.sin(angle), np.sin(angle), np.cos(angle)])
    loud = {"mag_sd_x": 512.0, "mag_sd_y": 512.0, "mag_sd_z": 512.0, "acc_sd_z": 64.0}
    for quiet, follows, stays in (("y", "pitch", "roll"), ("x", "roll", "pitch")):
        other = "x" if quiet == "y" else "y"
        out = run(records, p0_sd=1e-3, **loud, **{f"acc_sd_{quiet}": 0.05, f"acc_sd_{other}": 64.0})
        moved = {name: abs(180.0 * out[name][-1]) for name in (follows, stays)}
        assert moved[follows] > 0.9 and moved[stays] < 0.2, (quiet, moved)
