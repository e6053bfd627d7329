"""Records for the plain bench: from the log where it fits, within the ranges where not."""

from __future__ import annotations

import numpy as np

from boresight.model.estimators import estimator
from boresight.sim.levels.build import Build
from boresight.sim.levels.vectors import recorded
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from tests.support.linked import Inner, Middle, Models
from tests.support.track import Track


def test_wandering() -> None:
    build = Build(Track(), restarts=0)
    (run,) = recorded(build)
    program = build.programs[0]
    assert run.inputs.shape == (60, 4) and run.outputs.shape == (60, 3)
    for words, number in zip(run.inputs.T, program.streamed, strict=True):
        low, high = (program.format(number).quantise(x) for x in (
            program.values[number].low, program.values[number].high))  # fmt: skip
        assert ((low <= words) & (words <= high)).all() and len(set(words)) > 1
        step = (high - low) // 8
        kind = program.values[number].name
        if kind in ("dt", "w"):
            assert (np.abs(np.diff(words)) <= step).all() and np.ptp(words) > 2 * step
        elif kind == "seen":
            assert set(words) == {low, high}
        else:
            assert 2 <= np.count_nonzero(words == low) <= 20  # what says "no sample"
    (again,) = recorded(Build(Track(), restarts=0))
    assert (again.inputs == run.inputs).all() and (again.outputs == run.outputs).all()
    assert run.saturated.any() and not run.saturated.all()


def test_from_the_log() -> None:
    build = Build(estimator("complementary"), restarts=0)
    (run,) = recorded(build)
    columns = feed(build.estimators[0], read_record(bundled("synthetic_60s")))
    count = len(run.inputs)
    assert run.source == f"synthetic_60s, samples 4000 to {3999 + count}"
    assert (run.inputs == columns.words(build.programs[0])[4000 : 4000 + count]).all()
    assert count == 10_000 // build.core.schedule.interval
    assert np.ptp(run.inputs[:, 1]) > 0 and (run.inputs[:, 4] != 0).any()


def test_linked_programs_read_the_last_update_of_the_other() -> None:
    build = Build(Middle(), Inner(), restarts=0)
    runs = recorded(build)
    assert [run.number for run in runs] == [1, 0]
    models = Models(build.core)
    for run in runs:
        for words, wanted in zip(run.inputs, run.outputs, strict=True):
            assert models.update(run.number, words.tolist()) == wanted.tolist()
