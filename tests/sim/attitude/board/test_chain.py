"""The board's integer model: devices' values, spans, times."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.attitude.system.programs import system_estimators
from boresight.model.attitude import FILTERS
from boresight.model.errors import InputError
from boresight.model.nine_axis import INPUTS
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Samples, run_chain
from boresight.sim.attitude.board.front import quantise, words_as_record
from boresight.sim.levels.level import outputs_of
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.verbs.run import run
from tests.support.attitude.board.shared import odd_board
from tests.support.records import write_record

# -- the chain in integers: in turns, fresh lines, and any estimators against the board -----------

STEPS = 600
RECORD = tuple(i.name for i in INPUTS)


@pytest.fixture(scope="module")
def board():
    return odd_board()


def samples(n: int, **more) -> Samples:
    rng = np.random.default_rng(2)
    line = np.full(n, NO_LINE)
    line[[3, 7]] = COUNTS
    stimulus = {
        "stamp": np.arange(n) * 100_000,
        "counts": rng.integers(-2000, 2000, (n, 6)),
        "line": line,
        "values": rng.integers(100, 3000, (n, 3)),
        "restart": np.arange(n) == 0,
        "filter": np.zeros(n, dtype=np.int64),
    }
    return Samples(**{**stimulus, **more})


def test_a_set_of_registers_comes_with_an_update(board) -> None:
    programs = [part.program for part in board.core.parts]
    chain = run_chain(programs, samples(10, feed={"target": 1 << 28}, new_feed=4))
    names = [programs[0].values[n].name for n in programs[0].inputs]
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
    stimulus = quantise(read_record(bundled("synthetic_60s")).head(STEPS), kind=COUNTS)
    turns = replace(stimulus, filter=np.arange(STEPS) // 50 % 4)
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
    stimulus = Samples(
        np.arange(n) * 97656,
        np.zeros((n, 6), dtype=np.int64),
        np.array([0, 0, HEADING, 0, COUNTS, 0]),
        values,
        np.arange(n) == 0,
        np.zeros(n, dtype=np.int64),
    )
    field = run_chain(programs, stimulus).records[:, 4:7] / 2.0**23
    assert (field[[0, 1, 3, 5]] == 0).all()
    # A compass that points east: the field, which points north, is to the left, along -x.
    assert np.abs(field[2] - [-30.0, 0.0, 0.0]).max() < 1e-4
    assert np.abs(field[4] - np.array([100, -200, 300]) / 45).max() < 1e-4


# -- what a record becomes at the sensors, and the way back that gives the same attitude ----------


@pytest.fixture(scope="module")
def record() -> Record:
    return read_record(bundled("synthetic_60s")).head(STEPS)


@pytest.fixture(scope="module")
def log(record) -> NineAxis:
    return NineAxis.of(record)


def test_a_record_as_raw_counts(log) -> None:
    s = quantise(log.record(), kind=COUNTS, line_hz=8.0)
    assert len(s) == STEPS
    assert np.abs(s.counts[:, :3] * np.radians(0.0125) - log.gyr).max() <= np.radians(0.0063)
    assert np.abs(s.counts[:, 3:] * 0.25e-3 * 9.80665 - log.acc).max() <= 0.00123
    assert np.abs(s.stamp / 100e6 - (log.t - log.t[0])).max() <= 0.6e-8
    assert s.restart.tolist() == [True] + [False] * (STEPS - 1)
    seconds = log.t[-1] - log.t[0]
    assert 0 < np.count_nonzero(s.line) <= 8 * seconds + 1
    rows = s.line == COUNTS
    assert np.abs(s.values[rows] / 45 - log.mag[rows]).max() < 0.0112


def test_full_scale_is_the_sensor_s(log) -> None:
    wild = replace(log, gyr=log.gyr + 100.0, acc=log.acc - 1000.0)
    s = quantise(wild.record(), kind=NO_LINE)
    assert (s.counts[:, :3] == 24000).all()
    assert (s.counts[:, 3:] == -20000).all()
    assert not s.line.any()


def test_headings_need_a_reference(log) -> None:
    with pytest.raises(InputError, match=r"^log 'synthetic_60s': wanted a reference attitude"):
        quantise(replace(log, q=None).record(), kind=HEADING)
    s = quantise(log.record(), kind=HEADING)
    rows = s.line == HEADING
    assert rows.any()
    assert s.values[rows, 0].min() >= 0
    assert s.values[rows, 0].max() < 3600


@pytest.mark.parametrize("kind", [COUNTS, HEADING])
def test_the_chain_follows_the_reference(programs, log, kind: int) -> None:
    """Raw counts in, attitude out near the truth: units, signs and axes are right all the way."""
    chain = run_chain(programs, quantise(log.record(), kind=kind, line_hz=50.0))
    out = outputs_of(programs[0], chain.outputs)
    q = np.stack([out[f"q{a}"] for a in "wxyz"], axis=1)[-100:]
    off = 2 * np.degrees(np.arccos(np.clip(np.abs((q * log.q[-100:]).sum(axis=1)), 0, 1)))
    assert off.max() < (3.5 if kind == COUNTS else 1.5)  # deg; the recording's own field errs


@pytest.mark.parametrize("number, name", list(enumerate(FILTERS)))
def test_boresight_run_gives_the_same_words(
    number: int, name: str, programs, log, tmp_path
) -> None:
    """The calibrated words as an SI log, through the command line's own way: bit for bit."""
    stimulus = quantise(
        log.record(), kind=COUNTS if number % 2 else HEADING, number=number, line_hz=30.0
    )
    stimulus.restart[[200, 201, 350]] = True
    stamp = stimulus.stamp + np.where(np.arange(STEPS) >= 420, 2**27, 0)  # a gap
    chain = run_chain(programs, replace(stimulus, stamp=stamp % 2**32))
    assert np.flatnonzero(chain.restart).tolist() == [0, 200, 201, 350, 420]
    path = tmp_path / "words.npz"
    write_record(path, words_as_record(programs[number], chain))
    result = run(name, path, levels="fixed")
    for output, values in outputs_of(programs[number], chain.outputs).items():
        assert (result["outputs"][output] == values).all(), output
