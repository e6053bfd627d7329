"""`sim.data.make_synthetic`: the bundled file is what the code makes today."""

from pathlib import Path

import numpy as np
import pytest

from boresight.sim.data.make_synthetic import main
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis

ARRAYS = ("t", "gyr", "acc", "mag", "mag_new", "q")


def test_bundled_file_is_up_to_date(tmp_path: Path) -> None:
    assert main([str(tmp_path / "new.csv")]) == 0
    new, old = (
        NineAxis.of(read_record(path)) for path in (tmp_path / "new.csv", bundled("synthetic_60s"))
    )
    for key in ARRAYS:
        # sines differ in the last place between mathematics libraries
        np.testing.assert_allclose(
            getattr(old, key),
            getattr(new, key),
            rtol=0,
            atol=1e-11,
            err_msg="regenerate with: python -m boresight.sim.data.make_synthetic "
            "sim/data/synthetic_60s.csv",
        )


def test_documented_content() -> None:
    log = NineAxis.of(read_record(bundled("synthetic_60s")))
    assert len(log) == 6000
    np.testing.assert_array_equal(np.flatnonzero(log.mag_new), np.arange(0, 6000, 10))


def test_faults_exit_with_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert (
        capsys.readouterr().err
        == "error: usage: python -m boresight.sim.data.make_synthetic OUT.csv\n"
    )
    assert main([""]) == 2
    assert capsys.readouterr().err.startswith("error: ")
