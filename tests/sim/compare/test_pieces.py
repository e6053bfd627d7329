"""A check in pieces: the same texts and figures whatever they are."""

from __future__ import annotations

import re
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.model.attitude import ESTIMATORS, estimator
from boresight.sim.compare import check as module
from boresight.sim.compare.check import Check
from boresight.sim.compare.results import CheckResult
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CModel
from boresight.sim.records import files as logs
from boresight.sim.records.feed import feed, fitted
from boresight.sim.records.files import Log, bundled, content_of, read_record
from boresight.sim.records.record import Record

WALK = read_record(bundled("ximu_walk"))


def said(results: Sequence[CheckResult]) -> str:
    """All that is said of them, but the time."""
    out = []
    for result in results:
        data: Any = result.to_json()
        for level in data["verification"]:
            level.pop("seconds")
        lines = [re.sub(r" +[0-9.]+ s$", "", x, flags=re.M) for x in result.lines()]
        out.append(f"{data}\n{lines}")
    return "\n".join(out)


def of_pieces(build: Build, log: Log | Record, sizes: Sequence[int], **options: Any) -> set[str]:
    """What is said, with pieces of so many rows."""
    check = Check(build, **{"levels": ("fixed", "c"), **options})
    return {said(check.run(log, rows=rows)) for rows in sizes}


@pytest.mark.parametrize("name", ESTIMATORS)
def test_every_filter(name: str) -> None:
    build = Build(fitted(estimator(name), WALK))
    assert len(of_pieces(build, WALK.head(60), (7, 1_000_000))) == 1


@pytest.mark.parametrize("word", [32, 18])
def test_a_log_that_is_read_in_pieces(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, word: int
) -> None:
    """From a file, in memory, whole: also where a cause is looked for, and what is kept."""
    file = tmp_path / "ximu_walk.parquet"
    record = replace(WALK.head(120), comparison=False)  # which the file cannot hold
    file.write_bytes(content_of(file, record))
    build = Build(estimator("complementary"), word=word)
    (whole,) = of_pieces(build, record, (1 << 16,))
    monkeypatch.setattr(module, "KEPT", 64)
    monkeypatch.setattr(logs, "_MEMORY_LIMIT", 0)
    log = Log.of(file)
    assert log.data == file
    assert of_pieces(build, log, (1, 7, 80)) == of_pieces(build, record, (80,)) == {whole}
    check = Check(build, levels=("c",))
    (short,) = check.run(log)
    assert (len(short.given), len(short.fixed.outputs["roll"])) == (64, 64)
    assert sum(len(part.floating.outputs["roll"]) for part in short.parts()) == 120


@pytest.mark.parametrize("name", ["complementary", "complementary,ma2014_cf"])
def test_blocks_are_released(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """Of a long log the first and a few others are held, however many there are."""
    monkeypatch.setattr(module, "KEPT", 64)
    whole, seen = Log.blocks, list[weakref.ref[Record]]()

    def blocks(self: Log, rows: int) -> Iterator[Record]:
        for block in whole(self, rows):
            seen.append(weakref.ref(block))
            assert sum(ref() is not None for ref in seen) <= 4
            yield block

    monkeypatch.setattr(Log, "blocks", blocks)
    build = Build(*(fitted(estimator(n), WALK) for n in name.split(",")))
    Check(build, levels=("c",)).run(WALK.head(640))
    assert len(seen) == 10


def test_a_difference_in_a_later_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    """Row and states before it are those of the whole log."""
    build, record = Build(estimator("complementary")), WALK.head(120)
    wrong = feed(build.estimators[0], record).words(build.programs[0])[90]
    whole = CModel._updates

    def updates(self: CModel, inputs: Any, **options: Any) -> Any:
        made = whole(self, inputs, **options)
        made[0][(np.asarray(inputs) == wrong).all(axis=1), 0] ^= 1
        return made

    monkeypatch.setattr(CModel, "_updates", updates)
    texts = of_pieces(build, record, (7, 50, 1000), levels=("c",))
    monkeypatch.setattr(module, "KEPT", 64)
    texts |= of_pieces(build, record, (7, 50), levels=("c",))
    assert len(texts) == 1 and "'first_wrong': 90" in texts.pop()
