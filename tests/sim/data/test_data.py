"""Data sets as logs."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from boresight.sim.attitude.worlds import synthetic_60s
from boresight.sim.data.convert_broad import convert
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis


def test_a_trial_of_broad_becomes_a_log(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    vectors = {f"imu_{n}": rng.standard_normal((40, 3)) for n in ("gyr", "acc", "mag")}
    held = {**vectors, "opt_quat": np.full((40, 4), 0.5), "movement": np.arange(40)[:, None] > 10}
    savemat(tmp_path / "a.mat", {**held, "sampling_rate": 2000.0 / 7.0})
    convert(tmp_path / "a.mat", tmp_path / "a.npz")
    log = NineAxis.of(read_record(tmp_path / "a.npz"))
    assert log.dt == pytest.approx(7.0 / 2000.0) and log.counts.sum() == 29
    for name, values in vectors.items():
        assert getattr(log, name.removeprefix("imu_")) == pytest.approx(values)
    assert log.attitude == pytest.approx(0.5)


ARRAYS = ("t", "gyr", "acc", "mag", "mag_new", "q")


def test_bundled_file_is_up_to_date() -> None:
    new = NineAxis.of(synthetic_60s())
    old = NineAxis.of(read_record(bundled("synthetic_60s")))
    for key in ARRAYS:
        # sines differ in the last place between mathematics libraries
        np.testing.assert_allclose(
            getattr(old, key),
            getattr(new, key),
            rtol=0,
            atol=1e-11,
            err_msg="write it again: FILE.write_bytes(content_of(FILE.name, synthetic_60s()))",
        )


def test_documented_content() -> None:
    log = NineAxis.of(read_record(bundled("synthetic_60s")))
    assert len(log) == 6000
    np.testing.assert_array_equal(np.flatnonzero(log.mag_new), np.arange(0, 6000, 10))
