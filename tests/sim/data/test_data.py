"""The bundled logs."""

import numpy as np

from boresight.sim.attitude.worlds import synthetic_60s
from boresight.sim.records.files import bundled, read_record
from boresight.sim.records.nine_axis import NineAxis

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
