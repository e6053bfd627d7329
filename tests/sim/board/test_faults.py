"""Faults on the complete board: seen, survived, gone. `boresight simulate --faults` has all."""

import pytest

from boresight.sim.board.faults import (
    COMPASS_FAULTS,
    INERTIAL_FAULTS,
    FaultTrial,
    fault_board,
    fault_names,
    fault_trial,
)


@pytest.fixture(scope="module")
def board():
    """16 times as fast as the real one."""
    return fault_board(restarts=1)


@pytest.mark.parametrize(
    "device, fault, updates, span, event, within_s, worst_deg",
    [
        ("adis", "absent", 1900, (1200, 1400), "inertial_no_data_ready", 0.01, 4.0),
        ("adis", "bit_flips", 1900, (1200, 1400), "inertial_config_error", 0.01, 4.0),
        ("hmr", "silence", 1750, (6, 10), "compass_went_stale", 0.7, 2.0),
        ("adis", "force_saturated", 1900, (1200, 1400), None, None, 10.0),
    ],
)
def test_fault(
    board,
    device: str,
    fault: str,
    updates: int,
    span: tuple[int, int],
    event: str | None,
    within_s: float | None,
    worst_deg: float,
) -> None:
    trial = fault_trial(board, device, fault, updates=updates, span=span)
    assert trial.good, trial
    if event is None:
        assert trial.unseen and trial.seen_after_s is None and trial.dropped == 0
        assert 0.19 < trial.fault_s < 0.2 and trial.during_deg > 1.2 * trial.before_deg
    else:
        assert event in trial.seen_as and trial.seen_after_s < within_s
        assert (trial.dropped > 150) == (device == "adis")
    assert trial.before_deg < 1.5 and trial.during_deg < worst_deg and trial.after_deg < 1.5


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
