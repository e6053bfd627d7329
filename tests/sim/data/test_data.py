"""Data sets as logs."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from boresight.model.errors import InputError
from boresight.sim.attitude.worlds.make_synthetic import synthetic_60s
from boresight.sim.data.convert_broad import broad_record, broad_trials
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from tests.support.broad import trial

# -- A trial as BROAD stores it becomes a record, and what is none is refused ---------------------


def test_a_trial_becomes_a_record(tmp_path: Path) -> None:
    held = trial()
    savemat(tmp_path / "01_slow.mat", held)
    (path,) = broad_trials(tmp_path)
    log = NineAxis.of(broad_record(path))
    assert log.name == "01_slow"
    assert log.dt == pytest.approx(7.0 / 2000.0) and log.counts.sum() == 29
    for name, key in (("gyr", "imu_gyr"), ("acc", "imu_acc"), ("mag", "imu_mag")):
        assert getattr(log, name) == pytest.approx(held[key])
    assert log.attitude == pytest.approx(held["opt_quat"], nan_ok=True)


@pytest.mark.parametrize("name", ["imu_gyr", "sampling_rate", "movement"])
def test_what_is_no_trial_is_refused(name: str, tmp_path: Path) -> None:
    held = trial()
    if name == "movement":
        held[name] = np.zeros((7, 1))
    else:
        del held[name]
    savemat(tmp_path / "a.mat", held)
    with pytest.raises(InputError, match=r"a\.mat: wanted "):
        broad_record(tmp_path / "a.mat")


def test_no_trial_at_all(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"BROAD's \.mat files"):
        broad_trials(tmp_path)


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
            err_msg="regenerate with: python -m boresight.sim.attitude.worlds.make_synthetic "
            "sim/data/synthetic_60s.csv",
        )


def test_documented_content() -> None:
    log = NineAxis.of(read_record(bundled("synthetic_60s")))
    assert len(log) == 6000
    np.testing.assert_array_equal(np.flatnonzero(log.mag_new), np.arange(0, 6000, 10))
