"""The board's integer model: values of the devices, and the attitude that they give.

The model is compared with the hardware, word by word, in `tests.gateware.attitude.system`.
"""

from dataclasses import replace

import numpy as np
import pytest

from boresight.gateware.attitude.system.programs import system_estimators
from boresight.model.attitude import FILTERS
from boresight.model.errors import InputError
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, run_chain
from boresight.sim.levels.build import outputs_of
from boresight.sim.records.files import bundled, read_record
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from tests.support.attitude.quantise import quantise

STEPS = 600


@pytest.fixture(scope="module")
def programs() -> list:
    return [e.compile() for e in system_estimators(FILTERS)]


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
