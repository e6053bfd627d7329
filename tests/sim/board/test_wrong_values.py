"""Values that are wrong in good form: which rows, and by how much."""

import numpy as np
import pytest

from boresight.sim.board.faults import trial_log
from boresight.sim.board.wrong_values import WRONG_VALUES, wronged
from boresight.sim.records.nine_axis import NineAxis


@pytest.mark.parametrize("device, fault", [(d, f) for d, of in WRONG_VALUES.items() for f in of])
def test_only_these_rows_of_this_sensor(device: str, fault: str) -> None:
    log = trial_log()
    before, after = NineAxis.of(log), NineAxis.of(wronged(log, device, fault, slice(100, 140)))
    changed = np.flatnonzero((before.acc != after.acc).any(axis=1))
    turned = np.flatnonzero((before.mag != after.mag).any(axis=1))
    mine, other = (changed, turned) if device == "adis" else (turned, changed)
    assert set(mine) <= set(range(100, 140)) and len(mine) >= 39 and not len(other)
    assert (before.gyr == after.gyr).all()


def test_how_wrong() -> None:
    log = trial_log()
    of = {
        f: NineAxis.of(wronged(log, d, f, slice(5, 9)))
        for d in WRONG_VALUES
        for f in WRONG_VALUES[d]
    }
    assert (of["force_stuck"].acc[5:9] == NineAxis.of(log).acc[5]).all()
    assert of["force_saturated"].acc[5:9, 0] == pytest.approx(49.03, abs=0.01)
    more = np.linalg.norm(of["strong_field"].mag[5:9] - NineAxis.of(log).mag[5:9], axis=1)
    assert more == pytest.approx(3.0 * np.linalg.norm(NineAxis.of(log).mag[0]), rel=0.02)
