"""The chain in integers, sample by sample: who keeps what, and when a line counts."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.system.programs import system_estimators
from boresight.model.estimators.nine_axis import INPUTS
from boresight.sim.board.chain import COUNTS, HEADING, Samples, run_chain

RECORD = tuple(i.name for i in INPUTS)


@pytest.fixture(scope="module")
def programs() -> list:
    return [e.compile() for e in system_estimators()]


def samples(n: int, **changes) -> Samples:
    """Nothing but time goes on."""
    zeros = np.zeros(n, dtype=np.int64)
    plain = Samples(
        stamp=np.arange(n) * 97656,
        counts=np.zeros((n, 6), dtype=np.int64),
        line=zeros,
        values=np.zeros((n, 3), dtype=np.int64),
        restart=np.arange(n) == 0,
        filter=zeros,
    )
    return replace(plain, **changes)


def test_filters_in_turns_keep_their_states(programs) -> None:
    """Every filter gives what it gives on its own updates alone; a change restarts it."""
    rng = np.random.default_rng(1)
    counts = rng.integers(-500, 500, (600, 6)) + [0, 0, 0, 0, 0, 4000]
    chain = run_chain(programs, samples(600, counts=counts, filter=np.arange(600) // 50 % 4))
    assert np.flatnonzero(chain.restart).tolist() == list(range(0, 600, 50))
    rows = np.arange(600) // 50 % 4 == 2
    dt = chain.records[rows, RECORD.index("dt")]
    assert (dt < 0).sum() == rows.sum() // 50
    assert len(np.unique(chain.outputs[rows], axis=0)) > 100


def test_a_line_is_fresh_for_its_update_only(programs) -> None:
    n = 6
    values = np.zeros((n, 3), dtype=np.int64)
    values[2], values[4] = (900, 0, 0), (100, -200, 300)
    given = samples(n, line=np.array([0, 0, HEADING, 0, COUNTS, 0]), values=values)
    field = run_chain(programs, given).records[:, 4:7] / 2.0**23
    assert (field[[0, 1, 3, 5]] == 0).all()
    # A compass that points east: the field, which points north, is to the left, along -x.
    assert np.abs(field[2] - [-30.0, 0.0, 0.0]).max() < 1e-4
    assert np.abs(field[4] - np.array([100, -200, 300]) / 45).max() < 1e-4


def test_a_gap_or_a_new_filter_restarts(programs) -> None:
    stamp = np.arange(6) * 97656 + np.where(np.arange(6) >= 4, 2**27, 0)
    chain = run_chain(programs, samples(6, stamp=stamp, filter=np.array([0, 0, 1, 1, 1, 1])))
    assert np.flatnonzero(chain.restart).tolist() == [0, 2, 4]
    assert len(samples(6)) == 6


def test_words_of_a_record_are_the_calibrated_ones(programs) -> None:
    """One count of each axis in turn: its own word changes and no other."""
    counts = np.concatenate([np.zeros((1, 6), dtype=np.int64), 100 * np.eye(6, dtype=np.int64)])
    records = run_chain(programs, samples(7, counts=counts)).records
    columns = [RECORD.index(f"{s}{a}") for s in "ga" for a in "xyz"]
    changed = records[1:, columns] != records[0, columns]
    np.testing.assert_array_equal(changed, np.eye(6, dtype=bool))
    assert (records[1:, RECORD.index("dt")] > 0).all() and records[0, RECORD.index("dt")] < 0
