"""A trial as BROAD stores it becomes a log, and what is none is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from boresight.sim.data.convert_broad import main
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis


def trial(rows: int = 40) -> dict[str, object]:
    rng = np.random.default_rng(1)
    q = rng.standard_normal((rows, 4))
    q[3] = np.nan
    return {
        "imu_gyr": rng.standard_normal((rows, 3)),
        "imu_acc": rng.standard_normal((rows, 3)),
        "imu_mag": rng.standard_normal((rows, 3)),
        "opt_quat": q / np.linalg.norm(q, axis=1, keepdims=True),
        "movement": np.arange(rows)[:, None] > 10,
        "sampling_rate": 2000.0 / 7.0,
    }


def test_a_trial_becomes_a_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    held = trial()
    savemat(tmp_path / "01_slow.mat", held)
    assert main([str(tmp_path), str(tmp_path / "logs")]) == 0
    log = NineAxis.of(read_record(tmp_path / "logs" / "01_slow.npz"))
    assert log.dt == pytest.approx(7.0 / 2000.0) and log.counts.sum() == 29
    for name, key in (("gyr", "imu_gyr"), ("acc", "imu_acc"), ("mag", "imu_mag")):
        assert getattr(log, name) == pytest.approx(held[key])
    assert log.attitude == pytest.approx(held["opt_quat"], nan_ok=True)
    assert "01_slow.npz" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["imu_gyr", "sampling_rate", "movement"])
def test_what_is_no_trial_is_refused(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    held = trial()
    if name == "movement":
        held[name] = np.zeros((7, 1))
    else:
        del held[name]
    savemat(tmp_path / "a.mat", held)
    assert main([str(tmp_path), str(tmp_path / "logs")]) == 2
    assert str(tmp_path / "a.mat") in capsys.readouterr().err
    assert not (tmp_path / "logs").exists()


def test_no_trial_at_all(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path), str(tmp_path)]) == main([]) == 2
    assert "BROAD's .mat files" in capsys.readouterr().err
