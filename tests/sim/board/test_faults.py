"""Faults on the complete board: seen, survived, gone. `boresight simulate --faults` has all."""

import pytest

from boresight.sim.board.faults import (
    COMPASS_FAULTS,
    INERTIAL_FAULTS,
    FaultTrial,
    fault_names,
    faults_in_turn,
)
from tests.support.board.shared import shared_board

#: Device, fault, span; the events that tell of it, how soon; whether samples are lost.
TRIALS = (
    ("adis", "force_saturated", (790, 890), ("inertial_over_range",), 0.01, False),
    ("adis", "absent", (1410, 1560), ("inertial_no_data_ready", "inertial_restart"), 0.01, True),
    ("adis", "bit_flips", (2263, 2400), ("inertial_config_error", "inertial_restart"), 0.01, True),
    ("hmr", "silence", (22, 26), ("compass_went_stale",), 0.7, False),
)


def test_faults_in_turn() -> None:
    found = faults_in_turn(shared_board(), [row[:3] for row in TRIALS], updates=3050)
    for trial, (device, fault, _, events, within_s, loses) in zip(found, TRIALS, strict=True):
        assert (trial.device, trial.fault) == (device, fault) and trial.good, trial
        assert trial.seen_as == events and trial.seen_after_s < within_s, trial
        assert (trial.dropped > 150) == loses and (loses or trial.dropped == 0), trial
        assert max(trial.before_deg, trial.during_deg, trial.after_deg) < 1.5, trial


def test_all_faults_are_known() -> None:
    assert len(set(INERTIAL_FAULTS)) == 13 and len(set(COMPASS_FAULTS)) == 12
    assert len(set(fault_names())) == 27


@pytest.mark.parametrize(
    "changes, harmless, good",
    [
        ({}, True, True),
        ({"dropped": 1}, False, False),
        ({"during_deg": 1.3}, False, False),
        ({"seen_after_s": 0.1}, False, True),
        ({"seen_after_s": 0.1, "back_after_s": None}, False, False),
        ({"seen_after_s": 0.1, "after_deg": 2.1}, False, False),
        ({"seen_after_s": 0.1, "before_deg": 1.5, "after_deg": 2.1}, False, False),
        ({"seen_after_s": 0.1, "during_deg": 10.1}, False, False),
        ({"during_deg": 1.3, "device": "adis", "fault": "force_stuck"}, False, True),
    ],
)
def test_what_counts_as_good(changes: dict, harmless: bool, good: bool) -> None:
    values = {
        "seen_after_s": None,
        "seen_as": (),
        "dropped": 0,
        "before_deg": 1.0,
        "during_deg": 1.1,
        "after_deg": 1.0,
        "back_after_s": 0.01,
        **changes,
    }
    trial = FaultTrial(**{"device": "hmr", "fault": "glitches", "fault_s": 0.9, **values})
    assert (trial.harmless, trial.good) == (harmless, good)
