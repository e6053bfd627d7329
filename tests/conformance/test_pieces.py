"""A log in pieces: the same bytes of C and interpreter, of every filter, system and example."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boresight
from boresight.model.resolve import estimator_of
from boresight.sim.fit.observe import hostile
from boresight.sim.records.files import content_of
from boresight.sim.records.record import Record
from tests.support.estimators import ALL
from tests.support.tree import ROOT

EXAMPLES = [
    f"{ROOT}/examples/{name}"
    for name in ("biquad.py", "kalman.py", "madgwick.py", "pendulum.py", "pi.py:Pi")
]


@pytest.mark.parametrize("named", [*ALL, *EXAMPLES], ids=lambda x: str(x)[-24:])
def test_the_same_bytes(named: Any, tmp_path: Path, monkeypatch: Any) -> None:
    """Whatever the length of the pieces, also where samples are missing."""
    estimator = estimator_of(named)
    monkeypatch.setattr(estimator, "compile_traced", cache(estimator.compile_traced))
    stimuli = hostile(estimator, 60, np.random.default_rng(1))
    inputs = stimuli.get("gaps", next(iter(stimuli.values())))
    flags = {i.name for i in estimator.inputs if i.flags}
    columns = {i.name: inputs[:, k] for k, i in enumerate(estimator.inputs) if i.name not in flags}
    if rate := estimator.rates_hz.get("dt"):
        columns["dt"] = np.full(60, 1.0 / rate)
    log = tmp_path / "log.csv"
    log.write_bytes(content_of(log, Record.of(columns)))
    written = set()
    runs = ((1, "c"), (7, "c"), (1000, "c"), (None, "fixed"))
    # A last piece that is shorter: of the examples alone.
    for rows, level in runs if named in EXAMPLES else (runs[0], *runs[2:]):
        out = tmp_path / f"out{rows}.csv"
        boresight.run(estimator, log, levels=level, output=out, rows=rows)
        written.add(out.read_bytes())
    assert len(written) == 1 and written.pop().count(b"\n") == 61
