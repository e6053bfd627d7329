"""Long files are read in parts, as often as wanted: the figures are those of logs in memory."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import boresight
from boresight.model.settings import using
from boresight.sim.attitude.worlds import synthetic_log, white
from boresight.sim.records import feed, files
from boresight.sim.records.files import content_of
from boresight.sim.records.selection import Selection


def figures(folder: Path) -> list[Any]:
    """Of two logs from their first second on, without the seconds that it took."""
    with using(rows=Selection.of(start="1s")):
        errors = boresight.accuracy("complementary", folder, align="heading", jobs=2).to_json()
        tuned = boresight.tune(
            "complementary", folder, names=["kp_heading_per_s"], rounds=1, folds=2, jobs=2
        ).to_json()
    return [errors, tuned]


def test_accuracy_and_tune_hold_no_long_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for seed, name in ((1, "a.csv"), (2, "b.parquet")):
        made = synthetic_log(seconds=5, rate_hz=50, seed=seed, mag_error=white(2.0))
        (tmp_path / name).write_bytes(content_of(name, made))
    monkeypatch.setattr(feed, "ROWS", 70)
    held = figures(tmp_path)
    assert [each["samples"] for each in held[0]["logs"]] == [200, 200]
    most = list[int]()
    monkeypatch.setattr(files, "_MEMORY_LIMIT", 0)
    take = feed.Feeder.take
    monkeypatch.setattr(
        feed.Feeder, "take", lambda self, record: most.append(len(record)) or take(self, record)
    )
    assert figures(tmp_path) == held
    assert max(most) == 70 and len(most) > 30
