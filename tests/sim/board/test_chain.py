"""The chain in integers: in turns, fresh lines, and any estimators against the board."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.system.programs import system_estimators
from boresight.model.estimators import FILTERS
from boresight.model.estimators.nine_axis import INPUTS
from boresight.sim.board.chain import COUNTS, HEADING, NO_LINE, Samples, run_chain
from boresight.sim.board.front import quantise
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from tests.support.board.shared import odd_board

STEPS = 600
RECORD = tuple(i.name for i in INPUTS)


@pytest.fixture(scope="module")
def board():
    return odd_board()


def samples(n: int, **more) -> Samples:
    rng = np.random.default_rng(2)
    line = np.full(n, NO_LINE)
    line[[3, 7]] = COUNTS
    given = {
        "stamp": np.arange(n) * 100_000,
        "counts": rng.integers(-2000, 2000, (n, 6)),
        "line": line,
        "values": rng.integers(100, 3000, (n, 3)),
        "restart": np.arange(n) == 0,
        "filter": np.zeros(n, dtype=np.int64),
    }
    return Samples(**{**given, **more})


def test_a_set_of_registers_comes_with_an_update(board) -> None:
    programs = [part.program for part in board.core.parts]
    chain = run_chain(programs, samples(10, feed={"target": 1 << 28}, new_feed=4))
    names = [programs[0].values[n].name for n in programs[0].streamed]
    assert chain.records[:, names.index("target")].tolist() == [0] * 4 + [1 << 28] * 6
    assert np.flatnonzero(chain.records[:, names.index("set_new")]).tolist() == [4]
    assert np.flatnonzero(chain.records[:, names.index("mx_new")]).tolist() == [3, 7]
    held = chain.records[:, names.index("mx")]
    assert not held[:3].any() and len({*held[3:7]}) == len({*held[7:]}) == 1 and held[3] != held[7]


def test_estimators_in_turns_keep_their_own_records(board) -> None:
    programs = [part.program for part in board.core.parts]
    numbers = np.array([0, 0, 1, 1, 1, 0, 0, 1, 1, 0])
    chain = run_chain(programs, samples(10, filter=numbers))
    assert chain.records.shape == (10, 10) and chain.outputs.shape == (10, 8)
    assert not chain.records[numbers == 0, 8:].any() and not chain.outputs[numbers == 0, 6:].any()
    assert np.flatnonzero(chain.restart).tolist() == [0, 2, 5, 7, 9]


@pytest.fixture(scope="module")
def programs() -> list:
    return [e.compile() for e in system_estimators(FILTERS)]


def test_filters_in_turns_keep_their_states(programs) -> None:
    """Every filter gives what it gives on its own updates alone; a change restarts it."""
    given = quantise(read_record(bundled("synthetic_60s")).head(STEPS), kind=COUNTS)
    turns = replace(given, filter=np.arange(STEPS) // 50 % 4)
    chain = run_chain(programs, turns)
    assert np.flatnonzero(chain.restart).tolist() == list(range(0, STEPS, 50))
    rows = turns.filter == 2
    dt = chain.records[rows, RECORD.index("dt")]
    assert (dt < 0).sum() == rows.sum() // 50
    assert len(np.unique(chain.outputs[rows], axis=0)) > 100


def test_a_line_is_fresh_for_its_update_only(programs) -> None:
    n = 6
    zeros = np.zeros((n, 3), dtype=np.int64)
    values = zeros.copy()
    values[2], values[4] = (900, 0, 0), (100, -200, 300)
    given = Samples(
        np.arange(n) * 97656,
        np.zeros((n, 6), dtype=np.int64),
        np.array([0, 0, HEADING, 0, COUNTS, 0]),
        values,
        np.arange(n) == 0,
        np.zeros(n, dtype=np.int64),
    )
    field = run_chain(programs, given).records[:, 4:7] / 2.0**23
    assert (field[[0, 1, 3, 5]] == 0).all()
    # A compass that points east: the field, which points north, is to the left, along -x.
    assert np.abs(field[2] - [-30.0, 0.0, 0.0]).max() < 1e-4
    assert np.abs(field[4] - np.array([100, -200, 300]) / 45).max() < 1e-4
