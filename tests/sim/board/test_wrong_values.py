"""Values that are wrong in good form: which rows, and by how much."""

import numpy as np
import pytest

from boresight.sim.board.faults import trial_log
from boresight.sim.board.wrong_values import WRONG_VALUES, wronged
from boresight.sim.records.nine_axis import NineAxis


def test_only_these_rows_of_the_force_and_how_wrong() -> None:
    log = NineAxis.of(trial_log())
    assert set(WRONG_VALUES) == {"force_stuck", "force_saturated"}
    for fault in WRONG_VALUES:
        after = NineAxis.of(wronged(log.record(), fault, slice(100, 140)))
        changed = np.flatnonzero((log.acc != after.acc).any(axis=1))
        assert set(changed) <= set(range(100, 140)) and len(changed) >= 39
        assert (log.mag == after.mag).all() and (log.gyr == after.gyr).all()
        if fault == "force_stuck":
            assert (after.acc[100:140] == log.acc[100]).all()
        else:
            assert after.acc[100:140, 0] == pytest.approx(49.03, abs=0.01)
            assert (after.acc[:, 1:] == log.acc[:, 1:]).all()
