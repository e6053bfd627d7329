"""What a record becomes at the sensors, and the way back that gives the same attitude."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.system.programs import system_estimators
from boresight.model.errors import InputError
from boresight.model.estimators import FILTERS
from boresight.sim.board.chain import COUNTS, HEADING, NO_LINE, run_chain
from boresight.sim.board.front import quantise, words_as_record
from boresight.sim.levels.level import outputs_of
from boresight.sim.records.bundled import bundled
from boresight.sim.records.files import read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.verbs.run import run
from tests.support.records import write_record

STEPS = 600


@pytest.fixture(scope="module")
def programs() -> list:
    return [e.compile() for e in system_estimators(FILTERS)]


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
    given = quantise(
        log.record(), kind=COUNTS if number % 2 else HEADING, number=number, line_hz=30.0
    )
    given.restart[[200, 201, 350]] = True
    stamp = given.stamp + np.where(np.arange(STEPS) >= 420, 2**27, 0)  # a gap
    chain = run_chain(programs, replace(given, stamp=stamp % 2**32))
    assert np.flatnonzero(chain.restart).tolist() == [0, 200, 201, 350, 420]
    path = tmp_path / "words.npz"
    write_record(path, words_as_record(programs[number], chain))
    result = run(name, path, on="fixed")
    assert result.attitude is not None
    out = outputs_of(programs[number], chain.outputs)
    assert (result.attitude.q == np.stack([out[f"q{a}"] for a in "wxyz"], axis=1)).all()
    assert (result.attitude.euler_deg[:, 0] == 180.0 * out["heading"]).all()
    assert (result.attitude.status == np.rint(out["status"])).all()
